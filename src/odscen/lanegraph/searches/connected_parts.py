"""Strongly connected parts of a graph: what can be reached from many nodes, found together."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csgraph

if TYPE_CHECKING:
    from scipy import sparse

    from odscen.base.arrays import BoolArray, Int32Array


class ConnectedParts:
    """Parts of a graph, whose nodes can all be reached from each other.

    Parameters
    ----------
    matrix
        Length of the edge from row to column; shape ``(N, N)``.
    directed
        Whether edges lead from row to column only.

    Attributes
    ----------
    of
        Number of the part of each node, shape ``(N,)``.
    """

    def __init__(self, matrix: sparse.csr_matrix[np.float64], *, directed: bool) -> None:
        self._matrix = matrix
        self._directed = directed
        self.of: Int32Array = csgraph.connected_components(
            matrix, directed=directed, connection="strong"
        )[1]

    def lead(self, sources: Int32Array, targets: Int32Array) -> BoolArray:
        """Whether a path leads from each source to the target in the same place; shape ``(K,)``."""
        starts, ends = self.of[sources], self.of[targets]
        if not self._directed:
            return np.asarray(starts == ends, dtype=np.bool_)
        reached, columns = self._reached_parts(ends)
        pairs = zip(starts.tolist(), ends.tolist(), strict=True)
        return np.array([reached[a] >> columns[b] & 1 for a, b in pairs], dtype=np.bool_)

    def reach(self, sources: Int32Array, targets: Int32Array) -> tuple[Int32Array, BoolArray]:
        """Which of the targets each source can get to.

        Returns
        -------
        For each source, shape ``(S,)``, a row of the table, shape ``(R, T)``: sources from which
        the same can be reached share one. A node counts as reached from itself.
        """
        starts, ends = self.of[sources], self.of[targets]
        parts, rows = np.unique(starts, return_inverse=True)
        row = rows.astype(np.int32)
        if not self._directed:
            return row, np.equal.outer(parts, ends)
        reached, columns = self._reached_parts(ends)
        table = np.zeros((len(parts), len(columns)), dtype=np.bool_)
        for index, part in enumerate(parts.tolist()):
            bits = reached[part]
            while bits:
                low = bits & -bits
                table[index, low.bit_length() - 1] = True
                bits ^= low
        return row, table[:, [columns[part] for part in ends.tolist()]]

    def _reached_parts(self, parts: Int32Array) -> tuple[dict[int, int], dict[int, int]]:
        """For each part a bit for each of ``parts`` that it leads to; and which bit is whose."""
        columns = {part: k for k, part in enumerate(np.unique(parts).tolist())}
        reached: dict[int, int] = {}
        for part in self._order_parts:
            bits = 1 << columns[part] if part in columns else 0
            for after in self._part_successors[part]:
                bits |= reached[after]
            reached[part] = bits
        return reached, columns

    @cached_property
    def _part_successors(self) -> dict[int, set[int]]:
        after: dict[int, set[int]] = {part: set() for part in np.unique(self.of).tolist()}
        edges = self._matrix.tocoo()
        parts = np.stack([self.of[edges.row], self.of[edges.col]], axis=1)
        for one, other in np.unique(parts[parts[:, 0] != parts[:, 1]], axis=0).tolist():
            after[one].add(other)
        return after

    @cached_property
    def _order_parts(self) -> tuple[int, ...]:
        """Parts, each behind those that it leads to."""
        after = self._part_successors
        order: list[int] = []
        done: set[int] = set()
        todo = list(after)
        while todo:  # parts make no circles
            ahead = [number for number in after[todo[-1]] if number not in done]
            if ahead:
                todo += ahead
            elif (part := todo.pop()) not in done:
                done.add(part)
                order.append(part)
        return tuple(order)
