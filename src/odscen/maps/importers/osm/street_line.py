"""Reference lines: polylines made smooth by arcs, so that the heading never jumps."""

from __future__ import annotations

import itertools
import math
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.base.arrays import FloatArray

STRAY = 0.3
"""Metres by which corners of a line may be off when it is made simpler."""
MOST_OFF = 1.2
"""Metres between a corner of the line and the arc that replaces it, where bends are not tight."""
LEAST_RADIUS = 9.0
"""Metres, of arcs at tight bends, where there is room for it."""
_SHORTEST = 0.05
_TURNS = math.radians(20.0), math.radians(130.0)
"""Turns of which the tangents meet near enough to be those of an arc."""
_SHORTEST_TANGENT = 2.0
DRIVABLE = 6.0
"""Metres of radius that a bus needs."""
_HANDLES = (0.25, 0.35, 0.45, 0.6, 0.8)
"""Shares of the chord that handles of a curve have that would be sharper."""
_UNEVEN = 0.5
"""Metres by which tangents may differ without a straight piece."""


class Pose(NamedTuple):
    """Place in metres and heading in radians, counter-clockwise from +x."""

    x: float
    y: float
    hdg: float

    def ahead(self, distance: float) -> Pose:
        """The pose so far ahead on a straight line."""
        return Pose(
            self.x + distance * math.cos(self.hdg), self.y + distance * math.sin(self.hdg), self.hdg
        )

    def left(self, distance: float) -> Pose:
        """The pose so far to the left."""
        return Pose(
            self.x - distance * math.sin(self.hdg), self.y + distance * math.cos(self.hdg), self.hdg
        )

    def back(self) -> Pose:
        """The same place, looking the other way."""
        return Pose(self.x, self.y, self.hdg + math.pi)


class Arc(NamedTuple):
    """A stretch of constant curvature, 1/m, positive to the left; 0 is a straight line."""

    start: Pose
    length: float
    curvature: float

    def pose(self, s: float) -> Pose:
        """The pose ``s`` metres along."""
        x, y, hdg = self.start
        if abs(self.curvature) < 1e-9:
            return self.start.ahead(s)
        turn = self.curvature * s
        chord = 2.0 / self.curvature * math.sin(turn / 2)
        mid = hdg + turn / 2
        return Pose(x + chord * math.cos(mid), y + chord * math.sin(mid), hdg + turn)


