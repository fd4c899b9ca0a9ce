"""The ground of a world that a server makes of an OpenDRIVE text, by the rules of LibCarla.

Read in carla-simulator/carla, ``LibCarla/source/carla/road``:

- ``Map::GenerateChunkedMesh``: roads outside junctions, and of each junction the connecting roads
  of its connections. Sidewalks in junctions are not smoothed (pull request 2731).
- ``MeshFactory::Generate``: one strip a lane, with a cross-section every ``vertex_distance`` and at
  the end; a straight lane (``Lane::IsStraight``) has none but those at its ends. Outside junctions
  sections are cut every ``max_road_length``.
- ``Lane::GetCornerPositions``: heights are the elevation's alone, for neither superelevation nor
  lanes' heights are read; sidewalks are 0.1524 m higher. Driving lanes are wider by
  ``additional_width`` on each side (in junctions only until pull request 8975, which was merged
  before 0.9.16).
- ``MeshFactory::GenerateWalls``: at both edges of each road outside junctions. A wall has no
  thickness; here it has some, so that a ray meets it.
- ``MeshFactory::MergeAndSmooth``: see :func:`smoothen`.

Vertices are doubles here, and floats there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, diags_array, tril
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from odscen.base.ids import RoadId
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.profiles import CubicTable, StepTable
from odscen.opendrive.road_model import GeometryKind, OpenDrive, Road

SIDEWALK_LIFT = 0.1524
"""Metres by which sidewalks are higher than the file's elevation (``Lane.cpp``)."""
_WALL = 0.2
"""Metres of a wall's thickness, outwards from the edge."""
_NEIGHBOURS, _NEAR = 20, 5.0
"""Vertices that one is smoothed by and itself, at most, and within how many metres they are."""
_SAME_LANE, _LANE_ENDS = 2.0, 2.0
"""By how many times a vertex of the same lane counts more, and if it is at its lane's end."""
_ROUNDS, _STEP = 100, 0.5

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Generation:
    """How a world is made: ``OpendriveGenerationParameters`` of LibCarla with its defaults."""

    vertex_distance: float = 2.0
    max_road_length: float = 50.0
    wall_height: float = 1.0
    additional_width: float = 0.6
    smooth_junctions: bool = True

    @classmethod
    def of(cls, sent: list[float | bool]) -> Self:
        """Parameters as they are on the wire; what is only seen is left out."""
        every, longest, wall, width, smooth, *_ = sent
        return cls(every, longest, wall, width, bool(smooth))


def flattened(table: RoadTable) -> RoadTable:
    """Lanes as LibCarla knows them: heights are those of the elevation profile."""
    lanes = [()] * len(table.lane_keys)
    return replace(
        table,
        superelevation=CubicTable.of([()] * len(table.road_ids)),
        inner_heights=StepTable.of(lanes),
        outer_heights=StepTable.of(lanes),
    )


def strips_of(
    odr: OpenDrive, table: RoadTable, made: Generation
) -> tuple[list[Floats], list[bool]]:
    """Strips of the ground and of the walls, and whether each is a sidewalk.

    Each has shape ``(2 N, 3)``: right, left, right, left, ... along its lane, in CARLA's frame.

    Parameters
    ----------
    table
        As :func:`flattened` gives it.
    """
    strips: list[Floats] = []
    walks: list[bool] = []
    for road in odr.roads.values():
        if road.junction is None:
            for row in _rows(table, road):
                pieces = list(_pieces(road, table, row, made))
                pieces += _walls(table, row, pieces, made.wall_height)
                strips += pieces
                walks += [table.lane_type[row] == "sidewalk"] * len(pieces)
    for junction in odr.junctions.values():
        inside = dict.fromkeys(one.connecting_road for one in junction.connections)
        rows = [(odr.roads[road], row) for road in inside for row in _rows_of(odr, table, road)]
        kinds = [table.lane_type[row] == "sidewalk" for _, row in rows]
        lanes = [_strip(table, row, _sections(road, table, row, made), made) for road, row in rows]
        if made.smooth_junctions:
            smoothen([lane for lane, walk in zip(lanes, kinds, strict=True) if not walk])
        strips += lanes
        walks += kinds
    return strips, walks


def _rows_of(odr: OpenDrive, table: RoadTable, road: RoadId) -> list[int]:
    """Of a connecting road; what a direct junction connects to is a road outside junctions."""
    return _rows(table, odr.roads[road]) if odr.roads[road].junction is not None else []


def _rows(table: RoadTable, road: Road) -> list[int]:
    rows = np.flatnonzero(table.lane_road == table.road_index[road.id])
    return [int(row) for row in rows if table.lane_s1[row] > table.lane_s0[row]]


def _is_straight(road: Road, s0: float, s1: float) -> bool:
    """Whether LibCarla takes a lane for straight: a line, and no curve in height or offset."""
    under = [one for one in road.geometry if one.s <= s0 + 1e-9][-1]
    if under.kind is not GeometryKind.LINE or s1 > under.s + under.length + 1e-6:
        return False
    return not any(one.c or one.d for one in (*road.lane_offset, *road.elevation))


def _sections(road: Road, table: RoadTable, row: int, made: Generation) -> Floats:
    """Where the cross-sections of a lane are, that is not cut."""
    start, end = float(table.lane_s0[row]), float(table.lane_s1[row])
    if _is_straight(road, start, end):
        return np.array([start, end])
    return np.append(np.arange(start, end - 1e-6, made.vertex_distance), end)


