"""The ground of a map as a server has it: strips of triangles along all lanes.

A server makes a generated world's ground so: cross-sections every two metres, and the heights of
what is in a junction smoothed, but for its sidewalks (``MeshFactory.cpp`` and ``Map.cpp`` of
LibCarla: ``Generate``, ``MergeAndSmooth``, ``GenerateChunkedMesh``). Other worlds are made by hand;
theirs has cross-sections so close that nobody sees them. Places are in CARLA's frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import cKDTree

from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.road_model import OpenDrive

FINE = 0.3
"""Metres between cross-sections of a world that was made by hand."""
_NEIGHBOURS, _NEAR = 20, 5.0
"""Vertices by which one is smoothed, at most, and the metres within which they are."""
_SAME_LANE, _LANE_ENDS = 2.0, 2.0
"""By how many times a vertex of the same lane counts more, and if it is at its lane's end."""
_ROUNDS, _STEP = 100, 0.5

_Floats = npt.NDArray[np.float64]
_Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LaneMesh:
    """Ground of all lanes.

    Attributes
    ----------
    triangles
        Corners, shape ``(N, 3, 3)``.
    walks
        Whether each is of a sidewalk, shape ``(N,)``.
    """

    triangles: _Floats
    walks: npt.NDArray[np.bool_]

    @classmethod
    def of(
        cls, odr: OpenDrive, table: RoadTable, *, every: float = FINE, smooth: bool = False
    ) -> LaneMesh:
        """Ground with a cross-section every so many metres, in junctions smoothed or not."""
        lanes = np.flatnonzero(table.lane_s1 > table.lane_s0)
        strips = [_strip(table, int(row), every) for row in lanes]
        kinds = [table.lane_type[row] for row in lanes]
        if smooth:
            inside: dict[str, list[_Floats]] = {}
            for row, strip, kind in zip(lanes.tolist(), strips, kinds, strict=True):
                junction = odr.roads[table.lane_keys[row].road].junction
                if junction is not None and kind != "sidewalk":
                    inside.setdefault(str(junction), []).append(strip)
            for group in inside.values():
                smoothen(group)
        pieces = [_triangles(strip) for strip in strips]
        walks = [np.full(len(p), k == "sidewalk") for p, k in zip(pieces, kinds, strict=True)]
        if not pieces:
            return cls(np.empty((0, 3, 3)), np.empty(0, dtype=np.bool_))
        triangles, on_walk = np.concatenate(pieces), np.concatenate(walks)
        a, b, c = np.moveaxis(triangles[..., :2], 1, 0)
        area = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
        return cls(triangles[area > 1e-8], on_walk[area > 1e-8])

    @cached_property
    def _tree(self) -> shapely.STRtree:
        return shapely.STRtree(shapely.polygons(self.triangles[..., :2]))

    def around(self, x: float, y: float, reach: float) -> tuple[_Floats, _Floats, _Ints]:
        """Metres to the triangles that are within reach, heights at what is nearest, and rows."""
        place = shapely.Point(x, y)
        found = np.asarray(self._tree.query(place, predicate="dwithin", distance=reach))
        lines = shapely.shortest_line(place, self._tree.geometries[found])
        ends = shapely.get_coordinates(lines).reshape(-1, 2, 2)[:, 1]
        a, b, c = np.moveaxis(self.triangles[found], 1, 0)
        normal = np.cross(b - a, c - a)
        z = a[:, 2] - ((ends - a[:, :2]) * normal[:, :2]).sum(axis=1) / normal[:, 2]
        low, high = self.triangles[found, :, 2].min(axis=1), self.triangles[found, :, 2].max(axis=1)
        return shapely.length(lines), np.clip(z, low, high), found


def _strip(table: RoadTable, row: int, every: float) -> _Floats:
    """Vertices of a lane: inner, outer, inner, outer, ...; shape ``(2 N, 3)``."""
    start, end = float(table.lane_s0[row]), float(table.lane_s1[row])
    s = np.append(np.arange(start, end - 1e-6, every), end)
    rows = np.full(len(s), row)
    sides = [table.lane_points(rows, s, at=at) for at in (0.0, 1.0)]
    return np.stack([np.column_stack([side.x, -side.y, side.z]) for side in sides], axis=1).reshape(
        -1, 3
    )


def _triangles(strip: _Floats) -> _Floats:
    """Shape ``(N - 2, 3, 3)``."""
    return np.stack([strip[:-2], strip[1:-1], strip[2:]], axis=1)


def smoothen(strips: list[_Floats]) -> None:
    """Even out the heights of the lanes of a junction, as ``MergeAndSmooth`` of LibCarla does.

    The ends of lanes stay, so that the roads that lead to the junction fit. LibCarla moves one
    vertex after the other, this all at once; after so many rounds that is much the same.
    """
    vertices = np.concatenate(strips)
    lane = np.repeat(np.arange(len(strips)), [len(strip) for strip in strips])
    number = np.concatenate([np.arange(len(strip)) for strip in strips])
    left = np.concatenate([np.arange(len(strip))[::-1] for strip in strips])
    ends, moves = (number < 2) | (left < 2), (number > 2) & (left >= 2)
    count = min(_NEIGHBOURS, len(vertices))
    away, near = cKDTree(vertices).query(vertices, k=count)
    same = lane[near] == lane[:, None]
    weight = np.where((away > 1e-9) & (away <= _NEAR), 1.0 / np.maximum(away, 1e-5), 0.0)
    weight *= np.where(same, np.where(ends[near], _SAME_LANE * _LANE_ENDS, _SAME_LANE), 1.0)
    total = weight.sum(axis=1)
    moves &= total > 0.0
    z = vertices[:, 2].copy()
    for _ in range(_ROUNDS):
        mean = (z[near] * weight).sum(axis=1) / np.where(total > 0.0, total, 1.0)
        z[moves] += _STEP * (mean - z)[moves]
    for strip, heights in zip(strips, np.split(z, np.flatnonzero(np.diff(lane)) + 1), strict=True):
        strip[:, 2] = heights
