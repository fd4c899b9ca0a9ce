"""The trips of lines, one vehicle each, with what is drawn for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.scenario.demand.trips import FIRST
from odscen.scenario.document.distributions import stream
from odscen.scenario.document.scenario_document import Actor
from odscen.scenario.placing.region import place_of
from odscen.sumo.realize.road_user import RoadUser, StopVisit

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from odscen.scenario.document.scenario_document import Scenario, TransitLine
    from odscen.scenario.placing.region import Region

LEAST_DWELL = 1.0
"""Seconds: SUMO needs a step to stop in."""


def line_users(scenario: Scenario, region: Region, *, until: float) -> Iterator[RoadUser]:
    """Yield the vehicles of all lines that depart before ``until``, named ``<line>.<number>``.

    The scenario has been checked. Dwell times are drawn by the seed, the line, and the numbers of
    trip and stop, so that other trips and lines change nothing.
    """
    nodes = {stop.id: _required_node(region, stop.node) for stop in scenario.transit.stops}
    for line in scenario.transit.lines:
        goal = _goal_of_line(scenario, line, region, nodes)
        for number, depart in enumerate(_departure_times(scenario, line, until)):
            if depart >= until:
                break
            yield RoadUser(
                id=f"{line.id}.{number}",
                category=line.category,
                spawn=_required_node(region, line.start),
                goal=goal,
                depart=max(depart, FIRST),
                flow=line.id,
                visits=_stop_visits(scenario, line, number, depart, nodes),
                design=Actor(id=line.id, category=line.category, spawn="any", model=line.model),
            )


def _departure_times(scenario: Scenario, line: TransitLine, until: float) -> tuple[float, ...]:
    """Times of a line; those of a headway are not made beyond ``until``."""
    if line.headway is None:
        return line.departures
    end = min(scenario.simulation.duration if line.end is None else line.end, until)
    return tuple(np.round(np.arange(line.begin, end, line.headway), 2).tolist())


def _stop_visits(
    scenario: Scenario, line: TransitLine, number: int, depart: float, nodes: Mapping[str, int]
) -> tuple[StopVisit, ...]:
    visits = []
    for row, stop in enumerate(line.stops):
        rng = stream(scenario.seed, "dwell", line.id, str(number), str(row))
        dwell = (stop.dwell or line.dwell).draw(rng)
        visits.append(
            StopVisit(
                stop=stop.stop,
                node=nodes[stop.stop],
                dwell=round(max(dwell, LEAST_DWELL), 1),
                scheduled=None if stop.after is None else round(depart + stop.after, 2),
            )
        )
    return tuple(visits)


def _goal_of_line(
    scenario: Scenario, line: TransitLine, region: Region, nodes: Mapping[str, int]
) -> int:
    """Goal of all trips of a line: as given, or an end of the region drawn by the seed."""
    if line.goal is not None:
        return _required_node(region, line.goal)
    last = nodes[line.stops[-1].stop]
    return int(stream(scenario.seed, "goal", line.id).choice(region.router.goal_candidates(last)))


def _required_node(region: Region, name: str) -> int:
    place = place_of(region.graph, name)
    if place is None:  # the scenario has been checked
        raise AssertionError(name)
    return place.node
