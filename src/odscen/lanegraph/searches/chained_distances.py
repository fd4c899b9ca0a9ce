"""Distances from many nodes of a large graph, most of whose nodes lie between two others.

A lane is a chain of nodes two metres apart, each with one edge in and one out. Only where lanes
begin, end or have another one beside them has a search a choice: it goes from one such node, a
*fork*, to the next, and what lies between follows from the fork before it. In a town one node in
eight is a fork.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.lanegraph.searches.block_distances import BlockDistances
from odscen.lanegraph.searches.edge_matrix import shortest_edges

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scipy import sparse

    from odscen.base.arrays import FloatArray, Int32Array


class _Chain(NamedTuple):
    """From fork to fork, ``metres`` long; ``stop`` is behind its last node in the order of all."""

    head: int
    end: int
    stop: int
    metres: float


class ChainedDistances:
    """Distances over a directed graph; made once for many sources.

    Parameters
    ----------
    matrix
        Length of the edge from row to column, above 0; shape ``(N, N)``.
    block
        Number of a part of the graph with few ways out, such as a road, that each node is in;
        shape ``(N,)``.

    Attributes
    ----------
    rounding
        Bound of the relative error: lengths are not added up in the order of the path.
    """

    def __init__(self, matrix: sparse.csr_matrix[np.float64], block: Int32Array) -> None:
        self._count = matrix.shape[0]
        self.rounding = 2.0 * self._count * float(np.finfo(np.float64).eps)
        forks, nodes, metres, chains = _chains(matrix)
        self._forks = np.array(forks, dtype=np.int32)
        self._nodes = np.array(nodes, dtype=np.int32)
        self._metres = np.array(metres, dtype=np.float64)
        self._chains = chains
        self._number = np.full(self._count, -1, dtype=np.int32)
        self._number[self._forks] = np.arange(len(forks))
        self._place = np.full(self._count, -1, dtype=np.int32)
        self._place[self._nodes] = np.arange(len(nodes))
        stops = np.array([chain.stop for chain in chains], dtype=np.int64)
        sizes = np.diff(stops, prepend=0)
        self._chain = np.repeat(np.arange(len(chains)), sizes)
        heads = self._number[[chain.head for chain in chains]]
        self._head = np.repeat(heads, sizes)
        ends = self._number[[chain.end for chain in chains]]
        lengths = np.array([chain.metres for chain in chains], dtype=np.float64)
        between_forks = shortest_edges(len(forks), heads, ends, lengths)
        self._from_forks = BlockDistances(between_forks, block[self._forks])

    def each(self, sources: Sequence[int]) -> Iterator[tuple[int, FloatArray]]:
        """Yield place in ``sources`` and metres from there to every node, shape ``(N,)``.

        Not in the order of ``sources``; inf where no path leads.
        """
        places = self._place[list(sources)].tolist()
        for number, found in self._from_forks_of(sources, places):
            distances = self._unfolded(found)
            if (place := places[number]) >= 0:
                self._begin(distances, place)
            yield number, distances

    def each_at(
        self, sources: Sequence[int], spans: Sequence[tuple[int, int]]
    ) -> Iterator[tuple[int, FloatArray]]:
        """Yield place in ``sources`` and metres to the nodes of its span, its end excluded.

        As :meth:`each` has them.
        """
        places = self._place[list(sources)].tolist()
        for number, found in self._from_forks_of(sources, places):
            nodes = slice(*spans[number])
            on_chain, at_fork = self._place[nodes], self._number[nodes]
            distances = np.where(
                at_fork >= 0,
                found[at_fork],
                found[self._head_of[nodes]] + self._metres_of[nodes],
            )
            if (place := places[number]) >= 0:
                chain = self._chains[self._chain[place]]
                distances += chain.metres - self._metres[place]
                ahead = (on_chain >= place) & (on_chain < chain.stop)
                distances[ahead] = self._metres_of[nodes][ahead] - self._metres[place]
            yield number, distances

    def _from_forks_of(
        self, sources: Sequence[int], places: Sequence[int]
    ) -> Iterator[tuple[int, FloatArray]]:
        """Yield place in ``sources`` and metres of all forks from the fork at or after it."""
        forks = [
            source if place < 0 else self._chains[self._chain[place]].end
            for source, place in zip(sources, places, strict=True)
        ]
        yield from self._from_forks.each(self._number[forks].tolist())

    @cached_property
    def _head_of(self) -> Int32Array:
        """Number of the fork before each node, 0 for forks."""
        heads = np.zeros(self._count, dtype=np.int32)
        heads[self._nodes] = self._head
        return heads

    @cached_property
    def _metres_of(self) -> FloatArray:
        """Metres of each node from the fork before it, 0 for forks."""
        metres = np.zeros(self._count)
        metres[self._nodes] = self._metres
        return metres

    def _unfolded(self, of_forks: FloatArray) -> FloatArray:
        """Distances of all nodes from those of the forks."""
        result: FloatArray = np.empty(self._count, dtype=np.float64)
        result[self._forks] = of_forks
        result[self._nodes] = of_forks[self._head] + self._metres
        return result

    def _begin(self, distances: FloatArray, place: int) -> None:
        """Make distances from the end of a chain those from a node on it."""
        chain = self._chains[self._chain[place]]
        distances += chain.metres - self._metres[place]
        ahead = slice(place, chain.stop)
        distances[self._nodes[ahead]] = self._metres[ahead] - self._metres[place]


def _chains(
    matrix: sparse.csr_matrix[np.float64],
) -> tuple[list[int], list[int], list[float], list[_Chain]]:
    """Forks; nodes between them in the order of their chains, with metres from the fork; chains."""
    out = np.diff(matrix.indptr)
    between = (out == 1) & (np.bincount(matrix.indices, minlength=len(out)) == 1)
    is_fork = (~between).tolist()
    first, targets, lengths = (a.tolist() for a in (matrix.indptr, matrix.indices, matrix.data))
    forks: list[int] = []
    nodes: list[int] = []
    metres: list[float] = []
    chains: list[_Chain] = []
    seen = [False] * len(is_fork)
    # What no fork leads to lies on rings, each of which begins at one of its nodes.
    for fork in (*np.flatnonzero(~between).tolist(), *np.flatnonzero(between).tolist()):
        if seen[fork]:
            continue
        seen[fork] = is_fork[fork] = True
        forks.append(fork)
        for edge in range(first[fork], first[fork + 1]):
            node, length = targets[edge], lengths[edge]
            while not is_fork[node]:
                seen[node] = True
                nodes.append(node)
                metres.append(length)
                onwards = first[node]
                node, length = targets[onwards], length + lengths[onwards]
            chains.append(_Chain(fork, node, len(nodes), length))
    return forks, nodes, metres, chains
