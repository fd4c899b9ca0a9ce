"""How much traffic a road can expect: random shortest trips over the lanes of a map."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from odscen.lanegraph.graphs import Relation

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.lanegraph.graphs import LaneGraph

ORIGINS = 160
"""Lanes that trips begin on, at most."""
TO_KERB, FROM_KERB = 1.0, 15.0
"""Metres that a lane change counts as: one keeps to the kerb where there is a choice."""
CHANGE = 30.0
"""Length of a road, metres, of which one who changes lanes spends half on the old lane."""


class Flows(NamedTuple):
    """Relative numbers of trips; shapes ``(L,)``, of both the mean over all roads is 1.

    ``road`` is the mean over the lanes of one direction, ``lane`` that of the lane itself.
    """

    road: FloatArray
    lane: FloatArray


def expected_flows(lanes: LaneGraph) -> Flows:
    """Trips that lead by the shortest path from everywhere on the roads to everywhere else on them.

    Both by length. Lanes count apart, as the lane that most leave a road by has a queue, while
    those beside it are empty.
    """
    count = len(lanes.lanes.keys)
    lengths = np.maximum(lanes.lanes.lengths, 0.1)
    one, other = lanes.lane[lanes.source], lanes.lane[lanes.target]
    follows = (lanes.relation == Relation.SUCCESSOR) & (one != other)
    beside = lanes.relation != Relation.SUCCESSOR
    number = np.abs([key.lane for key in lanes.lanes.keys])
    directions = _directions(lanes)
    gone = lengths / (lengths + CHANGE)
    source = np.concatenate([one[follows], one[beside]])
    target = np.concatenate([other[follows], other[beside]])
    outwards = number[other[beside]] > number[one[beside]]
    cost = np.concatenate([lengths[other[follows]], np.where(outwards, TO_KERB, FROM_KERB)])
    pairs, first = np.unique(source.astype(np.int64) * count + target, return_index=True)
    graph = csr_array((cost[first], (pairs // count, pairs % count)), shape=(count, count))
    on_road = np.array([name is None for name in lanes.lanes.junctions], dtype=np.bool_)
    weight = lengths * on_road
    origins = _spread(weight)
    far, before = dijkstra(graph, indices=origins, return_predecessors=True)
    total = np.zeros(count)
    for row, origin in enumerate(origins):
        trips = _trips(far[row], before[row], weight)
        came = np.flatnonzero(before[row] >= 0)
        changed = came[directions[before[row][came]] == directions[came]]
        left = np.bincount(before[row][changed], weights=trips[changed], minlength=count)
        total += (trips - gone * left) * _share(weight, origin, origins)
    by_road = np.bincount(directions, weights=total) / np.maximum(np.bincount(directions), 1)
    return Flows(_relative(by_road[directions], on_road), _relative(total, on_road))


def _relative(total: FloatArray, on_road: BoolArray) -> FloatArray:
    mean = float(total[on_road].mean()) if on_road.any() else 0.0
    return np.asarray(total / mean) if mean > 0 else np.ones(len(total))


def _directions(lanes: LaneGraph) -> IntArray:
    """Row of the direction of its road that each lane is one of, ``(L,)``."""
    ids = [
        (key.road, key.section, forward)
        for key, forward in zip(lanes.lanes.keys, lanes.lanes.forward.tolist(), strict=True)
    ]
    rows = {one: row for row, one in enumerate(dict.fromkeys(ids))}
    return np.array([rows[one] for one in ids], dtype=np.int64)


def _spread(weight: FloatArray) -> list[int]:
    """Lanes at equal steps of the total length of roads: no chance is needed."""
    ends = np.cumsum(weight)
    wanted = (np.arange(ORIGINS) + 0.5) / ORIGINS * ends[-1]
    found: list[int] = np.unique(
        np.minimum(np.searchsorted(ends, wanted), len(weight) - 1)
    ).tolist()
    return found


def _share(weight: FloatArray, origin: int, origins: list[int]) -> float:
    return float(weight[origin] / sum(weight[one] for one in origins))


def _trips(far: FloatArray, before: FloatArray, weight: FloatArray) -> FloatArray:
    """Trips over each lane from one origin, if they end on lanes by ``weight``."""
    found: list[float] = np.where(np.isfinite(far), weight, 0.0).tolist()
    came = before.tolist()
    for lane in np.argsort(-np.where(np.isfinite(far), far, -1.0), kind="stable").tolist():
        if came[lane] >= 0:
            found[came[lane]] += found[lane]
    total = max(float(weight[np.isfinite(far)].sum()), 1.0)
    trips: FloatArray = np.array(found) / total
    return trips
