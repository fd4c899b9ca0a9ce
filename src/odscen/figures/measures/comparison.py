"""Two sets of runs side by side: means, differences and how sure they are.

Runs of the same seed are the same traffic under two conditions, so they are paired: the interval of
the difference is that of the mean of the pairs' differences (Student's t). Sets of other seeds are
compared by Welch's interval, which does not ask for equal variances.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.arrays import FloatArray


class Finding(StrEnum):
    """What a difference amounts to, in words."""

    ONE_SIDE = "only on one side"
    NOWHERE = "not there"
    SAME = "the same"
    TOO_FEW = "too few runs"
    CLEAR = "clear"
    UNCLEAR = "unclear"


CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Difference:
    """One figure of two sets of runs, in the figure's own unit.

    Attributes
    ----------
    a, b
        Means over the runs; ``None`` if none of them has the figure.
    difference
        ``b - a``; of paired runs only those with the figure on both sides count.
    low, high
        95 % interval of the difference; ``None`` with fewer than two runs a side.
    runs
        How many runs (pairs, if ``paired``) the difference rests on, the fewer of both sides.
    """

    a: float | None
    b: float | None
    difference: float | None
    low: float | None
    high: float | None
    paired: bool
    runs: int

    @property
    def relative(self) -> float | None:
        """Difference as a share of ``a``; ``None`` where that is nothing."""
        return self.difference / abs(self.a) if self.difference is not None and self.a else None

    @property
    def clear(self) -> bool | None:
        """Whether the interval leaves out zero; ``None`` without an interval."""
        if self.low is None or self.high is None:
            return None
        return self.low > 0.0 or self.high < 0.0

    @property
    def finding(self) -> Finding:
        """What it amounts to."""
        if self.difference is None:
            return Finding.NOWHERE if self.a is self.b else Finding.ONE_SIDE
        if self.difference == 0.0:
            return Finding.SAME
        if self.clear is None:
            return Finding.TOO_FEW
        return Finding.CLEAR if self.clear else Finding.UNCLEAR


def compare_figure(a: Mapping[int, float | None], b: Mapping[int, float | None]) -> Difference:
    """Compare one figure, given by seed."""
    known_a = {seed: value for seed, value in a.items() if value is not None}
    known_b = {seed: value for seed, value in b.items() if value is not None}
    paired = a.keys() == b.keys()
    if paired:
        both = sorted(known_a.keys() & known_b.keys())
        known_a = {seed: known_a[seed] for seed in both} or known_a
        known_b = {seed: known_b[seed] for seed in both} or known_b
    one, other = (np.array(list(known.values()), dtype=float) for known in (known_a, known_b))
    mean_a, mean_b = (float(values.mean()) if len(values) else None for values in (one, other))
    runs = min(len(one), len(other))
    if mean_a is None or mean_b is None:
        return Difference(mean_a, mean_b, None, None, None, paired, 0)
    difference = mean_b - mean_a
    margin = None
    if runs > 1:
        margin = _paired_margin(other - one) if paired else _welch_margin(one, other)
    low, high = (None, None) if margin is None else (difference - margin, difference + margin)
    return Difference(mean_a, mean_b, difference, low, high, paired, runs)


def _paired_margin(differences: FloatArray) -> float:
    r"""``t * s / sqrt(n)``, s the standard deviation of the n differences."""
    n = len(differences)
    return _student_quantile(n - 1) * float(differences.std(ddof=1)) / float(np.sqrt(n))


def _welch_margin(one: FloatArray, other: FloatArray) -> float:
    r"""``t * sqrt(u + v)``, u and v the squared errors of the means (Welch 1947)."""
    u, v = (float(values.var(ddof=1)) / len(values) for values in (one, other))
    if u + v == 0.0:
        return 0.0
    freedom = (u + v) ** 2 / (u**2 / (len(one) - 1) + v**2 / (len(other) - 1))
    return _student_quantile(freedom) * float(np.sqrt(u + v))


def _student_quantile(freedom: float) -> float:
    from scipy.special import stdtrit

    return float(stdtrit(freedom, 0.5 + CONFIDENCE / 2))
