"""Which lane follows which, in driving direction (sections 8.2, 11.6, 12.4).

A lane ends, in driving direction, at the end or the start of its section. What follows is said by
the lane's own ``successor`` or ``predecessor`` within a road and across a plain road link, and by
the lane links of the connections at a junction. Only relations that exist in the file and agree
with the driving direction of both lanes are given.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np

from odscen.base.ids import LaneKey, RoadId
from odscen.opendrive.lanes import is_forward
from odscen.opendrive.road_model import CLOSED_TYPES, DRIVABLE_TYPES, lane_use

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import (
        Connection,
        ContactPoint,
        Junction,
        Lane,
        OpenDrive,
        Road,
        RoadLink,
    )

End = Literal["start", "end"]


def lane_successors(odr: OpenDrive) -> dict[LaneKey, tuple[LaneKey, ...]]:
    """Following lanes of every lane with id other than 0, of every type, in driving direction.

    Returns
    -------
    dict[LaneKey, tuple[LaneKey, ...]]
        One entry per lane, in the order of the file (road, section, lane id ascending); the
        followers sorted by road in file order, section and lane id, each once.
    """
    order = {road_id: index for index, road_id in enumerate(odr.roads)}
    found: dict[LaneKey, set[LaneKey]] = {
        LaneKey(road.id, number, lane.id): set()
        for road in odr.roads.values()
        for number, section in enumerate(road.sections)
        for lane in reversed(section.lanes.values())
        if lane.id
    }
    for road in odr.roads.values():
        for here, there in _within_and_beyond(road, odr):
            found[here].add(there)
    for here, there in one_sided_links(odr):
        found[here].add(there)
    for junction in odr.junctions.values():
        for connection in junction.connections:
            for here, there in _relate_connection(junction, connection, odr):
                found[here].add(there)
    return {
        key: tuple(sorted(keys, key=lambda k: (order[k.road], k.section, k.lane)))
        for key, keys in found.items()
    }


def _within_and_beyond(road: Road, odr: OpenDrive) -> Iterator[tuple[LaneKey, LaneKey]]:
    """Relations that the links of the road's own lanes state."""
    for number, section in enumerate(road.sections):
        for lane in section.lanes.values():
            if not lane.id:
                continue
            forward = is_forward(road, lane)
            ids = lane.successors if forward else lane.predecessors
            if not ids:
                continue
            place = _following_place(road, number, odr, forward=forward)
            if place is None:
                continue
            target, target_section, contact = place
            here = LaneKey(road.id, number, lane.id)
            for lane_id in ids:
                if _lane_enters(target, target_section, lane_id, contact):
                    yield here, LaneKey(target.id, target_section, lane_id)


def one_sided_links(odr: OpenDrive) -> Iterator[tuple[LaneKey, LaneKey]]:
    """Relations, outside junctions' tables, that only the lane behind states.

    The lane before it names no lane there at all: one that names others is taken at its word.
    """
    for road in odr.roads.values():
        for number, section in enumerate(road.sections):
            for lane in section.lanes.values():
                if not lane.id:
                    continue
                forward = is_forward(road, lane)
                ids = lane.predecessors if forward else lane.successors
                place = _following_place(road, number, odr, forward=not forward) if ids else None
                if place is None:
                    continue
                source, source_section, contact = place
                for lane_id in ids:
                    before = _lane_of_section(source, source_section, lane_id)
                    if before is None or is_forward(source, before) == (contact == "start"):
                        continue
                    own = before.successors if contact == "end" else before.predecessors
                    back = _following_place(source, source_section, odr, forward=contact == "end")
                    if not own and back is not None and back[0] is road and back[1] == number:
                        here = LaneKey(source.id, source_section, lane_id)
                        yield here, LaneKey(road.id, number, lane.id)


def _following_place(
    road: Road, number: int, odr: OpenDrive, *, forward: bool
) -> tuple[Road, int, End] | None:
    """Road, section and end of it that follow a section, without junctions."""
    if forward and number < len(road.sections) - 1:
        return road, number + 1, "start"
    if not forward and number > 0:
        return road, number - 1, "end"
    return _linked_road(road.successor if forward else road.predecessor, odr)


def _linked_road(link: RoadLink | None, odr: OpenDrive) -> tuple[Road, int, End] | None:
    """Road, section and end of it that a plain road link leads to."""
    if link is None or link.element_type != "road" or link.contact_point is None:
        return None
    road = odr.roads.get(RoadId(link.element_id))
    if road is None:
        return None
    return road, end_section(road, link.contact_point), link.contact_point


