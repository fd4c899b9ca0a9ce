"""Shapes of trajectories as points: polylines, clothoids, clothoid splines and NURBS."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from odscen.formats.openscenario_import.import_report import RefusedError
from odscen.formats.openscenario_import.places.map_points import MapPoint
from odscen.opendrive.geometry import PlanView
from odscen.opendrive.road_model import Geometry, GeometryKind

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.places.read_positions import PositionReader

_STEP: Final = 1.0
"""Metres between the points of a curve at most."""
_MOST: Final = 5000
_SAME: Final = 1e-6
_BEYOND: Final = 0.5
"""Metres by which a place may be before or behind a trajectory without a word."""


class TrajectoryPoint(NamedTuple):
    """Where the reference point is, and its time as the file has it (0 without), seconds."""

    time: float
    at: MapPoint


def read_trajectory(
    report: ImportReport, positions: PositionReader, kind: _Element
) -> list[TrajectoryPoint]:
    """Points of the trajectory of an action, in their order; at least two.

    Raises
    ------
    RefusedError
        If its shape is unknown, or it has less than two points.
    """
    line = next(kind.iter("Trajectory"), None)
    if line is None:
        raise RefusedError(kind, "a trajectory that is not found")
    for element in kind.iter("Trajectory", "Shape", "TrajectoryRef"):
        report.mark(element, "taken")
    shape = line.find("Shape")
    body = None if shape is None else report.child(shape)
    reader = None if body is None else SHAPES.get(str(body.tag))
    if body is None or reader is None:
        raise RefusedError(line, "a trajectory without a shape")
    points = reader(report, positions, body)
    if len(points) < 2:
        raise RefusedError(body, f"a {body.tag} of less than two points")
    return _points_from(points, report.number(kind, "initialDistanceOffset", 0.0))


def trajectory_place(positions: PositionReader, kind: _Element) -> MapPoint:
    """Point of a ``TrajectoryPosition``: ``s`` metres along it and ``t`` to its left, headed along.

    Raises
    ------
    RefusedError
        If there is no trajectory.
    """
    report = positions.report
    points = read_trajectory(report, positions, kind)
    along, left = report.number(kind, "s"), positions.side * report.number(kind, "t", 0.0)
    length = _length_of(points)
    if not -_BEYOND <= along <= length + _BEYOND:
        words = f"at the end of the trajectory, which is {length:.1f} m long"
        report.mark(kind, "approximated", words)
    first, second = _points_from(points, min(max(float(along), 0.0), length))[:2]
    hdg = math.atan2(second.at.y - first.at.y, second.at.x - first.at.x)
    return MapPoint(float(first.at.x), float(first.at.y), hdg).moved(0.0, float(left))


def _length_of(points: list[TrajectoryPoint]) -> float:
    return sum(one.at.away(other.at) for one, other in itertools.pairwise(points))


def _points_from(points: list[TrajectoryPoint], metres: float) -> list[TrajectoryPoint]:
    """Points so many metres along a trajectory and after; of its last segment at least the end."""
    left = float(metres)
    if left <= 0.0:
        return points
    for row, (one, other) in enumerate(itertools.pairwise(points)):
        long = one.at.away(other.at)
        if left < long or row == len(points) - 2:
            share = min(left / long, 1.0 - 1e-6) if long > 0 else 0.0
            time = one.time + share * (other.time - one.time)
            x = one.at.x + share * (other.at.x - one.at.x)
            y = one.at.y + share * (other.at.y - one.at.y)
            hdg = math.atan2(other.at.y - one.at.y, other.at.x - one.at.x)
            return [TrajectoryPoint(time, MapPoint(x, y, hdg)), *points[row + 1 :]]
        left -= long
    return points


def _read_polyline(
    report: ImportReport, positions: PositionReader, shape: _Element
) -> list[TrajectoryPoint]:
    points: list[TrajectoryPoint] = []
    turned: list[bool] = []
    for vertex in report.children(shape, "Vertex"):
        place = _required_position(report, vertex, "Position")
        at = positions.point(place)
        turned.append(place.find("*/Orientation") is not None or place.find("*[@h]") is not None)
        points.append(TrajectoryPoint(report.number(vertex, "time", 0.0), at))
    return [
        point if own else point._replace(at=point.at._replace(hdg=_direction_at(points, row)))
        for row, (point, own) in enumerate(zip(points, turned, strict=True))
    ]


def _direction_at(points: list[TrajectoryPoint], row: int) -> float:
    """Direction in which a line leads through one of its points."""
    before, after = points[max(row - 1, 0)].at, points[min(row + 1, len(points) - 1)].at
    if before.away(after) < _SAME:
        return float(points[row].at.hdg)
    return math.atan2(after.y - before.y, after.x - before.x)


def _read_clothoid(
    report: ImportReport, positions: PositionReader, shape: _Element
) -> list[TrajectoryPoint]:
    start = positions.point(_required_position(report, shape, "Position"))
    length = _read_length(report, shape)
    bend = positions.side * report.number(shape, "curvature")
    change = positions.side * report.number(
        shape, "curvaturePrime", report.number(shape, "curvatureDot", 0.0)
    )
    begin, end = (report.number(shape, name, 0.0) for name in ("startTime", "stopTime"))
    points = _sample_spiral(start, length, bend, bend + change * length)
    _note_approximation(
        report, shape, _sagitta_of_arc(length, max(abs(bend), abs(bend + change * length)))
    )
    return _time_points(points, begin, end)


def _clothoid_spline(
    report: ImportReport, positions: PositionReader, shape: _Element
) -> list[TrajectoryPoint]:
    segments = list(report.children(shape, "ClothoidSplineSegment"))
    ends = [report.number(segment, "timeStart", 0.0) for segment in segments[1:]]
    ends.append(report.number(shape, "timeEnd", 0.0))
    trajectory_points: list[TrajectoryPoint] = []
    worst = 0.0
    for segment, end in zip(segments, ends, strict=True):
        place = report.child(segment, "PositionStart")
        if place is not None:
            start = positions.point(place)
        elif trajectory_points:
            start = trajectory_points[-1].at
        else:
            start = positions.itself(segment)
        turn = positions.side * report.number(segment, "hOffset", 0.0)
        start = start._replace(hdg=start.hdg + turn)
        bends = [
            positions.side * report.number(segment, name)
            for name in ("curvatureStart", "curvatureEnd")
        ]
        length = _read_length(report, segment)
        points = _sample_spiral(start, length, bends[0], bends[1])
        worst = max(worst, _sagitta_of_arc(length, max(abs(bend) for bend in bends)))
        more = _time_points(points, report.number(segment, "timeStart", 0.0), end)
        trajectory_points += more[1:] if trajectory_points and place is None else more
    _note_approximation(report, shape, worst)
    return trajectory_points


def _read_nurbs(
    report: ImportReport, positions: PositionReader, shape: _Element
) -> list[TrajectoryPoint]:
    """Rational B-spline; ``order`` is the degree plus one (section 6.9 of the user guide)."""
    degree = int(report.number(shape, "order")) - 1
    controls = list(report.children(shape, "ControlPoint"))
    knots = np.array([report.number(child, "value") for child in report.children(shape, "Knot")])
    if degree < 1 or len(controls) <= degree or len(knots) != len(controls) + degree + 1:
        raise RefusedError(
            shape,
            f"{len(controls)} control points and {len(knots)} knots for the order {degree + 1}",
        )
    if np.any(np.diff(knots) < 0) or knots[degree] >= knots[len(controls)]:
        raise RefusedError(shape, "knots that do not grow")
    rows, weights = [], []
    for control in controls:
        at = positions.point(_required_position(report, control, "Position"))
        rows.append((at.x, at.y, report.number(control, "time", 0.0)))
        weights.append(report.number(control, "weight", 1.0))
    if min(weights) <= 0:
        raise RefusedError(shape, f"a weight of {min(weights):g}")
    around = np.array(rows)
    reach = float(np.hypot(*np.diff(around[:, :2], axis=0).T).sum())
    count = min(max(math.ceil(reach / _STEP), 20), _MOST)
    fine = np.linspace(knots[degree], knots[len(controls)], 2 * count + 1)
    own = np.array(weights)
    whole = BSpline(knots, np.column_stack([around * own[:, None], own]), degree)(fine)
    x, y, time = (whole[:, :3] / whole[:, 3:]).T
    between = np.hypot(x[1::2] - (x[:-1:2] + x[2::2]) / 2, y[1::2] - (y[:-1:2] + y[2::2]) / 2)
    _note_approximation(report, shape, float(between.max()))
    hdg = np.arctan2(np.gradient(y[::2]), np.gradient(x[::2]))
    return [
        TrajectoryPoint(float(t), MapPoint(float(a), float(b), float(h)))
        for t, a, b, h in zip(time[::2], x[::2], y[::2], hdg, strict=True)
    ]


def _required_position(report: ImportReport, element: _Element, tag: str) -> _Element:
    found = report.child(element, tag)
    if found is None:
        raise RefusedError(element, f"{element.tag} without {tag}")
    return found


def _read_length(report: ImportReport, element: _Element) -> float:
    length = report.number(element, "length")
    if not 0 < length <= _MOST * _STEP:
        raise RefusedError(element, f"a length of {length:g} m")
    return length


def _sample_spiral(start: MapPoint, length: float, bend: float, end: float) -> list[MapPoint]:
    """Points of a clothoid, at most a step apart; ``bend`` and ``end`` are curvatures, 1/m."""
    kind = GeometryKind.SPIRAL if bend != end else GeometryKind.ARC
    params: tuple[float, ...] = (bend, end) if kind is GeometryKind.SPIRAL else (bend,)
    if bend == end == 0.0:
        kind, params = GeometryKind.LINE, ()
    shape = Geometry(0.0, start.x, start.y, start.hdg, length, kind, params)
    count = max(math.ceil(length / _STEP), 1) + 1
    found = PlanView.of([(shape,)]).at(np.zeros(count, np.int64), np.linspace(0, length, count))
    return [
        MapPoint(float(x), float(y), float(hdg))
        for x, y, hdg in zip(found.x, found.y, found.hdg, strict=True)
    ]


def _time_points(points: list[MapPoint], begin: float, end: float) -> list[TrajectoryPoint]:
    """Points with times that grow evenly along the curve."""
    times = np.linspace(begin, end, len(points))
    return [TrajectoryPoint(float(time), at) for time, at in zip(times, points, strict=True)]


def _sagitta_of_arc(length: float, bend: float) -> float:
    """Metres between an arc and its chord, at most: the sagitta."""
    chord = length / max(math.ceil(length / _STEP), 1)
    return chord * chord * bend / 8.0


def _note_approximation(report: ImportReport, shape: _Element, metres: float) -> None:
    words = f"a polyline of points up to {_STEP:g} m apart, up to {metres:.3f} m off the curve"
    report.mark(shape, "approximated", words)


SHAPES: Final[
    Mapping[str, Callable[[ImportReport, PositionReader, _Element], list[TrajectoryPoint]]]
] = {
    "Polyline": _read_polyline,
    "Clothoid": _read_clothoid,
    "ClothoidSpline": _clothoid_spline,
    "Nurbs": _read_nurbs,
}
