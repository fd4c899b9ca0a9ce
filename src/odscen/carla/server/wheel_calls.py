"""The wheels of vehicles on a server: a call for each, and no answer is waited for."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from odscen.carla.server.batch import WheelTurn


class WheelCalls:
    """Turns wheels, and knows the vehicles whose wheels were turned.

    Its calls raise the client's plain ``RuntimeError``.
    """

    def __init__(self, carla: Any) -> None:
        wheel = carla.VehicleWheelLocation
        self._front = (wheel.FL_Wheel, wheel.FR_Wheel)
        self._all = (*self._front, wheel.BL_Wheel, wheel.BR_Wheel)
        self._vehicles: dict[int, Any] = {}

    def turn(self, world: Any, turns: Mapping[int, WheelTurn]) -> None:
        """Turn the wheels of four-wheeled vehicles; who is gone is left out."""
        unknown = [actor for actor in turns if actor not in self._vehicles]
        if unknown:
            self._vehicles.update({one.id: one for one in world.get_actors(unknown)})
        for actor, turn in turns.items():
            vehicle = self._vehicles.get(actor)
            if vehicle is None:
                continue
            for wheel in self._front:
                vehicle.set_wheel_steer_direction(wheel, turn.steer)
            for wheel in self._all:
                vehicle.set_wheel_pitch_angle(wheel, turn.pitch)

    def forget(self, actors: Iterable[int]) -> None:
        """Forget vehicles that are gone."""
        for actor in actors:
            self._vehicles.pop(actor, None)
