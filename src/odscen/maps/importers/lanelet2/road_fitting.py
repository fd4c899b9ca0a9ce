r"""Roads fitted to border lines: a smooth reference line, and the borders as profiles over it.

The reference line is a chain of lines and cubics that is as smooth as its lanes are wide; where it
does not follow the line between the directions by itself, ``laneOffset`` makes up for it. Offset
and widths follow the given polylines: at each s the border is where the normal of the reference
line meets it,

.. math:: (V_i + \lambda (V_{i+1} - V_i) - P(s)) \cdot T(s) = 0, \qquad t = (\ldots) \cdot N(s)

and cubics are laid through these values as far as they hold :data:`TOLERANCE`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from odscen.opendrive.geometry import PlanView
from odscen.opendrive.road_model import Cubic, Geometry, GeometryKind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray

TOLERANCE: Final = 0.003
"""Metres by which offset and widths differ from the polylines at most."""
_HEIGHT_TOLERANCE = 0.01
_ROLL_TOLERANCE = 0.002
_STEP, _FINE_STEP, _BENT = 0.5, 0.1, 0.01
"""Metres between stations; the fine one where the curvature, 1/m, is larger than the last."""
_CHORD = 0.001
"""Metres by which a border may be off the line between its places at two stations."""
_SPACINGS = (math.inf, 80.0, 40.0, 20.0, 10.0, 5.0, 2.5, 1.25)
"""Distances between the points that the reference line runs through, metres, as tried."""
_NEAR = 0.02
"""Metres from its line within which a reference line needs no better one."""
_MARGINS = (0.4, 0.1)
"""Least ``1 - curvature t`` at the borders: below 0 lanes would fold."""
_LEVEL = 0.03
"""Metres of height across a road below which it is level."""
_STEEPEST = 0.15
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)


class RoadEnd(NamedTuple):
    """A straight cut across a road: points p with ``p . outward = offset``.

    Attributes
    ----------
    outward
        Unit vector out of the road, shape ``(2,)``.
    offset
        Metres.
    """

    outward: FloatArray
    offset: float

    def beyond(self, points: FloatArray) -> FloatArray:
        """Metres by which points lie outside."""
        distance: FloatArray = points[..., :2] @ self.outward - self.offset
        return distance


@dataclass(frozen=True, slots=True, eq=False)
class FittedRoad:
    """What OpenDRIVE needs of a road.

    Attributes
    ----------
    widths
        Of the lanes from left to right.
    deviation
        Largest distance of the reference line from the line that it follows, metres.
    margin
        Least ``1 - curvature t`` at the borders.
    stations, sides
        s of samples, and t of each border there, from left to right: shape ``(borders, K)``.
    """

    geometry: tuple[Geometry, ...]
    length: float
    lane_offset: tuple[Cubic, ...]
    widths: tuple[tuple[Cubic, ...], ...]
    elevation: tuple[Cubic, ...]
    superelevation: tuple[Cubic, ...]
    deviation: float
    margin: float
    stations: FloatArray
    sides: FloatArray

    def locate(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Give s and t of points; those before and behind the road lie at its ends."""
        plan = PlanView.of([self.geometry])
        return _locate_points(plan, self.length, points)

    def outline(self) -> FloatArray:
        """Ring around the road: its left border, and back along its right one; ``(2 K, 2)``."""
        plan = PlanView.of([self.geometry])
        at = plan.at(np.zeros(self.stations.size, dtype=np.int64), self.stations)
        left, right = (
            np.stack([at.x - t * np.sin(at.hdg), at.y + t * np.cos(at.hdg)], axis=1)
            for t in (self.sides[0], self.sides[-1])
        )
        return np.concatenate([left, right[::-1]])

    def frame(self, s: float) -> tuple[FloatArray, float]:
        """Point of the reference line at s, shape ``(2,)``, and its heading."""
        plan = PlanView.of([self.geometry])
        at = plan.at(np.zeros(1, dtype=np.int64), np.array([s]))
        return np.array([at.x[0], at.y[0]]), float(at.hdg[0])


