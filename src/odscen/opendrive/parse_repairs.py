"""Junction tables that lead nowhere, repaired from geometry (:attr:`Rule.JUNCTION_TABLE`).

A lane of a connecting road that leads to no lane, or that no lane leads to, is joined to the lane
at which it ends or begins, if exactly one lane meets it there, of the road that the connecting
road's own link names, or of any road outside junctions if it names none. Whatever leads somewhere
stays as it is. Roads of a junction that is linked to nothing are roads outside junctions.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from odscen.base.ids import LaneKey, RoadId
from odscen.base.shown import shown_id
from odscen.opendrive.lanes import RoadTable, is_forward
from odscen.opendrive.parse_rules import Notes, Rule
from odscen.opendrive.road_model import DRIVABLE_TYPES, Connection, RoadLink
from odscen.opendrive.topology import DeadEnd, End, dead_ends, end_section

if TYPE_CHECKING:
    from collections.abc import Iterable
    from collections.abc import Set as AbstractSet

    from odscen.base.arrays import FloatArray, IntArray
    from odscen.opendrive.road_model import Junction, OpenDrive, Road

MEETS: Final = 1.0
"""Metres between the middles of two lanes that meet, at most."""

MEETS_ANGLE: Final = math.radians(20.0)
"""Radians between the directions of two lanes that meet, at most."""

MOST_NEAR: Final = 16
"""Lane ends that are looked at for each dead end; where as many meet, nothing is clear."""

LEAST_WIDTH: Final = 0.3
"""Metres: lanes that are narrower where they end have come to an end there."""


class _LaneEnd(NamedTuple):
    """A lane at one end of its road; ``begins`` if traffic drives away from that end."""

    lane: LaneKey
    end: End
    begins: bool


class _Meeting(NamedTuple):
    """A dead end and the lane end that meets it, so many metres away."""

    dead: DeadEnd
    other: _LaneEnd
    gap: float


def repair_junction_tables(odr: OpenDrive, notes: Notes) -> OpenDrive:
    """Join connecting lanes that lead nowhere to the lanes that they meet, and note each."""
    found = dead_ends(odr)
    if not found:
        return odr
    meetings = _find_meetings(odr, found)
    if not meetings:
        return odr
    repaired = _join_meetings(odr, meetings)
    left = set(dead_ends(repaired))
    if left - set(found):  # another contact point would cut off lanes that do lead somewhere
        meetings = [meeting for meeting in meetings if _contact_stands(odr, meeting)]
        repaired = _join_meetings(odr, meetings)
        left = set(dead_ends(repaired))
    for dead, other, gap in meetings:
        if dead not in left:
            way = "leads to no lane" if dead.leads else "is reached from no lane"
            begins = "begins" if dead.leads else "ends"
            road, section, lane = dead.lane
            place = f"road {shown_id(road)} > laneSection {section} > lane {lane}"
            detail = (
                f"{way} by the junction's table; joined to lane {other.lane.lane} of road "
                f"{shown_id(other.lane.road)}, which {begins} {gap:.2f} m from it"
            )
            notes.add(Rule.JUNCTION_TABLE, place, detail)
    return repaired


def free_roads_of_no_junction(odr: OpenDrive, notes: Notes) -> OpenDrive:
    """Read roads of a junction without connections, to which nothing is linked, as plain roads.

    Nobody could enter such a junction, or its roads, otherwise.
    """
    linked = {
        link.element_id
        for road in odr.roads.values()
        for link in (road.predecessor, road.successor)
        if link is not None and link.element_type == "junction"
    }
    roads = dict(odr.roads)
    for road in odr.roads.values():
        junction = None if road.junction is None else odr.junctions.get(road.junction)
        if junction is None or junction.connections or junction.id in linked:
            continue
        if road.predecessor is not None or road.successor is not None:
            continue
        detail = (
            f"junction {shown_id(junction.id)} has no connection and no road is linked to it; "
            "read as a road outside junctions"
        )
        notes.add(Rule.JUNCTION_TABLE, f"road {shown_id(road.id)}", detail)
        roads[road.id] = replace(road, junction=None)
    return replace(odr, roads=roads) if roads != odr.roads else odr


def _find_meetings(odr: OpenDrive, found: Iterable[DeadEnd]) -> list[_Meeting]:
    """Dead ends that exactly one lane end meets."""
    from scipy.spatial import cKDTree

    table = RoadTable.of(odr)
    dead = list(found)
    links = [_link_at_end(odr.roads[dead_end.lane.road], dead_end.end) for dead_end in dead]
    others = list(_lane_ends(odr, {link.element_id for link in links if link is not None}))
    if not others:
        return []
    own = [_LaneEnd(dead_end.lane, dead_end.end, not dead_end.leads) for dead_end in dead]
    places, headings, widths = _place_lane_ends(odr, table, own)
    other_places, other_headings, other_widths = _place_lane_ends(odr, table, others)
    found_near: Any = cKDTree(other_places).query(
        places, k=list(range(1, MOST_NEAR + 1)), distance_upper_bound=MEETS
    )
    meetings: list[_Meeting] = []
    for number, rows in enumerate(found_near[1].tolist()):
        candidates = [
            row
            for row in rows
            if row < len(others)  # else fewer are near
            and others[row].begins == dead[number].leads
            and min(widths[number], other_widths[row]) >= LEAST_WIDTH
            and abs(math.remainder(other_headings[row] - headings[number], math.tau)) <= MEETS_ANGLE
            and _may_join(odr, dead[number], others[row])
        ]
        if len(candidates) == 1 and rows[-1] == len(others):
            gap = float(np.hypot(*(other_places[candidates[0]] - places[number])))
            meetings.append(_Meeting(dead[number], others[candidates[0]], gap))
    return meetings


def _lane_ends(odr: OpenDrive, named: AbstractSet[str]) -> Iterable[_LaneEnd]:
    """Ends of drivable lanes at both ends of roads outside junctions, and of those named."""
    ends: tuple[End, End] = ("start", "end")
    for road in odr.roads.values():
        if road.junction is not None and road.id not in named:
            continue
        for end in ends:
            number = end_section(road, end)
            for lane in road.sections[number].lanes.values():
                if lane.id and lane.type in DRIVABLE_TYPES:
                    begins = is_forward(road, lane) == (end == "start")
                    yield _LaneEnd(LaneKey(road.id, number, lane.id), end, begins)


def _place_lane_ends(
    odr: OpenDrive, table: RoadTable, ends: list[_LaneEnd]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Middles of lane ends, shape ``(N, 2)``, directions of their traffic, radians, and widths."""
    rows: IntArray = np.array([table.lane_index[end.lane] for end in ends], dtype=np.int64)
    s = np.array([0.0 if end.end == "start" else odr.roads[end.lane.road].length for end in ends])
    points = table.lane_points(rows, s)
    back = np.where(table.lane_forward[rows], 0.0, math.pi)
    return np.stack([points.x, points.y], axis=1), points.hdg + back, points.width


