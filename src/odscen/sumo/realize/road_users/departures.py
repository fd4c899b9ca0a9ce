"""Who is on the road: the scenario's actors, and those of its flows and demand one by one.

They are drawn here rather than left to SUMO and its tools (flows, od2trips), so that each vehicle
has its own category, start, goal and speed factor, written down, the same for the same seed and
independent of what else is in the scenario.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.scenario.demand.count_stations import observations
from odscen.scenario.demand.day_profiles import curve
from odscen.scenario.demand.inflow import input_trips
from odscen.scenario.demand.trips import background_trips, matrix_trips
from odscen.scenario.demand.zones import TripEnds
from odscen.scenario.document.distributions import stream
from odscen.scenario.placing.region import place_of
from odscen.scenario.sampling.actor_goals import flow_goals, resolve_goals
from odscen.sumo.realize.counted_traffic import counted_trips
from odscen.sumo.realize.passages import planned_passages
from odscen.sumo.realize.road_user import RoadUser
from odscen.sumo.realize.route_choice.chosen_paths import RoutesOfDemand

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.base.arrays import Int32Array
    from odscen.base.categories import Category
    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.demand.day_profiles import Curve
    from odscen.scenario.demand.trips import Trips
    from odscen.scenario.document.scenario_document import Flow, Scenario
    from odscen.scenario.placing.region import Region, Usable
    from odscen.sumo.realize.transit.parking_trips import ParkingOfTrips


def road_users(
    scenario: Scenario, graph: MapGraph, region: Region, *, until: float
) -> tuple[RoadUser, ...]:
    """Actors and members of flows who depart before ``until``, by departure, then id.

    Raises
    ------
    ScenarioError
        With every actor and flow whose spawn or goal is not usable.
    """
    goals = resolve_goals(scenario, graph, region=region)
    users = [
        RoadUser(
            id=actor.id,
            category=actor.category,
            spawn=_required_node(graph, actor.spawn),
            goal=goals[actor.id],
            via=tuple(_required_node(graph, name) for name in actor.via),
            depart=actor.depart,
            speed=actor.speed,
            initial_speed=actor.initial_speed,
            design=actor,
        )
        for actor in scenario.actors
    ]
    if scenario.flows:
        candidates = flow_goals(scenario, graph, region=region)
        for flow in scenario.flows:
            spawn = _required_node(graph, flow.spawn)
            users += flow_users(
                flow,
                seed=scenario.seed,
                spawn=spawn,
                goals=candidates[flow.id],
                until=until,
                day=None if flow.profile is None else curve(scenario.demand, flow.profile),
            )
    return tuple(sorted(users, key=lambda user: (user.depart, user.id)))


def flow_users(
    flow: Flow, *, seed: int, spawn: int, goals: Int32Array, until: float, day: Curve | None = None
) -> list[RoadUser]:
    """Members of a flow: a Poisson stream, that is, headways are exponentially distributed.

    The count in the flow's window is then random too, ``per_hour`` on average. Member ``k`` is
    named ``<flow>.<k>``; those after ``until`` are left out, and change nothing about those before.
    With a day profile, the stream is even in the integral of its factor instead of in time.
    """
    random = stream(seed, "flow", flow.id)
    categories = sorted(flow.mix)
    shares = [flow.mix[category] for category in categories]
    users: list[RoadUser] = []
    passed, last = flow.begin, min(flow.end, until)
    if day is not None:
        passed, last = day.amount(passed), day.amount(last)
    while True:
        passed += float(random.exponential(3600.0 / flow.per_hour))
        category = _pick_category(random, categories, shares)
        goal = int(goals[int(random.integers(len(goals)))])
        if passed >= last:
            return users
        depart = passed if day is None else float(day.times(np.array([passed]))[0])
        users.append(
            RoadUser(
                id=f"{flow.id}.{len(users)}",
                category=category,
                spawn=spawn,
                goal=goal,
                depart=round(depart, 2),
                speed=flow.speed,
                initial_speed=flow.initial_speed,
                flow=flow.id,
            )
        )


def demand_users(
    scenario: Scenario,
    region: Region,
    usable: Usable,
    placed: Sequence[RoadUser],
    *,
    until: float,
    parking: ParkingOfTrips | None = None,
) -> tuple[list[RoadUser], list[str]]:
    """Members of the scenario's demand who depart before ``until``, and what of it is not met.

    Counts come last: they are made up for what all others, ``placed`` and the rest of the
    demand, leaves of them. ``parking`` lets trips before them park.
    """
    taken = [place for actor in scenario.actors if (place := region.place(actor.spawn))]
    ground = TripEnds(region, usable, taken=taken)
    users: list[RoadUser] = []
    unmet: list[str] = []

    def add(part: Iterable[Trips]) -> None:
        for trips in part:
            users.extend(trip_users(trips, until=until))
            if trips.unmet:
                unmet.append(f"{trips.name}: {trips.unmet} trips left out: {trips.why}")

    for inflow in scenario.demand.inputs:
        add(input_trips(scenario, ground, inflow))
    for matrix in scenario.demand.matrices:
        add(matrix_trips(scenario, ground, matrix))
    for background in scenario.demand.background:
        add(background_trips(scenario, ground, background, usable))
    if parking is not None:
        users, unparked = parking.applied(users)
        unmet += unparked
    generated = [count for count in scenario.demand.counts if count.use == "generate"]
    if generated:
        others = [*placed, *users]
        seen = observations(scenario.demand)
        routes = RoutesOfDemand(scenario, region, ground.router)
        passages = planned_passages(others, region, ground.router, seen, routes=routes)
        for counts in generated:
            add(counted_trips(scenario, ground, counts, passages))
    return users, unmet


def trip_users(trips: Trips, *, until: float) -> list[RoadUser]:
    """Members of some trips who depart before ``until``."""
    rows = zip(
        trips.categories,
        trips.starts.tolist(),
        trips.goals.tolist(),
        trips.departs.tolist(),
        strict=True,
    )
    return [
        RoadUser(
            id=f"{trips.name}.{number}",
            category=category,
            spawn=start,
            goal=goal,
            depart=depart,
            flow=trips.part,
            trip=True,
            entering=trips.entering,
        )
        for number, (category, start, goal, depart) in enumerate(rows)
        if depart < until
    ]


def _pick_category(
    random: np.random.Generator, categories: list[Category], shares: list[float]
) -> Category:
    drawn = float(random.random()) * sum(shares)
    for category, share in zip(categories, shares, strict=True):
        drawn -= share
        if drawn < 0:
            return category
    return categories[-1]


def _required_node(graph: MapGraph, name: str) -> int:
    place = place_of(graph, name)
    if place is None:  # goals have been resolved, so the spawn is known
        raise AssertionError(name)
    return place.node
