"""From the road model to the shapes that are drawn.

Neighbouring lanes, and the marking between them, are made of the same thinned line, so that there
is neither gap nor overlap. Roads that pass over others are drawn a level up.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.base.arrays import Bounds, FloatArray, IntArray, offsets, ranges
from odscen.drawing.furniture import add_furniture, rings_of
from odscen.drawing.lane_borders import evaluate_borders, inner_rows, thinned
from odscen.drawing.map_drawing import BRIDGE, Area, Lines, MapDrawing, Mark
from odscen.opendrive.road_model import DRIVABLE_TYPES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from odscen.base.arrays import BoolArray
    from odscen.drawing.lane_borders import Borders, Sections
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive, RoadMark


_DASHES = {"broken": (3.0, 6.0), "botts dots": (0.2, 1.0)}
_DASH_FAST = (6.0, 12.0)
"""Broken lines outside towns, as on rural roads and motorways (painted, gap; metres)."""

_UNPAINTED = frozenset({"none", "grass", ""})

INSIDE = 0.15
"""Metres that a line lies inside the border of another lane, at least, to be painted over it."""

LEAST_PIECE = 1.0
"""Metres of a line that is left, at least."""


class _Stroke(NamedTuple):
    """One painted line: a stretch of a border, shifted sideways, in a style."""

    row: int
    section: int
    s_from: float
    s_to: float
    shift: float
    style: tuple[str, float, tuple[float, float] | None]


def road_marks(
    borders: Borders, levels: IntArray, tolerance: float, grounds: Sequence[JunctionGround] = ()
) -> tuple[Mark, ...]:
    """All painted markings, grouped by style; ``levels`` per section, ``tolerance`` in metres.

    Solid lines of connecting roads end where other connecting roads begin (``grounds``): there the
    ground of a junction is bare, and only broken lines guide drivers over it.
    """
    strokes = _list_strokes(borders.sections)
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
    thin = thinned(exact.take(kept), tolerance)
    if grounds:
        solid = np.array([strokes[stroke].style[2] is None for stroke in kept.tolist()])
        thin, pieces = _clear_grounds(thin, section[kept], solid, borders.sections.road, grounds)
        kept = kept[pieces]
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


class JunctionGround(NamedTuple):
    """Lanes for vehicles of the connecting roads of one junction on the ground.

    ``rings`` are their outlines, ``road`` the row of each one's road.
    """

    rings: Lines
    road: IntArray


def _clear_grounds(
    lines: Lines,
    section: IntArray,
    solid: BoolArray,
    roads: IntArray,
    grounds: Sequence[JunctionGround],
) -> tuple[Lines, IntArray]:
    """Cut solid lines of connecting roads where they run over other roads of their junction.

    Parameters
    ----------
    section
        Of each line.
    solid
        Of each line.
    roads
        Road of each section.

    Returns
    -------
    tuple
        The lines, or their pieces, and the line that each piece is of.
    """
    import shapely

    shapes = [lines.xy[a:b] for a, b in pairwise(lines.start.tolist())]
    pieces: dict[int, list[FloatArray]] = {n: [shape] for n, shape in enumerate(shapes)}
    own_road = roads[section]
    for ground in grounds:
        members = np.flatnonzero(solid & np.isin(own_road, ground.road))
        if not len(members):
            continue
        index = np.repeat(np.arange(ground.rings.total), np.diff(ground.rings.start))
        outlines = shapely.linearrings(ground.rings.xy, indices=index)
        lanes = shapely.buffer(shapely.make_valid(shapely.polygons(outlines)), -INSIDE)
        painted = np.array([shapely.linestrings(shapes[n]) for n in members])
        line, lane = shapely.STRtree(lanes).query(painted, predicate="intersects")
        other = ground.road[lane] != own_road[members[line]]
        for k in np.unique(line[other]).tolist():
            over = shapely.union_all(lanes[lane[other & (line == k)]])
            rest = shapely.get_parts(shapely.difference(painted[k], over))
            rest = rest[shapely.length(rest) >= LEAST_PIECE]
            pieces[int(members[k])] = [shapely.get_coordinates(part) for part in rest]
    order = [(n, part) for n, parts in pieces.items() for part in parts]
    sizes = np.array([len(part) for _, part in order], dtype=np.int64)
    xy = np.concatenate([part for _, part in order]) if order else np.empty((0, 2))
    return Lines(xy, offsets(sizes)), np.array([n for n, _ in order], dtype=np.int64)


def _list_strokes(sections: Sections) -> list[_Stroke]:
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


SMALL = 15.0
"""Square metres up to which a gap is no island."""

_POLYGON = 3
"""shapely's number of the geometry type."""