def _link_at_end(road: Road, end: End) -> RoadLink | None:
    return road.predecessor if end == "start" else road.successor


def _contact_stands(odr: OpenDrive, meeting: _Meeting) -> bool:
    """Whether the link of the connecting road names the end that is met, or there is none."""
    link = _link_at_end(odr.roads[meeting.dead.lane.road], meeting.dead.end)
    return link is None or link.contact_point == meeting.other.end


def _may_join(odr: OpenDrive, dead: DeadEnd, other: _LaneEnd) -> bool:
    """Whether no link of either road leads elsewhere."""
    road, there = odr.roads[dead.lane.road], odr.roads[other.lane.road]
    link, back = _link_at_end(road, dead.end), _link_at_end(there, other.end)
    own: tuple[str, str | None]
    if there.junction is None:
        own = ("junction", road.junction)
    elif link is None:
        return False
    else:
        own = ("road", road.id)
    if back is not None and (back.element_type, back.element_id) != own:
        return False
    if link is None:
        return True
    return (link.element_type, link.element_id) == ("road", there.id) and link.element_s is None


def _join_meetings(odr: OpenDrive, meetings: Iterable[_Meeting]) -> OpenDrive:
    """The model with links and lane links for meetings, as far as they agree on each road end."""
    roads, junctions = dict(odr.roads), dict(odr.junctions)
    agreed: dict[tuple[str, End], RoadLink] = {}
    for dead, other, _ in meetings:
        road = roads[dead.lane.road]
        link = RoadLink("road", other.lane.road, other.end)
        if agreed.setdefault((road.id, dead.end), link) != link:
            continue
        if dead.end == "start":
            road = replace(road, predecessor=link)
        else:
            road = replace(road, successor=link)
        if dead.leads:
            road = _lead_on(road, dead, other)
        elif road.junction is not None:
            junctions[road.junction] = _add_lane_link(junctions[road.junction], dead, other)
        roads[road.id] = road
    return replace(odr, roads=roads, junctions=junctions)