def end_section(road: Road, contact: ContactPoint) -> int:
    """Index of the section at the start or the end of a road."""
    return 0 if contact == "start" else len(road.sections) - 1


def _lane_of_section(road: Road, section: int, lane_id: int) -> Lane | None:
    return road.sections[section].lanes.get(lane_id) if lane_id else None


def _lane_enters(road: Road, section: int, lane_id: int, contact: End) -> bool:
    """Whether the lane exists and is driven away from that end of its section."""
    lane = _lane_of_section(road, section, lane_id)
    return lane is not None and is_forward(road, lane) == (contact == "start")


def _relate_connection(
    junction: Junction, connection: Connection, odr: OpenDrive
) -> Iterator[tuple[LaneKey, LaneKey]]:
    """Relations between an incoming road and the connecting or linked road."""
    incoming = odr.roads.get(connection.incoming_road)
    connecting = odr.roads.get(connection.connecting_road)
    if incoming is None or connecting is None:
        return
    contact = connection.contact_point
    section = end_section(connecting, contact)
    for end in _incoming_ends(junction, incoming, connecting, contact):
        incoming_section = end_section(incoming, end)
        for from_id, to_id in connection.lane_links:
            from_lane = _lane_of_section(incoming, incoming_section, from_id)
            to_lane = _lane_of_section(connecting, section, to_id)
            if from_lane is None or to_lane is None:
                continue
            # "entering" seen from the junction: driven away from the point where the roads meet
            from_enters = is_forward(incoming, from_lane) == (end == "start")
            to_enters = is_forward(connecting, to_lane) == (contact == "start")
            here = LaneKey(incoming.id, incoming_section, from_id)
            there = LaneKey(connecting.id, section, to_id)
            if to_enters and not from_enters:
                yield here, there
            elif from_enters and not to_enters:
                yield there, here


def _incoming_ends(
    junction: Junction, incoming: Road, connecting: Road, contact: ContactPoint
) -> tuple[End, ...]:
    """Ends of the incoming road at which it meets the connecting road.

    The connecting road's own link says so; in a direct junction, where that link names the
    junction, the ends of the incoming road that lead to the junction do.
    """
    link = connecting.predecessor if contact == "start" else connecting.successor
    if link is not None and link.element_type == "road" and link.element_id == incoming.id:
        return (link.contact_point,) if link.contact_point else ()
    ends: tuple[tuple[End, RoadLink | None], ...] = (
        ("start", incoming.predecessor),
        ("end", incoming.successor),
    )
    return tuple(
        end
        for end, own in ends
        if own is not None and own.element_type == "junction" and own.element_id == junction.id
    )


class DeadEnd(NamedTuple):
    """A drivable lane at an end of a connecting road without a lane behind it, or before it.

    ``leads`` says which: whether traffic would drive on from there, or come from there.
    """

    lane: LaneKey
    end: End
    leads: bool


def dead_ends(odr: OpenDrive) -> tuple[DeadEnd, ...]:
    """Connecting lanes that lead nowhere, or that nothing leads to, in the order of the file.

    Lanes that begin or end in the section, and those of virtual junctions, which begin beside a
    lane (:func:`side_links`), are none.
    """
    successors = lane_successors(odr)
    reached = {there for following in successors.values() for there in following}
    beside = {(side.other, side.leaves) for side in side_links(odr)}
    dead_ends: list[DeadEnd] = []
    for key, following in successors.items():
        road = odr.roads[key.road]
        lane = road.sections[key.section].lanes[key.lane]
        if road.junction is None or lane.type not in DRIVABLE_TYPES:
            continue
        forward = is_forward(road, lane)
        ends: tuple[End, End] = ("start", "end") if forward else ("end", "start")
        for end, leads, joined in ((ends[0], False, key in reached), (ends[1], True, following)):
            at_end = key.section == end_section(road, end)
            if at_end and not joined and (key, not leads) not in beside:
                dead_ends.append(DeadEnd(key, end, leads))
    return tuple(dead_ends)


def cut_off_lanes(odr: OpenDrive) -> frozenset[LaneKey]:
    """Connecting lanes for driving that only lanes closed to motor vehicles lead to, or follow.

    Converters write them where a footpath or cycle path meets a road: no car can come over them.
    """
    successors = lane_successors(odr)
    before: dict[LaneKey, list[LaneKey]] = {key: [] for key in successors}
    for here, following in successors.items():
        for there in following:
            before[there].append(here)

    def all_closed(neighbours: Collection[LaneKey]) -> bool:
        lanes = [odr.roads[key.road].sections[key.section].lanes[key.lane] for key in neighbours]
        return bool(lanes) and all(lane_use(lane) in CLOSED_TYPES for lane in lanes)

    return frozenset(
        key
        for key, following in successors.items()
        if odr.roads[key.road].junction is not None
        and lane_use(odr.roads[key.road].sections[key.section].lanes[key.lane]) in DRIVABLE_TYPES
        and (all_closed(before[key]) or all_closed(following))
    )


