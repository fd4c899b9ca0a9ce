"""How speeds change over time, and lines on the ground that road users are moved along.

What changes, a speed or an offset, has done a share p of it, with x = t/T from 0 to 1:

    linear  p = x
    cosine  p = (1 - cos(pi x)) / 2
    cubic   p = x^2 (3 - 2 x)

Of the last two it begins and ends without a change; they are fastest in the middle, pi/2 and 3/2
times as fast as the first. An offset may also change with the metres along its line; x is then the
share of these.

    v(t) = v0 + dv p                    e(t) = e0 + de p
    s(t) = v0 t + dv T P(x), P the integral of p from 0 to x: x^2/2, (x - sin(pi x)/pi)/2 and
           x^3 - x^4/2

with dv = v1 - v0; before it the speed is v0, after it v1.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.scenario.document.rules_document import SpeedChange
    from odscen.scenario.story.road_view import Point


def share_done(shape: str, x: float) -> float:
    """Share of a change that is done after a share ``x``, 0 to 1, of its time or metres."""
    if shape == "cosine":
        return (1.0 - math.cos(math.pi * x)) / 2.0
    return x * x * (3.0 - 2.0 * x) if shape == "cubic" else x


def share_slope(shape: str, x: float) -> float:
    """Derivative of :func:`share_done`: how fast it changes after ``x``, of an even change."""
    if shape == "cosine":
        return math.pi * math.sin(math.pi * x) / 2.0
    return 6.0 * x * (1.0 - x) if shape == "cubic" else 1.0


def _share_summed(shape: str, x: float) -> float:
    """Integral of :func:`share_done` from 0 to ``x``."""
    if shape == "cosine":
        return (x - math.sin(math.pi * x) / math.pi) / 2.0
    return x**3 - x**4 / 2.0 if shape == "cubic" else x * x / 2.0


STEEPEST = {"linear": 1.0, "cosine": math.pi / 2.0, "cubic": 1.5}
"""How much faster than in an even change it changes at most, by shape."""
SHARPEST = {"linear": 6.0, "cosine": math.pi**2 / 2.0, "cubic": 6.0}
"""Largest acceleration of a change, in its whole over the square of its time.

