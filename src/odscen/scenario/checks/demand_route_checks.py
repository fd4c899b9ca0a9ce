"""The rules for how trips of the demand choose their routes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.scenario.demand.zones import segments_of
from odscen.scenario.document.problems import error, warning

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.scenario.document.problems import Problem
    from odscen.scenario.document.routes_document import SharedRoutes
    from odscen.scenario.document.scenario_document import Demand, Scenario
    from odscen.scenario.placing.region import Region


def route_problems(scenario: Scenario, region: Region) -> Iterator[Problem]:
    """Yield what is wrong with the routes of the demand."""
    demand = scenario.demand
    for index, one in enumerate(demand.routes.shares):
        where = f"demand.routes.shares[{index}]"
        yield from _end_problems(demand, one, region, where)
        yield from _via_problems(one, region, where)
    generated = any(one.use == "generate" for one in demand.counts)
    if demand.routes.by == "travel_time" and generated:
        message = (
            "traffic generated from counts is made beside trips on their quickest routes in free "
            "flow; with other routes by travel time the counts are met less well"
        )
        yield warning("counts_by_travel_time", "demand.routes.by", message)


def _end_problems(
    demand: Demand, one: SharedRoutes, region: Region, where: str
) -> Iterator[Problem]:
    known = {str(name) for name in region.graph.segments.ids}
    inside = {str(name) for name in region.segments}
    zones = {zone.id for zone in demand.zones}
    for field, name in (("origin", one.origin), ("destination", one.destination)):
        if name not in zones and name not in known:
            message = f"{name!r} is neither a zone nor a segment of the map"
            yield error("unknown_zone", f"{where}.{field}", message)
        elif not inside.intersection(segments_of(demand, name)):
            message = f"{name!r} is outside the region of interest"
            yield error("zone_outside_roi", f"{where}.{field}", message)


def _via_problems(one: SharedRoutes, region: Region, where: str) -> Iterator[Problem]:
    known = {str(name) for name in region.graph.segments.ids}
    inside = {str(name) for name in region.segments}
    for row, (via, _) in enumerate(one.routes):
        here = f"{where}.routes[{row}]"
        for name in via:
            if name not in known:
                message = f"the route leads over {name!r}, which the map does not have"
                yield error("unknown_segment", here, message, segments=[name])
            elif name not in inside:
                message = f"the route leads over {name!r}, outside the region of interest"
                yield error("zone_outside_roi", here, message, segments=[name])
