"""From a scenario to the files that SUMO runs, and the plan that the run is held against.

Pure: the scenario, the map's graph and its SUMO network go in, texts come out, the same for the
same input. Everybody's type, speed factor, route and place are written out; nothing is left to
SUMO's random numbers but the dawdling of drivers.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol

import numpy as np

from odscen.categories import DEFAULT_BODY, Body
from odscen.errors import InputError, ScenarioError
from odscen.lanegraph.paths import Router
from odscen.lanegraph.query import node_id, walk_node_id
from odscen.results.records import Plan, PlannedActor
from odscen.scenario.problems import refuse_errors
from odscen.scenario.region import Region
from odscen.scenario.signals import signal_problems
from odscen.sumo.config import RunSettings, sumo_config
from odscen.sumo.demand import Demand
from odscen.sumo.driving import KINDS, draw_factor, driver
from odscen.sumo.layout import (
    CONFIG_FILE,
    MEASURES_FILE,
    REGION_FILE,
    ROUTES_FILE,
    SIGNALS_FILE,
)
from odscen.sumo.measures import interval_of, measures_xml
from odscen.sumo.paths import each_path
from odscen.sumo.people import RoadUser, demand_users, road_users
from odscen.sumo.recording import Recording, region_xml
from odscen.sumo.routes import NoRouteError, Route, RoutePlanner
from odscen.sumo.signals import scenario_lights, signals_xml
from odscen.sumo.ssm import VEHICLE_PARAMETER
from odscen.sumo.usable import usable_places
from odscen.sumo.walks import Walk, WalkPlanner
from odscen.sumo.weather import NO_EFFECT, weather_effect

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.lanegraph.model import IntArray
    from odscen.scenario.document import Environment, Scenario
    from odscen.sumo.driving import Driver
    from odscen.sumo.sumo_map import SumoMap
    from odscen.sumo.weather import WeatherEffect

UNKNOWN_LIMIT = 13.89
"""Speed (m/s) that free-flow times assume where the map gives no limit: 50 km/h."""

SliceLength = float | Literal["auto"] | None
"""Seconds of the slices of a long run; ``auto`` what suits it, ``None`` none."""
_HOUR = 3600.0
_SLICES, _MOST_HOURS = 6, 4


class Assets(Protocol):
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
    no way for them; ``notes`` name routes that had to be repaired, and demand that was not met.
    """

    files: dict[str, str]
    plan: Plan
    problems: tuple[str, ...]
    notes: tuple[str, ...]


