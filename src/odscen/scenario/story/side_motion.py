"""Lines on the ground that road users are moved along, and how far beside them they are.

The offset is a half-cosine over time: it begins and ends without sideways speed.

    e(t) = e0 + (e1 - e0) (1 - cos(pi t/T)) / 2
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.scenario.story.road_view import Point


@dataclass(frozen=True, slots=True)
class SideLaw:
    """Offset to the left of a line, from ``e0`` to ``e1`` metres within ``duration`` seconds."""

    begin: float
    e0: float
    e1: float
    duration: float

    @property
    def end(self) -> float:
        """Instant from which on the offset is ``e1``."""
        return self.begin + self.duration

    def offset(self, instant: float) -> float:
        """Metres to the left of the line."""
        share = min(1.0, max(0.0, (instant - self.begin) / self.duration))
        return self.e0 + (self.e1 - self.e0) * (1.0 - math.cos(math.pi * share)) / 2.0

    def sideways(self, instant: float) -> float:
        """Speed to the left, m/s."""
        share = (instant - self.begin) / self.duration
        if not 0.0 < share < 1.0:
            return 0.0
        turn = math.pi / self.duration
        return (self.e1 - self.e0) * turn * math.sin(math.pi * share) / 2.0


class OnLine(NamedTuple):
    """A point at ``along`` metres of a line: ``x``, ``y``, and the line's direction."""

    x: float
    y: float
    hdg: float


@lru_cache(maxsize=256)
def line_length(line: tuple[Point, ...]) -> float:
    """Metres of a line."""
    return sum(math.dist(a, b) for a, b in itertools.pairwise(line))


@lru_cache(maxsize=256)
def _pieces(line: tuple[Point, ...]) -> list[tuple[Point, Point, float]]:
    """Straight pieces of a line with their lengths; asked for the same lines in each step."""
    return [(a, b, math.dist(a, b)) for a, b in itertools.pairwise(line) if a != b]


def point_on(line: tuple[Point, ...], along: float, *, left: float = 0.0) -> OnLine:
    """Point of a line, moved to the left; the line goes on straight before and behind its ends."""
    rest = along
    pieces = _pieces(line)
    for index, (a, b, length) in enumerate(pieces):
        if rest <= length or index == len(pieces) - 1:
            ux, uy = (b[0] - a[0]) / length, (b[1] - a[1]) / length
            x, y = a[0] + ux * rest - uy * left, a[1] + uy * rest + ux * left
            return OnLine(x, y, math.atan2(uy, ux))
        rest -= length
    (x, y), *_ = line
    return OnLine(x, y, 0.0)


def heading_on(line: Sequence[Point], headings: Sequence[float], along: float) -> float:
    """Heading at so many metres of a line with one at each point, the shorter way between two."""
    rest = along
    for index, (a, b) in enumerate(itertools.pairwise(line)):
        length = math.dist(a, b)
        if rest < length:
            turn = math.remainder(headings[index + 1] - headings[index], math.tau)
            return headings[index] + turn * max(0.0, rest) / length
        rest -= length
    return headings[-1]


class Beside(NamedTuple):
    """Where a point is along a line, and how far to its left; metres."""

    along: float
    left: float


def beside(line: Sequence[Point], point: Point) -> Beside:
    """Where a point lies by a line: by the nearest place of it, ends drawn out."""
    best, before = (math.inf, Beside(0.0, 0.0)), 0.0
    last = len(line) - 2
    for index, (a, b) in enumerate(itertools.pairwise(line)):
        length = math.dist(a, b)
        if length == 0.0:
            continue
        ux, uy = (b[0] - a[0]) / length, (b[1] - a[1]) / length
        px, py = point[0] - a[0], point[1] - a[1]
        along = px * ux + py * uy
        along = along if index == 0 and along < 0.0 else max(0.0, along)
        along = along if index == last and along > length else min(along, length)
        away = math.hypot(px - along * ux, py - along * uy)
        if away < best[0]:
            best = away, Beside(before + along, math.copysign(away, ux * py - uy * px))
        before += length
    return best[1]