class StreetLine:
    """Arcs one after the other, each of which begins as the one before ends."""

    def __init__(self, arcs: Sequence[Arc]) -> None:
        self.arcs = tuple(arcs)
        self.starts = np.concatenate([[0.0], np.cumsum([arc.length for arc in arcs])])

    @property
    def length(self) -> float:
        """Metres."""
        return float(self.starts[-1])

    def pose(self, s: float) -> Pose:
        """The pose at ``s``; before the start and behind the end straight on."""
        place = int(
            np.clip(np.searchsorted(self.starts, s, side="right") - 1, 0, len(self.arcs) - 1)
        )
        if s > self.length:
            return self.arcs[-1].pose(self.arcs[-1].length).ahead(s - self.length)
        if s < 0.0:
            return self.arcs[0].start.ahead(s)
        return self.arcs[place].pose(s - float(self.starts[place]))

    def cut(self, start: float, end: float) -> StreetLine:
        """The part from ``start`` to ``end``."""
        parts = []
        for begin, arc in zip(self.starts[:-1].tolist(), self.arcs, strict=True):
            low, high = max(start, begin), min(end, begin + arc.length)
            if high - low > 1e-6:
                parts.append(Arc(arc.pose(low - begin), high - low, arc.curvature))
        return StreetLine(parts or [Arc(self.pose(start), max(end - start, 1e-3), 0.0)])

    def reversed(self) -> StreetLine:
        """The same line from its end to its start."""
        return StreetLine(
            [
                Arc(arc.pose(arc.length).back(), arc.length, -arc.curvature)
                for arc in self.arcs[::-1]
            ]
        )

    def places(self, s: FloatArray, t: FloatArray | float = 0.0) -> FloatArray:
        """Places ``(N, 2)`` at ``s``, so far to the left."""
        row = np.clip(np.searchsorted(self.starts, s, side="right") - 1, 0, len(self.arcs) - 1)
        x, y, hdg, curvature, length = self._point_columns[:, row]
        along = s - self.starts[row]
        # Before the first arc and behind the last one straight on, as at its end.
        curved = np.clip(along, 0.0, length)
        half = curvature * curved / 2
        chord = curved * np.sinc(half / np.pi)
        px, py = x + chord * np.cos(hdg + half), y + chord * np.sin(hdg + half)
        heading = hdg + 2 * half
        cos, sin = np.cos(heading), np.sin(heading)
        px, py = px + (along - curved) * cos, py + (along - curved) * sin
        placed: FloatArray = np.column_stack([px - t * sin, py + t * cos])
        return placed

    @cached_property
    def _point_columns(self) -> FloatArray:
        """x, y, heading, curvature and length of each arc; shape ``(5, N)``."""
        return np.array([(*arc.start, arc.curvature, arc.length) for arc in self.arcs]).T

    @cached_property
    def _trace_with_s(self) -> tuple[shapely.LineString, FloatArray]:
        s = np.linspace(0.0, self.length, max(2, int(self.length / 0.5) + 2))
        return shapely.LineString(self.places(s)), s

    @property
    def trace(self) -> shapely.LineString:
        """Its places every half metre."""
        return self._trace_with_s[0]

    def project(self, x: float, y: float) -> float:
        """The s of the nearest place."""
        return float(self.project_all(np.array([[x, y]]))[0])

    def project_all(self, places: FloatArray) -> FloatArray:
        """The s of the places nearest to others, shape ``(N, 2)``."""
        trace, _ = self._trace_with_s
        along = shapely.line_locate_point(trace, shapely.points(places))
        projected: FloatArray = along * self.length / max(trace.length, 1e-9)
        return projected


def smooth_line(points: Sequence[tuple[float, float]]) -> StreetLine:
    """Lay lines and arcs along a polyline, tangent to each other; ends stay where they are.

    At each corner an arc touches both segments. It is as wide as the segments allow, but stays
    within :data:`MOST_OFF` of the corner if its radius is then :data:`LEAST_RADIUS` or more.
    """
    xy = np.array(points, dtype=np.float64)
    keep = np.concatenate([[True], np.hypot(*np.diff(xy, axis=0).T) > _SHORTEST])
    xy = xy[keep]
    if len(xy) < 2:
        return StreetLine([Arc(Pose(float(xy[0][0]), float(xy[0][1]), 0.0), _SHORTEST, 0.0)])
    if len(xy) > 2:
        closed = float(np.hypot(*(xy[0] - xy[-1]))) < 1.0
        if not closed:
            xy = np.asarray(shapely.LineString(xy).simplify(STRAY).coords)
    steps = np.diff(xy, axis=0)
    lengths = np.hypot(*steps.T)
    headings = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.remainder(np.diff(headings) + math.pi, 2 * math.pi) - math.pi
    # A turn back on itself has no arc.
    turns = np.clip(turns, -math.radians(170), math.radians(170))
    count = len(turns)
    wished = np.zeros(count)
    for i in range(count):
        bend = abs(float(turns[i]))
        if bend < 1e-6:
            continue
        half = math.tan(bend / 2)
        by_offset = MOST_OFF / (1.0 / math.cos(bend / 2) - 1.0) * half
        wished[i] = max(by_offset, LEAST_RADIUS * half)
    # Corners share the segment between them; ends need none of theirs.
    tangents = wished.copy()
    for i in range(count + 1):
        before = tangents[i - 1] if i > 0 else 0.0
        after = tangents[i] if i < count else 0.0
        room = lengths[i] * (0.999 if 0 < i < count else 0.9)
        if before + after > room:
            share = room / (before + after)
            # What one does not need of its half, the other may have.
            half = room / 2
            if i == 0:
                tangents[i] = room
            elif i == count:
                tangents[i - 1] = room
            elif before < half:
                tangents[i] = room - before
            elif after < half:
                tangents[i - 1] = room - after
            else:
                tangents[i - 1] *= share
                tangents[i] *= share
    arcs: list[Arc] = []
    place = Pose(float(xy[0][0]), float(xy[0][1]), float(headings[0]))
    for i in range(count + 1):
        before = float(tangents[i - 1]) if i > 0 else 0.0
        after = float(tangents[i]) if i < count else 0.0
        straight = float(lengths[i]) - before - after
        if straight > 1e-4:
            arcs.append(Arc(place, straight, 0.0))
            place = arcs[-1].pose(straight)
        if i < count and abs(float(turns[i])) > 1e-9:
            radius = max(after, 1e-3) / math.tan(abs(float(turns[i])) / 2)
            length = radius * abs(float(turns[i]))
            if length > 1e-4:
                arcs.append(Arc(place, length, math.copysign(1.0 / radius, float(turns[i]))))
                place = arcs[-1].pose(length)
    return StreetLine(arcs)


