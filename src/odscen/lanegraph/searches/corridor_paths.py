"""Shortest paths between two nodes of a large graph, without a search of all its nodes.

A search over the gates of its blocks alone finds which blocks a shortest path can lead through, its
*corridor*; a search of these finds the path.

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
from scipy.sparse import csgraph

from odscen.lanegraph.searches.blocks import spans, square

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from odscen.base.arrays import FloatArray
    from odscen.lanegraph.searches.blocks import Blocks

    Rows = NDArray[np.integer]


class Way(NamedTuple):
    """A shortest path: its length, inf if there is none, and its nodes, both ends included."""

    metres: float
    nodes: Rows


class CorridorPaths:
    """Shortest paths over a directed graph; made once for many pairs of nodes.

    Parameters
    ----------
    blocks
        The graph, in blocks that are of use.
    """

    def __init__(self, blocks: Blocks) -> None:
        self._blocks = blocks
        back = blocks.between.T.tocsr()
        self._back = tuple(a.tolist() for a in (back.indptr, back.indices, back.data))

    def find(self, source: int, target: int) -> Way | None:
        """Shortest path from node to node; ``None`` if a search of all nodes has to say.

        It is the path that Dijkstra's algorithm finds from ``source`` on in the whole graph.
        """
        start, goal = self._blocks.row[[source, target]].tolist()
        blocks = self._blocks_of_corridor(start, goal)
        return (
            self._search_corridor(start, goal, blocks)
            if blocks
            else Way(math.inf, self._blocks.node[:0])
        )

    def _blocks_of_corridor(self, start: int, goal: int) -> set[int]:
        """Blocks that a shortest path can lead through; none if there is no path."""
        blocks = self._blocks
        outset, last = blocks.outset(start), int(blocks.block[goal])
        begin, stop = blocks.gates_of[last : last + 2].tolist()
        ends = [float(outset.gates[k] + blocks.within[k - begin, goal]) for k in range(begin, stop)]
        best = min(ends, default=math.inf)
        if outset.home == last:
            best = min(best, float(outset.nearby[goal - outset.first]))
        if not math.isfinite(best):
            return set()
        slack = best * blocks.rounding
        near = [begin + k for k, length in enumerate(ends) if length <= best + slack]
        return {outset.home, last, *self._blocks_before(near, outset.gates, slack)}

    def _blocks_before(self, near: list[int], gates: FloatArray, slack: float) -> list[int]:
        """Blocks of some gates, and of those on the shortest paths to there."""
        first, before, lengths = self._back
        metres = gates.item
        seen, open_ = set(near), near
        while open_:
            gate = open_.pop()
            most = metres(gate) + slack
            for k in range(first[gate], first[gate + 1]):
                if (other := before[k]) not in seen and metres(other) + lengths[k] <= most:
                    seen.add(other)
                    open_.append(other)
        blocks = self._blocks
        found: list[int] = blocks.block[blocks.gates[list(seen)]].tolist()
        return found

    def _search_corridor(self, start: int, goal: int, corridor: set[int]) -> Way | None:
        """Search some blocks as Dijkstra does; ``None`` where the heap decides."""
        blocks, every = self._blocks, self._blocks.every
        wanted = np.array(sorted(corridor))
        begins, ends = blocks.first[wanted], blocks.first[wanted + 1]
        places = np.cumsum(ends - begins) - (ends - begins)
        rows = spans(begins, ends)
        edges = spans(every.indptr[begins], every.indptr[ends])
        columns, metres = every.indices[edges], every.data[edges]
        shift = np.full(len(blocks.first), -2 * len(blocks.node))
        shift[wanted] = places - begins
        heads = columns + shift[blocks.block[columns]]
        tails = np.repeat(np.arange(len(rows)), every.indptr[rows + 1] - every.indptr[rows])
        inside = heads >= 0
        heads, tails, metres = heads[inside], tails[inside], metres[inside]
        counts = np.bincount(tails, minlength=len(rows))
        matrix = square(metres, heads, np.append(0, np.cumsum(counts)))
        start, goal = (row + int(shift[blocks.block[row]]) for row in (start, goal))
        distances, predecessors = csgraph.dijkstra(
            matrix, indices=np.asarray(start), return_predecessors=True
        )
        path = _path_from_predecessors(predecessors, goal)
        if _is_tied(path, distances, tails, heads, metres):
            return None
        return Way(float(distances[goal]), blocks.node[rows[path]])


def _path_from_predecessors(predecessors: Rows, goal: int) -> Rows:
    before = predecessors.item
    steps, step = [goal], before(goal)
    while step >= 0:
        steps.append(step)
        step = before(step)
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
