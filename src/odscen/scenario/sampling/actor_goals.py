"""The goals of a scenario: those given, and those left open, drawn by its seed (R39)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.errors import ScenarioError
from odscen.lanegraph.graphs import Relation
from odscen.scenario.checks.actor_checks import (
    Subject,
    goal_problems,
    legs,
    spawn_problems,
    via_problems,
)
from odscen.scenario.document.distributions import stream
from odscen.scenario.document.problems import Problem, refuse_errors
from odscen.scenario.placing.region import NodePlace, Region, name_of, on_foot

if TYPE_CHECKING:
    from odscen.base.arrays import Int32Array
    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import Scenario


def resolve_goals(
    scenario: Scenario, graph: MapGraph, *, region: Region | None = None
) -> dict[str, int]:
    """Goal of every actor as a node index: of the pedestrian graph for pedestrians, else of lanes.

    An open goal is drawn from the candidates of the spawn by the scenario's seed and the actor's
    id, so that adding, removing or reordering other actors changes nothing. Of a vehicle that the
    story alone drives it is where its lane leads, straight on at forks: such a vehicle keeps it.

    Parameters
    ----------
    region
        The scenario's region on ``graph``, if the caller has made it already.

    Raises
    ------
    ScenarioError
        With every actor whose spawn or goal is not usable.
    """
    region = Region.of(graph, scenario.roi) if region is None else region
    region.look_up(leg for actor in scenario.actors for leg in legs(actor))
    goals: dict[str, int] = {}
    problems: list[Problem] = []
    for index, actor in enumerate(scenario.actors):
        subject = Subject.actor(scenario, region, index)
        place, found = spawn_problems(subject)
        problems += found
        if place is not None:
            place, found = via_problems(subject, place)
            problems += found
        if place is None:
            continue
        given = None if actor.goal is None else region.place(actor.goal)
        if given is not None and region.leads(place, given):
            goals[actor.id] = given.node
            continue
        found = tuple(goal_problems(subject, place))
        problems += found
        if not found:
            candidates = region.candidates(place)
            keeps = actor.driver == "story" and not actor.via and not place.walk
            ahead = _find_lane_end(graph, place.node, candidates) if keeps else None
            drawn = int(stream(scenario.seed, "goal", actor.id).choice(candidates))
            goals[actor.id] = drawn if ahead is None else ahead
    refuse_errors(problems)
    return goals


def _find_lane_end(graph: MapGraph, start: int, candidates: Int32Array) -> int | None:
    """Last of some nodes that a lane leads to, straight on at forks; ``None`` if to none."""
    lanes = graph.lanes
    edges = np.flatnonzero(lanes.relation == Relation.SUCCESSOR)
    edges = edges[np.argsort(lanes.source[edges], kind="stable")]
    sources = lanes.source[edges]
    wanted = set(candidates.tolist())
    node, seen, last_wanted = start, {start}, None
    while True:
        first, last = np.searchsorted(sources, (node, node + 1))
        onward = lanes.target[edges[first:last]]
        if not len(onward):
            return last_wanted
        node = int(onward[np.argmax(np.cos(lanes.hdg[onward] - lanes.hdg[node]))])
        if node in seen:  # a roundabout, or a block that is driven around
            return last_wanted
        seen.add(node)
        last_wanted = node if node in wanted else last_wanted


def flow_goals(
    scenario: Scenario, graph: MapGraph, *, region: Region | None = None
) -> dict[str, Int32Array]:
    """Goals that the actors of each flow draw from: the one given, or all candidates.

    Node indices, of the pedestrian graph for flows of pedestrians, ascending.

    Raises
    ------
    ScenarioError
        With every flow whose spawn or goal is not usable.
    """
    region = Region.of(graph, scenario.roi) if region is None else region
    goals: dict[str, Int32Array] = {}
    problems: list[Problem] = []
    for index, flow in enumerate(scenario.flows):
        subject = Subject.flow(scenario, region, index)
        place, found = spawn_problems(subject)
        if place is not None:
            found = tuple(goal_problems(subject, place))
            given = None if flow.goal is None else region.place(flow.goal)
            goals[flow.id] = (
                region.candidates(place)
                if given is None
                else np.array([given.node], dtype=np.int32)
            )
        problems += found
    refuse_errors(problems)
    return goals


def with_goals(scenario: Scenario, graph: MapGraph) -> Scenario:
    """Write the goal that :func:`resolve_goals` draws into every actor that has none.

    Raises
    ------
    ScenarioError
        If two actors have the same id, or as :func:`resolve_goals`.
    """
    goals = resolve_goals(scenario, graph)
    if len(goals) != len(scenario.actors):
        raise ScenarioError("two actors have the same id")
    actors = tuple(
        actor.model_copy(
            update={"goal": name_of(graph, NodePlace(on_foot(actor.category), goals[actor.id]))}
        )
        for actor in scenario.actors
    )
    return scenario.model_copy(update={"actors": actors})
