"""The rules for parking of trips: that the map has places, and the region some of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.scenario.document.problems import Problem, error, warning

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.lanegraph.parking_areas import MapParking
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.placing.region import Region

_WHERE = "demand.parking"


def parking_problems(
    scenario: Scenario, region: Region, parking: MapParking | None
) -> Iterator[Problem]:
    """Yield why trips cannot park as the demand wants; ``parking`` ``None`` is not known."""
    how = scenario.demand.parking
    if not how.used:
        return
    demand = scenario.demand
    if not (demand.inputs or demand.matrices or demand.background):
        message = "no trips park: there are no inputs, matrices and background; add some or drop it"
        yield warning("nothing_parks", _WHERE, message)
    if parking is None:
        return
    if not parking.areas:
        beside = (
            f" within reach of a lane; {parking.unreached} are not" if parking.unreached else ""
        )
        message = (
            "the map has no parking places (objects of type parkingSpace, lanes of type parking)"
            f"{beside}; drop parking from the demand"
        )
        yield error("no_parking", _WHERE, message)
    elif not any(region.lanes[area.node] for area in parking.areas):
        message = (
            f"none of the {len(parking.areas)} parking areas of the map is in the region of "
            "interest; add their segments or drop parking from the demand"
        )
        segments = region.graph.lanes.segment
        names = {str(region.graph.segments.ids[segments[area.node]]) for area in parking.areas}
        yield error("parking_outside_roi", _WHERE, message, segments=sorted(names))
