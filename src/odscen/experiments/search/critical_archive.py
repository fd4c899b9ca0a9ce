"""What a search has found: critical cases that differ, and how much of the space was looked at."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray

DISTINCT: Final = 0.1
"""Share of a range by which two cases differ in some parameter if they are not the same again."""
CELLS: Final = 5
"""Parts of each range in which coverage is counted."""


def distinct(places: FloatArray, scores: Sequence[float], *, apart: float = DISTINCT) -> list[int]:
    """Rows of an archive: the most critical of cases that are alike.

    Parameters
    ----------
    places
        Critical cases in the unit cube, shape ``(cases, axes)``.
    scores
        How critical each is; the earlier of two that are equal is kept.
    apart
        Two cases are alike if no share differs by so much.

    Returns
    -------
    list of int
        Rows in order, so that any two are ``apart`` and every other case is like one of them.
    """
    kept: list[int] = []
    for row in sorted(range(len(places)), key=lambda row: (-scores[row], row)):
        away = np.abs(places[kept] - places[row]).max(axis=1) if kept else np.array([1.0])
        if np.all(away >= apart):
            kept.append(row)
    return sorted(kept)


def pair_coverage(places: FloatArray, *, cells: int = CELLS) -> float:
    """Share of the cells of all planes of two axes in which a case lies; of one axis, of its parts.

    Each axis has ``cells`` equal parts. It is the share of pairs of values that were tried, as in
    combinatorial testing of strength two; ``n`` cases cover at most ``n`` cells of a plane.
    """
    if not len(places):
        return 0.0
    parts = np.minimum((places * cells).astype(np.int64), cells - 1)
    axes = places.shape[1]
    if axes == 1:
        return len(np.unique(parts)) / cells
    found = [len(np.unique(parts[:, [a, b]], axis=0)) for a, b in combinations(range(axes), 2)]
    return float(np.mean(found)) / cells**2
