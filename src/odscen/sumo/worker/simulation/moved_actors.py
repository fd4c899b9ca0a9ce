"""Single road users read and moved for rules, in SUMO's frame; only a session hands this out."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.sumo.worker.simulation.lane_lines import LaneLines

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from odscen.sumo.realize.routes_file import HeldActor
    from odscen.sumo.worker.simulation.road_lanes import RoadLanes

_ALL_CHECKS, _SAFE, _NO_CHECKS = 31, 95, 96
"""``setSpeedMode``: SUMO's own; safe, but faster than the limit; what is set and nothing else."""
_OWN_LANES, _ROUTE_ONLY = 1621, 1537
"""``setLaneChangeMode``: SUMO's own; only changes that the route needs."""
_NEAR = 12.0
"""Metres around a place in which SUMO looks for its lane."""
_FREE, _ON_FOOT = 2, 6
"""``keepRoute``: exactly there, off the route and the road as well; of persons seen by drivers."""
_WALKER_WIDTH = 1.0
_NOWHERE = 1e8
_INSIDE = 0.1
"""Metres that a body has to be over a lane to be on it."""
_NEAR_END = 2.0
"""Metres before the end of a lane at which a vehicle goes on along it at the latest."""
_ONWARD = 600.0
"""Metres for which it is led on."""
_TURNS = "srlt"
"""Directions of links, the first of them first."""
_RIGHT_OF_WAY, _RED = 8, 16
"""Bits of ``setSpeedMode``."""

_NOW = -3.0
"""``depart`` of a person that is added while the simulation runs."""
_GREEN = "gG"
DARK = "off"
"""Program of a light that is switched off."""
LIGHT_BITS = {
    "right": 1, "left": 2, "hazard": 4, "brake": 8, "front": 16, "fog": 32, "high_beam": 64,
    "emergency": 2048,
}  # fmt: skip
"""Bits of ``setSignals``."""

_MORE = ("getAcceleration", "getDistance", "getLaneID", "getLateralLanePosition")
"""Getters of :class:`SeenVehicle` beyond how it moves, in its order."""


class SeenVehicle(NamedTuple):
    """A vehicle: centre of its front; metres since departure; metres left of its lane."""

    x: float
    y: float
    angle_deg: float
    speed: float
    acceleration: float
    travelled: float
    lane: str
    left: float


class SeenPerson(NamedTuple):
    """A person: centre of its front."""

    x: float
    y: float
    angle_deg: float
    speed: float
    lane: str


class SavedWalk(NamedTuple):
    """Where a person was walking to before it was moved: edges, and metres along the last."""

    edges: tuple[str, ...]
    arrival: float


