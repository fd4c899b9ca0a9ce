"""Travel times on the lane graph: in free flow, and as a run measured them.

The unit is seconds along each edge of the lane graph. A SUMO edge has one speed for all of its
lanes: who compares lanes finds the empty one fastest, but has to leave it before the junction.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.categories import Category
from odscen.sumo.realize.driving import KINDS

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.lanegraph.graphs import LaneGraph
    from odscen.sumo.realize.road_net import RoadNetLane
    from odscen.sumo.realize.sumo_map import SumoMap
    from odscen.sumo.realize.traffic_measures.measure_actions import ClosedLanes

UNKNOWN_LIMIT = 13.89
"""m/s assumed where the map gives no limit: 50 km/h."""
SLOWEST = 0.1
"""m/s taken at least, where vehicles were stopped for a whole interval."""

CAR = KINDS[Category.CAR].vclass

EdgeUse = tuple[float, str, float, float]
"""Begin of an interval (s), SUMO edge, vehicle-seconds and vehicle-metres on it."""


@dataclass(frozen=True, slots=True, eq=False)
class TravelTimes:
    """Seconds along the edges of the lane graph, by the time of day in the run.

    Attributes
    ----------
    interval
        Seconds; the first begins at 0, the last goes on for ever.
    costs
        Shape ``(K, E)``: seconds of each edge in each interval.
    """

    interval: float
    costs: FloatArray

    def row(self, depart: FloatArray) -> Int32Array:
        """Interval of each departure."""
        rows = np.floor(depart / self.interval).astype(np.int32)
        return np.clip(rows, 0, len(self.costs) - 1)


def free_flow_costs(lanes: LaneGraph) -> FloatArray:
    """Seconds along each edge of the lane graph at the limit, shape ``(E,)``."""
    return np.asarray(lanes.length * _free_pace(lanes)[lanes.source], dtype=np.float64)


def _free_pace(lanes: LaneGraph) -> FloatArray:
    """Seconds per metre at the limit of each node, shape ``(N,)``."""
    limit = lanes.speed_limit
    return np.asarray(1.0 / np.where(np.isfinite(limit), limit, UNKNOWN_LIMIT))


class TimedNetwork:
    """Travel times of one map.

    Parameters
    ----------
    sumo_map
        The map.
    """

    def __init__(self, sumo_map: SumoMap) -> None:
        self._map = sumo_map

    def measured(
        self,
        uses: Iterable[EdgeUse],
        *,
        until: float,
        interval: float,
        closings: Sequence[ClosedLanes] = (),
    ) -> TravelTimes:
        """Travel times from what vehicles spent on SUMO's edges.

        One vehicle in free flow is added to those measured, so that a single one that waited at a
        red light does not make an edge impassable. Where all lanes are closed to cars for at least
        half of an interval, nothing is quick in it.
        """
        count = max(1, int(np.ceil(until / interval)))
        seconds = np.zeros((count, len(self._edge_names)))
        metres = np.zeros_like(seconds)
        for begin, edge, spent, driven in uses:
            column = self._column_of_edge.get(edge)
            if column is not None:
                row = min(int(begin // interval), count - 1)
                seconds[row, column] += spent
                metres[row, column] += driven
        pace = (seconds + self._edge_length / self._edge_speed) / (metres + self._edge_length)
        pace = np.minimum(pace, 1.0 / SLOWEST)
        for row in range(count):
            pace[row, self._closed_columns(closings, row * interval, (row + 1) * interval)] = (
                1.0 / SLOWEST
            )
        lanes = self._map.graph.lanes
        own = np.where(self._edge_of_node >= 0, pace[:, self._edge_of_node], 0.0)
        of_node = np.maximum(own, _free_pace(lanes))
        return TravelTimes(interval, lanes.length * of_node[:, lanes.source])

    def _closed_columns(
        self, closings: Sequence[ClosedLanes], begin: float, end: float
    ) -> list[int]:
        lanes = {
            lane
            for closing in closings
            if CAR in closing.banned
            and min(closing.end, end) - max(closing.begin, begin) >= 0.5 * (end - begin)
            for lane in closing.lanes
        }
        edges = sorted({self._map.net.lanes[lane].edge for lane in lanes})
        every = self._map.net.edge_lanes
        return [
            self._column_of_edge[edge]
            for edge in edges
            if all(lane.id in lanes for lane in every[edge] if lane.allows(CAR))
        ]

    @cached_property
    def _edge_names(self) -> list[str]:
        return sorted({lane.edge for lane in self._map.net.lanes.values()})

    @cached_property
    def _column_of_edge(self) -> dict[str, int]:
        return {edge: column for column, edge in enumerate(self._edge_names)}

    @cached_property
    def _edge_length(self) -> FloatArray:
        return np.array([max(self._first_lane(edge).length, 0.1) for edge in self._edge_names])

    @cached_property
    def _edge_speed(self) -> FloatArray:
        return np.array(
            [self._first_lane(edge).speed or UNKNOWN_LIMIT for edge in self._edge_names]
        )

    def _first_lane(self, edge: str) -> RoadNetLane:
        return self._map.net.edge_lanes[edge][0]

    @cached_property
    def _edge_of_node(self) -> Int32Array:
        places = self._map.lane_places
        of_lane = [self._column_of_edge[self._map.net.lanes[name].edge] for name in places.lanes]
        return np.where(places.lane >= 0, np.array(of_lane, dtype=np.int32)[places.lane], -1)


class EdgeSteps:
    """Finds the edges of the lane graph that a path leads over."""

    def __init__(self, lanes: LaneGraph) -> None:
        self._nodes = len(lanes.x)
        key = lanes.source.astype(np.int64) * self._nodes + lanes.target
        self._order = np.lexsort((lanes.length, key))  # of parallel edges the shortest
        self._keys = key[self._order]

    def of(self, path: Int32Array) -> Int32Array:
        """Edges of a path of at least one node, shape ``(len(path) - 1,)``."""
        wanted = path[:-1].astype(np.int64) * self._nodes + path[1:]
        return self._order[np.searchsorted(self._keys, wanted)].astype(np.int32)


def path_costs(times: TravelTimes, steps: Sequence[Int32Array], rows: Int32Array) -> FloatArray:
    """Seconds of each path with the travel times of its interval, shape ``(len(steps),)``."""
    return np.array(
        [times.costs[row, edges].sum() for edges, row in zip(steps, rows.tolist(), strict=True)]
    )
