"""What the measures of a scenario do, as an additional file of SUMO's and as part of the plan.

Lanes are closed by SUMO's rerouters, limits set by its variable speed signs: both hold in plain
``sumo`` too, and after a saved state is loaded, where SUMO takes up what is active at its begin.
Neither leads drivers around: the run does that, see :mod:`odscen.sumo.worker.diversions`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

import numpy as np

from odscen.records.run_plan import ClosedPeriod, PlannedMeasure
from odscen.scenario.document.measures_document import (
    ChangedPermission,
    LaneIncident,
    RoadClosure,
    Roadworks,
    SignalOutage,
    SpeedLimit,
    banned_by,
    closed_places,
    measure_words,
    named_places,
)
from odscen.sumo.realize.driving import KINDS
from odscen.sumo.realize.traffic_measures.measured_lanes import MeasuredLanes, by_lane, periods

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.scenario.document.measures_document import Measure
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.road_net import RoadNet, RoadNetLane
    from odscen.sumo.realize.route_planner import Route
    from odscen.sumo.realize.sumo_map import SumoMap

NARROW = ((3.66, 0.0), (3.35, 3.1), (3.05, 10.6))
"""Least lane width (m) and what it takes off the free-flow speed (km/h); below, the last.

Highway Capacity Manual, 6th edition, exhibit 12-20: 12 ft 0, 11 ft 1.9 mi/h, 10 ft 6.6 mi/h.
"""

SLOWEST = 1.0
"""m/s that a limit is lowered to at most."""


@dataclass(frozen=True, slots=True)
class ClosedLanes:
    """Lanes that vehicles of some classes may not enter for a time."""

    id: str
    begin: float
    end: float
    lanes: tuple[str, ...]
    banned: frozenset[str]
    destinations: str = "leave"
    inside: frozenset[str] = frozenset()
    """Edges of the places, for what becomes of trips to them."""


@dataclass(frozen=True)
class MeasureActions:
    """Additional file, ``None`` if nothing is in it, and what goes into the plan."""

    xml: str | None = None
    measures: tuple[PlannedMeasure, ...] = ()
    closed: tuple[ClosedPeriod, ...] = ()
    closings: tuple[ClosedLanes, ...] = ()

    def fitted(
        self, route: Route, net: RoadNet, *, length: float, depart: float, vclass: str
    ) -> Route:
        """Let a route begin and end where closures leave it.

        The front of a body of ``length`` metres reaches over where its centre is to be: into the
        junction where its lane ends, or onto the road behind its goal. A route that meets something
        closed begins and ends on a road instead: SUMO refuses other routes to vehicles that depart
        inside a junction. Who would depart on a closed lane departs on the nearest open one.
        """
        if not self.closings:
            return route
        return self._move_departure(
            self._cut_ending(self._cut_beginning(route, net), net, length=length),
            net,
            depart,
            vclass,
        )

    def _cut_beginning(self, route: Route, net: RoadNet) -> Route:
        first = net.edge_lanes[route.edges[0]][0]
        before = net.links_to.get(first.id, ()) if first.internal else ()
        if not before:
            return route
        lane = net.lanes[before[0].source]
        edges = (lane.edge, *route.edges[1:])
        passed = {first.id, *(lane.id for lane in net.leaving(first.id))}
        if passed.isdisjoint(self._closed_lanes) and not self._meets_closed_pair(edges):
            return route
        return replace(route, edges=edges, depart_lane=lane.index, depart_pos=lane.length)

    def _cut_ending(self, route: Route, net: RoadNet, *, length: float) -> Route:
        edges = route.edges
        if len(edges) < 3 or route.arrival_pos > length or edges[-2:] not in self._closed_pairs:
            return route
        pos = net.edge_length(edges[-2])
        return replace(route, edges=edges[:-1], arrival_lane=None, arrival_pos=pos)

    def _move_departure(self, route: Route, net: RoadNet, depart: float, vclass: str) -> Route:
        closed = {
            lane
            for closing in self.closings
            if closing.begin <= depart < closing.end and vclass in closing.banned
            for lane in closing.lanes
        }
        lanes = net.edge_lanes[route.edges[0]]
        if lanes[route.depart_lane].id not in closed:
            return route
        rest = [lane for lane in lanes if lane.id not in closed and lane.allows(vclass)]
        if not rest:
            return route
        nearest = min(rest, key=lambda lane: abs(lane.index - route.depart_lane))
        return replace(route, depart_lane=nearest.index)

    def _meets_closed_pair(self, edges: tuple[str, ...]) -> bool:
        return any(pair in self._closed_pairs for pair in pairwise(edges))

    @cached_property
    def _closed_pairs(self) -> set[tuple[str, ...]]:
        return {pair for period in self.closed for pair in period.pairs}

    @cached_property
    def _closed_lanes(self) -> set[str]:
        return {lane for closing in self.closings for lane in closing.lanes}


def measure_actions(
    scenario: Scenario, sumo_map: SumoMap, *, until: float, step_length: float
) -> MeasureActions:
    """Work out what the measures of a scenario do in a run of ``until`` seconds.

    Closures begin and end with a step in SUMO, the nearest, and take at least one.

    Raises
    ------
    ScenarioError
        If a place is not on the map.
    """
    active = [measure for measure in scenario.measures if measure.begin < until]
    if not active:
        return MeasureActions()
    measured_lanes = MeasuredLanes(sumo_map)
    closings = [
        ClosedLanes(
            measure.id,
            measure.begin,
            end_of(measure, until),
            measured_lanes.closed_by(closed_places(measure)),
            frozenset(KINDS[category].vclass for category in banned_by(measure)),
            *_resolve_destinations(measure, measured_lanes),
        )
        for measure in active
        if isinstance(measure, RoadClosure | Roadworks | ChangedPermission)
        and closed_places(measure)
    ]
    lines = [
        *_rerouter_lines(closings, measured_lanes, step_length),
        *_speed_sign_lines(active, measured_lanes, until),
    ]
    xml = "\n".join(["<additional>", *lines, "</additional>", ""]) if lines else None
    planned = sorted(
        (_plan_measure(measure, measured_lanes, sumo_map, until) for measure in active),
        key=_begin_and_id,
    )
    return MeasureActions(
        xml,
        tuple(planned),
        tuple(_closed_periods(closings, measured_lanes, until)),
        tuple(closings),
    )


def end_of(measure: Measure, until: float) -> float:
    """Seconds at which a measure ends in a run."""
    return until if measure.end is None else min(measure.end, until)


def narrowed(width: float) -> float:
    """What a lane of so many metres takes off the free-flow speed, m/s."""
    less = next((kmh for least, kmh in NARROW if width >= least), NARROW[-1][1])
    return less / 3.6


def _resolve_destinations(measure: Measure, found: MeasuredLanes) -> tuple[str, frozenset[str]]:
    """What becomes of trips to what a measure closes, and the edges that it closes."""
    if not isinstance(measure, RoadClosure) or measure.destinations == "leave":
        return "leave", frozenset()
    lanes = (found.net.lanes[lane] for place in measure.places for lane in found.lanes(place))
    return measure.destinations, frozenset(lane.edge for lane in lanes if not lane.internal)


def _begin_and_id(measure: PlannedMeasure) -> tuple[float, str]:
    return measure.begin, measure.id


def _rerouter_lines(
    closings: Sequence[ClosedLanes], found: MeasuredLanes, step_length: float
) -> Iterator[str]:
    for closing in closings:
        if not closing.lanes:
            continue
        edges = " ".join(found.predecessors(closing.lanes))
        yield f"    <rerouter id={quoteattr(f'closed.{closing.id}')} edges={quoteattr(edges)}>"
        # SUMO compares these with the time of a step: between two it never opens again, and before
        # the second it does not get on at all.
        first = round(closing.begin / step_length)
        last = max(first + 1, round(closing.end / step_length))
        begin, end = first * step_length, last * step_length
        yield f'        <interval begin="{begin:.10g}" end="{end:.10g}">'
        for name in closing.lanes:
            who = _remaining_permission(found.net.lanes[name], closing.banned)
            yield f"            <closingLaneReroute id={quoteattr(name)} {who}/>"
        yield "        </interval>"
        yield "    </rerouter>"


def _remaining_permission(lane: RoadNetLane, banned: frozenset[str]) -> str:
    """Say who may still use a lane; SUMO starts from all classes, not from those of the lane."""
    if lane.allowed is None:
        return f'disallow="{" ".join(sorted(banned))}"'
    left = sorted(lane.allowed - banned)
    return f'allow="{" ".join(left)}"' if left else 'disallow="all"'


def _speed_sign_lines(
    measures: Sequence[Measure], found: MeasuredLanes, until: float
) -> Iterator[str]:
    limits = by_lane(_limit_spans(measures, found, until))
    alike: dict[tuple[tuple[float, float], ...], list[str]] = {}
    for lane, spans in sorted(limits.items()):
        alike.setdefault(_limit_steps(spans, until), []).append(lane)
    for number, (steps, lanes) in enumerate(alike.items()):
        yield f'    <variableSpeedSign id="limit.{number}" lanes={quoteattr(" ".join(lanes))}>'
        yield from (
            f'        <step time="{time:.10g}" speed="{speed:g}"/>' for time, speed in steps
        )
        yield "    </variableSpeedSign>"


def _limit_spans(
    measures: Sequence[Measure], found: MeasuredLanes, until: float
) -> Iterator[tuple[str, float, float, float]]:
    for measure in measures:
        if not isinstance(measure, SpeedLimit | Roadworks):
            continue
        if isinstance(measure, Roadworks) and measure.speed is None and measure.width is None:
            continue
        for lane in sorted({lane for name in measure.places for lane in found.lanes(name)}):
            speed = found.net.lanes[lane].speed if measure.speed is None else measure.speed
            if isinstance(measure, Roadworks) and measure.width is not None:
                speed = max(SLOWEST, speed - narrowed(measure.width))
            yield lane, measure.begin, end_of(measure, until), round(speed, 4)


def _limit_steps(
    spans: Sequence[tuple[float, float, float]], until: float
) -> tuple[tuple[float, float], ...]:
    """When which limit holds; -1 is the lane's own."""
    steps: list[tuple[float, float]] = []
    for begin, end in periods(((b, e) for b, e, _ in spans), until):
        held = [speed for b, e, speed in spans if b <= begin and end <= e]
        speed = min(held, default=-1.0)
        if steps[-1:] and steps[-1][1] == speed:
            continue
        if steps or speed >= 0.0:
            steps.append((begin, speed))
    return tuple(steps)