class Cubic(NamedTuple):
    """A parametric cubic in the frame of its start.

    ``u, v = a + b p + c p^2 + d p^3`` with p from 0 to 1.
    """

    start: Pose
    length: float
    u: tuple[float, float, float, float]
    v: tuple[float, float, float, float]

    def places(self, count: int = 20) -> FloatArray:
        """Places ``(count, 2)`` along it."""
        p = np.linspace(0.0, 1.0, count)
        powers = np.vander(p, 4, increasing=True)
        u, v = powers @ np.array(self.u), powers @ np.array(self.v)
        cos, sin = math.cos(self.start.hdg), math.sin(self.start.hdg)
        placed: FloatArray = np.column_stack(
            [self.start.x + u * cos - v * sin, self.start.y + u * sin + v * cos]
        )
        return placed


def curves_between(start: Pose, end: Pose, *, bulge: float = 0.0) -> list[Cubic]:
    """A smooth curve from pose to pose; straight first or last where one end is farther away.

    As :func:`curve_between`, but a turn whose tangents meet much nearer to one of the poses is
    driven with the radius of the shorter tangent, in place of one that becomes sharp at its end,
    and one that is sharper than a bus can drive is as wide as a curve can be.
    """
    turn = math.remainder(end.hdg - start.hdg, 2.0 * math.pi)
    if bulge == 0.0 and _TURNS[0] < abs(turn) < _TURNS[1]:
        ahead, meet = _find_tangents(*_offset_in_frame(start, end), turn)
        short = min(meet, ahead)
        if short > _SHORTEST_TANGENT and max(meet, ahead) - short > _UNEVEN:
            begins, ends = start.ahead(max(0.0, ahead - short)), end.ahead(-max(0.0, meet - short))
            straight = [_draw_straight(start, begins)] if ahead > meet else []
            after = [_draw_straight(ends, end)] if meet > ahead else []
            return [*straight, curve_between(begins, ends), *after]
    curve = [curve_between(start, end, bulge=bulge)]
    if bulge == 0.0 and least_radius(curve) < DRIVABLE:
        return max((curve, *_wider_curves(start, end)), key=least_radius)
    return curve


def _wider_curves(start: Pose, end: Pose) -> Iterator[list[Cubic]]:
    """Other curves from pose to pose: two arcs, and curves with handles of other lengths."""
    along, across = end.x - start.x, end.y - start.y
    chord, ahead = math.hypot(along, across), math.atan2(across, along)
    before, behind = (math.remainder(pose.hdg - ahead, 2.0 * math.pi) for pose in (start, end))
    between = Pose(
        0.5 * (start.x + end.x), 0.5 * (start.y + end.y), ahead - 0.5 * (before + behind)
    )
    yield [curve_between(start, between), curve_between(between, end)]
    for first, second in itertools.product(_HANDLES, repeat=2):
        yield [_draw_bezier(start, end, first * chord, second * chord)]


