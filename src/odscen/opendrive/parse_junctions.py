"""``<junction>`` and ``<controller>`` (sections 12 and 14.6)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from odscen.base.errors import OpenDriveError
from odscen.base.ids import JunctionId, RoadId
from odscen.base.shown import shown, shown_id
from odscen.opendrive.parse_rules import MAX_LANE_ID, Notes, Rule
from odscen.opendrive.parse_values import spelt_choice
from odscen.opendrive.parse_xml import (
    Element,
    children,
    integer,
    refusal,
    required,
    unread,
)
from odscen.opendrive.road_model import (
    Connection,
    ContactPoint,
    Controller,
    Junction,
    JunctionPriority,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from odscen.opendrive.road_model import Road

READ: Final = frozenset({"connection", "priority", "controller", "userData"})
IGNORED: Final = frozenset(
    {"surface", "planView", "boundary", "elevationGrid", "crossPath", "roadSection"} | {"objects"}
)
_TYPES: Final = {None: "default", "": "default"} | {
    name: name for name in ("default", "direct", "virtual", "crossing")
}
_CONTACT_POINTS: Final[dict[str | None, ContactPoint]] = {"start": "start", "end": "end"}


def parse_junction(element: Element, roads: Mapping[RoadId, Road], notes: Notes) -> Junction:
    """One junction; references to roads are checked later."""
    groups = children(element)
    for tag, count in unread(groups, READ).items():
        for _ in range(count):
            notes.skip(Rule.IGNORED if tag in IGNORED else Rule.UNKNOWN, "junction", tag)
    kind = spelt_choice(element, "type", _TYPES, notes, otherwise="default")
    connections = (
        _read_connection(found, kind, roads, notes) for found in groups.get("connection", ())
    )
    main_road = element.get("mainRoad")
    return Junction(
        id=JunctionId(required(element, "id")),
        name=element.get("name", ""),
        type=kind,
        connections=tuple(found for found in connections if found is not None),
        priorities=tuple(
            JunctionPriority(RoadId(found.get("high", "")), RoadId(found.get("low", "")))
            for found in groups.get("priority", ())
        ),
        controllers=tuple(_controller_ids(groups.get("controller", ()), notes)),
        main_road=RoadId(main_road) if main_road else None,
    )


def _controller_ids(elements: Iterable[Element], notes: Notes) -> Iterator[str]:
    for element in elements:
        name = element.get("id", "")
        if name.strip():
            yield name
        else:
            notes.add(Rule.DANGLING_LINK, element, "it names no controller; it is left out")


def _read_connection(
    element: Element, kind: str, roads: Mapping[RoadId, Road], notes: Notes
) -> Connection | None:
    """A connection, or ``None`` for one that is not read or names no road."""
    try:
        return _parse_connection(element, kind, roads, notes)
    except OpenDriveError as error:
        detail = f"{error.problem}; the connection is left out"
        notes.add(Rule.CONNECTION_LEFT_OUT, error.element or element, detail)
        return None


def _parse_connection(
    element: Element, kind: str, roads: Mapping[RoadId, Road], notes: Notes
) -> Connection | None:
    if kind in {"virtual", "crossing"} and element.get("incomingRoad") is None:
        # Virtual connections (<predecessor>, <successor>) name roads beside the main road.
        notes.skip(Rule.IGNORED, f"{kind} junction", "connection")
        return None
    if element.get("linkedRoad") and element.get("connectingRoad"):
        raise refusal(element, "has both connectingRoad and linkedRoad")
    target = "linkedRoad" if element.get("linkedRoad") else "connectingRoad"
    links = [child for child in element if child.tag == "laneLink"]
    incoming, connecting = (RoadId(required(element, name)) for name in ("incomingRoad", target))
    linked = _linked_end(roads.get(connecting), incoming, element)
    if element.get("contactPoint", "").strip() or linked is None:
        contact = spelt_choice(element, "contactPoint", _CONTACT_POINTS, notes)
    else:
        contact = linked
        detail = f"contactPoint is missing; the {contact} of road {shown_id(connecting)} is linked"
        notes.add(Rule.MISSING_CONTACT, element, detail)
    return Connection(
        id=element.get("id", ""),
        incoming_road=incoming,
        connecting_road=connecting,
        contact_point=contact,
        lane_links=tuple(_lane_links(links, notes)),
    )


def _linked_end(road: Road | None, incoming: RoadId, element: Element) -> ContactPoint | None:
    """The end of a connecting road that links to its incoming road, if exactly one does.

    Of the linked road of a direct junction it is the end that links to the junction.
    """
    if road is None:
        return None
    junction = element.getparent()
    own = None if junction is None else junction.get("id")
    ends: list[ContactPoint] = []
    for end, link in (("start", road.predecessor), ("end", road.successor)):
        if link is not None and (link.element_type, link.element_id) in (
            ("road", incoming),
            ("junction", own),
        ):
            ends.append("start" if end == "start" else "end")
    return ends[0] if len(ends) == 1 else None


def _lane_links(elements: Iterable[Element], notes: Notes) -> Iterator[tuple[int, int]]:
    for element in elements:
        try:
            yield tuple(integer(element, name, limit=MAX_LANE_ID) for name in ("from", "to"))  # type: ignore[misc]
        except OpenDriveError as error:
            detail = f"{error.problem}; the link is left out"
            notes.add(Rule.CONNECTION_LEFT_OUT, error.element or element, detail)


def parse_controller(element: Element, notes: Notes) -> Controller:
    """One controller with the signals it controls."""
    controls = [child for child in element if child.tag == "control" and child.get("signalId")]
    return Controller(
        id=required(element, "id"),
        name=element.get("name", ""),
        sequence=_parse_sequence(element, notes),
        controls=tuple(
            (str(control.get("signalId")), control.get("type", "")) for control in controls
        ),
    )


def _parse_sequence(element: Element, notes: Notes) -> int | None:
    text = element.get("sequence", "").strip()
    if not text:
        return None
    if not text.isdecimal():
        notes.add(Rule.UNKNOWN_VALUE, element, f"sequence={shown(text)} is no number of steps")
        return None
    return int(text[:9])
