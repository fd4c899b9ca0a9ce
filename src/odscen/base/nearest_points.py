"""Nearest points where there are few, for which SciPy's tree need not be imported."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray, IntArray

_AT_ONCE = 1_000_000
"""Distances that are held in memory."""


def nearest(points: FloatArray, among: FloatArray) -> tuple[FloatArray, IntArray]:
    """Distance to the nearest of a few points, and its row; the first of those as near.

    Parameters
    ----------
    points, among
        ``(N, 2)`` and ``(M, 2)``, metres, same frame; ``M`` at least 1.
    """
    away, row = np.empty(len(points)), np.empty(len(points), dtype=np.int64)
    size = max(_AT_ONCE // len(among), 1)
    for begin in range(0, len(points), size):
        part = slice(begin, begin + size)
        x, y = (points[part, None, k] - among[None, :, k] for k in (0, 1))
        squares = x * x + y * y
        row[part] = squares.argmin(axis=1)
        away[part] = np.sqrt(squares.min(axis=1))
    return away, row
