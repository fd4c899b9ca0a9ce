"""Quickest routes in free flow that avoid what is closed."""

from __future__ import annotations

import heapq
import math
from collections import defaultdict
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

Pairs = frozenset[tuple[str, str]]


class LaneLink(NamedTuple):
    """A way from a lane of one edge to one of another; ``seconds`` in free flow to its end."""

    source: str
    target: str
    seconds: float
    allowed: frozenset[str]


class Detours:
    """Finds routes on one network; what was found for the same closures is remembered."""

    def __init__(self, links: Iterable[LaneLink]) -> None:
        quickest: dict[str, dict[tuple[str, str], float]] = defaultdict(dict)
        for link in links:
            for vclass in link.allowed:
                key = link.source, link.target
                known = quickest[vclass].get(key, link.seconds)
                quickest[vclass][key] = min(known, link.seconds)
        self._onwards: dict[str, dict[str, list[tuple[str, float]]]] = {}
        for vclass, pairs in quickest.items():
            onwards: dict[str, list[tuple[str, float]]] = defaultdict(list)
            for (source, target), seconds in sorted(pairs.items()):
                onwards[source].append((target, seconds))
            self._onwards[vclass] = onwards
        self._quickest = quickest
        self._closed: Pairs = frozenset()
        self._known: dict[tuple[str, str, str], tuple[str, ...] | None] = {}

    def find(self, source: str, goal: str, vclass: str, closed: Pairs) -> tuple[str, ...] | None:
        """Edges of the quickest route, both ends included; ``None`` if every one is closed."""
        if closed != self._closed:
            self._closed, self._known = closed, {}
        key = source, goal, vclass
        if key not in self._known:
            self._known[key] = self._search_detour(source, goal, vclass, closed)
        return self._known[key]

    def by_stops(
        self, source: str, goals: Sequence[str], vclass: str, closed: Pairs
    ) -> tuple[str, ...] | None:
        """Edges of the quickest route by all goals to the last; ``None`` if that is out of reach.

        Other goals that are out of reach, or lead no further, are left out.
        """
        route: tuple[str, ...] = (source,)
        for goal in goals[:-1]:
            part = self.find(route[-1], goal, vclass, closed)
            if part is not None and self.find(goal, goals[-1], vclass, closed) is not None:
                route += part[1:]
        rest = self.find(route[-1], goals[-1], vclass, closed)
        return None if rest is None else route + rest[1:]

    def seconds(self, route: Sequence[str], vclass: str) -> float:
        """Seconds in free flow from the end of the first edge of a route to that of the last."""
        quickest = self._quickest[vclass]
        return sum(quickest.get(pair, math.inf) for pair in pairwise(route))

    def _search_detour(
        self, source: str, goal: str, vclass: str, closed: Pairs
    ) -> tuple[str, ...] | None:
        onwards = self._onwards.get(vclass, {})
        queue = [(0.0, source, "")]
        before: dict[str, str] = {}
        while queue:
            spent, edge, previous = heapq.heappop(queue)
            if edge in before:
                continue
            before[edge] = previous
            if edge == goal:
                break
            for target, seconds in onwards.get(edge, ()):
                if target not in before and (edge, target) not in closed:
                    heapq.heappush(queue, (spent + seconds, target, edge))
        if goal not in before:
            return None
        route = [goal]
        while route[-1] != source:
            route.append(before[route[-1]])
        return tuple(reversed(route))
