"""Paths to one goal from many starts, found together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from odscen.base.arrays import FloatArray, Int32Array


NO_PREDECESSOR = -9999
FEW = 100
"""Sources that are followed one by one: numpy would take a step of all of them no faster."""


class PathsTo:
    """Shortest paths to one node, found at once; nodes are numbered as the whole map's.

    Attributes
    ----------
    distances
        Metres from each node of ``nodes``; inf where no path leads.
    """

    def __init__(
        self,
        nodes: NDArray[np.integer],
        local: NDArray[np.integer],
        distances: FloatArray,
        nexts: Int32Array,
    ) -> None:
        self.nodes = nodes
        self.distances = distances
        self._local = local
        self._next = nexts

    def distance(self, sources: Int32Array) -> FloatArray:
        """Metres from each source, which lies in the region."""
        return np.asarray(self.distances[self._local[sources]], dtype=np.float64)

    def paths(self, sources: Int32Array) -> list[Int32Array]:
        """Nodes of the path from each source, both ends included; empty where there is none."""
        if len(sources) <= FEW:
            return [self._path_from(int(start)) for start in self._local[sources]]
        current = self._local[sources]
        steps = [current]
        counts = np.ones(len(sources), dtype=np.intp)
        while (going := self._next[current] != NO_PREDECESSOR).any():
            current = np.where(going, self._next[current], current)
            counts += going
            steps.append(current)
        counts[~np.isfinite(self.distances[steps[0]])] = 0
        table = self.nodes[np.stack(steps, axis=1)].astype(np.int32)
        return [row[:count] for row, count in zip(table, counts.tolist(), strict=True)]

    def _path_from(self, start: int) -> Int32Array:
        if not np.isfinite(self.distances[start]):
            return np.empty(0, dtype=np.int32)
        steps, after = [start], self._next.item
        while (step := after(steps[-1])) != NO_PREDECESSOR:
            steps.append(step)
        return self.nodes[steps].astype(np.int32)

    def stretches(
        self, sources: NDArray[np.integer], marks: Int32Array
    ) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
        """Follow the marks of the nodes along each path, each run of equal ones once.

        Parameters
        ----------
        marks
            A number from 0 on for each node of the map, such as the row of its segment.

        Returns
        -------
        Marks in the order in which they are met, and the first node with each: two arrays of shape
        ``(len(sources), most)``, with -1 behind the end of a path.
        """
        after = self._first_node_after(marks)
        steps = [self._local[sources]]
        while (steps[-1] >= 0).any():
            steps.append(np.where(steps[-1] >= 0, after[steps[-1]], -1))
        table = np.stack(steps[:-1], axis=1)
        nodes = np.where(table >= 0, self.nodes[table], -1)
        return np.where(table >= 0, marks[nodes], -1), nodes

    def _first_node_after(self, marks: Int32Array) -> NDArray[np.integer]:
        """First node on the path from each node of the region that has another mark, or -1."""
        mark = marks[self.nodes]
        jump = np.where(self._next == NO_PREDECESSOR, np.arange(len(mark)), self._next)
        # Pointers are doubled: as many rounds as the logarithm of the longest stretch.
        while (going := (mark[jump] == mark) & (jump[jump] != jump)).any():
            jump = np.where(going, jump[jump], jump)
        return np.where(mark[jump] != mark, jump, -1)
