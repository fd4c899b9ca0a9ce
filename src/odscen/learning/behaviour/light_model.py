"""Models that switch traffic lights: what they see of each light, and what they choose.

The counterpart of :mod:`odscen.learning.behaviour.behaviour_model` for lights:
``init_lights(rng, scene) -> state`` once, then ``switch(observation, state) -> stages`` every few
seconds. A model names the stage that is to have green; yellow, all-red and clearance between any
two stages follow from the paths that meet, and no green ends before its least seconds are over.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray, IntArray

DECISION_INTERVAL = 5.0
"""Seconds between two choices, where a model has no ``interval`` of its own."""
APPROACH = 150.0
"""Metres before the stop line that are looked at, as far as one lane leads there."""
KEEP = -1
"""In place of a stage: the light stays as it is."""


@dataclass(frozen=True, slots=True)
class LightFacts:
    """A light: ``P`` stages, ``L`` lanes with a stop line, ``M`` lanes that lead away.

    Attributes
    ----------
    id
        SUMO's.
    junctions
        Names that scenarios have for it.
    stages
        Ids of the stages.
    states
        A letter for each link, of each stage.
    least_green
        ``(P,)`` seconds.
    change
        ``(P, P)`` seconds from the end of a stage's green to the begin of another's.
    approaches
        Of each lane with a stop line: itself and those before it, up to :data:`APPROACH` metres.
    lengths
        ``(L,)`` metres of these.
    exits
        Lanes behind the junction.
    serves
        ``(P, L)``: whether a stage has green for a movement from a lane.
    leads
        ``(P, M)``: whether it has green for a movement to a lane.
    """

    id: str
    junctions: tuple[str, ...]
    stages: tuple[str, ...]
    states: tuple[str, ...]
    least_green: tuple[float, ...]
    change: tuple[tuple[float, ...], ...]
    approaches: tuple[tuple[str, ...], ...]
    lengths: tuple[float, ...]
    exits: tuple[str, ...]
    serves: tuple[tuple[bool, ...], ...]
    leads: tuple[tuple[bool, ...], ...]

    @property
    def lanes(self) -> tuple[str, ...]:
        """Lanes with a stop line."""
        return tuple(approach[0] for approach in self.approaches)


@dataclass(frozen=True, slots=True)
class LightScene:
    """What does not change during a run.

    Attributes
    ----------
    step_length
        Seconds.
    time
        Simulated seconds at which the model begins.
    interval
        Seconds between two choices.
    lights
        Those with at least two stages.
    """

    step_length: float
    time: float
    interval: float
    lights: tuple[LightFacts, ...]


@dataclass(frozen=True, slots=True, eq=False)
class LightObservation:
    """A light at the time of a choice.

    Attributes
    ----------
    stage
        That has green, or comes next; -1 while the program of the light still runs.
    since
        Seconds of its green; 0 before it begins.
    may_switch
        Whether another stage can be chosen: it is green, and has been for its least green.
    vehicles, queue
        ``(L,)``: vehicles on each approach, and those slower than 0.1 m/s.
    waiting
        ``(L,)``: seconds that the vehicles there have stood, in all, within the last 100 s.
    lost
        ``(L,)``: vehicles times the share of the speed limit that they are short of; a vehicle
        that stands counts 1.
    leaving
        ``(M,)``: vehicles on the lanes behind.
    """

    stage: int
    since: float
    may_switch: bool
    vehicles: FloatArray
    queue: FloatArray
    waiting: FloatArray
    lost: FloatArray
    leaving: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class LightsObservation:
    """All lights at simulated seconds ``time``, in the order of the scene."""

    time: float
    lights: tuple[LightObservation, ...]


class LightModel(Protocol):
    """Switches lights. It may have ``interval``, the seconds between two choices."""

    def init_lights(self, rng: np.random.Generator, scene: LightScene) -> Any:
        """Begin; returns whatever it wants to have at each choice.

        ``rng`` is the only source of chance. Each slice of a long run begins anew.
        """

    def switch(self, observation: LightsObservation, state: Any) -> Sequence[int] | IntArray:
        """Choose the stage of each light that is to have green, :data:`KEEP` for the present one.

        A choice for a light that may not switch is not looked at.
        """


def checked_stages(chosen: Any, scene: LightScene) -> list[int]:
    """What a model has chosen.

    Raises
    ------
    InputError
        If it is not one stage for each light.
    """
    stages = np.asarray(chosen)
    count = len(scene.lights)
    if stages.shape != (count,) or stages.dtype.kind not in "iu":
        raise InputError(f"stages are {stages.dtype} {stages.shape}, not whole numbers ({count},)")
    found: list[int] = stages.tolist()
    for facts, stage in zip(scene.lights, found, strict=True):
        if not KEEP <= stage < len(facts.stages):
            raise InputError(
                f"light {facts.id!r} has stages 0 to {len(facts.stages) - 1}, not {stage}"
            )
    return found


# Messages to a program that switches lights, as JSON


def scene_json(scene: LightScene) -> bytes:
    """The scene as JSON."""
    return json.dumps(asdict(scene)).encode()


def scene_from_json(data: bytes) -> LightScene:
    """Inverse of :func:`scene_json`."""
    values = json.loads(data)
    lights = tuple(facts_from_dict(light) for light in values.pop("lights"))
    return LightScene(**values, lights=lights)


def facts_from_dict(values: dict[str, Any]) -> LightFacts:
    """Facts of a light from what JSON has kept of them."""
    nested = "change", "approaches", "serves", "leads"
    found: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in values.items()
    }
    return LightFacts(**(found | {name: tuple(map(tuple, values[name])) for name in nested}))


_ARRAYS = "vehicles", "queue", "waiting", "lost", "leaving"


def observation_json(seen: LightsObservation) -> bytes:
    """An observation as JSON."""
    lights = [
        [light.stage, light.since, light.may_switch]
        + [getattr(light, name).tolist() for name in _ARRAYS]
        for light in seen.lights
    ]
    return json.dumps([seen.time, lights]).encode()


def observation_from_json(data: bytes) -> LightsObservation:
    """Inverse of :func:`observation_json`."""
    time, lights = json.loads(data)
    return LightsObservation(
        time,
        tuple(
            LightObservation(
                stage, since, may_switch, *(np.array(x, dtype=np.float64) for x in arrays)
            )
            for stage, since, may_switch, *arrays in lights
        ),
    )
