"""Agents for lights: training in runs, and how they compare with what lights have today."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.app.environments.light_tasks import LEAN_LIGHTS, SteppedLights, named_reward
from odscen.app.running.batches import run_many
from odscen.app.scenarios import given_scenario
from odscen.app.signals.signal_optimisation import time_signals
from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import InputError
from odscen.figures.measures.comparison import compare_figure
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.learning.behaviour.light_model import DECISION_INTERVAL, KEEP
from odscen.learning.behaviour.signal_agent import (
    LightEpisode,
    PpoLearner,
    SignalAgent,
    stage_features,
)
from odscen.records.outcomes import RunStatus
from odscen.scenario.document.distributions import stream

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from odscen.app.environments.light_tasks import LightReward
    from odscen.base.given_files import GivenPath
    from odscen.figures.measures.comparison import Difference
    from odscen.learning.behaviour.light_model import LightsObservation
    from odscen.learning.behaviour.signal_agent import PpoSettings
    from odscen.maps.store import Workspace
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario

FIRST_SEED = 100_000
"""Of training runs, so that seeds of comparisons are others."""


@dataclass(frozen=True, slots=True)
class TrainedEpisode:
    """How an episode of the training went; ``reward`` is the mean of a light and choice."""

    number: int
    scenario: str
    seed: int
    reward: float


def train_signals(
    workspace: Workspace,
    scenarios: Sequence[Scenario | GivenPath],
    *,
    episodes: int = 60,
    batch: int = 2,
    seed: int = 1,
    reward: str | LightReward = "delay",
    settings: RunSettings = LEAN_LIGHTS,
    ppo: PpoSettings | None = None,
    told: Callable[[TrainedEpisode], None] | None = None,
) -> SignalAgent:
    """Train one agent for all lights of some scenarios by PPO.

    The same arguments give the same agent, byte for byte, on the same platform.

    Parameters
    ----------
    workspace
        Has the maps.
    scenarios
        Scenarios, or their files; episodes take them in turn, each with a seed of its own from
        100,000 on.
    episodes
        Runs in all.
    batch
        Episodes between two updates of the agent.
    seed
        Of the training.
    reward
        As of :class:`odscen.rl.SignalEnvironment`.
    settings
        How runs are made.
    ppo
        Settings of the learner.
    told
        Hears of each episode.

    Raises
    ------
    InputError
        If there is nothing to train with, or a scenario has no light to switch.
    SimulationError
        If a run fails.
    """
    documents = [given_scenario(scenario) for scenario in scenarios]
    if not documents or episodes < 1 or batch < 1:
        raise InputError("training needs a scenario, an episode and a batch of one at least")
    worth = named_reward(reward)
    rng = stream(seed, "signal agent")
    learner = PpoLearner(rng, updates=-(-episodes // batch), settings=ppo)
    waiting: list[LightEpisode] = []
    for number in range(episodes):
        scenario, run_seed = documents[number % len(documents)], FIRST_SEED + 1000 * seed + number
        lights = _play_episode(workspace, scenario, run_seed, learner, worth, settings)
        waiting += lights
        if told is not None:
            mean = float(np.mean([light.rewards.mean() for light in lights]))
            told(TrainedEpisode(number, scenario.name, run_seed, mean))
        if (number + 1) % batch == 0 or number + 1 == episodes:
            learner.learn(waiting)
            waiting = []
    about = {
        "scenarios": [scenario.name for scenario in documents],
        "maps": sorted({scenario.map.name for scenario in documents}),
        "episodes": episodes,
        "batch": batch,
        "seed": seed,
        "reward": reward if isinstance(reward, str) else "own",
    }
    return SignalAgent(learner.policy, about)


def _play_episode(
    workspace: Workspace,
    scenario: Scenario,
    seed: int,
    learner: PpoLearner,
    worth: LightReward,
    settings: RunSettings,
) -> list[LightEpisode]:
    """One run in which stages are drawn; what each light went through."""
    run = SteppedLights(
        workspace, scenario, settings=replace(settings, seed=seed), interval=DECISION_INTERVAL
    )
    facts = run.scene.lights
    rows: list[list[tuple[Any, ...]]] = [[] for _ in facts]
    rewards: list[list[float]] = [[] for _ in facts]
    before: LightsObservation | None = None
    try:
        while (seen := run.see()) is not None:
            # What a choice was worth is known when the next one is due.
            if before is not None:
                for number, (old, new) in enumerate(zip(before.lights, seen.lights, strict=True)):
                    rewards[number].append(worth(facts[number], old, new))
            chosen = []
            for number, light in enumerate(seen.lights):
                features = stage_features(facts[number], light)
                stage, logp = learner.draw(features) if light.may_switch else (KEEP, 0.0)
                rows[number].append((features, light.may_switch, max(stage, 0), logp))
                chosen.append(stage)
            run.switch(chosen)
            before = seen
    finally:
        run.close()
    return [
        LightEpisode(
            np.stack([row[0] for row in light_rows[: len(light_rewards)]]),
            np.array([row[1] for row in light_rows[: len(light_rewards)]], dtype=np.bool_),
            np.array([row[2] for row in light_rows[: len(light_rewards)]], dtype=np.int64),
            np.array([row[3] for row in light_rows[: len(light_rewards)]], dtype=np.float64),
            np.array(light_rewards, dtype=np.float64),
        )
        for light_rows, light_rewards in zip(rows, rewards, strict=True)
        if light_rewards
    ]


@dataclass(frozen=True, slots=True)
class ControlledRuns:
    """Runs of a scenario under one control of its lights.

    Attributes
    ----------
    control
        ``fixed``, ``webster``, ``actuated``, ``max-pressure`` or ``agent``.
    delay
        Mean delay of all road users by seed, seconds.
    difference
        To the first control that was compared, seed by seed, with its interval at 95 %.
    """

    control: str
    delay: dict[int, float | None]
    difference: Difference


CONTROLS = ("fixed", "webster", "actuated", "max-pressure")
"""What an agent is compared with."""


def compare_controls(
    workspace: Workspace,
    scenario: Scenario | GivenPath,
    *,
    agent: GivenPath | None = None,
    controls: Sequence[str] = CONTROLS,
    seeds: Sequence[int] = (1, 2, 3, 4, 5),
    processes: int = 1,
    settings: RunSettings = LEAN_LIGHTS,
) -> tuple[ControlledRuns, ...]:
    """Run a scenario under several controls of its lights, with the same seeds.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario, or its file.
    agent
        File of an agent, which then comes last.
    controls
        ``fixed`` (the programs of the scenario, else of the map, with fixed times), ``webster``
        (those timed after the demand), ``actuated``, ``max-pressure``.
    seeds
        Of the runs.
    processes
        Runs at a time.
    settings
        How runs are made.

    Raises
    ------
    InputError
        If a control is unknown, there is no light, or a run does not complete.
    """
    given = given_scenario(scenario)
    unknown = [name for name in controls if name not in CONTROLS]
    if unknown:
        raise InputError(f"there is no control {unknown[0]!r}; there are {', '.join(CONTROLS)}")
    made: list[tuple[str, Scenario, BehaviourDoor | None]] = [
        (name, *_run_controlled(workspace, given, name)) for name in controls
    ]
    if agent is not None:
        own = BehaviourDoor(name="signal-agent", options={"agent": str(agent)})
        made.append(("agent", given, own))
    delays: list[tuple[str, dict[int, float | None]]] = []
    for name, document, door in made:
        with scratch_folder() as folder:
            runs = run_many(
                workspace, [document], settings=replace(settings, behaviour=door), seeds=seeds,
                out=folder, processes=processes, reports=False,
            )  # fmt: skip
            for run in runs:
                if run.status is not RunStatus.COMPLETED:
                    raise InputError(f"{name}: a run has not completed: {run.summary['error']}")
            found = {
                seed: run.summary["figures"].get("mean_delay")
                for seed, run in zip(seeds, runs, strict=True)
            }
            delays.append((name, found))
    return tuple(
        ControlledRuns(name, found, compare_figure(delays[0][1], found)) for name, found in delays
    )


def _run_controlled(
    workspace: Workspace, scenario: Scenario, control: str
) -> tuple[Scenario, BehaviourDoor | None]:
    """The scenario under a control, and what switches its lights."""
    if control == "max-pressure":
        return scenario, BehaviourDoor(name="max-pressure")
    if control == "webster":
        return time_signals(workspace, scenario).scenario, None
    kind = "actuated" if control == "actuated" else "fixed"
    junctions = [
        timing.model_copy(update={"control": kind}) for timing in scenario.signals.junctions
    ]
    signals = scenario.signals.model_copy(update={"control": kind, "junctions": tuple(junctions)})
    return scenario.model_copy(update={"signals": signals}), None
