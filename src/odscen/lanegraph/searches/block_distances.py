"""Distances from many nodes of a graph that falls into blocks with few ways out.

A path from a node either stays in the node's block or leaves it by an edge to a node of another
block, an *exit*. So the distances from all nodes of a block follow from those from its exits, which
are few (a road has one for each lane, where it ends), and from those inside the block, which is
small. That holds whatever the blocks are; they decide how quick it is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.lanegraph.searches.graph_searches import csgraph

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scipy import sparse

    from odscen.base.arrays import FloatArray, Int32Array

_MOST = 1 << 22
"""Distances from exits that are held at once, 8 bytes each."""


class BlockDistances:
    """Distances over a directed graph; made once for many sources.

    Parameters
    ----------
    matrix
        Length of the edge from row to column, above 0; shape ``(N, N)``.
    block
        Number of the block that each node is in, shape ``(N,)``.
    """

    def __init__(self, matrix: sparse.csr_matrix[np.float64], block: Int32Array) -> None:
        self._matrix = matrix
        self._block = block
        edges = matrix.tocoo()
        leaves = np.flatnonzero(block[edges.row] != block[edges.col])
        leaves = leaves[np.argsort(block[edges.row[leaves]], kind="stable")]
        self._tail, self._head = edges.row[leaves], edges.col[leaves]
        self._metres = edges.data[leaves]
        self._members = np.argsort(block, kind="stable")

    def each(self, sources: Sequence[int]) -> Iterator[tuple[int, FloatArray]]:
        """Yield place in ``sources`` and metres from there to every node, shape ``(N,)``.

        Block by block, not in the order of ``sources``; inf where no path leads.
        """
        nodes = np.asarray(sources, dtype=np.int64)
        order = np.argsort(self._block[nodes], kind="stable")
        changes = np.flatnonzero(np.diff(self._block[nodes[order]])) + 1
        for places in np.split(order, changes) if len(order) else ():
            distinct, row = np.unique(nodes[places], return_inverse=True)
            rows = self._from_block(distinct.tolist())
            for number, distances in enumerate(rows):
                for place in places[row == number].tolist():
                    yield place, distances

    def _from_block(self, sources: list[int]) -> Iterator[FloatArray]:
        """Yield the distances from each of some nodes of one block."""
        block = int(self._block[sources[0]])
        edges = self._span(self._block[self._tail], block)
        exits, number = np.unique(self._head[edges], return_inverse=True)
        if len(exits) >= len(sources) or len(exits) * len(self._block) > _MOST:
            for source in sources:
                yield csgraph.dijkstra(self._matrix, indices=np.asarray(source))
            return
        members = self._members[self._span(self._block[self._members], block)]
        tails = np.searchsorted(members, self._tail[edges])
        inside = csgraph.dijkstra(
            self._matrix[members][:, members], indices=np.searchsorted(members, sources)
        )
        beyond = csgraph.dijkstra(self._matrix, indices=exits)
        for within in inside:
            to_exit = np.full(len(exits), np.inf)
            np.minimum.at(to_exit, number, within[tails] + self._metres[edges])
            distances = np.full(len(self._block), np.inf)
            for k in np.flatnonzero(np.isfinite(to_exit)).tolist():
                np.minimum(distances, beyond[k] + to_exit[k], out=distances)
            distances[members] = np.minimum(distances[members], within)
            yield distances

    @staticmethod
    def _span(blocks: Int32Array, block: int) -> slice:
        """Where one block lies among sorted ones."""
        return slice(*np.searchsorted(blocks, [block, block + 1]).tolist())