LONGEST_FOLD: Final = 12.0
"""Metres of a connecting lane that only leads back, at most."""

_REVERSED: Final = -0.9
"""Cosine between two directions, at most, if one is the reverse of the other."""


def folded_lanes(odr: OpenDrive, table: RoadTable) -> frozenset[LaneKey]:
    """Short connecting lanes that lead back, against all lanes before and behind them.

    Converters write them where the edges that they had overlap: who would follow such a lane drives
    past the start of the next road, and in reverse to it.
    """
    successors = lane_successors(odr)
    before: dict[LaneKey, list[LaneKey]] = {key: [] for key in successors}
    for here, following in successors.items():
        for there in following:
            before[there].append(here)
    chosen = [
        key
        for key, following in successors.items()
        if odr.roads[key.road].junction is not None
        and odr.roads[key.road].length <= LONGEST_FOLD
        and following
        and before[key]
        and lane_use(odr.roads[key.road].sections[key.section].lanes[key.lane]) in DRIVABLE_TYPES
    ]
    near = {*chosen, *(k for key in chosen for k in (*before[key], *successors[key]))}
    rows = np.array([table.lane_index[key] for key in near], dtype=np.int64)
    if not len(rows):
        return frozenset()
    forward = table.lane_forward[rows]
    first = np.where(forward, table.lane_s0[rows], table.lane_s1[rows])
    last = np.where(forward, table.lane_s1[rows], table.lane_s0[rows])
    turned = np.where(forward, 0.0, np.pi)
    starts = dict(zip(near, table.lane_points(rows, first).hdg + turned, strict=True))
    ends = dict(zip(near, table.lane_points(rows, last).hdg + turned, strict=True))
    return frozenset(
        key
        for key in chosen
        if all(math.cos(starts[key] - ends[other]) < _REVERSED for other in before[key])
        and all(math.cos(starts[other] - ends[key]) < _REVERSED for other in successors[key])
    )


class SideLink(NamedTuple):
    """A lane that begins or ends beside another lane, not at an end of it (section 12.6).

    Attributes
    ----------
    main, s
        The lane that continues, and where; metres.
    other
        Lane of a connecting road of a virtual junction.
    leaves
        Whether traffic of ``main`` can turn into ``other`` there, or else comes from it.
    """

    main: LaneKey
    s: float
    other: LaneKey
    leaves: bool


def side_links(odr: OpenDrive) -> tuple[SideLink, ...]:
    """Links of connecting roads to places within a road, as virtual junctions have them."""
    links: dict[SideLink, None] = {}
    for road in odr.roads.values():
        ends: tuple[tuple[End, RoadLink | None], ...] = (
            ("start", road.predecessor),
            ("end", road.successor),
        )
        for end, link in ends:
            if road.junction is None or link is None or link.element_s is None:
                continue
            main = odr.roads.get(RoadId(link.element_id))
            if main is not None and main is not road and link.contact_point is None:
                links.update(dict.fromkeys(_lanes_beside_end(odr, road, end, main, link.element_s)))
    return tuple(links)


def _lanes_beside_end(
    odr: OpenDrive, road: Road, end: End, main: Road, s: float
) -> Iterator[SideLink]:
    number = next((n for n in reversed(range(len(main.sections))) if main.sections[n].s <= s), None)
    if number is None or s > main.length:
        return
    junction = odr.junctions.get(road.junction) if road.junction is not None else None
    stated = {
        (to_id, from_id)
        for connection in (junction.connections if junction else ())
        if (connection.incoming_road, connection.connecting_road) == (main.id, road.id)
        and connection.contact_point == end
        for from_id, to_id in connection.lane_links
    }
    section = end_section(road, end)
    for lane in road.sections[section].lanes.values():
        own = lane.predecessors if end == "start" else lane.successors
        for main_id in sorted({*own, *(m for own_id, m in stated if own_id == lane.id)}):
            if lane.id and _lane_of_section(main, number, main_id) is not None:
                leaves = is_forward(road, lane) == (end == "start")
                here = LaneKey(main.id, number, main_id)
                yield SideLink(here, s, LaneKey(road.id, section, lane.id), leaves)
