"""From the road model to the shapes that are drawn.

Every border of every lane is evaluated once, in one vectorised pass, on stations that all lanes of
a section share, and thinned to a tolerance. Neighbouring lanes, and the marking between them, use
the same line, so that there is neither gap nor overlap.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from odscen.catalog.drawing import BRIDGE, Area, Bounds, Lines, MapDrawing, Mark, offsets, ranges
from odscen.catalog.furniture import add_furniture
from odscen.opendrive.model import DRIVABLE_TYPES, GeometryKind

if TYPE_CHECKING:
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.model import LaneSection, OpenDrive, Road, RoadMark

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

TOLERANCE = 0.03
"""Metres that a drawn border may differ from the exact one."""

_STEP_STRAIGHT, _STEP_CURVED, _STEP_JUNCTION = 2.0, 1.0, 0.5
"""Metres between stations before thinning; junctions have the tightest turns."""

_MOST_POINTS = 2_000_000
"""Points on all borders before thinning; maps of whole countries are drawn more coarsely."""

_MOST_PAIRS = 20_000_000
"""Pairs of near places to look for bridges among; a map folded onto itself has more."""

_SHORTEST = 0.05
"""Metres below which a plan-view geometry is an editor's leftover."""

_CLEARANCE = 2.5
"""Metres of height between two lanes in the same place that make one of them a bridge."""

AREA_KINDS = {
    **dict.fromkeys(DRIVABLE_TYPES, "road"),
    **dict.fromkeys(("bidirectional", "roadWorks", "special1", "special2", "special3"), "road"),
    **dict.fromkeys(("bus", "taxi", "HOV"), "bus"),
    **dict.fromkeys(("sidewalk", "walking"), "sidewalk"),
    **dict.fromkeys(("biking", "bicycle"), "bicycle"),
    **dict.fromkeys(("shoulder", "stop", "border"), "shoulder"),
    **dict.fromkeys(("tram", "rail"), "rail"),
    "parking": "parking",
    "median": "green",
    "curb": "curb",
    "restricted": "restricted",
}
"""Kind of area per lane type; lanes of type ``none`` are not drawn, others are ``other``."""

_DASHES = {"broken": (3.0, 6.0), "botts dots": (0.2, 1.0)}
_DASH_FAST = (6.0, 12.0)
"""Broken lines outside towns, as on rural roads and motorways (painted, gap; metres)."""

_FAST_TYPES = frozenset({"motorway", "rural"})
_UNPAINTED = frozenset({"none", "grass", ""})


class _Sections(NamedTuple):
    """All lane sections that have lanes, flattened; arrays of shape ``(S,)``."""

    road: IntArray
    s0: FloatArray
    s1: FloatArray
    step: FloatArray
    fast: BoolArray
    breaks: tuple[tuple[float, ...], ...]
    models: tuple[LaneSection, ...]
    rows: IntArray
    """Shape ``(S + 1,)``: rows of the road table's lanes."""


class _Stations(NamedTuple):
    """Places along the reference line where borders are evaluated."""

    s: FloatArray
    section: IntArray
    start: IntArray
    x: FloatArray
    y: FloatArray
    z: FloatArray
    left_x: FloatArray
    """Unit vector towards growing t, times the cosine of the roll."""
    left_y: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _Borders:
    """Exact borders: rows ``0..L-1`` outer borders of lanes, ``L..L+S-1`` centre lines."""

    lines: Lines
    section: IntArray
    stations: _Stations
    sections: _Sections


def map_drawing(
    odr: OpenDrive, table: RoadTable, *, name: str = "", tolerance: float = TOLERANCE
) -> MapDrawing:
    """Shapes of a whole map.

    Parameters
    ----------
    odr, table
        The road model and its evaluation.
    name
        Name of the map, for titles.
    tolerance
        Metres that drawn borders may differ from exact ones.
    """
    sections = _sections(odr, table)
    stations = _stations(sections, table)
    borders = _borders(sections, stations, table)
    thin = _thinned(borders.lines, tolerance)
    levels = _levels(borders, table)
    areas = _areas(thin, borders, table, levels)
    drawing = MapDrawing(
        name=name,
        bounds=_bounds([area.rings for area in areas]),
        areas=areas,
        marks=(*_bridge_sides(thin, borders, table, levels), *_marks(borders, levels, tolerance)),
    )
    return add_furniture(drawing, odr, table)


