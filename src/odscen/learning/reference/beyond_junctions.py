"""What a driver sees of the traffic behind the junction ahead: room, and who is next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.learning.reference.gap_states import FREE
from odscen.learning.traffic_snapshots import STOPPED

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray, IntArray
    from odscen.learning.reference.gap_states import GapStates

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
        *(_mean(ways.root, one, count) for one in means),
    ]
    found: FloatArray = np.column_stack(columns)
    return found


def _mean(root: IntArray, values: FloatArray, count: int) -> FloatArray:
    total = np.bincount(root, weights=values, minlength=count)
    found: FloatArray = total / np.maximum(np.bincount(root, minlength=count), 1)
    return found
