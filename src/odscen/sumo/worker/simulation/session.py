"""The only door to libsumo: one simulation per process, always closed.

libsumo keeps its simulation in the process, and a second ``libsumo.start`` silently drops the
first. :func:`open_session` is therefore a context manager that refuses a second one. Only the
worker process (:mod:`odscen.sumo.worker.simulate`) opens a session; SUMO's own words appear on that
process's file descriptors 1 and 2, see :mod:`odscen.sumo.worker.output_capture`.
"""

from __future__ import annotations

from collections import Counter
from contextlib import contextmanager, suppress
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from odscen.base.errors import SimulationError
from odscen.sumo.worker.simulation.curve_speeds import CurveSpeeds
from odscen.sumo.worker.simulation.driven_vehicles import DrivenVehicles
from odscen.sumo.worker.simulation.foreign_traffic import ForeignLights, ForeignTraffic, is_foreign
from odscen.sumo.worker.simulation.lateral_places import LateralPlaces
from odscen.sumo.worker.simulation.libsumo_import import import_libsumo
from odscen.sumo.worker.simulation.moved_actors import MovedActors
from odscen.sumo.worker.simulation.observed import (
    Collision,
    Front,
    Poses,
    RouteAhead,
    StepLists,
)
from odscen.sumo.worker.simulation.placed_vehicles import Placing
from odscen.sumo.worker.simulation.road_lanes import RoadLanes
from odscen.sumo.worker.simulation.stop_doors import StopDoors
from odscen.sumo.worker.simulation.stopped_vehicles import StoppedVehicles
from odscen.sumo.worker.simulation.switched_lights import SwitchedLights
from odscen.sumo.worker.simulation.turn_exits import TurnExits
from odscen.sumo.worker.simulation.turning_gaps import TurningGaps

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
    from pathlib import Path


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


_NO_CHANGES = 0
"""``setLaneChangeMode``: SUMO begins none."""
_BESIDE_END = 5.0
"""Metres before the end of an edge where a vehicle waits beside the road."""


