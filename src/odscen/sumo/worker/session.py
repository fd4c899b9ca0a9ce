"""The only door to libsumo: one simulation per process, always closed.

libsumo keeps its simulation in the process, and a second ``libsumo.start`` silently drops the
first. :func:`open_session` is therefore a context manager that refuses a second one. Only the
worker process (:mod:`odscen.sumo.worker.simulate`) opens a session; SUMO's own words appear on that
process's file descriptors 1 and 2, see :mod:`odscen.sumo.worker.output_capture`.
"""

from __future__ import annotations

import math
import os
import sys
from collections import Counter, defaultdict
from contextlib import contextmanager, suppress
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from odscen.base.errors import SimulationError
from odscen.sumo.worker.detours import LaneLink
from odscen.sumo.worker.driven_vehicles import DrivenVehicles
from odscen.sumo.worker.foreign_traffic import ForeignLights, ForeignTraffic, is_foreign
from odscen.sumo.worker.moved_actors import MovedActors
from odscen.sumo.worker.observed import (
    Ahead,
    Front,
    Poses,
    RouteAhead,
    StepLists,
    StoppedVehicle,
)
from odscen.sumo.worker.stop_doors import StopDoors

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from pathlib import Path
    from types import ModuleType

    from odscen.sumo.worker.protocol import EgoPose


_UNCHECKED = 0
"""``setSpeedMode``: the speed that is set, whatever is safe, possible or permitted."""
_FAST = 200.0
"""m/s; no limit of a model, for a vehicle whose speed is set."""
_EDGES_AHEAD = 3
"""Edges that the route of a vehicle driven from outside has at least, its own included."""


_CLASSES = ("passenger", "delivery", "truck", "bus", "motorcycle", "bicycle")
"""SUMO's classes of our categories of vehicles."""
_NEAR_LANE = 10.0
"""Metres around a place in which SUMO looks for its lane; its own 100 m cost thrice as much."""
_CLOSE = 5.0
"""Metres that a stopped vehicle ahead may be away and be the reason for stopping."""
_BLOCKING = 10.0
"""Metres from the front to the middle of another body in a junction that may be the reason."""
_RED = ("r", "u")
"""States of a traffic light's link at which no vehicle goes."""
_STOPPED = 0.1
"""Speed, m/s, below which SUMO counts a vehicle as waiting."""


_HAPPENINGS = (
    ("getDepartedNumber", "getDepartedIDList"),
    ("getArrivedNumber", "getArrivedIDList"),
    ("getDepartedPersonNumber", "getDepartedPersonIDList"),
    ("getArrivedPersonNumber", "getArrivedPersonIDList"),
    ("getStartingTeleportNumber", "getStartingTeleportIDList"),
    ("getEndingTeleportNumber", "getEndingTeleportIDList"),
    ("getEmergencyStoppingVehiclesNumber", "getEmergencyStoppingVehiclesIDList"),
    ("getCollisions", "getCollisions"),
    ("getParkingStartingVehiclesNumber", "getParkingStartingVehiclesIDList"),
    ("getParkingEndingVehiclesNumber", "getParkingEndingVehiclesIDList"),
)
"""Getters of numbers and lists, as in :class:`StepLists`."""


