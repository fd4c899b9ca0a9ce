"""A navigation mesh in the file format that CARLA's client reads: one Detour tile in a set.

The set is that of ``Navigation::Load`` of LibCarla (magic ``MSET``, version 1), the tile that of
``dtNavMesh::addTile`` of Recast & Detour (``DetourNavMesh.h``: magic ``DNAV``, version 7, 32-bit
references). Polygons are triangles; there is no bounding volume tree, so that queries look at each.
"""

from __future__ import annotations

import struct
from typing import Final

import numpy as np
import numpy.typing as npt

SIDEWALK, CROSSWALK = 1, 2
"""Areas of CARLA's navigation; the flag of an area is ``1 << area``."""

_SET_MAGIC, _TILE_MAGIC = 0x4D534554, 0x444E4156
_SET_HEADER = struct.Struct("<iii3fffii")
_TILE_REFERENCE = struct.Struct("<Ii")
_TILE_HEADER = struct.Struct("<5iI9i3f3f3ff")
_POLYGON: Final = np.dtype(
    [
        ("first_link", "<u4"),
        ("vertices", "<u2", 6),
        ("neighbours", "<u2", 6),
        ("flags", "<u2"),
        ("count", "u1"),
        ("area_and_type", "u1"),
    ]
)
_DETAIL: Final = np.dtype(
    [("vertex", "<u4"), ("triangle", "<u4"), ("vertices", "u1"), ("triangles", "u1"), ("_", "<u2")]
)
_LINK_BYTES = 12
_NO_LINK = 0xFFFFFFFF
_ALL_EDGES = 0b010101
"""Flags of a detail triangle all of whose edges are those of its polygon."""
_WALKER_HEIGHT, _WALKER_RADIUS, _CLIMB = 1.8, 0.3, 0.5
_MOST_VERTICES = 0xFFFF


def mesh_file(
    vertices: npt.NDArray[np.float64],
    triangles: npt.NDArray[np.int64],
    areas: npt.NDArray[np.int64],
) -> bytes:
    """File of a mesh.

    Parameters
    ----------
    vertices
        Shape ``(N, 3)``: x, y, z in CARLA's frame, metres. Triangles that share two are neighbours.
    triangles
        Rows of ``vertices``, shape ``(K, 3)``, in any sense of rotation.
    areas
        Of each triangle, shape ``(K,)``.

    Raises
    ------
    ValueError
        If there are no triangles, or more vertices than a tile can number.
    """
    if not len(triangles) or len(vertices) > _MOST_VERTICES:
        raise ValueError(f"{len(triangles)} triangles on {len(vertices)} vertices make no tile")
    tile = _tile(vertices, triangles, areas)
    bits = max((len(triangles) - 1).bit_length(), 1)
    low = vertices.min(axis=0)
    size = vertices.max(axis=0) - low
    head = _SET_HEADER.pack(
        _SET_MAGIC, 1, 1, low[0], low[2], low[1], size[0] + 1.0, size[1] + 1.0, 1, 1 << bits
    )
    return head + _TILE_REFERENCE.pack(1 << bits, len(tile)) + tile


def _tile(
    vertices: npt.NDArray[np.float64],
    triangles: npt.NDArray[np.int64],
    areas: npt.NDArray[np.int64],
) -> bytes:
    triangles = _clockwise(vertices, triangles)
    neighbours = _neighbours(triangles)
    count = len(triangles)
    links = max(int(np.count_nonzero(neighbours)), 1)
    polygons = np.zeros(count, dtype=_POLYGON)
    polygons["first_link"] = _NO_LINK
    polygons["vertices"][:, :3] = triangles
    polygons["neighbours"][:, :3] = neighbours
    polygons["flags"] = 1 << areas
    polygons["count"] = 3
    polygons["area_and_type"] = areas
    details = np.zeros(count, dtype=_DETAIL)
    details["triangle"] = np.arange(count)
    details["triangles"] = 1
    corners = np.tile(np.array([0, 1, 2, _ALL_EDGES], dtype="u1"), count)
    points = vertices[:, [0, 2, 1]].astype("<f4")  # y is up in Detour
    header = _TILE_HEADER.pack(
        _TILE_MAGIC, 7, 0, 0, 0, 0, count, len(vertices), links, count, 0, count, 0, 0, count,
        _WALKER_HEIGHT, _WALKER_RADIUS, _CLIMB,
        *points.min(axis=0).tolist(), *points.max(axis=0).tolist(), 1.0,
    )  # fmt: skip
    parts = (points, polygons, np.zeros(_LINK_BYTES * links, dtype="u1"), details, corners)
    return header + b"".join(part.tobytes() for part in parts)


def _clockwise(
    vertices: npt.NDArray[np.float64], triangles: npt.NDArray[np.int64]
) -> npt.NDArray[np.int64]:
    """Triangles that turn as Detour's portals take for granted: from +y to +x."""
    a, b, c = (vertices[triangles[:, k], :2] for k in range(3))
    turn = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    return np.where((turn > 0.0)[:, None], triangles[:, ::-1], triangles)


def _neighbours(triangles: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """For each edge the number of the triangle beyond it, counted from 1; 0 for none."""
    found = np.zeros_like(triangles)
    open_edges: dict[tuple[int, int], tuple[int, int]] = {}
    for row, corners in enumerate(triangles.tolist()):
        for edge in range(3):
            ends = corners[edge], corners[(edge + 1) % 3]
            other = open_edges.pop(ends[::-1], None)
            if other is None:
                open_edges[ends] = (row, edge)
            else:
                found[row, edge], found[other] = other[0] + 1, row + 1
    return found
