"""Borders of all lanes of a map, evaluated in one vectorised pass.

Stations along the reference line are shared by all lanes of a section, so that neighbouring lanes,
and the marking between them, have the same points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.arrays import BoolArray, FloatArray, IntArray, offsets, ranges
from odscen.drawing.map_drawing import Lines
from odscen.opendrive.road_model import GeometryKind

if TYPE_CHECKING:
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import LaneSection, OpenDrive, Road


_STEP_STRAIGHT, _STEP_CURVED, _STEP_JUNCTION = 2.0, 1.0, 0.5
"""Metres between stations before thinning; junctions have the tightest turns."""

_MOST_POINTS = 2_000_000
"""Points on all borders before thinning; maps of whole countries are drawn more coarsely."""

_SHORTEST = 0.05
"""Metres below which a plan-view geometry is an editor's leftover."""

_FAST_TYPES = frozenset({"motorway", "rural"})


class Sections(NamedTuple):
    """All lane sections that have lanes, flattened; arrays of shape ``(S,)``.

    Attributes
    ----------
    road
        Row of the road table.
    s0, s1
        Road coordinates of both ends, metres.
    step
        Metres between stations.
    fast
        Whether the road is a rural one or a motorway anywhere.
    breaks
        Where stations are needed besides: changes of geometry and of markings.
    models
        The section itself.
    rows
        Shape ``(S + 1,)``: its lanes are these rows of the road table's.
    """

    road: IntArray
    s0: FloatArray
    s1: FloatArray
    step: FloatArray
    fast: BoolArray
    breaks: tuple[tuple[float, ...], ...]
    models: tuple[LaneSection, ...]
    rows: IntArray


class Stations(NamedTuple):
    """Places along the reference line where borders are evaluated, by section, then s.

    ``left_x, left_y`` is the unit vector towards growing t, times the cosine of the roll; the
    stations of section ``i`` are ``start[i]`` up to ``start[i + 1]``.
    """

    s: FloatArray
    section: IntArray
    start: IntArray
    x: FloatArray
    y: FloatArray
    z: FloatArray
    left_x: FloatArray
    left_y: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Borders:
    """Exact borders: rows ``0..L-1`` outer borders of lanes, ``L..L+S-1`` centre lines."""

    lines: Lines
    section: IntArray
    stations: Stations
    sections: Sections


def evaluate_borders(odr: OpenDrive, table: RoadTable) -> Borders:
    """Evaluate every border of every lane of every section."""
    sections = _list_sections(odr, table)
    return _compute_borders(sections, _sample_stations(sections, table), table)


def _list_sections(odr: OpenDrive, table: RoadTable) -> Sections:
    road, s0, s1, step, fast, breaks, models, sizes = [], [], [], [], [], [], [], []
    for name, item in odr.roads.items():
        pace = _sampling_step(item)
        # Editors leave geometries of millimetres with any heading at all: no place to draw from.
        kinks = [geometry.s for geometry in item.geometry if geometry.length > _SHORTEST]
        for section in item.sections:
            n = sum(1 for lane in section.lanes if lane != 0)
            if n == 0:
                continue
            road.append(table.road_index[name])
            s0.append(section.s)
            s1.append(section.s_end)
            step.append(pace)
            fast.append(any(kind.type in _FAST_TYPES for kind in item.types))
            marks = [mark.s for lane in section.lanes.values() for mark in lane.road_marks]
            breaks.append(tuple(s for s in (*kinks, *marks) if section.s < s < section.s_end))
            models.append(section)
            sizes.append(n)
    return Sections(
        np.array(road, dtype=np.int64),
        np.array(s0, dtype=np.float64),
        np.array(s1, dtype=np.float64),
        np.array(step, dtype=np.float64),
        np.array(fast, dtype=np.bool_),
        tuple(breaks),
        tuple(models),
        offsets(np.array(sizes, dtype=np.int64)),
    )


def _sampling_step(road: Road) -> float:
    if all(geometry.kind is GeometryKind.LINE for geometry in road.geometry):
        return _STEP_STRAIGHT
    return _STEP_CURVED if road.junction is None else _STEP_JUNCTION


