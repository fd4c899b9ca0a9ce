"""The vehicle of an incident: it drives up to its place, stops there, and drives on at the end."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.categories import Category
from odscen.base.errors import ScenarioError
from odscen.scenario.document.measures_document import LaneIncident
from odscen.sumo.realize.driving import HEADWAY, KINDS, number
from odscen.sumo.realize.traffic_measures.measure_actions import end_of
from odscen.sumo.realize.traffic_measures.measured_lanes import MOTOR, MeasuredLanes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.road_net import RoadNet
    from odscen.sumo.realize.sumo_map import SumoMap

COMFORT = 4.5
"""m/s^2 with which a car of SUMO's brakes."""
MORE_ROOM = 5.0
"""Metres that it drives before it brakes."""


_CAR = KINDS[Category.CAR]


class Breakdown(NamedTuple):
    """A vehicle that stops: departure (s), edges, and SUMO lanes and positions (m).

    Attributes
    ----------
    depart_lane
        Index of the lane on the first edge.
    until
        Seconds at which it drives on.
    """

    id: str
    length: float
    depart: float
    edges: tuple[str, ...]
    depart_lane: int
    depart_pos: float
    stop_lane: str
    stop_pos: float
    until: float

    def lines(self) -> Iterator[str]:
        """XML of the vehicle; its type is :meth:`type_line`."""
        yield (
            f'    <vehicle id="{self.id}" type="breakdown.{self.id}"'
            f' depart="{number(self.depart)}" departLane="{self.depart_lane}"'
            f' departPos="{number(self.depart_pos)}" departSpeed="avg" arrivalPos="max">'
        )
        yield f'        <route edges="{" ".join(self.edges)}"/>'
        start = max(0.0, self.stop_pos - 1.0)
        yield (
            f'        <stop lane="{self.stop_lane}" startPos="{number(start)}"'
            f' endPos="{number(self.stop_pos)}" until="{number(self.until)}"/>'
        )
        yield "    </vehicle>"

    def type_line(self) -> str:
        """XML of its type: a car of normal drivers of this length."""
        return (
            f'    <vType id="breakdown.{self.id}" vClass="{MOTOR}" length="{number(self.length)}"'
            f' maxSpeed="{number(_CAR.max_speed)}" accel="{number(_CAR.accel)}"'
            f' decel="{number(_CAR.decel)}" emissionClass="{_CAR.emissions}"'
            f' tau="{number(HEADWAY)}" sigma="0" speedDev="0" speedFactor="1"/>'
        )


def breakdowns(scenario: Scenario, sumo_map: SumoMap, *, until: float) -> tuple[Breakdown, ...]:
    """Vehicles of the incidents of a scenario that begin before the end of the run.

    Raises
    ------
    ScenarioError
        If the network has no lane at the place of one.
    """
    incidents = [
        measure
        for measure in scenario.measures
        if isinstance(measure, LaneIncident) and measure.begin < until
    ]
    if not incidents:
        return ()
    measured_lanes = MeasuredLanes(sumo_map)
    return tuple(
        _plan_breakdown(incident, measured_lanes, sumo_map, until) for incident in incidents
    )


def _plan_breakdown(
    incident: LaneIncident, found: MeasuredLanes, sumo_map: SumoMap, until: float
) -> Breakdown:
    lane, pos = _place_of_incident(incident, found, sumo_map)
    speed = sumo_map.net.lanes[lane].speed
    wanted = speed * speed / (2.0 * COMFORT) + MORE_ROOM
    start, start_pos, edges, driven = _departure_upstream(
        sumo_map.net, lane, pos, wanted, incident.length
    )
    duration = driven / speed + speed / (2.0 * COMFORT)
    return Breakdown(
        id=incident.id,
        length=incident.length,
        depart=max(0.0, incident.begin - duration),
        edges=edges,
        depart_lane=sumo_map.net.lanes[start].index,
        depart_pos=start_pos,
        stop_lane=lane,
        stop_pos=pos,
        until=end_of(incident, until),
    )


def _place_of_incident(
    incident: LaneIncident, found: MeasuredLanes, sumo_map: SumoMap
) -> tuple[str, float]:
    """SUMO lane and position of an incident."""
    nodes = found.places.lane_nodes(incident.lane)
    graph = sumo_map.graph.lanes
    near = None
    if nodes is not None:
        known = nodes[sumo_map.lane_places.lane[nodes] >= 0]
        if len(known):
            near = int(known[np.argmin(np.abs(graph.s[known] - incident.s))])
    place = None if near is None else sumo_map.lane_places.of(near)
    if near is None or place is None:
        raise ScenarioError(
            f"the SUMO network has no lane {incident.lane!r} at s {incident.s:g} m",
            element=incident.id,
        )
    lane = sumo_map.net.lanes[place[0]]
    ahead = incident.s - float(graph.s[near])
    if not graph.lanes.forward[graph.lane[near]]:
        ahead = -ahead
    return lane.id, min(max(place[1] + ahead, min(incident.length, lane.length)), lane.length)


def _departure_upstream(
    net: RoadNet, lane: str, pos: float, wanted: float, length: float
) -> tuple[str, float, tuple[str, ...], float]:
    """Where a vehicle departs that is to drive ``wanted`` metres to ``pos``: as far as roads go.

    Returns
    -------
    Lane, position, edges up to that of ``pos``, and metres driven.
    """
    edges: tuple[str, ...] = (net.lanes[lane].edge,)
    here, room = lane, pos - length
    driven = 0.0
    while room < wanted - driven:
        before = sorted(
            link.source
            for link in net.links
            if link.target == here and not net.lanes[link.source].internal
            if net.lanes[link.source].allows(MOTOR) and net.lanes[link.source].edge not in edges
        )
        if not before:
            break
        driven += room + length
        here = before[0]
        edges = (net.lanes[here].edge, *edges)
        room = net.lanes[here].length - length
    back = max(0.0, min(room, wanted - driven))
    start = max(0.0, (pos if here == lane else net.lanes[here].length) - back)
    return here, start, edges, driven + back