def realize(
    scenario: Scenario,
    sumo_map: SumoMap,
    assets: Assets | None = None,
    *,
    seed: int | None = None,
    until: float | None = None,
    step_length: float | None = None,
    weather: bool = True,
    recording: Recording | None = None,
    meso: bool = False,
    slice_length: SliceLength = None,
) -> Realization:
    """Derive SUMO files and plan from a scenario.

    Parameters
    ----------
    assets
        Knows the size of models and the parameters of weather presets; without it all bodies are
        their category's and only single parameters of the environment count.
    seed, until, step_length
        Instead of the scenario's own.
    weather
        Whether weather acts on driving; the scenario can also switch it off itself.
    recording
        What is recorded; everything if not given.
    meso
        Queues on road sections instead of single vehicles that follow each other.
    slice_length
        Seconds; a longer run goes in slices of this length, or of what suits it, see
        :func:`slices_of`. ``None`` for one piece, however long.

    Raises
    ------
    ScenarioError
        With every actor and flow whose spawn or goal is not usable, or with every timing of a
        traffic light that is not possible.
    InputError
        If criticality is to be measured in meso.
    """
    recording = recording or Recording()
    if meso and recording.criticality:
        msg = "criticality cannot be measured in meso: it has queues, not vehicles that meet"
        raise InputError(msg)
    refuse_errors(signal_problems(scenario.signals, scenario_lights(sumo_map.lights)))
    if seed is not None:
        scenario = scenario.model_copy(update={"seed": seed})
    until = scenario.simulation.duration if until is None else until
    step_length = scenario.simulation.step_length if step_length is None else step_length
    region = Region.of(sumo_map.graph, scenario.roi)
    users, unmet = everybody(scenario, sumo_map, region, until=until)
    _refuse_twins(users)
    effect = _effect(scenario.environment, assets) if weather else NO_EFFECT
    demand = Demand((VEHICLE_PARAMETER,) if recording.criticality else ())
    writer = _Writer(sumo_map, region, assets, scenario.seed, effect, demand)
    planned = writer.add(users)
    plan = Plan(
        scenario=scenario.name,
        seed=scenario.seed,
        until=until,
        step_length=step_length,
        net_offset=sumo_map.net_offset,
        actors=planned,
        elevation=sumo_map.elevation,
        slice_length=slices_of(until, slice_length, step_length),
        trajectories=recording.trajectories,
    )
    signals = signals_xml(scenario.signals, sumo_map.lights)
    settings = RunSettings(
        until=until,
        step_length=step_length,
        seed=scenario.seed,
        elevation=sumo_map.elevation,
        signals=signals is not None,
        recording=recording,
        measures=True,
        meso=meso,
    )
    interval = interval_of(until, plan.slice_length)
    files = {
        ROUTES_FILE: writer.demand.to_xml(),
        CONFIG_FILE: sumo_config(settings),
        MEASURES_FILE: measures_xml(interval, emissions=recording.emissions),
    }
    if signals is not None:
        files[SIGNALS_FILE] = signals
    if recording.region is not None:
        files[REGION_FILE] = region_xml(recording.region, sumo_map.net_offset)
    return Realization(files, plan, tuple(writer.problems), (*unmet, *writer.notes))


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


def everybody(
    scenario: Scenario, sumo_map: SumoMap, region: Region, *, until: float
) -> tuple[tuple[RoadUser, ...], list[str]]:
    """Road users of a scenario by departure, then id, and what of its demand is not met.

    Raises
    ------
    ScenarioError
        With every actor and flow whose spawn or goal is not usable.
    """
    users = road_users(scenario, sumo_map.graph, region, until=until)
    if not scenario.demand.parts:
        return users, []
    usable = usable_places(sumo_map)
    more, unmet = demand_users(scenario, region, usable, users, until=until)
    return tuple(sorted((*users, *more), key=lambda user: (user.depart, user.id))), unmet


