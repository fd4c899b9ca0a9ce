"""Speeds at which vehicles that are put on the road can all stop behind those ahead.

The bound is Krauss's safe speed (Krauss, S., 1998: Microscopic modeling of traffic flow), which
SUMO's car following keeps as well:

    v <= -b tau + sqrt((b tau)^2 + u^2 + 2 b g)

with u the speed of the vehicle ahead, g the gap to it, deceleration b and reaction time tau.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from odscen.lanegraph.graphs import Relation

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from odscen.base.arrays import FloatArray
    from odscen.lanegraph.graphs import LaneGraph

DECELERATION = 4.5
"""m/s², SUMO's of a car."""
REACTION = 1.0
"""Seconds."""
STANDING_GAP = 1.0
"""Metres that are left when all have stopped."""
SIGHT = 120.0
"""Metres that are looked ahead."""


def safe_speeds(
    lanes: LaneGraph, *, nodes: Sequence[int], lengths: Sequence[float], speeds: Sequence[float]
) -> list[float]:
    """Lower speeds that are too fast for the vehicle ahead on the lanes that a vehicle may follow.

    Parameters
    ----------
    nodes, lengths, speeds
        Of each vehicle: the node under its centre, metres, and the speed that is wanted, m/s.

    Returns
    -------
    list of float
        At most the speeds that are wanted, m/s.
    """
    on = dict(zip(nodes, range(len(nodes)), strict=True))
    onwards = _LaneLeads(lanes)
    ahead = [
        onwards.first(node, on, within=SIGHT) if speed > 0.0 else []
        for node, speed in zip(nodes, speeds, strict=True)
    ]
    found = list(speeds)
    changed = True
    while changed:  # whoever is lowered lowers those behind
        changed = False
        for k, leaders in enumerate(ahead):
            for metres, other in leaders:
                gap = metres - (lengths[k] + lengths[other]) / 2.0 - STANDING_GAP
                bound = float(safe_speed(gap, found[other]))
                if bound < found[k] - 1e-9:
                    found[k], changed = bound, True
    return found


def safe_speed(gap: float | FloatArray, ahead: float | FloatArray) -> Any:
    """Krauss's safe speed, m/s: of a gap in metres and the speed of the vehicle ahead."""
    lost = DECELERATION * REACTION
    root = np.sqrt(lost**2 + ahead**2 + 2.0 * DECELERATION * np.maximum(gap, 0.0))
    return np.maximum(root - lost, 0.0)


class _LaneLeads:
    """Where lanes lead, node by node."""

    def __init__(self, lanes: LaneGraph) -> None:
        follows = np.flatnonzero(lanes.relation == Relation.SUCCESSOR)
        source = lanes.source[follows]
        order = np.argsort(source, kind="stable")
        self._edges = follows[order]
        self._first = np.searchsorted(source[order], np.arange(len(lanes.x) + 1))
        self._target, self._length = lanes.target, lanes.length

    def first(
        self, node: int, vehicles: dict[int, int], *, within: float
    ) -> list[tuple[float, int]]:
        """Metres to the first vehicle on each way ahead, and which it is."""
        found: dict[int, float] = {}
        seen = {node: 0.0}
        ways = [(node, 0.0)]
        while ways:
            here, metres = ways.pop()
            for edge in self._edges[self._first[here] : self._first[here + 1]].tolist():
                there, far = int(self._target[edge]), metres + float(self._length[edge])
                if far > within or far >= seen.get(there, math.inf):
                    continue
                seen[there] = far
                if there in vehicles:
                    other = vehicles[there]
                    found[other] = min(far, found.get(other, math.inf))
                else:
                    ways.append((there, far))
        return sorted((metres, other) for other, metres in found.items())
