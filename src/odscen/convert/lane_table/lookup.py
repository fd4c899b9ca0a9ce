"""Look-up in many piecewise linear functions at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from odscen.base.arrays import FloatArray


SNAP = 0.65
"""Metres: a place this close beside the end of an interval is taken to be on it."""

_STRIDE = 1e6
"""Longer than any lane: lane number times this plus s sorts by lane, then s (exact to 1e-5 m)."""


@dataclass(frozen=True, slots=True, eq=False)
class Lookup:
    """Piecewise linear functions on intervals of many lanes, sorted by lane and place."""

    interval_lane: NDArray[np.int64]
    low: FloatArray
    high: FloatArray
    interval_key: FloatArray
    function: NDArray[np.int64]
    first: NDArray[np.int64]
    knot_key: FloatArray
    x: FloatArray
    y: FloatArray
    deviation: FloatArray

    @classmethod
    def of(
        cls,
        knots: Sequence[tuple[FloatArray, FloatArray, FloatArray]],
        intervals: Sequence[tuple[int, float, float, int]],
    ) -> Lookup:
        """Gather functions and the intervals on which they answer.

        Parameters
        ----------
        knots
            Per function x (ascending), y and deviation at its knots.
        intervals
            Lane, smallest and largest x, and number of the function; sorted, without overlaps.
        """
        table = np.array(intervals, dtype=np.float64).reshape(-1, 4)
        counts = [len(x) for x, _, _ in knots]
        first = np.concatenate(([0], np.cumsum(counts, dtype=np.int64))).astype(np.int64)
        parts = [np.concatenate([knot[i] for knot in knots] or [np.zeros(0)]) for i in range(3)]
        owner = np.repeat(np.arange(len(counts)), counts)
        return cls(
            table[:, 0].astype(np.int64),
            table[:, 1],
            table[:, 2],
            table[:, 0] * _STRIDE + table[:, 1],
            table[:, 3].astype(np.int64),
            first,
            owner * _STRIDE + parts[0],
            *parts,
        )

    def find(
        self, lane: NDArray[np.int64], x: FloatArray
    ) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
        """Find the function that answers (-1: none), the place on it, and how far off that is."""
        none = np.full(len(x), -1, dtype=np.int64)
        if not len(self.low):
            return none, x, np.zeros(len(x))
        after = np.searchsorted(self.interval_key, lane * _STRIDE + x, side="right")
        best, gap = none, np.full(len(x), np.inf)
        for candidate in (after - 1, after):
            index = np.clip(candidate, 0, len(self.low) - 1)
            off = np.maximum(np.maximum(self.low[index] - x, x - self.high[index]), 0.0)
            better = (self.interval_lane[index] == lane) & (off < gap) & (off <= SNAP)
            best = np.where(better, index, best)
            gap = np.where(better, off, gap)
        index = np.maximum(best, 0)
        on = np.clip(x, self.low[index], self.high[index])
        return np.where(best < 0, -1, self.function[index]), on, np.where(best < 0, 0.0, gap)

    def value(self, function: NDArray[np.int64], x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Value and deviation at places ``x`` of functions ``function``."""
        if not len(self.x):
            return np.zeros(len(x)), np.zeros(len(x))
        own = np.maximum(function, 0)
        after = np.searchsorted(self.knot_key, own * _STRIDE + x, side="right")
        after = np.clip(after, self.first[own] + 1, self.first[own + 1] - 1)
        before = after - 1
        share = (x - self.x[before]) / (self.x[after] - self.x[before])
        share = np.clip(share, 0.0, 1.0)
        return (
            self.y[before] + share * (self.y[after] - self.y[before]),
            self.deviation[before] + share * (self.deviation[after] - self.deviation[before]),
        )
