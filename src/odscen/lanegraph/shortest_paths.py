"""Reachability, goal candidates and shortest paths, on the lane graph and on the pedestrian graph.

All paths are shortest by length. A router is made once for a region and answers many queries.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.lanegraph.path_finder import PathFinder
from odscen.lanegraph.query import node_id, walk_node_id
from odscen.lanegraph.searches.chained_distances import ChainedDistances

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scipy import sparse

    from odscen.base.arrays import BoolArray, FloatArray, Int32Array
    from odscen.lanegraph.graphs import MapGraph


class Router(PathFinder):
    """Paths and goals of vehicles inside a region; ends are nodes that no edge leaves.

    Parameters
    ----------
    graph
        The map.
    mask
        Lane-graph nodes of the region, shape ``(N,)``; ``None`` for the whole map.
    costs
        What is to be least instead of the length, for each edge, shape ``(E,)``; distances are sums
        of it.
    """

    def __init__(
        self,
        graph: MapGraph,
        mask: BoolArray | None = None,
        *,
        costs: FloatArray | None = None,
    ) -> None:
        lanes = graph.lanes
        length = lanes.length if costs is None else costs
        super().__init__(
            len(lanes.x), lanes.source, lanes.target, length, lanes.lane, mask, directed=True
        )
        self._graph = graph
        inside_junction = np.array([name is not None for name in lanes.lanes.junctions], np.bool_)
        self._in_junction = inside_junction[lanes.lane]

    def with_costs(self, costs: FloatArray) -> Router:
        """Router of the same region by another cost of each edge, shape ``(E,)``."""
        return Router(self._graph, self.mask, costs=costs)

    def _farthest_from(self, spawns: Sequence[int]) -> Iterator[tuple[int, Int32Array]]:
        if not spawns:
            return
        chained = ChainedDistances(self._matrix, self._graph.lanes.segment[self.nodes])
        for place, distances in chained.each(self._local[list(spawns)].tolist()):
            spawn = spawns[place]
            rounding = chained.rounding * float(distances[np.isfinite(distances)].max())
            rows = self._farthest(spawn, distances, within=rounding)
            if (np.diff(self._lane[rows]) > 0).all():  # else it is rounding that decides
                yield spawn, self._on_roads(self.nodes[rows].astype(np.int32))

    def _are_farthest(self, pairs: Sequence[tuple[int, int]]) -> dict[tuple[int, int], bool]:
        on_roads = [pair for pair in pairs if not self._in_junction[pair[1]]]
        if not on_roads:
            return {}
        spawns, goals = self._local[np.array(on_roads)].T.tolist()
        lanes = np.searchsorted(self._lane_starts, goals, side="right") - 1
        starts, sizes = self._lane_starts[lanes], self._lane_sizes[lanes]
        spans = list(zip(starts.tolist(), (starts + sizes).tolist(), strict=True))
        chained = ChainedDistances(self._matrix, self._graph.lanes.segment[self.nodes])
        found: dict[tuple[int, int], bool] = {}
        for place, distances in chained.each_at(spawns, spans):
            first, end = spans[place]
            away = np.where(np.isfinite(distances), distances, -1.0)
            if first <= spawns[place] < end:
                away[spawns[place] - first] = -1.0
            most = float(away.max())
            farthest = np.flatnonzero((away >= most - chained.rounding * most) & (away >= 0.0))
            if len(farthest) == 1:  # else it is rounding that decides
                found[on_roads[place]] = first + int(farthest[0]) == goals[place]
        return found

    def _cuts(self, edges: sparse.coo_matrix[np.float64]) -> BoolArray:
        """Blocks end where a junction is left."""
        inside = self._in_junction[self.nodes]
        return np.asarray(inside[edges.row] & ~inside[edges.col], dtype=np.bool_)

    def is_terminal(self, node: int) -> bool:
        """Whether no edge leaves ``node`` inside the region."""
        return bool(self._is_end[self._local[node]])

    def _one_per_lane(self, rows: Int32Array) -> Int32Array:
        """Leave lanes inside junctions out if others remain."""
        return self._on_roads(super()._one_per_lane(rows))

    def _on_roads(self, nodes: Int32Array) -> Int32Array:
        on_roads = nodes[~self._in_junction[nodes]]
        return on_roads if len(on_roads) else nodes

    def _name(self, node: int) -> str:
        inside_map = 0 <= node < len(self.mask)
        return f"node {node_id(self._graph, node) if inside_map else node}"


class WalkRouter(PathFinder):
    """Paths and goals of pedestrians inside a region; ends are dead ends.

    Parameters
    ----------
    graph
        The map.
    mask
        Pedestrian nodes of the region, shape ``(P,)``; ``None`` for the whole map.
    """

    end_degree = 1

    def __init__(self, graph: MapGraph, mask: BoolArray | None = None) -> None:
        walks = graph.walks
        super().__init__(
            len(walks.x), walks.source, walks.target, walks.length, walks.lane, mask, directed=False
        )
        self._graph = graph

    def _cuts(self, edges: sparse.coo_matrix[np.float64]) -> BoolArray:
        """Blocks are segments."""
        segment = self._graph.walks.segment[self.nodes]
        return np.asarray(segment[edges.row] != segment[edges.col], dtype=np.bool_)

    def _name(self, node: int) -> str:
        inside_map = 0 <= node < len(self.mask)
        return f"node {walk_node_id(self._graph, node) if inside_map else node}"
