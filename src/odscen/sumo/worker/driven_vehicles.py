"""All vehicles read and driven at once, for behaviour models; only a session hands this out.

Getters of libsumo cost less than its subscriptions (1.0 to 1.2 times a step against 1.2 to 1.8),
so each vehicle is asked.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from odscen.base.arrays import FloatArray

_ALL_CHECKS, _NO_CHECKS = 31, 96
"""``setSpeedMode``: SUMO's own; what is set and nothing else."""
_OWN_LANES, _ROUTE_ONLY = 1621, 1537
"""``setLaneChangeMode``: SUMO's own; only changes that the route needs, or that are asked for."""
_NEAR = 12.0
"""Metres around a place in which SUMO looks for its lane."""
_EXACTLY = 2
"""``keepRoute``: exactly there, off the route and the road as well."""
_NOWHERE = 1e8


class LaneFacts(NamedTuple):
    """A lane of SUMO; ``links`` are pairs of the lane that it leads to and the one in between."""

    id: str
    edge: str
    length: float
    limit: float
    width: float
    shape: tuple[tuple[float, float], ...]
    links: tuple[tuple[str, str], ...]
    allowed: frozenset[str]


class SeenTraffic(NamedTuple):
    """Vehicles on the road: centre of the front, SUMO's frame; arrays ``(N,)``."""

    names: list[str]
    lane: list[str]
    x: FloatArray
    y: FloatArray
    angle_deg: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    pos: FloatArray
    left: FloatArray


class DrivenVehicles:
    """Reads and drives them."""

    def __init__(
        self,
        sumo: Any,
        errors: tuple[type[Exception], ...],
        native: Callable[[str, str], Callable[..., Any]],
        lanes_of_edge: Mapping[str, Sequence[str]],
    ) -> None:
        self._sumo = sumo
        self.errors = errors
        self._lanes_of_edge = lanes_of_edge
        self._ids = native("vehicle", "getIDList")
        self._place, self._lane = native("vehicle", "getPosition"), native("vehicle", "getLaneID")
        getters = ("Angle", "Speed", "Acceleration", "LanePosition", "LateralLanePosition")
        self._numbers = [native("vehicle", f"get{name}") for name in getters]
        self._set_speed = native("vehicle", "setSpeed")
        self._light = native("trafficlight", "getRedYellowGreenState")

    def traffic(self, known: Collection[str]) -> SeenTraffic:
        """Those of some vehicles who are on the road."""
        names, places, lanes = [], [], []
        for name in self._ids():
            place = self._place(name)
            if name in known and abs(place[0]) < _NOWHERE:
                names.append(name)
                places.append(place)
                lanes.append(self._lane(name))
        x, y = np.array(places, dtype=np.float64).reshape(-1, 2).T
        numbers = [
            np.array([getter(name) for name in names], dtype=np.float64) for getter in self._numbers
        ]
        return SeenTraffic(names, lanes, x, y, *numbers)

    def lanes(self) -> list[LaneFacts]:
        """Lanes that vehicles may use, inside junctions as well."""
        lane = self._sumo.lane
        found = []
        for edge, names in sorted(self._lanes_of_edge.items()):
            for name in sorted(names, key=lambda one: (len(one), one)):
                allowed = frozenset(lane.getAllowed(name))
                if allowed == {"pedestrian"}:
                    continue
                links = tuple((link[0], link[4]) for link in lane.getLinks(name))
                shape = tuple(lane.getShape(name))
                found.append(
                    LaneFacts(
                        name, edge, lane.getLength(name), lane.getMaxSpeed(name),
                        lane.getWidth(name), shape, links, allowed,
                    )
                )  # fmt: skip
        return found

    def light_links(self) -> dict[tuple[str, str], tuple[str, int]]:
        """Light and number of the link from one lane to another, where there is one."""
        lights = self._sumo.trafficlight
        return {
            (link[0], link[1]): (light, number)
            for light in lights.getIDList()
            for number, links in enumerate(lights.getControlledLinks(light))
            for link in links
        }

    def light_state(self, light: str) -> str:
        """Letters of a traffic light, one for each link."""
        return str(self._light(light))

    def coming_edges(self, name: str) -> tuple[str, ...]:
        """Edges of a vehicle's route after the one that it is on."""
        one = self._sumo.vehicle
        return tuple(one.getRoute(name)[one.getRouteIndex(name) + 1 :])

    def vehicle_class(self, name: str) -> str:
        """SUMO's class of a vehicle."""
        return str(self._sumo.vehicle.getVehicleClass(name))

    def take_over(self, name: str, *, checked: bool, changes: bool) -> None:
        """Let a vehicle do what is set, as far as SUMO's driver thinks it safe if ``checked``."""
        self._sumo.vehicle.setSpeedMode(name, _ALL_CHECKS if checked else _NO_CHECKS)
        self._sumo.vehicle.setLaneChangeMode(name, _ROUTE_ONLY if changes else _OWN_LANES)

    def release(self, name: str) -> None:
        """Give a vehicle back to SUMO's driver."""
        self._set_speed(name, -1.0)
        self._sumo.vehicle.setSpeedMode(name, _ALL_CHECKS)
        self._sumo.vehicle.setLaneChangeMode(name, _OWN_LANES)

    def set_speed(self, name: str, speed: float) -> None:
        """Speed after the next step, m/s."""
        self._set_speed(name, speed)

    def change_lane(self, name: str, lanes: int, seconds: float) -> None:
        """Ask for a change of so many lanes to the left, for some seconds."""
        self._sumo.vehicle.changeLaneRelative(name, lanes, seconds)

    def put_on_lane(self, name: str, lane: str, pos: float) -> None:
        """Place the front of a vehicle on a lane of its route."""
        self._sumo.vehicle.moveTo(name, lane, pos)

    def put(self, name: str, x: float, y: float, angle_deg: float) -> None:
        """Place the front of a vehicle anywhere."""
        self._sumo.vehicle.moveToXY(name, "", -1, x, y, angle_deg, _EXACTLY, _NEAR)
