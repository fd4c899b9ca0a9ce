"""The surface of a map's lanes, asked for at many places at once: height and kind of what is there.

Lanes are strips of triangles between their two borders, so that a step between two lanes, such as a
kerb, is where the file has their border: to 1 mm, which is how close the triangles follow a bend.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from odscen.opendrive.road_model import WALKABLE_TYPES

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, IntArray

BESIDE = 2.5
"""Metres beside the lanes where the ground is still taken to be that of the nearest one."""
STOREY = 2.0
"""Metres of height by which a lane may be off what is looked for; further off, it is a bridge."""
NOWHERE = -1
"""Kind of a place where no lane is."""
_SAG = 1e-3
"""Metres between a bend and the chord that stands for it."""
_SHORTEST, _LONGEST = 0.2, 2.0
"""Metres from one cross-section of a strip to the next."""
_LOOK = 1.0
"""Metres between places of a lane where its bend is looked at."""
_THIN = 1e-9
"""Square metres of a triangle that is none."""
_FIRST = 1e-4
"""Metres by which a sidewalk counts as higher than a lane of the same height: it lies on it."""


class Surface(NamedTuple):
    """What is at places, shape ``(N,)`` each: metres, and an index into ``kinds``.

    Where no lane is, ``z`` is NaN and ``kind`` :data:`NOWHERE`.
    """

    z: FloatArray
    kind: IntArray


class LaneSurface:
    """Surface of all lanes of a map.

    Parameters
    ----------
    table
        Of the map.

    Attributes
    ----------
    kinds
        Types of lanes, sorted.
    """

    def __init__(self, table: RoadTable) -> None:
        self.kinds = tuple(sorted(set(table.lane_type)))
        corners, lane = _triangulate_lanes(table)
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        real = np.abs(across[:, 2]) > 2.0 * _THIN
        self._corners, lane, across = corners[real], lane[real], across[real]
        self._slope = -across[:, :2] / across[:, 2:]
        codes = np.array([self.kinds.index(kind) for kind in table.lane_type], dtype=np.int64)
        self._kind = codes[lane]
        walks = np.array([kind in WALKABLE_TYPES for kind in self.kinds], dtype=np.float64)
        self._first = _FIRST * walks

    @classmethod
    def of(cls, xodr: bytes) -> LaneSurface:
        """Surface of an OpenDRIVE text."""
        return cls(RoadTable.of(parse(xodr)))

    @cached_property
    def _build_triangle_tree(self) -> shapely.STRtree:
        # Made when somebody is on foot: many runs have nobody who is.
        return shapely.STRtree(shapely.polygons(self._corners[..., :2]))

    def at(self, x: FloatArray, y: FloatArray, near: FloatArray, raised: FloatArray) -> Surface:
        """Uppermost lane at places, or the nearest one beside them; shape ``(N,)`` each.

        Parameters
        ----------
        x, y
            OpenDRIVE frame, metres.
        near
            About how high.
        raised
            Metres by which each of ``kinds`` is higher than the file says.
        """
        z, kind = np.full(len(x), np.nan), np.full(len(x), NOWHERE, dtype=np.int64)
        if not len(x) or not len(self._corners):
            return Surface(z, kind)
        xy = np.column_stack([x, y])
        place, triangle = self._build_triangle_tree.query(
            shapely.points(xy), predicate="intersects"
        )
        self._choose_uppermost(place, triangle, xy[place], near, raised, z, kind)
        off = np.flatnonzero(kind == NOWHERE)
        if len(off):
            self._fill_beside_lanes(off, xy, near, raised, z, kind)
        return Surface(z, kind)

    def _fill_beside_lanes(
        self,
        off: IntArray,
        xy: FloatArray,
        near: FloatArray,
        raised: FloatArray,
        z: FloatArray,
        kind: IntArray,
    ) -> None:
        """Fill in what is nearest to places that are on no lane."""
        points = shapely.points(xy[off])
        number, triangle = self._build_triangle_tree.query(
            points, predicate="dwithin", distance=BESIDE
        )
        fits = np.abs(self._corners[triangle, :, 2].mean(axis=1) - near[off[number]]) <= STOREY
        number, triangle = number[fits], triangle[fits]
        lines = shapely.shortest_line(
            points[number], self._build_triangle_tree.geometries[triangle]
        )
        away = shapely.length(lines)
        least = np.full(len(off), np.inf)
        np.minimum.at(least, number, away)
        best = away <= least[number] + 1e-9
        ends = shapely.get_coordinates(lines).reshape(-1, 2, 2)[best, 1]
        self._choose_uppermost(off[number[best]], triangle[best], ends, near, raised, z, kind)

    def _choose_uppermost(
        self,
        place: IntArray,
        triangle: IntArray,
        xy: FloatArray,
        near: FloatArray,
        raised: FloatArray,
        z: FloatArray,
        kind: IntArray,
    ) -> None:
        """Write the uppermost of the triangles at each place, if it is about as high as wanted."""
        height, kinds = self._height_on_triangle(triangle, xy), self._kind[triangle]
        fits = np.abs(height - near[place]) <= STOREY
        place, height, kinds = place[fits], height[fits], kinds[fits]
        order = np.lexsort((height + (raised + self._first)[kinds], place))
        # Of several values for one place numpy keeps the last, which is the uppermost.
        z[place[order]], kind[place[order]] = height[order], kinds[order]

    def _height_on_triangle(self, triangle: IntArray, xy: FloatArray) -> FloatArray:
        corner = self._corners[triangle]
        z = corner[:, 0, 2] + ((xy - corner[:, 0, :2]) * self._slope[triangle]).sum(axis=1)
        # A sliver's slope is not worth much, its corners are.
        clipped: FloatArray = np.clip(z, corner[..., 2].min(axis=1), corner[..., 2].max(axis=1))
        return clipped


def _triangulate_lanes(table: RoadTable) -> tuple[FloatArray, IntArray]:
    """Triangles of all lanes, corners of shape ``(N, 3, 3)``, and their lanes."""
    lanes = np.flatnonzero(table.lane_s1 > table.lane_s0)
    if not len(lanes):
        return np.empty((0, 3, 3)), np.empty(0, dtype=np.int64)
    every = _section_spacing(table, lanes)
    row, s, last = _section_stations(table, lanes, every)
    inner, outer = (_corner_points(table, row, s, at) for at in (0.0, 1.0))
    a = np.flatnonzero(~last)
    b = a + 1
    first = np.stack([inner[a], outer[a], inner[b]], axis=1)
    second = np.stack([outer[a], outer[b], inner[b]], axis=1)
    return np.concatenate([first, second]), np.concatenate([row[a], row[a]])


def _corner_points(table: RoadTable, row: IntArray, s: FloatArray, at: float) -> FloatArray:
    points = table.lane_points(row, s, at=at)
    return np.column_stack([points.x, points.y, points.z])


def _section_spacing(table: RoadTable, lanes: IntArray) -> FloatArray:
    """Metres of road between two cross-sections of each lane, by its sharpest bend."""
    row, s, _ = _section_stations(table, lanes, np.full(len(lanes), _LOOK))
    sharpest = np.zeros(len(table.lane_keys))
    for at in (0.0, 1.0):
        np.maximum.at(sharpest, row, np.abs(table.lane_points(row, s, at=at).curvature))
    bend = np.maximum(sharpest[lanes], 1e-9)
    spacing: FloatArray = np.clip(np.sqrt(8.0 * _SAG / bend), _SHORTEST, _LONGEST)
    return spacing


def _section_stations(
    table: RoadTable, lanes: IntArray, every: FloatArray
) -> tuple[IntArray, FloatArray, BoolArray]:
    """Lane and s of cross-sections, and which are the last of their lane."""
    start, length = table.lane_s0[lanes], table.lane_s1[lanes] - table.lane_s0[lanes]
    parts = np.maximum(np.ceil(length / every), 1.0).astype(np.int64)
    row = np.repeat(np.arange(len(lanes)), parts + 1)
    first = np.concatenate([[0], np.cumsum(parts + 1)[:-1]])
    number = np.arange(len(row)) - first[row]
    s = start[row] + length[row] * number / parts[row]
    return lanes[row], s, number == parts[row]
