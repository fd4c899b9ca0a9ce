"""A vehicle put where another program has driven it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.sumo.worker.protocol import EgoPose
    from odscen.sumo.worker.simulation.road_lanes import RoadLanes

_UNCHECKED = 0
"""``setSpeedMode``: the speed that is set, whatever is safe, possible or permitted."""
_FAST = 200.0
"""m/s; no limit of a model, for a vehicle whose speed is set."""
_EDGES_AHEAD = 3
"""Edges that the route of a vehicle driven from outside has at least, its own included."""
_NEAR_LANE = 10.0
"""Metres around a place in which SUMO looks for its lane; its own 100 m cost thrice as much."""


class Placing:
    """Puts vehicles somewhere.

    Parameters
    ----------
    sumo, errors
        libsumo, and what it raises.
    lanes
        Those of the network.
    """

    def __init__(self, sumo: Any, errors: tuple[type[Exception], ...], lanes: RoadLanes) -> None:
        self._sumo = sumo
        self._errors = errors
        self._lanes = lanes

    def __call__(self, vehicle: str, at: EgoPose, *, again: bool = False) -> bool:
        """Put a vehicle where another program has driven it; false if SUMO cannot.

        The place is taken exactly, on or off the road, and so is the speed, whatever limits,
        lights and right of way say: nothing of SUMO's drives it. ``keepRoute=2`` lets the vehicle
        leave its route; its new one would end with the edge that it is on, so it is led on a
        little: others must know where it may be going. ``again`` says that it was put somewhere
        before: how it obeys need not be said twice.
        """
        vehicles = self._sumo.vehicle
        try:
            if not again:
                vehicles.setSpeedMode(vehicle, _UNCHECKED)
                vehicles.setMaxSpeed(vehicle, _FAST)
            vehicles.setSpeed(vehicle, at.speed)
            vehicles.moveToXY(vehicle, "", -1, at.x, at.y, at.angle_deg, 2, _NEAR_LANE)
            route, index = vehicles.getRoute(vehicle), vehicles.getRouteIndex(vehicle)
            if index >= 0 and len(route) - index < _EDGES_AHEAD:
                self._lead_on(vehicle, route[index:])
        except self._errors:
            return False
        return True

    def _lead_on(self, vehicle: str, route: Sequence[str]) -> None:
        edges = list(route)
        lanes = self._lanes.of_edge
        if lanes[edges[0]][0] in self._lanes.internal:  # a route cannot be changed in a junction
            return
        links, lane_edge = self._sumo.lane.getLinks, self._sumo.lane.getEdgeID
        kind = self._sumo.vehicle.getVehicleClass(vehicle)
        while len(edges) < _EDGES_AHEAD:
            onward = [
                lane_edge(link[0])
                for lane in lanes[edges[-1]]
                for link in links(lane)
                if self._lanes.admits(link[0], kind)
            ]
            if not onward:
                break
            edges.append(onward[0])
        if len(edges) > len(route):
            self._sumo.vehicle.setRoute(vehicle, edges)
