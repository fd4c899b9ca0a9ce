"""The ground of a map as a server has it: strips of triangles along all lanes.

Worlds that are made of an OpenDRIVE text have the strips of :mod:`tests.carla_standin.generated`.
Other worlds are made by hand; theirs have cross-sections so close that nobody sees them. Places are
in CARLA's frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely

from odscen.opendrive.lanes import RoadTable

FINE = 0.3
"""Metres between cross-sections of a world that was made by hand."""

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
    def of(cls, table: RoadTable) -> LaneMesh:
        """Ground of a world that was made by hand: the surface of all lanes."""
        lanes = np.flatnonzero(table.lane_s1 > table.lane_s0)
        strips = [_strip(table, int(row)) for row in lanes]
        return cls.join(strips, [table.lane_type[row] == "sidewalk" for row in lanes])

    @classmethod
    def join(cls, strips: Sequence[_Floats], walks: Sequence[bool]) -> LaneMesh:
        """Ground of strips of vertices, shape ``(2 N, 3)`` each, and whether each is a sidewalk."""
        if not strips:
            return cls(np.empty((0, 3, 3)), np.empty(0, dtype=np.bool_))
        pieces = [_triangles(strip) for strip in strips]
        triangles = np.concatenate(pieces)
        on_walk = np.repeat(np.array(walks, dtype=np.bool_), [len(piece) for piece in pieces])
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


def _strip(table: RoadTable, row: int) -> _Floats:
    """Vertices of a lane: inner, outer, inner, outer, ...; shape ``(2 N, 3)``."""
    start, end = float(table.lane_s0[row]), float(table.lane_s1[row])
    s = np.append(np.arange(start, end - 1e-6, FINE), end)
    rows = np.full(len(s), row)
    sides = [table.lane_points(rows, s, at=at) for at in (0.0, 1.0)]
    return np.stack([np.column_stack([side.x, -side.y, side.z]) for side in sides], axis=1).reshape(
        -1, 3
    )


def _triangles(strip: _Floats) -> _Floats:
    """Shape ``(N - 2, 3, 3)``."""
    return np.stack([strip[:-2], strip[1:-1], strip[2:]], axis=1)
