"""The rules for public transport: where stops can be, and that a line can be driven."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from odscen.base.categories import DEFAULT_BODY
from odscen.scenario.document.problems import Problem, error, warning
from odscen.scenario.placing.region import on_foot

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.document.transit_document import TransitLine
    from odscen.scenario.placing.region import NodePlace, Region


def transit_problems(scenario: Scenario, region: Region) -> Iterator[Problem]:
    """Yield everything wrong with stops and lines of a scenario."""
    places: dict[str, NodePlace] = {}
    for index, stop in enumerate(scenario.transit.stops):
        where = f"transit.stops[{index}]"
        if stop.id in places:
            message = f"two stops are called {stop.id!r}; give one of them another id"
            yield error("duplicate_id", f"{where}.id", message)
        place, found = _road_place(region, stop.node, f"{where}.node", f"stop {stop.id!r}")
        yield from found
        if place is not None:
            places[stop.id] = place
    known = {stop.id for stop in scenario.transit.stops}
    for index, line in enumerate(scenario.transit.lines):
        where = f"transit.lines[{index}]"
        yield from _line_problems(scenario, line, where)
        unknown = [(row, one.stop) for row, one in enumerate(line.stops) if one.stop not in known]
        for row, name in unknown:
            message = f"line {line.id!r} serves stop {name!r}; there are {_listed(known)}"
            yield error("unknown_stop", f"{where}.stops[{row}].stop", message)
        if not unknown:
            yield from _route_problems(line, places, region, where)


def _line_problems(scenario: Scenario, line: TransitLine, where: str) -> Iterator[Problem]:
    if on_foot(line.category):
        message = f"line {line.id!r} has pedestrians; its trips are made by vehicles"
        yield error("wrong_graph", f"{where}.category", message)
    first = line.departures[0] if line.departures else line.begin
    if first >= scenario.simulation.duration:
        message = (
            f"line {line.id!r} departs first at {first:g} s, but the run ends at "
            f"{scenario.simulation.duration:g} s; depart earlier or run longer"
        )
        yield warning("departs_too_late", where, message)


def _route_problems(
    line: TransitLine, places: Mapping[str, NodePlace], region: Region, where: str
) -> Iterator[Problem]:
    start, found = _road_place(region, line.start, f"{where}.start", f"line {line.id!r}")
    yield from found
    goal = None
    if line.goal is not None:
        goal, found = _road_place(region, line.goal, f"{where}.goal", f"line {line.id!r}")
        yield from found
    if start is None or any(one.stop not in places for one in line.stops):
        return
    named = [(line.start, start), *((one.stop, places[one.stop]) for one in line.stops)]
    if goal is not None:
        named.append((str(line.goal), goal))
    for (one, place), (other, further) in pairwise(named):
        if not region.leads(place, further):
            nodes = [line.start, *([line.goal] if line.goal else [])]
            message = f"line {line.id!r}: no way leads from {one!r} to {other!r} inside the region"
            yield error("no_path", f"{where}.stops", message, nodes=nodes)
            return
    if goal is None and not len(region.candidates(named[-1][1])):
        message = f"line {line.id!r} has no end of the region to go to after its last stop"
        yield error("no_goal", f"{where}.goal", message)


def _road_place(
    region: Region, node: str, where: str, name: str
) -> tuple[NodePlace | None, list[Problem]]:
    place = region.place(node)
    if place is None or place.walk:
        what = "is on a walk, not on a lane" if place else "is not on the map"
        return None, [error("unknown_node", where, f"{name}: node {node!r} {what}", nodes=[node])]
    lanes = region.graph.lanes
    if not region.holds(place):
        message = f"{name}: node {node!r} is outside the region of interest"
        return None, [error("outside_roi", where, message, nodes=[node])]
    if lanes.lanes.junctions[int(lanes.lane[place.node])] is not None:
        message = f"{name}: node {node!r} is inside a junction; move it onto a road"
        return None, [error("in_junction", where, message, nodes=[node])]
    if float(lanes.width[place.node]) < min(body.width for body in DEFAULT_BODY.values()):
        message = f"{name}: the lane is too narrow at node {node!r}"
        return None, [error("lane_too_narrow", where, message, nodes=[node])]
    return place, []


def _listed(known: set[str]) -> str:
    return ", ".join(sorted(known)) or "none"
