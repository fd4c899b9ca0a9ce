"""Where the parking areas of a map are on the SUMO network, and the file that says so to SUMO."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.categories import DEFAULT_BODY, Category
from odscen.records.run_plan import PlannedParking, begin_area
from odscen.sumo.realize.route_planner import NoRouteError
from odscen.sumo.realize.transit.stop_places import CLEAR, LEAST_LENGTH

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.base.arrays import BoolArray
    from odscen.lanegraph.graphs import LaneGraph
    from odscen.lanegraph.parking_areas import ParkingArea, ParkingPlace
    from odscen.sumo.realize.road_net import RoadNet
    from odscen.sumo.realize.route_planner import Route
    from odscen.sumo.realize.sumo_map import SumoMap

ALTERNATIVES = 12
"""Areas that drivers know of who find theirs full, the nearest ones."""

_ROUND_END = 3.0
"""Metres of lane before the first and behind the last place of an area."""

_END_EDGES = 2
"""Edges at an end of a route among which that of an area is looked for."""


class ParkingPosition(NamedTuple):
    """A parking area on the SUMO network; positions in metres along the lane."""

    area: ParkingArea
    lane: str
    lane_index: int
    edge: str
    begin: float
    end: float


def parking_positions(sumo_map: SumoMap, inside: BoolArray) -> dict[str, ParkingPosition]:
    """Find the parking areas of a region on the network, by id; those without a lane are left out.

    Parameters
    ----------
    inside
        Shape ``(N,)``: nodes of the lane graph that are in the region.
    """
    positions: dict[str, ParkingPosition] = {}
    places = sumo_map.lane_places
    for area in sumo_map.parking.areas:
        if not inside[area.node]:
            continue
        middle = places.of(area.node)
        lane = None if middle is None else sumo_map.net.lanes[middle[0]]
        if lane is None or lane.internal or not lane.allows("passenger"):
            continue
        along = [
            place[1] for node in area.nodes if (place := places.of(node)) and place[0] == lane.id
        ]
        begin = round(max(min(along) - _ROUND_END, 0.0), 2)
        # As SUMO reads it: a trip that ends a hair behind its area would drive on after its stay.
        end = round(min(max(along) + _ROUND_END, lane.length - CLEAR), 2)
        if end - begin >= LEAST_LENGTH:
            positions[area.id] = ParkingPosition(area, lane.id, lane.index, lane.edge, begin, end)
    return positions


def planned_parking(
    positions: Iterable[ParkingPosition], sumo_map: SumoMap
) -> tuple[PlannedParking, ...]:
    """Areas as reports have them."""
    lanes, segments = sumo_map.graph.lanes, sumo_map.graph.segments
    return tuple(
        PlannedParking(
            position.area.id,
            str(segments.ids[int(lanes.segment[position.area.node])]),
            len(position.area.places),
            round(sum(place.x for place in position.area.places) / len(position.area.places), 2),
            round(sum(place.y for place in position.area.places) / len(position.area.places), 2),
        )
        for position in positions
    )


def parking_xml(
    positions: Sequence[ParkingPosition], sumo_map: SumoMap, *, begins: Mapping[str, int]
) -> str:
    """Text of ``parking.add.xml``: areas with each of their places, and alternatives to them.

    The places that trips begin in are areas of their own, so that no other car takes one when it
    is due. One rerouter for each edge lets those who enter it and whose area is full drive to the
    nearest one with room.

    Parameters
    ----------
    begins
        How many places of each area trips begin in.
    """
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', "<additional>"]
    lanes = sumo_map.graph.lanes
    for position in positions:
        spaces = [
            _space_element(place, float(lanes.z[node]), sumo_map)
            for node, place in zip(position.area.nodes, position.area.places, strict=True)
        ]
        own = begins.get(position.area.id, 0)
        lines += _area_lines(position, begin_area(position.area.id), spaces[:own])
        lines += _area_lines(position, position.area.id, spaces[own:])
    # Nobody is sent to an area all of whose places belong to trips that begin there.
    positions = [
        position
        for position in positions
        if begins.get(position.area.id, 0) < len(position.area.places)
    ]
    for edge in dict.fromkeys(position.edge for position in positions):
        here = [position for position in positions if position.edge == edge]
        lines += [
            f'    <rerouter id="parking.{here[0].area.id}" edges="{edge}">',
            '        <interval begin="0" end="1e9">',
        ]
        lines += [
            f'            <parkingAreaReroute id="{position.area.id}" visible="true"/>'
            for position in _list_areas_known_from(here, positions, lanes)
        ]
        lines += ["        </interval>", "    </rerouter>"]
    return "\n".join([*lines, "</additional>", ""])


def _area_lines(parking_position: ParkingPosition, name: str, spaces: Sequence[str]) -> list[str]:
    if not spaces:
        return []
    start = (
        f'    <parkingArea id="{name}" lane="{parking_position.lane}" '
        f'startPos="{parking_position.begin:.2f}" '
        f'endPos="{parking_position.end:.2f}" roadsideCapacity="0">'
    )
    return [start, *spaces, "    </parkingArea>"]


def _space_element(place: ParkingPlace, z: float, sumo_map: SumoMap) -> str:
    """One place: SUMO has the front of a car there, and counts angles from south, clockwise not."""
    body = min(DEFAULT_BODY[Category.CAR].length, place.length)
    dx, dy = sumo_map.net_offset
    x = place.x + dx + math.cos(place.hdg) * body / 2.0
    y = place.y + dy + math.sin(place.hdg) * body / 2.0
    height = f' z="{z:.2f}"' if sumo_map.elevation else ""
    angle = (math.degrees(place.hdg) + 90.0) % 360.0
    return (
        f'        <space x="{x:.2f}" y="{y:.2f}"{height} angle="{angle:.2f}" '
        f'length="{place.length:.2f}" width="{place.width:.2f}"/>'
    )


def _list_areas_known_from(
    here: Sequence[ParkingPosition], every: Sequence[ParkingPosition], lanes: LaneGraph
) -> list[ParkingPosition]:
    """Areas of an edge, then the nearest others."""
    x, y = float(lanes.x[here[0].area.node]), float(lanes.y[here[0].area.node])

    def away(parking_position: ParkingPosition) -> tuple[float, str]:
        node = parking_position.area.node
        return round(
            math.hypot(float(lanes.x[node]) - x, float(lanes.y[node]) - y), 2
        ), parking_position.area.id

    others = sorted((position for position in every if position.edge != here[0].edge), key=away)
    return [*here, *others[:ALTERNATIVES]]


def parked_route(
    route: Route,
    net: RoadNet,
    vclass: str,
    *,
    begins: ParkingPosition | None,
    ends: ParkingPosition | None,
) -> Route:
    """Let a route begin and end on the edges of parking areas, at their places.

    Raises
    ------
    NoRouteError
        If the route does not touch them.
    """
    edges = route.edges
    if begins is not None:
        edges = _begin_at_area(edges, begins, net, vclass)
        route = replace(
            route, depart_lane=begins.lane_index, depart_pos=begins.end, depart_pos_lat=0.0
        )
    if ends is not None:
        edges = _end_at_area(edges, ends, net, vclass)
        route = replace(route, arrival_lane=None, arrival_pos=ends.end)
    return replace(route, edges=edges)


def _begin_at_area(
    edges: tuple[str, ...], area: ParkingPosition, net: RoadNet, vclass: str
) -> tuple[str, ...]:
    for at in range(min(_END_EDGES, len(edges))):
        if edges[at] == area.edge:
            return edges[at:]
    # A route that begins inside a junction begins on the area's edge, which leads into it.
    normal = edges[1:] if net.edge_lanes[edges[0]][0].internal else edges
    if normal and normal[0] in net.followers(area.edge, vclass):
        return (area.edge, *normal)
    raise NoRouteError(f"its route on the SUMO network does not begin at parking {area.area.id}")


def _end_at_area(
    edges: tuple[str, ...], area: ParkingPosition, net: RoadNet, vclass: str
) -> tuple[str, ...]:
    for cut in range(min(_END_EDGES, len(edges))):
        if edges[len(edges) - 1 - cut] == area.edge:
            return edges[: len(edges) - cut]
    if area.edge in net.followers(edges[-1], vclass):
        return (*edges, area.edge)
    raise NoRouteError(f"its route on the SUMO network does not end at parking {area.area.id}")
