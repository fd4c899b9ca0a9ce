"""Reachability, goal candidates and shortest paths, on the lane graph and on the pedestrian graph.

All paths are shortest by length. A router is made once for a region and answers many queries; the
functions below make one for a single query.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from odscen.errors import InputError
from odscen.lanegraph.query import node_id, walk_node_id

if TYPE_CHECKING:
    from odscen.lanegraph.model import BoolArray, FloatArray, IntArray, MapGraph

MIN_EDGE_LENGTH = 1e-6
"""Metres; scipy's sparse graphs drop edges of weight zero."""

_NO_PREDECESSOR = -9999


class _PathFinder:
    """Shortest paths inside ``mask``; node numbers outside are the whole map's.

    The last source's tree is kept: a caller asks for goals first and for the path to one of them
    next.
    """

    def __init__(
        self,
        count: int,
        source: IntArray,
        target: IntArray,
        length: FloatArray,
        mask: BoolArray | None,
        *,
        directed: bool,
    ) -> None:
        self.mask = np.ones(count, dtype=np.bool_) if mask is None else mask
        self.nodes = np.flatnonzero(self.mask)
        self._local = np.cumsum(self.mask) - 1
        inside = self.mask[source] & self.mask[target]
        rows, columns = self._local[source[inside]], self._local[target[inside]]
        self._directed = directed
        self._matrix = _shortest_edges(len(self.nodes), rows, columns, length[inside])
        self.out_degree = np.bincount(rows, minlength=len(self.nodes))
        if not directed:
            self.out_degree = self.out_degree + np.bincount(columns, minlength=len(self.nodes))
        self._tree: tuple[int, FloatArray, IntArray] | None = None

    def distances(self, source: int) -> FloatArray:
        """Metres from ``source`` to every node of the map, shape ``(N,)``; inf if unreachable."""
        result = np.full(len(self.mask), np.inf)
        result[self.nodes] = self._from(source)[0]
        return result

    def reachable(self, source: int) -> BoolArray:
        """Nodes that can be reached from ``source`` in the region, itself included; ``(N,)``."""
        return np.isfinite(self.distances(source))

    def path(self, source: int, target: int) -> IntArray:
        """Nodes of the shortest path, both ends included; empty if there is none."""
        distances, predecessors = self._from(source)
        if not self.mask[target] or not np.isfinite(distances[self._local[target]]):
            return np.empty(0, dtype=np.int32)
        steps = [int(self._local[target])]
        while (before := int(predecessors[steps[-1]])) != _NO_PREDECESSOR:
            steps.append(before)
        return self.nodes[steps[::-1]].astype(np.int32)

    def _from(self, source: int) -> tuple[FloatArray, IntArray]:
        if not 0 <= source < len(self.mask) or not self.mask[source]:
            msg = f"{self._name(source)} is outside the region of interest"
            raise InputError(msg)
        if self._tree is None or self._tree[0] != source:
            distances, predecessors = csgraph.dijkstra(
                self._matrix,
                directed=self._directed,
                indices=np.asarray(self._local[source]),
                return_predecessors=True,
            )
            self._tree = source, distances, predecessors
        return self._tree[1], self._tree[2]

    def _name(self, node: int) -> str:
        return f"node {node}"

    def _farthest_per_lane(self, spawn: int, lane: IntArray) -> IntArray:
        """Return the farthest reachable node of each lane; ``lane`` has shape ``(N,)``."""
        distances = self._from(spawn)[0]
        reached = np.flatnonzero(np.isfinite(distances) & (self.nodes != spawn))
        order = np.lexsort((self.nodes[reached], -distances[reached], lane[self.nodes[reached]]))
        ranked = self.nodes[reached][order]
        first = np.ones(len(ranked), dtype=np.bool_)
        first[1:] = lane[ranked][1:] != lane[ranked][:-1]
        return np.sort(ranked[first]).astype(np.int32)

    def _reached_with_degree(self, spawn: int, degree: int) -> IntArray:
        finite = np.isfinite(self._from(spawn)[0])
        found = self.nodes[finite & (self.out_degree <= degree)]
        others: IntArray = found[found != spawn].astype(np.int32)
        return others


