"""Roads with another shape: a reference line that is led elsewhere, profiles that are added."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from odscen.maps.importers.osm.road_plan import write_geometry
from odscen.maps.importers.osm.street_line import Pose, curve_between
from odscen.opendrive import road_model as model

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.opendrive.lanes import RoadTable

_PIECE = 3.0
"""Metres of the cubics by which a line is drawn anew."""
_NO_PROFILE = model.Cubic(0.0, 0.0, 0.0, 0.0, 0.0)


_Row = TypeVar(
    "_Row", model.RoadMark, model.LaneSpeed, model.LaneHeight, model.LaneAccess, model.RoadType
)


class Displacement(NamedTuple):
    """How a reference line is moved between two of its stations, metres.

    By ``(x, y)`` times a share: 1 at ``peak``, from there to 0 at ``begin`` and ``end``, with
    heading and curvature kept at all three. ``peak`` may be one of the two.
    """

    x: float
    y: float
    begin: float
    peak: float
    end: float

    def share(self, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The share at stations, and its change per metre.

        6 p^5 - 15 p^4 + 10 p^3 with p from 0 at a foot to 1 at the peak.
        """
        before, after = max(self.peak - self.begin, 1e-9), max(self.end - self.peak, 1e-9)
        rising = s <= self.peak if self.peak > self.begin else s < self.peak
        p = np.where(rising, (s - self.begin) / before, (self.end - s) / after).clip(0.0, 1.0)
        slope = np.where(rising, 1.0 / before, -1.0 / after)
        return p**3 * (10.0 - 15.0 * p + 6.0 * p**2), 30.0 * p**2 * (1.0 - p) ** 2 * slope


def add_profiles(
    first: Iterable[model.Cubic], second: Iterable[model.Cubic]
) -> tuple[model.Cubic, ...]:
    """Sum of two profiles; before its first cubic a profile is zero."""
    a, b = sorted(first), sorted(second)
    total = []
    for s in sorted({cubic.s for cubic in (*a, *b)}):
        pairs = zip(_cubic_from(a, s), _cubic_from(b, s), strict=True)
        total.append(model.Cubic(s, *(x + y for x, y in pairs)))
    return tuple(total)


def _cubic_from(profile: Sequence[model.Cubic], s: float) -> tuple[float, float, float, float]:
    """Coefficients of the profile at ``s``, for ds from there."""
    before = [cubic for cubic in profile if cubic.s <= s]
    start, a, b, c, d = before[-1] if before else _NO_PROFILE
    h = s - start if before else 0.0
    return (a + h * (b + h * (c + h * d)), b + h * (2 * c + 3 * h * d), c + 3 * h * d, d)


def reshape_road(road: model.Road, table: RoadTable, by: Displacement) -> tuple[model.Road, float]:
    """Lead a reference line elsewhere; all that lies on the road moves along with it.

    Lines and arcs outside of the displacement stay as they are; within it the line becomes cubics
    of 3 m. Stations are stretched there, and behind it shifted, by the length that was gained.

    Returns
    -------
    Road, float
        The road, and the least radius of the line that was drawn, metres.
    """
    begin, end = by.begin, by.end
    for piece in road.geometry:
        if piece.kind in (model.GeometryKind.LINE, model.GeometryKind.ARC):
            continue
        # A spiral or cubic is drawn anew as a whole.
        low, high = piece.s, piece.s + piece.length
        begin = low if low < begin < high else begin
        end = high if low < end < high else end
    s = np.linspace(begin, end, max(3, int(np.ceil((end - begin) / _PIECE)) + 1))
    line = table.reference(np.full(s.size, table.road_index[road.id]), s)
    share, change = by.share(s)
    x, y = line.x + by.x * share, line.y + by.y * share
    hdg = np.arctan2(np.sin(line.hdg) + by.y * change, np.cos(line.hdg) + by.x * change)
    poses = [Pose(*row) for row in np.stack([x, y, hdg], axis=1).tolist()]
    curves = [curve_between(a, b) for a, b in pairwise(poses)]
    lengths = np.array([curve.length for curve in curves])
    turns = np.abs(np.angle(np.exp(1j * np.diff(hdg))))
    geometry = [
        *(_cut_piece(piece, table, road, 0.0, begin) for piece in road.geometry),
        *(piece._replace(s=piece.s + begin) for piece in write_geometry(curves)),
        *(_cut_piece(piece, table, road, end, road.length) for piece in road.geometry),
    ]
    stretch = _Stretch(begin, end, float(lengths.sum()) / (end - begin))
    placed, station = [], 0.0
    for part in geometry:
        if part is not None and part.length > 1e-6:
            placed.append(part._replace(s=station))
            station += part.length
    stretched = stretch_road(road, stretch)
    stretched = replace(stretched, length=station, geometry=tuple(placed))
    radius = float((lengths / np.maximum(turns, 1e-9)).min())
    return stretched, radius


