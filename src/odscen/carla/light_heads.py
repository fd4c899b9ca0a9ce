"""Traffic lights: SUMO's letters per link become a state per OpenDRIVE signal."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.convert.lane_table.table import SumoLight

_STATES = {
    "G": "Green",
    "g": "Green",
    "y": "Yellow",
    "Y": "Yellow",
    "u": "Yellow",
    "r": "Red",
    "s": "Red",
    "o": "Off",
    "O": "Off",
}
"""CARLA's state for each letter: https://sumo.dlr.de/docs/Simulation/Traffic_Lights.html."""
_FIRST = ("Green", "Yellow", "Red", "Off")
"""A signal with several links shows the first of these that any of them has."""


class Heads:
    """The OpenDRIVE signals of a map and the links that each one rules."""

    def __init__(self, lights: Sequence[SumoLight]) -> None:
        self._links: dict[str, list[tuple[str, int]]] = {}
        for light in lights:
            for link, signals in enumerate(light.signals):
                for signal in signals:
                    self._links.setdefault(signal, []).append((light.id, link))

    @property
    def signals(self) -> frozenset[str]:
        """OpenDRIVE ids of all signals that rule a link."""
        return frozenset(self._links)

    def states(self, lights: Mapping[str, str]) -> dict[str, str]:
        """State of each signal, from the letters of each SUMO light."""
        return {
            signal: _shown([lights[light][link] for light, link in links if light in lights])
            for signal, links in self._links.items()
        }


def _shown(letters: Sequence[str]) -> str:
    states = {_STATES.get(letter, "Red") for letter in letters}
    return next((state for state in _FIRST if state in states), "Red")
