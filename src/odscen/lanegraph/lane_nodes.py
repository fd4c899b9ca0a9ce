"""Nodes of the lane graph: where they lie, what lies beside them, what may be done there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.lanegraph.centrelines import MOST_LANES, CentreLines, node_offsets
from odscen.lanegraph.graphs import CHANGE_LEFT, CHANGE_RIGHT, ByteArray
from odscen.opendrive.lanes import LANE_CHANGE_DECREASE, LANE_CHANGE_INCREASE
from odscen.opendrive.road_model import DRIVABLE_TYPES

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.opendrive.lanes import RoadTable

MIN_LANE_WIDTH = 1.0
"""Metres; where a lane is narrower nothing can drive, so it has no nodes there."""


@dataclass(frozen=True, slots=True, eq=False)
class NodeTable:
    """Nodes of all drivable lanes, the lanes numbered from 0 whether they have nodes or not.

    Attributes
    ----------
    lines
        Centre lines of the lanes.
    spacing
        Metres.
    planned
        Shape ``(L + 1,)``: first planned node of each lane; nodes are planned along the whole lane.
    kept
        Shape ``(M,)``: the node that a planned one became, or -1 where the lane is too narrow.
    first
        Shape ``(L + 1,)``: first node of each lane.
    lane, s, offset, x, y, z, hdg, pitch, curvature, width
        Shape ``(N,)``: see :class:`~odscen.lanegraph.graphs.LaneGraph`.
    left, right
        Shape ``(N,)``: adjacent lane of the same driving direction that is wide enough here, or -1.
    lane_change
        Shape ``(N,)``: see :class:`~odscen.lanegraph.graphs.LaneGraph`.
    """

    lines: CentreLines
    spacing: float
    planned: IntArray
    kept: IntArray
    first: IntArray
    lane: IntArray
    s: FloatArray
    offset: FloatArray
    x: FloatArray
    y: FloatArray
    z: FloatArray
    hdg: FloatArray
    pitch: FloatArray
    curvature: FloatArray
    width: FloatArray
    left: IntArray
    right: IntArray
    lane_change: ByteArray


def place_nodes(table: RoadTable, spacing: float, *, most: float = MOST_LANES) -> NodeTable:
    """Place nodes along all drivable lanes of a map, at most ``most`` metres (R20)."""
    drivable = np.array([kind in DRIVABLE_TYPES for kind in table.lane_type], dtype=np.bool_)
    rows = np.flatnonzero(drivable).astype(np.int64)
    forward = table.lane_forward[rows]
    lines = CentreLines.of(table, rows, forward=forward, at=np.full(len(rows), 0.5), most=most)
    planned, lane, offset = node_offsets(lines.lengths, spacing, most=most)
    s = lines.s_at(lane, offset)
    points = table.lane_points(rows[lane], s)
    wide = points.width >= MIN_LANE_WIDTH
    kept = np.where(wide, np.cumsum(wide) - 1, -1).astype(np.int64)
    first = np.concatenate([[0], np.cumsum(wide)])[planned].astype(np.int64)
    lane, s, offset = lane[wide], s[wide], offset[wide]
    ahead = forward[lane]
    sign = np.where(ahead, 1.0, -1.0)
    left, right, lane_change = _lanes_beside(table, rows, lane, s)
    return NodeTable(
        lines=lines,
        spacing=spacing,
        planned=planned,
        kept=kept,
        first=first,
        lane=lane,
        s=s,
        offset=offset,
        x=points.x[wide],
        y=points.y[wide],
        z=points.z[wide],
        hdg=wrapped(points.hdg[wide] + np.where(ahead, 0.0, np.pi)),
        pitch=sign * points.pitch[wide],
        curvature=sign * points.curvature[wide],
        width=points.width[wide],
        left=left,
        right=right,
        lane_change=lane_change,
    )


def wrapped(angle: FloatArray) -> FloatArray:
    """Angles in [-pi, pi)."""
    return np.mod(angle + np.pi, 2.0 * np.pi) - np.pi


def _lanes_beside(
    table: RoadTable, rows: IntArray, lane: IntArray, s: FloatArray
) -> tuple[IntArray, IntArray, ByteArray]:
    """Left and right lane of each node, and which changes the road marks permit.

    A lane beside counts if it is drivable, runs in the same direction and is wide enough here.
    """
    number = np.full(len(table.lane_keys), -1, dtype=np.int64)
    number[rows] = np.arange(len(rows), dtype=np.int64)
    upper, lower = _adjacent_rows(table)
    ahead = table.lane_forward[rows][lane]
    row = rows[lane]
    left, change_left = _neighbour_lane(
        table, number, row, np.where(ahead, upper[row], lower[row]), s
    )
    right, change_right = _neighbour_lane(
        table, number, row, np.where(ahead, lower[row], upper[row]), s
    )
    permitted = change_left * CHANGE_LEFT + change_right * CHANGE_RIGHT
    return left, right, permitted.astype(np.uint8)


def _adjacent_rows(table: RoadTable) -> tuple[IntArray, IntArray]:
    """Row of the lane with the next higher and the next lower id in each lane's section, or -1.

    Rows are sorted by road, section and lane id, and the centre lane has no row: 1 follows -1.
    """
    beside = (np.diff(table.lane_road) == 0) & (np.diff(table.lane_section) == 0)
    count = len(table.lane_keys)
    upper = np.full(count, -1, dtype=np.int64)
    lower = np.full(count, -1, dtype=np.int64)
    array = np.flatnonzero(beside).astype(np.int64)
    upper[array] = array + 1
    lower[array + 1] = array
    return upper, lower


def _neighbour_lane(
    table: RoadTable, number: IntArray, row: IntArray, beside: IntArray, s: FloatArray
) -> tuple[IntArray, BoolArray]:
    """Lane number of the lane in table row ``beside`` or -1, and whether one may change to it.

    ``number`` gives the lane number of each table row, -1 for lanes that are not drivable.
    """
    usable = (beside >= 0) & (number[beside] >= 0)
    usable &= table.lane_forward[beside] == table.lane_forward[row]
    at = np.flatnonzero(usable)
    usable[at] = table.lane_width(beside[at], s[at]) >= MIN_LANE_WIDTH
    at = np.flatnonzero(usable)
    permitted = np.zeros(len(row), dtype=np.bool_)
    permitted[at] = _change_permitted(table, row[at], beside[at], s[at])
    return np.where(usable, number[beside], -1).astype(np.int64), permitted


def _change_permitted(
    table: RoadTable, row: IntArray, beside: IntArray, s: FloatArray
) -> BoolArray:
    """Whether the mark between two adjacent lanes permits a change from ``row`` to ``beside``.

    The mark is that on the outer border of the inner lane, or the centre lane's between 1 and -1.
    ``increase`` permits changes to higher lane ids, ``decrease`` to lower ones, whatever the
    driving direction (OpenDRIVE 1.8, section 11.9).
    """
    outer = np.where(np.abs(table.lane_id[row]) >= np.abs(table.lane_id[beside]), row, beside)
    code = table.inner_lane_change_at(outer, s)
    needed = np.where(
        table.lane_id[beside] > table.lane_id[row], LANE_CHANGE_INCREASE, LANE_CHANGE_DECREASE
    )
    permitted: BoolArray = (code & needed) != 0
    return permitted
