"""Cubic profiles over s, flattened: many groups of records in few arrays.

A *group* is what one element owns: the elevations of a road, the widths of a lane. The records of
group ``i`` are rows ``first[i]`` up to ``first[i + 1]``, sorted by s. Queries name a group and an s
each and are answered all at once; there is no Python loop over roads or lanes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.arrays import FloatArray, IntArray, offsets

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from odscen.opendrive.road_model import Cubic


def locate(starts: FloatArray, first: IntArray, group: IntArray, s: FloatArray) -> IntArray:
    """Row of the last record of each query's group that starts at or before ``s``.

    Parameters
    ----------
    starts
        Start of each record, ascending within a group.
    first
        Shape ``(groups + 1,)``, see :func:`offsets`.
    group, s
        Shape ``(N,)``.

    Returns
    -------
    IntArray
        Shape ``(N,)``; the group's first row where ``s`` lies before it, -1 for an empty group.
    """
    low = first[group]
    high = first[group + 1]
    empty = low == high
    # Bisection of all groups at once: the record sought is always in [low, high).
    for _ in range(int(np.max(high - low, initial=0)).bit_length()):
        middle = (low + high) >> 1
        # middle == low only when one record is left; then nothing must move.
        right = (middle > low) & (starts[np.minimum(middle, starts.size - 1)] <= s)
        left = (middle > low) & ~right
        low = np.where(right, middle, low)
        high = np.where(left, middle, high)
    return np.where(empty, -1, low)


@dataclass(frozen=True, slots=True, eq=False)
class CubicTable:
    """Flattened cubics; ``first`` has shape ``(groups + 1,)``, ``coefficients`` ``(n, 4)``."""

    first: IntArray
    starts: FloatArray
    coefficients: FloatArray

    @classmethod
    def of(cls, groups: Sequence[tuple[Cubic, ...]]) -> CubicTable:
        """Table of one tuple of records per group."""
        flat = [value for group in groups for record in group for value in record]
        rows = np.array(flat, dtype=np.float64).reshape(-1, 5)
        return cls(offsets(map(len, groups)), rows[:, 0].copy(), rows[:, 1:].copy())

    def present(self, group: IntArray) -> NDArray[np.bool_]:
        """Whether each group has any record."""
        return self.first[group + 1] > self.first[group]

    def at(self, group: IntArray, s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Value, first and second derivative by s, each of shape ``(N,)``; 0 for empty groups."""
        if self.starts.size == 0:
            zero = np.zeros(np.shape(s))
            return zero, zero, zero
        row = locate(self.starts, self.first, group, s)
        ds = s - self.starts[row]
        a, b, c, d = self.coefficients[row].T
        # a + b ds + c ds^2 + d ds^3
        value = a + ds * (b + ds * (c + ds * d))
        slope = b + ds * (2.0 * c + ds * 3.0 * d)
        bend = 2.0 * c + 6.0 * d * ds
        empty = row < 0
        if empty.any():
            value, slope, bend = (np.where(empty, 0.0, part) for part in (value, slope, bend))
        return value, slope, bend


@dataclass(frozen=True, slots=True, eq=False)
class StepTable:
    """Flattened records that hold from their ``s`` to the next one's; ``values`` ``(records,)``."""

    first: IntArray
    starts: FloatArray
    values: FloatArray

    @classmethod
    def of(cls, groups: Sequence[Sequence[tuple[float, float]]]) -> StepTable:
        """Table of one sequence of ``(s, value)`` per group."""
        flat = [number for group in groups for record in group for number in record]
        rows = np.array(flat, dtype=np.float64).reshape(-1, 2)
        return cls(offsets(map(len, groups)), rows[:, 0].copy(), rows[:, 1].copy())

    def at(self, group: IntArray, s: FloatArray, *, default: float) -> FloatArray:
        """Value of the record that holds at ``s``; ``default`` where there is none."""
        if self.starts.size == 0:
            return np.full(np.shape(s), default)
        row = locate(self.starts, self.first, group, s)
        holds = (row >= 0) & (self.starts[row] <= s)
        return np.where(holds, self.values[row], default)