def small_gaps(rings: Lines, junction: IntArray, road: BoolArray) -> Lines:
    """Rings of the small gaps of all junctions.

    Parameters
    ----------
    rings
        Outlines of lanes.
    junction
        Shape ``(K,)``: number of the junction that each ring lies in, or -1.
    road
        Shape ``(K,)``: whether it is carriageway. Bits of other lanes, as of bicycle lanes, that
        the carriageway and its gaps enclose are gaps as well.
    """
    import shapely

    rows = np.flatnonzero(junction >= 0)
    found: list[Any] = []
    for number in np.unique(junction[rows]).tolist():
        members = rows[junction[rows] == number]
        part = rings.take(members)
        index = np.repeat(np.arange(part.total), np.diff(part.start))
        try:
            outlines = shapely.linearrings(part.xy, indices=index)
            lanes = shapely.make_valid(shapely.polygons(outlines))
            gaps = _small_holes(lanes)
            if not road[members].all():
                gaps += _small_holes(np.concatenate([lanes[road[members]], np.array(gaps)]))
        except (shapely.errors.GEOSException, ValueError):
            continue  # a folded lane: the drawing does without the gaps beside it
        found += gaps
    return rings_of([shapely.get_coordinates(gap) for gap in found])


def _small_holes(polygons: NDArray[Any]) -> list[Any]:
    """Holes below :data:`SMALL` of the union of polygons, as polygons."""
    import shapely

    pieces = shapely.get_parts(shapely.union_all(polygons, grid_size=0.01))
    holes = [
        shapely.polygons(shapely.get_interior_ring(piece, k))
        for piece in pieces[shapely.get_type_id(pieces) == _POLYGON]
        for k in range(shapely.get_num_interior_rings(piece))
    ]
    return [hole for hole in holes if shapely.area(hole) < SMALL]


TOLERANCE = 0.03
"""Metres that a drawn border may differ from the exact one."""

_MOST_PAIRS = 20_000_000
"""Pairs of near places to look for bridges among; a map folded onto itself has more."""

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
    borders = evaluate_borders(odr, table)
    thin = thinned(borders.lines, tolerance)
    levels = _section_levels(borders, table)
    junction = _junction_of_lanes(odr, table)
    areas = _build_areas(thin, borders, table, levels, junction)
    grounds = _junction_grounds(thin, borders, table, levels, junction)
    sides = _bridge_sides(thin, borders, table, levels)
    drawing = MapDrawing(
        name=name,
        bounds=_bounds_of([area.rings for area in areas]),
        areas=areas,
        marks=(*sides, *road_marks(borders, levels, tolerance, grounds)),
    )
    return add_furniture(drawing, odr, table)


def _bounds_of(parts: list[Lines]) -> Bounds:
    xy = np.concatenate([part.xy for part in parts]) if parts else np.zeros((1, 2))
    low, high = xy.min(axis=0).tolist(), xy.max(axis=0).tolist()
    return (low[0], low[1], high[0], high[1])


def _lane_rings(thin: Lines, borders: Borders, table: RoadTable) -> Lines:
    """Outline of each lane."""
    lanes = len(table.lane_keys)
    outer, ids = np.arange(lanes), np.asarray(table.lane_id)
    inner = inner_rows(table, lanes, borders.section[:lanes])
    # Counter-clockwise: out along the right border, back along the left one.
    ahead, back = np.where(ids < 0, outer, inner), np.where(ids < 0, inner, outer)
    sizes = np.diff(thin.start)
    first = np.stack([thin.start[:-1][ahead], thin.start[1:][back] - 1], axis=1).ravel()
    counts = np.stack([sizes[ahead], sizes[back]], axis=1).ravel()
    steps = np.tile(np.array([1, -1], dtype=np.int64), lanes)
    return Lines(
        thin.xy[ranges(first, counts, step=steps)], offsets(counts.reshape(-1, 2).sum(axis=1))
    )