class Router(_PathFinder):
    """Paths and goals of vehicles inside a region.

    Parameters
    ----------
    graph
        The map.
    mask
        Lane-graph nodes of the region, shape ``(N,)``; ``None`` for the whole map.
    """

    def __init__(self, graph: MapGraph, mask: BoolArray | None = None) -> None:
        lanes = graph.lanes
        super().__init__(
            len(lanes.x), lanes.source, lanes.target, lanes.length, mask, directed=True
        )
        self._graph = graph
        inside_junction = np.array([name is not None for name in lanes.lanes.junctions], np.bool_)
        self._in_junction = inside_junction[lanes.lane]

    def is_terminal(self, node: int) -> bool:
        """Whether no edge leaves ``node`` inside the region."""
        return bool(self.out_degree[self._local[node]] == 0)

    def goal_candidates(self, spawn: int) -> IntArray:
        """Goal candidates of a vehicle that starts at node ``spawn`` (requirement R38), ascending.

        Reachable terminal nodes. Where none is reachable (a ring, a closed town), the farthest
        reachable node of each lane, lanes inside junctions left out if others remain. Empty if
        ``spawn`` is terminal itself.

        Raises
        ------
        InputError
            If ``spawn`` is outside the region.
        """
        terminal = self._reached_with_degree(spawn, 0)
        if len(terminal) or self.is_terminal(spawn):
            return terminal
        farthest = self._farthest_per_lane(spawn, self._graph.lanes.lane)
        on_roads = farthest[~self._in_junction[farthest]]
        return on_roads if len(on_roads) else farthest

    def _name(self, node: int) -> str:
        inside_map = 0 <= node < len(self.mask)
        return f"node {node_id(self._graph, node) if inside_map else node}"


class WalkRouter(_PathFinder):
    """Paths and goals of pedestrians inside a region.

    Parameters
    ----------
    graph
        The map.
    mask
        Pedestrian nodes of the region, shape ``(P,)``; ``None`` for the whole map.
    """

    def __init__(self, graph: MapGraph, mask: BoolArray | None = None) -> None:
        walks = graph.walks
        super().__init__(
            len(walks.x), walks.source, walks.target, walks.length, mask, directed=False
        )
        self._graph = graph

    def goal_candidates(self, spawn: int) -> IntArray:
        """Goal candidates of a walker that starts at pedestrian node ``spawn``, ascending.

        Reachable dead ends (at most one edge inside the region). Where there is none, the farthest
        reachable node of each walk. Empty if nothing else can be reached.

        Raises
        ------
        InputError
            If ``spawn`` is outside the region.
        """
        dead_ends = self._reached_with_degree(spawn, 1)
        if len(dead_ends):
            return dead_ends
        return self._farthest_per_lane(spawn, self._graph.walks.lane)

    def _name(self, node: int) -> str:
        inside_map = 0 <= node < len(self.mask)
        return f"node {walk_node_id(self._graph, node) if inside_map else node}"


def goal_candidates(graph: MapGraph, roi_mask: BoolArray | None, spawn: int) -> IntArray:
    """Goal candidates of a vehicle; see :meth:`Router.goal_candidates`."""
    return Router(graph, roi_mask).goal_candidates(spawn)


def walk_goal_candidates(graph: MapGraph, roi_mask: BoolArray | None, spawn: int) -> IntArray:
    """Goal candidates of a walker; see :meth:`WalkRouter.goal_candidates`."""
    return WalkRouter(graph, roi_mask).goal_candidates(spawn)


def shortest_path(
    graph: MapGraph, source: int, target: int, mask: BoolArray | None = None
) -> IntArray:
    """Lane-graph nodes of the shortest path, both ends included; empty if there is none."""
    return Router(graph, mask).path(source, target)


def walk_shortest_path(
    graph: MapGraph, source: int, target: int, mask: BoolArray | None = None
) -> IntArray:
    """Pedestrian nodes of the shortest path, both ends included; empty if there is none."""
    return WalkRouter(graph, mask).path(source, target)


def reachable(graph: MapGraph, source: int, mask: BoolArray | None = None) -> BoolArray:
    """Lane-graph nodes that can be reached from ``source``, itself included; shape ``(N,)``."""
    return Router(graph, mask).reachable(source)


def walk_reachable(graph: MapGraph, source: int, mask: BoolArray | None = None) -> BoolArray:
    """Pedestrian nodes that can be reached from ``source``, itself included; shape ``(P,)``."""
    return WalkRouter(graph, mask).reachable(source)


def _shortest_edges(
    count: int, rows: IntArray, columns: IntArray, length: FloatArray
) -> sparse.csr_matrix[np.float64]:
    """CSR matrix with the shortest of parallel edges (scipy would add them up)."""
    weight = np.maximum(length, MIN_EDGE_LENGTH)
    order = np.lexsort((weight, columns, rows))
    rows, columns, weight = rows[order], columns[order], weight[order]
    first = np.ones(len(rows), dtype=np.bool_)
    first[1:] = (rows[1:] != rows[:-1]) | (columns[1:] != columns[:-1])
    shape = (count, count)
    return sparse.csr_matrix((weight[first], (rows[first], columns[first])), shape=shape)
