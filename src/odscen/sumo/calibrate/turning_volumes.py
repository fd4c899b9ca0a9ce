"""Vehicles that a scenario brings to the movements of each traffic light, by their routes."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.categories import DEFAULT_BODY, Category
from odscen.convert.model.net import CROSSED
from odscen.scenario.placing.region import Region
from odscen.sumo.realize.driving import KINDS
from odscen.sumo.realize.realization import all_road_users
from odscen.sumo.realize.route_choice.chosen_paths import RoutesOfDemand
from odscen.sumo.realize.route_planner import NoRouteError, RoutePlanner

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import polars as pl

    from odscen.convert.lane_table.table import SumoLight
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.sumo_map import SumoMap

HOUR = 3600.0

_STEP = 300.0
"""Seconds between the hours among which the busiest one is looked for."""

DRIVEN = "passenger"
"""Class of vehicles that lanes for cars are open to."""

HEAVY_CATEGORIES = frozenset({Category.TRUCK, Category.BUS})


class Turn(NamedTuple):
    """Edges before and behind a light."""

    source: str
    target: str


class TurnVolume(NamedTuple):
    """Vehicles an hour, and how many of them are trucks and buses, and bicycles."""

    vehicles: float
    heavy: float
    bicycles: float = 0.0


class PlannedVehicle(NamedTuple):
    """When a vehicle departs, and at which lights it turns where."""

    depart: float
    category: Category
    turns: tuple[Turn, ...]


class Volumes(NamedTuple):
    """Volumes at all lights in an interval of the scenario, seconds."""

    begin: float
    end: float
    by_turn: Mapping[Turn, TurnVolume]


def planned_vehicles(scenario: Scenario, sumo_map: SumoMap) -> Iterator[PlannedVehicle]:
    """Yield vehicles that pass lights on the routes that a run gives them.

    Raises
    ------
    ScenarioError
        With every actor and flow whose spawn or goal is not usable.
    """
    known = {turn for light in sumo_map.lights for turn in turns_of(light, sumo_map)}
    region = Region.of(sumo_map.graph, scenario.roi)
    users, _ = all_road_users(scenario, sumo_map, region, until=scenario.simulation.duration)
    vehicles = [user for user in users if not user.person]
    router = region.router_over(sumo_map.drivable)
    planner = RoutePlanner(sumo_map.graph.lanes, sumo_map.net, sumo_map.lane_places)
    for index, path in RoutesOfDemand(scenario, region, router).each_path(vehicles):
        user = vehicles[index]
        vclass = KINDS[user.category].vclass
        try:
            length = DEFAULT_BODY[user.category].length
            route = planner.plan(path, length=length, vclass=vclass, lateral_offset=0.0)
        except NoRouteError:
            continue
        steps = zip(route.edges[:-1], route.edges[1:], strict=True)
        passed = tuple(turn for step in steps if (turn := Turn(*step)) in known)
        if passed:
            yield PlannedVehicle(user.depart, user.category, passed)


def driven_vehicles(
    trajectories: pl.LazyFrame, sumo_map: SumoMap, categories: Mapping[str, Category]
) -> Iterator[PlannedVehicle]:
    """Yield each passage of a light in a run as a vehicle of its own, at the time of it.

    Parameters
    ----------
    trajectories
        As the run wrote them, of every step, with lanes.
    categories
        Of the road users of the run; those who are not in it are left out.
    """
    import polars as pl

    known = {turn for light in sumo_map.lights for turn in turns_of(light, sumo_map)}
    edges = {edge for turn in known for edge in turn}
    lanes = [(name, lane.edge) for name, lane in sumo_map.net.lanes.items() if lane.edge in edges]
    table = pl.DataFrame(lanes, schema={"lane": pl.String, "edge": pl.String}, orient="row")
    steps = (
        trajectories.select(
            time=pl.col("timestep_time"),
            id=pl.col("vehicle_id").cast(pl.String),
            lane=pl.col("vehicle_lane").cast(pl.String),
        )
        .join(table.lazy(), on="lane", how="inner")
        .sort("id", "time")
        .with_columns(before=pl.col("edge").shift(1).over("id"))
        .filter(pl.col("before").is_not_null() & (pl.col("before") != pl.col("edge")))
        .select("id", "time", "before", "edge")
        .collect()
    )
    for name, time, before, edge in steps.iter_rows():
        turn = Turn(before, edge)
        if turn in known and name in categories:
            yield PlannedVehicle(time, categories[name], (turn,))


def turns_of(light: SumoLight, sumo_map: SumoMap) -> dict[Turn, tuple[int, ...]]:
    """Links of a light by the turn that they are for; crossings are left out."""
    lanes = sumo_map.net.lanes
    turns: dict[Turn, list[int]] = {}
    for number, link in enumerate(light.links):
        if link.turn != CROSSED:
            turn = Turn(lanes[link.source].edge, lanes[link.target].edge)
            turns.setdefault(turn, []).append(number)
    return {turn: tuple(numbers) for turn, numbers in turns.items()}


def turning_volumes(
    vehicles: Sequence[PlannedVehicle],
    *,
    duration: float,
    begin: float | None = None,
    end: float | None = None,
) -> Volumes:
    """Count the vehicles that depart in an interval, per hour.

    By their departures, wherever they then are: so a flow counts in full from its first second.

    Parameters
    ----------
    duration
        Of the scenario, seconds.
    begin, end
        Seconds; without both the hour with most passages, or all of a shorter scenario.
    """
    if begin is None and end is None:
        begin = _busiest_hour(vehicles, duration)
        end = min(begin + HOUR, duration)
    begin, end = begin or 0.0, duration if end is None else end
    every: Counter[Turn] = Counter()
    heavy: Counter[Turn] = Counter()
    bicycles: Counter[Turn] = Counter()
    for vehicle in vehicles:
        if begin <= vehicle.depart < end:
            every.update(vehicle.turns)
            if vehicle.category in HEAVY_CATEGORIES:
                heavy.update(vehicle.turns)
            elif vehicle.category == Category.BICYCLE:
                bicycles.update(vehicle.turns)
    hours = (end - begin) / HOUR
    volumes = {
        turn: TurnVolume(every[turn] / hours, heavy[turn] / hours, bicycles[turn] / hours)
        for turn in sorted(every)
    }
    return Volumes(begin, end, volumes)


def _busiest_hour(vehicles: Sequence[PlannedVehicle], duration: float) -> float:
    if duration <= HOUR:
        return 0.0
    passages = np.zeros(math.ceil(duration / _STEP))
    for vehicle in vehicles:
        passages[min(int(vehicle.depart // _STEP), len(passages) - 1)] += len(vehicle.turns)
    sums = np.convolve(passages, np.ones(int(HOUR / _STEP)), mode="valid")
    return float(sums.argmax()) * _STEP if len(sums) else 0.0
