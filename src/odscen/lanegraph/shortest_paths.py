"""Reachability, goal candidates and shortest paths, on the lane graph and on the pedestrian graph.

All paths are shortest by length. A router is made once for a region and answers many queries.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csgraph

from odscen.base.errors import InputError
from odscen.lanegraph.query import node_id, walk_node_id
from odscen.lanegraph.searches.blocks import Blocks
from odscen.lanegraph.searches.connected_parts import ConnectedParts
from odscen.lanegraph.searches.corridor_paths import CorridorPaths
from odscen.lanegraph.searches.edge_matrix import shortest_edges
from odscen.lanegraph.searches.farthest_nodes import FarthestNodes
from odscen.lanegraph.searches.kept_trees import KEPT_TREES, ROUTERS, Tree
from odscen.lanegraph.searches.paths_to_goal import NO_PREDECESSOR, PathsTo
from odscen.lanegraph.searches.ring_goals import RingGoals

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray
    from scipy import sparse

    from odscen.base.arrays import BoolArray, FloatArray, Int32Array
    from odscen.lanegraph.graphs import MapGraph
    from odscen.lanegraph.searches.corridor_paths import Way
    from odscen.lanegraph.searches.ring_goals import GoalsOfStart


# ----------------------- shortest paths and goal candidates inside a region, whatever graph it is a
_FEW = 64
"""Pairs up to which it is quicker to look from each source by itself: those of a short scenario."""
_MANY = 1 << 20
"""Nodes, times sources, from which blocks are worth their making."""
_LARGE = 1 << 15
"""Nodes from which a path is found sooner in its corridor than in the tree of its source."""
_TREES = 8
"""Trees that take as long as to cut a graph into blocks."""
_TO_ONE_BY_ONE = 8
"""Paths from one source that are found one by one; all of more of them are in one tree."""
_SOURCES = 32
"""Sources whose paths are kept."""


class PathFinder:
    """Shortest paths inside ``mask``; node numbers outside are the whole map's.

    An *end* is a node that is left by at most ``end_degree`` edges. Trees of the last sources are
    kept: a caller asks for goals of one or two first, and for the path to one of them next, and the
    scenarios of a batch have their spawns in common.
    """

    end_degree = 0

    def __init__(
        self,
        count: int,
        source: Int32Array,
        target: Int32Array,
        length: FloatArray,
        lane: Int32Array,
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
        self._lane = lane[self.nodes]
        self._matrix = shortest_edges(len(self.nodes), rows, columns, length[inside])
        self.out_degree = np.bincount(rows, minlength=len(self.nodes))
        if not directed:
            self.out_degree = self.out_degree + np.bincount(columns, minlength=len(self.nodes))
        self._number = next(ROUTERS)
        self._searched = 0
        self._ways: dict[int, dict[int, Way | None]] = {}

    def distances(self, source: int) -> FloatArray:
        """Metres from ``source`` to every node of the map, shape ``(N,)``; inf if unreachable."""
        result = np.full(len(self.mask), np.inf)
        result[self.nodes] = self._tree_from(source).distances
        return result

    def distance(self, source: int, target: int) -> float:
        """Metres from one node to another one; inf if it cannot be reached."""
        if (way := self._find_way(source, target)) is not None:
            return way.metres
        distances = self._tree_from(source).distances
        return float(distances[self._local[target]]) if self.mask[target] else math.inf

    def reachable(self, source: int) -> BoolArray:
        """Nodes that can be reached from ``source`` in the region, itself included; ``(N,)``."""
        return np.isfinite(self.distances(source))

    def path(self, source: int, target: int) -> Int32Array:
        """Nodes of the shortest path, both ends included; empty if there is none."""
        if (way := self._find_way(source, target)) is not None:
            return self.nodes[way.nodes].astype(np.int32)
        distances, predecessors = self._tree_from(source)
        if not self.mask[target] or not np.isfinite(distances[self._local[target]]):
            return np.empty(0, dtype=np.int32)
        step, item = int(self._local[target]), predecessors.item
        steps = [step]
        while (step := item(step)) != NO_PREDECESSOR:
            steps.append(step)
        return self.nodes[steps[::-1]].astype(np.int32)

    def _find_way(self, source: int, target: int) -> Way | None:
        """Find the shortest path in its corridor; ``None`` where it is in a tree sooner."""
        if len(self.nodes) < _LARGE or self._searched < _TREES or self._corridor_paths is None:
            return None
        if not (self._holds_node(source) and self._holds_node(target)):
            return None
        if KEPT_TREES.get(self._number, source) is not None:
            return None
        if len(self._ways) >= _SOURCES and source not in self._ways:
            self._ways = {}
        ways = self._ways.setdefault(source, {})
        if target not in ways and len(ways) < _TO_ONE_BY_ONE:
            ends = (int(self._local[node]) for node in (source, target))
            ways[target] = self._corridor_paths.find(*ends)
        return ways.get(target)

    @cached_property
    def _corridor_paths(self) -> CorridorPaths | None:
        return None if self._graph_blocks is None else CorridorPaths(self._graph_blocks)

    @cached_property
    def _graph_blocks(self) -> Blocks | None:
        """The graph in blocks; ``None`` if they are of no use."""
        found = Blocks(self._both_ways, self._block_cuts(self._both_ways.tocoo()))
        return found if found.are_of_use else None

    @cached_property
    def _both_ways(self) -> sparse.csr_matrix[np.float64]:
        """Edges in the directions in which they may be taken."""
        if self._directed:
            return self._matrix
        edges = self._matrix.tocoo()
        rows = np.concatenate([edges.row, edges.col])
        columns = np.concatenate([edges.col, edges.row])
        return shortest_edges(len(self.nodes), rows, columns, np.tile(edges.data, 2))

    def _block_cuts(self, edges: sparse.coo_matrix[np.float64]) -> BoolArray:
        """Whether a block ends at each edge between two nodes of the region; shape ``(E,)``."""
        return np.asarray(self._lane[edges.row] != self._lane[edges.col], dtype=np.bool_)

    def paths_to(self, target: int) -> PathsTo:
        """Shortest paths from everywhere to one node, for many sources with the same target."""
        distances, nexts = csgraph.dijkstra(
            self._reversed_matrix,
            directed=self._directed,
            indices=np.asarray(self._local[target]),
            return_predecessors=True,
        )
        return PathsTo(self.nodes, self._local, distances, nexts)

    @cached_property
    def _reversed_matrix(self) -> sparse.csr_matrix[np.float64]:
        return self._matrix.T.tocsr()

    def leads(self, sources: Int32Array, targets: Int32Array) -> BoolArray:
        """Whether a path leads from each source to the target in the same place; shape ``(K,)``.

        One pass for all, if they are many. Sources and targets lie in the region.
        """
        if self._directed and len(sources) <= _FEW:
            return self._lead_few(sources, targets)
        return self._connected_parts.lead(self._local[sources], self._local[targets])

    def _lead_few(self, sources: Int32Array, targets: Int32Array) -> BoolArray:
        """The same, each source by itself."""
        found = np.zeros(len(sources), dtype=np.bool_)
        for source in np.unique(sources).tolist():
            seen = np.zeros(len(self.nodes), dtype=np.bool_)
            seen[
                csgraph.breadth_first_order(
                    self._matrix, int(self._local[source]), return_predecessors=False
                )
            ] = True
            asked = sources == source
            found[asked] = seen[self._local[targets[asked]]]
        return found

    def reach(self, sources: Int32Array, targets: Int32Array) -> tuple[Int32Array, BoolArray]:
        """Which of the targets each source can get to.

        Returns
        -------
        For each source, shape ``(S,)``, a row of the table, shape ``(R, T)``: sources from which
        the same can be reached share one. A node counts as reached from itself.
        """
        return self._connected_parts.reach(self._local[sources], self._local[targets])

    def has_goals(self, spawn: int) -> bool:
        """Whether there is any goal candidate: whether anything can be reached."""
        return bool(self.out_degree[self._local[spawn]] > 0)

    def goal_candidates(self, spawn: int) -> Int32Array:
        """Nodes that may be the goal of an actor that starts at ``spawn``, ascending (R38).

        Ends that can be reached. Where there is none (a ring, a closed town), the farthest
        reachable node of each lane. Empty if nothing can be reached.

        Raises
        ------
        InputError
            If ``spawn`` is outside the region.
        """
        distances = self._tree_from(spawn).distances  # refuses a spawn outside
        if not self.has_goals(spawn):
            return np.empty(0, dtype=np.int32)
        if not self._reaches_end(spawn):
            return self._one_per_lane(self._farthest_rows(spawn, distances))
        ends = np.isfinite(distances) & self._is_end
        ends[self._local[spawn]] = False
        return self.nodes[ends].astype(np.int32)

    def each_candidates(
        self, spawns: Sequence[int], among: Callable[[int], BoolArray] | None = None
    ) -> Iterator[GoalsOfStart]:
        """Yield the goal candidates of many spawns; the same, sooner on a large map.

        Parameters
        ----------
        among
            Nodes of the map, shape ``(N,)``, that goals of a spawn may be on; all if not given.
        """
        is_much = len(spawns) * len(self.nodes) >= _MANY
        ends = self._ends_from(spawns) if is_much else {}
        for spawn in spawns:
            goals = ends.get(spawn)
            allowed = among(spawn) if among is not None and self._holds_node(spawn) else None
            if (
                goals is None
                and is_much
                and self._ring_goals is not None
                and self._is_closed(spawn)
            ):
                yield self._ring_goals.of(int(self._local[spawn]), allowed)
                continue
            goals = self.goal_candidates(spawn) if goals is None else goals[goals != spawn]
            yield goals if allowed is None else goals[allowed[goals]]

    def are_candidates(self, spawns: Sequence[int], goals: Sequence[int]) -> list[bool]:
        """Say of many spawns at once whether the goal in its place :meth:`is_candidate`."""
        is_much = len(spawns) * len(self.nodes) >= _MANY
        found = [False] * len(spawns)
        # In the order of the map, as starts of one block are searched from together.
        for place in sorted(range(len(spawns)), key=spawns.__getitem__):
            spawn, goal = spawns[place], goals[place]
            known: bool | None = None
            if (
                is_much
                and self._ring_goals is not None
                and self._is_closed(spawn)
                and self._holds_node(goal)
            ):
                known = self._ring_goals.is_goal(*self._local[[spawn, goal]].tolist())
            found[place] = self.is_candidate(spawn, goal) if known is None else known
        return found

    def _ends_from(self, spawns: Sequence[int]) -> dict[int, Int32Array]:
        """Ends that each spawn reaches, itself among them if it is one; if it reaches others."""
        starts = [fromkey for fromkey in dict.fromkeys(spawns) if self._holds_node(fromkey)]
        starts = [start for start in starts if self._reaches_end(start)]
        ends = self.nodes[self._is_end].astype(np.int32)
        row, table = self.reach(np.array(starts, dtype=np.int32), ends)
        reached = [ends[ahead] for ahead in table]
        return {spawn: reached[number] for spawn, number in zip(starts, row.tolist(), strict=True)}

    @cached_property
    def _ring_goals(self) -> RingGoals | None:
        """Goals of spawns that reach no end; ``None`` where they are found by a search of all."""
        if self._graph_blocks is None:
            return None
        return RingGoals(
            self._both_ways,
            self._connected_parts.of,
            FarthestNodes(self._graph_blocks, self._lane_starts),
            nodes=self.nodes,
            is_road=self._are_roads(self.nodes[self._lane_starts]),
            searched=self.goal_candidates,
        )

    def _are_roads(self, nodes: NDArray[np.integer]) -> BoolArray:
        """Whether goals in a ring may be on the lanes of some nodes while others are left."""
        return np.ones(len(nodes), dtype=np.bool_)

    def _is_closed(self, spawn: int) -> bool:
        """Whether a node lies in the region, and no end can be reached from it, but other nodes."""
        return self._holds_node(spawn) and self.has_goals(spawn) and not self._reaches_end(spawn)

    def is_candidate(self, spawn: int, goal: int) -> bool:
        """Whether ``goal``, which can be reached, is among the candidates of ``spawn``."""
        if self._reaches_end(spawn):
            return bool(self._is_end[self._local[goal]])
        return goal in self.goal_candidates(spawn)

    @cached_property
    def _is_end(self) -> BoolArray:
        return np.asarray(self.out_degree <= self.end_degree, dtype=np.bool_)

    @cached_property
    def _connected_parts(self) -> ConnectedParts:
        return ConnectedParts(self._matrix, directed=self._directed)

    @cached_property
    def _ends_ahead(self) -> Int32Array:
        """At least how many ends, itself included, can be reached from each node of the region."""
        ends = np.flatnonzero(self._is_end)
        if not self._directed:
            part = self._connected_parts.of
            per_part = np.bincount(part[ends], minlength=len(self.nodes))
            return per_part[part].astype(np.int32)
        if not len(ends):
            return np.zeros(len(self.nodes), dtype=np.int32)
        back = csgraph.dijkstra(self._matrix.T.tocsr(), indices=ends, min_only=True)
        return np.isfinite(back).astype(np.int32)

    def _reaches_end(self, spawn: int) -> bool:
        row = self._local[spawn]
        return bool(self._ends_ahead[row] > int(self._is_end[row]))

    def _tree_from(self, source: int) -> Tree:
        if not self._holds_node(source):
            raise InputError(f"{self._name_node(source)} is outside the region of interest")
        tree = KEPT_TREES.get(self._number, source)
        if tree is None:
            self._searched += 1
            distances, predecessors = csgraph.dijkstra(
                self._matrix,
                directed=self._directed,
                indices=np.asarray(self._local[source]),
                return_predecessors=True,
            )
            tree = Tree(distances, predecessors)
            KEPT_TREES.add(self._number, source, tree)
        return tree

    def _holds_node(self, node: int) -> bool:
        return 0 <= node < len(self.mask) and bool(self.mask[node])

    def _name_node(self, node: int) -> str:
        return f"node {node}"

    def _farthest_rows(self, spawn: int, distances: FloatArray) -> Int32Array:
        """Rows of the farthest reachable nodes of each lane, where several are equally far all."""
        away = np.where(np.isfinite(distances), distances, -1.0)
        away[self._local[spawn]] = -1.0
        farthest = np.maximum.reduceat(away, self._lane_starts)
        sizes = np.diff(self._lane_starts, append=len(self._lane))
        return np.flatnonzero((away >= np.repeat(farthest, sizes)) & (away >= 0)).astype(np.int32)

    def _one_per_lane(self, rows: Int32Array) -> Int32Array:
        """Return the first node of each lane among these, ascending."""
        _, first = np.unique(self._lane[rows], return_index=True)
        nodes: Int32Array = np.sort(self.nodes[rows[first]]).astype(np.int32)
        return nodes

    @cached_property
    def _lane_starts(self) -> Int32Array:
        """Where the nodes of each lane begin."""
        starts: Int32Array = np.flatnonzero(np.diff(self._lane, prepend=-1)).astype(np.int32)
        return starts


# ----------------------- reachability, goal candidates and shortest paths, on the lane graph and on
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
