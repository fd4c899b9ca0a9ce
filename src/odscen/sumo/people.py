"""Who is on the road: the scenario's actors, and those of its flows one by one.

Flows are drawn here rather than left to SUMO, so that each of their vehicles has its own category,
goal and speed factor, written down and the same for the same seed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.categories import Category
from odscen.scenario.goals import flow_goals, resolve_goals, stream
from odscen.scenario.region import place_of

if TYPE_CHECKING:
    import numpy as np

    from odscen.lanegraph.model import IntArray, MapGraph
    from odscen.scenario.document import DrivingStyle, Flow, Scenario
    from odscen.scenario.region import Region


@dataclass(frozen=True, slots=True)
class RoadUser:
    """One vehicle or person with everything decided; ``spawn`` and ``goal`` are node indices.

    They count on the pedestrian graph for pedestrians and on the lane graph for everybody else.
    """

    id: str
    category: Category
    spawn: int
    goal: int
    depart: float
    model: str | None = None
    speed: float | None = None
    lateral_offset: float = 0.0
    style: DrivingStyle = "normal"
    flow: str | None = None
    ego: bool = False
    ignores_red: bool = False

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
            model=actor.model,
            speed=actor.speed,
            lateral_offset=actor.lateral_offset,
            style=actor.style,
            ego=actor.ego,
            ignores_red=actor.ignores_red,
        )
        for actor in scenario.actors
    ]
    if scenario.flows:
        candidates = flow_goals(scenario, graph, region=region)
        for flow in scenario.flows:
            spawn = _node(graph, flow.spawn)
            users += flow_users(
                flow, seed=scenario.seed, spawn=spawn, goals=candidates[flow.id], until=until
            )
    return tuple(sorted(users, key=lambda user: (user.depart, user.id)))


def flow_users(
    flow: Flow, *, seed: int, spawn: int, goals: IntArray, until: float
) -> list[RoadUser]:
    """Members of a flow: a Poisson stream, that is, headways are exponentially distributed.

    The count in the flow's window is then random too, ``per_hour`` on average. Member ``k`` is
    named ``<flow>.<k>``; those after ``until`` are left out, and change nothing about those before.
    """
    random = stream(seed, "flow", flow.id)
    categories = sorted(flow.mix)
    shares = [flow.mix[category] for category in categories]
    users: list[RoadUser] = []
    depart = flow.begin
    while True:
        depart += float(random.exponential(3600.0 / flow.per_hour))
        category = _pick(random, categories, shares)
        goal = int(goals[int(random.integers(len(goals)))])
        if depart >= min(flow.end, until):
            return users
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
