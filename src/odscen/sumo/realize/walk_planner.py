"""From a path on the pedestrian graph to the edges of a SUMO walk."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.sumo.realize.road_net import PEDESTRIAN
from odscen.sumo.realize.route_planner import NoRouteError, connected

if TYPE_CHECKING:
    from odscen.base.arrays import Int32Array
    from odscen.lanegraph.graphs import PedestrianGraph
    from odscen.sumo.realize.road_net import RoadNet, RoadNetLane
    from odscen.sumo.realize.route_planner import NodePositions, RouteRepair


ALONG = 0.5
"""Share of an edge that a path must cover to be walking along it, not only touching it."""


@dataclass(frozen=True, slots=True)
class Walk:
    """A SUMO walk; ``depart_pos`` is where the front of the body is.

    ``depart_pos_lat`` counts from the lane that SUMO's pedestrians use, which may be another one of
    the edge than that of the spawn.
    """

    edges: tuple[str, ...]
    depart_pos: float
    depart_pos_lat: float
    arrival_pos: float
    repairs: tuple[RouteRepair, ...] = ()


class WalkPlanner:
    """Walks on one map; :mod:`odscen.sumo.realize.route_planner` does the same for vehicles."""

    def __init__(self, graph: PedestrianGraph, net: RoadNet, places: NodePositions) -> None:
        self._graph = graph
        self._net = net
        self._places = places

    def plan(self, path: Int32Array, *, length: float, lateral_offset: float) -> Walk:
        """Walk along a path of the pedestrian graph.

        Parameters
        ----------
        path
            Nodes from spawn to goal, both included.
        length
            Of the body, metres.
        lateral_offset
            Metres to the left, looking along growing s.

        Raises
        ------
        NoRouteError
            If the SUMO network has no path to walk there.
        """
        start = self._place_on_lane(int(path[0]), "spawn")
        end = self._place_on_lane(int(path[-1]), "goal")
        edges, repairs = connected(self._net, self._edges_of_path(path), PEDESTRIAN)
        onwards = self._direction_of_start(start, end, edges)
        front = start[1] + length / 2.0 * onwards * self._places.scales[start[0].id]
        walked = self._net.walked_lane(start[0].edge) or start[0]
        aside = self._net.left_of(start[0], walked)
        return Walk(
            edges=edges,
            depart_pos=min(max(front, 0.0), start[0].length),
            depart_pos_lat=aside + lateral_offset * self._direction_along(int(path[0]), start),
            arrival_pos=min(max(end[1], 0.0), end[0].length),
            repairs=repairs,
        )

    def _place_on_lane(self, node: int, what: str) -> tuple[RoadNetLane, float]:
        place = self._places.of(node)
        if place is None:
            raise NoRouteError(f"the SUMO network has nothing to walk on at the {what}")
        lane = self._net.lanes[place[0]]
        if lane.internal or not lane.allows(PEDESTRIAN):
            raise NoRouteError(
                f"lane {lane.id} of the SUMO network at the {what} is not for walking"
            )
        return lane, place[1]

    def _edges_of_path(self, path: Int32Array) -> list[str]:
        """Return the edges that the path walks along, in order.

        An edge that is only touched, at a corner between two crosswalks, is left out: SUMO would
        have it walked to its other end. SUMO finds the path across a junction by itself.
        """
        rows = self._places.lane[path]
        starts = np.flatnonzero(np.diff(rows, prepend=-2))
        ends = np.append(starts[1:], len(rows)) - 1
        edges: list[str] = []
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
            if rows[start] < 0:
                continue
            lane = self._net.lanes[self._places.lanes[int(rows[start])]]
            if lane.internal or not lane.allows(PEDESTRIAN) or lane.edge in edges[-1:]:
                continue
            walked = abs(float(self._places.pos[path[end]] - self._places.pos[path[start]]))
            if start == 0 or end == len(rows) - 1 or walked >= ALONG * lane.length:
                edges.append(lane.edge)
        return edges

    def _direction_along(self, node: int, start: tuple[RoadNetLane, float]) -> float:
        """Return 1 if the SUMO lane at a node runs with growing s, -1 if against it."""
        row = int(self._graph.lane[node])
        first, end = (int(n) for n in self._graph.first_node[row : row + 2])
        for other in (node + 1, node - 1):
            place = self._places.of(other) if first <= other < end else None
            if place is not None and place[0] == start[0].id and place[1] != start[1]:
                return float(np.sign(place[1] - start[1])) * (other - node)
        return 1.0

    def _direction_of_start(
        self,
        start: tuple[RoadNetLane, float],
        end: tuple[RoadNetLane, float],
        edges: tuple[str, ...],
    ) -> float:
        """Return 1 if SUMO's walk begins along its first edge, -1 if against it."""
        if len(edges) == 1:
            return 1.0 if end[1] >= start[1] else -1.0
        nowhere = ("", "")
        come_from, go_to = self._net.ends.get(edges[0], nowhere)
        others = self._net.ends.get(edges[1], nowhere)
        if (go_to in others) != (come_from in others):
            return 1.0 if go_to in others else -1.0
        # Two sides of one street: SUMO takes the shorter way round.
        there = start[0].length - start[1]
        onwards = end[1] if go_to == others[0] else end[0].length - end[1]
        return 1.0 if there + onwards <= start[1] + end[0].length - onwards else -1.0
