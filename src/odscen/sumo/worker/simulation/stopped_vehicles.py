"""Vehicles that are stopped, and what each has before it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from odscen.sumo.worker.simulation.foreign_traffic import is_foreign
from odscen.sumo.worker.simulation.observed import StoppedVehicle, ViewAhead

if TYPE_CHECKING:
    from odscen.sumo.worker.simulation.road_lanes import RoadLanes

_CLOSE = 5.0
"""Metres that a stopped vehicle ahead may be away and be the reason for stopping."""
_BLOCKING = 10.0
"""Metres from the front to the middle of another body in a junction that may be the reason."""
_RED = ("r", "u")
"""States of a traffic light's link at which no vehicle goes."""
_STOPPED = 0.1
"""Speed, m/s, below which SUMO counts a vehicle as waiting."""


class StoppedVehicles:
    """Finds them and says why.

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

    def longer_than(self, seconds: float) -> list[StoppedVehicle]:
        """Vehicles that have been stopped for so long; a microsecond for each on the road."""
        vehicle = self._sumo.vehicle
        vehicles = []
        for name in vehicle.getIDList():
            waited = 0.0 if is_foreign(name) else vehicle.getWaitingTime(name)
            if waited >= seconds and (lane := vehicle.getLaneID(name)):
                vehicles.append(StoppedVehicle(name, lane, vehicle.getLanePosition(name), waited))
        return vehicles

    def ahead(self, name: str) -> ViewAhead | None:
        """What a vehicle has before it; ``None`` if it is not on the road."""
        vehicle = self._sumo.vehicle
        try:
            links = vehicle.getNextLinks(name)
            leader = self._stopped_leader(name, float(links[0][7]) if links else 0.0)
            at_end = vehicle.getRouteIndex(name) >= len(vehicle.getRoute(name)) - 1
            lane = str(vehicle.getLaneID(name))
            if leader is None and not at_end and (wrong := self._leads_astray(name)) is not None:
                return ViewAhead(False, "", False, None, people=False, beside=wrong)
            inside = lane in self._lanes.internal
            goes = bool(links) and links[0][5] not in _RED  # else that is the reason
            through = lane if inside else str(links[0][4]) if goes else ""
            if leader is None and through:
                leader = self._blocking_vehicle(name, through)
        except self._errors:
            return None
        if not links:  # inside a junction the link out of it is not among them
            onwards = at_end or inside
            return ViewAhead(onwards, "", onwards, leader, people=False)
        link = links[0]
        # approachedLane, hasPrio, isOpen, hasFoe, approachedInternal, state, direction, length
        people = bool(link[3]) and self._people_cross(link[4])
        return ViewAhead(True, str(link[5]), bool(link[2]), leader, people)

    def is_at_red(self, name: str) -> bool:
        """Whether the next light that a vehicle comes to shows red."""
        links = self._sumo.vehicle.getNextLinks(name)
        return bool(links) and links[0][5] in _RED

    def _leads_astray(self, name: str) -> bool | None:
        """Whether another lane continues along a vehicle's route; ``None`` if its own lane does."""
        vehicle, lanes = self._sumo.vehicle, self._sumo.lane
        lane, index = vehicle.getLaneID(name), vehicle.getRouteIndex(name)
        if not lane or lane in self._lanes.internal:
            return None
        own = self._lanes.of_edge[lanes.getEdgeID(lane)]
        following = vehicle.getRoute(name)[index + 1]
        leading = {
            name
            for name in own
            if any(lanes.getEdgeID(link[0]) == following for link in lanes.getLinks(name))
        }
        if lane not in leading:
            return bool(leading)
        # It may lead on there and no further: SUMO wants another lane, so many to the left.
        wants = next(
            (
                getBestLane[3]
                for getBestLane in vehicle.getBestLanes(name)
                if getBestLane[0] == lane
            ),
            0,
        )
        return True if wants else None

    def _stopped_leader(self, name: str, junction: float) -> str | None:
        """Return the vehicle that leaves no room behind ``junction`` metres of junction."""
        vehicle = self._sumo.vehicle
        lane = vehicle.getLaneID(name)
        rest = self._sumo.lane.getLength(lane) - vehicle.getLanePosition(name) if lane else 0.0
        gap = vehicle.getMinGap(name)
        needed = max(_CLOSE, rest + junction + vehicle.getLength(name) + 2.0 * gap)
        leader = vehicle.getLeader(name, needed)
        if not leader or not leader[0] or leader[1] > needed:
            return None
        return str(leader[0]) if vehicle.getSpeed(leader[0]) < _STOPPED else None

    def _blocking_vehicle(self, name: str, internal: str) -> str | None:
        """Return the nearest vehicle stopped ahead on another connection of the junction."""
        vehicle, lanes = self._sumo.vehicle, self._sumo.lane
        x, y = vehicle.getPosition(name)
        angle = math.radians(vehicle.getAngle(name))
        nearest, found = _BLOCKING, None
        for foe in sorted(lanes.getInternalFoes(internal)):
            for other in lanes.getLastStepVehicleIDs(foe):
                if vehicle.getSpeed(other) >= _STOPPED:
                    continue
                (fx, fy), turned = vehicle.getPosition(other), math.radians(vehicle.getAngle(other))
                half = vehicle.getLength(other) / 2.0
                dx = fx - half * math.sin(turned) - x
                dy = fy - half * math.cos(turned) - y
                away = math.hypot(dx, dy)
                if away < nearest and dx * math.sin(angle) + dy * math.cos(angle) > 0.0:
                    nearest, found = away, str(other)
        return found

    def _people_cross(self, internal: str) -> bool:
        if not internal:
            return False
        lane, edge = self._sumo.lane, self._sumo.edge
        return any(
            lane.getAllowed(foe) == ("pedestrian",)
            and edge.getLastStepPersonIDs(lane.getEdgeID(foe))
            for foe in lane.getInternalFoes(internal)
        )