def _junction_grounds(
    thin: Lines, borders: Borders, table: RoadTable, levels: IntArray, junction: IntArray
) -> list[JunctionGround]:
    """Lanes for vehicles of each junction's connecting roads on the ground."""
    lanes = len(table.lane_keys)
    if not (junction >= 0).any():
        return []
    rings = _lane_rings(thin, borders, table)
    drivable = np.array([kind in DRIVABLE_TYPES for kind in table.lane_type], dtype=np.bool_)
    usable = drivable & (np.abs(_ring_areas(rings)) > 0.01) & (levels[borders.section[:lanes]] == 0)
    roads = np.asarray(table.lane_road)
    return [
        JunctionGround(rings.take(rows), roads[rows])
        for number in np.unique(junction[usable & (junction >= 0)]).tolist()
        for rows in [np.flatnonzero(usable & (junction == number))]
    ]


def _build_areas(
    thin: Lines, borders: Borders, table: RoadTable, levels: IntArray, junction: IntArray
) -> tuple[Area, ...]:
    lanes = len(table.lane_keys)
    if lanes == 0:
        return ()
    rings = _lane_rings(thin, borders, table)
    solid = np.abs(_ring_areas(rings)) > 0.01
    kinds = np.array([AREA_KINDS.get(kind, "other") for kind in table.lane_type])
    drawn = solid & (np.array(table.lane_type) != "none")
    level = levels[borders.section[:lanes]]
    groups = sorted({(int(a), str(b)) for a, b in zip(level[drawn], kinds[drawn], strict=True)})
    areas = [
        Area(at, kind, rings.take(drawn & (level == at) & (kinds == kind))) for at, kind in groups
    ]
    within = np.where(drawn & (level == 0) & (kinds != "sidewalk"), junction, -1)
    gaps = small_gaps(rings, within, kinds == "road")
    return tuple(
        area._replace(rings=_join_lines(area.rings, gaps)) if area[:2] == (0, "road") else area
        for area in areas
    )


def _join_lines(a: Lines, b: Lines) -> Lines:
    return Lines(np.concatenate([a.xy, b.xy]), np.concatenate([a.start, a.start[-1] + b.start[1:]]))


def _junction_of_lanes(odr: OpenDrive, table: RoadTable) -> IntArray:
    """Number of the junction that each lane lies in, or -1."""
    numbers = {name: k for k, name in enumerate(odr.junctions)}
    of_road = [
        -1 if road.junction is None else numbers.get(road.junction, -1)
        for road in odr.roads.values()
    ]
    return np.array(of_road, dtype=np.int64)[np.asarray(table.lane_road)]


def _ring_areas(rings: Lines) -> FloatArray:
    """Signed area of each ring, m2, positive counter-clockwise."""
    following = np.arange(1, len(rings.xy) + 1)
    following[rings.start[1:] - 1] = rings.start[:-1]
    x, y = rings.xy.T
    cross = x * y[following] - x[following] * y
    area: FloatArray = np.add.reduceat(cross, rings.start[:-1]) / 2.0
    return area


def _section_levels(borders: Borders, table: RoadTable) -> IntArray:
    """Level of each section: one above whatever it passes over by :data:`_CLEARANCE`."""
    sections, stations = borders.sections, borders.stations
    levels = np.zeros(len(sections.road), dtype=np.int64)
    if len(stations.z) == 0 or np.ptp(stations.z) < _CLEARANCE:
        return levels
    from scipy.spatial import cKDTree

    lanes = len(table.lane_keys)
    inner = inner_rows(table, lanes, borders.section[:lanes])
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


def _bridge_sides(thin: Lines, borders: Borders, table: RoadTable, levels: IntArray) -> list[Mark]:
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
