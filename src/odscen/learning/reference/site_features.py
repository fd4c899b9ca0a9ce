"""What the model knows of a place: the road, the light ahead, and the traffic ahead.

Columns are numbers of about the size of one. A feature with bends is a row of ``min(value, c) / c``
for several ``c``, of which a small network makes any smooth curve.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.lanegraph.graphs import Relation
from odscen.learning.reference.beyond_junctions import Ways, beyond_columns
from odscen.learning.reference.expected_flow import expected_flows
from odscen.learning.reference.junction_approaches import approaches
from odscen.learning.reference.road_strips import Strips, road_strips
from odscen.learning.reference.stop_lines import setbacks
from odscen.learning.traffic_snapshots import SignalAhead

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, Int32Array, IntArray
    from odscen.lanegraph.graphs import LaneGraph, PedestrianGraph
    from odscen.learning.reference.gap_states import GapStates
    from odscen.learning.traffic_snapshots import LightView

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
    ends = _ends(lanes, strips, flow)
    ways, more = approaches(lanes, strips.on_road, limit=limit, flow=flow)
    bend = _bend_ahead(lanes, strips)
    columns = np.column_stack(
        [
            *_hinges(to_line, _TO_END),
            np.minimum(setback, 8.0) / 8.0,
            (setback > 0.0) & (strips.to_end < setback),
            *_hinges(strips.from_start, _FROM_START),
            limit / 15.0,
            np.isnan(lanes.speed_limit),
            rights / 3.0,
            lefts / 3.0,
            rights == 0,
            lefts == 0,
            np.minimum(np.abs(lanes.curvature) * 30.0, 1.0),
            np.minimum(bend * 30.0, 1.0),
            *(np.log(0.1 + one) / 2.0 for one in (flows.road[lanes.lane], flow)),
            *(one[strips.root] for one in (*ends, *more, _flow_behind(ways, flow))),
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
    times = [on * column for on in (green, red) for column in _hinges(since, _SINCE)]
    line = [red * column for column in _hinges(site.to_line, _TO_LINE)]
    return np.column_stack([*shown, *times, *line]).astype(np.float64)


def traffic_columns(site: Site, states: GapStates, nodes: IntArray) -> FloatArray:
    """Features of the traffic ahead of nodes, on their lanes and those beside; one row for each."""
    own = _ahead(states, nodes)
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
        columns += [np.where(beside >= 0, one, 0.0) for one in seen]
    return np.column_stack(columns).astype(np.float64)


def junction_columns(site: Site, states: GapStates) -> FloatArray:
    """Features of the traffic behind the junction ahead, for all nodes: ``(N, 8)``."""
    return beyond_columns(site.ways, states)[site.strips.root]


def _ahead(states: GapStates, nodes: IntArray) -> list[FloatArray]:
    gap, leader = states.gap[nodes], states.leader[nodes]
    seen = leader >= 0
    close = np.exp(-gap / 25.0) * seen
    speed = np.where(seen, leader, 0.0)
    queue = states.queue[nodes]
    return [
        *_hinges(np.maximum(gap, 0.0), _GAPS),
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


def _hinges(values: FloatArray, bends: tuple[float, ...]) -> list[FloatArray]:
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


def _ends(lanes: LaneGraph, strips: Strips, flow: FloatArray) -> list[FloatArray]:
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
        [-1 if name is None else hash_row for name, hash_row in _numbered(lanes.lanes.junctions)]
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


def _numbered(names: tuple[str | None, ...]) -> list[tuple[str | None, int]]:
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
