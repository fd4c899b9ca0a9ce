"""From a scenario to the files that SUMO runs, and the plan that the run is held against.

Pure: the scenario, the map's graph and its SUMO network go in, texts come out, the same for the
same input. Type, speed factor, route and place of all are written out; nothing is left to
SUMO's random numbers but the dawdling of drivers.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from odscen.base.categories import Category
from odscen.base.errors import ScenarioError
from odscen.figures.judging.criteria import awaited_actors, criteria_of
from odscen.records.run_plan import Plan
from odscen.runs.layout import (
    CLOSURES_FILE,
    CONFIG_FILE,
    MEASURES_FILE,
    NET_FILE,
    PARKING_FILE,
    REGION_FILE,
    ROUTES_FILE,
    SIGNALS_FILE,
    STOPS_FILE,
    STORY_FILE,
)
from odscen.runs.recording import region_xml
from odscen.runs.run_settings import AS_DESIGNED
from odscen.scenario.checks.signal_checks import signal_problems
from odscen.scenario.demand.expected_users import expected_users, refuse_too_many
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.document.rules_document import appearing_actors
from odscen.scenario.document.scenario_document import TripParking
from odscen.scenario.placing.region import Region
from odscen.scenario.sampling.sampler import redrawn
from odscen.scenario.signals.program_design import without_detectors
from odscen.sumo.realize.lights.light_realization import realized_lights
from odscen.sumo.realize.lights.light_views import scenario_lights
from odscen.sumo.realize.lights.program_files import signals_xml
from odscen.sumo.realize.measure_files import interval_of, measures_xml
from odscen.sumo.realize.project_files import allowed_options, project_files
from odscen.sumo.realize.road_users.departures import demand_users, road_users
from odscen.sumo.realize.road_users.free_flow import environment_effect
from odscen.sumo.realize.road_users.planned_users import RoadUserWriter
from odscen.sumo.realize.routes_file import RoutesFile
from odscen.sumo.realize.rules.story_files import story_plan
from odscen.sumo.realize.rules.walks_across import RoadsAcross
from odscen.sumo.realize.sumocfg import SSM_PARAMETER, SumocfgSettings, sumo_config
from odscen.sumo.realize.traffic_measures.breakdowns import breakdowns
from odscen.sumo.realize.traffic_measures.measure_actions import (
    measure_actions,
)
from odscen.sumo.realize.traffic_measures.signal_outages import with_outages
from odscen.sumo.realize.traffic_measures.study_stations import planned_stations
from odscen.sumo.realize.transit.line_vehicles import line_users
from odscen.sumo.realize.transit.parking_places import (
    parking_positions,
    parking_xml,
    planned_parking,
)
from odscen.sumo.realize.transit.parking_trips import ParkingOfTrips, places_to_begin
from odscen.sumo.realize.transit.stop_places import stop_places, stops_xml
from odscen.sumo.realize.usable import usable_places
from odscen.sumo.realize.weather_effects import NO_EFFECT

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.base.arrays import Int32Array
    from odscen.records.light_programs import LightProgram
    from odscen.records.run_plan import PlannedActor
    from odscen.runs.run_settings import RunSettings, SliceLength
    from odscen.scenario.document.scenario_document import Scenario, Simulation
    from odscen.sumo.realize.lights.light_realization import RealizedLight
    from odscen.sumo.realize.project_files import ProjectFiles
    from odscen.sumo.realize.road_user import RoadUser
    from odscen.sumo.realize.road_users.free_flow import ModelSizes
    from odscen.sumo.realize.sumo_map import SumoMap
    from odscen.sumo.realize.transit.parking_places import ParkingPosition

RUN_FILES = (
    CLOSURES_FILE, CONFIG_FILE, MEASURES_FILE, NET_FILE, PARKING_FILE, REGION_FILE, ROUTES_FILE,
    SIGNALS_FILE, STOPS_FILE, STORY_FILE,
)  # fmt: skip
"""Names of files that a run may have of odscen."""
_HOUR = 3600.0
_SLICES, _MOST_HOURS = 6, 4


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
    asked, scenario = scenario, as_run(scenario, settings)
    recording, (until, step_length) = settings.recorded_of(scenario), settings.times(scenario)
    settings = replace(settings, recording=recording)
    analysis = settings.analysis(scenario)
    stations, unplaced = planned_stations(scenario, sumo_map)
    region = Region.of(sumo_map.graph, scenario.roi)
    users, unmet = all_road_users(scenario, sumo_map, region, until=until)
    _refuse_twins(users)
    effect = environment_effect(scenario.environment, assets) if settings.weather else NO_EFFECT
    rules = () if settings.meso else scenario.rules
    demand = RoutesFile(
        (SSM_PARAMETER,) if recording.criticality else (), held_back=appearing_actors(rules)
    )
    for vehicle in breakdowns(scenario, sumo_map, until=until):
        demand.add_breakdown(vehicle)
    actions = measure_actions(scenario, sumo_map, until=until, step_length=step_length)
    stops = stop_places(scenario, sumo_map)
    parks = scenario.demand.parking.used
    areas = parking_positions(sumo_map, region.lanes) if parks else {}
    writer = RoadUserWriter(sumo_map, region, assets, scenario, effect, demand, step_length, stops)
    writer.actions, writer.areas, writer.until = actions, areas, until
    writer.assigned = assigned or {}
    if not settings.meso and any(actor.crosses_anywhere for actor in scenario.actors):
        walkable = usable_places(sumo_map).walkable
        writer.roads = None if walkable is None else RoadsAcross(sumo_map, region, walkable)
    project = None
    if scenario.sumo is not None:
        project = project_files(scenario.sumo, sumo_map, until=until, taken=RUN_FILES)
        _refuse_twins((*users, *project.actors))
    actors = writer.add(users)
    if project is not None:
        actors = tuple(
            sorted((*actors, *project.actors), key=lambda actor: (actor.depart, actor.id))
        )
    settle = settings.settle_time(scenario)
    wanted = (*criteria_of(scenario.criteria), *settings.expectations)
    plan = Plan(
        scenario=scenario.name,
        seed=scenario.seed,
        until=until,
        step_length=step_length,
        net_offset=sumo_map.net_offset,
        actors=actors,
        elevation=sumo_map.elevation,
        slice_length=None  # SUMO's own flows and routes of a file have no slices
        if project is not None and project.routes
        else slices_of(until, settings.slice_length, step_length),
        trajectories=recording.trajectories,
        measures=actions.measures,
        closed=actions.closed,
        warm_up=analysis.warm_up,
        interval=analysis.interval,
        clock=scenario.demand.clock,
        stations=stations,
        parking=planned_parking(areas.values(), sumo_map),
        criteria=scenario.criteria,
        scene=scenario.is_scene and not settings.meso,
        after_story=settle,
        awaits=() if settle is None else awaited_actors(wanted, scenario),
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
        **_parking_file(areas, sumo_map, users),
        **_run_files(
            plan,
            settings,
            scenario.simulation,
            signals,
            lights,
            stops=bool(stops),
            closures=actions.xml,
            project=project,
            begin=0.0 if scenario.sumo is None else scenario.sumo.begin,
            options=None
            if scenario.sumo is None or scenario.sumo.options is None
            else {
                # Trips of the project may find no route where measures close their roads.
                **({"ignore-route-errors": "true"} if actions.closed else {}),
                **allowed_options(scenario.sumo.options),
            },
        ),
    }
    if project is not None:
        files |= project.texts
        writer.notes += project.notes
    if settings.meso and asked.demand.parking.used:
        writer.notes.append("meso: no trip begins or ends in a parking place")
    if settings.meso:
        if scenario.rules:
            writer.notes.append("meso: the rules of the scenario are left out")
        if scenario.by_story:
            writer.notes.append("meso: SUMO drives whom the story alone drives")
    elif scenario.rules or writer.crossings or scenario.by_story:
        story = scenario.model_copy(update={"rules": (*scenario.rules, *writer.crossings)})
        files[STORY_FILE] = story_plan(story, sumo_map, demand.held).to_json()
    return Realization(
        files,
        plan,
        tuple(writer.problems),
        (*unmet, *unplaced, *writer.notes),
        tuple(light.shown for light in lights),
    )


def _parking_file(
    areas: Mapping[str, ParkingPosition], sumo_map: SumoMap, users: Sequence[RoadUser]
) -> dict[str, str]:
    if not areas:
        return {}
    begins = places_to_begin(users)
    return {PARKING_FILE: parking_xml(tuple(areas.values()), sumo_map, begins=begins)}


def as_run(scenario: Scenario, settings: RunSettings) -> Scenario:
    """Give a scenario the seed of its run, and what that draws anew; in meso no trip parks."""
    if settings.seed is not None:
        scenario = scenario.model_copy(update={"seed": settings.seed})
    if settings.meso and scenario.demand.parking.used:
        demand = scenario.demand.model_copy(update={"parking": TripParking()})
        scenario = scenario.model_copy(update={"demand": demand})
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
    project: ProjectFiles | None = None,
    begin: float = 0.0,
    options: Mapping[str, str] | None = None,
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
        project_stops=project is not None and project.stops,
        parking=bool(plan.parking),
        closures=closures is not None,
        informed=any(actor.informed for actor in plan.actors),
        recording=recording,
        measures=True,
        meso=settings.meso,
        time_to_teleport=own.teleport_after,
        action_step=own.action_step,
        lateral_resolution=own.lateral_resolution,
        pedestrians=own.pedestrians,
        begin=begin,
        routes=() if project is None else project.routes,
        additional=() if project is None else project.additional,
        options=options,
    )
    analysed = [value for value in (plan.warm_up, plan.interval) if value]
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
    LimitError
        If there are more than a run may have; they are counted before they are made.
    """
    refuse_too_many(expected_users(scenario, until=until))
    users = road_users(scenario, sumo_map.graph, region, until=until)
    if scenario.transit.lines:
        users = _sort_users((*users, *line_users(scenario, region, until=until)))
    if not scenario.demand.parts:
        return users, []
    usable = usable_places(sumo_map)
    parks = scenario.demand.parking.used
    parking = ParkingOfTrips(scenario, sumo_map, region) if parks else None
    more, unmet = demand_users(scenario, region, usable, users, until=until, parking=parking)
    return _sort_users((*users, *more)), unmet


def _sort_users(users: Iterable[RoadUser]) -> tuple[RoadUser, ...]:
    return tuple(sorted(users, key=lambda user: (user.depart, user.id)))


def _refuse_twins(users: Sequence[RoadUser | PlannedActor]) -> None:
    """Flow members are named ``<flow>.<k>``, which an actor's own id may equal."""
    twins = sorted(name for name, n in Counter(user.id for user in users).items() if n > 1)
    if twins:
        raise ScenarioError(
            "two road users have the same name; flows name theirs <flow>.<number>",
            problems=twins[:10],
        )
