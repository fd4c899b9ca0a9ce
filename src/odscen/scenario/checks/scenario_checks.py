"""All rules of a scenario on its map, checked at once; docs/scenario-format.md lists the codes."""

from __future__ import annotations

from collections import Counter, defaultdict
from itertools import pairwise
from math import floor
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.shown import some_of
from odscen.lanegraph.query import neighbours
from odscen.scenario.checks.actor_checks import (
    AssetLookup,
    actor_problems,
    flow_problems,
    legs,
)
from odscen.scenario.checks.demand_checks import demand_problems, parking_problems, transit_problems
from odscen.scenario.checks.measure_checks import measure_problems
from odscen.scenario.checks.rule_checks import rule_problems
from odscen.scenario.checks.signal_checks import signal_problems
from odscen.scenario.document.problems import MOST_OF_KIND, Problem, error, limited, warning
from odscen.scenario.document.scenario_document import Flow
from odscen.scenario.placing.bodies import Box, Crowd, body_of, box_at
from odscen.scenario.placing.region import Region, place_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.base.categories import Body
    from odscen.lanegraph.graphs import MapGraph
    from odscen.lanegraph.parking_areas import MapParking
    from odscen.scenario.document.scenario_document import Actor, Scenario
    from odscen.scenario.signals.light import Light


def study_problems(scenario: Scenario, graph: MapGraph) -> Iterator[Problem]:
    """Yield ids that are there twice, and nodes that no vehicle can be measured at."""
    seen: dict[str, str] = {}
    for where, station in scenario.study.stations:
        if station.id in seen:
            message = f"id {station.id!r} is taken by {seen[station.id]}; give one of them another"
            yield error("duplicate_id", f"{where}.id", message)
        seen.setdefault(station.id, f"{where}.id")
        for name, nodes in station.lines:
            for index, node in enumerate(nodes):
                place = place_of(graph, node)
                at = f"{where}.{name}[{index}]"
                if place is None:
                    message = f"the map has no node {node!r}; place {station.id!r} elsewhere"
                    yield error("unknown_node", at, message)
                elif place.walk:
                    message = f"{node!r} is a node for pedestrians; {station.id!r} counts vehicles"
                    yield error("wrong_graph", at, message, nodes=[node])


_LISTED = 30
"""Names that a message lists at most."""
SAME_TIME = 1.0
"""Actors that depart within this many seconds of each other are on the road together."""


class _Start(NamedTuple):
    """Where and how large; actors with the same start in a window of time are one box."""

    spawn: str
    lateral_offset: float
    longitudinal_offset: float
    body: Body
    alone: str = ""
    """Id of one that the story drives, and that so waits for nobody."""

    @property
    def place(self) -> tuple[str, float, str]:
        """Where those wait behind one another who depart together."""
        return self.spawn, self.longitudinal_offset, self.alone


class _Window(NamedTuple):
    """Who departs within one stretch of :data:`SAME_TIME`."""

    crowd: Crowd
    known: dict[_Start, int]
    places: list[tuple[str, float, str]]
    actors: list[list[int]]

    def add(self, start: _Start, box: Box, actor: int) -> None:
        label = self.known.setdefault(start, len(self.places))
        if label == len(self.places):
            self.places.append(start.place)
            self.actors.append([])
            self.crowd.add(label, box)
        self.actors[label].append(actor)

    def beside(self, start: _Start, box: Box) -> Iterator[int]:
        """Actors whose boxes overlap this one, but for those that wait at the same place."""
        for label in self.crowd.touching(box):
            if self.places[label] != start.place:
                yield from self.actors[label]


def start_overlaps(
    scenario: Scenario, region: Region, assets: AssetLookup | None
) -> Iterator[Problem]:
    """Find bodies that share ground while both have just departed, the first thousand of them.

    There may be billions.

    Takes time in proportion to the actors and to what is found, however many start at one place.
    """
    found = 0
    for index, others in _find_overlapping(scenario, region, assets):
        actor = scenario.actors[index]
        for other in (scenario.actors[row] for row in others[: MOST_OF_KIND - found]):
            nodes = [actor.spawn, other.spawn]
            if actor.driver == other.driver == "story":
                yield warning(
                    "bodies_overlap",
                    f"actors[{index}].spawn",
                    f"{actor.id!r} and {other.id!r} overlap where they start: the run begins with "
                    "their collision",
                    nodes=nodes,
                )
                continue
            yield error(
                "bodies_overlap",
                f"actors[{index}].spawn",
                f"{actor.id!r} and {other.id!r} overlap where they start; move one of them or "
                "let it depart later",
                nodes=nodes,
            )
        found += len(others)
        if found >= MOST_OF_KIND:
            return


