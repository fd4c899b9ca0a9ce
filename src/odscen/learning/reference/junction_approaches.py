"""Whom a driver meets at the junction ahead, from the shape of the lanes through it alone.

A lane graph has no rules of right of way. Mostly the larger road goes first: of two approaches
opposite each other the fastest, then those of most lanes, then the straightest. Who comes by
another one waits for their traffic; of two who go first, or two who wait, the one who turns more.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.lanegraph.graphs import Relation
from odscen.learning.reference.beyond_junctions import Ways

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import BoolArray, FloatArray
    from odscen.lanegraph.graphs import LaneGraph

MEET = 2.2
"""Metres between the centre lines of lanes whose traffic meets."""
OPPOSITE = 2.4
"""Radians between the headings of approaches that are one road, at least."""
LONGEST = 120.0
"""Metres through a junction that are followed."""
BRANCHES = 12
"""Ways through a junction from one lane, at most."""
COLUMNS = 7
_TURNS_MORE = 0.3
"""Radians."""
_MOST_POINTS = 1500

_Approach = tuple[str, int, bool]


@dataclass(frozen=True, slots=True, eq=False)
class _WayThrough:
    """A way through a junction; ``turn`` in radians, ``flow`` is its share of its lane's.

    ``entry`` is the node that it comes out on.
    """

    root: int
    entry: int
    approach: _Approach
    points: FloatArray
    turn: float
    metres: float
    flow: float


class _Standing(NamedTuple):
    """What makes an approach go first: m/s, number of lanes; its heading in radians."""

    limit: float
    lanes: int
    heading: float


def approaches(
    lanes: LaneGraph, on_road: BoolArray, *, limit: FloatArray, flow: FloatArray
) -> tuple[Ways, list[FloatArray]]:
    """Ways through all junctions, and features of the last nodes of strips, 0 elsewhere.

    Features have shape ``(N,)``: whether the approach is of the road that goes first, the share of
    its ways on which one waits, the traffic that is waited for (mean and most), all that is met,
    metres through the junction, and by how much the limit is above that of the fastest other
    approach.

    Parameters
    ----------
    on_road
        Shape ``(N,)``: nodes outside junctions.
    limit, flow
        Shape ``(N,)``: m/s, and relative numbers of trips.
    """
    found = [np.zeros(len(lanes.x)) for _ in range(COLUMNS)]
    junctions = _movements(lanes, on_road, flow)
    for movements in junctions.values():
        _describe(movements, _standings(movements, lanes, limit), found)
    every = [one for some in junctions.values() for one in some if on_road[one.entry]]
    ways = Ways(
        np.array([one.root for one in every], dtype=np.int64),
        np.array([one.entry for one in every], dtype=np.int64),
        np.array([one.metres for one in every], dtype=np.float64),
    )
    return ways, found


def _movements(
    lanes: LaneGraph, on_road: BoolArray, flow: FloatArray
) -> dict[str, list[_WayThrough]]:
    """Ways through each junction."""
    onwards = _InsideJunctions(lanes, on_road)
    found: dict[str, list[_WayThrough]] = {}
    for root in onwards.roots:
        lane = int(lanes.lane[root])
        key = lanes.lanes.keys[lane]
        approach = (str(key.road), key.section, bool(lanes.lanes.forward[lane]))
        ways = onwards.ways(root)
        for nodes, metres in ways:
            turn = float(np.angle(np.exp(1j * (lanes.hdg[nodes[-1]] - lanes.hdg[root]))))
            points = np.column_stack([lanes.x[nodes], lanes.y[nodes]])
            name = str(lanes.lanes.junctions[lanes.lane[nodes[0]]])
            share = float(flow[root]) / len(ways)
            one = _WayThrough(root, nodes[-1], approach, points, turn, metres, share)
            found.setdefault(name, []).append(one)
    return found


class _InsideJunctions:
    """Where nodes lead, inside junctions."""

    def __init__(self, lanes: LaneGraph, on_road: BoolArray) -> None:
        follows = np.flatnonzero(lanes.relation == Relation.SUCCESSOR)
        order = follows[np.argsort(lanes.source[follows], kind="stable")]
        source, self._target = lanes.source[order], lanes.target[order].tolist()
        self._length = lanes.length[order].tolist()
        self._first = np.searchsorted(source, np.arange(len(lanes.x) + 1)).tolist()
        self._on_road = on_road.tolist()
        enters = on_road[source] & ~on_road[lanes.target[order]]
        self.roots: list[int] = np.unique(source[enters]).tolist()

    def ways(self, root: int) -> list[tuple[list[int], float]]:
        """Nodes of each way from the first in the junction to the first behind it, and metres."""
        found: list[tuple[list[int], float]] = []
        open_ = [([there], far) for there, far in self._next(root) if not self._on_road[there]]
        while open_ and len(found) < BRANCHES:
            nodes, metres = open_.pop()
            onwards = self._next(nodes[-1]) if metres < LONGEST else []
            if self._on_road[nodes[-1]] or not onwards:
                found.append((nodes, metres))
            else:
                open_ += [([*nodes, there], metres + far) for there, far in reversed(onwards)]
        return found

    def _next(self, node: int) -> list[tuple[int, float]]:
        edges = slice(self._first[node], self._first[node + 1])
        return list(zip(self._target[edges], self._length[edges], strict=True))


def _standings(
    movements: Sequence[_WayThrough], lanes: LaneGraph, limit: FloatArray
) -> dict[_Approach, _Standing]:
    roots: dict[_Approach, set[int]] = {}
    for one in movements:
        roots.setdefault(one.approach, set()).add(one.root)
    return {
        approach: _Standing(
            max(float(limit[root]) for root in some),
            len(some),
            float(lanes.hdg[min(some)]),
        )
        for approach, some in roots.items()
    }


def _first_road(standings: dict[_Approach, _Standing]) -> frozenset[_Approach]:
    """Approaches of the road that goes first; none where no two are opposite."""
    best: tuple[tuple[float, int, float], frozenset[_Approach]] | None = None
    for (one, a), (other, b) in combinations(standings.items(), 2):
        apart = abs(float(np.angle(np.exp(1j * (a.heading - b.heading)))))
        if apart > OPPOSITE:
            rank = (round(min(a.limit, b.limit), 1), min(a.lanes, b.lanes), round(apart, 3))
            if best is None or rank > best[0]:
                best = (rank, frozenset({one, other}))
    return best[1] if best else frozenset()


def _describe(
    movements: Sequence[_WayThrough],
    standings: dict[_Approach, _Standing],
    found: list[FloatArray],
) -> None:
    """Write the features of the approaches of one junction."""
    first = _first_road(standings)
    ahead = np.array([one.approach in first for one in movements])
    turn = np.array([abs(one.turn) for one in movements])
    flow = np.array([one.flow for one in movements])
    meets = _meeting(movements)
    more = turn[:, None] > turn[None, :] + _TURNS_MORE
    level = ahead[:, None] == ahead[None, :]
    equal = level & ~more & ~more.T & ~ahead[:, None]
    waits = (~ahead[:, None] & ahead[None, :]) + level * more + 0.5 * equal
    waited = (meets * waits) @ flow
    met = meets @ flow
    root = np.array([one.root for one in movements])
    for node in np.unique(root).tolist():
        own = root == node
        approach = movements[int(np.argmax(own))].approach
        limits = [one.limit for key, one in standings.items() if key != approach]
        values = (
            float(approach in first),
            float(np.mean(waited[own] > 0)),
            np.log(0.1 + waited[own].mean()) / 2.0,
            np.log(0.1 + waited[own].max()) / 2.0,
            np.log(0.1 + met[own].mean()) / 2.0,
            min(max(one.metres for one in movements if one.root == node), 60.0) / 30.0,
            (standings[approach].limit - max(limits, default=standings[approach].limit)) / 15.0,
        )
        for column, value in zip(found, values, strict=True):
            column[node] = value


def _meeting(movements: Sequence[_WayThrough]) -> FloatArray:
    """Whether the ways of two movements of different approaches cross or merge, ``(M, M)``."""
    from scipy.spatial.distance import cdist

    step = -(-sum(len(one.points) for one in movements) // _MOST_POINTS)
    points = [one.points[::-step] for one in movements]  # the place behind the junction first
    first = np.concatenate([[0], np.cumsum([len(one) for one in points])[:-1]])
    every = np.concatenate(points)
    near = cdist(every, every)
    least = np.minimum.reduceat(np.minimum.reduceat(near, first, axis=0), first, axis=1)
    approach = [one.approach for one in movements]
    apart = np.array([[a != b for b in approach] for a in approach], dtype=np.bool_)
    return ((least < MEET * step) & apart).astype(np.float64)
