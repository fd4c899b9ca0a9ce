"""The rules on measures, and the places of measures on the lane graph."""

from __future__ import annotations

import math
from bisect import bisect_right, insort
from collections import Counter, defaultdict
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.shown import some_of
from odscen.lanegraph.graphs import Relation
from odscen.lanegraph.shortest_paths import Router
from odscen.scenario.demand.zones import PLACE_SEPARATOR, place_segments
from odscen.scenario.document.measures_document import (
    LaneIncident,
    SignalOutage,
    banned_by,
    closed_places,
    named_places,
)
from odscen.scenario.document.problems import MOST_PAIRS, error, more_of_kind, warning
from odscen.scenario.signals.light import lights_by_name

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from odscen.base.arrays import BoolArray, Int32Array
    from odscen.base.categories import Category
    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.measures_document import Measure
    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.placing.region import Region
    from odscen.scenario.signals.light import Light


class MeasurePlace(NamedTuple):
    """Nodes that a name stands for; of a turn those inside the junction.

    Attributes
    ----------
    nodes
        Mask over the nodes of the lane graph, shape ``(N,)``.
    turn
        Whether it is a turn; ``source`` and ``target`` are then masks of the segments before and
        behind, else empty.
    """

    nodes: BoolArray
    turn: bool
    source: BoolArray
    target: BoolArray


class UnknownPlace(NamedTuple):
    """Why a name stands for nothing, and the segments that it names all the same."""

    code: str
    message: str
    segments: tuple[str, ...] = ()


class PlaceNames:
    """Finds places on one map."""

    def __init__(self, graph: MapGraph) -> None:
        self._graph = graph
        self._segments = {str(name): row for row, name in enumerate(graph.segments.ids)}
        self._lanes = {str(key): row for row, key in enumerate(graph.lanes.lanes.keys)}
        follows = graph.lanes.relation == Relation.SUCCESSOR
        self._source: Int32Array = graph.lanes.source[follows]
        self._target: Int32Array = graph.lanes.target[follows]

    def find(self, name: str) -> MeasurePlace | UnknownPlace:
        """Find the nodes of a segment, lane or turn."""
        if PLACE_SEPARATOR in name:
            return self._read_turn(name)
        lanes = self._graph.lanes
        none = np.zeros(len(lanes.x), dtype=np.bool_)
        if name in self._segments:
            return MeasurePlace(lanes.segment == self._segments[name], False, none, none)
        if name in self._lanes:
            return MeasurePlace(lanes.lane == self._lanes[name], False, none, none)
        message = f"{name!r} is neither a segment nor a lane of the map, nor a turn like r1>r2"
        return UnknownPlace("unknown_place", message)

    def lane_nodes(self, name: str) -> Int32Array | None:
        """Nodes of a lane in the order of the graph; ``None`` if the map has no such lane."""
        if name not in self._lanes:
            return None
        found: Int32Array = np.flatnonzero(self._graph.lanes.lane == self._lanes[name]).astype(
            np.int32
        )
        return found

    def _read_turn(self, name: str) -> MeasurePlace | UnknownPlace:
        segments = place_segments(name)
        unknown = tuple(segment for segment in segments if segment not in self._segments)
        if unknown:
            message = f"place {name!r} has segment {unknown[0]!r}, which the map does not have"
            return UnknownPlace("unknown_segment", message, unknown)
        own = self._graph.lanes.segment
        masks = [own == self._segments[segment] for segment in segments]
        junctions = [self._graph.segments.kinds[self._segments[segment]] for segment in segments]
        if junctions[0] == "junction" or junctions[-1] == "junction":
            message = f"turn {name!r} has to begin and end with a road"
            return UnknownPlace("place_broken", message, segments)
        inside = self._nodes_between(masks)
        if inside is None:
            message = f"place {name!r}: no lane leads from {segments[0]!r} into {segments[-1]!r}"
            return UnknownPlace("place_broken", message, segments)
        return MeasurePlace(inside, True, masks[0], masks[-1])

    def _nodes_between(self, masks: list[BoolArray]) -> BoolArray | None:
        """Nodes between the first segment and the last; ``None`` if nothing leads there."""
        kinds = np.array([kind == "junction" for kind in self._graph.segments.kinds])
        junction: BoolArray = kinds[self._graph.lanes.segment]
        between = junction if len(masks) == 2 else np.logical_or.reduce(masks[1:-1])
        ahead = self._spread_within(masks[0], between, self._source, self._target)
        behind = self._spread_within(masks[-1], between, self._target, self._source)
        found: BoolArray = ahead & behind
        direct = bool((masks[0][self._source] & masks[-1][self._target]).any())
        passed = all(bool(found[mask].any()) for mask in masks[1:-1])
        return found if passed and (found.any() or direct) else None

    def _spread_within(
        self, start: BoolArray, inside: BoolArray, source: Int32Array, target: Int32Array
    ) -> BoolArray:
        """Nodes of ``inside`` that are reached from ``start`` without leaving it."""
        reached = np.zeros(len(start), dtype=np.bool_)
        reached[target[start[source] & inside[target]]] = True
        while True:
            more = reached[source] & inside[target] & ~reached[target]
            if not more.any():
                return reached
            reached[target[more]] = True