class MovedActors:
    """Reads and moves road users by name.

    Attributes
    ----------
    knows
        Says whether SUMO has a vehicle or person of a name, on the road or not.
    lane_lines
        Where lanes lead.
    """

    def __init__(
        self,
        sumo: Any,
        errors: tuple[type[Exception], ...],
        lanes: RoadLanes,
        native: Callable[[str, str], Callable[[str], Any]],
        knows: Callable[[str], bool],
    ) -> None:
        self.knows = knows
        self.lane_lines = LaneLines(sumo, lanes)
        self._position = native("vehicle", "getPosition")
        self._angle, self._speed = native("vehicle", "getAngle"), native("vehicle", "getSpeed")
        self._more = tuple(native("vehicle", getter) for getter in _MORE)
        self._sumo = sumo
        self._errors = errors
        self._lanes = lanes

    def motion(self, name: str) -> tuple[float, float, float, float] | None:
        """X, y, angle (degrees) and speed of a vehicle, ``None`` if it is not on the road."""
        try:
            x, y = self._position(name)
            if x > _NOWHERE or x < -_NOWHERE:
                return None
            return x, y, self._angle(name), self._speed(name)
        except self._errors:
            return None

    def vehicle(self, name: str) -> SeenVehicle | None:
        """A vehicle, ``None`` if it is not on the road."""
        moves = self.motion(name)
        if moves is None:
            return None
        return SeenVehicle(*moves, *[getter(name) for getter in self._more])

    def person(self, name: str) -> SeenPerson | None:
        """A person, ``None`` if it is not on the road."""
        persons = self._sumo.person
        try:
            x, y = persons.getPosition(name)
            if abs(x) > _NOWHERE:
                return None
            return SeenPerson(
                x, y, persons.getAngle(name), persons.getSpeed(name), persons.getLaneID(name)
            )
        except self._errors:
            return None

    def lane_of(self, name: str, *, person: bool) -> str:
        """Lane that a road user is on; empty if it is on none."""
        return str((self._sumo.person if person else self._sumo.vehicle).getLaneID(name))

    def edge_of(self, lane: str) -> str:
        """Edge of a lane."""
        return str(self._sumo.lane.getEdgeID(lane))

    def lane_width(self, lane: str) -> float:
        """Metres."""
        return float(self._sumo.lane.getWidth(lane))

    def drive(
        self,
        vehicle: str,
        speed: float | None,
        *,
        exact: bool = False,
        ignore_red: bool = False,
        ignore_right_of_way: bool = False,
    ) -> None:
        """Set the speed of the next step, and what is not heeded; ``None`` is SUMO's own speed."""
        vehicles = self._sumo.vehicle
        mode = _ALL_CHECKS if speed is None else _NO_CHECKS if exact else _SAFE
        mode &= ~(_RED * ignore_red | _RIGHT_OF_WAY * ignore_right_of_way)
        vehicles.setSpeedMode(vehicle, mode)
        vehicles.setSpeed(vehicle, -1.0 if speed is None else speed)

    def fastest(self, vehicle: str) -> float:
        """Highest speed that a vehicle's type allows, m/s."""
        return float(self._sumo.vehicle.getMaxSpeed(vehicle))

    def gain(self, vehicle: str) -> float:
        """Most that a vehicle accelerates by itself, m/s²."""
        return float(self._sumo.vehicle.getAccel(vehicle))

    def limit(self, vehicle: str, speed: float) -> None:
        """Set the highest speed that a vehicle can go, m/s."""
        self._sumo.vehicle.setMaxSpeed(vehicle, speed)

    def keep_lane(self, vehicle: str, *, keeps: bool) -> None:
        """Let a vehicle change lanes only where its route needs it, or as SUMO likes."""
        self._sumo.vehicle.setLaneChangeMode(vehicle, _ROUTE_ONLY if keeps else _OWN_LANES)

    def put_vehicle(self, vehicle: str, x: float, y: float, angle_deg: float) -> None:
        """Place the front of a vehicle for the next step."""
        self._sumo.vehicle.moveToXY(vehicle, "", -1, x, y, angle_deg, _FREE, _NEAR)

    def put_person(
        self, person: str, x: float, y: float, angle_deg: float, *, only_on_lanes: bool = False
    ) -> None:
        """Place a person for the next step, on a road as well; drivers brake for it.

        With ``only_on_lanes`` SUMO looks for a lane on those of cars only. It ends in a fault where
        it takes a walking area that is not on the way of the person, but a person that it has not
        followed does not find back to its walk.
        """
        beside = only_on_lanes and self.off_lanes(x, y, width=_WALKER_WIDTH)
        near = 0.0 if beside else 100.0
        self._sumo.person.moveToXY(person, "", x, y, angle_deg, _ON_FOOT, near)

    def walk_speed(self, person: str, speed: float) -> None:
        """Set the speed at which a person walks, m/s."""
        self._sumo.person.setSpeed(person, speed)

    def saved_walk(self, person: str) -> SavedWalk:
        """Where a person is walking to."""
        stage = self._sumo.person.getStage(person)
        return SavedWalk(tuple(stage.edges), float(stage.arrivalPos))

    def resume_walk(self, person: str, walk: SavedWalk) -> bool:
        """Send a person on foot from where it is to where it was going; false if it cannot.

        SUMO ends in a fault where a person waits on an edge without sidewalk, so that a walk is
        found before it gives up the old one.
        """
        sumo, persons = self._sumo, self._sumo.person
        try:
            here = persons.getRoadID(person)
            goal = walk.edges[-1]
            if here in walk.edges:
                edges = walk.edges[walk.edges.index(here) :]
            else:
                stages = sumo.simulation.findIntermodalRoute(
                    here, goal, "", -1.0, 0, -1.0, persons.getLanePosition(person), walk.arrival
                )
                edges = tuple(edge for stage in stages for edge in stage.edges)
            if not edges or not self._is_walkable(edges[0]):
                return False
            persons.removeStages(person)
            persons.appendWalkingStage(person, list(edges), walk.arrival)
        except self._errors:
            return False
        return True

    def _is_walkable(self, edge: str) -> bool:
        return any(self._lanes.admits(lane, "pedestrian") for lane in self._lanes.of_edge[edge])

    def goal_edge(self, vehicle: str) -> str:
        """Edge on which the route of a vehicle ends."""
        return str(self._sumo.vehicle.getRoute(vehicle)[-1])

    def lead_to(self, vehicle: str, edge: str, *, through: bool = False) -> bool:
        """Give a vehicle a route to an edge, and beyond it if ``through``; false if there is none.

        Beyond, so that it does not end its trip before it is where it is to arrive.
        """
        vehicles, links = self._sumo.vehicle, self._sumo.lane.getLinks
        kind = vehicles.getVehicleClass(vehicle)
        beyond = next(
            (
                self._sumo.lane.getEdgeID(link[0])
                for lane in self._lanes.of_edge.get(edge, ())
                for link in (links(lane) if through and self._lanes.admits(lane, kind) else ())
                if self._lanes.admits(link[0], kind)
            ),
            None,
        )
        try:
            vehicles.setVia(vehicle, [edge] if beyond is not None else [])
            vehicles.changeTarget(vehicle, beyond or edge)
        except self._errors:
            return False
        return edge in vehicles.getRoute(vehicle)

    def follow_lane(self, vehicle: str, *, within: float) -> None:
        """Lead a vehicle on along its lane, straight on at forks, if its route leaves that.

        Only so many metres before the end of the lane, where SUMO would stop it dead; until then
        it may still change lanes. Its trip ends where that lane ends.
        """
        vehicles, lanes = self._sumo.vehicle, self._sumo.lane
        lane, route = vehicles.getLaneID(vehicle), vehicles.getRoute(vehicle)
        row = vehicles.getRouteIndex(vehicle)
        if not lane or lane in self._lanes.internal or not 0 <= row < len(route) - 1:
            return
        if lanes.getLength(lane) - vehicles.getLanePosition(vehicle) > within + _NEAR_END:
            return
        kind = vehicles.getVehicleClass(vehicle)
        onward = self._lanes.onwards(lane, kind)
        leads_on = any(best[0] == lane and best[4] for best in vehicles.getBestLanes(vehicle))
        if not onward or leads_on:
            return
        edges = [lanes.getEdgeID(lane)]
        metres = 0.0
        while onward and metres < _ONWARD:
            ways = {link[0]: _TURNS.find(link[6].lower()) for link in lanes.getLinks(lane)}
            lane, edge = min(onward, key=lambda there: ways[there[0]] % len(_TURNS))
            if edge in edges:
                break
            edges.append(edge)
            metres += lanes.getLength(lane)
            onward = self._lanes.onwards(lane, kind)
        vehicles.setRoute(vehicle, edges)

    def arrive(self, vehicle: str) -> None:
        """End the trip of a vehicle where it is."""
        self._sumo.vehicle.remove(vehicle, self._sumo.REMOVE_ARRIVED)

    def insert(self, name: str, held_actor: HeldActor, speed: float | None) -> float | None:
        """Let a road user depart as soon as there is room; ``None`` if SUMO cannot.

        Gives the speed at which it departs: a vehicle at no higher one than SUMO takes there, see
        :meth:`begin_at`; ``inf`` where SUMO chooses.
        """
        own = held_actor.attributes
        try:
            if held_actor.person:
                persons = self._sumo.person
                pos = float(own["departPos"])
                persons.add(name, held_actor.edges[0], pos, _NOW, own["type"])
                persons.appendWalkingStage(name, list(held_actor.edges), float(own["arrivalPos"]))
                return math.inf
            self._sumo.route.add(f"{name} appears", held_actor.edges)
            if speed is None and own["departSpeed"] == "avg":
                self._add_vehicle(name, held_actor, "avg")
                return math.inf
        except self._errors:
            return None
        wanted = float(own["departSpeed"]) if speed is None else speed
        # From rest where the limit is that of a turn, or only kept by its own factor, which it gets
        # when it is there.
        for begin in dict.fromkeys((min(wanted, float(own["mostSpeed"])), 0.0)):
            try:
                self._add_vehicle(name, held_actor, f"{begin:.4f}")
            except self._errors:
                continue
            return begin
        return None

    def _add_vehicle(self, name: str, held_actor: HeldActor, begin: str) -> None:
        own = held_actor.attributes
        self._sumo.vehicle.add(
            name, f"{name} appears", own["type"], "now", own["departLane"], own["departPos"],
            begin, own["arrivalLane"], own["arrivalPos"],
        )  # fmt: skip
        self._sumo.vehicle.setSpeedFactor(name, float(own["speedFactor"]))

    def begin_at(self, vehicle: str, speed: float) -> None:
        """Let a vehicle that has just departed have another speed."""
        self._sumo.vehicle.setPreviousSpeed(vehicle, speed)

    def say_speed(self, vehicle: str, speed: float) -> None:
        """Let another speed be that of the step that has been made, if a vehicle is still there."""
        with suppress(*self._errors):
            self._sumo.vehicle.setPreviousSpeed(vehicle, speed)

    def show_lights(self, vehicle: str, lights: Sequence[str] | None) -> None:
        """Set the lights of a vehicle, or give them back to the driver."""
        bits = -1 if lights is None else sum(LIGHT_BITS[name] for name in lights)
        self._sumo.vehicle.setSignals(vehicle, bits)

    def program(self, light: str) -> str:
        """Program that a traffic light runs."""
        return str(self._sumo.trafficlight.getProgram(light))

    def run_program(self, light: str, program: str) -> None:
        """Let a traffic light run a program; :data:`DARK` is none."""
        self._sumo.trafficlight.setProgram(light, program)

    def jump_to_green(self, light: str, link: int) -> bool:
        """Let the program of a light resume where a link has green next; false if it never has."""
        lights = self._sumo.trafficlight
        own = lights.getProgram(light)
        phases = next(
            (
                getAllProgramLogic.phases
                for getAllProgramLogic in lights.getAllProgramLogics(light)
                if getAllProgramLogic.programID == own
            ),
            (),
        )
        now = lights.getPhase(light)
        for ahead in range(len(phases)):
            number = (now + ahead) % len(phases)
            if phases[number].state[link] in _GREEN:
                if ahead:
                    lights.setPhase(light, number)
                return True
        return False

    def remove(self, name: str, *, person: bool) -> None:
        """Take a road user out of the simulation."""
        if person:
            self._sumo.person.removeStages(name)
        else:
            self._sumo.vehicle.remove(name)

    def driving_distance(self, vehicle: str, edge: str, pos: float, lane: int = 0) -> float | None:
        """Metres from a vehicle's front along its route; ``None`` if it does not lead there."""
        try:
            distance = float(self._sumo.vehicle.getDrivingDistance(vehicle, edge, pos, lane))
        except self._errors:
            return None
        return distance if abs(distance) < _NOWHERE else None

    def is_in_junction(self, edge: str) -> bool:
        """Whether an edge leads over a junction."""
        return not self._lanes.internal.isdisjoint(self._lanes.of_edge[edge])

    def road_place(self, vehicle: str) -> tuple[str, float, int]:
        """Edge of a vehicle, metres along it, and its lane."""
        vehicles = self._sumo.vehicle
        return (
            vehicles.getRoadID(vehicle),
            vehicles.getLanePosition(vehicle),
            vehicles.getLaneIndex(vehicle),
        )

    def nearest_road(self, x: float, y: float) -> tuple[str, float, int]:
        """Edge for cars that is nearest, metres along it, and lane."""
        edge, pos, lane = self._sumo.simulation.convertRoad(x, y, False, "passenger")
        return edge, pos, lane

    def off_lanes(self, x: float, y: float, *, width: float) -> bool:
        """Whether a body of some width would be beside all lanes: SUMO cannot let it begin there.

        It ends in a fault where a vehicle that has not departed is moved off its lanes.
        """
        edge, pos, lane = self.nearest_road(x, y)
        if not edge:
            return True
        at = self._sumo.simulation.convert2D(edge, pos, lane)
        return (
            math.dist(at, (x, y))
            > (self.lane_width(self._lanes.in_order(edge)[lane]) + width) / 2.0 - _INSIDE
        )

    def light_letter(self, light: str, link: int) -> str:
        """What a link of a traffic light shows."""
        return str(self._sumo.trafficlight.getRedYellowGreenState(light)[link])

    def bodies_near(self, lane: str) -> list[tuple[str, bool]]:
        """Vehicles and persons on the edge of a lane, with whether each is a person."""
        edge = self._sumo.lane.getEdgeID(lane)
        on = self._sumo.edge
        vehicles = [(name, False) for name in on.getLastStepVehicleIDs(edge)]
        return vehicles + [(name, True) for name in on.getLastStepPersonIDs(edge)]

    def collisions(self) -> set[frozenset[str]]:
        """Pairs that SUMO itself has seen collide in the last step."""
        collisions = self._sumo.simulation.getCollisions()
        return {frozenset((collision.collider, collision.victim)) for collision in collisions}
