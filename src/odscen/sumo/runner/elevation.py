"""How high the road is, and how steep: what a flat SUMO network does not know.

The lane graph has heights and slopes every few metres. Which of several roads above each other is
meant, the lane says that SUMO has the road user on, not the nearest point. Cross slope is left out:
road users stand level from side to side.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from odscen.base.frames import SumoPose, XodrPose, sumo_to_xodr
from odscen.base.ids import Roadside

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from odscen.convert.lane_table.table import LaneTable
    from odscen.lanegraph.graphs import MapGraph

    FloatArray = NDArray[np.float64]

_NEIGHBOURS = 12
"""Nodes looked at around a place; lanes side by side have two or three each."""
_REACH = 15.0
"""Metres from a node beyond which nothing is known of the ground."""
_STOREY = 2.0
"""Metres of height by which a node may differ from what the lane says, plus a steep slope's."""
_STEEP = 0.3
_ASTRAY = 6.0
"""Metres that a node of the other graph costs: a long vehicle that turns sweeps over the kerb, and
does not stand on it."""


class GroundSlope(NamedTuple):
    """Height (metres) and slope of the ground in a direction (radians, positive uphill)."""

    z: FloatArray
    pitch: FloatArray


class ElevationLookup:
    """Heights of one map.

    Parameters
    ----------
    graph, table
        Of the map.
    """

    def __init__(self, graph: MapGraph, table: LaneTable) -> None:
        lanes, walks = graph.lanes, graph.walks
        walk_lane = walks.lane.astype(np.int64) + len(lanes.lanes.keys)
        walk_pitch = _walk_slopes(walk_lane, walks.s, walks.z)
        self._lane = np.concatenate([lanes.lane.astype(np.int64), walk_lane])
        self._xy = np.column_stack(
            [np.concatenate([lanes.x, walks.x]), np.concatenate([lanes.y, walks.y])]
        )
        self._z = np.concatenate([lanes.z, walks.z])
        self._hdg = np.concatenate([lanes.hdg, walks.hdg])
        self._pitch = np.concatenate([lanes.pitch, walk_pitch])
        self._tree = cKDTree(self._xy) if len(self._z) else None
        self._heights = _lane_heights(graph, table)
        self._walk = np.arange(len(self._z)) >= len(lanes.x)
        self._flat = bool(np.ptp(self._z) < 1e-9) if len(self._z) else True

    def height(self, lane: str, pos: float) -> float | None:
        """Height of the middle of a SUMO lane, ``None`` where the map does not say."""
        known = self._heights.get(lane)
        if known is None:
            return None
        return float(np.interp(pos, *known))

    def lie(
        self,
        x: FloatArray,
        y: FloatArray,
        hdg: FloatArray,
        near_z: FloatArray,
        walks: NDArray[np.bool_],
    ) -> GroundSlope:
        """Ground at places; shape ``(N,)`` each.

        Parameters
        ----------
        x, y, hdg
            OpenDRIVE frame.
        near_z
            About how high; NaN if that is unknown.
        walks
            Who is on foot.
        """
        if self._flat or self._tree is None:
            z = self._z[0] if len(self._z) else 0.0
            return GroundSlope(np.full(len(x), z), np.zeros(len(x)))
        count = min(_NEIGHBOURS, len(self._z))
        far, node = self._tree.query(np.column_stack([x, y]), k=count, distance_upper_bound=_REACH)
        far = np.asarray(far).reshape(len(x), count)
        node = np.asarray(node).reshape(len(x), count)
        known = np.isfinite(far)
        node = np.where(known, node, 0)
        off = np.abs(self._z[node] - near_z[:, None])
        # NaN compares as false: without a height to go by, every node will do.
        elsewhere = off > _STOREY + _STEEP * np.where(known, far, 0.0)
        cost = np.where(known, far + np.where(elsewhere, 1e3 + off, 0.0), np.inf)
        cost += _direction_cost(hdg[:, None], self._hdg[node])
        cost += np.where(self._walk[node] != walks[:, None], _ASTRAY, 0.0)
        best = np.argmin(cost, axis=1)
        own = node[np.arange(len(x)), best]
        lie = self._interpolate_between(own, x, y, hdg)
        lost = ~known.any(axis=1)
        return GroundSlope(
            np.where(lost, np.where(np.isnan(near_z), 0.0, near_z), lie.z),
            np.where(lost, 0.0, lie.pitch),
        )

    def centres(
        self,
        front: SumoPose,
        length: FloatArray,
        net_offset: tuple[float, float],
        z: FloatArray,
        walks: NDArray[np.bool_],
    ) -> XodrPose:
        """Body centres of road users of whom SUMO knows the front; ``z`` is about how high."""
        level = sumo_to_xodr(front, length=length, net_offset=net_offset)
        arrays = [np.asarray(part, dtype=np.float64) for part in level[:4]]
        lie = self.lie(arrays[0], arrays[1], arrays[3], z, walks)
        pose = sumo_to_xodr(
            SumoPose(front.x, front.y, 0.0, front.angle_deg, lie.pitch),
            length=length,
            net_offset=net_offset,
        )
        return XodrPose(pose.x, pose.y, lie.z, pose.hdg, lie.pitch)

    def _interpolate_between(
        self, node: NDArray[np.int64], x: FloatArray, y: FloatArray, hdg: FloatArray
    ) -> GroundSlope:
        """Between a node and the next one on the same lane, that way or the other."""
        ahead = np.cos(self._hdg[node]) * (x - self._xy[node, 0])
        ahead += np.sin(self._hdg[node]) * (y - self._xy[node, 1])
        other = np.clip(node + np.where(ahead >= 0, 1, -1), 0, len(self._z) - 1)
        step = np.hypot(*(self._xy[other] - self._xy[node]).T)
        usable = (self._lane[other] == self._lane[node]) & (step > 1e-6)
        share = np.where(usable, np.minimum(np.abs(ahead) / np.where(usable, step, 1.0), 1.0), 0.0)
        # The cubic that has the heights and slopes of both nodes: roads are cubics themselves.
        sense = np.where(ahead >= 0, 1.0, -1.0)
        rise, fall = np.tan(self._pitch[node]) * sense, np.tan(self._pitch[other]) * sense
        climb = np.where(
            usable, (self._z[other] - self._z[node]) / np.where(usable, step, 1.0), 0.0
        )
        bend, twist = 3 * climb - 2 * rise - fall, rise + fall - 2 * climb
        cubic = self._z[node] + step * share * (rise + share * (bend + share * twist))
        along = self._z[node] + np.tan(self._pitch[node]) * ahead
        z = np.where(usable, cubic, along)
        steep = rise + share * (2 * bend + share * 3 * twist)
        slope = np.arctan(np.where(usable, steep, rise) * sense)
        turn = hdg - self._hdg[node]
        return GroundSlope(z, np.arctan(np.tan(slope) * np.cos(turn)))


