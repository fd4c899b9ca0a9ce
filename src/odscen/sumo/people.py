"""Who is on the road: the scenario's actors, and those of its flows and demand one by one.

They are drawn here rather than left to SUMO and its tools (flows, od2trips), so that each vehicle
has its own category, start, goal and speed factor, written down, the same for the same seed and
independent of what else is in the scenario.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.categories import Category
from odscen.scenario.counting import observations
from odscen.scenario.document import Actor
from odscen.scenario.goals import flow_goals, resolve_goals, stream
from odscen.scenario.profiles import curve
from odscen.scenario.region import place_of
from odscen.scenario.trips import background_trips, matrix_trips
from odscen.scenario.zones import Ground
from odscen.sumo.counts import counted_trips
from odscen.sumo.passages import planned_passages

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.lanegraph.model import IntArray, MapGraph
    from odscen.scenario.document import Flow, Scenario
    from odscen.scenario.profiles import Curve
    from odscen.scenario.region import Region
    from odscen.scenario.supply import Usable
    from odscen.scenario.trips import Trips


_AS_USUAL = Actor(id="anybody", category=Category.CAR, spawn="anywhere")
"""Its optional fields have the document's defaults; the others mean nothing."""


@dataclass(frozen=True, slots=True)
class RoadUser:
    """One vehicle or person with everything decided; ``spawn`` and ``goal`` are node indices.

    They count on the pedestrian graph for pedestrians and on the lane graph for everybody else.
    ``flow`` is the flow or the part of the demand that it belongs to. ``trip`` is set for members
    of the demand: many share a goal, so their ways are found from there.

    ``design`` is the actor as the document has it, for what is not decided here but acted on as it
    is: model, style and the like. Members of flows and demand are as usual.
    """

    id: str
    category: Category
    spawn: int
    goal: int
    depart: float
    speed: float | None = None
    flow: str | None = None
    trip: bool = False
    design: Actor = _AS_USUAL

    @property
    def person(self) -> bool:
        """Whether it moves on the pedestrian graph."""
        return self.category is Category.PEDESTRIAN


def road_users(
    scenario: Scenario, graph: MapGraph, region: Region, *, until: float
) -> tuple[RoadUser, ...]:
    """Everybody that the scenario puts on the road before ``until``, by departure, then id.

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
            spawn=_node(graph, actor.spawn),
            goal=goals[actor.id],
            depart=actor.depart,
            speed=actor.speed,
            design=actor,
        )
        for actor in scenario.actors
    ]
    if scenario.flows:
        candidates = flow_goals(scenario, graph, region=region)
        for flow in scenario.flows:
            spawn = _node(graph, flow.spawn)
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
    flow: Flow, *, seed: int, spawn: int, goals: IntArray, until: float, day: Curve | None = None
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
        category = _pick(random, categories, shares)
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
) -> tuple[list[RoadUser], list[str]]:
    """Members of the scenario's demand who depart before ``until``, and what of it is not met.

    Counts come last: they are made up for what everybody else, ``placed`` and the rest of the
    demand, leaves of them.
    """
    taken = [place for actor in scenario.actors if (place := region.place(actor.spawn))]
    ground = Ground(region, usable, taken=taken)
    users: list[RoadUser] = []
    unmet: list[str] = []

    def add(part: Iterable[Trips]) -> None:
        for trips in part:
            users.extend(trip_users(trips, until=until))
            if trips.unmet:
                unmet.append(f"{trips.name}: {trips.unmet} trips left out: {trips.why}")

    for matrix in scenario.demand.matrices:
        add(matrix_trips(scenario, ground, matrix))
    for background in scenario.demand.background:
        add(background_trips(scenario, ground, background, usable))
    if scenario.demand.counts:
        others = [*placed, *users]
        seen = observations(scenario.demand)
        passages = planned_passages(others, region, ground.router, seen)
        for counts in scenario.demand.counts:
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
        )
        for number, (category, start, goal, depart) in enumerate(rows)
        if depart < until
    ]


def _pick(random: np.random.Generator, categories: list[Category], shares: list[float]) -> Category:
    drawn = float(random.random()) * sum(shares)
    for category, share in zip(categories, shares, strict=True):
        drawn -= share
        if drawn < 0:
            return category
    return categories[-1]


def _node(graph: MapGraph, name: str) -> int:
    place = place_of(graph, name)
    if place is None:  # goals have been resolved, so the spawn is known
        raise AssertionError(name)
    return place.node
