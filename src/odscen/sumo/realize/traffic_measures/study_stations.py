"""Stations of a scenario's study on the SUMO network."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.records.run_plan import PlannedStation
from odscen.scenario.document.scenario_document import Cordon, Detector
from odscen.scenario.placing.region import place_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.records.run_plan import StationKind
    from odscen.scenario.document.scenario_document import Scenario, TravelTimeSection
    from odscen.sumo.realize.sumo_map import SumoMap


def planned_stations(
    scenario: Scenario, sumo_map: SumoMap
) -> tuple[tuple[PlannedStation, ...], list[str]]:
    """Stations as lines across SUMO lanes, and what cannot be measured, in words."""
    found, notes = [], []
    for _, station in scenario.study.stations:
        lines = [_line_places(nodes, sumo_map) for _, nodes in station.lines]
        missing = [
            node
            for (_, nodes), line in zip(station.lines, lines, strict=True)
            for node, place in zip(nodes, line, strict=True)
            if place is None
        ]
        if missing:
            notes.append(f"{station.id}: not measured, the network has no lane at {missing[0]}")
            continue
        placed = [tuple(place for place in line if place is not None) for line in lines]
        found.append(PlannedStation(station.id, _kind_of_station(station), *placed))
    return tuple(found), notes


def _kind_of_station(station: Detector | TravelTimeSection | Cordon) -> StationKind:
    if isinstance(station, Detector):
        return "detector"
    return "cordon" if isinstance(station, Cordon) else "section"


def _line_places(nodes: Sequence[str], sumo_map: SumoMap) -> list[tuple[str, float] | None]:
    places = [place_of(sumo_map.graph, node) for node in nodes]
    return [
        None if place is None or place.walk else sumo_map.lane_places.of(place.node)
        for place in places
    ]
