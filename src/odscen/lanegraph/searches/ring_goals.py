"""Goals of starts from which no end is reached, on a large graph: of each lane the farthest node.

A town that is closed has one such goal on each of its lanes, and many starts: what they have in
common is found once, and of each start only the goals that somebody takes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from scipy.sparse import csgraph

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray
    from scipy import sparse

    from odscen.base.arrays import BoolArray, Int32Array
    from odscen.lanegraph.searches.farthest_nodes import FarthestNodes, LaneNodes

    Rows = NDArray[np.integer]

_KEPT = 16
"""Sets of starts of which it is kept what they have in common: a few bytes for each lane, and
the mask of their goals."""


class GoalsOfStart(Protocol):
    """Goals of one start, ascending, as nodes of the map."""

    def __len__(self) -> int:
        """How many there are."""

    def __getitem__(self, place: int, /) -> Any:
        """Goal in that place, from 0 on."""


class _LanesAhead(NamedTuple):
    """Lanes that are reached from a part of the graph, as seen from blocks other than theirs.

    Attributes
    ----------
    allowed
        Nodes of the map that goals may be on.
    reached
        How many nodes of each lane are reached; shape ``(L,)``, as the two that follow.
    counts
        Whether a lane is one of those that have a goal: a road, if any road is reached.
    has_goal
        Whether the farthest node of the lane may be a goal.
    mixed
        Lanes on some of whose nodes a goal may be, and on others not, where it is certain which is
        the farthest.
    open
        Such lanes where it is not.
    open_nodes
        Nodes of the open lanes.
    """

    allowed: BoolArray | None
    reached: Rows
    counts: BoolArray
    has_goal: BoolArray
    mixed: Rows
    open: Rows
    open_nodes: LaneNodes | None


class RingGoals:
    """Goals of many starts; made once for a graph.

    Parameters
    ----------
    matrix
        Length of the edge from row to column, above 0; shape ``(N, N)``.
    part
        Strongly connected part of each node, shape ``(N,)``.
    farthest
        Farthest nodes of the lanes of that graph.
    nodes
        Node of the map that each node is, shape ``(N,)``.
    is_road
        Whether a lane is none of a junction: goals are on those, if one is reached; shape ``(L,)``.
    searched
        Finds all goals of a node of the map by a search of the whole graph, where rounding decides
        which node of a lane is the farthest.
    """

    def __init__(
        self,
        matrix: sparse.csr_matrix[np.float64],
        part: Int32Array,
        farthest: FarthestNodes,
        *,
        nodes: Rows,
        is_road: BoolArray,
        searched: Callable[[int], Int32Array],
    ) -> None:
        self._matrix, self._part = matrix, part
        self._farthest, self._starts, self._nodes = farthest, farthest.starts, nodes
        self._is_road, self._searched = is_road, searched
        self._known: dict[tuple[int, int], _LanesAhead] = {}

    def of(self, start: int, allowed: BoolArray | None) -> GoalsOfStart:
        """Goals of a node from which no end is reached.

        Parameters
        ----------
        start
            Its number in the graph.
        allowed
            Nodes of the map that a goal may be on; the same array for starts that have them in
            common. ``None``: all.
        """
        lanes = self._lanes_with_goal(start, allowed)
        if lanes is None:
            return self.by_search(start, allowed)
        return _LaneGoals(self, start, allowed, lanes)

    def is_goal(self, start: int, goal: int) -> bool | None:
        """Whether a node of the graph, which is reached, is a goal of a start.

        ``None`` if only a search of the whole graph can say.
        """
        lane = self._farthest.lane_of(goal)
        if not self._is_road[lane]:  # it depends on the other lanes
            return None
        node = self._farthest.of(start, lane)
        return None if node is None else node == goal

    def by_search(self, start: int, allowed: BoolArray | None) -> Int32Array:
        """All goals of a start, as nodes of the map."""
        goals = self._searched(int(self._nodes[start]))
        return goals if allowed is None else goals[allowed[goals]]

    def on_lane(self, start: int, lane: int) -> int | None:
        """Goal on a lane that has one, as node of the map; ``None`` if rounding decides."""
        node = self._farthest.of(start, lane)
        return None if node is None else int(self._nodes[node])

    def _lanes_with_goal(self, start: int, allowed: BoolArray | None) -> BoolArray | None:
        """Lanes that have a goal, shape ``(L,)``; ``None`` if only a search can say."""
        ahead, own = self._lanes_ahead(start, allowed), self._farthest.lane_of(start)
        is_alone = bool(ahead.counts[own]) and int(ahead.reached[own]) == 1
        if is_alone and np.count_nonzero(ahead.counts) == 1:
            return None
        has_goal = ahead.has_goal.copy()
        if allowed is not None and not self._weigh_mixed_lanes(start, ahead, allowed, has_goal):
            return None
        if is_alone:
            has_goal[own] = False
        return has_goal

    def _weigh_mixed_lanes(
        self, start: int, ahead: _LanesAhead, allowed: BoolArray, has_goal: BoolArray
    ) -> bool:
        """Say of mixed lanes whether their farthest node is allowed; if that is decided."""
        farthest = self._farthest
        near = ahead.mixed[farthest.home[ahead.mixed] == farthest.block_of[start]]
        for lanes, known in ((near, None), (ahead.open, ahead.open_nodes)):
            if len(lanes):
                nodes = farthest.on(lanes) if known is None else known
                found, lane = farthest.by_search(start, nodes)
                is_allowed = allowed[self._nodes[found]]
                some = np.bincount(lane, is_allowed, minlength=len(lanes)) > 0
                if not (some[lane] == is_allowed).all():
                    return False  # rounding decides
                has_goal[lanes] = some
        return True

    def _lanes_ahead(self, start: int, allowed: BoolArray | None) -> _LanesAhead:
        key = (int(self._part[start]), id(allowed))
        known = self._known.get(key)
        if known is None or known.allowed is not allowed:
            if len(self._known) >= _KEPT:
                self._known = {}
            known = self._known[key] = self._find_lanes_ahead(start, allowed)
        return known

    def _find_lanes_ahead(self, start: int, allowed: BoolArray | None) -> _LanesAhead:
        seen = np.zeros(len(self._part), dtype=np.bool_)
        seen[csgraph.breadth_first_order(self._matrix, start, return_predecessors=False)] = True
        reached = np.add.reduceat(seen, self._starts, dtype=np.int32)
        counts = reached > 0
        if (counts & self._is_road).any():
            counts &= self._is_road
        if allowed is None:
            none = np.empty(0, dtype=np.int32)
            return _LanesAhead(allowed, reached, counts, counts, none, none, None)
        some = np.add.reduceat(seen & allowed[self._nodes], self._starts, dtype=np.int32)
        mixed = np.flatnonzero(counts & (some > 0) & (some < reached))
        certain = self._farthest.certain[mixed]
        has_goal = counts & (some == reached)
        has_goal[mixed] = (certain >= 0) & allowed[self._nodes[certain]]
        mixed, open_ = mixed[certain >= 0], mixed[certain < 0]
        nodes = self._farthest.on(open_)
        return _LanesAhead(allowed, reached, counts, has_goal, mixed, open_, nodes)


class _LaneGoals:
    """Goals of one start: which node of a lane it is, is found when it is asked for."""

    def __init__(
        self, goals: RingGoals, start: int, allowed: BoolArray | None, lanes: BoolArray
    ) -> None:
        self._goals, self._start, self._allowed, self._lanes_with_goal = (
            goals,
            start,
            allowed,
            lanes,
        )

    def __len__(self) -> int:
        return int(np.count_nonzero(self._lanes_with_goal))

    def __getitem__(self, place: int, /) -> int:
        lane = int(np.flatnonzero(self._lanes_with_goal)[place])
        node = self._goals.on_lane(self._start, lane)
        if node is None:
            node = int(self._goals.by_search(self._start, self._allowed)[place])
        return node
