"""Where a body fits on the lane graph, node by node, and the largest crowd that fits (R47)."""

from __future__ import annotations

from math import ceil
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.lanegraph.graphs import CHANGE_LEFT, CHANGE_RIGHT, LaneGraph, PedestrianGraph, Relation
from odscen.lanegraph.searches.edge_matrix import MIN_EDGE_LENGTH
from odscen.scenario.placing.bodies import SIDE_GAP, Crowd, box_at

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray
    from scipy.sparse import csr_array

    from odscen.base.arrays import BoolArray, FloatArray
    from odscen.base.categories import Body, Category

LANE_MARGIN = 0.05
"""Free width kept between a body and the border of its lane, metres."""
SAGITTA = 0.05
"""A rigid body of length L on curvature k sits ``L^2 |k| / 8`` beside the lane centre; no more than
this many metres are accepted for sampled spawns."""

LANE_CHANGE = 8.0
"""Metres beyond its front that a vehicle setting off needs to change lanes; our choice, about what
a car at full lock needs to move a lane's width aside."""
_PARTS_KEPT = 64
"""Parts of a graph of which it is kept what they reach: a byte for each node."""


class MaximalCrowd(NamedTuple):
    """A maximal crowd: nodes in the order of the graph, and the category that is on each."""

    nodes: tuple[int, ...]
    categories: tuple[Category, ...]

    def __len__(self) -> int:
        return len(self.nodes)


def standing_room(graph: LaneGraph, body: Body, *, allowed: BoolArray) -> BoolArray:
    """Nodes on which a body can be placed so that it lies along its lane.

    Parameters
    ----------
    allowed
        Shape ``(N,)``: nodes that the body's centre, and what is under its length, may use.

    Returns
    -------
    Shape ``(N,)``: the lane is wide enough, it continues for half a length either way, all nodes
    under the body are ``allowed``, and none of them bends more than :data:`SAGITTA` permits.
    """
    bends = body.length**2 * np.abs(graph.curvature) / 8 > SAGITTA
    good = allowed & ~bends
    follows = graph.relation == Relation.SUCCESSOR
    source, target = graph.source[follows], graph.target[follows]
    ahead, behind = good.copy(), good.copy()
    for _ in range(ceil(body.length / 2 / graph.spacing)):
        ahead &= _step_back(ahead, source, target)
        behind &= _step_back(behind, target, source)
    return ahead & behind & (graph.width >= body.width + 2 * LANE_MARGIN)


def late_for_changes(graph: LaneGraph, body: Body) -> BoolArray:
    """Nodes where lanes may be changed, but not for long enough for a vehicle that departs there.

    Returns
    -------
    Shape ``(N,)``: a lane change is permitted to a side here, and not any more, or not on all lanes
    ahead, where the front is and :data:`LANE_CHANGE` further on.
    """
    follows = graph.relation == Relation.SUCCESSOR
    source, target = graph.source[follows], graph.target[follows]
    late = np.zeros(len(graph.x), dtype=np.bool_)
    for side in (CHANGE_LEFT, CHANGE_RIGHT):
        here = graph.lane_change & side > 0
        ahead = here.copy()
        for _ in range(ceil((body.length / 2.0 + LANE_CHANGE) / graph.spacing)):
            ahead &= _step_back(ahead, source, target)
        late |= here & ~ahead
    return late


