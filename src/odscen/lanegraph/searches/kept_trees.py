"""Trees of shortest paths that were searched, the last ones of all routers of the process.

A server has a router for each region that someone edits, and each of these is asked for the same
few sources again and again. What all of them keep together has one bound, however many they are.
"""

from __future__ import annotations

import os
import threading
from itertools import count
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray, Int32Array

_LEAST = 4
"""Trees that are kept however large they are."""
_MOST_NODES = 1 << 21
"""Nodes that those kept have together, where they are more: 12 bytes each, 25 MB."""


class Tree(NamedTuple):
    """Shortest paths from one node to all others.

    Attributes
    ----------
    distances
        Of each node of the region, shape ``(R,)``; inf if it is not reached.
    predecessors
        Node before it on the path, as a row of the region, shape ``(R,)``.
    """

    distances: FloatArray
    predecessors: Int32Array


class _KeptTrees:
    """The first that came goes first."""

    def __init__(self) -> None:
        self._trees: dict[tuple[int, int], Tree] = {}
        self._nodes = 0
        self.begin_in_child()

    def begin_in_child(self) -> None:
        """Free the lock, which a thread of the process that was forked may have held."""
        self._lock = threading.Lock()

    def get(self, router: int, source: int) -> Tree | None:
        """Tree of a source, if it is kept."""
        return self._trees.get((router, source))

    def add(self, router: int, source: int, tree: Tree) -> None:
        """Keep a tree, and let go of the oldest that are too many now."""
        with self._lock:
            if (router, source) in self._trees:  # two threads looked for the same
                return
            self._trees[router, source] = tree
            self._nodes += len(tree.distances)
            while self._nodes > _MOST_NODES and len(self._trees) > _LEAST:
                gone = self._trees.pop(next(iter(self._trees)))
                self._nodes -= len(gone.distances)

    @property
    def nodes(self) -> int:
        """Nodes of all trees that are kept."""
        return self._nodes


KEPT_TREES = _KeptTrees()
os.register_at_fork(after_in_child=KEPT_TREES.begin_in_child)

ROUTERS = count()
"""Numbers of routers: names under which their trees are kept."""
