"""Crosswalks and the lanes under them: what they take from roads, and which junction they join."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely
from scipy.spatial import cKDTree

from odscen.convert.model.access import allowed
from odscen.convert.model.edge_plan import RoadGap
from odscen.convert.model.lane_alignment import DENSE, spread
from odscen.opendrive.objects import crosswalks

if TYPE_CHECKING:
    from odscen.base.ids import RoadId
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.objects import Crosswalk
    from odscen.opendrive.road_model import OpenDrive

MARGIN = 1.0
"""Metres before a crosswalk where vehicles stop."""

SHARE = 0.2
"""Share of a road's length that the margin is at most: short roads stay."""

LEVEL = 2.5
"""Metres of height between a crosswalk and lanes of other levels."""


class PlacedCrosswalk(NamedTuple):
    """A crosswalk, roads outside junctions that it lies on (with s), and connecting roads."""

    crosswalk: Crosswalk
    roads: tuple[tuple[RoadId, float], ...]
    connecting: tuple[RoadId, ...]


def place_crosswalks(
    odr: OpenDrive, table: RoadTable
) -> tuple[tuple[PlacedCrosswalk, ...], dict[RoadId, list[RoadGap]]]:
    """Find the lanes under each crosswalk.

    Returns
    -------
    tuple
        The crosswalks in the order of the file, and by road the parts that they take from it.
    """
    found = crosswalks(odr, table)
    if not found:
        return (), {}
    usable = np.array([bool(allowed(kind)) for kind in table.lane_type], dtype=np.bool_)
    rows = np.flatnonzero(usable & (table.lane_s1 - table.lane_s0 > 1e-3))
    extent = (table.lane_s1 - table.lane_s0)[rows]
    _, owner, share = spread(extent, DENSE)
    s = table.lane_s0[rows][owner] + share * extent[owner]
    points = table.lane_points(rows[owner], s)
    tree = cKDTree(np.column_stack((points.x, points.y)))
    placed: list[PlacedCrosswalk] = []
    taken: dict[RoadId, list[RoadGap]] = {}
    for crosswalk in found:
        area = shapely.Polygon(crosswalk.polygon).buffer(DENSE / 2.0)
        west, south, east, north = area.bounds
        middle = (0.5 * (west + east), 0.5 * (south + north))
        reach = math.hypot(east - west, north - south)  # twice what is needed
        near = np.array(tree.query_ball_point(middle, reach, return_sorted=True), dtype=np.int64)
        inside = near[shapely.intersects_xy(area, points.x[near], points.y[near])]
        inside = inside[np.abs(points.z[inside] - crosswalk.z) < LEVEL]
        roads = table.lane_road[rows[owner[inside]]]
        outside: list[tuple[RoadId, float]] = []
        connecting: list[RoadId] = []
        for row in np.unique(roads).tolist():
            road = table.road_ids[row]
            if odr.roads[road].junction is not None:
                connecting.append(road)
                continue
            under = s[inside[roads == row]]
            margin = min(MARGIN, SHARE * odr.roads[road].length)
            first, last = float(under.min()), float(under.max())
            taken.setdefault(road, []).append(
                RoadGap(first - margin, last + margin, (first + last) / 2.0)
            )
            outside.append((road, (first + last) / 2.0))
        placed.append(PlacedCrosswalk(crosswalk, tuple(outside), tuple(connecting)))
    return tuple(placed), taken