def max_fit(
    graph: LaneGraph | PedestrianGraph,
    bodies: Mapping[Category, Body],
    allowed: Mapping[Category, BoolArray],
    *,
    shares: Mapping[Category, float],
    minimum_gap: float,
) -> MaximalCrowd:
    """Place as many bodies as fit: lane after lane, from its start, at the first node that is free.

    At each node the body's category is the one furthest behind its share among those that may be
    there, so that the crowd keeps the ``shares`` as closely as the places allow. The result depends
    on nothing but the arguments; with one category nothing can be added to it.

    Parameters
    ----------
    bodies, allowed
        Size, and mask of nodes (shape ``(N,)``), of each category.
    shares
        Relative share of each category; those with share 0 are left out.
    minimum_gap
        Free length between two bodies, metres.
    """
    categories = [category for category, share in shares.items() if share > 0]
    quota = {c: shares[c] / sum(shares[d] for d in categories) for c in categories}
    masks = {c: allowed[c].tolist() for c in categories}
    crowd = crowd_for(bodies, minimum_gap=minimum_gap)
    placed: dict[Category, int] = dict.fromkeys(categories, 0)
    fit: list[tuple[int, Category]] = []
    for node in np.flatnonzero(np.any([allowed[c] for c in categories], axis=0)).tolist():
        choices = (c for c in categories if masks[c][node])
        category = min(choices, key=lambda c: placed[c] - (len(fit) + 1) * quota[c])
        box = box_at(graph, node, bodies[category], gap=minimum_gap)
        if crowd.is_free(box):
            crowd.add(node, box)
            placed[category] += 1
            fit.append((node, category))
    return MaximalCrowd(tuple(node for node, _ in fit), tuple(category for _, category in fit))


def crowd_for(bodies: Mapping[Category, Body], *, minimum_gap: float) -> Crowd:
    """Return an empty crowd that boxes of these bodies, grown by the gap, can be added to."""
    largest = max(
        np.hypot(body.length + minimum_gap, body.width + SIDE_GAP) for body in bodies.values()
    )
    return Crowd(float(largest))


def distance_to_end(ends: NDArray[np.integer], graph: LaneGraph, mask: BoolArray) -> FloatArray:
    """Metres from each node along the lanes to the nearest of ``ends``, inside ``mask``.

    Infinite where no end can be reached.
    """
    from scipy.sparse.csgraph import dijkstra

    if not len(ends):
        return np.full(len(graph.x), np.inf)
    matrix = _shortest_edges(graph, mask).T.tocsr()
    return np.asarray(dijkstra(matrix, indices=ends, min_only=True), dtype=np.float64)


class Reach:
    """What can be reached on the lane graph inside ``mask``; quick, for many spawns.

    Nodes that can be reached from each other reach the same: of a town almost all.
    """

    def __init__(self, graph: LaneGraph, mask: BoolArray) -> None:
        from scipy.sparse.csgraph import connected_components

        self._edges = _shortest_edges(graph, mask)
        self._mask = mask
        _, self._part = connected_components(self._edges, connection="strong")
        self._known: dict[int, BoolArray] = {}

    def of(self, node: int) -> BoolArray:
        """Nodes that can be reached from ``node``, itself included; shape ``(N,)``."""
        part = int(self._part[node])
        if part not in self._known:
            if len(self._known) >= _PARTS_KEPT:
                self._known.clear()
            self._known[part] = self._nodes_reached(node)
        return self._known[part]

    def _nodes_reached(self, node: int) -> BoolArray:
        from scipy.sparse.csgraph import breadth_first_order

        reached = np.zeros(len(self._mask), dtype=np.bool_)
        if self._mask[node]:
            reached[breadth_first_order(self._edges, node, return_predecessors=False)] = True
        return reached


def _shortest_edges(graph: LaneGraph, mask: BoolArray) -> csr_array:
    """Edges with both ends in ``mask``, the shortest of parallel ones, with their lengths."""
    from scipy.sparse import csr_array

    count = len(graph.x)
    inside = mask[graph.source] & mask[graph.target]
    source, target = graph.source[inside], graph.target[inside]
    length = np.maximum(graph.length[inside], MIN_EDGE_LENGTH)
    order = np.lexsort((length, target, source))
    source, target, length = source[order], target[order], length[order]
    first = np.ones(len(source), dtype=np.bool_)
    first[1:] = (source[1:] != source[:-1]) | (target[1:] != target[:-1])
    return csr_array((length[first], (source[first], target[first])), shape=(count, count))


def _step_back(good: BoolArray, source: np.ndarray, target: np.ndarray) -> BoolArray:
    """Nodes with at least one edge out, all of whose edges lead to good nodes."""
    some = np.zeros(len(good), dtype=bool)
    some[source] = True
    some[source[~good[target]]] = False
    return some
