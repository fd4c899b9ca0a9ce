"""Two-way roads that the junctions of a map let traffic only enter, or only leave."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.shown import shown_id
from odscen.convert.model.conversion_report import ElementOutcome, ReportEntry
from odscen.opendrive.road_model import DRIVABLE_TYPES

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.convert.model.connections import PlannedConnections
    from odscen.convert.model.edge_plan import EdgePlan
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive


def one_way_ends(
    odr: OpenDrive, table: RoadTable, found: PlannedConnections
) -> Iterator[ReportEntry]:
    """Name the ends of two-way roads where a junction leads traffic in one direction only."""
    by_road: dict[tuple[int, bool], list[int]] = {}
    for number, edge in enumerate(found.edges):
        if any(lane.type in DRIVABLE_TYPES for lane in edge.lanes):
            by_road.setdefault((edge.road, edge.forward), []).append(number)
    left = {connection.source for connection in found.connections}
    entered = {connection.target for connection in found.connections}
    for road in odr.roads.values():
        row = table.road_index[road.id]
        along, against = by_road.get((row, True), []), by_road.get((row, False), [])
        for name, link in (("predecessor", road.predecessor), ("successor", road.successor)):
            if not along or not against or link is None or link.element_type != "junction":
                continue
            at_end = name == "successor"
            arriving = _outermost(found.edges, along if at_end else against, at_end=at_end)
            leaving = _outermost(found.edges, against if at_end else along, at_end=at_end)
            goes, comes = arriving in left, leaving in entered
            if goes != comes:
                reason = (
                    f"two-way road that is one-way at junction {link.element_id}: traffic can "
                    f"{'only leave it for' if goes else 'only enter it from'} the junction"
                )
                yield ReportEntry(ElementOutcome.LOST, f"road {shown_id(road.id)} > {name}", reason)


def _outermost(edges: Sequence[EdgePlan], numbers: Sequence[int], *, at_end: bool) -> int:
    """Edge nearest to the end of the road, or to its start."""
    middles = {number: edges[number].start + edges[number].end for number in numbers}
    return max(numbers, key=lambda number: middles[number] if at_end else -middles[number])
