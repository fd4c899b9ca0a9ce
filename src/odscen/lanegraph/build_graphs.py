"""From the road model to the graphs of a map."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.errors import InputError, OpenDriveError
from odscen.base.shown import shown_id
from odscen.lanegraph.centrelines import MOST_LANES
from odscen.lanegraph.graphs import (
    CHANGE_LEFT,
    CHANGE_RIGHT,
    ByteArray,
    LaneGraph,
    Lanes,
    MapGraph,
    Relation,
)
from odscen.lanegraph.lane_density import check_density
from odscen.lanegraph.lane_nodes import NodeTable, place_nodes
from odscen.lanegraph.pedestrian_graph import build_pedestrians
from odscen.lanegraph.query import WALK_PREFIX, is_walk_node_id
from odscen.lanegraph.segments import SegmentMap, build_segments
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import crosswalks
from odscen.opendrive.topology import lane_successors, side_links

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.base.ids import LaneKey
    from odscen.opendrive.road_model import OpenDrive
    from odscen.opendrive.topology import SideLink


# -------------------------------------------------------------------------- edges of the lane graph
MAX_PASSED = 16
"""Lanes that an edge to the side may pass on its way one spacing ahead."""


class Edges(NamedTuple):
    """Edges, each array of shape ``(E,)``, sorted by (source, relation, target)."""

    source: IntArray
    target: IntArray
    relation: ByteArray
    length: FloatArray


def connect(
    nodes: NodeTable,
    keys: Sequence[LaneKey],
    successors: Mapping[LaneKey, Sequence[LaneKey]],
    sides: Sequence[SideLink] = (),
) -> Edges:
    """Make all edges of a map.

    Parameters
    ----------
    nodes
        The nodes.
    keys
        Name of each lane of ``nodes``.
    successors
        Lanes that follow each lane in driving direction, of all types.
    sides
        Lanes that begin or end beside others.
    """
    number = {key: lane for lane, key in enumerate(keys)}
    follow = [
        [number[after] for after in successors.get(key, ()) if after in number] for key in keys
    ]
    parts = [
        _link_along_lanes(nodes),
        _link_across_joints(nodes, follow),
        _link_at_sides(nodes, number, sides),
        _link_lane_changes(nodes, follow, Relation.LEFT),
        _link_lane_changes(nodes, follow, Relation.RIGHT),
    ]
    source, target, relation, length = (
        np.concatenate(columns) for columns in zip(*parts, strict=True)
    )
    order = np.lexsort((length, target, relation, source))
    source, target, relation, length = (
        column[order] for column in (source, target, relation, length)
    )
    keep = source != target  # a ring so short that it has one node
    keep[1:] &= (
        (source[1:] != source[:-1]) | (target[1:] != target[:-1]) | (relation[1:] != relation[:-1])
    )
    return Edges(source[keep], target[keep], relation[keep], length[keep])


def _link_along_lanes(nodes: NodeTable) -> Edges:
    """From each node to the next one of its lane."""
    source = np.flatnonzero(nodes.lane[:-1] == nodes.lane[1:])
    length = nodes.offset[source + 1] - nodes.offset[source]
    return _make_edges(source, source + 1, Relation.SUCCESSOR, length)


def _link_across_joints(nodes: NodeTable, follow: list[list[int]]) -> Edges:
    """From the last node of each lane to the first of each lane that follows it."""
    lengths = nodes.lines.lengths.tolist()
    first = nodes.first.tolist()
    empty = [begin == end for begin, end in itertools.pairwise(first)]
    pairs = [
        (lane, after, between)
        for lane in range(len(lengths))
        if not empty[lane]
        for after, between in _lanes_following(lane, follow, lengths, empty)
    ]
    table = np.array(pairs, dtype=np.float64).reshape(-1, 3)
    lane, after = table[:, 0].astype(np.int64), table[:, 1].astype(np.int64)
    source, target = nodes.first[lane + 1] - 1, nodes.first[after]
    rest = nodes.lines.lengths[lane] - nodes.offset[source]
    length = rest + table[:, 2] + nodes.offset[target]
    return _make_edges(source, target, Relation.SUCCESSOR, length)


def _link_at_sides(
    nodes: NodeTable, number: Mapping[LaneKey, int], sides: Sequence[SideLink]
) -> Edges:
    """Between the last node before a side link and the first one behind it."""
    pairs: list[tuple[int, int, float]] = []
    for side in sides:
        if side.main not in number or side.other not in number:
            continue
        main, other = number[side.main], number[side.other]
        place = float(nodes.lines.offset_at(np.array([main]), np.array([side.s]))[0])
        own = range(int(nodes.first[main]), int(nodes.first[main + 1]))
        first, end = int(nodes.first[other]), int(nodes.first[other + 1])
        if first == end:
            continue
        if side.leaves:
            before = [node for node in own if nodes.offset[node] <= place]
            if before:
                gap = place - float(nodes.offset[before[-1]]) + float(nodes.offset[first])
                pairs.append((before[-1], first, gap))
        else:
            behind = [node for node in own if nodes.offset[node] >= place]
            if behind:
                rest = float(nodes.lines.lengths[other] - nodes.offset[end - 1])
                pairs.append((end - 1, behind[0], rest + float(nodes.offset[behind[0]]) - place))
    table = np.array(pairs, dtype=np.float64).reshape(-1, 3)
    source, target = table[:, 0].astype(np.int64), table[:, 1].astype(np.int64)
    return _make_edges(source, target, Relation.SUCCESSOR, table[:, 2])


def _lanes_following(
    lane: int, follow: list[list[int]], lengths: list[float], empty: list[bool]
) -> Iterator[tuple[int, float]]:
    """Lanes with nodes that follow ``lane``, and the metres of lanes without nodes in between."""
    todo = [(after, 0.0) for after in follow[lane]]
    seen = {lane}
    while todo:
        after, between = todo.pop()
        if not empty[after]:
            yield after, between
        elif after not in seen:
            seen.add(after)
            todo += [(further, between + lengths[after]) for further in follow[after]]


def _link_lane_changes(nodes: NodeTable, follow: list[list[int]], relation: Relation) -> Edges:
    """From each node to the adjacent lane's node about one spacing ahead, where that is permitted.

    Near the end of the lane section that node may lie in the one lane that follows the adjacent
    one; if several lanes follow it, or none, there is no edge. Nor is there one that would lead
    back, as it happens where a lane swings out to many times its width.
    """
    bit, beside = (
        (CHANGE_LEFT, nodes.left) if relation is Relation.LEFT else (CHANGE_RIGHT, nodes.right)
    )
    source = np.flatnonzero(nodes.lane_change & bit)
    goal, k = _nodes_ahead(nodes, follow, beside[source], nodes.s[source])
    source, goal, k = source[goal >= 0], goal[goal >= 0], k[goal >= 0]
    target = nodes.kept[nodes.planned[goal] + k]
    source, target = source[target >= 0], target[target >= 0]
    dx = nodes.x[target] - nodes.x[source]
    dy = nodes.y[target] - nodes.y[source]
    dz = nodes.z[target] - nodes.z[source]
    onward = dx * np.cos(nodes.hdg[source]) + dy * np.sin(nodes.hdg[source]) > 0
    length = np.sqrt(dx * dx + dy * dy + dz * dz)
    return _make_edges(source[onward], target[onward], relation, length[onward])


def _nodes_ahead(
    nodes: NodeTable, follow: list[list[int]], lane: IntArray, s: FloatArray
) -> tuple[IntArray, IntArray]:
    """Planned node nearest to one spacing ahead of s on each lane, as lane (or -1) and k on it.

    Behind the end of a lane the only one that follows it continues it; short lanes are passed.
    """
    lengths, planned = nodes.lines.lengths, np.diff(nodes.planned)
    gap = np.maximum(lengths / planned, 1e-6)
    only = np.array([after[0] if len(after) == 1 else -1 for after in follow], dtype=np.int64)
    place = nodes.lines.offset_at(lane, s) + nodes.spacing
    goal = lane.copy()
    k = np.rint(place / gap[goal] - 0.5).astype(np.int64)
    over = np.arange(len(lane))
    for _ in range(MAX_PASSED):
        over = over[k[over] >= planned[goal[over]]]
        place[over] -= lengths[goal[over]]
        goal[over] = only[goal[over]]
        over = over[goal[over] >= 0]
        k[over] = np.maximum(np.rint(place[over] / gap[goal[over]] - 0.5), 0)
    goal[over[k[over] >= planned[goal[over]]]] = -1
    return goal, k


def _make_edges(
    source: IntArray, target: IntArray, relation: Relation, length: FloatArray
) -> Edges:
    return Edges(source, target, np.full(len(source), relation, dtype=np.uint8), length)


# ------------------------------------------------------- from the road model to the graphs of a map
MIN_SPACING, MAX_SPACING = 0.1, 100.0
"""Metres; the range of spacings that make sense for placing vehicles."""


def build_map_graph(
    odr: OpenDrive,
    *,
    name: str,
    sha256: str,
    spacing: float = 2.0,
    table: RoadTable | None = None,
    most_lanes: float = MOST_LANES,
) -> MapGraph:
    """Make lane graph, segments and pedestrian graph of a map (requirements R20 to R27, R32).

    Parameters
    ----------
    odr
        The road model.
    name, sha256
        What the map is called, and the hash of its .xodr.
    spacing
        Metres between nodes of a lane or walk, before rounding per lane.
    table
        The road model as arrays, if it has been made already.
    most_lanes
        Metres that all drivable lanes, or all walks, may have together.

    Raises
    ------
    InputError
        If ``spacing`` is out of range.
    OpenDriveError
        If the lanes together are longer, need too many nodes, or lie on each other, or a road has
        an id with which its nodes would be those of walks.
    """
    if not MIN_SPACING <= spacing <= MAX_SPACING:
        raise InputError(f"spacing {spacing} m is not within {MIN_SPACING} to {MAX_SPACING} m")
    for road in odr.roads:
        if is_walk_node_id(road):
            raise OpenDriveError(
                f"nodes of walks begin with {WALK_PREFIX!r}, so no id of a road may; rename it",
                element=f"road {shown_id(road)}",
            )
    table = RoadTable.of(odr) if table is None else table
    successors = lane_successors(odr)
    nodes = place_nodes(table, spacing, most=most_lanes)
    check_density(table, nodes.lines.rows[nodes.lane], np.stack([nodes.x, nodes.y, nodes.z]))
    segments = build_segments(odr)
    row = {road: index for index, road in enumerate(odr.roads)}
    road_rows = np.array([row[road] for road in table.road_ids], dtype=np.int64)
    return MapGraph(
        map_name=name,
        map_sha256=sha256,
        lanes=_lane_graph(odr, table, nodes, segments, road_rows, successors),
        segments=segments.segments,
        walks=build_pedestrians(
            odr,
            table,
            spacing=spacing,
            most=most_lanes,
            vehicles=nodes,
            segments=segments,
            road_rows=road_rows,
            successors=successors,
            crosswalks=crosswalks(odr, table),
        ),
    )


def _lane_graph(
    odr: OpenDrive,
    table: RoadTable,
    nodes: NodeTable,
    segments: SegmentMap,
    road_rows: IntArray,
    successors: Mapping[LaneKey, Sequence[LaneKey]],
) -> LaneGraph:
    keys = [table.lane_keys[row] for row in nodes.lines.rows.tolist()]
    edges = connect(nodes, keys, successors, side_links(odr))
    used = np.flatnonzero(np.diff(nodes.first))
    number = np.full(len(keys) + 1, -1, dtype=np.int64)  # the last answers for lane -1
    number[used] = np.arange(len(used))
    rows = nodes.lines.rows
    road = road_rows[table.lane_road[rows]][nodes.lane]
    return LaneGraph(
        spacing=nodes.spacing,
        lanes=Lanes(
            keys=tuple(keys[lane] for lane in used.tolist()),
            types=tuple(table.lane_type[row] for row in rows[used].tolist()),
            junctions=tuple(odr.roads[keys[lane].road].junction for lane in used.tolist()),
            lengths=nodes.lines.lengths[used],
            forward=nodes.lines.forward[used],
            first_node=np.append(nodes.first[used], nodes.first[-1]).astype(np.int32),
        ),
        lane=number[nodes.lane].astype(np.int32),
        s=nodes.s,
        offset=nodes.offset,
        x=nodes.x,
        y=nodes.y,
        z=nodes.z,
        hdg=nodes.hdg,
        pitch=nodes.pitch,
        curvature=nodes.curvature,
        width=nodes.width,
        speed_limit=table.speed_limit(rows[nodes.lane], nodes.s),
        left_lane=number[nodes.left].astype(np.int32),
        right_lane=number[nodes.right].astype(np.int32),
        lane_change=nodes.lane_change,
        segment=segments.at(road, nodes.s).astype(np.int32),
        source=edges.source.astype(np.int32),
        target=edges.target.astype(np.int32),
        relation=edges.relation,
        length=edges.length,
    )
