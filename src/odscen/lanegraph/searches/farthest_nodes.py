"""The farthest node of a lane from any node of a large graph, without a search of all nodes.

Whoever comes from another block enters that of the lane at one of its gates. Where, seen from each
gate, the same node of the lane is the farthest, it is so from everywhere outside the block: nothing
need be searched. It is the last one of nearly all lanes of a town. For other lanes a search over
the gates of all blocks finds how far each of their nodes is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.lanegraph.searches.blocks import spans

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.lanegraph.searches.blocks import Blocks, OutwardDistances

    Rows = NDArray[np.integer]


class LaneNodes(NamedTuple):
    """Nodes of some lanes, one lane after another, and how they are reached.

    Attributes
    ----------
    nodes, rows, block
        Their numbers in the graph, rows of the blocks, and blocks; shape ``(K,)``.
    starts, sizes
        Where each lane begins among them, and how many nodes it has.
    gates, within
        Gates of the block of each, and metres from there; shape ``(G, K)``.
    """

    nodes: Rows
    starts: Rows
    sizes: Rows
    rows: Rows
    block: Rows
    gates: Rows
    within: FloatArray


class FarthestNodes:
    """Farthest node of each lane; made once for many sources.

    Parameters
    ----------
    blocks
        The graph, in blocks that are of use.
    starts
        First node of each lane, ascending, the first 0: nodes of a lane follow each other;
        shape ``(L,)``.

    Attributes
    ----------
    starts
        As given.
    block_of
        Block of each node, shape ``(N,)``.
    home
        Block of each lane, -1 where it lies in several; shape ``(L,)``.
    certain
        Farthest node of each lane from whatever source outside its block, if that reaches the lane;
        -1 where it depends on the source; shape ``(L,)``.
    """

    def __init__(self, blocks: Blocks, starts: Int32Array) -> None:
        self._blocks = blocks
        self.starts = starts
        self._bounds = np.append(starts, np.int32(len(blocks.row)))
        self.block_of = blocks.block[blocks.row]
        first, last = (f.reduceat(self.block_of, starts) for f in (np.minimum, np.maximum))
        self.home = np.where(first == last, first, -1)
        self.certain = self._without_search()
        self._outset: tuple[int, OutwardDistances] | None = None

    def lane_of(self, node: int) -> int:
        """Lane that a node is on."""
        return int(np.searchsorted(self.starts, node, side="right")) - 1

    def of(self, source: int, lane: int) -> int | None:
        """Farthest node of a lane that is reached from a node, which itself does not count.

        ``None`` if rounding decides which it is, or no other is reached.
        """
        if self.certain[lane] >= 0 and self.home[lane] != self.block_of[source]:
            return int(self.certain[lane])
        nodes, _ = self.by_search(source, self.on(np.array([lane])))
        return int(nodes[0]) if len(nodes) == 1 else None

    def on(self, lanes: Rows) -> LaneNodes:
        """What :meth:`by_search` looks at, made once for some lanes."""
        blocks, begins, ends = self._blocks, self._bounds[lanes], self._bounds[lanes + 1]
        nodes, sizes = spans(begins, ends), ends - begins
        starts = np.cumsum(sizes) - sizes
        rows, block = blocks.row[nodes], self.block_of[nodes]
        begin, stop = blocks.gates_of[block], blocks.gates_of[block + 1]
        turns = np.arange(int((stop - begin).max(initial=0)))[:, np.newaxis]
        gates = np.where(begin + turns < stop, begin + turns, 0)  # for these within is infinite
        return LaneNodes(
            nodes, starts, sizes, rows, block, gates, blocks.within[: len(gates), rows]
        )

    def by_search(self, source: int, lanes: LaneNodes) -> tuple[Rows, Rows]:
        """Farthest nodes of some lanes, whatever is certain, and the place of their lane.

        Of a lane there are several where rounding decides, and none where no other is reached.
        """
        outset = self._outset_from(source)
        metres = np.full(len(lanes.nodes), np.inf)
        for gates, within in zip(lanes.gates, lanes.within, strict=True):
            np.minimum(metres, outset.gates[gates] + within, out=metres)
        here = np.flatnonzero(lanes.block == outset.home)
        nearby = outset.nearby[lanes.rows[here] - outset.first]
        metres[here] = np.minimum(metres[here], nearby)
        away = np.where(np.isfinite(metres), metres, -1.0)
        away[lanes.nodes == source] = -1.0
        most = np.maximum.reduceat(away, lanes.starts)
        least = np.repeat(most * (1.0 - self._blocks.rounding), lanes.sizes)
        places = np.flatnonzero((away >= least) & (away >= 0.0))
        return lanes.nodes[places], np.searchsorted(lanes.starts, places, side="right") - 1

    def _outset_from(self, source: int) -> OutwardDistances:
        known = self._outset  # other threads may ask for theirs
        if known is None or known[0] != source:
            row = int(self._blocks.row[source])
            known = self._outset = (source, self._blocks.outset(row))
        return known[1]

    def _without_search(self) -> Rows:
        blocks, starts = self._blocks, self.starts
        sizes = np.diff(self._bounds)
        margin = blocks.rounding * float(blocks.every.data.sum())
        found = np.full(len(starts), -1)
        is_certain = self.home >= 0
        for within in blocks.within:
            metres = within[blocks.row]
            most, least = (f.reduceat(metres, starts) for f in (np.maximum, np.minimum))
            leads = np.isfinite(most)
            is_certain &= leads | np.isinf(least)  # to all of its nodes, or to none
            is_near = metres >= np.repeat(most - margin, sizes)
            is_one = leads & (np.add.reduceat(is_near, starts, dtype=np.int32) == 1)
            nodes = np.flatnonzero(is_near & np.repeat(is_one, sizes))
            is_certain &= is_one | ~leads
            farthest = np.full(len(starts), -1)
            farthest[is_one] = nodes
            is_certain &= ~leads | (found < 0) | (found == farthest)
            found = np.where(leads, farthest, found)
        return np.where(is_certain, found, -1)
