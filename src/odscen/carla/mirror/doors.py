"""Which doors of vehicles near the ego are open: of those that stand at a stop.

Pure planning. On a server an open door is a body of its own, on a joint (``OpenDoorPhys`` of
CarlaWheeledVehicle.cpp): it does not go with its vehicle. So a door opens a step after its vehicle
has come to its place, and is shut before the vehicle leaves it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.carla.mirror.wheels import NEAR
from odscen.carla.server.batch import DoorMove
from odscen.sumo.worker.simulation.observed import VehicleSignal

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from odscen.records.run_plan import Plan
    from odscen.sumo.runner.in_step import Step

_LEFT, _RIGHT = VehicleSignal.DOOR_OPEN_LEFT, VehicleSignal.DOOR_OPEN_RIGHT
_DOORS = {_LEFT: ("FL",), _RIGHT: ("FR", "RR")}
"""On the left it is the driver's; a model that has no such door leaves it out."""


class Doors:
    """Which doors are to be opened and shut in each tick.

    Parameters
    ----------
    plan
        Road users.
    able
        Whose models have doors that open, shape ``(N,)``.
    calls
        Calls in a tick at most; no more doors than that are ever open, so that all can be shut.
    """

    def __init__(self, plan: Plan, able: NDArray[np.bool_], *, calls: int) -> None:
        self._calls = calls
        self._able = able
        self._ego = next((row for row, actor in enumerate(plan.actors) if actor.ego), None)
        self._open: dict[int, tuple[str, ...]] = {}
        self._at_stop: dict[int, int] = {}
        self._wanted: dict[int, tuple[str, ...]] = {}

    def before(self, step: Step) -> None:
        """Learn where everybody will be after the next ticks."""
        last, self._at_stop = self._at_stop, self._doors_of_stopped(step)
        stay = {row: bits & last.get(row, 0) for row, bits in self._at_stop.items()}
        near = self._rows_near_ego(step)
        self._wanted = {
            row: sum((doors for side, doors in _DOORS.items() if bits & side), ())
            for row, bits in stay.items()
            if bits and row in near
        }

    def moved(self, actors: Mapping[int, int]) -> dict[int, tuple[DoorMove, ...]]:
        """Doors to open and to shut before the next tick, by actor on the server.

        Parameters
        ----------
        actors
            Actor for each row of the plan that is on the server already.
        """
        self._open = {row: doors for row, doors in self._open.items() if row in actors}
        moves: dict[int, tuple[DoorMove, ...]] = {}
        left = self._calls
        for row in [row for row in self._open if row not in self._wanted]:
            doors = self._open.pop(row)
            left -= len(doors)
            moves[actors[row]] = tuple(DoorMove(door, opens=False) for door in doors)
        room = self._calls - sum(map(len, self._open.values()))
        for row, doors in self._wanted.items():
            if row in actors and row not in self._open and len(doors) <= min(left, room):
                left, room = left - len(doors), room - len(doors)
                self._open[row] = doors
                moves[actors[row]] = tuple(DoorMove(door, opens=True) for door in doors)
        return moves

    def _doors_of_stopped(self, step: Step) -> dict[int, int]:
        bits = step.signals & (_LEFT | _RIGHT)
        found = np.flatnonzero((bits > 0) & self._able[step.index])
        return {int(step.index[k]): int(bits[k]) for k in found.tolist()}

    def _rows_near_ego(self, step: Step) -> set[int]:
        """Rows of those near the ego."""
        found = [] if self._ego is None else np.flatnonzero(step.index == self._ego).tolist()
        if not found or not self._at_stop:
            return set()
        away = np.hypot(step.x - step.x[found[0]], step.y - step.y[found[0]])
        return set(step.index[away <= NEAR].tolist())
