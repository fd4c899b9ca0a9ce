"""Where the driving surface ends: outer borders of roads, outlines of junctions.

Along a road that is each border of a lane that no other driving lane lies beyond. In a junction
lanes cross, so that it is the outline of all of its lanes together, open where roads lead in.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.formats.recordings.run_recording import LaneElement

_SEAM = 0.05
"""Metres by which lanes of a junction may miss each other without an edge between them."""
_OPEN = 0.3
"""Metres around the roads at a junction within which its outline is no edge."""
_SHORTEST = 0.5


def road_edges(lanes: Sequence[LaneElement]) -> Iterator[FloatArray]:
    """Edges of the driving surface, shape ``(n, 3)`` each."""
    for lane in lanes:
        if not lane.junction:
            yield from _outer_borders(lane)
    junctions: dict[str, list[int]] = {}
    for row, lane in enumerate(lanes):
        if lane.junction:
            junctions.setdefault(lane.junction, []).append(row)
    for rows in junctions.values():
        yield from _outline_of_lanes(rows, lanes)


def _outer_borders(lane: LaneElement) -> Iterator[FloatArray]:
    beyond = lane.opposite >= 0
    if lane.left_lane < 0 and not (beyond and lane.keeps_right):
        yield lane.left
    if lane.right_lane < 0 and not (beyond and not lane.keeps_right):
        yield lane.right


def _outline_of_lanes(rows: Sequence[int], lanes: Sequence[LaneElement]) -> Iterator[FloatArray]:
    import shapely
    from scipy.spatial import cKDTree

    inside = [lanes[row] for row in rows]
    around = {entry for lane in inside for entry in (*lane.entries, *lane.exits)} - set(rows)
    ground = shapely.union_all([_lane_polygon(lane).buffer(_SEAM) for lane in inside]).buffer(
        -_SEAM
    )
    roads = shapely.union_all([_lane_polygon(lanes[row]) for row in sorted(around)])
    outline = ground.boundary.difference(roads.buffer(_OPEN))
    lines = shapely.get_parts(shapely.line_merge(outline) if outline.length else outline)
    border = np.concatenate([np.concatenate([lane.left, lane.right]) for lane in inside])
    tree = cKDTree(border[:, :2])
    for line in lines:
        if line.length >= _SHORTEST:
            xy = shapely.get_coordinates(line)
            yield np.column_stack([xy, border[tree.query(xy)[1], 2]])


def _lane_polygon(lane: LaneElement) -> Any:
    import shapely

    ring = np.concatenate([lane.left[:, :2], lane.right[::-1, :2]])
    return shapely.Polygon(ring).buffer(0.0)
