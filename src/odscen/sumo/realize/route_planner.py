"""From a path on the lane graph to a SUMO route: edges, where it departs, where it arrives.

The centre of the body is to be on the spawn node; SUMO's ``departPos`` is where the front is, half
a body further on. Near the end of a lane that place is on the next one, which may be an internal
lane of a junction: the route then starts with it. How far along is counted from the last node of
the spawn's lane that lies on a normal SUMO lane, and followed through the links of the route,
because several internal lanes overlap where they begin and geometry alone cannot tell them apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.lanegraph.graphs import LaneGraph
    from odscen.sumo.realize.road_net import RoadNet, RoadNetLane


DETOUR = 60.0
"""Metres of road that a repair of a route may put between two of its edges."""


CLAMP = 0.05
"""Metres that a front may be set back so that it stays on its lane."""


class NoRouteError(Exception):
    """Somebody cannot get from spawn to goal on the SUMO network; the message says why."""


@dataclass(frozen=True, eq=False)
class NodePositions:
    """Where the nodes of a graph are on the SUMO network.

    Attributes
    ----------
    lanes
        Ids of SUMO lanes.
    lane
        Shape ``(N,)``: row of ``lanes`` for each node, -1 where the network has nothing there.
    pos
        Shape ``(N,)``: metres along that lane.
    deviation
        Shape ``(N,)``: metres between the centres of the two lanes there; NaN without a lane.
    scale
        Shape of ``lanes``: metres of position per metre on the ground.
    """

    lanes: tuple[str, ...]
    lane: Int32Array
    pos: FloatArray
    deviation: FloatArray
    scale: FloatArray

    def of(self, node: int) -> tuple[str, float] | None:
        """SUMO lane and position of a node."""
        row = int(self.lane[node])
        return None if row < 0 else (self.lanes[row], float(self.pos[node]))

    @cached_property
    def scales(self) -> dict[str, float]:
        """Scale by the id of the lane."""
        return dict(zip(self.lanes, self.scale.tolist(), strict=True))


class RepairKind(StrEnum):
    """How a route differs from the path on the lane graph; the value is what is said of it."""

    LEFT_OUT = "edge {edge} left out: no link from {before}"
    PUT_IN = "{edges} put in between {before} and {edge}"
    LED_AROUND = "{left_out} left out; {edges} put in between {before} and {edge}"
    OTHER_LINK = "leaves lane {before} by {edge}, not {left_out}"


class RouteRepair(NamedTuple):
    """Where a route differs from the path; ``words`` are for people."""

    kind: RepairKind
    words: str

    @classmethod
    def of(cls, kind: RepairKind, **names: str) -> RouteRepair:
        """Name the edges and lanes of a repair as its kind does."""
        return cls(kind, kind.format(**names))


@dataclass(frozen=True, slots=True)
class Route:
    """A SUMO route; ``repairs`` says where it differs from the path on the lane graph."""

    edges: tuple[str, ...]
    depart_lane: int
    depart_pos: float
    depart_pos_lat: float
    arrival_lane: int | None
    arrival_pos: float
    repairs: tuple[RouteRepair, ...] = ()


class RoutePlanner:
    """Routes of vehicles on one map.

    Parameters
    ----------
    graph
        The lane graph.
    net
        The SUMO network.
    places
        Where the nodes of the lane graph are on it.
    """

    def __init__(self, graph: LaneGraph, net: RoadNet, places: NodePositions) -> None:
        self._graph = graph
        self._net = net
        self._places = places

    def plan(
        self,
        path: Int32Array,
        *,
        length: float,
        vclass: str,
        lateral_offset: float = 0.0,
        longitudinal_offset: float = 0.0,
    ) -> Route:
        """Route of a vehicle of this length along a path of the lane graph.

        Parameters
        ----------
        path
            Nodes from spawn to goal, both included.
        length
            Of the body, metres.
        vclass
            SUMO's vehicle class.
        lateral_offset
            Metres to the left.
        longitudinal_offset
            Metres ahead of the first node.

        Raises
        ------
        NoRouteError
            If the SUMO network has no way along the path, or the class may not use it.
        """
        edges, repairs = connected(self._net, self._edges_of_path(path, vclass), vclass)
        # The arrival first: it may add the edge that the front stands on the way to.
        edges, arrival_lane, arrival_pos = self._place_arrival(edges, path, vclass, length)
        edges, start, pos = self._anchor_spawn(path, edges, vclass)
        ahead = (length / 2.0 + longitudinal_offset) * self._places.scales[start.id]
        pos = max(pos, -ahead)  # a front behind the beginning of its lane is on none
        if pos + ahead > start.length + CLAMP and not self._next_lanes(start, edges):
            edges, more_repairs = self._leave_along_link(start, edges, vclass)
            repairs += more_repairs
        edges, lane, front = self._place_front(edges, start, pos + ahead)
        if not lane.allows(vclass):
            raise NoRouteError(f"lane {lane.id} of the SUMO network does not admit {vclass}")
        if len(edges) == 1:  # there and back again is not meant: stop where it has just started
            arrival_pos = min(max(arrival_pos, front + 0.1), lane.length)
        lateral = self._net.pos_lat(lateral_offset)
        return Route(edges, lane.index, front, lateral, arrival_lane, arrival_pos, repairs)

    def _edges_of_path(self, path: Int32Array, vclass: str) -> list[str]:
        """Return normal edges that the path runs over, in order, each run of equal ones once."""
        rows = self._places.lane[path]
        rows = rows[rows >= 0]
        if not len(rows):
            raise NoRouteError("the SUMO network has no lane anywhere on the way")
        changed = np.ones(len(rows), dtype=np.bool_)
        changed[1:] = rows[1:] != rows[:-1]
        edges: list[str] = []
        for row in rows[changed].tolist():
            lane = self._net.lanes[self._places.lanes[row]]
            if (
                not lane.internal
                and lane.edge not in edges[-1:]
                and self._edge_admits(lane, vclass)
            ):
                edges.append(lane.edge)
        if edges:
            return edges
        return [self._lanes_leaving(self._net.lanes[self._places.lanes[int(rows[0])]])[-1].edge]

    def _edge_admits(self, lane: RoadNetLane, vclass: str) -> bool:
        return any(other.allows(vclass) for other in self._net.edge_lanes[lane.edge])

    def _anchor_spawn(
        self, path: Int32Array, edges: tuple[str, ...], vclass: str
    ) -> tuple[tuple[str, ...], RoadNetLane, float]:
        """Edges, lane and position of the spawn; the position may lie beyond the lane's end.

        The lane is the normal one of the last node of the spawn's lane, up to the spawn, that lies
        on the route or just before it; without such a node it is where geometry says.
        """
        spawn = int(path[0])
        row = int(self._graph.lane[spawn])
        first = int(self._graph.lanes.first_node[row])
        for node in range(spawn, first - 1, -1):
            place = self._places.of(node)
            if place is None or (lane := self._net.lanes[place[0]]).internal:
                continue
            behind = float(self._graph.offset[spawn] - self._graph.offset[node])
            behind *= self._places.scales[lane.id]
            if lane.edge == edges[0]:
                return edges, lane, place[1] + behind
            if edges[0] in self._net.followers(lane.edge, vclass):
                return (lane.edge, *edges), lane, place[1] + behind
        place = self._places.of(spawn)
        if place is None:
            raise NoRouteError("the SUMO network has no lane at the spawn")
        lane = self._net.lanes[place[0]]
        if lane.internal:
            return self._prepend_internal_edges(lane, edges, vclass), lane, place[1]
        if lane.edge == edges[0]:
            return edges, lane, place[1]
        raise NoRouteError(f"the SUMO network has no way from lane {lane.id} for {vclass}")

    def _prepend_internal_edges(
        self, lane: RoadNetLane, edges: tuple[str, ...], vclass: str
    ) -> tuple[str, ...]:
        """Put the internal edges before ``edges`` that lead there from an internal lane."""
        leaving = self._lanes_leaving(lane)
        between = self._net.path(leaving[-1].edge, edges[0], vclass)
        if between is None:
            raise NoRouteError(
                f"the SUMO network has no way for {vclass} from {lane.id} to edge {edges[0]}"
            )
        return (lane.edge, *between, *edges[1:])

    def _lanes_leaving(self, lane: RoadNetLane) -> tuple[RoadNetLane, ...]:
        leaving = self._net.leaving(lane.id)
        if not leaving:
            raise NoRouteError(f"lane {lane.id} of the SUMO network leads nowhere")
        return leaving

    def _place_front(
        self, edges: tuple[str, ...], start: RoadNetLane, pos: float
    ) -> tuple[tuple[str, ...], RoadNetLane, float]:
        """Follow the route from ``start`` to ``pos``: the edges left, the lane, and where on it."""
        lane = start
        while pos > lane.length:
            passage = self._next_lanes(lane, edges)
            if not passage:  # another lane of the edge goes there; it changes lanes at its end
                return edges, lane, lane.length
            ground = (pos - lane.length) / self._places.scales[lane.id]
            lane = passage[0]
            pos = ground * self._places.scales[lane.id]
            # SUMO takes one internal edge at most, as the first: it knows what follows by itself.
            inside = (lane.edge,) if lane.internal else ()
            edges = (*inside, *edges[edges.index(passage[-1].edge) :])
        return edges, lane, max(pos, 0.0)

    def _leave_along_link(
        self, lane: RoadNetLane, edges: tuple[str, ...], vclass: str
    ) -> tuple[tuple[str, ...], tuple[RouteRepair, ...]]:
        """Leave by a link of the lane that the body is on, as its front is beyond the end.

        The path would have it change lanes first, for which it is too late.
        """
        paths = [
            found
            for link in self._net.links_from.get(lane.id, ())
            if (found := self._net.path(self._net.lanes[link.target].edge, edges[-1], vclass))
        ]
        if len(edges) < 2 or not paths:
            return edges, ()
        best = min(paths, key=lambda path: (self._net.path_length(path), path))
        repair = RouteRepair.of(
            RepairKind.OTHER_LINK, before=lane.id, edge=best[0], left_out=edges[1]
        )
        return (edges[0], *best), (repair,)

    def _next_lanes(self, lane: RoadNetLane, edges: tuple[str, ...]) -> tuple[RoadNetLane, ...]:
        """Return the lanes from the next one on to the next normal one, on the route."""
        if lane.internal:
            return self._net.leaving(lane.id)
        return (self._net.passage(lane.id, edges[1]) if len(edges) > 1 else None) or ()

    def _place_arrival(
        self, edges: tuple[str, ...], path: Int32Array, vclass: str, length: float
    ) -> tuple[tuple[str, ...], int | None, float]:
        """Edges, lane and position of the arrival: body centre on the goal as far as the edge goes.

        A goal inside a junction is reached by leaving the junction: routes end on normal edges.
        """
        last = self._net.edge_lanes[edges[-1]]
        place = self._places.of(int(path[-1]))
        if place is None:
            return edges, None, last[0].length
        lane = self._net.lanes[place[0]]
        if lane.edge == edges[-1] and not lane.internal:
            index = lane.index if lane.allows(vclass) else None
            ahead = length / 2.0 * self._places.scales[lane.id]
            return edges, index, min(place[1] + ahead, lane.length)
        leaving = self._net.leaving(lane.id)[-1:]
        if leaving and leaving[0].edge in self._net.followers(edges[-1], vclass):
            return (*edges, leaving[0].edge), None, min(1.0, leaving[0].length)
        return edges, None, last[0].length


def connected(
    net: RoadNet, edges: list[str], vclass: str
) -> tuple[tuple[str, ...], tuple[RouteRepair, ...]]:
    """Make a list of edges a connected route.

    Where two edges have no link, the shortest path between them is put in; where there is none of
    at most :data:`DETOUR` metres, the second one is left out. If the last edge cannot be reached
    then, the route leaves the path for the shortest path to it, as late as possible.

    Returns
    -------
    The edges, and the repairs.

    Raises
    ------
    NoRouteError
        If the last edge cannot be reached from any edge of the route.
    """
    route = [edges[0]]
    repairs: list[RouteRepair] = []
    for edge in edges[1:-1]:
        if edge in net.next_edges(route[-1], vclass):
            route.append(edge)
            continue
        between = net.path(route[-1], edge, vclass)
        if between is None or net.path_length(between[1:-1]) > DETOUR:
            repairs.append(RouteRepair.of(RepairKind.LEFT_OUT, edge=edge, before=route[-1]))
            continue
        route.extend(between[1:])
        put_in = " ".join(between[1:-1]) or edge
        repairs.append(
            RouteRepair.of(RepairKind.PUT_IN, edges=put_in, before=between[0], edge=edge)
        )
    if len(edges) > 1 and edges[-1] not in net.next_edges(route[-1], vclass):
        route, repair = _end_route(net, route, edges[-1], vclass)
        repairs.append(repair)
    elif len(edges) > 1:
        route.append(edges[-1])
    return tuple(route), tuple(repairs)


def _end_route(
    net: RoadNet, route: list[str], last: str, vclass: str
) -> tuple[list[str], RouteRepair]:
    """Lead a route to its last edge from the latest place where that is possible."""
    for kept in range(len(route), 0, -1):
        between = net.path(route[kept - 1], last, vclass)
        if between is None:
            continue
        repair = RouteRepair.of(
            RepairKind.LED_AROUND if kept < len(route) else RepairKind.PUT_IN,
            left_out=" ".join(route[kept:]),
            edges=" ".join(between[1:-1]) or last,
            before=between[0],
            edge=last,
        )
        return [*route[:kept], *between[1:]], repair
    raise NoRouteError(f"the SUMO network has no way for {vclass} from edge {route[-1]} to {last}")