SLACK = 0.1
"""Metres by which a place may lie beyond the ends of a lane."""


def measure_problems(
    scenario: Scenario, region: Region, lights: Sequence[Light] | None = None
) -> Iterator[Problem]:
    """Yield what is wrong with the measures of a scenario.

    Parameters
    ----------
    lights
        Traffic lights of the map for the rules on outages; without them those are left out.
    """
    if not scenario.measures:
        return
    places = PlaceNames(region.graph)
    yield from measure_errors(scenario, region, lights, places=places)
    for index, measure in enumerate(scenario.measures):
        yield from _time_problems(scenario, measure, f"measures[{index}]")
    yield from _cut_off(scenario, region, places)


def measure_errors(
    scenario: Scenario,
    region: Region,
    lights: Sequence[Light] | None = None,
    *,
    places: PlaceNames | None = None,
) -> Iterator[Problem]:
    """Yield what measures may not be, as :func:`measure_problems` without warnings.

    Who is cut off by closures needs a search for routes; an edit is refused for errors only.
    """
    places = places or PlaceNames(region.graph)
    yield from _find_repeated_ids(scenario)
    outages = None if lights is None else _outage_problems(scenario, lights)
    for index, measure in enumerate(scenario.measures):
        where = f"measures[{index}]"
        yield from _place_problems(measure, places, where)
        if isinstance(measure, LaneIncident):
            yield from _incident_problems(measure, places, region, where)
        if outages is not None:
            yield from outages.get(index, ())


def _find_repeated_ids(scenario: Scenario) -> Iterator[Problem]:
    """Yield ids that two measures have, or a measure and an actor: events name both alike."""
    others = [*scenario.actors, *scenario.flows, *(part for _, part in scenario.demand.parts)]
    taken = Counter(
        [*(measure.id for measure in others), *(measure.id for measure in scenario.measures)]
    )
    for index, measure in enumerate(scenario.measures):
        if taken[measure.id] > 1:
            message = f"id {measure.id!r} is taken {taken[measure.id]} times; give each its own"
            yield error("duplicate_id", f"measures[{index}].id", message)


def _time_problems(scenario: Scenario, measure: Measure, where: str) -> Iterator[Problem]:
    duration = scenario.simulation.duration
    if measure.begin >= duration:
        message = (
            f"{measure.id!r} begins at {measure.begin:g} s, but the run ends at {duration:g} s; "
            "begin earlier or run longer"
        )
        yield warning("measure_too_late", f"{where}.begin", message)


def _place_problems(measure: Measure, places: PlaceNames, where: str) -> Iterator[Problem]:
    for field, name in named_places(measure):
        found = places.find(name)
        here = f"{where}.{field}"
        if isinstance(found, UnknownPlace):
            yield error(found.code, here, found.message, segments=found.segments)
        elif found.turn and not field.startswith("places"):
            yield error("place_broken", here, f"{name!r} is a turn; give a lane here")
        elif found.turn and measure.kind in ("speed_limit", "roadworks"):
            message = f"{name!r} is a turn; a limit needs segments or lanes"
            yield error("place_broken", here, message)


