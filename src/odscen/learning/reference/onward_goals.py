"""Goals to which vehicles that are already driving get without a lane change right ahead.

A vehicle on its way has mostly changed to the lane that its route needs. A goal drawn for one that
has just been put on the road knows nothing of that, and makes it brake hard before the junction at
which it is on the wrong lane.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from odscen.lanegraph.graphs import Relation
from odscen.lanegraph.shortest_paths import Router

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.lanegraph.graphs import LaneGraph, MapGraph

NO_GOAL = -1
TRIES = 32
"""Goals that are tried for all vehicles together."""
AHEAD = 120.0
"""Metres that a vehicle follows its lane at least, where a goal allows it."""
SECONDS = 8.0
"""And for how long at its speed."""
BRAKING = 4.0
"""m/s² with which a vehicle slows down at most for a bend on the way to its goal."""
_SIDEWAYS = 5.5
"""m/s² across the driving direction that limit the speed in a bend inside a junction."""
_SLOWEST = 2.0
"""m/s; no bend is slower."""
_CHANGE = 30.0
"""Metres that a lane change counts as on the way to a goal."""


def onward_goals(
    graph: MapGraph,
    roads: BoolArray,
    *,
    node: IntArray,
    speed: FloatArray,
    rng: np.random.Generator,
) -> IntArray:
    """Draw goals among the ends of the region, or of its lanes where it has none.

    Parameters
    ----------
    roads
        Shape ``(N,)``: nodes of the region.
    node, speed
        Of each vehicle; m/s.

    Returns
    -------
    Node for each vehicle, :data:`NO_GOAL` where none of those tried can be reached.
    """
    lanes = graph.lanes
    router = Router(graph, roads)
    ends = np.flatnonzero(roads)[router.out_degree == 0]
    on_lanes = _last_nodes(lanes, roads)
    found = np.full(len(node), NO_GOAL, dtype=np.int64)
    onwards = _LanesOnwards.of(lanes, roads)
    wanted = np.maximum(AHEAD, SECONDS * speed)
    for pool in (ends, on_lanes):
        open_ = np.flatnonzero(found == NO_GOAL)
        goals = rng.permutation(pool)[:TRIES]
        if not len(open_) or not len(goals):
            continue
        free = onwards.free_metres(node[open_], goals, wanted[open_], speed[open_])
        row, table = router.reach(node[open_].astype(np.int32), goals.astype(np.int32))
        free[~table[row].T | (goals[:, None] == node[open_])] = -1.0
        order = rng.permuted(np.tile(np.arange(len(goals)), (len(open_), 1)), axis=1).T
        best = np.argmax(np.take_along_axis(free, order, axis=0), axis=0)
        chosen = order[best, np.arange(len(open_))]
        leads = free[chosen, np.arange(len(open_))] >= 0.0
        found[open_[leads]] = goals[chosen[leads]]
    return found


def _last_nodes(lanes: LaneGraph, roads: BoolArray) -> IntArray:
    """Last node of each lane outside junctions, where it is in the region."""
    outside = np.array([name is None for name in lanes.lanes.junctions], dtype=np.bool_)
    last = lanes.lanes.first_node[1:].astype(np.int64) - 1
    some = lanes.lanes.first_node[1:] > lanes.lanes.first_node[:-1]
    last = last[outside & some]
    return last[roads[last]]


class _LanesOnwards(NamedTuple):
    """Lanes of a region and where they lead; lanes are numbered as in the lane graph."""

    lanes: LaneGraph
    section: IntArray
    back: csr_array
    passing: FloatArray

    @classmethod
    def of(cls, lanes: LaneGraph, roads: BoolArray) -> _LanesOnwards:
        inside = roads[lanes.source] & roads[lanes.target]
        one, other = lanes.lane[lanes.source[inside]], lanes.lane[lanes.target[inside]]
        follows = lanes.relation[inside] == Relation.SUCCESSOR
        kept = one != other
        length = np.maximum(lanes.lanes.lengths, 0.1)
        cost = np.where(follows, length[other], _CHANGE)[kept]
        count = len(length)
        pairs = one[kept].astype(np.int64) * count + other[kept]
        order = np.lexsort((cost, pairs))
        pairs, first = np.unique(pairs[order], return_index=True)
        where = (pairs % count, pairs // count)
        names = [(key.road, key.section) for key in lanes.lanes.keys]
        rows = {name: row for row, name in enumerate(dict.fromkeys(names))}
        section = np.array([rows[name] for name in names], dtype=np.int64)
        back = csr_array((cost[order][first], where), shape=(count, count))
        return cls(lanes, section, back, _passing_speeds(lanes))

    def free_metres(
        self, node: IntArray, goals: IntArray, wanted: FloatArray, speed: FloatArray
    ) -> FloatArray:
        """Metres to the first lane change of each vehicle on its way to each goal, ``(K, V)``.

        Or to the first bend that it is too fast for. At most ``wanted``, which ``(V,)`` vehicles
        have; all of it to the goal without either.
        """
        lanes = self.lanes
        targets = lanes.lane[goals].astype(np.int64)
        _, ahead = dijkstra(self.back, indices=targets, return_predecessors=True)
        at = np.tile(lanes.lane[node].astype(np.int64), (len(goals), 1))
        rows = np.arange(len(goals))[:, None]
        metres = np.tile(lanes.lanes.lengths[at[0]] - lanes.offset[node], (len(goals), 1))
        going = metres < wanted
        while going.any():
            there = ahead[rows, at]
            arrived = there < 0
            beside = ~arrived & (self.section[at] == self.section[np.maximum(there, 0)])
            slow = self.passing[np.maximum(there, 0)]
            fast = ~arrived & (speed**2 > slow**2 + 2.0 * BRAKING * metres)
            metres = np.where(going & arrived, wanted, metres)
            metres = np.where(going & fast, 0.0, metres)
            going &= ~arrived & ~beside & ~fast
            at = np.where(going, there, at)
            metres = np.where(going, metres + lanes.lanes.lengths[at], metres)
            going &= metres < wanted
        found: FloatArray = np.minimum(metres, wanted)
        return found


def _passing_speeds(lanes: LaneGraph) -> FloatArray:
    """Speed at which each lane is driven, m/s: its limit, inside junctions less in bends."""
    count = len(lanes.lanes.keys)
    nodes = np.maximum(np.bincount(lanes.lane, minlength=count), 1)
    bend = np.bincount(lanes.lane, weights=np.abs(lanes.curvature), minlength=count) / nodes
    limit = np.full(count, np.inf)
    known = ~np.isnan(lanes.speed_limit)
    np.minimum.at(limit, lanes.lane[known], lanes.speed_limit[known])
    inside = np.array([name is not None for name in lanes.lanes.junctions], dtype=np.bool_)
    turning = np.where(inside, np.sqrt(_SIDEWAYS / np.maximum(bend, 1e-6)), np.inf)
    found: FloatArray = np.maximum(np.minimum(limit, turning), _SLOWEST)
    return found