def _bounds(parts: list[Lines]) -> Bounds:
    xy = np.concatenate([part.xy for part in parts]) if parts else np.zeros((1, 2))
    low, high = xy.min(axis=0).tolist(), xy.max(axis=0).tolist()
    return (low[0], low[1], high[0], high[1])


def _sections(odr: OpenDrive, table: RoadTable) -> _Sections:
    road, s0, s1, step, fast, breaks, models, sizes = [], [], [], [], [], [], [], []
    for name, item in odr.roads.items():
        pace = _step(item)
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
    return _Sections(
        np.array(road, dtype=np.int64),
        np.array(s0, dtype=np.float64),
        np.array(s1, dtype=np.float64),
        np.array(step, dtype=np.float64),
        np.array(fast, dtype=np.bool_),
        tuple(breaks),
        tuple(models),
        offsets(np.array(sizes, dtype=np.int64)),
    )


def _step(road: Road) -> float:
    if all(geometry.kind is GeometryKind.LINE for geometry in road.geometry):
        return _STEP_STRAIGHT
    return _STEP_CURVED if road.junction is None else _STEP_JUNCTION


def _stations(sections: _Sections, table: RoadTable) -> _Stations:
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
    return _Stations(
        s,
        section,
        np.searchsorted(section, np.arange(len(n) + 1)).astype(np.int64),
        at.x,
        at.y,
        at.z,
        -np.sin(at.hdg) * level,
        np.cos(at.hdg) * level,
    )


def _borders(sections: _Sections, stations: _Stations, table: RoadTable) -> _Borders:
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
    return _Borders(Lines(xy, offsets(sizes)), section, stations, sections)


def _thinned(lines: Lines, tolerance: float) -> Lines:
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


def _inner_rows(table: RoadTable, lanes: int, lane_section: IntArray) -> IntArray:
    """Row of each lane's inner border: the outer one of the next lane inwards, or the centre."""
    ids = np.asarray(table.lane_id, dtype=np.int64)
    towards = np.where(ids > 0, -1, 1)
    row = np.arange(lanes) + towards
    inside = (row >= 0) & (row < lanes)
    row = np.clip(row, 0, lanes - 1)
    same = inside & (lane_section[row] == lane_section) & (ids[row] == ids + towards)
    return np.where(same, row, lanes + lane_section)


def _areas(thin: Lines, borders: _Borders, table: RoadTable, levels: IntArray) -> tuple[Area, ...]:
    lanes = len(table.lane_keys)
    if lanes == 0:
        return ()
    outer, ids = np.arange(lanes), np.asarray(table.lane_id)
    inner = _inner_rows(table, lanes, borders.section[:lanes])
    # Counter-clockwise: out along the right border, back along the left one.
    ahead, back = np.where(ids < 0, outer, inner), np.where(ids < 0, inner, outer)
    sizes = np.diff(thin.start)
    first = np.stack([thin.start[:-1][ahead], thin.start[1:][back] - 1], axis=1).ravel()
    counts = np.stack([sizes[ahead], sizes[back]], axis=1).ravel()
    steps = np.tile(np.array([1, -1], dtype=np.int64), lanes)
    rings = Lines(
        thin.xy[ranges(first, counts, step=steps)], offsets(counts.reshape(-1, 2).sum(axis=1))
    )
    solid = np.abs(_ring_areas(rings)) > 0.01
    kinds = np.array([AREA_KINDS.get(kind, "other") for kind in table.lane_type])
    drawn = solid & (np.array(table.lane_type) != "none")
    level = levels[borders.section[:lanes]]
    groups = sorted({(int(a), str(b)) for a, b in zip(level[drawn], kinds[drawn], strict=True)})
    return tuple(
        Area(at, kind, rings.take(drawn & (level == at) & (kinds == kind))) for at, kind in groups
    )


