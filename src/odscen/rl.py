"""Environments of Gymnasium and PettingZoo; they need ``pip install 'odscen[rl]'``.

>>> from odscen import rl
>>> environment = rl.SignalEnvironment(workspace, "rush.scenario.json")
>>> seen, info = environment.reset(seed=1)
"""

from odscen.app.environments.driving_tasks import progress_reward
from odscen.app.environments.ego_environment import EgoEnvironment
from odscen.app.environments.light_tasks import light_view
from odscen.app.environments.signal_environment import SignalEnvironment, SignalsEnvironment
from odscen.app.environments.signal_training import (
    ControlledRuns,
    TrainedEpisode,
    compare_controls,
    train_signals,
)
from odscen.app.environments.traffic_environment import TrafficEnvironment
from odscen.learning.behaviour.light_model import (
    LightFacts,
    LightModel,
    LightObservation,
    LightScene,
    LightsObservation,
)
from odscen.learning.behaviour.signal_agent import PpoSettings, SignalAgent

__all__ = [
    "ControlledRuns",
    "EgoEnvironment",
    "LightFacts",
    "LightModel",
    "LightObservation",
    "LightScene",
    "LightsObservation",
    "PpoSettings",
    "SignalAgent",
    "SignalEnvironment",
    "SignalsEnvironment",
    "TrafficEnvironment",
    "TrainedEpisode",
    "compare_controls",
    "light_view",
    "progress_reward",
    "train_signals",
]
