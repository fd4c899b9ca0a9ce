"""From the road model to the shapes that are drawn.

Neighbouring lanes, and the marking between them, are made of the same thinned line, so that there
is neither gap nor overlap. Roads that pass over others are drawn a level up.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.arrays import Bounds, FloatArray, IntArray, offsets, ranges
from odscen.drawing.furniture import add_furniture
from odscen.drawing.junction_gaps import small_gaps
from odscen.drawing.lane_borders import evaluate_borders, inner_rows, thinned
from odscen.drawing.map_drawing import BRIDGE, Area, Lines, MapDrawing, Mark
from odscen.drawing.road_marks import road_marks
from odscen.opendrive.road_model import DRIVABLE_TYPES

if TYPE_CHECKING:
    from odscen.drawing.lane_borders import Borders
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive


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
    levels = _levels(borders, table)
    areas = _areas(thin, borders, table, levels, _junctions(odr, table))
    sides = _bridge_sides(thin, borders, table, levels)
    drawing = MapDrawing(
        name=name,
        bounds=_bounds([area.rings for area in areas]),
        areas=areas,
        marks=(*sides, *road_marks(borders, levels, tolerance)),
    )
    return add_furniture(drawing, odr, table)


def _bounds(parts: list[Lines]) -> Bounds:
    xy = np.concatenate([part.xy for part in parts]) if parts else np.zeros((1, 2))
    low, high = xy.min(axis=0).tolist(), xy.max(axis=0).tolist()
    return (low[0], low[1], high[0], high[1])


def _areas(
    thin: Lines, borders: Borders, table: RoadTable, levels: IntArray, junction: IntArray
) -> tuple[Area, ...]:
    lanes = len(table.lane_keys)
    if lanes == 0:
        return ()
    outer, ids = np.arange(lanes), np.asarray(table.lane_id)
    inner = inner_rows(table, lanes, borders.section[:lanes])
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
    areas = [
        Area(at, kind, rings.take(drawn & (level == at) & (kinds == kind))) for at, kind in groups
    ]
    within = np.where(drawn & (level == 0) & (kinds != "sidewalk"), junction, -1)
    gaps = small_gaps(rings, within, kinds == "road")
    return tuple(
        area._replace(rings=_joined(area.rings, gaps)) if area[:2] == (0, "road") else area
        for area in areas
    )


def _joined(a: Lines, b: Lines) -> Lines:
    return Lines(np.concatenate([a.xy, b.xy]), np.concatenate([a.start, a.start[-1] + b.start[1:]]))


def _junctions(odr: OpenDrive, table: RoadTable) -> IntArray:
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


def _levels(borders: Borders, table: RoadTable) -> IntArray:
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
