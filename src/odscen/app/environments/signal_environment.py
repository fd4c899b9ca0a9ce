"""Traffic lights of a scenario as environments: one of Gymnasium, all of them of PettingZoo."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from odscen.app.environments.light_tasks import (
    LEAN_LIGHTS,
    SteppedLights,
    light_view,
    named_reward,
    view_size,
)
from odscen.app.maps import map_of
from odscen.app.scenarios import given_scenario
from odscen.base.errors import InputError, MissingDependencyError
from odscen.learning.behaviour.light_model import DECISION_INTERVAL, KEEP
from odscen.sumo.realize.lights.light_stages import switched_lights

try:
    import gymnasium
    import pettingzoo
except ImportError as error:
    raise MissingDependencyError(
        "environments need gymnasium and pettingzoo: pip install 'odscen[rl]'"
    ) from error

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.app.environments.light_tasks import LightReward
    from odscen.base.given_files import GivenPath
    from odscen.learning.behaviour.light_model import LightFacts, LightsObservation
    from odscen.learning.fill import Array
    from odscen.maps.store import Workspace
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario


class _LightEpisodes:
    """The runs behind an environment, one after the other."""

    def __init__(
        self,
        workspace: Workspace,
        scenario: Scenario | GivenPath,
        settings: RunSettings,
        interval: float,
    ) -> None:
        self._workspace = workspace
        self.scenario = given_scenario(scenario)
        self._settings = settings
        self._interval = interval
        loaded = map_of(workspace, self.scenario)
        self.facts = tuple(light.facts for light in switched_lights(self.scenario, loaded.sumo))
        if not self.facts:
            raise InputError(f"map {self.scenario.map.name!r} has no light with two stages or more")
        self._run: SteppedLights | None = None
        self.seen: LightsObservation | None = None

    def begin(self, seed: int) -> None:
        """Begin a run, up to its first choice."""
        self.close()
        self._run = SteppedLights(
            self._workspace,
            self.scenario,
            settings=replace(self._settings, seed=seed),
            interval=self._interval,
        )
        self.seen = self._run.see()
        if self.seen is None:
            raise InputError("the run is over before its first choice: it has no road users")

    def go_on(self, stages: list[int]) -> LightsObservation | None:
        """Switch, and wait for the next choice; ``None`` once the run is over."""
        if self._run is None or self.seen is None:
            raise InputError("reset the environment first")
        self._run.switch(stages)
        self.seen = self._run.see()
        return self.seen

    def close(self) -> None:
        """End the run."""
        if self._run is not None:
            self._run.close()
            self._run, self.seen = None, None


def _stage_of(facts: LightFacts, action: Any) -> int:
    """The stage that an action means.

    Raises
    ------
    InputError
        If there is no such stage.
    """
    stage = int(np.asarray(action).reshape(-1)[0])
    if not 0 <= stage < len(facts.stages):
        raise InputError(f"light {facts.id!r} has stages 0 to {len(facts.stages) - 1}, not {stage}")
    return stage


class SignalEnvironment(gymnasium.Env):  # type: ignore[misc]  # not there without the extra
    """One traffic light of a scenario; the others keep their programs.

    One episode is one run. Seen is :func:`light_view`, done is the number of the next stage. A
    choice comes every ``interval`` seconds; one for another stage counts only once the least green
    is over, and yellow, all-red and clearance then come by themselves. It is truncated at the end
    of the run.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file.
    light
        A junction of it, or SUMO's id of the light; the first if not given.
    settings
        How it is run. The seed is that of ``reset``, from then on drawn from it.
    interval
        Seconds between two choices.
    reward
        ``diff-waiting-time``, ``queue``, ``pressure``, ``delay``, or a function.

    Raises
    ------
    MissingDependencyError
        On import, without gymnasium and pettingzoo.
    InputError
        If there is no such light, or no such reward.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}

    def __init__(
        self,
        workspace: Workspace,
        scenario: Scenario | GivenPath,
        *,
        light: str | None = None,
        settings: RunSettings = LEAN_LIGHTS,
        interval: float = DECISION_INTERVAL,
        reward: str | LightReward = "diff-waiting-time",
    ) -> None:
        self._reward = named_reward(reward)
        self._episodes = _LightEpisodes(workspace, scenario, settings, interval)
        facts = self._episodes.facts
        named = [n for n, x in enumerate(facts) if light is None or light in {x.id, *x.junctions}]
        if not named:
            known = ", ".join(facts_of_light.id for facts_of_light in facts)
            raise InputError(f"there is no light {light!r}; there are {known}")
        self._row = named[0]
        self.facts = facts[self._row]
        self.observation_space = gymnasium.spaces.Box(
            0.0, 1.0, (view_size(self.facts),), np.float32
        )
        self.action_space = gymnasium.spaces.Discrete(len(self.facts.stages))
        self._last = np.zeros(view_size(self.facts), dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begin a run."""
        super().reset(seed=seed)
        del options
        self._episodes.begin(int(self.np_random.integers(2**31)) if seed is None else seed % 2**31)
        return self._make_observation(), self._make_info()

    def step(self, action: Any) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Choose a stage, and let ``interval`` seconds go by."""
        before = self._episodes.seen
        stages = [KEEP] * len(self._episodes.facts)
        stages[self._row] = _stage_of(self.facts, action)
        now = self._episodes.go_on(stages)
        if now is None or before is None:
            return self._last, 0.0, False, True, {}
        old, new = before.lights[self._row], now.lights[self._row]
        reward = self._reward(self.facts, old, new)
        return self._make_observation(), reward, False, False, self._make_info()

    def close(self) -> None:
        """End the run."""
        self._episodes.close()

    def _make_observation(self) -> Array:
        if self._episodes.seen is not None:
            self._last = light_view(self.facts, self._episodes.seen.lights[self._row])
        return self._last

    def _make_info(self) -> dict[str, Any]:
        seen = self._episodes.seen
        if seen is None:
            return {}
        light = seen.lights[self._row]
        return {
            "time": seen.time,
            "vehicles": int(light.vehicles.sum()),
            "queue": int(light.queue.sum()),
            "waiting": float(light.waiting.sum()),
        }


class SignalsEnvironment(pettingzoo.ParallelEnv):  # type: ignore[misc]  # as of Gymnasium
    """All traffic lights of a scenario as agents, by SUMO's ids, in parallel.

    Spaces, choices and rewards are those of :class:`SignalEnvironment`. An agent that is given no
    action keeps its stage.

    Parameters
    ----------
    workspace, scenario, settings, interval, reward
        As there; the seed is that of ``reset``, else the scenario's.
    """

    metadata: ClassVar[dict[str, Any]] = {"name": "odscen_signals", "render_modes": []}

    def __init__(
        self,
        workspace: Workspace,
        scenario: Scenario | GivenPath,
        *,
        settings: RunSettings = LEAN_LIGHTS,
        interval: float = DECISION_INTERVAL,
        reward: str | LightReward = "diff-waiting-time",
    ) -> None:
        self._reward = named_reward(reward)
        self._episodes = _LightEpisodes(workspace, scenario, settings, interval)
        self.facts = {light.id: light for light in self._episodes.facts}
        self.possible_agents = [*self.facts]
        self.agents: list[str] = []
        self.observation_spaces = {
            name: gymnasium.spaces.Box(0.0, 1.0, (view_size(facts),), np.float32)
            for name, facts in self.facts.items()
        }
        self.action_spaces = {
            name: gymnasium.spaces.Discrete(len(facts.stages)) for name, facts in self.facts.items()
        }
        self._last: dict[str, Array] = {}

    def observation_space(self, agent: str) -> Any:
        """What an agent sees."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Any:
        """What an agent may do."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Array], dict[str, dict[str, Any]]]:
        """Begin a run."""
        del options
        self._episodes.begin(self._episodes.scenario.seed if seed is None else seed % 2**31)
        self.agents = [*self.possible_agents]
        return self._make_observation(), {name: {} for name in self.agents}

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[
        dict[str, Array],
        dict[str, float],
        dict[str, bool],
        dict[str, bool],
        dict[str, dict[str, Any]],
    ]:
        """Choose stages, and let ``interval`` seconds go by."""
        before = self._episodes.seen
        stages = [
            _stage_of(facts, actions[name]) if name in actions else KEEP
            for name, facts in self.facts.items()
        ]
        now = self._episodes.go_on(stages)
        names = self.possible_agents
        over = now is None or before is None
        rewards = dict.fromkeys(names, 0.0)
        if now is not None and before is not None:
            rewards = {
                name: self._reward(facts, old, new)
                for (name, facts), old, new in zip(
                    self.facts.items(), before.lights, now.lights, strict=True
                )
            }
        self.agents = [] if over else [*names]
        return (
            self._make_observation(),
            rewards,
            dict.fromkeys(names, False),
            dict.fromkeys(names, over),
            {name: {} for name in names},
        )

    def close(self) -> None:
        """End the run."""
        self._episodes.close()
        self.agents = []

    def _make_observation(self) -> dict[str, Array]:
        seen = self._episodes.seen
        if seen is not None:
            self._last = {
                name: light_view(facts, light)
                for (name, facts), light in zip(self.facts.items(), seen.lights, strict=True)
            }
        return dict(self._last)
