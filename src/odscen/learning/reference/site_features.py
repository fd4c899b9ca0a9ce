"""What the model knows of a place: the road, the light ahead, and the traffic ahead.

Columns are numbers of about the size of one. A feature with bends is a row of ``min(value, c) / c``
for several ``c``, of which a small network makes any smooth curve.

A lane graph has no rules of right of way. Mostly the larger road goes first: of two approaches
opposite each other the fastest, then those of most lanes, then the straightest. Who comes by
another one waits for their traffic; of two who go first, or two who wait, the one who turns more.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from odscen.lanegraph.graphs import Relation, WalkKind
from odscen.learning.reference.gap_states import Ways, beyond_columns
from odscen.learning.reference.road_strips import Strips, road_strips
from odscen.learning.traffic_snapshots import SignalAhead

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import BoolArray, FloatArray, Int32Array, IntArray
    from odscen.lanegraph.graphs import LaneGraph, PedestrianGraph
    from odscen.learning.reference.gap_states import GapStates
    from odscen.learning.traffic_snapshots import LightView


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


class _ApproachRank(NamedTuple):
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
    junctions = _junction_movements(lanes, on_road, flow)
    for movements in junctions.values():
        _describe_approaches(movements, _approach_standings(movements, lanes, limit), found)
    every = [through for some in junctions.values() for through in some if on_road[through.entry]]
    ways = Ways(
        np.array([through.root for through in every], dtype=np.int64),
        np.array([through.entry for through in every], dtype=np.int64),
        np.array([through.metres for through in every], dtype=np.float64),
    )
    return ways, found


def _junction_movements(
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
            through = _WayThrough(root, nodes[-1], approach, points, turn, metres, share)
            found.setdefault(name, []).append(through)
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
        open_ = [
            ([there], far) for there, far in self._nodes_after(root) if not self._on_road[there]
        ]
        while open_ and len(found) < BRANCHES:
            nodes, metres = open_.pop()
            onwards = self._nodes_after(nodes[-1]) if metres < LONGEST else []
            if self._on_road[nodes[-1]] or not onwards:
                found.append((nodes, metres))
            else:
                open_ += [([*nodes, there], metres + far) for there, far in reversed(onwards)]
        return found

    def _nodes_after(self, node: int) -> list[tuple[int, float]]:
        edges = slice(self._first[node], self._first[node + 1])
        return list(zip(self._target[edges], self._length[edges], strict=True))


def _approach_standings(
    movements: Sequence[_WayThrough], lanes: LaneGraph, limit: FloatArray
) -> dict[_Approach, _ApproachRank]:
    roots: dict[_Approach, set[int]] = {}
    for movement in movements:
        roots.setdefault(movement.approach, set()).add(movement.root)
    return {
        approach: _ApproachRank(
            max(float(limit[root]) for root in some),
            len(some),
            float(lanes.hdg[min(some)]),
        )
        for approach, some in roots.items()
    }


def _first_road(standings: dict[_Approach, _ApproachRank]) -> frozenset[_Approach]:
    """Approaches of the road that goes first; none where no two are opposite."""
    best: tuple[tuple[float, int, float], frozenset[_Approach]] | None = None
    for (one, a), (other, b) in combinations(standings.items(), 2):
        apart = abs(float(np.angle(np.exp(1j * (a.heading - b.heading)))))
        if apart > OPPOSITE:
            rank = (round(min(a.limit, b.limit), 1), min(a.lanes, b.lanes), round(apart, 3))
            if best is None or rank > best[0]:
                best = (rank, frozenset({one, other}))
    return best[1] if best else frozenset()


def _describe_approaches(
    movements: Sequence[_WayThrough],
    standings: dict[_Approach, _ApproachRank],
    found: list[FloatArray],
) -> None:
    """Write the features of the approaches of one junction."""
    first = _first_road(standings)
    ahead = np.array([movement.approach in first for movement in movements])
    turn = np.array([abs(movement.turn) for movement in movements])
    flow = np.array([movement.flow for movement in movements])
    meets = _movements_meet(movements)
    more = turn[:, None] > turn[None, :] + _TURNS_MORE
    level = ahead[:, None] == ahead[None, :]
    equal = level & ~more & ~more.T & ~ahead[:, None]
    waits = (~ahead[:, None] & ahead[None, :]) + level * more + 0.5 * equal
    waited = (meets * waits) @ flow
    met = meets @ flow
    root = np.array([movement.root for movement in movements])
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
            min(max(movement.metres for movement in movements if movement.root == node), 60.0)
            / 30.0,
            (standings[approach].limit - max(limits, default=standings[approach].limit)) / 15.0,
        )
        for column, value in zip(found, values, strict=True):
            column[node] = value


def _movements_meet(movements: Sequence[_WayThrough]) -> FloatArray:
    """Whether the ways of two movements of different approaches cross or merge, ``(M, M)``."""
    from scipy.spatial.distance import cdist

    step = -(-sum(len(movement.points) for movement in movements) // _MOST_POINTS)
    points = [
        movement.points[::-step] for movement in movements
    ]  # the place behind the junction first
    first = np.concatenate([[0], np.cumsum([len(point) for point in points])[:-1]])
    every = np.concatenate(points)
    near = cdist(every, every)
    least = np.minimum.reduceat(np.minimum.reduceat(near, first, axis=0), first, axis=1)
    approach = [movement.approach for movement in movements]
    apart = np.array([[a != b for b in approach] for a in approach], dtype=np.bool_)
    return ((least < MEET * step) & apart).astype(np.float64)


ORIGINS = 160
"""Lanes that trips begin on, at most."""
TO_KERB, FROM_KERB = 1.0, 15.0
"""Metres that a lane change counts as: one keeps to the kerb where there is a choice."""
CHANGE = 30.0
"""Length of a road, metres, of which one who changes lanes spends half on the old lane."""


class Flows(NamedTuple):
    """Relative numbers of trips; shapes ``(L,)``, of both the mean over all roads is 1.

    ``road`` is the mean over the lanes of one direction, ``lane`` that of the lane itself.
    """

    road: FloatArray
    lane: FloatArray


def expected_flows(lanes: LaneGraph) -> Flows:
    """Trips that lead by the shortest path from everywhere on the roads to everywhere else on them.

    Both by length. Lanes count apart, as the lane that most leave a road by has a queue, while
    those beside it are empty.
    """
    count = len(lanes.lanes.keys)
    lengths = np.maximum(lanes.lanes.lengths, 0.1)
    one, other = lanes.lane[lanes.source], lanes.lane[lanes.target]
    follows = (lanes.relation == Relation.SUCCESSOR) & (one != other)
    beside = lanes.relation != Relation.SUCCESSOR
    number = np.abs([key.lane for key in lanes.lanes.keys])
    directions = _road_directions(lanes)
    gone = lengths / (lengths + CHANGE)
    source = np.concatenate([one[follows], one[beside]])
    target = np.concatenate([other[follows], other[beside]])
    outwards = number[other[beside]] > number[one[beside]]
    cost = np.concatenate([lengths[other[follows]], np.where(outwards, TO_KERB, FROM_KERB)])
    pairs, first = np.unique(source.astype(np.int64) * count + target, return_index=True)
    graph = csr_array((cost[first], (pairs // count, pairs % count)), shape=(count, count))
    on_road = np.array([name is None for name in lanes.lanes.junctions], dtype=np.bool_)
    weight = lengths * on_road
    origins = _spread_origins(weight)
    far, before = dijkstra(graph, indices=origins, return_predecessors=True)
    total = np.zeros(count)
    for row, origin in enumerate(origins):
        trips = _trips_over_lanes(far[row], before[row], weight)
        came = np.flatnonzero(before[row] >= 0)
        changed = came[directions[before[row][came]] == directions[came]]
        left = np.bincount(before[row][changed], weights=trips[changed], minlength=count)
        total += (trips - gone * left) * _share_of_weight(weight, origin, origins)
    by_road = np.bincount(directions, weights=total) / np.maximum(np.bincount(directions), 1)
    return Flows(_relative_flow(by_road[directions], on_road), _relative_flow(total, on_road))


def _relative_flow(total: FloatArray, on_road: BoolArray) -> FloatArray:
    mean = float(total[on_road].mean()) if on_road.any() else 0.0
    return np.asarray(total / mean) if mean > 0 else np.ones(len(total))


def _road_directions(lanes: LaneGraph) -> IntArray:
    """Row of the direction of its road that each lane is one of, ``(L,)``."""
    ids = [
        (key.road, key.section, forward)
        for key, forward in zip(lanes.lanes.keys, lanes.lanes.forward.tolist(), strict=True)
    ]
    rows = {one: row for row, one in enumerate(dict.fromkeys(ids))}
    return np.array([rows[pair] for pair in ids], dtype=np.int64)


def _spread_origins(weight: FloatArray) -> list[int]:
    """Lanes at equal steps of the total length of roads: no chance is needed."""
    ends = np.cumsum(weight)
    wanted = (np.arange(ORIGINS) + 0.5) / ORIGINS * ends[-1]
    found: list[int] = np.unique(
        np.minimum(np.searchsorted(ends, wanted), len(weight) - 1)
    ).tolist()
    return found


def _share_of_weight(weight: FloatArray, origin: int, origins: list[int]) -> float:
    return float(weight[origin] / sum(weight[origin] for origin in origins))


def _trips_over_lanes(far: FloatArray, before: FloatArray, weight: FloatArray) -> FloatArray:
    """Trips over each lane from one origin, if they end on lanes by ``weight``."""
    found: list[float] = np.where(np.isfinite(far), weight, 0.0).tolist()
    came = before.tolist()
    for lane in np.argsort(-np.where(np.isfinite(far), far, -1.0), kind="stable").tolist():
        if came[lane] >= 0:
            found[came[lane]] += found[lane]
    total = max(float(weight[np.isfinite(far)].sum()), 1.0)
    trips: FloatArray = np.array(found) / total
    return trips


BEFORE_END = 14.0
"""Metres before the end of a strip in which a crosswalk belongs to its junction."""
_NEAR = 1.3
"""Metres from a crosswalk to the nodes that it lies on."""


def setbacks(lanes: LaneGraph, strips: Strips, walks: PedestrianGraph | None) -> FloatArray:
    """Metres from the end of its strip to where its last crosswalk begins, for each node, ``(N,)``.

    0 without a crosswalk near the end.
    """
    from scipy.spatial import cKDTree

    count = len(strips.ahead)
    near = np.flatnonzero(strips.on_road & (strips.to_end < BEFORE_END))
    if walks is None or not len(near):
        return np.zeros(count)
    crossing = np.flatnonzero(walks.kind == WalkKind.CROSSWALK)
    if not len(crossing):
        return np.zeros(count)
    share = np.linspace(0.0, 1.0, 13)
    one, other = walks.source[crossing], walks.target[crossing]
    places = [
        (along[one][:, None] * (1.0 - share) + along[other][:, None] * share).ravel()
        for along in (walks.x, walks.y)
    ]
    far, _ = cKDTree(np.column_stack(places)).query(np.column_stack([lanes.x[near], lanes.y[near]]))
    crossed = near[far < _NEAR]
    found = np.zeros(count)
    np.maximum.at(found, strips.root[crossed], strips.to_end[crossed] + 1.0)
    at_root: FloatArray = found[strips.root]
    return at_root


UNKNOWN_LIMIT = 13.89
"""m/s, where the map gives no speed limit."""
_TO_END = (4.0, 8.0, 15.0, 30.0, 60.0, 120.0, 250.0)
_FROM_START = (15.0, 60.0, 200.0)
_SINCE = (4.0, 12.0, 30.0)
_TO_LINE = (4.0, 7.0, 13.0, 30.0)
_GAPS = (3.0, 5.0, 8.0, 12.0, 20.0, 40.0, 80.0, 150.0)


@dataclass(frozen=True, slots=True, eq=False)
class Site:
    """A map as the model sees it, without traffic and lights.

    Attributes
    ----------
    strips
        Its strips.
    limit
        Shape ``(N,)``: speed limit, m/s, known everywhere.
    beside
        Shape ``(N, 2)``: nearest nodes of the lanes to the left and right, -1 without one.
    outer
        Shape ``(N,)``: whether no lane of the same direction is to the right.
    lane
        Shape ``(N,)``: row of the lane.
    columns
        Shape ``(N, K)``: features of the road.
    ways
        Where strips lead through junctions.
    beside_ahead
        Shape ``(N, 2)``: on the lanes to the left and right the nearest nodes that are placed
        before this one, -1 without any.
    to_line
        Shape ``(N,)``: metres to the end of the strip or the crosswalk before it, 0 behind that.
    """

    strips: Strips
    limit: FloatArray
    beside: IntArray
    outer: BoolArray
    lane: IntArray
    columns: FloatArray
    ways: Ways
    beside_ahead: IntArray
    to_line: FloatArray


def site_of(lanes: LaneGraph, walks: PedestrianGraph | None = None) -> Site:
    """Look at a map once; many fills are made of it."""
    strips = road_strips(lanes)
    setback = setbacks(lanes, strips, walks)
    to_line = np.maximum(strips.to_end - setback, 0.0)
    limit = np.where(np.isnan(lanes.speed_limit), UNKNOWN_LIMIT, lanes.speed_limit)
    limit = np.maximum(limit, 1.0)
    flows = expected_flows(lanes)
    flow = flows.lane[lanes.lane]
    rights, lefts = _lanes_beside(lanes)
    ends = _strip_end_features(lanes, strips, flow)
    ways, more = approaches(lanes, strips.on_road, limit=limit, flow=flow)
    bend = _bend_ahead(lanes, strips)
    columns = np.column_stack(
        [
            *_hinge_features(to_line, _TO_END),
            np.minimum(setback, 8.0) / 8.0,
            (setback > 0.0) & (strips.to_end < setback),
            *_hinge_features(strips.from_start, _FROM_START),
            limit / 15.0,
            np.isnan(lanes.speed_limit),
            rights / 3.0,
            lefts / 3.0,
            rights == 0,
            lefts == 0,
            np.minimum(np.abs(lanes.curvature) * 30.0, 1.0),
            np.minimum(bend * 30.0, 1.0),
            *(np.log(0.1 + array) / 2.0 for array in (flows.road[lanes.lane], flow)),
            *(end[strips.root] for end in (*ends, *more, _flow_behind(ways, flow))),
        ]
    ).astype(np.float64)
    beside = np.column_stack(
        [_nodes_beside(lanes, lanes.left_lane), _nodes_beside(lanes, lanes.right_lane)]
    )
    return Site(strips, limit, beside, rights == 0, lanes.lane.astype(np.int64), columns, ways,
                _placed_before(strips, beside), to_line)  # fmt: skip


def light_columns(site: Site, lights: LightView) -> FloatArray:
    """Features of the light ahead, ``(N, 13)``: what it shows, for how long, how far red is."""
    lane = site.lane[site.strips.root]
    state, since = lights.state[lane], lights.since[lane]
    green, red = state == SignalAhead.GREEN, state == SignalAhead.RED
    shown = [green, state == SignalAhead.YELLOW, red]
    times = [on * column for on in (green, red) for column in _hinge_features(since, _SINCE)]
    line = [red * column for column in _hinge_features(site.to_line, _TO_LINE)]
    return np.column_stack([*shown, *times, *line]).astype(np.float64)


def traffic_columns(site: Site, states: GapStates, nodes: IntArray) -> FloatArray:
    """Features of the traffic ahead of nodes, on their lanes and those beside; one row for each."""
    own = _features_ahead(states, nodes)
    columns = [*own]
    for side in (0, 1):
        beside = site.beside_ahead[nodes, side]
        there = np.maximum(beside, 0)
        on_it = ~np.isnan(states.speed[there])
        gap, leader = states.gap[there], states.leader[there]
        seen = [
            np.exp(-gap / 15.0),
            np.where((leader >= 0) & (leader < 0.5), np.exp(-gap / 15.0), 0.0),
            on_it,
            np.minimum(states.near[there], 4.0) / 4.0,
            np.minimum(states.queue[there], 8.0) / 8.0,
            np.clip(leader, 0.0, None) / 15.0 * np.exp(-gap / 40.0),
        ]
        columns += [np.where(beside >= 0, column, 0.0) for column in seen]
    return np.column_stack(columns).astype(np.float64)


def junction_columns(site: Site, states: GapStates) -> FloatArray:
    """Features of the traffic behind the junction ahead, for all nodes: ``(N, 8)``."""
    return beyond_columns(site.ways, states)[site.strips.root]


def _features_ahead(states: GapStates, nodes: IntArray) -> list[FloatArray]:
    gap, leader = states.gap[nodes], states.leader[nodes]
    seen = leader >= 0
    close = np.exp(-gap / 25.0) * seen
    speed = np.where(seen, leader, 0.0)
    queue = states.queue[nodes]
    return [
        *_hinge_features(np.maximum(gap, 0.0), _GAPS),
        seen,
        speed / 15.0,
        (speed < 0.5) & seen,
        close,
        close * speed / 15.0,
        close * (speed < 0.5),
        np.minimum(queue, 3.0) / 3.0,
        np.minimum(queue, 15.0) / 15.0,
        np.minimum(states.near[nodes], 4.0) / 4.0,
        np.minimum(states.far[nodes], 12.0) / 12.0,
    ]


def _hinge_features(values: FloatArray, bends: tuple[float, ...]) -> list[FloatArray]:
    return [np.minimum(values, bend) / bend for bend in bends]


def _lanes_beside(lanes: LaneGraph) -> tuple[FloatArray, FloatArray]:
    """Number of lanes of the same direction to the right and to the left of each node."""
    found = []
    for beside in (lanes.right_lane, lanes.left_lane):
        first = lanes.lanes.first_node[:-1]
        next_lane = np.where(first < len(beside), beside[np.minimum(first, len(beside) - 1)], -1)
        count = np.zeros(len(next_lane))
        at = next_lane.copy()
        for _ in range(8):
            count += at >= 0
            at = np.where(at >= 0, next_lane[np.maximum(at, 0)], -1)
        found.append(count[lanes.lane])
    return found[0], found[1]


def _nodes_beside(lanes: LaneGraph, beside: Int32Array) -> IntArray:
    """Node of the lane beside with the nearest road coordinate; -1 without such a lane."""
    first, last = lanes.lanes.first_node[:-1], lanes.lanes.first_node[1:] - 1
    lane = np.maximum(beside, 0)
    count = last[lane] - first[lane] + 1
    own = np.arange(len(beside)) - first[lanes.lane]
    own_count = last[lanes.lane] - first[lanes.lane] + 1
    share = (own + 0.5) / np.maximum(own_count, 1)
    place = np.clip((share * count).astype(np.int64), 0, np.maximum(count - 1, 0))
    found: IntArray = np.where((beside >= 0) & (count > 0), first[lane] + place, -1)
    return found.astype(np.int64)


def _placed_before(strips: Strips, beside: IntArray) -> IntArray:
    """Nodes beside, or ahead of these, that have fewer nodes ahead than the node itself."""
    hops = np.zeros(len(strips.ahead), dtype=np.int64)
    for place, row in enumerate(strips.rows):
        hops[row] = place
    found = beside.copy()
    for _ in range(len(strips.rows)):
        late = (found >= 0) & (hops[np.maximum(found, 0)] >= hops[:, None])
        if not late.any():
            break
        found[late] = strips.ahead[found[late]]
    return found


def _strip_end_features(lanes: LaneGraph, strips: Strips, flow: FloatArray) -> list[FloatArray]:
    """What comes at the last node of each strip, for all nodes; shapes ``(N,)``.

    Whether a junction follows, the sharpest and least turns there, whether several ways lead on,
    the share of this road in the busiest that comes into the junction, how much traffic the others
    bring, and on how many lanes all of it comes.
    """
    count = len(lanes.x)
    follows = lanes.relation == Relation.SUCCESSOR
    source, target = lanes.source[follows], lanes.target[follows]
    enters = strips.on_road[source] & ~strips.on_road[target]
    source, target = source[enters], target[enters]
    exits = _lane_exits(lanes, target)
    turn = np.abs(np.angle(np.exp(1j * (lanes.hdg[exits] - lanes.hdg[source]))))
    most, least, ways = np.zeros(count), np.full(count, np.pi), np.zeros(count)
    np.maximum.at(most, source, turn)
    np.minimum.at(least, source, turn)
    np.add.at(ways, source, 1.0)
    junction = np.array(
        [
            -1 if name is None else hash_row
            for name, hash_row in _number_names(lanes.lanes.junctions)
        ]
    )
    at = np.full(count, -1, dtype=np.int64)
    at[source] = junction[lanes.lane[target]]
    busiest = np.zeros(max(int(junction.max(initial=0)) + 1, 1))
    held = at >= 0
    np.maximum.at(busiest, at[held], flow[held])
    share = np.where(held, flow / np.maximum(busiest[np.maximum(at, 0)], 1e-9), 1.0)
    least = np.where(ways > 0, least, 0.0)
    total = np.bincount(at[held], weights=flow[held], minlength=len(busiest))
    lanes_in = np.bincount(at[held], minlength=len(busiest))
    others = np.where(held, np.maximum(total[np.maximum(at, 0)] - flow, 0.0), 0.0)
    many = np.where(held, lanes_in[np.maximum(at, 0)], 0)
    return [
        held.astype(np.float64),
        most / np.pi,
        least / np.pi,
        np.minimum(ways, 4) / 4,
        share,
        np.log(0.1 + others) / 2.0,
        np.minimum(many, 12) / 12,
    ]


def _flow_behind(ways: Ways, flow: FloatArray) -> FloatArray:
    """Most traffic on a lane that the strip leads to, where it merges with that of others."""
    most = np.zeros(len(flow))
    np.maximum.at(most, ways.root, flow[ways.entry])
    found: FloatArray = np.log(0.1 + most) / 2.0
    return found


def _number_names(names: tuple[str | None, ...]) -> list[tuple[str | None, int]]:
    rows = {name: row for row, name in enumerate(dict.fromkeys(names))}
    return [(name, rows[name]) for name in names]


def _lane_exits(lanes: LaneGraph, nodes: Int32Array) -> IntArray:
    """Last nodes of the lanes of nodes."""
    return (lanes.lanes.first_node[1:] - 1)[lanes.lane[nodes]].astype(np.int64)


def _bend_ahead(lanes: LaneGraph, strips: Strips) -> FloatArray:
    """Sharpest curvature within about 30 m ahead on the strip, 1/m."""
    sharpest = np.abs(lanes.curvature)
    at = strips.ahead.copy()
    for _ in range(int(30.0 / max(lanes.spacing, 0.5))):
        there = np.maximum(at, 0)
        sharpest = np.where(at >= 0, np.maximum(sharpest, np.abs(lanes.curvature[there])), sharpest)
        at = np.where(at >= 0, strips.ahead[there], -1)
    return sharpest