That of an even change is infinite where it begins and ends; it is taken to last as long as a cubic.
"""


@dataclass(frozen=True, slots=True)
class SpeedLaw:
    """From ``begin`` on, within ``duration`` seconds, from ``v0`` to ``v1``.

    Attributes
    ----------
    begin, duration
        Instant, and seconds from there to the last speed.
    v0, v1
        First and last speed, m/s.
    shape
        ``linear``, ``cosine`` or ``cubic``.
    """

    begin: float
    v0: float
    v1: float
    duration: float = 0.0
    shape: str = "linear"

    @property
    def end(self) -> float:
        """Instant from which on the speed is ``v1``."""
        return self.begin + self.duration

    def speed(self, instant: float) -> float:
        """Speed at an instant, m/s."""
        t = instant - self.begin
        if t >= self.duration:
            return self.v1
        share = share_done(self.shape, max(t, 0.0) / self.duration)
        return self.v0 + (self.v1 - self.v0) * share

    def metres(self, start: float, stop: float) -> float:
        """Metres from one instant to another."""
        return self._metres_covered(stop - self.begin) - self._metres_covered(start - self.begin)

    def _metres_covered(self, t: float) -> float:
        if t <= 0.0:
            return self.v0 * t
        inside, change = min(t, self.duration), self.v1 - self.v0
        covered = self.v0 * inside + self.v1 * (t - inside)
        if inside <= 0.0:
            return covered
        return covered + change * self.duration * _share_summed(self.shape, inside / self.duration)


@dataclass(frozen=True, slots=True)
class SpeedTable:
    """From ``begin`` on, speeds at instants, even between them.

    ``knots`` are seconds since the begin and m/s, in order; two at one instant are a jump.
    """

    begin: float
    knots: tuple[tuple[float, float], ...]

    @property
    def end(self) -> float:
        """Instant of the last speed."""
        return self.begin + self.knots[-1][0]

    @property
    def v1(self) -> float:
        """Last speed, m/s."""
        return self.knots[-1][1]

    def speed(self, instant: float) -> float:
        """Speed at an instant, m/s."""
        t = instant - self.begin
        for (t0, v0), (t1, v1) in itertools.pairwise(self.knots):
            if t0 <= t < t1:
                return v0 + (v1 - v0) * (t - t0) / (t1 - t0)
        return self.knots[0][1] if t < self.knots[0][0] else self.v1

    def metres(self, start: float, stop: float) -> float:
        """Metres from one instant to another."""
        return self._metres_covered(stop - self.begin) - self._metres_covered(start - self.begin)

    def _metres_covered(self, t: float) -> float:
        if t <= 0.0:
            return self.knots[0][1] * t
        covered = 0.0
        for (t0, v0), (t1, v1) in itertools.pairwise(self.knots):
            if t <= t0:
                break
            inside = min(t, t1) - t0
            if inside > 0.0:
                covered += inside * (v0 + (v1 - v0) * inside / (t1 - t0) / 2.0)
        return covered + self.v1 * max(0.0, t - self.knots[-1][0])


AnyLaw = SpeedLaw | SpeedTable


def law_from_state(state: Mapping[str, Any] | None) -> AnyLaw | None:
    """Law from what ``asdict`` has made of it and JSON has kept."""
    if state is None:
        return None
    if "knots" in state:
        return SpeedTable(state["begin"], tuple((t, v) for t, v in state["knots"]))
    return SpeedLaw(**state)


def steady(begin: float, speed: float) -> SpeedLaw:
    """One speed for ever."""
    return SpeedLaw(begin, speed, speed)


def speed_change(change: SpeedChange, begin: float, speed: float) -> SpeedLaw:
    """Law of a change of speed that begins with ``speed``."""
    difference = abs(change.to - speed)
    duration = 0.0
    if change.over is not None:
        duration = change.over
    elif change.within is not None:
        duration = 2.0 * change.within / max(change.to + speed, 1e-9)
    elif change.rate is not None:
        duration = STEEPEST.get(change.shape, 1.0) * difference / change.rate
    if difference == 0.0 and change.over is None:
        duration = 0.0
    return SpeedLaw(begin, speed, change.to, duration, change.shape)


def braking(by: float, begin: float, speed: float) -> SpeedLaw:
    """Law of braking to a standstill with ``by`` m/s^2."""
    return SpeedLaw(begin, speed, 0.0, speed / by)


def stopping(within: float | None, begin: float, speed: float) -> SpeedLaw:
    """Law of stopping after so many metres; at once if ``None``."""
    if within is None or speed <= 0.0:
        return SpeedLaw(begin, speed, 0.0)
    return SpeedLaw(begin, speed, 0.0, 2.0 * within / speed)


@dataclass(frozen=True, slots=True)
class SideLaw:
    """Offset to the left of a line, from ``e0`` to ``e1`` metres.

    Attributes
    ----------
    begin, duration
        Instant, and seconds from there to the last offset; 0 of a change with the metres.
    e0, e1
        First and last offset, metres.
    shape
        ``linear``, ``cosine`` or ``cubic``.
    start, length
        Metres along the line at which it begins, and within which it changes; no length if it
        changes with time.
    """

    begin: float
    e0: float
    e1: float
    duration: float
    shape: str = "cosine"
    start: float = 0.0
    length: float | None = None

    def offset(self, instant: float, along: float) -> float:
        """Metres to the left of the line at an instant, ``along`` metres of it."""
        share = min(1.0, max(0.0, self._find_share(instant, along)))
        return self.e0 + (self.e1 - self.e0) * share_done(self.shape, share)

    def sideways(self, instant: float, along: float, speed: float) -> float:
        """Speed to the left, m/s, at ``speed`` m/s along the line."""
        share = self._find_share(instant, along)
        if not 0.0 < share < 1.0:
            return 0.0
        pace = 1.0 / self.duration if self.length is None else speed / self.length
        return (self.e1 - self.e0) * pace * share_slope(self.shape, share)

    def _find_share(self, instant: float, along: float) -> float:
        """Share of the time or of the metres that is over; below 0 before, above 1 after it."""
        if self.length is None:
            return (instant - self.begin) / self.duration
        return (along - self.start) / self.length


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
def _line_pieces(line: tuple[Point, ...]) -> list[tuple[Point, Point, float]]:
    """Straight pieces of a line with their lengths; asked for the same lines in each step."""
    return [(a, b, math.dist(a, b)) for a, b in itertools.pairwise(line) if a != b]


def point_on(line: tuple[Point, ...], along: float, *, left: float = 0.0) -> OnLine:
    """Point of a line, moved to the left; the line goes on straight before and behind its ends."""
    rest = along
    pieces = _line_pieces(line)
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


class PlaceAlongLine(NamedTuple):
    """Where a point is along a line, and how far to its left; metres."""

    along: float
    left: float


def beside(line: Sequence[Point], point: Point) -> PlaceAlongLine:
    """Where a point lies by a line: by the nearest place of it, ends drawn out."""
    best, before = (math.inf, PlaceAlongLine(0.0, 0.0)), 0.0
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
            best = away, PlaceAlongLine(before + along, math.copysign(away, ux * py - uy * px))
        before += length
    return best[1]