def _closed_periods(
    closings: Sequence[ClosedLanes], found: MeasuredLanes, until: float
) -> Iterator[ClosedPeriod]:
    classes = sorted({vclass for closing in closings for vclass in closing.banned})
    for begin, end in periods(((closing.begin, closing.end) for closing in closings), until):
        for vclass in classes:
            closed = frozenset(
                lane
                for closing in closings
                if closing.begin <= begin and end <= closing.end and vclass in closing.banned
                for lane in closing.lanes
            )
            active = [c for c in closings if c.begin <= begin and end <= c.end]
            ends = {e for c in active if c.destinations == "end" for e in c.inside}
            waits = {e: c.end for c in active if c.destinations == "wait" for e in c.inside}
            if pairs := found.broken_links(closed, vclass):
                yield ClosedPeriod(
                    begin, end, vclass, pairs, tuple(sorted(ends)), tuple(sorted(waits.items()))
                )


def _plan_measure(
    measure: Measure, found: MeasuredLanes, sumo_map: SumoMap, until: float
) -> PlannedMeasure:
    if isinstance(measure, SignalOutage):
        lines = _light_place(measure, sumo_map)
    elif isinstance(measure, LaneIncident):
        nodes = found.places.lane_nodes(measure.lane)
        lanes = sumo_map.graph.lanes
        lines = ()
        if nodes is not None:
            near = int(nodes[np.argmin(np.abs(lanes.s[nodes] - measure.s))])
            lines = ((round(float(lanes.x[near]), 2), round(float(lanes.y[near]), 2)),)
    else:
        lines = tuple(
            line for _, name in named_places(measure) for line in found.line(found.find(name).nodes)
        )
    return PlannedMeasure(
        id=measure.id,
        kind=measure.kind,
        words=measure_words(measure),
        begin=measure.begin,
        end=end_of(measure, until),
        lines=lines,
    )


def _light_place(measure: SignalOutage, sumo_map: SumoMap) -> tuple[tuple[float, ...], ...]:
    """Middle of what a light controls."""
    for light in sumo_map.lights:
        if measure.junction in (light.id, *light.junctions):
            points = [point for link in light.links for point in link.path]
            if points:
                middle = np.mean(np.array(points), axis=0).round(2)
                return (tuple(middle.tolist()),)
    return ()
