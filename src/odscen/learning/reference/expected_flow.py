"""How much traffic a road can expect: random shortest trips over the lanes of a map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from odscen.lanegraph.graphs import Relation

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray
    from odscen.lanegraph.graphs import LaneGraph

ORIGINS = 160
"""Lanes that trips begin on, at most."""
_CHANGE = 15.0
"""Metres that a lane change counts as."""


def expected_flow(lanes: LaneGraph) -> FloatArray:
    """Relative number of trips over each lane, as the mean over the lanes beside it; ``(L,)``.

    Trips lead by the shortest path from everywhere on the roads to everywhere else on them, both by
    length. The mean over all lanes is 1.
    """
    count = len(lanes.lanes.keys)
    lengths = np.maximum(lanes.lanes.lengths, 0.1)
    one, other = lanes.lane[lanes.source], lanes.lane[lanes.target]
    follows = (lanes.relation == Relation.SUCCESSOR) & (one != other)
    beside = lanes.relation != Relation.SUCCESSOR
    cost = np.concatenate([lengths[other[follows]], np.full(int(beside.sum()), _CHANGE)])
    source = np.concatenate([one[follows], one[beside]])
    target = np.concatenate([other[follows], other[beside]])
    pairs, first = np.unique(source.astype(np.int64) * count + target, return_index=True)
    graph = csr_array((cost[first], (pairs // count, pairs % count)), shape=(count, count))
    on_road = np.array([name is None for name in lanes.lanes.junctions], dtype=np.bool_)
    weight = lengths * on_road
    origins = _spread(weight)
    far, before = dijkstra(graph, indices=origins, return_predecessors=True)
    total = np.zeros(count)
    for row, origin in enumerate(origins):
        total += _trips(far[row], before[row], weight) * _share(weight, origin, origins)
    total = _over_lanes_beside(lanes, total)
    mean = float(total[on_road].mean()) if on_road.any() else 0.0
    return np.asarray(total / mean) if mean > 0 else np.ones(count)


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


def _over_lanes_beside(lanes: LaneGraph, total: FloatArray) -> FloatArray:
    keys = lanes.lanes.keys
    ids = [
        (key.road, key.section, forward)
        for key, forward in zip(keys, lanes.lanes.forward.tolist(), strict=True)
    ]
    rows = {one: row for row, one in enumerate(dict.fromkeys(ids))}
    of = np.array([rows[one] for one in ids], dtype=np.int64)
    mean: FloatArray = np.bincount(of, weights=total) / np.maximum(np.bincount(of), 1)
    return mean[of]
