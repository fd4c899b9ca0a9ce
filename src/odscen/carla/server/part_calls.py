"""Wheels and doors of vehicles on a server: a call for each, and no answer is waited for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from odscen.carla.server.batch import DoorMove, WheelTurn


class PartCalls:
    """Turns wheels, moves doors, and knows the vehicles that have them.

    Its calls raise the client's plain ``RuntimeError``.
    """

    def __init__(self, carla: Any) -> None:
        wheel = carla.VehicleWheelLocation
        self._front = (wheel.FL_Wheel, wheel.FR_Wheel)
        self._all = (*self._front, wheel.BL_Wheel, wheel.BR_Wheel)
        self._door = carla.VehicleDoor.names
        self._vehicles: dict[int, Any] = {}

    def move_doors(self, world: Any, moves: Mapping[int, tuple[DoorMove, ...]]) -> None:
        """Open and shut doors; who is gone is left out."""
        self._look_up(world, moves)
        for actor, doors in moves.items():
            vehicle = self._vehicles.get(actor)
            if vehicle is None:
                continue
            for door, opens in doors:
                (vehicle.open_door if opens else vehicle.close_door)(self._door[door])

    def turn(self, world: Any, turns: Mapping[int, WheelTurn]) -> None:
        """Turn the wheels of four-wheeled vehicles; who is gone is left out."""
        self._look_up(world, turns)
        for actor, turn in turns.items():
            vehicle = self._vehicles.get(actor)
            if vehicle is None:
                continue
            for wheel in self._front:
                vehicle.set_wheel_steer_direction(wheel, turn.steer)
            for wheel in self._all:
                vehicle.set_wheel_pitch_angle(wheel, turn.pitch)

    def _look_up(self, world: Any, actors: Iterable[int]) -> None:
        unknown = [actor for actor in actors if actor not in self._vehicles]
        if unknown:
            self._vehicles.update(
                {get_actor.id: get_actor for get_actor in world.get_actors(unknown)}
            )

    def forget(self, actors: Iterable[int]) -> None:
        """Forget vehicles that are gone."""
        for actor in actors:
            self._vehicles.pop(actor, None)
