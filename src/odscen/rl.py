"""Environments of Gymnasium and PettingZoo; they need ``pip install 'odscen[rl]'``.

>>> from odscen import rl
>>> environment = rl.EgoEnvironment(workspace, "cut-in.scenario.json")
>>> seen, info = environment.reset(seed=1)
"""

from odscen.app.environments.driving_tasks import progress_reward
from odscen.app.environments.ego_environment import EgoEnvironment
from odscen.app.environments.traffic_environment import TrafficEnvironment

__all__ = ["EgoEnvironment", "TrafficEnvironment", "progress_reward"]