def least_radius(parts: Sequence[Cubic]) -> float:
    """The smallest radius of curves one behind the other, metres."""
    bends = [0.0]
    p = np.linspace(0.0, 1.0, 41)
    for part in parts:
        (_, b, c, d), (_, e, f, g) = part.u, part.v
        du, dv = b + 2 * c * p + 3 * d * p * p, e + 2 * f * p + 3 * g * p * p
        ddu, ddv = 2 * c + 6 * d * p, 2 * f + 6 * g * p
        speed = np.maximum(np.hypot(du, dv), 1e-6)  # 0 where a handle has no length
        bends.append(float((np.abs(du * ddv - dv * ddu) / speed**3).max()))
    return 1.0 / max(*bends, 1e-9)


def _offset_in_frame(start: Pose, end: Pose) -> tuple[float, float]:
    """Metres ahead and to the left of a pose at which another one is."""
    dx, dy = end.x - start.x, end.y - start.y
    cos, sin = math.cos(start.hdg), math.sin(start.hdg)
    return dx * cos + dy * sin, dy * cos - dx * sin


def _find_tangents(u: float, v: float, turn: float) -> tuple[float, float]:
    """Metres along both tangents of a turn, from its start and its end, to where they meet."""
    meet = v / math.sin(turn)
    return u - meet * math.cos(turn), meet


def _draw_straight(start: Pose, end: Pose) -> Cubic:
    length = math.hypot(end.x - start.x, end.y - start.y)
    return Cubic(start, length, (0.0, length, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0))


def curve_between(start: Pose, end: Pose, *, bulge: float = 0.0) -> Cubic:
    """A smooth curve from pose to pose: a cubic Bezier curve with the handles of a circle.

    ``4/3 tan(turn / 4)`` radii; ``bulge`` makes them at least so long, metres, which widens a turn
    back.
    """
    u, v = _offset_in_frame(start, end)
    turn = math.remainder(end.hdg - start.hdg, 2.0 * math.pi)
    chord, half = math.hypot(u, v), abs(turn) / 2.0
    handle = chord / 3.0
    if half > 1e-6:
        handle = chord * 2.0 / 3.0 * math.tan(half / 2) / math.sin(half)
    handle = max(handle, bulge)
    # Where start and end are not symmetrical, as in a wide junction of a narrow street, the handles
    # are those of two tangents that meet.
    first = second = handle
    if math.radians(20) < abs(turn) < math.radians(160):
        ahead, meet = _find_tangents(u, v, turn)
        if min(meet, ahead) > 0.2 * chord:
            factor = 4.0 / 3.0 * math.tan(abs(turn) / 4) / math.tan(abs(turn) / 2)
            first, second = max(factor, 0.55) * ahead, max(factor, 0.55) * meet
    return _draw_bezier(start, end, first, second)


def _draw_bezier(start: Pose, end: Pose, first: float, second: float) -> Cubic:
    """The cubic Bezier curve from pose to pose with handles of these lengths, metres."""
    u, v = _offset_in_frame(start, end)
    turn = end.hdg - start.hdg
    out = (u - second * math.cos(turn), v - second * math.sin(turn))
    p0, p1, p2, p3 = np.array([(0.0, 0.0), (first, 0.0), out, (u, v)])
    coefficients = np.array([p0, 3 * (p1 - p0), 3 * (p2 - 2 * p1 + p0), p3 - 3 * p2 + 3 * p1 - p0])
    cu, cv = (tuple(float(c) for c in column) for column in coefficients.T)
    p = np.linspace(0.0, 1.0, 401)
    speed = np.hypot(*(c[1] + 2 * c[2] * p + 3 * c[3] * p**2 for c in (cu, cv)))
    length = float(np.trapezoid(speed, dx=1.0 / 400))
    return Cubic(start, length, cu, cv)  # type: ignore[arg-type]