def cut_line(line: FloatArray, end: RoadEnd, *, last: bool) -> tuple[FloatArray, FloatArray]:
    """Cut a line at a road's end.

    Parameters
    ----------
    last
        Whether the road's end is at the line's end, or else at its start.

    Returns
    -------
    tuple
        What lies inside, up to the cut, in the direction of the line; and what lies outside, from
        the cut outwards. A line that does not reach the cut is continued straight.
    """
    run = line if last else line[::-1]
    beyond = end.beyond(run)
    inside = np.flatnonzero(beyond <= 0.0)
    if inside.size == 0:
        return (run[:1].repeat(2, axis=0), run)
    k = int(inside[-1])
    if k == len(run) - 1:
        along = run[-1] - run[-2]
        ahead = float(along[:2] @ end.outward)
        if beyond[k] > -1e-9 or ahead <= 0.2 * float(np.hypot(*along[:2])):
            cut = run[-1] - np.append(end.outward * beyond[k], 0.0)
        else:
            cut = run[-1] + along * (-beyond[k] / ahead)
        kept = np.concatenate([run, [cut]]) if beyond[k] < -1e-9 else run
        outside = cut[None]
    else:
        share = beyond[k] / (beyond[k] - beyond[k + 1])
        cut = run[k] + share * (run[k + 1] - run[k])
        kept = np.concatenate([run[: k + 1], [cut]])
        outside = np.concatenate([[cut], run[k + 1 :]])
    return (kept if last else kept[::-1], outside)


def without_repeats(line: FloatArray) -> FloatArray:
    """A line without points that repeat the one before, but with at least two."""
    apart = np.hypot(*np.diff(line[:, :2], axis=0).T)
    kept = np.concatenate([[True], apart > 1e-6])
    return line[kept] if kept.sum() > 1 else line[[0, -1]]


def along_line(line: FloatArray, at: FloatArray) -> FloatArray:
    """Points of a polyline at arc lengths, shape ``(K, columns)``; arc length in the plane."""
    run = arc_lengths(line)
    return np.stack([np.interp(at, run, column) for column in line.T], axis=1)