class Session:
    """A running simulation. Made by :func:`open_session` only."""

    def __init__(self, sumo: Any) -> None:
        self._sumo = sumo
        self._simulation = sumo.simulation
        self._errors = sumo_errors(sumo)
        self._step = _native(sumo, "simulation", "step")
        self._time = _native(sumo, "simulation", "getTime")
        self._expected = _native(sumo, "simulation", "getMinExpectedNumber")
        self._vehicle, self._person = (
            (_native(sumo, domain, "getPosition3D"), _native(sumo, domain, "getAngle"))
            for domain in ("vehicle", "person")
        )
        self._foreign: ForeignTraffic | None = None
        self._happenings = tuple(
            (_native(sumo, "simulation", count), _native(sumo, "simulation", ids))
            for count, ids in _HAPPENINGS
        )

    @property
    def time(self) -> float:
        """Simulated seconds at the start of the next step."""
        return float(self._time())

    def step(self) -> float:
        """Advance by one step; simulated seconds then, at the start of the next one.

        Raises
        ------
        SimulationError
            If SUMO ends the simulation with an error.
        """
        try:
            self._step()
            return float(self._time())
        except self._errors as error:
            msg = f"SUMO stopped at {self.time:g} s: {error}"
            raise SimulationError(msg) from error

    def expected(self) -> int:
        """How many vehicles and persons are on the road or still to come; 0 only when none is.

        Those that other programs drive do not count.
        """
        return int(self._expected()) - self._strangers()

    def running(self) -> int:
        """How many vehicles and persons of the run are on the road now."""
        on_road = int(self._sumo.vehicle.getIDCount() + self._sumo.person.getIDCount())
        return on_road - self._strangers()

    def foreign_traffic(self) -> ForeignTraffic:
        """Road users that other programs drive."""
        if self._foreign is None:
            self._foreign = ForeignTraffic(self._sumo, self._errors, self.place)
        return self._foreign

    @cached_property
    def stop_doors(self) -> StopDoors:
        """Doors of vehicles at stops."""
        return StopDoors(self._sumo)

    @cached_property
    def foreign_lights(self) -> ForeignLights:
        """Traffic lights that other programs switch."""
        return ForeignLights(self._sumo)

    def _strangers(self) -> int:
        return 0 if self._foreign is None else len(self._foreign)

    def happened(self) -> StepLists | None:
        """What happened in the last step; ``None`` if nothing did, as in most."""
        # A list costs far more than its length, and most are empty.
        lists: list[Any] = [ids() if count() else () for count, ids in self._happenings]
        if self._foreign is not None:
            lists = [_of_the_run(ids) for ids in lists]
        if not any(lists):
            return None
        fronts: dict[str, Front | None] = {}
        lists.append(fronts)
        step = StepLists(*lists)
        for name in (
            *step.departed, *step.teleports_ended, *step.emergency_stops, *step.unparked
        ):  # fmt: skip
            fronts[name] = self._front(self._vehicle, name)
        for name in step.departed_persons:
            fronts[name] = self._front(self._person, name)
        return step

    def vehicle_front(self, vehicle: str) -> Front | None:
        """Pose of a vehicle on the road, ``None`` if it is not (or no longer) there."""
        return self._front(self._vehicle, vehicle)

    def vehicles(self) -> tuple[str, ...]:
        """Ids of all vehicles on the road."""
        return tuple(self._sumo.vehicle.getIDList())

    def waiting_vehicles(self) -> tuple[str, ...]:
        """Ids of the vehicles that wait for room to depart."""
        return tuple(self._simulation.getPendingVehicles())

    def vehicle_class(self, vehicle: str) -> str:
        """SUMO's class of a vehicle; empty if there is no such vehicle."""
        try:
            return str(self._sumo.vehicle.getVehicleClass(vehicle))
        except self._errors:
            return ""

    def route_ahead(self, vehicle: str) -> RouteAhead:
        """Route of a vehicle from its edge on, or whole if it is still to depart."""
        vehicles = self._sumo.vehicle
        edges = tuple(vehicles.getRoute(vehicle))[max(0, vehicles.getRouteIndex(vehicle)) :]
        inside = vehicles.getLaneID(vehicle) in self._internal_lanes
        in_junction = self._lanes_of_edge[edges[0]][0] in self._internal_lanes
        return RouteAhead(edges[:in_junction], edges[in_junction:], inside)

    def has_departed(self, vehicle: str) -> bool:
        """Whether a vehicle that SUMO knows is on the road, or was."""
        return int(self._sumo.vehicle.getRouteIndex(vehicle)) >= 0

    def stop_edges(self, vehicle: str) -> tuple[str, ...]:
        """Edges of the stops that a vehicle has before it, in their order."""
        lane = self._sumo.lane.getEdgeID
        return tuple(lane(stop.lane) for stop in self._sumo.vehicle.getStops(vehicle))

    def set_route(self, vehicle: str, edges: Sequence[str]) -> bool:
        """Give a vehicle another route from its edge on; false if SUMO refuses it."""
        try:
            self._sumo.vehicle.setRoute(vehicle, list(edges))
        except self._errors:
            return False
        return True

    def take_out(self, vehicle: str) -> None:
        """Take a vehicle out of the simulation."""
        with suppress(*self._errors):
            self._sumo.vehicle.remove(vehicle, self._sumo.REMOVE_VAPORIZED)

    def road_links(self) -> list[LaneLink]:
        """Return ways from edge to edge for vehicles, with the time that they take in free flow."""
        lane, everyone = self._sumo.lane, frozenset(_CLASSES)
        allowed = {
            name: frozenset(lane.getAllowed(name)) or everyone - {*lane.getDisallowed(name)}
            for name in lane.getIDList()
        }
        links = []
        for edge, own in self._lanes_of_edge.items():
            for name in own:
                if name in self._internal_lanes:
                    continue
                for link in lane.getLinks(name):
                    passed = [part for part in (link[4], link[0]) if part]
                    who = allowed[name].intersection(*(allowed[part] for part in passed))
                    time = sum(lane.getLength(part) / lane.getMaxSpeed(part) for part in passed)
                    links.append(LaneLink(edge, lane.getEdgeID(link[0]), time, who))
        return links

    def vehicle_poses(self) -> Poses:
        """Poses of all vehicles; 1.5 microseconds each, a fifth of what subscriptions cost."""
        return self._poses(self._sumo.vehicle, self._sumo.vehicle.getSignals)

    def person_poses(self) -> Poses:
        """Poses of all persons."""
        return self._poses(self._sumo.person, None)

    def vehicle_places(self, ids: Sequence[str]) -> list[tuple[str, float]]:
        """Lane of each vehicle (empty: none) and metres along it."""
        lane, pos = self._sumo.vehicle.getLaneID, self._sumo.vehicle.getLanePosition
        return [(lane(name), pos(name)) for name in ids]

    def person_places(self, ids: Sequence[str]) -> list[tuple[str, float]]:
        """Lane of each person (empty: none) and metres along it."""
        lane, pos = self._sumo.person.getLaneID, self._sumo.person.getLanePosition
        return [(lane(name), pos(name)) for name in ids]

    def moved_actors(self) -> MovedActors:
        """Hand of rules on single road users."""
        native = partial(_native, self._sumo)
        lanes = self._lanes_of_edge
        return MovedActors(self._sumo, self._errors, lanes, self._admits, native, self.knows)

    def driven_vehicles(self) -> DrivenVehicles:
        """Hand of behaviour models on all vehicles."""
        native = partial(_native, self._sumo)
        return DrivenVehicles(self._sumo, self._errors, native, self._lanes_of_edge)

    def place(self, vehicle: str, at: EgoPose, *, again: bool = False) -> bool:
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
        lanes = self._lanes_of_edge
        if lanes[edges[0]][0] in self._internal_lanes:  # a route cannot be changed in a junction
            return
        links, lane_edge = self._sumo.lane.getLinks, self._sumo.lane.getEdgeID
        kind = self._sumo.vehicle.getVehicleClass(vehicle)
        while len(edges) < _EDGES_AHEAD:
            onward = [
                lane_edge(link[0])
                for lane in lanes[edges[-1]]
                for link in links(lane)
                if self._admits(link[0], kind)
            ]
            if not onward:
                break
            edges.append(onward[0])
        if len(edges) > len(route):
            self._sumo.vehicle.setRoute(vehicle, edges)

    def _admits(self, lane: str, kind: str) -> bool:
        allowed = self._sumo.lane.getAllowed(lane)
        return not allowed or kind in allowed

    def lane_lengths(self) -> dict[str, dict[str, float]]:
        """Lanes that vehicles may use, by edge, and their lengths in metres; junctions as well."""
        lane = self._sumo.lane
        on_foot = ("pedestrian",)
        lengths = {
            edge: {
                name: lane.getLength(name)
                for name in lanes
                if tuple(lane.getAllowed(name)) != on_foot
            }
            for edge, lanes in self._lanes_of_edge.items()
        }
        return {edge: own for edge, own in lengths.items() if own}

    @cached_property
    def _lanes_of_edge(self) -> dict[str, list[str]]:
        """Lanes of each edge, as SUMO lists them."""
        edge_of, lanes = self._sumo.lane.getEdgeID, defaultdict(list)
        for name in self._sumo.lane.getIDList():
            lanes[edge_of(name)].append(name)
        return dict(lanes)

    @cached_property
    def _internal_lanes(self) -> frozenset[str]:
        """Lanes for vehicles inside junctions: those that connections lead over."""
        lane = self._sumo.lane
        links = (link for name in lane.getIDList() for link in lane.getLinks(name))
        return frozenset(link[4] for link in links if link[4])

    def vehicles_by_lane(self) -> dict[str, int]:
        """How many vehicles have their front on each lane, of those that have any."""
        lane = self._sumo.vehicle.getLaneID
        counts = Counter(lane(name) for name in self._sumo.vehicle.getIDList())
        return {name: counts[name] for name in sorted(counts) if name}

    def light_states(self) -> dict[str, str]:
        """State of each traffic light, a letter per link."""
        state = self._sumo.trafficlight.getRedYellowGreenState
        return {name: state(name) for name in self._sumo.trafficlight.getIDList()}

    def occupied(self, detectors: Iterable[str]) -> dict[str, bool]:
        """Whether a road user was on each of these loops and areas in the last step.

        Those that SUMO does not have are left out.
        """
        share = self._sumo.inductionloop.getLastStepOccupancy
        count = self._sumo.lanearea.getLastStepVehicleNumber
        loops, areas = self._detectors
        return {
            name: share(name) > 0.0 if name in loops else count(name) > 0
            for name in detectors
            if name in loops or name in areas
        }

    @cached_property
    def _detectors(self) -> tuple[frozenset[str], frozenset[str]]:
        """Ids of loops and of areas."""
        loops, areas = self._sumo.inductionloop, self._sumo.lanearea
        return frozenset(loops.getIDList()), frozenset(areas.getIDList())

    def present(self) -> set[str]:
        """Ids of all vehicles and persons on the road, and of vehicles that wait for room."""
        waiting = self._simulation.getPendingVehicles()
        return {*self._sumo.vehicle.getIDList(), *self._sumo.person.getIDList(), *waiting}

    def knows(self, name: str) -> bool:
        """Whether there is such a vehicle or person, on the road or still to come.

        :meth:`present` does not say right after a state is loaded: SUMO lists vehicles that wait
        for room only after its first step.
        """
        for domain in (self._sumo.vehicle, self._sumo.person):
            with suppress(*self._errors):
                domain.getTypeID(name)
                return True
        return False

    def save(self, path: Path) -> None:
        """Write the state to ``path``, which ends in ``.xml.gz``.

        Raises
        ------
        SimulationError
            If SUMO cannot.
        """
        try:
            self._simulation.saveState(str(path))
        except self._errors as error:
            msg = f"SUMO could not save its state at {self.time:g} s: {error}"
            raise SimulationError(msg) from error

    def stopped(self, seconds: float) -> list[StoppedVehicle]:
        """Vehicles that have been stopped for so long; a microsecond for each on the road."""
        vehicle = self._sumo.vehicle
        found = []
        for name in vehicle.getIDList():
            waited = 0.0 if is_foreign(name) else vehicle.getWaitingTime(name)
            if waited >= seconds and (lane := vehicle.getLaneID(name)):
                found.append(StoppedVehicle(name, lane, vehicle.getLanePosition(name), waited))
        return found

    def ahead(self, name: str) -> Ahead | None:
        """What a vehicle has before it; ``None`` if it is not on the road."""
        vehicle = self._sumo.vehicle
        try:
            links = vehicle.getNextLinks(name)
            leader = self._stopped_leader(name, float(links[0][7]) if links else 0.0)
            at_end = vehicle.getRouteIndex(name) >= len(vehicle.getRoute(name)) - 1
            lane = str(vehicle.getLaneID(name))
            if leader is None and not at_end and (wrong := self._leads_astray(name)) is not None:
                return Ahead(False, "", False, None, people=False, beside=wrong)
            inside = lane in self._internal_lanes
            goes = bool(links) and links[0][5] not in _RED  # else that is the reason
            through = lane if inside else str(links[0][4]) if goes else ""
            if leader is None and through:
                leader = self._blocking_vehicle(name, through)
        except self._errors:
            return None
        if not links:  # inside a junction the link out of it is not among them
            onwards = at_end or inside
            return Ahead(onwards, "", onwards, leader, people=False)
        link = links[0]
        # approachedLane, hasPrio, isOpen, hasFoe, approachedInternal, state, direction, length
        people = bool(link[3]) and self._people_cross(link[4])
        return Ahead(True, str(link[5]), bool(link[2]), leader, people)

    def _leads_astray(self, name: str) -> bool | None:
        """Whether another lane continues along a vehicle's route; ``None`` if its own lane does."""
        vehicle, lanes = self._sumo.vehicle, self._sumo.lane
        lane, index = vehicle.getLaneID(name), vehicle.getRouteIndex(name)
        if not lane or lane in self._internal_lanes:
            return None
        own = self._lanes_of_edge[lanes.getEdgeID(lane)]
        following = vehicle.getRoute(name)[index + 1]
        leading = {
            one
            for one in own
            if any(lanes.getEdgeID(link[0]) == following for link in lanes.getLinks(one))
        }
        if lane not in leading:
            return bool(leading)
        # It may lead on there and no further: SUMO wants another lane, so many to the left.
        wants = next((one[3] for one in vehicle.getBestLanes(name) if one[0] == lane), 0)
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

    def _poses(self, domain: Any, signals: Callable[[str], int] | None) -> Poses:
        ids = domain.getIDList()
        position, angle, speed = domain.getPosition, domain.getAngle, domain.getSpeed
        places = np.array([position(name) for name in ids], dtype=np.float64).reshape(-1, 2)
        bits = [signals(name) for name in ids] if signals else [0] * len(ids)
        return Poses(
            ids,
            places[:, 0],
            places[:, 1],
            np.array([angle(name) for name in ids], dtype=np.float64),
            np.array([speed(name) for name in ids], dtype=np.float64),
            np.array(bits, dtype=np.int64),
        )

    def _front(self, pose: tuple[Any, Any], name: str) -> Front | None:
        place, direction = pose
        try:
            (x, y, z), angle = place(name), direction(name)
        except self._errors:
            return None
        if abs(x) > 1e8:  # SUMO's INVALID_DOUBLE_VALUE, -2^30: known, but not on the road
            return None
        return Front(x, y, z, angle)


