"""Shortest paths between two nodes of a large graph, without a search of all its nodes.

The graph is cut into *blocks*: of the lane graph a road in one direction with what leads on from it
through the junction ahead, as it is cut where a junction is left. A block is entered at a few
nodes, its *gates*, one for each lane. A search over gates alone finds which blocks a shortest path
can lead through, its *corridor*; a search of these finds the path. In a town one node in seventy is
a gate.

Lengths that were added up in another order differ in their last digits, and many paths are equally
long but for these: one may change lanes at any place of a road. So the corridor has all blocks that
hold a path as short as the shortest one within rounding, and the search in it adds up as one of the
whole graph does. Where even that does not decide, as two paths are equally long to the last digit,
the order inside the heap of such a search does: then there is no answer from here.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.lanegraph.searches.edge_matrix import shortest_edges
from odscen.lanegraph.searches.graph_searches import csgraph

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy import sparse

    from odscen.base.arrays import BoolArray, FloatArray

    Rows = NDArray[np.integer]

_MOST_GATES = 12
"""Of one block: blocks are made by a search of the whole graph for each."""
_SHARE = 8
"""Of a graph may be in its largest block one node in so many; else it is searched as a whole."""


class Way(NamedTuple):
    """A shortest path: its length, inf if there is none, and its nodes, both ends included."""

    metres: float
    nodes: Rows


class CorridorPaths:
    """Shortest paths over a directed graph; made once for many pairs of nodes.

    Parameters
    ----------
    matrix
        Length of the edge from row to column, above 0; shape ``(N, N)``.
    cut
        Whether blocks end at an edge, in the order of ``matrix.data``; shape ``(E,)``. Cuts decide
        how quick it is, and nothing else.

    Attributes
    ----------
    is_of_use
        Whether blocks are many, and have few gates; else nothing can be found.
    """

    def __init__(self, matrix: sparse.csr_matrix[np.float64], cut: BoolArray) -> None:
        count = matrix.shape[0]
        edges = matrix.tocoo()
        source, target = edges.row.astype(np.int32), edges.col.astype(np.int32)
        uncut = shortest_edges(count, source[~cut], target[~cut], edges.data[~cut])
        blocks, block = csgraph.connected_components(uncut, directed=True, connection="weak")
        # From here on nodes are rows in the order of their blocks.
        self._node = np.argsort(block, kind="stable")
        self._row = np.argsort(self._node).astype(np.int32)
        self._block = block[self._node]
        self._first = np.searchsorted(self._block, np.arange(blocks + 1))
        tail, head = self._row[source], self._row[target]
        leaves = self._block[tail] != self._block[head]
        self._all = shortest_edges(count, tail, head, edges.data)
        self._uncut = shortest_edges(count, tail[~leaves], head[~leaves], edges.data[~leaves])
        order = np.flatnonzero(leaves)[np.argsort(tail[leaves], kind="stable")]
        self._tail, self._metres = tail[order], edges.data[order]
        self._leaving = np.searchsorted(self._tail, self._first)
        self._gates, self._entered = np.unique(head[order], return_inverse=True)
        self._gates_of = np.searchsorted(self._gates, self._first)
        self._rounding = 8.0 * count * float(np.finfo(np.float64).eps)
        most, largest = (int(np.diff(a).max(initial=0)) for a in (self._gates_of, self._first))
        self.is_of_use = 0 < most <= _MOST_GATES and largest * _SHARE <= count
        if self.is_of_use:
            self._within = np.stack([self._from_gate(turn) for turn in range(most)])
            self._between = self._between_gates()
            back = self._between.T.tocsr()
            self._back = tuple(a.tolist() for a in (back.indptr, back.indices, back.data))

    def find(self, source: int, target: int) -> Way | None:
        """Shortest path from node to node; ``None`` if a search of all nodes has to say.

        It is the path that Dijkstra's algorithm finds from ``source`` on in the whole graph.
        """
        start, goal = int(self._row[source]), int(self._row[target])
        blocks = self._corridor(start, goal)
        return self._search(start, goal, blocks) if blocks else Way(math.inf, self._node[:0])

    def _from_gate(self, turn: int) -> FloatArray:
        """Metres to each node from one of the gates of its block, shape ``(N,)``; one search."""
        first, end = self._gates_of[:-1], self._gates_of[1:]
        gates = first[first + turn < end] + turn
        found: FloatArray = csgraph.dijkstra(self._uncut, indices=self._gates[gates], min_only=True)
        return found

    def _between_gates(self) -> sparse.csr_matrix[np.float64]:
        """Metres from each gate to those of the blocks that follow."""
        home = self._block[self._tail]
        turn, edge = np.nonzero(np.isfinite(self._within[:, self._tail]))
        gate = self._gates_of[home[edge]] + turn
        metres = self._within[turn, self._tail[edge]] + self._metres[edge]
        entered = self._entered[edge].astype(np.int32)
        return shortest_edges(len(self._gates), gate.astype(np.int32), entered, metres)

    def _corridor(self, start: int, goal: int) -> set[int]:
        """Blocks that a shortest path can lead through; none if there is no path."""
        home, last = int(self._block[start]), int(self._block[goal])
        first, end = self._first[home : home + 2].tolist()
        nearby = csgraph.dijkstra(_rows(self._uncut, first, end), indices=np.asarray(start - first))
        ahead = slice(*self._leaving[home : home + 2].tolist())
        to_gates = nearby[self._tail[ahead] - first] + self._metres[ahead]
        metres = self._to_gates(self._entered[ahead], to_gates)
        begin, stop = self._gates_of[last : last + 2].tolist()
        ends = [metres[k] + float(self._within[k - begin, goal]) for k in range(begin, stop)]
        best = min(ends, default=math.inf)
        if home == last:
            best = min(best, float(nearby[goal - first]))
        if not math.isfinite(best):
            return set()
        slack = best * self._rounding
        near = [begin + k for k, length in enumerate(ends) if length <= best + slack]
        return {home, last, *self._blocks_before(near, metres, slack)}

    def _to_gates(self, entered: Rows, lengths: FloatArray) -> list[float]:
        """Metres from a start to every gate, when it is so far to those of the next blocks."""
        count, between = len(self._gates), self._between
        leads = np.isfinite(lengths)
        gates, number = np.unique(entered[leads], return_inverse=True)
        shortest = np.full(len(gates), np.inf)
        np.minimum.at(shortest, number, lengths[leads])
        matrix = _matrix(
            np.concatenate([between.data, shortest]),
            np.concatenate([between.indices, gates.astype(np.int32)]),
            np.append(between.indptr, np.int32(len(between.data) + len(gates))),
        )
        found: list[float] = csgraph.dijkstra(matrix, indices=np.asarray(count))[:count].tolist()
        return found

    def _blocks_before(self, near: list[int], metres: list[float], slack: float) -> list[int]:
        """Blocks of some gates, and of those on the shortest paths to there."""
        first, before, lengths = self._back
        seen, open_ = set(near), near
        while open_:
            gate = open_.pop()
            most = metres[gate] + slack
            for k in range(first[gate], first[gate + 1]):
                if (other := before[k]) not in seen and metres[other] + lengths[k] <= most:
                    seen.add(other)
                    open_.append(other)
        blocks: list[int] = self._block[self._gates[list(seen)]].tolist()
        return blocks

    def _search(self, start: int, goal: int, blocks: set[int]) -> Way | None:
        """Search some blocks as Dijkstra does; ``None`` where the heap decides."""
        wanted = np.array(sorted(blocks))
        begins, ends = self._first[wanted], self._first[wanted + 1]
        places = np.cumsum(ends - begins) - (ends - begins)
        spans = list(zip(begins.tolist(), ends.tolist(), strict=True))
        parts = [slice(*self._all.indptr[list(span)].tolist()) for span in spans]
        columns = np.concatenate([self._all.indices[part] for part in parts])
        metres = np.concatenate([self._all.data[part] for part in parts])
        degree = np.concatenate([np.diff(self._all.indptr[a : b + 1]) for a, b in spans])
        shift = np.full(len(self._first), -2 * len(self._node))
        shift[wanted] = places - begins
        heads = columns + shift[self._block[columns]]
        tails = np.repeat(np.arange(len(degree)), degree)
        inside = heads >= 0
        heads, tails, metres = heads[inside], tails[inside], metres[inside]
        counts = np.bincount(tails, minlength=len(degree))
        matrix = _matrix(metres, heads, np.append(0, np.cumsum(counts)))
        start, goal = (row + int(shift[self._block[row]]) for row in (start, goal))
        distances, predecessors = csgraph.dijkstra(
            matrix, indices=np.asarray(start), return_predecessors=True
        )
        path = _path(predecessors, goal)
        if _is_tied(path, distances, tails, heads, metres):
            return None
        rows = np.repeat(begins - places, ends - begins)[path] + path
        return Way(float(distances[goal]), self._node[rows])


def _path(predecessors: Rows, goal: int) -> Rows:
    before: list[int] = predecessors.tolist()
    steps = [goal]
    while (step := before[steps[-1]]) >= 0:
        steps.append(step)
    return np.array(steps[::-1])


def _is_tied(
    path: Rows, distances: FloatArray, tails: Rows, heads: Rows, metres: FloatArray
) -> bool:
    """Whether a node of the path could as well be reached from another one equally far away.

    Of several before it that make it equally far, a search takes the one that it comes to first,
    which is the nearest.
    """
    on_path = np.zeros(len(distances), dtype=np.bool_)
    on_path[path] = True
    edge = np.flatnonzero(on_path[heads])
    edge = edge[distances[tails[edge]] + metres[edge] == distances[heads[edge]]]
    if len(edge) < len(path):  # one to each node but the first
        return False
    nodes, away = heads[edge], distances[tails[edge]]
    order = np.lexsort((away, nodes))
    nodes, away = nodes[order], away[order]
    is_nearest = np.diff(nodes, prepend=-1) != 0
    return bool((is_nearest[:-1] & ~is_nearest[1:] & (away[:-1] == away[1:])).any())


def _rows(
    matrix: sparse.csr_matrix[np.float64], first: int, end: int
) -> sparse.csr_matrix[np.float64]:
    """Rows of a block, which no edge leaves, as a matrix of its own."""
    starts = matrix.indptr[first : end + 1]
    part = slice(*starts[[0, -1]].tolist())
    return _matrix(matrix.data[part], matrix.indices[part] - first, starts - starts[0])


def _matrix(data: FloatArray, indices: Rows, starts: Rows) -> sparse.csr_matrix[np.float64]:
    from scipy import sparse

    count = len(starts) - 1
    return sparse.csr_matrix((data, indices, starts), shape=(count, count))
