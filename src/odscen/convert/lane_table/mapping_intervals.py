"""Pieces: stretches of one OpenDRIVE lane that are stretches of one SUMO lane."""

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


class Piece(NamedTuple):
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


def monotone(piece: Piece, *, growing: bool) -> Piece | None:
    """Drop knots that run backwards; ``None`` if fewer than two are left."""
    s = piece.s if growing else -piece.s
    keep = np.flatnonzero(s >= np.maximum.accumulate(s))
    steps = (np.diff(s[keep]) > LEAST_STEP) & (np.diff(piece.pos[keep]) > LEAST_STEP)
    keep = keep[np.concatenate(([True], steps))] if len(keep) else keep
    if len(keep) < 2:
        return None
    return Piece(piece.lane, piece.sumo, piece.pos[keep], piece.s[keep], piece.deviation[keep])


def simplified(piece: Piece) -> Piece:
    """Leave out knots that a straight line between their neighbours gives anyway."""
    keep = np.zeros(len(piece.pos), dtype=np.bool_)
    keep[[0, -1]] = True
    open_spans = [(0, len(piece.pos) - 1)]
    while open_spans:
        low, high = open_spans.pop()
        if high - low < 2:
            continue
        inner = slice(low + 1, high)
        share = (piece.pos[inner] - piece.pos[low]) / (piece.pos[high] - piece.pos[low])
        error_s = np.abs(piece.s[low] + share * (piece.s[high] - piece.s[low]) - piece.s[inner])
        line = piece.deviation[low] + share * (piece.deviation[high] - piece.deviation[low])
        error = np.maximum(
            error_s / SIMPLE_S, np.abs(line - piece.deviation[inner]) / SIMPLE_DEVIATION
        )
        worst = int(np.argmax(error))
        if error[worst] > 1.0:
            middle = low + 1 + worst
            keep[middle] = True
            open_spans += [(low, middle), (middle, high)]
    return Piece(piece.lane, piece.sumo, piece.pos[keep], piece.s[keep], piece.deviation[keep])


class Span(NamedTuple):
    """Where a piece answers "which SUMO lane is here": s from ``low`` to ``high`` of its lane."""

    lane: int
    low: float
    high: float
    piece: int


def answering(pieces: Sequence[Piece], *, least: float = 0.01) -> list[Span]:
    """Divide the OpenDRIVE lanes among their pieces; sorted, without overlaps.

    Where several SUMO lanes run over the same stretch (connections that share a connecting lane),
    the one with the smallest mean deviation answers, of equals the first. Remainders shorter than
    ``least`` metres are left out.
    """
    order = sorted(range(len(pieces)), key=lambda i: (_badness(pieces[i]), i))
    spans: dict[int, list[Span]] = {}
    for i in order:
        low, high = pieces[i].span
        lane = pieces[i].lane
        taken = spans.setdefault(lane, [])
        free = _without(low, high, taken)
        taken += [Span(lane, a, b, i) for a, b in free if b - a >= least]
        taken.sort()
    return sorted(span for taken in spans.values() for span in taken)


def _without(low: float, high: float, taken: Sequence[Span]) -> list[tuple[float, float]]:
    """Tell what of an interval sorted, disjoint spans leave free."""
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


def _badness(piece: Piece) -> float:
    return round(float(np.mean(piece.deviation)), 3)