def arc_lengths(line: FloatArray) -> FloatArray:
    """Arc length in the plane at each point of a polyline."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line[:, :2], axis=0).T))])


def middle_line(left: FloatArray, right: FloatArray) -> FloatArray:
    """Line in the middle of two, by shares of their lengths; shape ``(N, 3)``."""
    runs = [arc_lengths(line) for line in (left, right)]
    shares = np.unique(
        np.concatenate([run / run[-1] if run[-1] > 0 else run[:1] for run in runs]).round(9)
    )
    first, second = (
        along_line(line, shares * run[-1]) for line, run in zip((left, right), runs, strict=True)
    )
    middle: FloatArray = (first + second) / 2.0
    return without_repeats(middle)


def fit_road(
    borders: Sequence[FloatArray], separator: int, start_hdg: float, end_hdg: float
) -> FittedRoad:
    """Fit a road to its borders.

    Parameters
    ----------
    borders
        From left to right, shape ``(N, 3)`` each, along the road; they begin and end at the cuts.
    separator
        Index of the border at which lanes have the id 0.
    start_hdg, end_hdg
        Directions of the road at its ends, rad: the cuts are square to them.
    """
    borders = [without_repeats(border) for border in borders]
    centre = middle_line(borders[0], borders[-1])
    fits: list[tuple[float, float, tuple[Geometry, ...], float]] = []
    best = None
    for base in (borders[separator], centre):
        if arc_lengths(base)[-1] < 1e-3:
            continue
        fits = _try_references(base, start_hdg, end_hdg, borders)
        for least in _MARGINS:
            good = [fit for fit in fits if fit[1] >= least]
            if good:
                best = min(good, key=lambda fit: (max(fit[0], _NEAR), len(fit[2])))
                break
        if best is not None:
            break
    if best is None:
        best = max(fits, key=lambda fit: fit[1])
    deviation, margin, geometry, length = best
    plan = PlanView.of([geometry])
    stations = _choose_stations(plan, length, borders)
    sides, heights = _measure_borders(plan, stations, borders)
    # Borders that cross would make negative widths: the outer one gives way.
    for k in range(separator - 1, -1, -1):
        sides[k] = np.maximum(sides[k], sides[k + 1])
    for k in range(separator + 1, len(borders)):
        sides[k] = np.minimum(sides[k], sides[k - 1])
    offset = sides[separator]
    lane_offset = () if np.abs(offset).max() < TOLERANCE / 2 else fit_cubics(stations, offset)
    widths = tuple(
        fit_cubics(stations, sides[k] - sides[k + 1], floor=True) for k in range(len(borders) - 1)
    )
    elevation, superelevation = _fit_surface(stations, sides, heights, separator)
    return FittedRoad(
        geometry,
        length,
        lane_offset,
        widths,
        elevation,
        superelevation,
        deviation,
        margin,
        stations,
        sides,
    )


# ----------------------------------------------------------------------------- reference line
def _try_references(
    base: FloatArray, start_hdg: float, end_hdg: float, borders: Sequence[FloatArray]
) -> list[tuple[float, float, tuple[Geometry, ...], float]]:
    """Reference lines of several finenesses: deviation, margin, geometry, length."""
    size = float(arc_lengths(base)[-1])
    fits: list[tuple[float, float, tuple[Geometry, ...], float]] = []
    counts: set[int] = set()
    for spacing in _SPACINGS:
        count = 1 if math.isinf(spacing) else max(1, round(size / spacing))
        if count in counts:
            continue
        counts.add(count)
        at = np.linspace(0.0, size, count + 1)
        knots = along_line(base, at)[:, :2]
        reach = 0.5 * size / count
        ahead = along_line(base, np.minimum(at + reach, size))[:, :2]
        behind = along_line(base, np.maximum(at - reach, 0.0))[:, :2]
        headings = np.arctan2(*(ahead - behind).T[::-1])
        headings[0], headings[-1] = start_hdg, end_hdg
        geometry = _join_knots(knots, headings)
        if geometry is None:
            continue
        length = geometry[-1].s + geometry[-1].length
        plan = PlanView.of([geometry])
        stations = np.linspace(0.0, length, max(9, math.ceil(length / 1.0) + 1))
        sides, _ = _measure_borders(plan, stations, [base, borders[0], borders[-1]])
        bend = plan.at(np.zeros(stations.size, dtype=np.int64), stations).curvature
        margin = float((1.0 - bend * sides[1:]).min())
        deviation = float(np.abs(sides[0]).max())
        fits.append((deviation, margin, geometry, length))
        if deviation < _NEAR and margin > _MARGINS[0]:
            break
    return fits


def _join_knots(knots: FloatArray, headings: FloatArray) -> tuple[Geometry, ...] | None:
    """Lines and cubics through points with given headings; ``None`` if one would turn back."""
    geometry = []
    s = 0.0
    for start, end, hdg, to_hdg in zip(
        knots[:-1], knots[1:], headings[:-1], headings[1:], strict=True
    ):
        chord = end - start
        size = float(np.hypot(*chord))
        if size < 1e-6:
            return None
        direction = math.atan2(chord[1], chord[0])
        leave = math.remainder(direction - hdg, 2.0 * math.pi)
        arrive = math.remainder(to_hdg - direction, 2.0 * math.pi)
        if max(abs(leave), abs(arrive)) > 2.0:
            return None
        if max(abs(leave), abs(arrive)) < 1e-5:
            x, y = start.tolist()
            geometry.append(Geometry(s, x, y, direction, size, GeometryKind.LINE, ()))
            s += size
            continue
        # Of an arc the handles have this length; of other curves it is a good one.
        pull = size / math.cos((abs(leave) + abs(arrive)) / 4.0) ** 2
        to = size * np.array([math.cos(leave), math.sin(leave)])
        first = np.array([pull, 0.0])
        last = pull * np.array([math.cos(leave + arrive), math.sin(leave + arrive)])
        c2, c3 = 3.0 * to - 2.0 * first - last, -2.0 * to + first + last
        share = 0.5 * (_NODES + 1.0)[:, None]
        speed = np.hypot(*(first + 2.0 * c2 * share + 3.0 * c3 * share * share).T)
        length = float(0.5 * speed @ _WEIGHTS)
        rows = np.stack([0.0 * to, first / length, c2 / length**2, c3 / length**3], axis=1)
        params = tuple(rows.ravel().tolist())
        x, y = start.tolist()
        geometry.append(Geometry(s, x, y, hdg, length, GeometryKind.PARAM_POLY3, params))
        s += length
    return tuple(geometry)


# ----------------------------------------------------------------------------- borders
def _locate_points(
    plan: PlanView, length: float, points: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Give s and t of points by the nearest point of the reference line, and Newton's method."""
    grid = np.linspace(0.0, length, max(9, math.ceil(length / _STEP) + 1))
    line = plan.at(np.zeros(grid.size, dtype=np.int64), grid)
    apart = (points[:, None, 0] - line.x) ** 2 + (points[:, None, 1] - line.y) ** 2
    s = grid[np.argmin(apart, axis=1)]
    row = np.zeros(s.size, dtype=np.int64)
    for _ in range(4):
        at = plan.at(row, s)
        dx, dy = points[:, 0] - at.x, points[:, 1] - at.y
        ahead = dx * np.cos(at.hdg) + dy * np.sin(at.hdg)
        side = -dx * np.sin(at.hdg) + dy * np.cos(at.hdg)
        s = np.clip(s + ahead / np.maximum(1.0 - at.curvature * side, 0.3), 0.0, length)
    at = plan.at(row, s)
    dx, dy = points[:, 0] - at.x, points[:, 1] - at.y
    t: FloatArray = -dx * np.sin(at.hdg) + dy * np.cos(at.hdg)
    return s, t


