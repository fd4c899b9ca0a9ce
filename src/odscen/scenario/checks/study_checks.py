"""What can be wrong with the stations of a study."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.scenario.document.problems import Problem, error
from odscen.scenario.placing.region import place_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import Scenario


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
