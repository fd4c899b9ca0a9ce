"""The rules for one actor or flow on its own: where it starts, where it goes, what it is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from odscen.base.categories import Category
from odscen.scenario.document.problems import Problem, error, warning
from odscen.scenario.placing.bodies import ModelBodies, body_of
from odscen.scenario.placing.region import NodePlace, Region, name_of, on_foot, turns_round
from odscen.scenario.placing.spawn_room import SAGITTA

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.base.categories import Body
    from odscen.scenario.document.scenario_document import Actor, Flow, Scenario

SPEED_MAX = {
    # Highest speed of SUMO's vehicle classes (m/s), bicycles and walkers as people move:
    # https://sumo.dlr.de/docs/Vehicle_Type_Parameter_Defaults.html
    Category.CAR: 55.6,
    Category.VAN: 55.6,
    Category.TRUCK: 36.1,
    Category.BUS: 27.8,
    Category.MOTORCYCLE: 55.6,
    Category.BICYCLE: 13.9,
    Category.PEDESTRIAN: 4.0,
}
SPEED_MIN = {
    category: 0.3 if category in (Category.PEDESTRIAN, Category.BICYCLE) else 1.0
    for category in Category
}
"""Below this (m/s) an actor hardly moves."""


class AssetLookup(ModelBodies, Protocol):
    """What checks ask of an asset catalogue."""

    def weather(self, preset: str) -> Mapping[str, float] | None:
        """Parameters of a weather preset, ``None`` if there is no such preset."""

    def category_of(self, model: str) -> Category | None:
        """Category of a model, ``None`` if there is no such model."""


@dataclass(frozen=True)
class Subject:
    """An actor or flow under examination, with all that its rules look at."""

    scenario: Scenario
    region: Region
    where: str
    one: Actor | Flow
    categories: tuple[Category, ...]

    @classmethod
    def actor(cls, scenario: Scenario, region: Region, index: int) -> Subject:
        """Take the actor at this place of the document."""
        actor = scenario.actors[index]
        return cls(scenario, region, f"actors[{index}]", actor, (actor.category,))

    @classmethod
    def flow(cls, scenario: Scenario, region: Region, index: int) -> Subject:
        """Take the flow at this place of the document."""
        flow = scenario.flows[index]
        return cls(scenario, region, f"flows[{index}]", flow, tuple(flow.mix))

    @property
    def name(self) -> str:
        """Return the id as messages quote it."""
        return repr(self.one.id)


def actor_problems(
    scenario: Scenario, region: Region, index: int, assets: AssetLookup | None = None
) -> Iterator[Problem]:
    """Yield everything wrong with one actor on its own."""
    subject = Subject.actor(scenario, region, index)
    actor = scenario.actors[index]
    yield from _model_problems(actor, subject, assets)
    yield from _speed_problems(subject, actor.category)
    if actor.ego and on_foot(actor.category):
        yield error(
            "ego_not_vehicle",
            f"{subject.where}.ego",
            f"{subject.name} is a pedestrian; only a vehicle can be the ego",
        )
    if actor.driver != "sumo" and on_foot(actor.category):
        yield error(
            "driver_not_possible",
            f"{subject.where}.driver",
            f"{subject.name} is a pedestrian, who has no driver; leave it out, and let "
            "rules say where it walks",
        )
    if actor.depart >= scenario.simulation.duration:
        yield warning(
            "departs_too_late",
            f"{subject.where}.depart",
            f"{subject.name} departs at {actor.depart:g} s, but the run ends at "
            f"{scenario.simulation.duration:g} s; depart earlier or run longer",
        )
    spawn, problems = spawn_problems(subject)
    yield from problems
    if spawn is not None:
        yield from _initial_speed_problems(subject, spawn)
        last, problems = via_problems(subject, spawn)
        yield from problems
        if last is not None:
            problems = tuple(goal_problems(subject, last))
            yield from problems
            if not any(problem.severity == "error" for problem in problems):
                yield from _turning_problems(subject)
        yield from _body_problems(subject, actor, spawn, body_of(actor, assets))


def _initial_speed_problems(subject: Subject, spawn: NodePlace) -> Iterator[Problem]:
    """Yield what is odd about the speed at departure, which SUMO bounds."""
    one = subject.one
    if one.initial_speed is None or spawn.walk or getattr(one, "driver", "sumo") == "story":
        return
    limit = float(subject.region.graph.lanes.speed_limit[spawn.node])
    # Who wants to be faster than the limit may be.
    allowed = one.speed or (limit if math.isfinite(limit) else math.inf)
    if one.initial_speed > allowed + 1e-9:
        yield warning(
            "initial_speed_too_high",
            f"{subject.where}.initial_speed",
            f"{subject.name} is to depart with {one.initial_speed:g} m/s, but its lane and its "
            f"desired speed allow {allowed:g} m/s: it departs with that",
        )


def flow_problems(scenario: Scenario, region: Region, index: int) -> Iterator[Problem]:
    """Yield everything wrong with one flow on its own."""
    subject = Subject.flow(scenario, region, index)
    flow = scenario.flows[index]
    if flow.end <= flow.begin:
        yield error(
            "flow_window_empty",
            f"{subject.where}.end",
            f"flow {subject.name} ends at {flow.end:g} s, not after it begins ({flow.begin:g} s)",
        )
    elif flow.begin >= scenario.simulation.duration:
        yield warning(
            "departs_too_late",
            f"{subject.where}.begin",
            f"flow {subject.name} begins at {flow.begin:g} s, but the run ends at "
            f"{scenario.simulation.duration:g} s; begin earlier or run longer",
        )
    for category in flow.mix:
        yield from _speed_problems(subject, category)
    spawn, problems = spawn_problems(subject)
    yield from problems
    if spawn is not None:
        yield from _initial_speed_problems(subject, spawn)
        yield from goal_problems(subject, spawn)


def spawn_problems(subject: Subject) -> tuple[NodePlace | None, tuple[Problem, ...]]:
    """Check the spawn; gives its place if the further rules can be asked, and the problems."""
    one, where = subject.one, f"{subject.where}.spawn"
    place = subject.region.place(one.spawn)
    if place is None:
        message = (
            f"{subject.name} starts on {one.spawn!r}, which the map does not have; pick a node"
        )
        return None, (error("unknown_spawn", where, message, nodes=[one.spawn]),)
    found: list[Problem] = []
    wrong = [category for category in subject.categories if on_foot(category) != place.walk]
    if wrong:
        kind, other = (
            ("a pedestrian node", "a node of a lane")
            if place.walk
            else ("a node of a lane", "a pedestrian node")
        )
        message = (
            f"{subject.name} ({', '.join(wrong)}) starts on {one.spawn!r}, {kind}; use {other}"
        )
        found.append(error("wrong_graph", where, message, nodes=[one.spawn]))
    if not subject.region.holds(place):
        segment = subject.region.segment_of(place)
        message = (
            f"{subject.name} starts on {one.spawn!r} in segment {segment!r}, outside the region of "
            "interest; move it or add the segment"
        )
        found.append(
            error("spawn_outside_roi", where, message, nodes=[one.spawn], segments=[segment])
        )
    return (None if found else place), tuple(found)


def vias(actor: Actor | Flow) -> tuple[str, ...]:
    """Nodes that a route leads through; those of flows lead through none."""
    found: tuple[str, ...] = getattr(actor, "via", ())
    return found


def legs(actor: Actor | Flow) -> Iterator[tuple[str, str | None]]:
    """Yield the pairs of nodes between which a route leads; an open goal is ``None``."""
    return zip((actor.spawn, *vias(actor)), (*vias(actor), actor.goal), strict=True)


def via_problems(
    subject: Subject, spawn: NodePlace
) -> tuple[NodePlace | None, tuple[Problem, ...]]:
    """Check the places that a route leads through.

    Returns
    -------
    The last of them, from which the route leads on to its goal (the spawn if there are none), or
    ``None`` if one is wrong; and what is wrong with it.
    """
    region, here, name = subject.region, spawn, subject.one.spawn
    for index, node in enumerate(vias(subject.one)):
        where, nodes = f"{subject.where}.via[{index}]", [name, node]
        place = region.place(node)
        if place is None:
            message = f"{subject.name} passes {node!r}, which the map does not have; pick a node"
            return None, (error("unknown_via", where, message, nodes=nodes),)
        if not region.holds(place):
            segment = region.segment_of(place)
            message = (
                f"{subject.name} passes {node!r} in segment {segment!r}, outside the region of "
                "interest; pick another node or add the segment"
            )
            return None, (
                error("via_outside_roi", where, message, nodes=nodes, segments=[segment]),
            )
        if not region.leads(here, place):
            message = (
                f"{subject.name} is to pass {node!r}, but cannot get there from {name!r} inside "
                "the region of interest; pick a node further on"
            )
            return None, (error("via_unreachable", where, message, nodes=nodes),)
        here, name = place, node
    return here, ()


def _turning_problems(subject: Subject) -> Iterator[Problem]:
    """Yield a place at which a walk would go back the way it came, as SUMO's walks cannot."""
    region, names = subject.region, (subject.one.spawn, *vias(subject.one), subject.one.goal)
    places = [place for name in names if name is not None and (place := region.place(name))]
    if len(places) < 3 or not places[0].walk:
        return
    path = region.path_over([place.node for place in places], walk=True)
    node = turns_round(path)
    if node is not None:
        name = name_of(region.graph, NodePlace(walk=True, node=node))
        yield error(
            "via_turns_round",
            f"{subject.where}.via",
            f"{subject.name} would turn round at {name!r} and lead back along itself, which no "
            "walk can; pick a place that it passes, or use a rule with 'walk'",
            nodes=[name],
        )


