"""Routes that trips have known, and which of them each takes: the logit model."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.sumo.realize.route_choice.travel_times import EdgeSteps

_STEP = 0.6180339887
"""From trip to trip of a row: they fill the interval evenly."""


@dataclass(slots=True)
class KnownRoutes:
    """Routes that have been quickest for a trip at some time.

    Attributes
    ----------
    paths
        Nodes of the lane graph.
    steps
        Edges of the lane graph along each.
    """

    paths: list[Int32Array]
    steps: list[Int32Array]

    def learn(self, path: Int32Array, edges: EdgeSteps) -> None:
        """Add a path, if it is a new one."""
        if not any(np.array_equal(path, array) for array in self.paths):
            self.paths.append(path)
            self.steps.append(edges.of(path))


def taste(trip: str) -> float:
    """Return the number from 0 to 1 that decides among routes, the same whatever they take."""
    row, _, number = trip.rpartition(".")
    first = zlib.crc32(row.encode()) / 2.0**32
    return (first + (int(number) if number.isdecimal() else 0) * _STEP) % 1.0


def chosen_route(seconds: FloatArray, number: float, *, spread: float) -> int:
    """Choose one of some routes.

    Parameters
    ----------
    seconds
        What they take, shape ``(R,)``.
    number
        Of the trip, see :func:`taste`.
    spread
        Share of the time by which a route that takes longer is taken ``e`` times as rarely; with 0
        the quickest is taken.
    """
    least = float(seconds.min())
    if not spread or len(seconds) == 1:
        return int(seconds.argmin())
    weights = np.exp((1.0 - seconds / max(least, 1e-9)) / spread)
    bounds = np.cumsum(weights)
    return min(int(np.searchsorted(bounds, number * bounds[-1], side="right")), len(seconds) - 1)