def _incident_problems(
    measure: LaneIncident, places: PlaceNames, region: Region, where: str
) -> Iterator[Problem]:
    nodes = places.lane_nodes(measure.lane)
    if nodes is None:
        if not isinstance(places.find(measure.lane), UnknownPlace):
            message = f"{measure.lane!r} is no lane; name one, such as 12.0.-1"
            yield error("unknown_place", f"{where}.lane", message)
        return
    lanes = region.graph.lanes
    low, high = float(lanes.s[nodes].min()), float(lanes.s[nodes].max())
    if not low - lanes.spacing - SLACK <= measure.s <= high + lanes.spacing + SLACK:
        message = f"lane {measure.lane!r} lies between s {low:g} and {high:g} m"
        yield error("place_off_lane", f"{where}.s", message)
    if lanes.lanes.junctions[int(lanes.lane[nodes[0]])] is not None:
        message = f"lane {measure.lane!r} lies in a junction; block a lane before or behind it"
        yield error("place_in_junction", f"{where}.lane", message)


def _outage_problems(scenario: Scenario, lights: Sequence[Light]) -> dict[int, list[Problem]]:
    """Find what is wrong with outages of lights, by their places among the measures.

    Of outages of one light that overlap in time the first pairs are listed; the last of them has
    how many more there are.
    """
    light_of = lights_by_name(lights)
    planned = {
        id(light_of[timing.junction])
        for timing in scenario.signals.junctions
        if timing.plans and timing.junction in light_of
    }
    names = ", ".join(sorted(light.names[0] for light in lights)[:10]) or "none"
    found: dict[int, list[Problem]] = defaultdict(list)
    same: dict[int, list[int]] = defaultdict(list)
    for index, measure in enumerate(scenario.measures):
        if not isinstance(measure, SignalOutage):
            continue
        here = f"measures[{index}].junction"
        light = light_of.get(measure.junction)
        if light is None:
            message = (
                f"there is no traffic light in junction {measure.junction!r}; there are {names}"
            )
            found[index].append(error("unknown_light", here, message))
            continue
        if id(light) in planned:
            message = f"the light of {measure.junction!r} has plans of the day; take them out first"
            found[index].append(error("outage_with_plans", here, message))
        same[id(light)].append(index)
    pairs: list[tuple[int, int]] = []
    number = 0
    for outages in same.values():
        overlapping = _overlapping_pairs(scenario.measures, outages)
        number += overlapping.number
        pairs += overlapping.listed[: MOST_PAIRS - len(pairs)]
    for index, other in sorted(pairs):
        message = (
            f"{scenario.measures[index].id!r} and {scenario.measures[other].id!r} switch one light "
            "at the same time"
        )
        found[index].append(error("light_twice", f"measures[{index}].junction", message))
    if number > len(pairs):
        last = max(pairs)[0]
        found[last].append(more_of_kind(found[last][-1], number - len(pairs)))
    return found


class _Pairs(NamedTuple):
    """How many pairs of measures are in force at the same time, and the first of them.

    Each by its places among the measures, the later one first.
    """

    number: int
    listed: list[tuple[int, int]]


def _overlapping_pairs(measures: Sequence[Measure], these: Iterable[int]) -> _Pairs:
    """Go through the begins of measures; each overlaps all that have not ended by then."""
    active: list[tuple[float, int]] = []
    number, listed = 0, list[tuple[int, int]]()
    for begin, end, index in sorted(
        (*_times_of_measure(measures[index]), index) for index in these
    ):
        del active[: bisect_right(active, (begin, len(measures)))]
        number += len(active)
        listed += [
            (max(index, other), min(index, other))
            for _, other in active[: MOST_PAIRS - len(listed)]
        ]
        insort(active, (end, index))
    return _Pairs(number, listed)


def _times_of_measure(measure: Measure) -> tuple[float, float]:
    return measure.begin, math.inf if measure.end is None else measure.end


