"""Elements of a map as polylines with equal steps: lanes with borders, markings, crosswalks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.base.arrays import offsets, ranges
from odscen.base.ids import LaneKey
from odscen.formats.recordings.run_recording import (
    CrosswalkElement,
    LaneElement,
    LineElement,
    MapElements,
)
from odscen.lanegraph.graphs import CHANGE_LEFT, CHANGE_RIGHT, Relation
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import crosswalks

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.base.ids import RoadId
    from odscen.lanegraph.graphs import LaneGraph
    from odscen.opendrive.road_model import LaneSection, OpenDrive, RoadMark

POINT_STEP = 1.0
"""Most metres of s between two points; a chord of 1 m at a radius of 5 m is 2.5 cm off."""

_UNPAINTED = frozenset({"none", "grass", "curb", "edge", ""})
_SHORTEST = 0.05
"""Metres below which a stretch of a marking is an editor's leftover."""


def map_elements(odr: OpenDrive, graph: LaneGraph) -> MapElements:
    """Elements of a map; lanes in the order of the lane graph's."""
    table = RoadTable.of(odr)
    lanes = _make_lane_elements(odr, table, graph)
    walks = tuple(
        CrosswalkElement(
            _lift_to(crosswalk.polygon, crosswalk.z),
            _lift_to(crosswalk.axis, crosswalk.z),
            crosswalk.width,
        )
        for crosswalk in crosswalks(odr, table)
    )
    return MapElements(
        lanes, tuple(_make_line_elements(odr, table)), tuple(road_edges(lanes)), walks
    )


def _lift_to(xy: FloatArray, z: float) -> FloatArray:
    return np.column_stack([xy, np.full(len(xy), z)])


class _Polylines(NamedTuple):
    """Lines on lanes; line ``k`` is ``points[start[k]:start[k + 1]]`` of each."""

    start: IntArray
    centre: FloatArray
    inner: FloatArray
    outer: FloatArray


def _sample_polylines(
    table: RoadTable, rows: IntArray, s0: FloatArray, s1: FloatArray
) -> _Polylines:
    """Points along lanes (rows of the table) between two road coordinates each."""
    n = np.maximum(np.ceil((s1 - s0) / POINT_STEP), 1.0).astype(np.int64) + 1
    of = np.repeat(np.arange(len(rows)), n)
    share = ranges(np.zeros(len(n), dtype=np.int64), n) / (n - 1)[of]
    s = s0[of] * (1.0 - share) + s1[of] * share
    found = [table.lane_points(rows[of], s, at=at) for at in (0.5, 0.0, 1.0)]
    lines = [np.stack([points.x, points.y, points.z], axis=1) for points in found]
    return _Polylines(offsets(n), *lines)


def _make_lane_elements(
    odr: OpenDrive, table: RoadTable, graph: LaneGraph
) -> tuple[LaneElement, ...]:
    own = graph.lanes
    rows = np.array([table.lane_index[key] for key in own.keys], dtype=np.int64)
    lines = _sample_polylines(table, rows, table.lane_s0[rows], table.lane_s1[rows])
    entries, exits = _lane_links(graph)
    row_of = {key: row for row, key in enumerate(own.keys)}
    elements = []
    for row, key in enumerate(own.keys):
        part = slice(int(lines.start[row]), int(lines.start[row + 1]))
        turned = 1 if own.forward[row] else -1
        centre, inner, outer = (
            line[part][::turned] for line in (lines.centre, lines.inner, lines.outer)
        )
        # The inner border is on the left of a lane with negative id that runs with s.
        keeps_right = (key.lane < 0) == (turned > 0)
        left, right = (inner, outer) if keeps_right else (outer, inner)
        nodes = slice(int(own.first_node[row]), int(own.first_node[row + 1]))
        middle = (nodes.start + nodes.stop) // 2
        change = int(graph.lane_change[middle])
        elements.append(
            LaneElement(
                key=str(key),
                kind=own.types[row],
                road_type=next((kind.type for kind in odr.roads[key.road].types), ""),
                junction=own.junctions[row] or "",
                centre=centre,
                left=left,
                right=right,
                speed_limit=float(graph.speed_limit[middle]),
                entries=entries[row],
                exits=exits[row],
                left_lane=_usual_neighbour(graph.left_lane[nodes]),
                right_lane=_usual_neighbour(graph.right_lane[nodes]),
                opposite=_opposite_lane(key, row, row_of, graph),
                keeps_right=keeps_right,
                change_left=bool(change & CHANGE_LEFT),
                change_right=bool(change & CHANGE_RIGHT),
            )
        )
    return tuple(elements)


