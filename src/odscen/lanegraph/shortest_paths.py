"""Reachability, goal candidates and shortest paths, on the lane graph and on the pedestrian graph.

All paths are shortest by length. A router is made once for a region and answers many queries.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.lanegraph.path_finder import PathFinder
from odscen.lanegraph.query import node_id, walk_node_id

if TYPE_CHECKING:
    from numpy.typing import NDArray
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

    def _block_cuts(self, edges: sparse.coo_matrix[np.float64]) -> BoolArray:
        """Blocks end where a junction is left."""
        inside = self._in_junction[self.nodes]
        return np.asarray(inside[edges.row] & ~inside[edges.col], dtype=np.bool_)

    def _are_roads(self, nodes: NDArray[np.integer]) -> BoolArray:
        return np.asarray(~self._in_junction[nodes], dtype=np.bool_)

    def is_terminal(self, node: int) -> bool:
        """Whether no edge leaves ``node`` inside the region."""
        return bool(self._is_end[self._local[node]])

    def _one_per_lane(self, rows: Int32Array) -> Int32Array:
        """Leave lanes inside junctions out if others remain."""
        return self._on_roads(super()._one_per_lane(rows))

    def _on_roads(self, nodes: Int32Array) -> Int32Array:
        on_roads = nodes[~self._in_junction[nodes]]
        return on_roads if len(on_roads) else nodes

    def _name_node(self, node: int) -> str:
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

    def _block_cuts(self, edges: sparse.coo_matrix[np.float64]) -> BoolArray:
        """Blocks are segments."""
        segment = self._graph.walks.segment[self.nodes]
        return np.asarray(segment[edges.row] != segment[edges.col], dtype=np.bool_)

    def _name_node(self, node: int) -> str:
        inside_map = 0 <= node < len(self.mask)
        return f"node {walk_node_id(self._graph, node) if inside_map else node}"
