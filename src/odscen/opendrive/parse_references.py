"""References between elements: what leads nowhere is left out and noted."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from odscen.base.ids import JunctionId, RoadId
from odscen.base.shown import shown_id
from odscen.opendrive.parse_rules import S_TOLERANCE, Notes, Rule
from odscen.opendrive.road_model import (
    DRIVABLE_TYPES,
    Connection,
    ContactPoint,
    Controller,
    Junction,
    LaneSection,
    Road,
    RoadLink,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

Roads = dict[RoadId, Road]
Junctions = dict[JunctionId, Junction]


def check_references(
    roads: Roads, junctions: Junctions, controllers: dict[str, Controller], notes: Notes
) -> tuple[Roads, Junctions, dict[str, Controller]]:
    """Leave out references that lead nowhere, and note each.

    Links of single lanes stay in the model as they are written; those that lead nowhere are noted
    and :func:`~odscen.opendrive.topology.lane_successors` does not follow them.
    """
    signals = _signal_ids(roads, notes)
    roads = {key: _with_contacts(road, roads, notes) for key, road in roads.items()}
    roads = {
        key: _check_road(road, roads, junctions, signals, notes) for key, road in roads.items()
    }
    roads = _join_silent_lanes(_link_back(roads, notes), notes)
    for road in roads.values():
        _note_lane_links(road, roads, notes)
        _note_places(road, notes)
    junctions = {
        key: _check_junction(junction, roads, controllers, notes)
        for key, junction in junctions.items()
    }
    controllers = {
        key: _check_controller(controller, signals, notes)
        for key, controller in controllers.items()
    }
    return roads, junctions, controllers


def _signal_ids(roads: Roads, notes: Notes) -> set[str]:
    """Ids of all signals; ids used twice are noted."""
    seen: set[str] = set()
    for road in roads.values():
        for signal in road.signals:
            if signal.id in seen:
                place = f"road {shown_id(road.id)} > signal {shown_id(signal.id)}"
                notes.add(Rule.DUPLICATE_ID, place, "another signal has the same id")
            seen.add(signal.id)
        objects: set[str] = set()
        for obj in road.objects:
            if obj.id in objects:
                place = f"road {shown_id(road.id)} > object {shown_id(obj.id)}"
                notes.add(Rule.DUPLICATE_ID, place, "another object of the road has the same id")
            objects.add(obj.id)
    return seen


def _with_contacts(road: Road, roads: Roads, notes: Notes) -> Road:
    """The road with the contact points that its links leave out and the other roads show."""
    changes: dict[str, RoadLink | None] = {}
    for name, end in (("predecessor", "start"), ("successor", "end")):
        link: RoadLink | None = getattr(road, name)
        if link is None or link.element_type != "road":
            continue
        if link.contact_point is not None or link.element_s is not None:
            continue
        contact = _end_that_links_back(roads.get(RoadId(link.element_id)), road, end)
        changes[name] = None if contact is None else link._replace(contact_point=contact)
        detail = "contactPoint is missing; the link is left out"
        if contact is not None:
            detail = f"contactPoint is missing; the {contact} of that road links back here"
        notes.add(Rule.MISSING_CONTACT, f"road {shown_id(road.id)} > {name}", detail)
    return replace(road, **changes) if changes else road  # type: ignore[arg-type]


def _end_that_links_back(other: Road | None, road: Road, end: str) -> ContactPoint | None:
    """The end of a road that leads to an end of another or to its junction, if one does."""
    if other is None:
        return None
    ends: list[ContactPoint] = []
    sides: tuple[tuple[ContactPoint, RoadLink | None], ...] = (
        ("start", other.predecessor),
        ("end", other.successor),
    )
    for side, link in sides:
        if link is None or (other is road and side == end):
            continue
        to_road = link.element_type == "road" and link.element_id == road.id
        if (to_road and link.contact_point in (None, end)) or (
            link.element_type == "junction" and link.element_id == road.junction
        ):
            ends.append(side)
    return ends[0] if len(ends) == 1 else None


def _check_road(
    road: Road, roads: Roads, junctions: Junctions, signals: set[str], notes: Notes
) -> Road:
    """Return the road itself, or a copy without what leads nowhere."""
    place = f"road {shown_id(road.id)}"
    changes: dict[str, object] = {}
    if road.junction is not None and road.junction not in junctions:
        detail = f"there is no junction {road.junction!r}; the road is in no junction"
        notes.add(Rule.DANGLING_LINK, place, detail)
        changes["junction"] = None
    for name in ("predecessor", "successor"):
        link: RoadLink | None = getattr(road, name)
        if link is None:
            continue
        known = roads if link.element_type == "road" else junctions
        if link.element_id not in known:
            detail = f"there is no {link.element_type} {link.element_id!r}; the link is left out"
            notes.add(Rule.DANGLING_LINK, f"{place} > {name}", detail)
            changes[name] = None
    kept = tuple(item for item in road.signal_references if item.id in signals)
    if len(kept) != len(road.signal_references):
        changes["signal_references"] = kept
        for item in road.signal_references:
            if item.id not in signals:
                detail = f"there is no signal {item.id!r}; the reference is left out"
                notes.add(Rule.DANGLING_LINK, f"{place} > signalReference", detail)
    return replace(road, **changes) if changes else road  # type: ignore[arg-type]


def _link_back(roads: Roads, notes: Notes) -> Roads:
    """The roads, each end without a link with that to the only road end that links to it."""
    linking: dict[tuple[str, str], list[tuple[RoadId, ContactPoint]]] = {}
    for road in roads.values():
        ends: tuple[tuple[ContactPoint, RoadLink | None], ...] = (
            ("start", road.predecessor),
            ("end", road.successor),
        )
        for end, link in ends:
            if link is not None and link.element_type == "road" and link.contact_point:
                linking.setdefault((link.element_id, link.contact_point), []).append((road.id, end))
    changed = dict(roads)
    for (name, at), others in linking.items():
        road = changed[RoadId(name)]
        field = "predecessor" if at == "start" else "successor"
        if getattr(road, field) is not None or len(others) > 1 or others[0][0] == road.id:
            continue
        other, contact = others[0]
        link = RoadLink("road", other, contact)
        changed[road.id] = replace(road, **{field: link})  # type: ignore[arg-type]
        detail = f"no link, but the {contact} of road {shown_id(other)} links here: linked back"
        notes.add(Rule.ONE_SIDED_LINK, f"road {shown_id(road.id)} > {field}", detail)
    return changed


def _join_silent_lanes(roads: Roads, notes: Notes) -> Roads:
    """Link lanes by their ids where sections follow each other and no lane of a side says how."""
    links: dict[tuple[RoadId, int, int, str], int] = {}
    for road in roads.values():
        for number, section in enumerate(road.sections):
            for field, step, link in (
                ("successors", 1, road.successor),
                ("predecessors", -1, road.predecessor),
            ):
                target = _next_section(road, number, link, roads, step)
                if target is None or section.s_end <= section.s or target.s_end <= target.s:
                    continue
                inside = 0 <= number + step < len(road.sections)
                if not inside and link is not None:
                    beyond = roads[RoadId(link.element_id)]
                    if road.junction is not None or beyond.junction is not None:
                        continue  # there the junction's table says it, or else geometry
                at_start = step > 0
                if not inside and link is not None:
                    at_start = link.contact_point == "start"
                back = "predecessors" if at_start else "successors"
                flip = 1 if back != field else -1
                for side in (1, -1):
                    ids = _silent_lanes(section, side, field)
                    there = [flip * n for n in _silent_lanes(target, flip * side, back)]
                    if not ids or not there:
                        continue
                    rule, what = Rule.CONNECTION_LEFT_OUT, "whose ids are others: they end here"
                    if ids == there:
                        links |= {(road.id, number, n, field): flip * n for n in ids}
                        rule, what = Rule.SILENT_LANES, "and are linked by their ids"
                    if step > 0 or not inside:
                        where = f"road {shown_id(road.id)} > laneSection {number}"
                        name = "left" if side > 0 else "right"
                        detail = f"lanes on the {name} name no {field}, nor do those there, {what}"
                        notes.add(rule, where, detail)
    changed = dict(roads)
    for (road_id, number, lane_id, field), to in links.items():
        road = changed[road_id]
        sections = list(road.sections)
        lanes = dict(sections[number].lanes)
        lanes[lane_id] = replace(lanes[lane_id], **{field: (to,)})  # type: ignore[arg-type]
        sections[number] = replace(sections[number], lanes=lanes)
        changed[road_id] = replace(road, sections=tuple(sections))
    return changed


def _silent_lanes(section: LaneSection, side: int, field: str) -> list[int]:
    """Lanes for driving on a side of a section, if none of that side names others there."""
    lanes = [lane for lane in section.lanes.values() if lane.id * side > 0]
    if any(getattr(lane, field) for lane in lanes):
        return []
    return sorted((n.id for n in lanes if n.type in DRIVABLE_TYPES), key=abs)


def _next_section(
    road: Road, number: int, link: RoadLink | None, roads: Roads, step: int
) -> LaneSection | None:
    """Section that lanes of section ``number`` lead to, forwards (step 1) or backwards (-1)."""
    if 0 <= number + step < len(road.sections):
        return road.sections[number + step]
    if link is None or link.element_type != "road" or link.contact_point is None:
        return None
    target = roads[RoadId(link.element_id)]
    return target.sections[0 if link.contact_point == "start" else -1]


def _note_lane_links(road: Road, roads: Roads, notes: Notes) -> None:
    for number, section in enumerate(road.sections):
        ahead = _next_section(road, number, road.successor, roads, 1)
        behind = _next_section(road, number, road.predecessor, roads, -1)
        for lane in section.lanes.values():
            for name, ids, target in (
                ("successor", lane.successors, ahead),
                ("predecessor", lane.predecessors, behind),
            ):
                for lane_id in ids:
                    if target is not None and lane_id not in target.lanes:
                        where = f"road {shown_id(road.id)} > laneSection {number} > lane {lane.id}"
                        place = f"{where} > {name}"
                        detail = f"there is no lane {lane_id} there; the link is not followed"
                        notes.add(Rule.DANGLING_LINK, place, detail)


def _note_places(road: Road, notes: Notes) -> None:
    placed: Iterable[tuple[str, str, float]] = (
        *(("object", item.id, item.s) for item in road.objects),
        *(("signal", item.id, item.s) for item in road.signals),
        *(("signalReference", item.id, item.s) for item in road.signal_references),
    )
    for tag, item_id, s in placed:
        if not -S_TOLERANCE <= s <= road.length + S_TOLERANCE:
            place = f"road {shown_id(road.id)} > {tag} {shown_id(item_id)}"
            detail = f"s={s:.6g} is outside the road of {road.length:.6g} m"
            notes.add(Rule.OUTSIDE_ROAD, place, detail)


def _check_junction(
    junction: Junction, roads: Roads, controllers: dict[str, Controller], notes: Notes
) -> Junction:
    """Return the junction itself, or a copy without what leads nowhere."""
    place = f"junction {shown_id(junction.id)}"
    connections = tuple(_check_connections(junction, roads, notes))
    kept_controllers = tuple(key for key in junction.controllers if key in controllers)
    for key in junction.controllers:
        if key not in controllers:
            detail = f"there is no controller {key!r}; the reference is left out"
            notes.add(Rule.DANGLING_LINK, place, detail)
    priorities = tuple(p for p in junction.priorities if p.high in roads and p.low in roads)
    if len(priorities) != len(junction.priorities):
        lost = len(junction.priorities) - len(priorities)
        detail = f"{lost} priorities name roads that do not exist; they are left out"
        notes.add(Rule.DANGLING_LINK, place, detail)
    return replace(
        junction, connections=connections, controllers=kept_controllers, priorities=priorities
    )


def _check_connections(junction: Junction, roads: Roads, notes: Notes) -> Iterator[Connection]:
    for connection in junction.connections:
        place = f"junction {shown_id(junction.id)} > connection {shown_id(connection.id)}"
        ends = (connection.incoming_road, connection.connecting_road)
        missing = [road_id for road_id in ends if road_id not in roads]
        if missing:
            detail = f"there is no road {missing[0]!r}; the connection is left out"
            notes.add(Rule.DANGLING_LINK, place, detail)
            continue
        if junction.type == "direct" and not connection.lane_links:
            notes.add(Rule.CONNECTION_LEFT_OUT, place, "it links no lanes; it is left out")
            continue
        incoming, connecting = (roads[road_id] for road_id in ends)
        contact = 0 if connection.contact_point == "start" else -1
        there = connecting.sections[contact].lanes
        here = incoming.sections[0].lanes.keys() | incoming.sections[-1].lanes.keys()
        links = tuple(
            link for link in connection.lane_links if link[0] in here and link[1] in there
        )
        for from_id, to_id in connection.lane_links:
            if from_id not in here or to_id not in there:
                lane, road = (to_id, connecting) if from_id in here else (from_id, incoming)
                detail = (
                    f"there is no lane {lane} on road {shown_id(road.id)}; the link is left out"
                )
                notes.add(Rule.DANGLING_LINK, f"{place} > laneLink {from_id} {to_id}", detail)
        yield connection._replace(lane_links=links)


def _check_controller(controller: Controller, signals: set[str], notes: Notes) -> Controller:
    kept = tuple(control for control in controller.controls if control[0] in signals)
    if len(kept) == len(controller.controls):
        return controller
    for signal_id, _ in controller.controls:
        if signal_id not in signals:
            detail = f"there is no signal {signal_id!r}; the control is left out"
            notes.add(Rule.DANGLING_LINK, f"controller {shown_id(controller.id)}", detail)
    return replace(controller, controls=kept)