def _lane_links(graph: LaneGraph) -> tuple[list[tuple[int, ...]], list[tuple[int, ...]]]:
    """Rows of the lanes before and behind each lane, sorted."""
    on = graph.relation == Relation.SUCCESSOR
    source, target = graph.lane[graph.source[on]], graph.lane[graph.target[on]]
    # An edge within a lane leads to its next node; one from its last to its first is a closed loop.
    passed = (source != target) | (graph.target[on] <= graph.source[on])
    pairs = sorted(set(zip(source[passed].tolist(), target[passed].tolist(), strict=True)))
    entries: list[list[int]] = [[] for _ in graph.lanes.keys]
    exits: list[list[int]] = [[] for _ in graph.lanes.keys]
    for before, after in pairs:
        exits[before].append(after)
        entries[after].append(before)
    return [tuple(sorted(entry)) for entry in entries], [tuple(rows) for rows in exits]


def _usual_neighbour(lanes: IntArray | np.ndarray[tuple[int], np.dtype[np.int32]]) -> int:
    """Neighbour beside most nodes of a lane, or -1."""
    there, count = np.unique(lanes[lanes >= 0], return_counts=True)
    return int(there[np.argmax(count)]) if len(there) else -1


def _opposite_lane(key: LaneKey, row: int, row_of: dict[LaneKey, int], graph: LaneGraph) -> int:
    if abs(key.lane) != 1:
        return -1
    other = row_of.get(LaneKey(key.road, key.section, -key.lane), -1)
    against = other >= 0 and graph.lanes.forward[other] != graph.lanes.forward[row]
    return other if against else -1


class _MarkedStretch(NamedTuple):
    """A marking along a lane's outer border, or along the inner one of a lane at the centre."""

    row: int
    inner: bool
    s0: float
    s1: float
    kind: str
    color: str


def _make_line_elements(odr: OpenDrive, table: RoadTable) -> Iterator[LineElement]:
    stretches = [
        marked_stretch
        for road in odr.roads.values()
        for index, section in enumerate(road.sections)
        for marked_stretch in _marked_stretches(table, road.id, index, section)
    ]
    rows = np.array([stretch.row for stretch in stretches], dtype=np.int64)
    s0 = np.array([stretch.s0 for stretch in stretches])
    s1 = np.array([stretch.s1 for stretch in stretches])
    lines = _sample_polylines(table, rows, s0, s1)
    for k, mark in enumerate(stretches):
        points = (lines.inner if mark.inner else lines.outer)[lines.start[k] : lines.start[k + 1]]
        yield LineElement(mark.kind, mark.color, points)


def _marked_stretches(
    table: RoadTable, road: RoadId, index: int, section: LaneSection
) -> Iterator[_MarkedStretch]:
    for number, lane in section.lanes.items():
        beside = number or next((side for side in (-1, 1) if side in section.lanes), 0)
        if not beside:
            continue
        row = table.lane_index[LaneKey(road, index, beside)]
        for mark, s0, s1 in _mark_intervals(lane.road_marks, section):
            if mark.type not in _UNPAINTED and s1 - s0 >= _SHORTEST:
                color = "white" if mark.color in {"standard", ""} else mark.color
                yield _MarkedStretch(row, not number, s0, s1, mark.type, color)


def _mark_intervals(
    marks: Sequence[RoadMark], section: LaneSection
) -> Iterator[tuple[RoadMark, float, float]]:
    ends = [*(mark.s for mark in marks[1:]), section.s_end]
    for mark, end in zip(marks, ends, strict=False):
        yield mark, max(mark.s, section.s), min(end, section.s_end)


# ------------------------------------------------------------------- where the driving surface ends
# Along a road that is each border of a lane that no other driving lane lies beyond. In a junction
# lanes cross, so that it is the outline of all of its lanes together, open where roads lead in.
_SEAM = 0.05
"""Metres by which lanes of a junction may miss each other without an edge between them."""
_OPEN = 0.3
"""Metres around the roads at a junction within which its outline is no edge."""
_SHORTEST_EDGE = 0.5


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
        if line.length >= _SHORTEST_EDGE:
            xy = shapely.get_coordinates(line)
            yield np.column_stack([xy, border[tree.query(xy)[1], 2]])


def _lane_polygon(lane: LaneElement) -> Any:
    import shapely

    ring = np.concatenate([lane.left[:, :2], lane.right[::-1, :2]])
    return shapely.Polygon(ring).buffer(0.0)