def _choose_stations(plan: PlanView, length: float, borders: Sequence[FloatArray]) -> FloatArray:
    """Choose where borders are measured: evenly, and at each corner of a border."""
    coarse = np.linspace(0.0, length, max(9, math.ceil(length / _STEP) + 1))
    fine = np.linspace(0.0, length, max(9, math.ceil(length / _FINE_STEP) + 1))
    bend = np.abs(plan.at(np.zeros(fine.size, dtype=np.int64), fine).curvature)
    located = [_locate_points(plan, length, border) for border in borders]
    reach = max(float(np.abs(t).max()) for _, t in located)
    # Seen from a bend a straight border is d / cos(angle): its second derivative is t curvature^2.
    curvature = np.maximum(bend[:-1], bend[1:])
    steps = np.maximum(np.ceil(np.diff(fine) * curvature * math.sqrt(reach / (8.0 * _CHORD))), 1.0)
    starts = np.repeat(np.arange(steps.size), steps.astype(np.int64))
    share = (np.arange(starts.size) - np.searchsorted(starts, starts)) / steps[starts]
    within = fine[starts] + share * np.diff(fine)[starts]
    even = np.concatenate([coarse, within[curvature[starts] > _BENT]])
    stations: FloatArray = np.sort(np.concatenate([even, *(s for s, _ in located)]))
    kept = np.concatenate([[True], np.diff(stations) > 1e-3])
    stations = stations[kept]
    stations[0], stations[-1] = 0.0, length
    return stations


