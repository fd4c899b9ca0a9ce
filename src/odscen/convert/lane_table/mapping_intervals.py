"""Mapping intervals: stretches of one OpenDRIVE lane that are stretches of one SUMO lane."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray


SIMPLE_S = 0.005
"""Metres: knots that change s by less than this are left out."""
SIMPLE_DEVIATION = 0.01
"""Metres: the same for the deviation, which is a figure for reports and limits."""

LEAST_STEP = 1e-3
"""Metres between knots."""


class MappingInterval(NamedTuple):
    """Knots of a monotone, piecewise linear relation between s and pos.

    Attributes
    ----------
    lane
        Row of the OpenDRIVE lane.
    sumo
        Row of the SUMO lane.
    pos
        Ascending positions on the SUMO lane, metres, in terms of its length attribute.
    s
        Road coordinates, strictly ascending or strictly descending.
    deviation
        Distance between the two lane centres at each knot, metres.
    """

    lane: int
    sumo: int
    pos: FloatArray
    s: FloatArray
    deviation: FloatArray

    @property
    def span(self) -> tuple[float, float]:
        """Smallest and largest s."""
        ends = float(self.s[0]), float(self.s[-1])
        return min(ends), max(ends)


def monotone(interval: MappingInterval, *, growing: bool) -> MappingInterval | None:
    """Drop knots that run backwards; ``None`` if fewer than two are left."""
    s = interval.s if growing else -interval.s
    keep = np.flatnonzero(s >= np.maximum.accumulate(s))
    steps = (np.diff(s[keep]) > LEAST_STEP) & (np.diff(interval.pos[keep]) > LEAST_STEP)
    keep = keep[np.concatenate(([True], steps))] if len(keep) else keep
    if len(keep) < 2:
        return None
    return MappingInterval(
        interval.lane, interval.sumo, interval.pos[keep], interval.s[keep], interval.deviation[keep]
    )


def simplified(interval: MappingInterval) -> MappingInterval:
    """Leave out knots that a straight line between their neighbours gives anyway."""
    keep = np.zeros(len(interval.pos), dtype=np.bool_)
    keep[[0, -1]] = True
    open_spans = [(0, len(interval.pos) - 1)]
    while open_spans:
        low, high = open_spans.pop()
        if high - low < 2:
            continue
        inner = slice(low + 1, high)
        share = (interval.pos[inner] - interval.pos[low]) / (interval.pos[high] - interval.pos[low])
        error_s = np.abs(
            interval.s[low] + share * (interval.s[high] - interval.s[low]) - interval.s[inner]
        )
        line = interval.deviation[low] + share * (
            interval.deviation[high] - interval.deviation[low]
        )
        error = np.maximum(
            error_s / SIMPLE_S, np.abs(line - interval.deviation[inner]) / SIMPLE_DEVIATION
        )
        worst = int(np.argmax(error))
        if error[worst] > 1.0:
            middle = low + 1 + worst
            keep[middle] = True
            open_spans += [(low, middle), (middle, high)]
    return MappingInterval(
        interval.lane, interval.sumo, interval.pos[keep], interval.s[keep], interval.deviation[keep]
    )


class Span(NamedTuple):
    """Where an interval answers which SUMO lane is here: s from ``low`` to ``high`` of its lane."""

    lane: int
    low: float
    high: float
    interval: int


def answering(intervals: Sequence[MappingInterval], *, least: float = 0.01) -> list[Span]:
    """Divide the OpenDRIVE lanes among their mapping intervals; sorted, without overlaps.

    Where several SUMO lanes run over the same stretch (connections that share a connecting lane),
    the one with the smallest mean deviation answers, of equals the first. Remainders shorter than
    ``least`` metres are left out.
    """
    order = sorted(range(len(intervals)), key=lambda i: (_badness(intervals[i]), i))
    spans: dict[int, list[Span]] = {}
    for i in order:
        low, high = intervals[i].span
        lane = intervals[i].lane
        taken = spans.setdefault(lane, [])
        free = _without(low, high, taken)
        taken += [Span(lane, a, b, i) for a, b in free if b - a >= least]
        taken.sort()
    return sorted(span for taken in spans.values() for span in taken)


def _without(low: float, high: float, taken: Sequence[Span]) -> list[tuple[float, float]]:
    """What sorted, disjoint spans leave free from ``low`` to ``high``."""
    free: list[tuple[float, float]] = []
    for span in taken:
        if span.high <= low or span.low >= high:
            continue
        if span.low > low:
            free.append((low, span.low))
        low = span.high
    if high > low:
        free.append((low, high))
    return free


def _badness(interval: MappingInterval) -> float:
    return round(float(np.mean(interval.deviation)), 3)