def _lead_on(road: Road, dead: DeadEnd, other: _LaneEnd) -> Road:
    """A connecting road whose lane leads on."""
    section = road.sections[dead.lane.section]
    lane = section.lanes[dead.lane.lane]
    if dead.end == "start":
        lane = replace(lane, predecessors=(other.lane.lane,))
    else:
        lane = replace(lane, successors=(other.lane.lane,))
    section = replace(section, lanes={**section.lanes, lane.id: lane})
    sections = list(road.sections)
    sections[dead.lane.section] = section
    return replace(road, sections=tuple(sections))


def _add_lane_link(junction: Junction, dead: DeadEnd, other: _LaneEnd) -> Junction:
    """A junction with a lane link to a connecting lane."""
    link = (other.lane.lane, dead.lane.lane)
    key = (other.lane.road, dead.lane.road, dead.end)
    connections = list(junction.connections)
    for number, connection in enumerate(connections):
        if (connection.incoming_road, connection.connecting_road, connection.contact_point) == key:
            connections[number] = connection._replace(lane_links=(*connection.lane_links, link))
            break
    else:
        connections.append(Connection("", *key, (link,)))
    return replace(junction, connections=tuple(connections))


# ---------------------------------------------------------- roads that are in a file more than once
def merge_coincident_roads(
    roads: dict[RoadId, Road], junctions: Iterable[Junction], notes: Notes
) -> dict[RoadId, Road]:
    """Keep one of roads that are alike, lead links to it, and note each that is left out.

    Roads that a junction names stay: its connections may tell them apart.
    """
    kept = _find_kept_roads(roads, junctions)
    if not kept:
        return roads
    for road, other in kept.items():
        detail = f"is as road {shown_id(other)} in all but id and name; it is merged with it"
        notes.add(Rule.COINCIDENT_ROAD, f"road {shown_id(road)}", detail)
    return {
        key: replace(
            road,
            predecessor=_redirect_link(road.predecessor, kept),
            successor=_redirect_link(road.successor, kept),
        )
        for key, road in roads.items()
        if key not in kept
    }


def _find_kept_roads(
    roads: dict[RoadId, Road], junctions: Iterable[Junction]
) -> dict[RoadId, RoadId]:
    """The first of the roads that are alike, for each of the others."""
    named = {
        road
        for junction in junctions
        for connection in junction.connections
        for road in (connection.incoming_road, connection.connecting_road)
    }
    free = [road for road in roads.values() if road.junction is None and road.id not in named]
    places = Counter(road.geometry for road in free)
    first: dict[str, RoadId] = {}
    kept: dict[RoadId, RoadId] = {}
    for road in free:
        if places[road.geometry] > 1:
            # A road has no hash, for its lanes are in dictionaries.
            content = repr(replace(road, id=RoadId(""), name=""))
            first_road = first.setdefault(content, road.id)
            if first_road != road.id:
                kept[road.id] = first_road
    return kept


def _redirect_link(link: RoadLink | None, kept: dict[RoadId, RoadId]) -> RoadLink | None:
    if link is None or link.element_type != "road":
        return link
    linked_road = RoadId(link.element_id)
    return link._replace(element_id=kept.get(linked_road, linked_road))