_open = False


@contextmanager
def open_session(arguments: Sequence[str]) -> Iterator[Session]:
    """Start SUMO with these command-line arguments (without its name); close it at the end.

    Raises
    ------
    SimulationError
        If a session is open in this process already (that one lives on), or SUMO refuses to start.
    """
    global _open  # noqa: PLW0603 - libsumo itself is one global simulation
    if _open:
        msg = "a simulation is running in this process already; libsumo holds only one"
        raise SimulationError(msg)
    sumo = import_libsumo()
    errors = sumo_errors(sumo)
    try:
        sumo.start(["sumo", *arguments])
    except errors as error:  # libsumo has closed by itself; closing again would crash
        msg = f"SUMO refused to start: {error}"
        raise SimulationError(msg) from error
    _open = True
    try:
        yield Session(sumo)
    except BaseException:
        with suppress(*errors):  # the first error is the one to report
            sumo.close()
        raise
    else:
        try:
            sumo.close()  # writes what is left of the outputs
        except errors as error:
            msg = f"SUMO could not finish its outputs: {error}"
            raise SimulationError(msg) from error
    finally:
        _open = False


def sumo_errors(sumo: Any) -> tuple[type[Exception], ...]:
    """Exceptions that libsumo raises; the two of its own have no common base."""
    return sumo.TraCIException, sumo.FatalTraCIError, RuntimeError


def _native(sumo: Any, domain: str, name: str) -> Any:
    """Return the C function of libsumo behind one of Python, which costs a call in every step."""
    getter = getattr(getattr(sumo, domain), name)
    return getattr(getattr(sumo, "_libsumo", None), f"{domain}_{name}", getter)


def _of_the_run(happened: Sequence[Any]) -> list[Any]:
    """Leave out what happened to road users that other programs drive, but collisions."""
    return [one for one in happened if not (isinstance(one, str) and is_foreign(one))]


def import_libsumo() -> Any:
    """Import libsumo with stdout kept clean.

    With pyarrow importable libsumo prints a warning about Arrow to stdout when imported, which
    would break output that a program reads; it goes to stderr instead.
    """
    sys.stdout.flush()
    kept = os.dup(1)
    # It imports sumolib, for a few names, and that pyproj, which takes longer than a short run.
    unused = "pyproj" not in sys.modules and "sumolib" not in sys.modules
    if unused:
        sys.modules["pyproj"] = cast("ModuleType", None)  # how Python itself says: not there
    try:
        os.dup2(2, 1)
        import libsumo

        sys.stdout.flush()
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        if unused:
            del sys.modules["pyproj"]
    return libsumo
