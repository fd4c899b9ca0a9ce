"""Where walkers may walk on a map, as a navigation mesh: sidewalks, and crosswalks between them.

One level only: where roads lie above each other the mesh is that of the highest.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry.base import BaseGeometry

from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import crosswalks
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import WALKABLE_TYPES
from tests.carla_standin.detour import CROSSWALK, SIDEWALK, mesh_file
from tests.carla_standin.road_map import RoadMap

_EVERY = 1.0
"""Metres between points of a sidewalk's borders."""
_JOIN = 0.1
"""Metres by which sidewalks are wider than the file's, so that those that touch are one."""
_REACH = 0.5
"""Metres by which a crosswalk reaches on to a sidewalk."""
_FINE = 0.02
"""Metres to which outlines are kept."""
_GRID = 1e-3
_ABOVE = 1e4


def navigation_mesh(road_map: RoadMap, kerb: float) -> bytes:
    """File of a map's mesh; empty if there is nothing to walk on.

    Parameters
    ----------
    kerb
        Metres by which sidewalks stand above the map's surface, if it was not made with them.
    """
    kerb = road_map.kerb(kerb)
    odr = parse(road_map.text.encode(), file=road_map.name)
    table = RoadTable.of(odr)
    if not _walkable(table):
        return b""
    walks = shapely.union_all([_sidewalk(table, row) for row in _walkable(table)])
    walks = walks.buffer(_JOIN, join_style="mitre").simplify(_FINE)
    flip = np.array([1.0, -1.0])
    zebras = [shapely.Polygon(one.polygon * flip) for one in crosswalks(odr, table)]
    crossings = shapely.union_all(zebras).buffer(_REACH, join_style="mitre").difference(walks)
    places, triangles, areas = _triangles(walks, crossings)
    on_walk = np.isin(np.arange(len(places)), triangles[areas == SIDEWALK])
    heights = [
        _height(road_map, x, y, kerb, on_walk=walk)
        for (x, y), walk in zip(places.tolist(), on_walk.tolist(), strict=True)
    ]
    return mesh_file(np.column_stack([places, heights]), triangles, areas)


def _height(road_map: RoadMap, x: float, y: float, kerb: float, *, on_walk: bool) -> float:
    below = None if on_walk else road_map.surface(x, y, _ABOVE, kerb)
    return road_map.walk_height(x, y) + kerb if below is None else below[0]


def _walkable(table: RoadTable) -> list[int]:
    return [row for row, kind in enumerate(table.lane_type) if kind in WALKABLE_TYPES]


def _sidewalk(table: RoadTable, row: int) -> BaseGeometry:
    start, end = table.lane_s0[row], table.lane_s1[row]
    s = np.linspace(start, end, max(2, int((end - start) / _EVERY) + 1))
    rows = np.full(len(s), row)
    inner, outer = (table.lane_points(rows, s, at=at) for at in (0.0, 1.0))
    ring = np.concatenate(
        [np.column_stack([inner.x, -inner.y]), np.column_stack([outer.x, -outer.y])[::-1]]
    )
    return shapely.make_valid(shapely.Polygon(ring))


def _triangles(
    walks: BaseGeometry, crossings: BaseGeometry
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Corners, shape ``(N, 2)``, triangles and their areas; neighbours share their corners."""
    outlines = shapely.set_precision(shapely.union_all([walks.boundary, crossings.boundary]), _GRID)
    corners: dict[tuple[float, float], int] = {}
    triangles, areas = [], []
    for face in shapely.get_parts(shapely.polygonize([outlines])):
        inside = face.representative_point()
        if walks.contains(inside):
            area = SIDEWALK
        elif crossings.contains(inside):
            area = CROSSWALK
        else:
            continue
        for part in shapely.get_parts(shapely.constrained_delaunay_triangles(face)):
            ring = shapely.get_coordinates(part)[:3].tolist()
            triangles.append([corners.setdefault((x, y), len(corners)) for x, y in ring])
            areas.append(area)
    return np.array(list(corners)), np.array(triangles, dtype=np.int64), np.array(areas)
