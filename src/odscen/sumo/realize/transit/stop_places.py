"""Where the stops of lines are on the SUMO network, and the file that says so to SUMO."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple
from xml.sax.saxutils import quoteattr

from odscen.base.errors import ScenarioError
from odscen.scenario.placing.region import place_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.realize.sumo_map import SumoMap

CLEAR = 0.1
"""Metres of its lane behind a stop: SUMO takes none that ends where a rounded length does."""

LEAST_LENGTH = 5.0
"""Metres of a stop that must fit on the SUMO lane."""


class StopPlace(NamedTuple):
    """A stop on the SUMO network; positions in metres along the lane."""

    id: str
    name: str
    lane: str
    edge: str
    begin: float
    end: float
    bay: bool


def stop_places(scenario: Scenario, sumo_map: SumoMap) -> dict[str, StopPlace]:
    """Find the stops of a scenario on the network, by id.

    Raises
    ------
    ScenarioError
        With every stop for which the network has no lane, or too little of it.
    """
    places: dict[str, StopPlace] = {}
    problems: list[str] = []
    for index, stop in enumerate(scenario.transit.stops):
        node = place_of(sumo_map.graph, stop.node)
        place = None if node is None else sumo_map.lane_places.of(node.node)
        lane = None if place is None else sumo_map.net.lanes[place[0]]
        where = f"transit.stops[{index}]: stop {stop.id!r}"
        if place is None or lane is None or lane.internal:
            problems.append(f"{where}: the SUMO network has no lane outside junctions there")
            continue
        half = stop.length / 2.0 * sumo_map.lane_places.scales[lane.id]
        begin, end = max(place[1] - half, 0.0), min(place[1] + half, lane.length - CLEAR)
        if end - begin < LEAST_LENGTH:
            problems.append(f"{where}: only {end - begin:.1f} m of it are on its SUMO lane")
            continue
        places[stop.id] = StopPlace(stop.id, stop.name, lane.id, lane.edge, begin, end, stop.bay)
    if problems:
        raise ScenarioError("stops that cannot be there", problems=problems)
    return places


def stops_xml(stops: Mapping[str, StopPlace]) -> str:
    """Text of ``stops.add.xml``."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', "<additional>"]
    for stop in stops.values():
        name = f" name={quoteattr(stop.name)}" if stop.name else ""
        lines.append(
            f"    <busStop id={quoteattr(stop.id)}{name} lane={quoteattr(stop.lane)} "
            f'startPos="{stop.begin:.2f}" endPos="{stop.end:.2f}"/>'
        )
    return "\n".join([*lines, "</additional>", ""])


def left_out(stops: Iterable[StopPlace], edges: Iterable[str]) -> StopPlace | None:
    """First of the stops that a route does not pass in their order; ``None`` if it passes all."""
    rest = iter(edges)
    here = None
    for stop in stops:
        if stop.edge != here and not any(edge == stop.edge for edge in rest):
            return stop
        here = stop.edge
    return None