def _measure_borders(
    plan: PlanView, stations: FloatArray, borders: Sequence[FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Give t and height of each border at each station, shape ``(borders, K)``."""
    at = plan.at(np.zeros(stations.size, dtype=np.int64), stations)
    tangent = np.stack([np.cos(at.hdg), np.sin(at.hdg)], axis=1)
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
    origin = np.stack([at.x, at.y], axis=1)
    sides = np.empty((len(borders), stations.size))
    heights = np.empty_like(sides)
    for row, border in enumerate(borders):
        ahead = tangent @ border[:, :2].T - (tangent * origin).sum(axis=1)[:, None]
        side = normal @ border[:, :2].T - (normal * origin).sum(axis=1)[:, None]
        a, b = ahead[:, :-1], ahead[:, 1:]
        crossed = (a <= 1e-7) & (b >= -1e-7) & (b > a)
        share = np.clip(-a / np.where(b > a, b - a, 1.0), 0.0, 1.0)
        t = side[:, :-1] + share * (side[:, 1:] - side[:, :-1])
        # Mostly each normal meets a border once: the segment is the only one that is crossed.
        picked = np.argmax(crossed, axis=1)
        counts = crossed.sum(axis=1)
        rows = np.arange(stations.size)
        last: tuple[float, int] | None = None
        for k in np.flatnonzero(counts > 1).tolist():
            segments = np.flatnonzero(crossed[k])
            if k and counts[k - 1]:
                last = float(t[k - 1, picked[k - 1]]), int(picked[k - 1])
            near = np.abs(t[k, segments] - (last[0] if last else 0.0))
            if last is not None:
                near = near + 1e-3 * np.abs(segments - last[1])
            picked[k] = segments[np.argmin(near)]
        z = border[:, 2]
        sides[row] = t[rows, picked]
        heights[row] = z[picked] + share[rows, picked] * (z[picked + 1] - z[picked])
        # Before the first or behind the last point of the border.
        outside = np.flatnonzero(counts == 0)
        first = np.abs(ahead[outside, 0]) < np.abs(ahead[outside, -1])
        end = np.where(first, 0, border.shape[0] - 1)
        sides[row, outside], heights[row, outside] = side[outside, end], z[end]
    return sides, heights


def _fit_surface(
    stations: FloatArray, sides: FloatArray, heights: FloatArray, separator: int
) -> tuple[tuple[Cubic, ...], tuple[Cubic, ...]]:
    """Elevation of the reference line, and superelevation where the borders are not level."""
    across = sides[0] - sides[-1]
    drop = heights[0] - heights[-1]
    slope = np.zeros(stations.size)
    if np.abs(drop).max() > _LEVEL:
        slope = np.clip(drop / np.maximum(across, 1.0), -_STEEPEST, _STEEPEST)
    z = heights[separator] - sides[separator] * slope
    elevation = () if np.abs(z).max() < 1e-6 else fit_cubics(stations, z, _HEIGHT_TOLERANCE)
    if not slope.any():
        return elevation, ()
    return elevation, fit_cubics(stations, np.arctan(slope), _ROLL_TOLERANCE)


def fit_cubics(
    s: FloatArray, values: FloatArray, tolerance: float = TOLERANCE, *, floor: bool = False
) -> tuple[Cubic, ...]:
    """Cubics through values over s, each as long as it holds the tolerance.

    They meet in values of the table, so they are continuous.

    Parameters
    ----------
    floor
        Whether they must not fall below zero: near it they are straight.

    Raises
    ------
    AssertionError
        Never: through two values there is a line.
    """
    records = []
    first, last = 0, s.size - 1
    while first < last:
        fitted = None
        low, high, reach = first + 1, last, 1
        # Doubling, then halving: the longest stretch that a cubic follows.
        while True:
            end = min(first + reach, last)
            trial = _fit_cubic(s, values, first, end, tolerance, floor=floor)
            if trial is None:
                high = end - 1
                break
            fitted, low = (trial, end), end + 1
            if end == last:
                high = last
                break
            reach *= 2
        while low <= high:
            middle = (low + high) // 2
            trial = _fit_cubic(s, values, first, middle, tolerance, floor=floor)
            if trial is None:
                high = middle - 1
            else:
                fitted, low = (trial, middle), middle + 1
        if fitted is None:
            raise AssertionError("two values have a line")
        records.append(fitted[0])
        first = fitted[1]
    return tuple(records)


def _fit_cubic(
    s: FloatArray, values: FloatArray, first: int, last: int, tolerance: float, *, floor: bool
) -> Cubic | None:
    """The cubic from one value to another that is nearest to those between, if near enough."""
    size = float(s[last] - s[first])
    a, rise = float(values[first]), float(values[last] - values[first])
    if last == first + 1:
        return Cubic(float(s[first]), a, rise / size, 0.0, 0.0)
    u = (s[first : last + 1] - s[first]) / size
    rest = values[first : last + 1] - a - rise * u
    # Between stations, too: through four of them there is always a cubic, which swings where the
    # border has a corner.
    between = np.interp(np.arange(4 * (last - first) + 1) / 4.0, np.arange(u.size), u)
    rest, u = np.interp(between, u, rest), between
    if float(np.abs(rest).max()) <= tolerance / 3.0:
        return Cubic(float(s[first]), a, rise / size, 0.0, 0.0)
    if floor and float(values[first : last + 1].min()) < 4.0 * tolerance:
        return None
    shape = u * (1.0 - u)
    terms = np.stack([shape, shape * u], axis=1)
    alpha, beta = np.linalg.lstsq(terms, rest, rcond=None)[0].tolist()
    if float(np.abs(terms @ (alpha, beta) - rest).max()) > tolerance:
        return None
    # u (1 - u) (alpha + beta u) + rise u
    b, c, d = rise + alpha, beta - alpha, -beta
    return Cubic(float(s[first]), a, b / size, c / size**2, d / size**3)