class Session:
    """A running simulation. Made by :func:`open_session` only."""

    def __init__(self, sumo: Any) -> None:
        self._sumo = sumo
        self._simulation = sumo.simulation
        self._errors = sumo_errors(sumo)
        self._step = _native_function(sumo, "simulation", "step")
        self._time = _native_function(sumo, "simulation", "getTime")
        self._expected = _native_function(sumo, "simulation", "getMinExpectedNumber")
        self._vehicle, self._person = (
            (
                _native_function(sumo, domain, "getPosition3D"),
                _native_function(sumo, domain, "getAngle"),
            )
            for domain in ("vehicle", "person")
        )
        self._foreign: ForeignTraffic | None = None
        self._happenings = tuple(
            (_native_function(sumo, "simulation", count), _native_function(sumo, "simulation", ids))
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
            raise SimulationError(f"SUMO stopped at {self.time:g} s: {error}") from error

    def expected(self) -> int:
        """How many vehicles and persons are on the road or still to come; 0 only when none is.

        Those that other programs drive do not count.
        """
        return int(self._expected()) - self._count_strangers()

    def running(self) -> int:
        """How many vehicles and persons of the run are on the road now."""
        on_road = int(self._sumo.vehicle.getIDCount() + self._sumo.person.getIDCount())
        return on_road - self._count_strangers()

    def foreign_traffic(self) -> ForeignTraffic:
        """Road users that other programs drive."""
        if self._foreign is None:
            self._foreign = ForeignTraffic(self._sumo, self._errors, self.place, self.lanes)
        return self._foreign

    @cached_property
    def stop_doors(self) -> StopDoors:
        """Doors of vehicles at stops."""
        return StopDoors(self._sumo)

    @cached_property
    def foreign_lights(self) -> ForeignLights:
        """Traffic lights that other programs switch."""
        return ForeignLights(self._sumo)

    @cached_property
    def lanes(self) -> RoadLanes:
        """Lanes of the network."""
        return RoadLanes(self._sumo)

    @cached_property
    def stopped(self) -> StoppedVehicles:
        """Vehicles that are stopped, and why."""
        return StoppedVehicles(self._sumo, self._errors, self.lanes)

    @cached_property
    def turning_gaps(self) -> TurningGaps:
        """Gaps that those take who turn across oncoming traffic."""
        native = partial(_native_function, self._sumo)
        return TurningGaps(self._sumo, self._errors, self.lanes, native)

    @cached_property
    def lateral_places(self) -> LateralPlaces:
        """Where vehicles are beside the centres of their lanes."""
        native = partial(_native_function, self._sumo)
        return LateralPlaces(self._sumo, self._errors, self.lanes, native)

    @cached_property
    def curve_speeds(self) -> CurveSpeeds:
        """How fast those who want more than the limit go through curves."""
        native = partial(_native_function, self._sumo)
        return CurveSpeeds(self._sumo, self._errors, self.lanes, native)

    @cached_property
    def turn_exits(self) -> TurnExits:
        """Changes of lanes that wait until a vehicle has left its turn."""
        native = partial(_native_function, self._sumo)
        return TurnExits(self._sumo, self._errors, self.lanes, native)

    @cached_property
    def place(self) -> Placing:
        """Puts a vehicle where another program has driven it."""
        return Placing(self._sumo, self._errors, self.lanes)

    def _count_strangers(self) -> int:
        return 0 if self._foreign is None else len(self._foreign)

    def happened(self) -> StepLists | None:
        """What happened in the last step; ``None`` if nothing did, as in most."""
        # A list costs far more than its length, and most are empty.
        lists: list[Any] = [ids() if count() else () for count, ids in self._happenings]
        if self._foreign is not None:
            lists = [_drop_foreign_users(ids) for ids in lists]
        if not any(lists):
            return None
        fronts: dict[str, Front | None] = {}
        lists.append(fronts)
        step = StepLists(*lists)
        if step.collisions:
            touching = [Collision(c.collider, c.victim, c.type, c.lane) for c in step.collisions]
            step = step._replace(collisions=touching)
        for name in (
            *step.departed, *step.teleports_ended, *step.emergency_stops, *step.unparked
        ):  # fmt: skip
            fronts[name] = self._front_of(self._vehicle, name)
        for name in step.departed_persons:
            fronts[name] = self._front_of(self._person, name)
        return step

    def vehicle_front(self, vehicle: str) -> Front | None:
        """Pose of a vehicle on the road, ``None`` if it is not (or no longer) there."""
        return self._front_of(self._vehicle, vehicle)

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
        inside = vehicles.getLaneID(vehicle) in self.lanes.internal
        in_junction = self.lanes.of_edge[edges[0]][0] in self.lanes.internal
        return RouteAhead(edges[:in_junction], edges[in_junction:], inside)

    def has_departed(self, vehicle: str) -> bool:
        """Whether a vehicle that SUMO knows is on the road, or was."""
        return int(self._sumo.vehicle.getRouteIndex(vehicle)) >= 0

    def stop_edges(self, vehicle: str) -> tuple[str, ...]:
        """Edges of the stops that a vehicle has before it, in their order."""
        lane = self._sumo.lane.getEdgeID
        return tuple(lane(stop.lane) for stop in self._sumo.vehicle.getStops(vehicle))

    def park_until(self, vehicle: str, edge: str, until: float) -> bool:
        """Let a vehicle wait beside the end of an edge; false if SUMO refuses it.

        Parameters
        ----------
        until
            Simulated seconds.
        """
        api, lane = self._sumo.vehicle, self._sumo.lane
        if any(
            lane.getEdgeID(stop.lane) == edge and stop.until == until
            for stop in api.getStops(vehicle)
        ):
            return True
        kind = api.getVehicleClass(vehicle)
        lanes = enumerate(self.lanes.in_order(edge))
        index, own = next((pair for pair in lanes if self.lanes.admits(pair[1], kind)), (0, ""))
        if not own:
            return False
        place = max(lane.getLength(own) - _BESIDE_END, 1.0)
        parking = 1
        try:
            # Without a duration SUMO would hold it for ever, whatever ``until`` says.
            api.setStop(vehicle, edge, place, index, 0.0, parking, 0.0, until)
        except self._errors:
            return False
        return True

    def set_route(self, vehicle: str, edges: Sequence[str]) -> bool:
        """Give a vehicle another route from its edge on; false if SUMO refuses it."""
        try:
            self._sumo.vehicle.setRoute(vehicle, list(edges))
        except self._errors:
            return False
        self.turning_gaps.look_again(vehicle)
        return True

    def take_out(self, vehicle: str) -> None:
        """Take a vehicle out of the simulation."""
        with suppress(*self._errors):
            self._sumo.vehicle.remove(vehicle, self._sumo.REMOVE_VAPORIZED)

    def vehicle_poses(self) -> Poses:
        """Poses of all vehicles; 1.5 microseconds each, a fifth of what subscriptions cost."""
        return self._read_poses(self._sumo.vehicle, self._sumo.vehicle.getSignals)

    def person_poses(self) -> Poses:
        """Poses of all persons."""
        return self._read_poses(self._sumo.person, None)

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
        native = partial(_native_function, self._sumo)
        return MovedActors(self._sumo, self._errors, self.lanes, native, self.knows)

    def driven_vehicles(self) -> DrivenVehicles:
        """Hand of behaviour models on all vehicles."""
        native = partial(_native_function, self._sumo)
        return DrivenVehicles(self._sumo, self._errors, native, self.lanes)

    def switched_lights(self) -> SwitchedLights:
        """Hand of models that switch lights."""
        return SwitchedLights(self._sumo)

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
        loops, areas = self._detector_ids
        return {
            name: share(name) > 0.0 if name in loops else count(name) > 0
            for name in detectors
            if name in loops or name in areas
        }

    @cached_property
    def _detector_ids(self) -> tuple[frozenset[str], frozenset[str]]:
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

    @cached_property
    def lane_change_duration(self) -> float:
        """Seconds that a change of lanes takes; 0 where vehicles have it done in a step."""
        with suppress(*self._errors):
            return max(0.0, float(self._simulation.getOption("lanechange.duration")))
        return 0.0

    def hold_lanes(self, *, but: Collection[str]) -> None:
        """Let no vehicle begin a change of lanes any more, but those named.

        For the last seconds before the state is saved: SUMO's state does not say how far a change
        has come, and who is in one would stand on a lane again with the next step. What is held
        is not in the state either.
        """
        hold = self._sumo.vehicle.setLaneChangeMode
        for vehicle in self._sumo.vehicle.getIDList():
            if vehicle not in but:
                hold(vehicle, _NO_CHANGES)

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
            raise SimulationError(
                f"SUMO could not save its state at {self.time:g} s: {error}"
            ) from error

    def _read_poses(self, domain: Any, signals: Callable[[str], int] | None) -> Poses:
        import numpy as np

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

    def _front_of(self, pose: tuple[Any, Any], name: str) -> Front | None:
        place, direction = pose
        try:
            (x, y, *height), angle = place(name), direction(name)
        except self._errors:
            return None
        # SUMO's INVALID_DOUBLE_VALUE, -2^30, without a height: known, but not on the road.
        if abs(x) > 1e8 or not height:
            return None
        return Front(x, y, height[0], angle)


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
        raise SimulationError(
            "a simulation is running in this process already; libsumo holds only one"
        )
    sumo = import_libsumo()
    errors = sumo_errors(sumo)
    try:
        sumo.start(["sumo", *arguments])
    except errors as error:  # libsumo has closed by itself; closing again would crash
        raise SimulationError(f"SUMO refused to start: {error}") from error
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
            raise SimulationError(f"SUMO could not finish its outputs: {error}") from error
    finally:
        _open = False


def sumo_errors(sumo: Any) -> tuple[type[Exception], ...]:
    """Exceptions that libsumo raises; the two of its own have no common base."""
    return sumo.TraCIException, sumo.FatalTraCIError, RuntimeError


def _native_function(sumo: Any, domain: str, name: str) -> Any:
    """Return the C function of libsumo behind one of Python, which costs a call in every step."""
    getter = getattr(getattr(sumo, domain), name)
    return getattr(getattr(sumo, "_libsumo", None), f"{domain}_{name}", getter)


def _drop_foreign_users(happened: Sequence[Any]) -> list[Any]:
    """Leave out what happened to road users that other programs drive, but collisions."""
    return [name for name in happened if not (isinstance(name, str) and is_foreign(name))]
