"""Traffic lights: SUMO's letters per link become a state per OpenDRIVE signal, and back."""

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
_LETTERS = {"Green": "G", "Yellow": "y", "Red": "r", "Off": "o"}
UNKNOWN = "-"
"""Letter of a link that no signal rules whose state is known."""


class SignalHeads:
    """The OpenDRIVE signals of a map and the links that each one rules."""

    def __init__(self, lights: Sequence[SumoLight]) -> None:
        self._links: dict[str, list[tuple[str, int]]] = {}
        self._signals = {light.id: light.signals for light in lights}
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
            signal: _state_of_letters(
                [lights[light][link] for light, link in links if light in lights]
            )
            for signal, links in self._links.items()
        }

    def letters(self, states: Mapping[str, str]) -> dict[str, str]:
        """Letters of each SUMO light, from the states of signals: the inverse of :meth:`states`.

        A link that several signals rule may go if any of them shows it. Lights of which no signal
        is known are left out; single links of which none is have :data:`UNKNOWN`.
        """
        found = {
            light: "".join(
                _letter_of_states([states[name] for name in own if name in states]) for own in links
            )
            for light, links in self._signals.items()
        }
        return {light: letters for light, letters in found.items() if letters.strip(UNKNOWN)}


def _letter_of_states(states: Sequence[str]) -> str:
    shown = next((state for state in _FIRST if state in states), None)
    return UNKNOWN if shown is None else _LETTERS[shown]


def letter_state(letter: str) -> str:
    """State of one link: ``Green``, ``Yellow``, ``Red`` or ``Off``."""
    return _STATES.get(letter, "Red")


def _state_of_letters(letters: Sequence[str]) -> str:
    states = {letter_state(letter) for letter in letters}
    return next((state for state in _FIRST if state in states), "Red")