def _sample_stations(sections: Sections, table: RoadTable) -> Stations:
    length = sections.s1 - sections.s0
    points = float(np.sum(length / sections.step * (np.diff(sections.rows) + 1)))
    step = sections.step * max(1.0, points / _MOST_POINTS)
    n = np.maximum(np.ceil(length / step), 1.0).astype(np.int64) + 1
    section = np.repeat(np.arange(len(n)), n)
    k = ranges(np.zeros(len(n), dtype=np.int64), n)
    share = k / (n - 1)[section]
    s = sections.s0[section] * (1.0 - share) + sections.s1[section] * share
    extra = np.array([at for part in sections.breaks for at in part], dtype=np.float64)
    owner = np.repeat(np.arange(len(n)), [len(part) for part in sections.breaks])
    s, section = np.concatenate([s, extra]), np.concatenate([section, owner])
    order = np.lexsort((s, section))
    s, section = s[order], section[order]
    fresh = np.ones(len(s), dtype=np.bool_)
    fresh[1:] = (np.diff(s) > 1e-6) | (np.diff(section) != 0)
    # Both ends stay, however short the section: a line needs two points.
    fresh[:-1] |= np.diff(section) != 0
    fresh[-1:] = True
    s, section = s[fresh], section[fresh]
    # Some maps start a width record at the very end of the section; it belongs to nothing.
    s = np.minimum(s, sections.s1[section] - 1e-6)
    at = table.reference(sections.road[section], s)
    level = np.cos(at.roll)
    return Stations(
        s,
        section,
        np.searchsorted(section, np.arange(len(n) + 1)).astype(np.int64),
        at.x,
        at.y,
        at.z,
        -np.sin(at.hdg) * level,
        np.cos(at.hdg) * level,
    )


def _compute_borders(sections: Sections, stations: Stations, table: RoadTable) -> Borders:
    lane_section = np.repeat(np.arange(len(sections.road)), np.diff(sections.rows))
    section = np.concatenate([lane_section, np.arange(len(sections.road))])
    sizes = np.diff(stations.start)[section]
    place = ranges(stations.start[:-1][section], sizes)
    cut = int(sizes[: len(lane_section)].sum())
    lane = np.repeat(np.arange(len(lane_section)), sizes[: len(lane_section)])
    _inner, outer = table.lane_borders(lane, stations.s[place[:cut]])
    centre = table.lane_offset(
        sections.road[stations.section[place[cut:]]], stations.s[place[cut:]]
    )
    t = np.concatenate([outer, centre])
    xy = np.stack(
        [
            stations.x[place] + t * stations.left_x[place],
            stations.y[place] + t * stations.left_y[place],
        ],
        axis=1,
    )
    return Borders(Lines(xy, offsets(sizes)), section, stations, sections)


def thinned(lines: Lines, tolerance: float) -> Lines:
    """Leave out points that matter less than ``tolerance``, line by line (Douglas-Peucker)."""
    import shapely

    if lines.total == 0:
        return lines
    index = np.repeat(np.arange(lines.total), np.diff(lines.start))
    simple = shapely.simplify(
        shapely.linestrings(lines.xy, indices=index), tolerance, preserve_topology=False
    )
    xy, owner = shapely.get_coordinates(simple, return_index=True)
    start = np.searchsorted(owner, np.arange(lines.total + 1)).astype(np.int64)
    return Lines(np.round(xy, 2), start)


def inner_rows(table: RoadTable, lanes: int, lane_section: IntArray) -> IntArray:
    """Row of each lane's inner border: the outer one of the next lane inwards, or the centre."""
    ids = np.asarray(table.lane_id, dtype=np.int64)
    towards = np.where(ids > 0, -1, 1)
    row = np.arange(lanes) + towards
    inside = (row >= 0) & (row < lanes)
    row = np.clip(row, 0, lanes - 1)
    same = inside & (lane_section[row] == lane_section) & (ids[row] == ids + towards)
    return np.where(same, row, lanes + lane_section)
