"""All vehicles read and driven at once, for behaviour models; only a session hands this out.

Getters of libsumo cost less than its subscriptions (284 vehicles: 40 us for a number of each, 154
us for three by subscription), so each vehicle is asked, and only for what a model looks at.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.sumo.worker.simulation.road_lanes import RoadLanes

_ALL_CHECKS, _NO_CHECKS = 31, 96
"""``setSpeedMode``: SUMO's own; what is set and nothing else."""
_OWN_LANES, _ROUTE_ONLY = 1621, 1537
"""``setLaneChangeMode``: SUMO's own; only changes that the route needs, or that are asked for."""
_NEAR = 12.0
"""Metres around a place in which SUMO looks for its lane."""
_EXACTLY = 2
"""``keepRoute``: exactly there, off the route and the road as well."""
_NOWHERE = 1e8
NUMBERS = ("Angle", "Speed", "Acceleration", "LanePosition", "LateralLanePosition")
"""Of a vehicle, by SUMO's names."""
_COMING_AND_GOING = ("Departed", "Arrived", "StartingTeleport", "EndingTeleport")


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


class DrivenVehicles:
    """Reads and drives them."""

    def __init__(
        self,
        sumo: Any,
        errors: tuple[type[Exception], ...],
        native: Callable[[str, str], Callable[..., Any]],
        lanes: RoadLanes,
    ) -> None:
        self._sumo = sumo
        self.errors = errors
        self._lanes = lanes
        self._ids, self._count = (native("vehicle", f"getID{what}") for what in ("List", "Count"))
        self._place, self._lane = native("vehicle", "getPosition"), native("vehicle", "getLaneID")
        self._numbers = {name: native("vehicle", f"get{name}") for name in NUMBERS}
        self._happened = [native("simulation", f"get{what}Number") for what in _COMING_AND_GOING]
        self._present: tuple[int, list[str]] = -1, []
        self.set_speed = native("vehicle", "setSpeed")
        """Of a vehicle by its id, after the next step, m/s."""
        self._light = native("trafficlight", "getRedYellowGreenState")

    def present(self, known: Collection[str]) -> list[str]:
        """Those of some vehicles who are on the road.

        The list is the same object as before where nobody has come or gone in the last step.
        """
        count = self._count()
        if count != self._present[0] or any(number() for number in self._happened):
            place = self._place
            names = [
                vehicle
                for vehicle in self._ids()
                if vehicle in known and abs(place(vehicle)[0]) < _NOWHERE
            ]
            self._present = count, names
        return self._present[1]

    def numbers(self, what: str, names: Sequence[str]) -> FloatArray:
        """One of :data:`NUMBERS` of each vehicle; m, m/s, m/s^2, degrees from north clockwise."""
        import numpy as np

        return np.fromiter(map(self._numbers[what], names), np.float64, len(names))

    def fronts(self, names: Sequence[str]) -> tuple[FloatArray, FloatArray]:
        """Middle of each one's front, SUMO's frame, metres."""
        import numpy as np

        places = np.array([*map(self._place, names)], dtype=np.float64).reshape(-1, 2)
        return places[:, 0], places[:, 1]

    def lanes_of(self, names: Sequence[str]) -> list[str]:
        """Lane of each one's front; empty off the road."""
        return [*map(self._lane, names)]

    def lanes(self) -> list[LaneFacts]:
        """Lanes that vehicles may use, inside junctions as well."""
        lane = self._sumo.lane
        facts = []
        for edge, names in sorted(self._lanes.of_edge.items()):
            for name in sorted(names, key=lambda name: (len(name), name)):
                allowed = frozenset(lane.getAllowed(name))
                if allowed == {"pedestrian"}:
                    continue
                links = tuple((link[0], link[4]) for link in lane.getLinks(name))
                shape = tuple(lane.getShape(name))
                facts.append(
                    LaneFacts(
                        name, edge, lane.getLength(name), lane.getMaxSpeed(name),
                        lane.getWidth(name), shape, links, allowed,
                    )
                )  # fmt: skip
        return facts

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
        vehicles = self._sumo.vehicle
        return tuple(vehicles.getRoute(name)[vehicles.getRouteIndex(name) + 1 :])

    def route_index(self, name: str) -> int:
        """Place in its route of the edge that a vehicle is on."""
        return int(self._sumo.vehicle.getRouteIndex(name))

    def vehicle_class(self, name: str) -> str:
        """SUMO's class of a vehicle."""
        return str(self._sumo.vehicle.getVehicleClass(name))

    def take_over(self, name: str, *, checked: bool, changes: bool) -> None:
        """Let a vehicle do what is set, as far as SUMO's driver thinks it safe if ``checked``."""
        self._sumo.vehicle.setSpeedMode(name, _ALL_CHECKS if checked else _NO_CHECKS)
        self._sumo.vehicle.setLaneChangeMode(name, _ROUTE_ONLY if changes else _OWN_LANES)

    def release(self, name: str) -> None:
        """Give a vehicle back to SUMO's driver."""
        self.set_speed(name, -1.0)
        self._sumo.vehicle.setSpeedMode(name, _ALL_CHECKS)
        self._sumo.vehicle.setLaneChangeMode(name, _OWN_LANES)

    def change_lane(self, name: str, lanes: int, seconds: float) -> None:
        """Ask for a change of so many lanes to the left, for some seconds."""
        self._sumo.vehicle.changeLaneRelative(name, lanes, seconds)

    def put_on_lane(self, name: str, lane: str, pos: float) -> None:
        """Place the front of a vehicle on a lane of its route."""
        self._sumo.vehicle.moveTo(name, lane, pos)

    def put(self, name: str, x: float, y: float, angle_deg: float) -> None:
        """Place the front of a vehicle anywhere."""
        self._sumo.vehicle.moveToXY(name, "", -1, x, y, angle_deg, _EXACTLY, _NEAR)