def _ring_areas(rings: Lines) -> FloatArray:
    """Signed area of each ring, m2, positive counter-clockwise."""
    following = np.arange(1, len(rings.xy) + 1)
    following[rings.start[1:] - 1] = rings.start[:-1]
    x, y = rings.xy.T
    cross = x * y[following] - x[following] * y
    area: FloatArray = np.add.reduceat(cross, rings.start[:-1]) / 2.0
    return area


def _levels(borders: _Borders, table: RoadTable) -> IntArray:
    """Level of each section: one above whatever it passes over by :data:`_CLEARANCE`."""
    sections, stations = borders.sections, borders.stations
    levels = np.zeros(len(sections.road), dtype=np.int64)
    if len(stations.z) == 0 or np.ptp(stations.z) < _CLEARANCE:
        return levels
    from scipy.spatial import cKDTree

    lanes = len(table.lane_keys)
    inner = _inner_rows(table, lanes, borders.section[:lanes])
    drivable = np.flatnonzero([kind in DRIVABLE_TYPES for kind in table.lane_type])
    sizes = np.diff(borders.lines.start)[drivable]
    within = ranges(np.zeros(len(drivable), dtype=np.int64), sizes)
    lane = np.repeat(drivable, sizes)
    use = within % 3 == 0
    within, lane = within[use], lane[use]
    first = borders.lines.start
    outside, inside = first[lane] + within, first[inner[lane]] + within
    xy = (borders.lines.xy[outside] + borders.lines.xy[inside]) / 2.0
    section = borders.section[lane]
    z = stations.z[stations.start[section] + within]
    tree = cKDTree(xy)
    if tree.count_neighbors(tree, 3.0) > 2 * _MOST_PAIRS:
        return levels
    pairs = tree.query_pairs(3.0, output_type="ndarray")
    drop = z[pairs[:, 1]] - z[pairs[:, 0]]
    apart = np.abs(drop) > _CLEARANCE
    pairs, drop = section[pairs[apart]], drop[apart]
    low = np.where(drop > 0, pairs[:, 0], pairs[:, 1])
    high = np.where(drop > 0, pairs[:, 1], pairs[:, 0])
    low, high = np.unique(np.stack([low, high]), axis=1)
    for _ in range(3):  # no junction has more than four storeys, and a loop must end
        np.maximum.at(levels, high, levels[low] + 1)
    return np.minimum(levels, 3)


def _bridge_sides(thin: Lines, borders: _Borders, table: RoadTable, levels: IntArray) -> list[Mark]:
    """Outermost borders of the drawn lanes of every section above ground."""
    lanes = len(table.lane_keys)
    ids, drawn = np.asarray(table.lane_id), np.array(table.lane_type) != "none"
    sides: dict[int, list[int]] = {}
    for section in np.flatnonzero(levels).tolist():
        rows = np.arange(borders.sections.rows[section], borders.sections.rows[section + 1])
        rows = rows[drawn[rows]]
        left, right = rows[ids[rows] > 0], rows[ids[rows] < 0]
        outer = [left[-1] if len(left) else lanes + section]
        outer.append(right[0] if len(right) else lanes + section)
        sides.setdefault(int(levels[section]), []).extend(int(row) for row in outer)
    return [
        Mark(level, BRIDGE, 1.0, None, thin.take(np.array(sides[level]))) for level in sorted(sides)
    ]


class _Stroke(NamedTuple):
    """One painted line: a stretch of a border, shifted sideways, in a style."""

    row: int
    section: int
    s_from: float
    s_to: float
    shift: float
    style: tuple[str, float, tuple[float, float] | None]