def _direction_cost(one: FloatArray, other: FloatArray) -> FloatArray:
    """Metres that a direction costs: of two lanes that cross, the one along is meant.

    Lanes of opposite direction are the same ground.
    """
    return 2.0 * np.abs(np.sin(one - other))


def _walk_slopes(lane: NDArray[np.int64], s: FloatArray, z: FloatArray) -> FloatArray:
    """Slope at nodes of walks, from the heights of their neighbours."""
    pitch = np.zeros(len(z))
    if len(z) < 2:
        return pitch
    same = (lane[1:] == lane[:-1]) & (np.abs(np.diff(s)) > 1e-6)
    rise = np.where(same, np.diff(z) / np.where(same, np.diff(s), 1.0), 0.0)
    total, count = np.zeros(len(z)), np.zeros(len(z))
    for part in (slice(0, -1), slice(1, None)):
        total[part] += rise
        count[part] += same
    return np.arctan(total / np.maximum(count, 1.0))


def _lane_heights(graph: MapGraph, table: LaneTable) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Positions along each SUMO lane, ascending, and heights there."""
    heights: dict[str, tuple[FloatArray, FloatArray]] = {}
    lanes, walks = graph.lanes, graph.walks
    walk_keys = [
        Roadside(*key) if beside else key
        for key, beside in zip(walks.lane_keys, walks.roadside, strict=True)
    ]
    for names, lane, s, z in (
        (lanes.lanes.keys, lanes.lane, lanes.s, lanes.z),
        (walk_keys, walks.lane, walks.s, walks.z),
    ):
        places = table.sumo_places(names, lane, s)
        order = np.lexsort((places.pos, places.lane))
        order = order[places.lane[order] >= 0]
        rows = places.lane[order]
        cuts = np.flatnonzero(np.diff(rows)) + 1
        for part in np.split(order, cuts) if len(order) else ():
            name = table.lane_list[int(places.lane[part[0]])].id
            heights.setdefault(str(name), (places.pos[part], z[part]))
    return heights
