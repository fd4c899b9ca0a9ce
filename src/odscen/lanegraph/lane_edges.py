"""Edges of the lane graph: successor, left and right (requirement R21)."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.lanegraph.graphs import CHANGE_LEFT, CHANGE_RIGHT, ByteArray, Relation

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.base.ids import LaneKey
    from odscen.lanegraph.lane_nodes import NodeTable
    from odscen.opendrive.topology import SideLink


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
        _along_lanes(nodes),
        _across_joints(nodes, follow),
        _at_sides(nodes, number, sides),
        _to_the_side(nodes, follow, Relation.LEFT),
        _to_the_side(nodes, follow, Relation.RIGHT),
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


def _along_lanes(nodes: NodeTable) -> Edges:
    """From each node to the next one of its lane."""
    source = np.flatnonzero(nodes.lane[:-1] == nodes.lane[1:])
    length = nodes.offset[source + 1] - nodes.offset[source]
    return _make_edges(source, source + 1, Relation.SUCCESSOR, length)


def _across_joints(nodes: NodeTable, follow: list[list[int]]) -> Edges:
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


def _at_sides(nodes: NodeTable, number: Mapping[LaneKey, int], sides: Sequence[SideLink]) -> Edges:
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


def _to_the_side(nodes: NodeTable, follow: list[list[int]], relation: Relation) -> Edges:
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
