"""Lights at the ends of lanes, all read at once."""

from __future__ import annotations

from itertools import accumulate
from typing import TYPE_CHECKING

import numpy as np

from odscen.learning.behaviour.behaviour_model import LightAhead

if TYPE_CHECKING:
    from odscen.base.arrays import Int32Array, IntArray
    from odscen.sumo.worker.simulation.driven_vehicles import DrivenVehicles

_SHOWN = np.full(256, LightAhead.NONE, dtype=np.int32)
"""What letters of SUMO's lights mean, by their codes; off and blinking are no light."""
for _letters, _meaning in (
    (b"gG", LightAhead.GREEN), (b"yYu", LightAhead.YELLOW), (b"rs", LightAhead.RED),
):  # fmt: skip
    _SHOWN[list(_letters)] = _meaning


class SeenLights:
    """Links with a light have numbers, one light after the other."""

    def __init__(self, road: DrivenVehicles) -> None:
        links = road.light_links()
        self._road = road
        self._lights = sorted({light for light, _ in links.values()})
        self._sizes = [len(road.light_state(light)) for light in self._lights]
        first = dict(zip(self._lights, accumulate(self._sizes, initial=0), strict=False))
        self._number: dict[tuple[str, str], int] = {
            key: first[light] + place for key, (light, place) in links.items()
        }

    def number(self, lane: str, target: str) -> int:
        """Of the link from a lane to another; -1 without a light."""
        return self._number.get((lane, target), -1)

    def ahead(self, links: IntArray) -> Int32Array:
        """What lights show on links; :class:`LightAhead`, none for -1."""
        if not self._lights:
            return np.zeros(len(links), dtype=np.int32)
        # A program that another one has set may be longer or shorter than that of the network.
        states = [
            self._road.light_state(light)[:size].ljust(size)
            for light, size in zip(self._lights, self._sizes, strict=True)
        ]
        letters = np.frombuffer("".join(states).encode("ascii", "replace"), dtype=np.uint8)
        found: Int32Array = np.where(links >= 0, _SHOWN[letters[links]], LightAhead.NONE)
        return found
