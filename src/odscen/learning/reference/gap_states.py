"""What a driver sees of the traffic ahead on the strip, and behind the junction ahead.

The states of a row of nodes follow from those of the nodes ahead of them and from what is on these,
so that traffic can be described, and placed, row after row from the stop lines backwards.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.categories import DEFAULT_BODY, Category
from odscen.learning.traffic_snapshots import STOPPED

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray, IntArray
    from odscen.lanegraph.graphs import ByteArray, LaneGraph
    from odscen.learning.reference.road_strips import Strips
    from odscen.learning.traffic_snapshots import Snapshot


FREE = 150.0
"""Metres; a longer gap counts as none ahead."""
NEAR, FAR = 30.0, 120.0
"""Metres over which the weight of a vehicle ahead falls to 1/e in the two counts of vehicles."""
HALF_LENGTHS = np.array([DEFAULT_BODY[category].length / 2.0 for category in Category])


@dataclass(frozen=True, slots=True, eq=False)
class GapStates:
    """What is ahead of each node on its strip; arrays have shape ``(N,)``.

    Attributes
    ----------
    gap
        Metres from the node to the rear of the next vehicle, at most :data:`FREE`.
    leader
        Its speed, m/s; -1 without one.
    queue
        Number of stopped vehicles in a row right ahead.
    near, far
        Vehicles ahead, each weighted by ``exp(-distance / NEAR)`` or ``exp(-distance / FAR)``.
    speed
        Of the vehicle on the node, m/s; NaN without one.
    half
        Half its length, metres.
    """

    gap: FloatArray
    leader: FloatArray
    queue: FloatArray
    near: FloatArray
    far: FloatArray
    speed: FloatArray
    half: FloatArray

    @classmethod
    def empty(cls, count: int) -> GapStates:
        """States of a map without vehicles."""
        return cls(
            gap=np.full(count, FREE),
            leader=np.full(count, -1.0),
            queue=np.zeros(count),
            near=np.zeros(count),
            far=np.zeros(count),
            speed=np.full(count, np.nan),
            half=np.zeros(count),
        )

    def put(self, nodes: IntArray, category: IntArray, speed: FloatArray) -> None:
        """Put vehicles on nodes; what is behind them has to be told with :meth:`advance`."""
        self.speed[nodes] = speed
        self.half[nodes] = HALF_LENGTHS[category]

    def advance(self, strips: Strips, row: IntArray) -> None:
        """Bring a row of nodes up to date with what is ahead of it."""
        onwards = row[strips.ahead[row] >= 0]
        there, step = strips.ahead[onwards], strips.step[onwards]
        speed, taken = self.speed[there], ~np.isnan(self.speed[there])
        gap = np.where(taken, step - self.half[there], np.minimum(self.gap[there] + step, FREE))
        self.gap[onwards] = gap
        leader = np.where(taken, speed, self.leader[there])
        self.leader[onwards] = np.where(gap >= FREE, -1.0, leader)
        queue = self.queue[there]
        self.queue[onwards] = np.where(taken, np.where(speed < STOPPED, queue + 1.0, 0.0), queue)
        for column, reach in ((self.near, NEAR), (self.far, FAR)):
            column[onwards] = (column[there] + taken) * np.exp(-step / reach)


def gap_states(
    strips: Strips, *, node: IntArray, category: IntArray, speed: FloatArray
) -> GapStates:
    """States of a map with vehicles; those inside junctions are not seen.

    Parameters
    ----------
    node, category, speed
        Of each vehicle; speeds in m/s.
    """
    states = GapStates.empty(len(strips.ahead))
    states.put(node, category, speed)
    for row in strips.rows:
        states.advance(strips, row)
    return states


def seen_ahead(lanes: LaneGraph, strips: Strips, snapshot: Snapshot) -> tuple[IntArray, ByteArray]:
    """Stopped vehicles right ahead of each vehicle, and what the light ahead shows it.

    Returns
    -------
    tuple of arrays
        Counts, and :class:`~odscen.learning.traffic_snapshots.SignalAhead`.
    """
    states = gap_states(
        strips, node=snapshot.node, category=snapshot.category, speed=snapshot.speed
    )
    root = strips.root[snapshot.node]
    return (
        states.queue[snapshot.node].astype(np.int64),
        snapshot.lights.state[lanes.lane[root]],
    )


COLUMNS = 8
_ROOM = (15.0, 35.0, 80.0)


@dataclass(frozen=True, slots=True, eq=False)
class Ways:
    """Ways through junctions, from strip to strip; arrays have shape ``(W,)``.

    Attributes
    ----------
    root
        Last node before the junction.
    entry
        First node behind it.
    metres
        Between them.
    """

    root: IntArray
    entry: IntArray
    metres: FloatArray


def beyond_columns(ways: Ways, states: GapStates) -> FloatArray:
    """Features of the last nodes of strips, ``(N, 8)``; 0 elsewhere.

    Least and mean room to the next vehicle, how many of the ways have a stopped one near, the
    slowest speed near, queues and vehicles near, as the mean over the ways.
    """
    entry = ways.entry
    taken = ~np.isnan(states.speed[entry])
    gap = np.where(taken, -states.half[entry], states.gap[entry]) + ways.metres
    speed = np.where(taken, states.speed[entry], states.leader[entry])
    seen = speed >= 0.0
    room = np.where(seen, np.clip(gap, 0.0, FREE), FREE)
    stands = (seen & (speed < STOPPED)).astype(np.float64)
    near: FloatArray = np.minimum(states.near[entry] + taken, 4.0) / 4.0
    behind = states.queue[entry]
    queue = np.where(taken, np.where(speed < STOPPED, behind + 1.0, 0.0), behind)
    count = len(states.gap)
    least = np.full(count, FREE)
    np.minimum.at(least, ways.root, room)
    pace = np.where(room < _ROOM[-1], np.maximum(speed, 0.0) / 15.0, 1.0)
    slowest = np.ones(count)
    np.minimum.at(slowest, ways.root, pace)
    means = (
        np.exp(-room / 30.0),
        stands * np.exp(-room / 20.0),
        near,
        np.minimum(queue, 8.0) / 8.0,
    )
    columns = [
        *(1.0 - np.minimum(least, bend) / bend for bend in _ROOM),
        1.0 - slowest,
        *(_mean_by_root(ways.root, array, count) for array in means),
    ]
    found: FloatArray = np.column_stack(columns)
    return found


def _mean_by_root(root: IntArray, values: FloatArray, count: int) -> FloatArray:
    total = np.bincount(root, weights=values, minlength=count)
    found: FloatArray = total / np.maximum(np.bincount(root, minlength=count), 1)
    return found