def _find_overlapping(
    scenario: Scenario, region: Region, assets: AssetLookup | None
) -> Iterator[tuple[int, list[int]]]:
    """Each actor with those before it in the document that it overlaps."""
    bodies = [body_of(actor, assets) for actor in scenario.actors]
    reach = 2 * max((body.length + body.width for body in bodies), default=0.0)
    windows: dict[int, _Window] = {}
    boxes: dict[_Start, Box] = {}
    for index, (actor, body) in enumerate(zip(scenario.actors, bodies, strict=True)):
        alone = actor.id if actor.driver == "story" else ""
        start = _Start(actor.spawn, actor.lateral_offset, actor.longitudinal_offset, body, alone)
        if start not in boxes:
            place = region.place(actor.spawn)
            if place is None:
                continue
            boxes[start] = box_at(
                region.nodes_of(place),
                place.node,
                body,
                lateral_offset=actor.lateral_offset,
                longitudinal_offset=actor.longitudinal_offset,
            )
        own = floor(actor.depart / SAME_TIME)
        near = [
            other
            for window in (own - 1, own, own + 1)
            if window in windows
            for other in windows[window].beside(start, boxes[start])
            if _depart_together(actor, scenario.actors[other])
        ]
        yield index, sorted(near)
        windows.setdefault(own, _Window(Crowd(reach), {}, [], [])).add(start, boxes[start], index)


def _depart_together(one: Actor, other: Actor) -> bool:
    return abs(one.depart - other.depart) < SAME_TIME


def check(
    scenario: Scenario,
    graph: MapGraph,
    assets: AssetLookup | None = None,
    lights: Sequence[Light] | None = None,
    *,
    parking: MapParking | None = None,
    region: Region | None = None,
) -> tuple[Problem, ...]:
    """Find everything that is wrong with a scenario on its map.

    Of very many problems of one kind the first thousand are listed, see
    :func:`~odscen.scenario.document.problems.limited`; :func:`every_problem` yields all.

    Parameters
    ----------
    graph
        The map that the scenario names. If it is another one, or has another node spacing, that is
        the first problem and rules that need the graph are left out.
    assets
        Catalogue for the rules on models and for their sizes; without one those are left out.
    lights
        Traffic lights of the map for the rules on their timing; without them those are left out.
    parking
        Where cars can park on the map; without it the rules on that are left out.
    region
        The scenario's region on ``graph``, if the caller has it: paths found once are remembered.

    Returns
    -------
    Problems in the order of the document, map and region first, errors and warnings mixed.
    """
    return tuple(
        limited(every_problem(scenario, graph, assets, lights, parking=parking, region=region))
    )


def every_problem(
    scenario: Scenario,
    graph: MapGraph,
    assets: AssetLookup | None = None,
    lights: Sequence[Light] | None = None,
    *,
    parking: MapParking | None = None,
    region: Region | None = None,
) -> Iterator[Problem]:
    """Yield what :func:`check` finds, however much it is; parameters as there.

    Of kinds of which there is one for each two parts of a scenario, such as rules that move an
    actor at once, there are only the first, and one problem that stands for the others.
    """
    on_other_map = list(map_problems(scenario, graph))
    if on_other_map:
        yield from on_other_map
        yield from _document_problems(scenario)
        return
    region = Region.of(graph, scenario.roi) if region is None else region
    yield from roi_problems(scenario, graph)
    yield from _document_problems(scenario)
    yield from _environment_problems(scenario, assets)
    region.look_up(leg for actor in scenario.actors for leg in legs(actor))
    for index in range(len(scenario.actors)):
        yield from actor_problems(scenario, region, index, assets)
    for index in range(len(scenario.flows)):
        yield from flow_problems(scenario, region, index)
    yield from demand_problems(scenario, region)
    yield from parking_problems(scenario, region, parking)
    yield from transit_problems(scenario, region)
    if lights is not None:
        clock, until = scenario.demand.clock, scenario.simulation.duration
        yield from signal_problems(scenario.signals, lights, clock=clock, until=until)
    yield from measure_problems(scenario, region, lights)
    yield from study_problems(scenario, graph)
    yield from rule_problems(scenario, region, lights)
    yield from shared_nodes(scenario)
    yield from start_overlaps(scenario, region, assets)


def roi_problems(scenario: Scenario, graph: MapGraph) -> Iterator[Problem]:
    """Yield what is wrong with the region of interest (R29).

    It is in one piece, or in several between which the map has nothing.
    """
    if not scenario.roi:
        yield error("roi_empty", "roi", "the region of interest is empty; pick a segment")
        return
    known = set(graph.segments.ids)
    for index, name in enumerate(scenario.roi):
        if name not in known:
            message = f"the map has no segment {name!r}; remove it"
            yield error("unknown_segment", f"roi[{index}]", message, segments=[name])
    for name, count in Counter(scenario.roi).items():
        if count > 1:
            message = f"segment {name!r} is listed {count} times; once is enough"
            yield warning("segment_twice", "roi", message, segments=[name])
    region = Region.of(graph, scenario.roi)
    if not region.is_whole and neighbours(graph.segments, region.segments):
        yield error(
            "roi_not_connected",
            "roi",
            "the region of interest is in several pieces; add the segments between them or remove "
            "some",
            segments=region.segments,
        )