def _marks(borders: _Borders, levels: IntArray, tolerance: float) -> tuple[Mark, ...]:
    strokes = _strokes(borders.sections)
    if not strokes:
        return ()
    stations = borders.stations
    section = np.array([stroke.section for stroke in strokes])
    row = np.array([stroke.row for stroke in strokes])
    # One ascending key over all sections finds both ends of all strokes in two calls.
    base = offsets(np.ceil(borders.sections.s1 - borders.sections.s0).astype(np.int64) + 2)[:-1]
    low_s = borders.sections.s0
    key = base[stations.section] + stations.s - low_s[stations.section]
    ends = np.array([(stroke.s_from, stroke.s_to) for stroke in strokes])
    first = np.searchsorted(key, base[section] + ends[:, 0] - low_s[section] - 1e-5)
    last = np.searchsorted(key, base[section] + ends[:, 1] - low_s[section] + 1e-5)
    sizes = last - first
    place = ranges(first, sizes)
    on_line = place + np.repeat(borders.lines.start[row] - stations.start[section], sizes)
    shift = np.repeat(np.array([stroke.shift for stroke in strokes]), sizes)[:, None]
    normal = np.stack([stations.left_x[place], stations.left_y[place]], axis=1)
    exact = Lines(borders.lines.xy[on_line] + shift * normal, offsets(sizes))
    level = levels[section]
    kept = np.flatnonzero(sizes >= 2)
    thin = _thinned(exact.take(kept), tolerance)
    groups: dict[tuple[int, str, float, tuple[float, float]], list[int]] = {}
    for line, stroke in enumerate(kept.tolist()):
        color, width, dash = strokes[stroke].style
        style = (int(level[stroke]), color, width, dash or (0.0, 0.0))
        groups.setdefault(style, []).append(line)
    return tuple(
        Mark(at, color, width, dash if dash[0] else None, thin.take(np.array(groups[style])))
        for style in sorted(groups)
        for at, color, width, dash in [style]
    )


def _strokes(sections: _Sections) -> list[_Stroke]:
    lanes = int(sections.rows[-1])
    strokes = []
    for index, model in enumerate(sections.models):
        row = int(sections.rows[index])
        ids = sorted(lane for lane in model.lanes if lane != 0)
        rows = {lane: row + k for k, lane in enumerate(ids)}
        rows[0] = lanes + index
        fast = bool(sections.fast[index])
        for lane, item in model.lanes.items():
            marks = item.road_marks
            for k, mark in enumerate(marks):
                s_from = max(mark.s, model.s)
                s_to = marks[k + 1].s if k + 1 < len(marks) else model.s_end
                if s_to - s_from < 0.05 or mark.type in _UNPAINTED:
                    continue
                strokes += [
                    _Stroke(rows[lane], index, s_from, min(s_to, model.s_end), shift, style)
                    for shift, style in _mark_styles(mark, lane, fast=fast)
                ]
    return strokes


def _mark_styles(
    mark: RoadMark, lane: int, *, fast: bool
) -> list[tuple[float, tuple[str, float, tuple[float, float] | None]]]:
    """Sideways shift and style of the one or two lines of a marking.

    Double lines are named from the inside to the outside, at the centre from left to right
    (section 11.9).
    """
    width = mark.width if 0.02 <= mark.width <= 1.0 else (0.25 if mark.weight == "bold" else 0.12)
    width = round(width, 2)
    color = "white" if mark.color in {"standard", ""} else mark.color
    if mark.type == "curb":
        color = "curb"
    parts = mark.type.split() if mark.type != "botts dots" else ["botts dots"]
    broken = _DASH_FAST if fast else _DASHES["broken"]
    dashes = [broken if part == "broken" else _DASHES.get(part) for part in parts]
    if len(parts) == 1:
        return [(0.0, (color, width, dashes[0]))]
    # Given widths of double lines may span both; a painted line is seldom over 15 cm.
    thin = min(width, 0.15)
    sign = 1.0 if lane > 0 else -1.0
    return [(-sign * thin, (color, thin, dashes[0])), (sign * thin, (color, thin, dashes[1]))]