def _pieces(road: Road, table: RoadTable, row: int, made: Generation) -> Iterator[Floats]:
    """Strips of a lane outside junctions."""
    start, end = float(table.lane_s0[row]), float(table.lane_s1[row])
    straight = _is_straight(road, start, end)
    cuts = np.append(np.arange(start, end - 1e-6, made.max_road_length), end)
    for s0, s1 in pairwise(cuts):
        inner = np.array([s0]) if straight else np.arange(s0, s1 - 1e-6, made.vertex_distance)
        yield _strip(table, row, np.append(inner, s1), made)


def _strip(table: RoadTable, row: int, s: Floats, made: Generation) -> Floats:
    rows = np.full(len(s), row)
    side = -1.0 if table.lane_id[row] < 0 else 1.0
    hdg = table.reference(table.lane_road[rows], s).hdg
    kind = table.lane_type[row]
    wider = side * (made.additional_width if kind == "driving" else 0.0)
    lift = SIDEWALK_LIFT if kind == "sidewalk" else 0.0
    borders = []
    for at, sign in ((0.0, -1.0), (1.0, 1.0)):
        line = table.lane_points(rows, s, at=at)
        x = line.x - sign * wider * np.sin(hdg)
        y = line.y + sign * wider * np.cos(hdg)
        borders.append(np.column_stack([x, -y, line.z + lift]))
    right_to_left = borders[::-1] if side < 0 else borders
    return np.stack(right_to_left, axis=1).reshape(-1, 3)


def _walls(table: RoadTable, row: int, pieces: list[Floats], height: float) -> list[Floats]:
    """Walls along the outermost lanes of a section: on the right, on the left, on both or none."""
    if not height:
        return []
    section = table.section_first[table.lane_road[row]] + table.lane_section[row]
    lanes = table.lane_id[table.section_lanes[section] : table.section_lanes[section + 1]]
    lane = table.lane_id[row]
    found = []
    for piece in pieces:
        right, left = piece[0::2], piece[1::2]
        if lane == lanes.min():
            found.append(_wall(right, left, height))
        if lane == lanes.max():
            found.append(_wall(left, right, height))
    return found


def _wall(edge: Floats, other: Floats, height: float) -> Floats:
    away = (edge - other)[:, :2]
    away = away / np.maximum(np.hypot(*away.T), 1e-9)[:, None]
    top = edge + np.array([0.0, 0.0, height])
    outer = top + np.column_stack([_WALL * away, np.zeros(len(edge))])
    return np.stack([top, outer], axis=1).reshape(-1, 3)


def smoothen(strips: list[Floats]) -> None:
    """Even out the heights of the lanes of a junction, in place, as ``MergeAndSmooth`` does.

    100 times, one vertex after the other, each goes half of the way to the mean height of those of
    its 20 nearest vertices that are within 5 m, where one counts by 1 / distance, twice that in the
    same lane, and four times at an end of that lane. The ends of lanes stay, so that the roads that
    lead to the junction fit; so does, by how LibCarla counts, the first vertex after the start.

    One round solves ``(D / 0.5 + L) step = W z - D z``, where ``W`` are the weights, ``D`` their
    sums, and ``-L`` the part of ``W`` that comes before a vertex: a step of a relaxed Gauss-Seidel.
    """
    if not strips:
        return
    vertices = np.concatenate(strips)
    sizes = [len(strip) for strip in strips]
    lane = np.repeat(np.arange(len(strips)), sizes)
    number = np.concatenate([np.arange(size) for size in sizes])
    size = np.repeat(sizes, sizes)
    ends = (number < 2) | (number >= size - 2)
    weights = _weights(vertices, lane, ends)
    total = np.asarray(weights.sum(axis=1)).ravel()
    moves = np.flatnonzero((number > 2) & (number < size - 2) & (total > 0.0))
    if not len(moves):
        return
    own = weights[moves]
    relaxed = diags_array(total[moves] / _STEP) - tril(own[:, moves], k=-1)
    solver = splu(relaxed.tocsc(), permc_spec="NATURAL", diag_pivot_thresh=0.0)
    z = vertices[:, 2].copy()
    for _ in range(_ROUNDS):
        z[moves] += solver.solve(own @ z - total[moves] * z[moves])
    for strip, heights in zip(strips, np.split(z, np.cumsum(sizes)[:-1]), strict=True):
        strip[:, 2] = heights


def _weights(
    vertices: Floats, lane: npt.NDArray[np.int64], ends: npt.NDArray[np.bool_]
) -> coo_array:
    """How much each vertex counts for each, shape ``(N, N)``."""
    count = min(_NEIGHBOURS, len(vertices))
    away, near = cKDTree(vertices).query(vertices, k=count)
    weight = np.where((away > 1e-9) & (away <= _NEAR), 1.0 / np.maximum(away, 1e-5), 0.0)
    same = lane[near] == lane[:, None]
    weight *= np.where(same, np.where(ends[near], _SAME_LANE * _LANE_ENDS, _SAME_LANE), 1.0)
    rows = np.repeat(np.arange(len(vertices)), count)
    shape = (len(vertices), len(vertices))
    return coo_array((weight.ravel(), (rows, near.ravel())), shape=shape).tocsr()