def shared_nodes(scenario: Scenario) -> Iterator[Problem]:
    """Yield nodes that more than one actor or flow starts on (R37, R44).

    Flows may follow one another on a node, as where an inflow grows by steps; and whom the story
    drives starts wherever it is put, beside or in another body, see :func:`start_overlaps`.
    """
    users: dict[str, list[tuple[str, Actor | Flow]]] = defaultdict(list)
    for index, actor in enumerate(scenario.actors):
        if actor.driver != "story":
            users[actor.spawn].append((f"actors[{index}].spawn", actor))
    for index, flow in enumerate(scenario.flows):
        users[flow.spawn].append((f"flows[{index}].spawn", flow))
    for node, sharing in users.items():
        if len(sharing) > 1 and not _follow_each_other([one for _, one in sharing]):
            names = some_of([repr(one.id) for _, one in sharing])
            message = f"{names} start on the same node {node!r}; move all but one"
            yield error("node_taken", sharing[-1][0], message, nodes=[node])


def _follow_each_other(users: Sequence[Actor | Flow]) -> bool:
    """Whether all are flows of which each ends before the next begins."""
    flows = sorted(
        (one for one in users if isinstance(one, Flow)), key=lambda flow: (flow.begin, flow.end)
    )
    return len(flows) == len(users) and all(
        before.end <= after.begin for before, after in pairwise(flows)
    )


def duplicate_ids(scenario: Scenario) -> Iterator[Problem]:
    """Yield ids that more than one actor, flow or part of the demand has."""
    seen: dict[str, str] = {}
    placed = [
        (f"{kind}[{index}]", one)
        for kind in ("actors", "flows")
        for index, one in enumerate(getattr(scenario, kind))
    ]
    lines = [(f"transit.lines[{n}]", line) for n, line in enumerate(scenario.transit.lines)]
    for place, one in (*placed, *scenario.demand.parts, *lines):
        where = f"{place}.id"
        if one.id in seen:
            message = f"id {one.id!r} is taken by {seen[one.id]}; give one of them another"
            yield error("duplicate_id", where, message)
        else:
            seen[one.id] = where


def _document_problems(scenario: Scenario) -> Iterator[Problem]:
    yield from duplicate_ids(scenario)
    egos = [actor.id for actor in scenario.actors if actor.ego]
    if len(egos) > 1:
        names = some_of([*map(repr, egos)], between=", ")
        message = f"{names} are all the ego; keep one"
        yield error("several_egos", "actors", message)
    styles = scenario.drivers.styles
    listed = some_of(list(styles), most=_LISTED, between=", ")
    for index, actor in enumerate(scenario.actors):
        if actor.style not in styles:
            message = f"{actor.id!r} drives as {actor.style!r}; there are {listed}"
            yield error("unknown_style", f"actors[{index}].style", message)
    headway, step = scenario.drivers.headway, scenario.simulation.step_length
    if headway is not None and headway < step:
        message = (
            f"the headway is {headway:g} s, but a step lasts {step:g} s: SUMO cannot keep vehicles"
            " that are closer from colliding; raise the headway or shorten the step"
        )
        yield error("headway_below_step", "drivers.headway", message)
    traffic = scenario.flows, scenario.demand.parts, scenario.transit.lines, scenario.sumo
    if not scenario.actors and not any(traffic):
        yield warning(
            "no_actors", "actors", "there are neither actors nor flows; nothing will move"
        )


def _environment_problems(scenario: Scenario, assets: AssetLookup | None) -> Iterator[Problem]:
    if assets is None:
        return
    environment = scenario.environment
    parameters = assets.weather(environment.preset)
    if parameters is None:
        message = f"there is no weather preset {environment.preset!r}; pick one of the catalogue"
        yield error("unknown_preset", "environment.preset", message)
        return
    for name in environment.parameters:
        if name not in parameters:
            listed = some_of(list(parameters), most=_LISTED, between=", ")
            message = f"weather has no parameter {name!r}; there are {listed}"
            yield error("unknown_parameter", f"environment.parameters.{name}", message)


def map_problems(scenario: Scenario, graph: MapGraph) -> Iterator[Problem]:
    """Yield why a scenario was not made on this graph, if it was not."""
    made_on = scenario.map
    if made_on.sha256 != graph.map_sha256:
        yield error(
            "map_mismatch",
            "map.sha256",
            f"the scenario was made on map {made_on.name!r} with sha256 {made_on.sha256[:12]}..., "
            f"but this is {graph.map_name!r} with {graph.map_sha256[:12]}...; add that .xodr file",
        )
    elif made_on.spacing != graph.lanes.spacing:
        yield error(
            "spacing_mismatch",
            "map.spacing",
            f"the scenario's nodes are {made_on.spacing:g} m apart, those of this map "
            f"{graph.lanes.spacing:g} m; add the map with --spacing {made_on.spacing:g}",
        )
