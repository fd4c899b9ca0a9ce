"""Centre lines of the lanes about a vehicle, in SUMO's frame; only a session hands this out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from odscen.sumo.worker.simulation.road_lanes import RoadLanes

_AHEAD = 600.0
"""Metres that a line of lanes is followed."""

Shape = tuple[tuple[float, float], ...]


class LaneLines:
    """Lines that a vehicle of the running simulation could be led along."""

    def __init__(self, sumo: Any, lanes: RoadLanes) -> None:
        self._sumo = sumo
        self._lanes = lanes

    def beside(self, vehicle: str, by: int) -> tuple[Shape, ...]:
        """Centre lines of the lanes ``by`` lanes beside that of a vehicle, on either side of it."""
        vehicles = self._sumo.vehicle
        own = vehicles.getLaneID(vehicle)
        if not own:
            return ()
        lanes = self._lanes.in_order(self._sumo.lane.getEdgeID(own))
        kind, row = vehicles.getVehicleClass(vehicle), lanes.index(own)
        rows = {row + by, row - by}
        return tuple(
            self._line_ahead(vehicle, lanes[n], kind)
            for n in sorted(rows)
            if 0 <= n < len(lanes) and self._lanes.admits(lanes[n], kind)
        )

    def own(self, vehicle: str) -> tuple[Shape, ...]:
        """Centre lines of all lanes of its edge that a vehicle may use, and of where they lead."""
        vehicles = self._sumo.vehicle
        own = vehicles.getLaneID(vehicle)
        if not own:
            return ()
        kind = vehicles.getVehicleClass(vehicle)
        lanes = self._lanes.in_order(self._sumo.lane.getEdgeID(own))
        return tuple(
            self._line_ahead(vehicle, lane, kind)
            for lane in lanes
            if self._lanes.admits(lane, kind)
        )

    def _line_ahead(self, vehicle: str, lane: str, kind: str) -> Shape:
        """Centre line of a lane and of those that it leads to, along the route if it does."""
        lanes, vehicles = self._sumo.lane, self._sumo.vehicle
        route = set(vehicles.getRoute(vehicle)[max(vehicles.getRouteIndex(vehicle), 0) :])
        line, metres = list(lanes.getShape(lane)), lanes.getLength(lane)
        while metres < _AHEAD:
            links = [link for link in lanes.getLinks(lane) if self._lanes.admits(link[0], kind)]
            if not links:
                break
            onward = [link for link in links if lanes.getEdgeID(link[0]) in route]
            link = (onward or links)[0]
            inside = link[4]
            while inside:
                line += lanes.getShape(inside)
                metres += lanes.getLength(inside)
                inside = next((getLink[4] for getLink in lanes.getLinks(inside)), "")
            lane = link[0]
            line += lanes.getShape(lane)
            metres += lanes.getLength(lane)
        return tuple(line)
