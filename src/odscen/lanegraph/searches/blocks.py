"""A large graph cut into blocks, and how far their gates are from a node.

Of the lane graph a *block* is a road in one direction with what leads on from it through the
junction ahead, as it is cut where a junction is left. A block is entered at a few nodes, its
*gates*, one for each lane. So the distance to a node of another block is that to one of its gates
and from there on inside the block, and a search over gates alone, of which a town has one in
seventy nodes, gives the distances to all of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.sparse import csgraph

from odscen.lanegraph.searches.edge_matrix import shortest_edges

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy import sparse

    from odscen.base.arrays import BoolArray, FloatArray

    Rows = NDArray[np.integer]

_MOST_GATES = 12
"""Of one block: blocks are made by a search of the whole graph for each."""
_SHARE = 8
"""Of a graph may be in its largest block one node in so many; else it is searched as a whole."""

_ALONE = 2
"""Starts in a block that are searched from by themselves."""
_BLOCKS_KEPT = 8
"""Blocks that starts came from last."""


class OutwardDistances(NamedTuple):
    """How far it is from a node.

    Attributes
    ----------
    home, first
        Its block, and the first row of that.
    nearby
        Metres to each node of the block, inside the block; inf where no path leads.
    gates
        Metres to each gate of the graph.
    """

    home: int
    first: int
    nearby: FloatArray
    gates: FloatArray


class Blocks:
    """Blocks of a directed graph; made once for many searches.

    Parameters
    ----------
    matrix
        Length of the edge from row to column, above 0; shape ``(N, N)``.
    cut
        Whether blocks end at an edge, in the order of ``matrix.data``; shape ``(E,)``. Cuts decide
        how quick it is, and nothing else.

    Attributes
    ----------
    are_of_use
        Whether blocks are many, and have few gates; else nothing can be found.
    node, row
        From here on nodes are rows in the order of their blocks: the node of each row, and back.
    block, first
        Block of each row; first row of each block, and the end of the last one.
    every
        All edges between rows.
    gates, gates_of
        Rows that are gates, block by block, and where those of each block begin.
    within
        Metres to each row from the first, second and further gates of its block; inf where there
        is no such gate, or no path inside the block; shape ``(G, N)``.
    between
        Metres from each gate to those of the blocks that follow.
    rounding
        Bound of the relative error: lengths are not added up in the order of the path.
    """

    def __init__(self, matrix: sparse.csr_matrix[np.float64], cut: BoolArray) -> None:
        count = matrix.shape[0]
        edges = matrix.tocoo()
        source, target = edges.row.astype(np.int32), edges.col.astype(np.int32)
        uncut = shortest_edges(count, source[~cut], target[~cut], edges.data[~cut])
        blocks, block = csgraph.connected_components(uncut, directed=True, connection="weak")
        self.node = np.argsort(block, kind="stable")
        self.row = np.argsort(self.node).astype(np.int32)
        self.block = block[self.node]
        self.first = np.searchsorted(self.block, np.arange(blocks + 1))
        tail, head = self.row[source], self.row[target]
        leaves = self.block[tail] != self.block[head]
        self.every = shortest_edges(count, tail, head, edges.data)
        self._uncut = shortest_edges(count, tail[~leaves], head[~leaves], edges.data[~leaves])
        order = np.flatnonzero(leaves)[np.argsort(tail[leaves], kind="stable")]
        self._tail, self._metres = tail[order], edges.data[order]
        self._leaving = np.searchsorted(self._tail, self.first)
        self.gates, self._entered = np.unique(head[order], return_inverse=True)
        self.gates_of = np.searchsorted(self.gates, self.first)
        self.rounding = 8.0 * count * float(np.finfo(np.float64).eps)
        most, largest = (int(np.diff(a).max(initial=0)) for a in (self.gates_of, self.first))
        self.are_of_use = 0 < most <= _MOST_GATES and largest * _SHARE <= count
        if self.are_of_use:
            self.within = np.stack([self._from_gate(turn) for turn in range(most)])
            self.between = self._between_gates()
            self._beyond: dict[int, tuple[int, FloatArray | None]] = {}

    def outset(self, row: int) -> OutwardDistances:
        """Search from one row on."""
        home = int(self.block[row])
        first, end = self.first[home : home + 2].tolist()
        nearby = csgraph.dijkstra(
            block_rows(self._uncut, first, end), indices=np.asarray(row - first)
        )
        ahead = slice(*self._leaving[home : home + 2].tolist())
        to_gates = nearby[self._tail[ahead] - first] + self._metres[ahead]
        return OutwardDistances(
            home, first, nearby, self._to_gates(home, self._entered[ahead], to_gates)
        )

    def _from_gate(self, turn: int) -> FloatArray:
        """Metres to each row from one of the gates of its block, shape ``(N,)``; one search."""
        first, end = self.gates_of[:-1], self.gates_of[1:]
        gates = first[first + turn < end] + turn
        found: FloatArray = csgraph.dijkstra(self._uncut, indices=self.gates[gates], min_only=True)
        return found

    def _between_gates(self) -> sparse.csr_matrix[np.float64]:
        home = self.block[self._tail]
        turn, edge = np.nonzero(np.isfinite(self.within[:, self._tail]))
        gate = self.gates_of[home[edge]] + turn
        metres = self.within[turn, self._tail[edge]] + self._metres[edge]
        entered = self._entered[edge].astype(np.int32)
        return shortest_edges(len(self.gates), gate.astype(np.int32), entered, metres)

    def _to_gates(self, home: int, entered: Rows, lengths: FloatArray) -> FloatArray:
        """Metres to every gate from a row of a block, from which it is so far to the next blocks.

        Starts mostly come block by block. Once some have come from one, what lies beyond is
        searched from each gate that follows it, and holds for all that are to come.
        """
        gates, number = np.unique(entered, return_inverse=True)
        shortest = np.full(len(gates), np.inf)
        np.minimum.at(shortest, number, lengths)
        trees = self._trees_beyond(home, gates)
        if trees is not None:
            return np.asarray((trees + shortest[:, np.newaxis]).min(axis=0))
        leads = np.isfinite(shortest)
        return self._from_several(gates[leads], shortest[leads])

    def _trees_beyond(self, home: int, gates: Rows) -> FloatArray | None:
        """Metres from each of the gates that follow a block to all; ``None`` for its first starts.

        Other threads may ask for theirs.
        """
        beyond = self._beyond
        asked, trees = beyond.pop(home, (0, None))
        if asked >= _ALONE and trees is None and len(gates):
            trees = csgraph.dijkstra(self.between, indices=gates)
        for gone in [*beyond][: max(len(beyond) - _BLOCKS_KEPT + 1, 0)]:
            beyond.pop(gone, None)
        beyond[home] = (asked + 1, trees)
        return trees

    def _from_several(self, gates: Rows, lengths: FloatArray) -> FloatArray:
        """Metres to every gate from a place from which it is so far to some of them."""
        count, between = len(self.gates), self.between
        matrix = square(
            np.concatenate([between.data, lengths]),
            np.concatenate([between.indices, gates.astype(np.int32)]),
            np.append(between.indptr, np.int32(len(between.data) + len(gates))),
        )
        found: FloatArray = csgraph.dijkstra(matrix, indices=np.asarray(count))[:count]
        return found


def block_rows(
    matrix: sparse.csr_matrix[np.float64], first: int, end: int
) -> sparse.csr_matrix[np.float64]:
    """Rows of a block, which no edge leaves, as a matrix of its own."""
    starts = matrix.indptr[first : end + 1]
    part = slice(*starts[[0, -1]].tolist())
    return square(matrix.data[part], matrix.indices[part] - first, starts - starts[0])


def square(data: FloatArray, indices: Rows, starts: Rows) -> sparse.csr_matrix[np.float64]:
    """CSR matrix of as many columns as rows."""
    from scipy import sparse

    count = len(starts) - 1
    return sparse.csr_matrix((data, indices, starts), shape=(count, count))


def spans(begins: Rows, ends: Rows) -> Rows:
    """Numbers of some spans, one after another: from each begin on, its end excluded."""
    sizes = ends - begins
    shift = np.repeat(begins - (np.cumsum(sizes) - sizes), sizes)
    return np.asarray(np.arange(len(shift)) + shift)
