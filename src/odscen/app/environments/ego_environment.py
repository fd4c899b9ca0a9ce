"""The ego of a scenario as an environment of Gymnasium; the others are SUMO's."""

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
except ImportError as error:
    raise MissingDependencyError("environments need gymnasium: pip install 'odscen[rl]'") from error

if TYPE_CHECKING:
    from odscen.app.environments.driving_tasks import Reward
    from odscen.base.given_files import GivenPath
    from odscen.learning.behaviour.behaviour_model import RoadObservation
    from odscen.learning.fill import Array
    from odscen.maps.store import Workspace
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario


class EgoEnvironment(gymnasium.Env):  # type: ignore[misc]  # not there without the extra
    """One episode is one run, from when the ego departs.

    Seen are the 12 numbers of :func:`odscen.learning.behaviour.imitation_driver.sight`; done is
    one acceleration, -6 to 4 m/s^2; right of way and what else SUMO's driver thinks unsafe limits
    it. It is terminated when the ego has arrived, truncated at the end of the run.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        With exactly one ego; or its file.
    settings
        How it is run. The seed is that of ``reset``, from then on drawn from it.
    reward
        Of each vehicle; how near it is to its desired speed if not given.

    Raises
    ------
    MissingDependencyError
        On import, without gymnasium.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}

    def __init__(
        self,
        workspace: Workspace,
        scenario: Scenario | GivenPath,
        *,
        settings: RunSettings = LEAN,
        reward: Reward = progress_reward,
    ) -> None:
        self.observation_space = gymnasium.spaces.Box(0.0, HIGHEST, (SEES,), np.float32)
        self.action_space = gymnasium.spaces.Box(HARDEST, STRONGEST, (1,), np.float32)
        self._given = workspace, scenario, settings
        self._reward = reward
        self._run: SteppedRun | None = None
        self._seen: RoadObservation
        self._row = 0
        self._ego = 0
        self._last = np.zeros(SEES, dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin a run, up to when the ego is on the road.

        Raises
        ------
        InputError
            If the scenario has not exactly one ego, or it never departs.
        """
        super().reset(seed=seed)
        del options
        self.close()
        workspace, scenario, settings = self._given
        drawn = int(self.np_random.integers(2**31)) if seed is None else seed % 2**31
        self._run = SteppedRun(workspace, scenario, settings=replace(settings, seed=drawn))
        egos = np.flatnonzero(self._run.scene.ego)
        if len(egos) != 1:
            raise InputError(
                f"the scenario has {len(egos)} egos that drive; this environment is of one"
            )
        self._ego = int(egos[0])
        seen = self._run.see()
        while seen is not None and not self._find_ego_row(seen):
            self._run.drive(*accelerated(seen, self._run.scene, {}))
            seen = self._run.see()
        if seen is None:
            raise InputError("the ego never departs")
        return self._observe_ego(), {"time": seen.time}

    def step(self, action: Any) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Drive for a step."""
        if self._run is None:
            raise InputError("reset the environment first")
        scene = self._run.scene
        wanted = {self._row: float(np.asarray(action).reshape(-1)[0])}
        self._run.drive(*accelerated(self._seen, scene, wanted))
        seen = self._run.see()
        if seen is None:
            return self._last, 0.0, False, True, {}
        if not self._find_ego_row(seen):
            return self._last, 0.0, True, False, {"time": seen.time}
        reward = float(self._reward(seen, scene)[self._row])
        return self._observe_ego(), reward, False, False, {"time": seen.time}

    def close(self) -> None:
        """End the run."""
        if self._run is not None:
            self._run.close()
            self._run = None

    def _find_ego_row(self, seen: RoadObservation) -> bool:
        rows = np.flatnonzero(seen.index == self._ego)
        if len(rows):
            self._seen, self._row = seen, int(rows[0])
        return bool(len(rows))

    def _observe_ego(self) -> Array:
        if self._run is not None:
            self._last = features(self._seen, self._run.scene)[self._row]
        return self._last
