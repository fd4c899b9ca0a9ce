"""All vehicles of a scenario as agents of PettingZoo, in parallel."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from odscen.app.environments.driving_tasks import (
    HARDEST,
    HIGHEST,
    SEES,
    STRONGEST,
    accelerated,
    features,
    progress_reward,
)
from odscen.app.environments.stepped_run import LEAN, SteppedRun
from odscen.base.errors import InputError, MissingDependencyError

try:
    import gymnasium
    import pettingzoo
except ImportError as error:
    raise MissingDependencyError(
        "environments need gymnasium and pettingzoo: pip install 'odscen[rl]'"
    ) from error

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.app.environments.driving_tasks import Reward
    from odscen.base.given_files import GivenPath
    from odscen.learning.behaviour.behaviour_model import RoadObservation
    from odscen.learning.fill import Array
    from odscen.maps.store import Workspace
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario


class TrafficEnvironment(pettingzoo.ParallelEnv):  # type: ignore[misc]  # as of Gymnasium
    """One episode is one run; agents are the vehicles on the road, by their ids.

    Spaces as of :class:`odscen.app.environments.ego_environment.EgoEnvironment`. An agent that is
    given no action is SUMO's in that step; one that has arrived is terminated.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file.
    settings
        How it is run. The seed is that of ``reset``, else the scenario's.
    reward
        Of each vehicle; how near it is to its desired speed if not given.
    """

    metadata: ClassVar[dict[str, Any]] = {"name": "odscen_traffic", "render_modes": []}

    def __init__(
        self,
        workspace: Workspace,
        scenario: Scenario | GivenPath,
        *,
        settings: RunSettings = LEAN,
        reward: Reward = progress_reward,
    ) -> None:
        self._given = workspace, scenario, settings
        self._reward = reward
        self._seen_space = gymnasium.spaces.Box(0.0, HIGHEST, (SEES,), np.float32)
        self._act_space = gymnasium.spaces.Box(HARDEST, STRONGEST, (1,), np.float32)
        self.render_mode = None
        self.agents: list[str] = []
        self._run: SteppedRun | None = None
        self._seen: RoadObservation | None = None
        first = SteppedRun(workspace, scenario, settings=settings)
        self.possible_agents = [str(name) for name in first.scene.vehicle_id]
        first.close()

    def observation_space(self, agent: str) -> Any:
        """What an agent sees."""
        del agent
        return self._seen_space

    def action_space(self, agent: str) -> Any:
        """What an agent does."""
        del agent
        return self._act_space

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Array], dict[str, dict[str, Any]]]:
        """Begin a run, up to when the first vehicle is on the road.

        Raises
        ------
        InputError
            If none ever is.
        """
        del options
        self.close()
        workspace, scenario, settings = self._given
        drawn = settings.seed if seed is None else seed % 2**31
        self._run = SteppedRun(workspace, scenario, settings=replace(settings, seed=drawn))
        self._seen = self._run.see()
        if self._seen is None:
            raise InputError("no vehicle ever departs")
        self.agents = self._agent_names(self._seen)
        return self._observe_agents(self._seen), {name: {} for name in self.agents}

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[
        dict[str, Array],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Drive for a step."""
        if self._run is None or self._seen is None:
            raise InputError("reset the environment first")
        before = self._seen
        rows = {name: row for row, name in enumerate(self._agent_names(before))}
        wanted = {
            rows[name]: float(np.asarray(action).reshape(-1)[0])
            for name, action in actions.items()
            if name in rows
        }
        self._run.drive(*accelerated(before, self._run.scene, wanted))
        self._seen = self._run.see()
        last = self._observe_agents(before)
        if self._seen is None:
            gone, now, rewards = list(rows), [], {}
        else:
            now = self._agent_names(self._seen)
            gone = [name for name in rows if name not in set(now)]
            given = self._reward(self._seen, self._run.scene)
            rewards = dict(zip(now, map(float, given), strict=True))
        vehicles = [*now, *gone]
        views = {} if self._seen is None else self._observe_agents(self._seen)
        over = self._seen is None
        self.agents = now
        return (
            {name: views.get(name, last.get(name)) for name in vehicles},  # type: ignore[misc]
            {name: rewards.get(name, 0.0) for name in vehicles},
            {name: name in gone and not over for name in vehicles},
            dict.fromkeys(vehicles, over),
            {name: {} for name in vehicles},
        )

    def close(self) -> None:
        """End the run."""
        if self._run is not None:
            self._run.close()
            self._run, self._seen, self.agents = None, None, []

    def _agent_names(self, seen: RoadObservation) -> list[str]:
        return [self.possible_agents[row] for row in seen.index.tolist()]

    def _observe_agents(self, seen: RoadObservation) -> dict[str, Array]:
        if self._run is None:
            return {}
        return dict(zip(self._agent_names(seen), features(seen, self._run.scene), strict=True))
