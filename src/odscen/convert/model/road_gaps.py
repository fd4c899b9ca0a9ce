"""Gaps: parts of roads that belong to junctions, under crosswalks and where side roads turn off."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.ids import RoadId
    from odscen.opendrive.road_model import OpenDrive, Road
    from odscen.opendrive.topology import SideLink

TO_JUNCTION = 12.0
"""Metres between a gap and a junction: with less, the gap belongs to the junction."""

BETWEEN = 8.0
"""Metres between gaps of one road: with less, no edge lies between them."""

STUB = 0.5
"""Metres of road that stay beyond a gap at a dead end."""

SIDE_MARGIN = 2.0
"""Metres of road before and behind a place where side roads turn off."""

TOGETHER = 30.0
"""Metres between side links of one junction that share a gap."""


class RoadGap(NamedTuple):
    """Part of a road that belongs to a junction, metres of s."""

    start: float
    end: float


def side_gaps(sides: Sequence[SideLink]) -> dict[RoadId, list[RoadGap]]:
    """Gaps around the places where lanes begin or end beside a road."""
    places: dict[RoadId, set[float]] = {}
    for side in sides:
        places.setdefault(side.main.road, set()).add(side.s)
    found: dict[RoadId, list[RoadGap]] = {}
    for road, own in places.items():
        gaps = found.setdefault(road, [])
        for s in sorted(own):
            if gaps and s - gaps[-1].end < TOGETHER:
                gaps[-1] = RoadGap(gaps[-1].start, s + SIDE_MARGIN)
            else:
                gaps.append(RoadGap(s - SIDE_MARGIN, s + SIDE_MARGIN))
    return found


def merge_gaps(
    odr: OpenDrive, *parts: Mapping[RoadId, Sequence[RoadGap]]
) -> dict[RoadId, tuple[RoadGap, ...]]:
    """Gaps of each road: sorted, disjoint, widened to junctions that are near."""
    roads = dict.fromkeys(road for part in parts for road in part)
    return {
        road: _merged(odr.roads[road], sorted(g for part in parts for g in part.get(road, ())))
        for road in roads
    }


def _merged(road: Road, gaps: list[RoadGap]) -> tuple[RoadGap, ...]:
    """Gaps of a road, widened to junctions that are near, and joined if they are close."""
    found: list[RoadGap] = []
    for gap in gaps:
        # At a dead end a stub stays: without an edge there no vehicle would come over the gap.
        start = max(gap.start, 0.0 if road.predecessor else min(STUB, 0.1 * road.length))
        end = min(gap.end, road.length - (0.0 if road.successor else min(STUB, 0.1 * road.length)))
        before, behind = start, road.length - end
        if before < min(TO_JUNCTION, behind) and _at_junction(road, "start"):
            start = 0.0
        if behind < min(TO_JUNCTION, before) and _at_junction(road, "end"):
            end = road.length
        if found and start - found[-1].end < BETWEEN:
            found[-1] = RoadGap(found[-1].start, max(found[-1].end, end))
        else:
            found.append(RoadGap(start, end))
    return tuple(found)


def _at_junction(road: Road, end: str) -> bool:
    link = road.predecessor if end == "start" else road.successor
    return link is not None and link.element_type == "junction"