def goal_problems(subject: Subject, spawn: NodePlace) -> Iterator[Problem]:
    """Check the goal of an actor or flow whose spawn is right (R38).

    ``spawn`` is the last place that its route leads through, if it leads through any.
    """
    one, region, where = subject.one, subject.region, f"{subject.where}.goal"
    start = (one.spawn, *vias(one))[-1]
    if not region.router_of(spawn).has_goals(spawn.node):
        starts = "starts on" if start == one.spawn else "passes"
        yield error(
            "no_goal",
            f"{subject.where}.spawn",
            f"{subject.name} {starts} {start!r}, from where no path leads on inside the "
            "region of interest; start further back or add the next segment",
            nodes=[start],
        )
        return
    if one.goal is None:
        return
    goal = region.place(one.goal)
    nodes = [start, one.goal]
    if goal is None:
        message = f"{subject.name} goes to {one.goal!r}, which the map does not have; pick a goal"
        yield error("unknown_goal", where, message, nodes=nodes)
    elif not region.holds(goal):
        segment = region.segment_of(goal)
        message = (
            f"{subject.name} goes to {one.goal!r} in segment {segment!r}, outside the region of "
            "interest; pick another goal or add the segment"
        )
        yield error("goal_outside_roi", where, message, nodes=nodes, segments=[segment])
    elif not region.leads(spawn, goal):
        message = (
            f"{subject.name} cannot get from {start!r} to {one.goal!r} inside the region of "
            f"interest; pick one of its {len(region.candidates(spawn))} goals"
        )
        yield error("goal_unreachable", where, message, nodes=nodes)
    elif not region.is_candidate(spawn, goal):
        message = (
            f"{subject.name} goes to {one.goal!r}, which is not where a path through the region "
            f"ends, and vanishes there; pick one of its {len(region.candidates(spawn))} goals"
        )
        yield warning("goal_not_candidate", where, message, nodes=nodes)