def _cut_off(scenario: Scenario, region: Region, places: PlaceNames) -> Iterator[Problem]:
    """Yield placed actors that depart while every route to their goal is closed."""
    asked = _routes_when_closed(scenario, region, places)
    stranded: dict[int, tuple[Measure, ...]] = {}
    for mask, routes in asked.values():
        stranded |= {route.actor: route.closing for route in _without_way(region, mask, routes)}
    for index, closing in sorted(stranded.items()):
        if all(getattr(measure, "destinations", "leave") != "leave" for measure in closing):
            continue
        actor = scenario.actors[index]
        names = some_of([repr(measure.id) for measure in closing], between=", ")
        message = (
            f"{actor.id!r} departs at {actor.depart:g} s, when {names} has closed every route "
            "to its goal; it will be stranded"
        )
        yield warning("only_route_closed", f"actors[{index}].goal", message)


class _Route(NamedTuple):
    """Nodes that an actor must reach one after another, and the measures that are in its way."""

    actor: int
    nodes: tuple[int, ...]
    closing: tuple[Measure, ...]


def _routes_when_closed(
    scenario: Scenario, region: Region, places: PlaceNames
) -> dict[bytes, tuple[BoolArray, list[_Route]]]:
    """Routes of actors that measures may stop, by the nodes that are open to them."""
    segments = region.graph.lanes.segment
    found: dict[bytes, tuple[BoolArray, list[_Route]]] = {}
    closed_by: dict[tuple[int, ...], BoolArray] = {}
    open_to: dict[tuple[tuple[int, ...], int | None], tuple[bytes, BoolArray]] = {}
    closures = [
        (row, measure, banned_by(measure), *_times_of_measure(measure))
        for row, measure in enumerate(scenario.measures)
        if closed_places(measure)
    ]
    # Between two of these instants the same measures are in force.
    instants = sorted({instant for *_, begin, end in closures for instant in (begin, end)})
    in_force: dict[tuple[int, Category], tuple[int, ...]] = {}
    for index, actor in enumerate(scenario.actors):
        key = bisect_right(instants, actor.depart), actor.category
        if key not in in_force:
            in_force[key] = tuple(
                row
                for row, _, banned, begin, end in closures
                if begin <= actor.depart < end and actor.category in banned
            )
        rows = in_force[key]
        spawn = region.place(actor.spawn)
        goal = None if actor.goal is None else region.place(actor.goal)
        if not rows or spawn is None or goal is None or spawn.walk or goal.walk:
            continue
        closing = tuple(scenario.measures[row] for row in rows)
        if rows not in closed_by:
            closed_by[rows] = _closed_nodes(closing, places, len(region.lanes))
        closed = closed_by[rows]
        # Who starts in a place that is closed may still leave it.
        own = int(segments[spawn.node]) if closed[spawn.node] else None
        if (rows, own) not in open_to:
            mask = region.lanes & (~closed | (segments == own if own is not None else False))
            open_to[rows, own] = mask.tobytes(), mask
        name, mask = open_to[rows, own]
        nodes = (
            spawn.node,
            *(p.node for name in actor.via if (p := region.place(name))),
            goal.node,
        )
        found.setdefault(name, (mask, []))[1].append(_Route(index, nodes, closing))
    return found


def _without_way(region: Region, mask: BoolArray, routes: Sequence[_Route]) -> Iterator[_Route]:
    """Yield the routes of which a part does not lead on over the nodes of the mask."""
    open_routes = [route for route in routes if mask[list(route.nodes)].all()]
    pairs = [
        (pair, open_route.actor)
        for open_route in open_routes
        for pair in pairwise(open_route.nodes)
    ]
    broken: set[int] = set()
    if pairs:
        nodes = np.array([pair for pair, _ in pairs], dtype=np.int32)
        leads = Router(region.graph, mask).leads(nodes[:, 0], nodes[:, 1])
        broken = {index for (_, index), way in zip(pairs, leads, strict=True) if not way}
    whole = {open_route.actor for open_route in open_routes} - broken
    yield from (route for route in routes if route.actor not in whole)


def _closed_nodes(measures: Iterable[Measure], places: PlaceNames, size: int) -> BoolArray:
    closed = np.zeros(size, dtype=np.bool_)
    for measure in measures:
        for name in closed_places(measure):
            found = places.find(name)
            if not isinstance(found, UnknownPlace):
                closed |= found.nodes
    return closed
