"""Strips of road: nodes of the lane graph in the order in which vehicles stand behind each other.

A strip ends at a junction or at the end of the map. Each node has at most one node ahead of it in
its strip; several may lie behind a node where lanes merge, so a strip is a tree with its root at
the stop line. Nodes with the same number of nodes ahead are a *row*: rows are worked off one after
the other, all strips at once.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.lanegraph.graphs import Relation

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.lanegraph.graphs import LaneGraph


@dataclass(frozen=True, slots=True, eq=False)
class Strips:
    """Strips of a lane graph; arrays have shape ``(N,)`` unless said otherwise.

    Attributes
    ----------
    on_road
        Whether the node lies outside junctions: the others are in no strip.
    ahead
        Next node of the strip; -1 at its end.
    step
        Metres to the node ahead; 0 at the end.
    root
        Last node of the strip.
    to_end, from_start
        Metres to the end of the strip, and from its (nearest) beginning.
    rows
        Nodes on roads by the number of nodes ahead of them, nearest to the end first.
    """

    on_road: BoolArray
    ahead: IntArray
    step: FloatArray
    root: IntArray
    to_end: FloatArray
    from_start: FloatArray
    rows: tuple[IntArray, ...]


def road_strips(lanes: LaneGraph) -> Strips:
    """Find the strips of a lane graph; a ring without a junction is cut at one of its nodes."""
    count = len(lanes.x)
    inside = np.array([name is not None for name in lanes.lanes.junctions], dtype=np.bool_)
    on_road = ~inside[lanes.lane]
    ahead, step = _next_nodes(lanes, on_road)
    hops, to_end, root = _distances_to_end(ahead, step)
    while np.any(endless := hops > count):
        cut = int(np.flatnonzero(endless)[0])
        ahead[cut], step[cut] = -1, 0.0
        hops, to_end, root = _distances_to_end(ahead, step)
    nodes = np.flatnonzero(on_road)
    nodes = nodes[np.argsort(hops[nodes], kind="stable")]
    starts = np.flatnonzero(np.diff(hops[nodes])) + 1
    rows = tuple(np.split(nodes, starts)) if len(nodes) else ()
    from_start = np.full(count, np.inf)
    for row in reversed(rows):
        from_start[row] = np.where(np.isinf(from_start[row]), 0.0, from_start[row])
        onwards = row[ahead[row] >= 0]
        np.minimum.at(from_start, ahead[onwards], from_start[onwards] + step[onwards])
    from_start[~on_road] = 0.0
    return Strips(on_road, ahead, step, root, to_end, from_start, rows)


def _next_nodes(lanes: LaneGraph, on_road: BoolArray) -> tuple[IntArray, FloatArray]:
    """Next node on the road, the straightest where roads part, and metres to it."""
    follows = np.flatnonzero(
        (lanes.relation == Relation.SUCCESSOR) & on_road[lanes.source] & on_road[lanes.target]
    )
    source, target = lanes.source[follows], lanes.target[follows]
    bend = np.abs(np.angle(np.exp(1j * (lanes.hdg[target] - lanes.hdg[source]))))
    order = np.lexsort((target, np.round(bend, 6), source))
    source, target, length = source[order], target[order], lanes.length[follows][order]
    first = np.concatenate(([True], source[1:] != source[:-1])) if len(source) else source > 0
    ahead = np.full(len(lanes.x), -1, dtype=np.int64)
    step = np.zeros(len(lanes.x))
    ahead[source[first]], step[source[first]] = target[first], length[first]
    return ahead, step


def _distances_to_end(ahead: IntArray, step: FloatArray) -> tuple[IntArray, FloatArray, IntArray]:
    """Nodes and metres to the end, and the last node, by doubling the length of the jumps."""
    count = len(ahead)
    jump, metres = ahead.copy(), step.copy()
    hops = (ahead >= 0).astype(np.int64)
    root = np.where(ahead < 0, np.arange(count), ahead)
    for _ in range(int(np.ceil(np.log2(max(count, 2)))) + 1):
        going = np.flatnonzero(jump >= 0)
        there = jump[going]
        hops[going] += hops[there]
        metres[going] += metres[there]
        root[going] = root[there]
        jump[going] = jump[there]
    hops[jump >= 0] = count + 1  # a ring
    return hops, metres, root