def _model_problems(
    actor: Actor, subject: Subject, assets: AssetLookup | None
) -> Iterator[Problem]:
    if actor.model is None or assets is None:
        return
    category = assets.category_of(actor.model)
    if category is None:
        yield error(
            "unknown_model",
            f"{subject.where}.model",
            f"{subject.name} is a {actor.model!r}, which is not in the asset catalogue; pick "
            "another model or none",
        )
    elif category is not actor.category:
        yield error(
            "model_of_other_category",
            f"{subject.where}.model",
            f"{subject.name} is a {actor.category}, but its model {actor.model!r} is a {category}; "
            "change one of the two",
        )


def _speed_problems(subject: Subject, category: Category) -> Iterator[Problem]:
    speed = subject.one.speed
    if speed is None or SPEED_MIN[category] <= speed <= SPEED_MAX[category]:
        return
    yield warning(
        "speed_implausible",
        f"{subject.where}.speed",
        f"{subject.name} wants to go {speed:g} m/s ({speed * 3.6:.0f} km/h); plausible for a "
        f"{category} are {SPEED_MIN[category]:g} to {SPEED_MAX[category]:g} m/s",
    )


def _body_problems(
    subject: Subject, actor: Actor, spawn: NodePlace, body: Body
) -> Iterator[Problem]:
    graph = subject.region.nodes_of(spawn)
    offset, width = actor.lateral_offset, float(graph.width[spawn.node])
    beyond = abs(offset) + body.width / 2 - width / 2
    kind = "walk" if spawn.walk else "lane"
    if abs(offset) > width / 2:
        yield error(
            "off_lane",
            f"{subject.where}.lateral_offset",
            f"{subject.name} is {abs(offset):g} m off the middle of a {kind} {width:.2f} m wide, "
            f"outside it; at most {width / 2:.2f} m",
            nodes=[actor.spawn],
        )
    elif beyond > 0.01 and not spawn.walk:
        yield warning(
            "body_over_border",
            f"{subject.where}.lateral_offset",
            f"{subject.name} ({body.width:.2f} m wide, {offset:g} m beside the middle) reaches "
            f"{beyond:.2f} m over the border of its lane ({width:.2f} m)",
            nodes=[actor.spawn],
        )
    if spawn.walk:
        return
    bend = abs(float(subject.region.graph.lanes.curvature[spawn.node]))
    if body.length**2 * bend / 8 > SAGITTA:
        yield warning(
            "tight_curve",
            f"{subject.where}.spawn",
            f"{subject.name} is {body.length:.1f} m long and starts in a curve of {1 / bend:.0f} m "
            f"radius; its middle is {body.length**2 * bend / 8:.2f} m off the lane centre",
            nodes=[actor.spawn],
        )
