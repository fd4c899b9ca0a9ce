"""Environments of lights: the run behind them, what is seen of a light, and rewards."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from odscen.app.environments.stepped_run import PATIENCE, HeldRun
from odscen.base.errors import InputError
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.learning.behaviour.light_model import (
    DECISION_INTERVAL,
    observation_from_json,
    scene_from_json,
)
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from odscen.base.given_files import GivenPath
    from odscen.learning.behaviour.light_model import (
        LightFacts,
        LightObservation,
        LightsObservation,
    )
    from odscen.learning.fill import Array
    from odscen.learning.offered_options import OptionValue
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario

LightReward: TypeAlias = "Callable[[LightFacts, LightObservation, LightObservation], float]"
"""Of a light, from what was seen at the last choice and at this one."""

LEAN_LIGHTS = RunSettings(
    recording=Recording(trajectories=False, emissions=False), slice_length=None
)
"""How such a run is made if nothing else is said."""
LIGHT_SOCKET = "odscen.sumo.worker.behaviour.light_socket:LightSocket"
_ROOM = 7.5
"""Metres of a lane that a vehicle takes in a queue."""


class SteppedLights(HeldRun):
    """One run whose lights this process switches; :meth:`see` and :meth:`switch` in turn.

    Attributes
    ----------
    scene
        Of the run.
    """

    def __init__(
        self,
        workspace: Workspace,
        scenario: Scenario | GivenPath,
        *,
        settings: RunSettings = LEAN_LIGHTS,
        interval: float = DECISION_INTERVAL,
    ) -> None:
        def door(path: str) -> BehaviourDoor:
            options: dict[str, OptionValue] = {
                "path": path,
                "interval": float(interval),
                "time_limit": PATIENCE,
            }
            return BehaviourDoor(name=LIGHT_SOCKET, options=options)

        super().__init__(workspace, scenario, settings=settings, door=door)
        self.scene = scene_from_json(self.first)

    def see(self) -> LightsObservation | None:
        """Wait for the next choice; ``None`` once the run is over.

        Raises
        ------
        SimulationError
            If it has failed.
        """
        data = self.wait()
        return None if data is None else observation_from_json(data)

    def switch(self, stages: Sequence[int]) -> None:
        """Choose a stage for each light, -1 for the present one."""
        self.answer(json.dumps([int(stage) for stage in stages]).encode())


def light_view(facts: LightFacts, seen: LightObservation) -> Array:
    """What is seen of a light, ``(P + 1 + 2 L,)`` float32 from 0 to 1.

    As sumo-rl has it: the stage that is shown as one-hot, whether its least green is over, then
    the density of each approach and its queue, as shares of the vehicles that have room there.
    """
    room = np.maximum(np.array(facts.lengths) / _ROOM, 1.0)
    shown = np.arange(len(facts.stages)) == seen.stage
    parts = (shown, [seen.may_switch], seen.vehicles / room, seen.queue / room)
    return np.clip(np.concatenate(parts), 0.0, 1.0).astype(np.float32)


def view_size(facts: LightFacts) -> int:
    """Numbers of :func:`light_view`."""
    return len(facts.stages) + 1 + 2 * len(facts.lanes)


def waiting_reward(facts: LightFacts, before: LightObservation, now: LightObservation) -> float:
    """Seconds that vehicles on the approaches have waited, before less now, over 100 (sumo-rl)."""
    del facts
    return float(before.waiting.sum() - now.waiting.sum()) / 100.0


def queue_reward(facts: LightFacts, before: LightObservation, now: LightObservation) -> float:
    """Less the vehicles that stand on the approaches (sumo-rl)."""
    del facts, before
    return -float(now.queue.sum())


def pressure_reward(facts: LightFacts, before: LightObservation, now: LightObservation) -> float:
    """Vehicles on the lanes behind less those on the approaches (sumo-rl)."""
    del facts, before
    return float(now.leaving.sum() - now.vehicles.sum())


def delay_reward(facts: LightFacts, before: LightObservation, now: LightObservation) -> float:
    """Less the time that vehicles on the approaches lose each second, over 10 (odscen's own).

    A vehicle that stands loses a second, one at half of the speed limit half of one: the mean delay
    of a run is what it adds up to.
    """
    del facts, before
    return -float(now.lost.sum()) / 10.0


REWARDS: Mapping[str, LightReward] = {
    "diff-waiting-time": waiting_reward,
    "queue": queue_reward,
    "pressure": pressure_reward,
    "delay": delay_reward,
}
"""By name; the first three are those of sumo-rl."""


def named_reward(reward: str | LightReward) -> LightReward:
    """A reward by its name, or as a function.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if not isinstance(reward, str):
        return reward
    if reward not in REWARDS:
        raise InputError(f"there is no reward {reward!r}; there are {', '.join(REWARDS)}")
    return REWARDS[reward]