class _Way(NamedTuple):
    """How somebody gets to the goal; metres and seconds. Without a route, the problem says why."""

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
        assets: Assets | None,
        seed: int,
        effect: WeatherEffect,
        demand: Demand,
    ) -> None:
        graph = sumo_map.graph
        self.demand = demand
        self.problems: list[str] = []
        self.notes: list[str] = []
        self._graph = graph
        self._region = region
        self._assets = assets
        self._seed = seed
        self._effect = effect
        self._drivable = Router(graph, region.lanes & sumo_map.drivable)
        self._routes = RoutePlanner(graph.lanes, sumo_map.net, sumo_map.lane_places)
        self._walks = WalkPlanner(graph.walks, sumo_map.net, sumo_map.walk_places)

    def add(self, users: Sequence[RoadUser]) -> tuple[PlannedActor, ...]:
        """Write road users in their order and return the plan for them.

        Ways are found in another order, those from one spawn or to one goal together.
        """
        bodies = [self._body(user) for user in users]
        manners = [self._driver(*pair) for pair in zip(users, bodies, strict=True)]
        ways: dict[int, _Way] = {}
        for index, path in each_path(users, self._region, self._drivable, bodies):
            ways[index] = self._way(users[index], bodies[index], manners[index], path)
        return tuple(
            self._write(user, body, manner, ways[index])
            for index, (user, body, manner) in enumerate(zip(users, bodies, manners, strict=True))
        )

    def _way(self, user: RoadUser, body: Body, manner: Driver, path: IntArray) -> _Way:
        steps = self._steps(user, path)
        length = float(np.sum(steps))
        duration = self._free_flow_time(user, manner, path, steps)
        try:
            return _Way(self._route(user, body, path), None, length, duration)
        except NoRouteError as error:
            return _Way(None, str(error), length, duration)

    def _route(self, user: RoadUser, body: Body, path: IntArray) -> Route | Walk:
        offset = user.lateral_offset
        if user.person:
            return self._walks.plan(path, length=body.length, lateral_offset=offset)
        vclass = KINDS[user.category].vclass
        route = self._routes.plan(path, length=body.length, vclass=vclass, lateral_offset=offset)
        # A trip ends in a segment, not on a lane of it: nobody has to stop for a lane change.
        return replace(route, arrival_lane=None) if user.trip else route

    def _write(self, user: RoadUser, body: Body, manner: Driver, way: _Way) -> PlannedActor:
        if way.route is None:
            self.problems.append(f"{user.id}: {way.problem}")
        else:
            if isinstance(way.route, Walk):
                self.demand.add_walk(user, manner, way.route)
            else:
                self.demand.add_vehicle(user, manner, way.route)
            self.notes += [f"{user.id}: {repair.words}" for repair in way.route.repairs]
        return self._planned(user, body, manner, way)

    def _driver(self, user: RoadUser, body: Body) -> Driver:
        limit = None if user.person else float(self._graph.lanes.speed_limit[user.spawn])
        return driver(
            user.category,
            body,
            style=user.style,
            factor=draw_factor(self._seed, user.id, user.style, user.category),
            speed=user.speed,
            limit=limit if limit is not None and math.isfinite(limit) else None,
            weather=self._effect,
            ignores_red=user.ignores_red,
            electric=user.model is not None
            and self._assets is not None
            and self._assets.electric(user.model),
        )

    def _body(self, user: RoadUser) -> Body:
        known = None
        if user.model is not None and self._assets is not None:
            known = self._assets.dimensions(user.model)
        return DEFAULT_BODY[user.category] if known is None else known

    def _planned(self, user: RoadUser, body: Body, manner: Driver, way: _Way) -> PlannedActor:
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
            x=float(graph.x[spawn]) - math.sin(hdg) * user.lateral_offset,
            y=float(graph.y[spawn]) + math.cos(hdg) * user.lateral_offset,
            z=float(graph.z[spawn]),
            hdg=hdg,
            speed=user.speed,
            speed_factor=manner.speed_factor,
            route_length=way.length,
            free_flow_time=way.free_flow_time,
            model=user.model,
            flow=user.flow,
            ego=user.ego,
            problem=way.problem,
        )

    def _steps(self, user: RoadUser, path: IntArray) -> np.ndarray:
        """Distances between the nodes of a path, shape ``(len(path) - 1,)``, metres."""
        graph = self._graph.walks if user.person else self._graph.lanes
        return np.hypot(np.diff(graph.x[path]), np.diff(graph.y[path]))

    def _free_flow_time(
        self, user: RoadUser, manner: Driver, path: IntArray, steps: np.ndarray
    ) -> float | None:
        """Seconds along the path at the speed the actor wants, from standing.

        ``sum(ds / v) + v0 / (2 a)``: the second term is what getting up to the first speed costs.
        """
        if len(path) < 2:
            return None
        if user.person:
            return float(np.sum(steps)) / manner.max_speed
        limit = self._graph.lanes.speed_limit[path[:-1]]
        limit = np.where(np.isfinite(limit), limit, UNKNOWN_LIMIT)
        speed = np.minimum(limit * manner.speed_factor, manner.max_speed)
        return float(np.sum(steps / speed) + speed[0] / (2.0 * manner.accel))


def _effect(environment: Environment, assets: Assets | None) -> WeatherEffect:
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