def redraw_road(
    road: model.Road, table: RoadTable, start: tuple[float, float], end: tuple[float, float]
) -> tuple[model.Road, float]:
    """Draw the line of a connecting road anew between its ends, moved by ``start`` and ``end``.

    Returns
    -------
    Road, float
        The road, and the least radius of its line, metres.
    """
    index = table.road_index[road.id]
    line = table.reference(np.array([index, index]), np.array([0.0, road.length]))
    moved = np.array([[*start, 0.0], [*end, 0.0]])
    ends = np.stack([line.x, line.y, line.hdg], axis=1) + moved
    curve = curve_between(*(Pose(*row) for row in ends.tolist()))
    stretch = _Stretch(0.0, road.length, curve.length / road.length)
    stretched = stretch_road(road, stretch)
    places = curve.places(40)
    steps = np.diff(places, axis=0)
    turns = np.abs(np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))))
    radius = float((np.hypot(*steps.T)[1:] / np.maximum(turns, 1e-9)).min())
    return replace(stretched, length=curve.length, geometry=write_geometry([curve])), radius


def _cut_piece(
    piece: model.Geometry, table: RoadTable, road: model.Road, begin: float, end: float
) -> model.Geometry | None:
    """The part of a piece of a reference line between two stations, if there is any."""
    low, high = max(piece.s, begin), min(piece.s + piece.length, end)
    if high - low < 1e-6:
        return None
    if low <= piece.s:
        return piece._replace(length=high - low)
    at = table.reference(np.array([table.road_index[road.id]]), np.array([low]))
    return piece._replace(
        x=float(at.x[0]), y=float(at.y[0]), hdg=float(at.hdg[0]), length=high - low
    )


class _Stretch(NamedTuple):
    """Stations between ``begin`` and ``end`` are stretched by a factor."""

    begin: float
    end: float
    factor: float

    def move(self, s: float) -> float:
        inside = min(max(s - self.begin, 0.0), self.end - self.begin)
        return s + inside * (self.factor - 1.0)

    def cubics(self, profile: Sequence[model.Cubic], low: float, high: float) -> list[model.Cubic]:
        """A profile that holds from ``low`` to ``high``, on the stretched road."""
        if not profile:
            return []
        stations = {cubic.s for cubic in profile}
        first = min(stations)
        stations |= {s for s in (self.begin, self.end) if max(first, low) < s < high - 1e-6}
        stretched = []
        for s in sorted(stations):
            k = self.factor if self.begin <= s < self.end else 1.0
            a, b, c, d = _cubic_from(sorted(profile), s)
            stretched.append(model.Cubic(self.move(s), a, b / k, c / k**2, d / k**3))
        return stretched


def stretch_road(road: model.Road, stretch: _Stretch) -> model.Road:
    """A road with all stations but those of its reference line moved."""
    move, end = stretch.move, road.length

    def profile(cubics: Sequence[model.Cubic]) -> tuple[model.Cubic, ...]:
        return tuple(stretch.cubics(cubics, 0.0, end))

    def placed(rows: tuple[_Row, ...]) -> tuple[_Row, ...]:
        return tuple(row._replace(s=move(row.s)) for row in rows)

    def stretch_lane(lane: model.Lane, low: float, high: float) -> model.Lane:
        return replace(
            lane,
            widths=tuple(stretch.cubics(lane.widths, low, high)),
            borders=tuple(stretch.cubics(lane.borders, low, high)),
            heights=placed(lane.heights),
            road_marks=placed(lane.road_marks),
            speeds=placed(lane.speeds),
            access=placed(lane.access),
        )

    sections = tuple(
        replace(
            section,
            s=move(section.s),
            s_end=move(section.s_end),
            lanes={
                number: stretch_lane(lane, section.s, section.s_end)
                for number, lane in section.lanes.items()
            },
        )
        for section in road.sections
    )
    return replace(
        road,
        length=move(end),
        types=placed(road.types),
        elevation=profile(road.elevation),
        superelevation=profile(road.superelevation),
        lane_offset=profile(road.lane_offset),
        sections=sections,
        objects=tuple(_move_object(item, move) for item in road.objects),
        signals=tuple(replace(item, s=move(item.s)) for item in road.signals),
        signal_references=tuple(replace(item, s=move(item.s)) for item in road.signal_references),
    )


def _move_object(item: model.RoadObject, move: Callable[[float], float]) -> model.RoadObject:
    outlines = tuple(
        outline._replace(
            corners=tuple(c if c.local else c._replace(a=move(c.a)) for c in outline.corners)
        )
        for outline in item.outlines
    )
    repeats = tuple(
        row._replace(s=move(row.s), length=move(row.s + row.length) - move(row.s))
        for row in item.repeats
    )
    return replace(item, s=move(item.s), outlines=outlines, repeats=repeats)
