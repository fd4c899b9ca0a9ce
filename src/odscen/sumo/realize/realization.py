"""From a scenario to the files that SUMO runs, and the plan that the run is held against.

Pure: the scenario, the map's graph and its SUMO network go in, texts come out, the same for the
same input. Type, speed factor, route and place of all are written out; nothing is left to
SUMO's random numbers but the dawdling of drivers.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from odscen.base.categories import DEFAULT_BODY, Body, Category
from odscen.base.errors import ScenarioError
from odscen.lanegraph.query import node_id, walk_node_id
from odscen.lanegraph.shortest_paths import Router
from odscen.results.records.run_records import Plan, PlannedActor
from odscen.scenario.checks.signal_timing import signal_problems
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.rules_document import appearing_actors
from odscen.scenario.placing.region import Region
from odscen.scenario.sampling.redrawn_traffic import redrawn
from odscen.scenario.signals.detectors import without_detectors
from odscen.sumo.folder.layout import (
    CLOSURES_FILE,
    CONFIG_FILE,
    MEASURES_FILE,
    REGION_FILE,
    ROUTES_FILE,
    SIGNALS_FILE,
    STOPS_FILE,
    STORY_FILE,
)
from odscen.sumo.realize.departures import demand_users, road_users
from odscen.sumo.realize.driving import KINDS, driver, factor_of, kind_of
from odscen.sumo.realize.light_realization import realized_lights
from odscen.sumo.realize.light_views import scenario_lights
from odscen.sumo.realize.measure_files import interval_of, measures_xml
from odscen.sumo.realize.program_files import signals_xml
from odscen.sumo.realize.recording import region_xml
from odscen.sumo.realize.route_choice.chosen_paths import RoutesOfDemand
from odscen.sumo.realize.route_planner import NoRouteError, Route, RoutePlanner
from odscen.sumo.realize.routes_file import RoutesFile
from odscen.sumo.realize.rules.story_files import story_plan
from odscen.sumo.realize.run_settings import AS_DESIGNED
from odscen.sumo.realize.sumocfg import SSM_PARAMETER, SumocfgSettings, sumo_config
from odscen.sumo.realize.traffic_measures.breakdowns import breakdowns
from odscen.sumo.realize.traffic_measures.measure_actions import (
    MeasureActions,
    measure_actions,
)
from odscen.sumo.realize.traffic_measures.signal_outages import with_outages
from odscen.sumo.realize.traffic_measures.study_stations import planned_stations
from odscen.sumo.realize.transit.line_vehicles import line_users
from odscen.sumo.realize.transit.stop_places import left_out, stop_places, stops_xml
from odscen.sumo.realize.usable import usable_places
from odscen.sumo.realize.walk_planner import Walk, WalkPlanner
from odscen.sumo.realize.weather_effects import NO_EFFECT, weather_effect

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.base.arrays import Int32Array
    from odscen.results.records.light_programs import LightProgram
    from odscen.scenario.document.scenario_document import Environment, Scenario, Simulation
    from odscen.sumo.realize.driving import Driver
    from odscen.sumo.realize.light_realization import RealizedLight
    from odscen.sumo.realize.road_user import RoadUser
    from odscen.sumo.realize.run_settings import RunSettings, SliceLength
    from odscen.sumo.realize.sumo_map import SumoMap
    from odscen.sumo.realize.transit.stop_places import StopPlace
    from odscen.sumo.realize.weather_effects import WeatherEffect

UNKNOWN_LIMIT = 13.89
"""Speed (m/s) that free-flow times assume where the map gives no limit: 50 km/h."""

_HOUR = 3600.0
_SLICES, _MOST_HOURS = 6, 4


class ModelSizes(Protocol):
    """What realization asks of the asset catalogue."""

    def dimensions(self, model: str) -> Body | None:
        """Size of a model, ``None`` if there is no such model."""

    def electric(self, model: str) -> bool:
        """Whether a model has no exhaust; false if there is no such model."""

    def weather(self, preset: str) -> Mapping[str, float] | None:
        """Parameters of a weather preset, ``None`` if there is no such preset."""


@dataclass(frozen=True, slots=True)
class Realization:
    """SUMO files by name, the plan, and what could not be done as designed.

    ``problems`` name actors that are in the plan but not in the files, because the SUMO network has
    no route for them; ``notes`` name routes that had to be repaired, and demand that was not met.
    ``lights`` say what each traffic light shows.
    """

    files: dict[str, str]
    plan: Plan
    problems: tuple[str, ...]
    notes: tuple[str, ...]
    lights: tuple[LightProgram, ...] = ()


def realize(
    scenario: Scenario,
    sumo_map: SumoMap,
    assets: ModelSizes | None = None,
    *,
    settings: RunSettings = AS_DESIGNED,
    assigned: Mapping[str, Int32Array] | None = None,
) -> Realization:
    """Derive SUMO files and plan from a scenario.

    Parameters
    ----------
    assets
        Knows the size of models and the parameters of weather presets; without it all bodies are
        their category's and only single parameters of the environment count.
    settings
        How it is run; what they leave open is the scenario's own.
    assigned
        Paths on the lane graph of trips whose routes were found before, by the trip's id.

    Raises
    ------
    ScenarioError
        With every actor and flow whose spawn or goal is not usable, or with every timing of a
        traffic light that is not possible.
    """
    refuse_errors(signal_problems(scenario.signals, scenario_lights(sumo_map)))
    scenario = as_run(scenario, settings)
    recording, (until, step_length) = settings.recorded, settings.times(scenario)
    analysis = settings.analysis(scenario)
    stations, unplaced = planned_stations(scenario, sumo_map)
    region = Region.of(sumo_map.graph, scenario.roi)
    users, unmet = all_road_users(scenario, sumo_map, region, until=until)
    _refuse_twins(users)
    effect = _effect(scenario.environment, assets) if settings.weather else NO_EFFECT
    rules = () if settings.meso else scenario.rules
    demand = RoutesFile(
        (SSM_PARAMETER,) if recording.criticality else (), held_back=appearing_actors(rules)
    )
    for vehicle in breakdowns(scenario, sumo_map, until=until):
        demand.add_breakdown(vehicle)
    actions = measure_actions(scenario, sumo_map, until=until)
    stops = stop_places(scenario, sumo_map)
    writer = _Writer(sumo_map, region, assets, scenario, effect, demand, step_length, stops)
    writer.actions = actions
    writer.assigned = assigned or {}
    plan = Plan(
        scenario=scenario.name,
        seed=scenario.seed,
        until=until,
        step_length=step_length,
        net_offset=sumo_map.net_offset,
        actors=writer.add(users),
        elevation=sumo_map.elevation,
        slice_length=slices_of(until, settings.slice_length, step_length),
        trajectories=recording.trajectories,
        measures=actions.measures,
        closed=actions.closed,
        warm_up=analysis.warm_up,
        interval=analysis.interval,
        clock=scenario.demand.clock,
        stations=stations,
    )
    if settings.meso:
        scenario = scenario.model_copy(update={"signals": without_detectors(scenario.signals)})
    lights = with_outages(
        realized_lights(scenario, sumo_map, until=until), scenario, sumo_map, until=until
    )
    signals = signals_xml(lights, buses=demand.types_of(Category.BUS))
    files = {
        ROUTES_FILE: demand.to_xml(),
        **({STOPS_FILE: stops_xml(stops)} if stops else {}),
        **_run_files(
            plan,
            settings,
            scenario.simulation,
            signals,
            lights,
            stops=bool(stops),
            closures=actions.xml,
        ),
    }
    if scenario.rules and settings.meso:
        writer.notes.append("meso: the rules of the scenario are left out")
    elif scenario.rules:
        files[STORY_FILE] = story_plan(scenario, sumo_map, demand.held).to_json()
    return Realization(
        files,
        plan,
        tuple(writer.problems),
        (*unmet, *unplaced, *writer.notes),
        tuple(light.shown for light in lights),
    )


def as_run(scenario: Scenario, settings: RunSettings) -> Scenario:
    """Give a scenario the seed of its run, and what that draws anew."""
    if settings.seed is not None:
        scenario = scenario.model_copy(update={"seed": settings.seed})
    return redrawn(scenario, settings.redraw)


def _run_files(
    plan: Plan,
    settings: RunSettings,
    own: Simulation,
    signals: str | None,
    lights: Sequence[RealizedLight],
    *,
    stops: bool,
    closures: str | None,
) -> dict[str, str]:
    """What SUMO reads beside network and routes; ``signals`` are programs that differ.

    ``stops`` says whether there is a file of them.
    """
    recording = settings.recorded
    sumocfg = SumocfgSettings(
        until=plan.until,
        step_length=plan.step_length,
        seed=plan.seed,
        elevation=plan.elevation,
        signals=signals is not None,
        stops=stops,
        closures=closures is not None,
        informed=any(actor.informed for actor in plan.actors),
        recording=recording,
        measures=True,
        meso=settings.meso,
        time_to_teleport=own.teleport_after,
        action_step=own.action_step,
        lateral_resolution=own.lateral_resolution,
        pedestrians=own.pedestrians,
    )
    analysed = [one for one in (plan.warm_up, plan.interval) if one]
    interval = interval_of(plan.until, plan.slice_length, analysed=analysed)
    files = {
        CONFIG_FILE: sumo_config(sumocfg),
        MEASURES_FILE: measures_xml(
            interval,
            emissions=recording.emissions,
            lights=bool(lights),
            watched=[light.shown.id for light in lights if light.watched],
        ),
    }
    if signals is not None:
        files[SIGNALS_FILE] = signals
    if closures is not None:
        files[CLOSURES_FILE] = closures
    if recording.region is not None:
        files[REGION_FILE] = region_xml(recording.region, plan.net_offset)
    return files


def slices_of(until: float, length: SliceLength, step_length: float) -> float | None:
    """Seconds of the slices of a run: whole steps; ``None`` if it goes in one piece.

    What suits is an hour, and of a run of more than six hours a sixth, in whole hours and at most
    four: each slice costs a start of SUMO, and an interruption what is done of one.
    """
    if length == "auto":
        length = _HOUR * min(max(math.ceil(until / _HOUR / _SLICES), 1), _MOST_HOURS)
    if length is None or until <= length:
        return None
    return max(1, round(length / step_length)) * step_length


def all_road_users(
    scenario: Scenario, sumo_map: SumoMap, region: Region, *, until: float
) -> tuple[tuple[RoadUser, ...], list[str]]:
    """Road users of a scenario by departure, then id, and what of its demand is not met.

    Raises
    ------
    ScenarioError
        With every actor and flow whose spawn or goal is not usable.
    """
    users = road_users(scenario, sumo_map.graph, region, until=until)
    if scenario.transit.lines:
        users = _in_order((*users, *line_users(scenario, region, until=until)))
    if not scenario.demand.parts:
        return users, []
    usable = usable_places(sumo_map)
    more, unmet = demand_users(scenario, region, usable, users, until=until)
    return _in_order((*users, *more)), unmet


def _in_order(users: Iterable[RoadUser]) -> tuple[RoadUser, ...]:
    return tuple(sorted(users, key=lambda user: (user.depart, user.id)))


class _PlannedRoute(NamedTuple):
    """Route of a road user to its goal; metres and seconds. Without one, the problem says why."""

    route: Route | Walk | None
    problem: str | None
    length: float
    free_flow_time: float | None


class _Writer:
    """Adds road users to the demand; collects what could not be done."""

    def __init__(
        self,
        sumo_map: SumoMap,
        region: Region,
        assets: ModelSizes | None,
        scenario: Scenario,
        effect: WeatherEffect,
        demand: RoutesFile,
        step_length: float,
        stops: Mapping[str, StopPlace],
    ) -> None:
        graph = sumo_map.graph
        self.demand = demand
        self.problems: list[str] = []
        self.notes: list[str] = []
        self.actions = MeasureActions()
        self.assigned: Mapping[str, Int32Array] = {}
        self._graph = graph
        self._region = region
        self._assets = assets
        self._scenario = scenario
        self._step_length = step_length
        self._stops = stops
        self._bays = {name for name, stop in stops.items() if stop.bay}
        self._effect = effect
        self._net, self._lane_places = sumo_map.net, sumo_map.lane_places
        self._drivable = Router(graph, region.lanes & sumo_map.drivable)
        self._routes = RoutePlanner(graph.lanes, sumo_map.net, sumo_map.lane_places)
        self._ways = RoutesOfDemand(scenario, region, self._drivable)
        self._period = scenario.demand.routes.period
        self._walks = WalkPlanner(graph.walks, sumo_map.net, sumo_map.walk_places)

    def add(self, users: Sequence[RoadUser]) -> tuple[PlannedActor, ...]:
        """Write road users in their order and return the plan for them.

        Routes are found in another order, those from one spawn or to one goal together.
        """
        bodies = [self._body(user) for user in users]
        drivers = [self._driver(*pair) for pair in zip(users, bodies, strict=True)]
        routes: dict[int, _PlannedRoute] = {}
        for index, path in self._ways.each_path(users, bodies, self.assigned):
            routes[index] = self._plan_route(users[index], bodies[index], drivers[index], path)
        return tuple(
            self._write(user, body, behaviour, routes[index])
            for index, (user, body, behaviour) in enumerate(
                zip(users, bodies, drivers, strict=True)
            )
        )

    def _plan_route(
        self, user: RoadUser, body: Body, behaviour: Driver, path: Int32Array
    ) -> _PlannedRoute:
        steps = self._steps(user, path)
        length = float(np.sum(steps))
        duration = self._free_flow_time(user, behaviour, path, steps)
        try:
            return _PlannedRoute(self._route(user, body, path), None, length, duration)
        except NoRouteError as error:
            return _PlannedRoute(None, str(error), length, duration)

    def _route(self, user: RoadUser, body: Body, path: Int32Array) -> Route | Walk:
        offset = user.design.lateral_offset
        if user.person:
            return self._walks.plan(path, length=body.length, lateral_offset=offset)
        vclass = KINDS[user.category].vclass
        route = self._routes.plan(path, length=body.length, vclass=vclass, lateral_offset=offset)
        route = self.actions.fitted(
            route, self._net, length=body.length, depart=user.depart, vclass=vclass
        )
        missed = left_out((self._stops[visit.stop] for visit in user.visits), route.edges)
        if missed is not None:
            msg = f"its route on the SUMO network does not pass stop {missed.id!r}"
            raise NoRouteError(msg)
        # A trip ends in a segment, not on a lane of it: no vehicle has to stop for a lane change.
        return replace(route, arrival_lane=None) if user.trip else route

    def _write(
        self, user: RoadUser, body: Body, behaviour: Driver, planned: _PlannedRoute
    ) -> PlannedActor:
        if planned.route is None:
            self.problems.append(f"{user.id}: {planned.problem}")
        else:
            if isinstance(planned.route, Walk):
                self.demand.add_walk(user, behaviour, planned.route)
            else:
                self.demand.add_vehicle(
                    user,
                    behaviour,
                    planned.route,
                    bays=self._bays,
                    speed=self._initial_speed(user, behaviour),
                    looks_every=self._period if self._ways.informed(user) else None,
                )
            self.notes += [f"{user.id}: {repair.words}" for repair in planned.route.repairs]
        return self._planned(user, body, behaviour, planned)

    def _initial_speed(self, user: RoadUser, behaviour: Driver) -> float:
        """Speed at departure, m/s: SUMO ends a run in which one is above what the lane allows."""
        wanted, place = user.design.initial_speed, self._lane_places.of(user.spawn)
        if not wanted or place is None:
            return 0.0
        allowed = self._net.lanes[place[0]].speed * behaviour.speed_factor
        return min(wanted, allowed, behaviour.max_speed)

    def _driver(self, user: RoadUser, body: Body) -> Driver:
        limit = None if user.person else float(self._graph.lanes.speed_limit[user.spawn])
        drivers = self._scenario.drivers
        kind = kind_of(user, drivers, self._scenario.seed)
        return driver(
            user,
            body,
            factor=factor_of(user, kind, self._scenario.seed),
            limit=limit if limit is not None and math.isfinite(limit) else None,
            weather=self._effect,
            electric=user.design.model is not None
            and self._assets is not None
            and self._assets.electric(user.design.model),
            drivers=drivers,
            step_length=self._step_length,
            kind=kind,
        )

    def _body(self, user: RoadUser) -> Body:
        known = None
        if user.design.model is not None and self._assets is not None:
            known = self._assets.dimensions(user.design.model)
        return DEFAULT_BODY[user.category] if known is None else known

    def _planned(
        self, user: RoadUser, body: Body, behaviour: Driver, planned: _PlannedRoute
    ) -> PlannedActor:
        graph = self._graph.walks if user.person else self._graph.lanes
        name = walk_node_id if user.person else node_id
        spawn = user.spawn
        hdg = float(graph.hdg[spawn])
        return PlannedActor(
            id=user.id,
            category=user.category.value,
            spawn=name(self._graph, spawn),
            goal=name(self._graph, user.goal),
            depart=user.depart,
            length=body.length,
            width=body.width,
            x=float(graph.x[spawn]) - math.sin(hdg) * user.design.lateral_offset,
            y=float(graph.y[spawn]) + math.cos(hdg) * user.design.lateral_offset,
            z=float(graph.z[spawn]),
            hdg=hdg,
            speed=user.speed,
            speed_factor=behaviour.speed_factor,
            route_length=planned.length,
            free_flow_time=planned.free_flow_time,
            model=user.design.model,
            flow=user.flow,
            ego=user.design.ego,
            problem=planned.problem,
            informed=self._ways.informed(user),
        )

    def _steps(self, user: RoadUser, path: Int32Array) -> np.ndarray:
        """Distances between the nodes of a path, shape ``(len(path) - 1,)``, metres."""
        graph = self._graph.walks if user.person else self._graph.lanes
        return np.hypot(np.diff(graph.x[path]), np.diff(graph.y[path]))

    def _free_flow_time(
        self, user: RoadUser, behaviour: Driver, path: Int32Array, steps: np.ndarray
    ) -> float | None:
        """Seconds along the path at the speed the actor wants, from standing.

        ``sum(ds / v) + v0 / (2 a)``: the second term is what getting up to the first speed costs;
        vehicles that drive in at the boundary do not have it.
        """
        if len(path) < 2:
            return None
        if user.person:
            return float(np.sum(steps)) / behaviour.max_speed
        limit = self._graph.lanes.speed_limit[path[:-1]]
        limit = np.where(np.isfinite(limit), limit, UNKNOWN_LIMIT)
        speed = np.minimum(limit * behaviour.speed_factor, behaviour.max_speed)
        set_off = 0.0 if user.entering else speed[0] / (2.0 * behaviour.accel)
        return float(np.sum(steps / speed) + set_off)


def _effect(environment: Environment, assets: ModelSizes | None) -> WeatherEffect:
    if not environment.affects_driving:
        return NO_EFFECT
    preset = None if assets is None else assets.weather(environment.preset)
    return weather_effect({**(preset or {}), **environment.parameters})


def _refuse_twins(users: tuple[RoadUser, ...]) -> None:
    """Flow members are named ``<flow>.<k>``, which an actor's own id may equal."""
    twins = sorted(name for name, n in Counter(user.id for user in users).items() if n > 1)
    if twins:
        msg = "two road users have the same name; flows name theirs <flow>.<number>"
        raise ScenarioError(msg, problems=twins[:10])
