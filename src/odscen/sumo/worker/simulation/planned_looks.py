"""Vehicles that are looked at only when something may have come of them: the schedule of looks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable


class PlannedLooks:
    """Which vehicles are to be looked at before a step.

    Parameters
    ----------
    sumo
        libsumo.
    native
        Gives the function of libsumo behind one of Python, by domain and name.

    Attributes
    ----------
    step_length
        Seconds; 0 before the first step.
    """

    def __init__(self, sumo: Any, native: Callable[[str, str], Any]) -> None:
        self.step_length = 0.0
        self._sumo = sumo
        self._departed_number, self._departed = (
            native("simulation", f"getDeparted{what}") for what in ("Number", "IDList")
        )
        self._step = -1
        self._due: dict[int, list[str]] = {}

    def next_step(self) -> Iterable[str]:
        """Go on to the next step; who has departed in the last one, at first all who are there."""
        if self._step < 0:
            self.step_length = float(self._sumo.simulation.getDeltaT())
        self._step += 1
        if self._step == 0:
            names: Iterable[str] = self._sumo.vehicle.getIDList()
        elif self._departed_number():
            names = self._departed()
        else:
            names = ()
        return names

    def take_due(self) -> list[str]:
        """Who is to be looked at before this step."""
        return self._due.pop(self._step, [])

    def plan(self, name: str, seconds: float) -> None:
        """Look again when so many seconds have passed, a step early, or in the next step."""
        steps = max(1, int(seconds / self.step_length) - 1)
        self._due.setdefault(self._step + steps, []).append(name)

    def plan_all_now(self) -> None:
        """Look at all who are waited for in the next step, as after a state has been saved."""
        waiting = [name for names in self._due.values() for name in names]
        self._due.clear()
        self._due[self._step + 1] = waiting


def seconds_to(metres: float, speed: float, gains: float) -> float:
    """Seconds in which a vehicle that gains speed all the time drives so many metres.

    Parameters
    ----------
    metres, speed, gains
        m (0 if negative), m/s and m/s2.
    """
    return (math.sqrt(speed * speed + 2.0 * gains * max(metres, 0.0)) - speed) / gains
