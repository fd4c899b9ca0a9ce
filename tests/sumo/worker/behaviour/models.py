"""Behaviour models of tests, named by ``tests.sumo.worker.behaviour.models:NAME``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from odscen.learning.behaviour.behaviour_model import DrivingAction, DrivingKind

HERE = "tests.sumo.worker.behaviour.models"


class Nobody:
    """Looks, and controls nobody."""

    def init(self, rng: Any, scene: Any) -> Any:
        rng.random()
        return scene

    def act(self, seen: Any, state: Any) -> tuple[DrivingAction, Any]:
        del state
        return DrivingAction(speed=seen.speed), np.zeros(len(seen), dtype=bool)


@dataclass
class Only(Nobody):
    """Controls one vehicle, by one kind of action, from 1 s to 3 s."""

    vehicle: str
    kind: float
    value: float

    def act(self, seen: Any, state: Any) -> tuple[DrivingAction, Any]:
        mine = (state.vehicle_id[seen.index] == self.vehicle) & (1.0 <= seen.time < 3.0)
        kind, zero = DrivingKind(int(self.kind)), np.zeros(len(seen))
        since = seen.time - 1.0
        if kind in (DrivingKind.SPEED, DrivingKind.SPEED_UNCHECKED):
            return DrivingAction(kind, speed=zero + self.value), mine
        if kind == DrivingKind.LANE_POSITION:
            return DrivingAction(kind, speed=zero, lane=seen.lane, pos=seen.pos + self.value), mine
        place = DrivingAction(kind, x=zero + self.value + since, y=zero - 20.0, hdg=zero + 0.5)
        return place, mine


@dataclass
class Wrong(Nobody):
    """Does something wrong from 1 s on."""

    what: str

    def act(self, seen: Any, state: Any) -> tuple[Any, Any]:
        if seen.time < 1.0:
            return super().act(seen, state)
        if self.what == "raise":
            raise ZeroDivisionError("kaputt")
        count = len(seen)
        place = DrivingAction(
            DrivingKind.LANE_POSITION, lane=np.full(count, 10**6), pos=np.zeros(count)
        )
        return place, np.ones(count, dtype=bool)


class Keeper(Nobody):
    """Looks at what it was shown a step ago, and every second time only."""

    def __init__(self) -> None:
        self.kept: Any = None

    def act(self, seen: Any, state: Any) -> tuple[DrivingAction, Any]:
        before, self.kept = self.kept, seen
        if before is not None and round(seen.time / state.step_length) % 2:
            moved = seen.pos[seen.index == 0] - before.pos[before.index == 0]
            slow = 0.5 * (seen.speed[seen.index == 0] + before.speed[before.index == 0])
            if (seen.lane == before.lane).all() and (abs(moved) < 0.1 * slow).any():
                raise ValueError(f"it was shown {before.time:g} s and sees {seen.time:g} s")
        return DrivingAction(speed=np.zeros(len(seen))), np.zeros(len(seen), dtype=bool)


class Unrelated(Nobody):
    """Keeps its keyword arguments in an attribute that happens to be called ``options``."""

    options: Any = ("eager", "calm")

    def __init__(self, **options: Any) -> None:
        self.options = options


class Misdescribed(Nobody):
    """Offers an option, but not as a property of an object."""

    options: Any = {"gap": {"type": "number"}}  # noqa: RUF012 - as people write it


class Stubborn:
    """Switches lights: every light to a stage, from the first second on."""

    interval = 1.0

    def __init__(self, stage: float = 0.0) -> None:
        self.stage = int(stage)

    def init_lights(self, rng: Any, scene: Any) -> Any:
        del rng
        return scene

    def switch(self, seen: Any, state: Any) -> Any:
        del seen
        return [self.stage] * len(state.lights)


class InTurn(Stubborn):
    """Switches each light to its next stage as soon as it may."""

    def switch(self, seen: Any, state: Any) -> Any:
        return [
            (light.stage + 1) % len(facts.stages)
            for facts, light in zip(state.lights, seen.lights, strict=True)
        ]
