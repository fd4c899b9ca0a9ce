"""``<junction>`` and ``<controller>`` (sections 12 and 14.6)."""

from __future__ import annotations

from typing import Final

from odscen.base.ids import JunctionId, RoadId
from odscen.base.shown import shown
from odscen.opendrive.parse_rules import MAX_LANE_ID, Notes, Rule
from odscen.opendrive.parse_xml import (
    Element,
    children,
    choice,
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

READ: Final = frozenset({"connection", "priority", "controller", "userData"})
IGNORED: Final = frozenset(
    {"surface", "planView", "boundary", "elevationGrid", "crossPath", "roadSection"} | {"objects"}
)
_TYPES: Final = {None: "default", "": "default"} | {
    name: name for name in ("default", "direct", "virtual", "crossing")
}
_CONTACT_POINTS: Final[dict[str | None, ContactPoint]] = {"start": "start", "end": "end"}


def parse_junction(element: Element, notes: Notes) -> Junction:
    """One junction; references to roads are checked later."""
    groups = children(element)
    for tag, count in unread(groups, READ).items():
        for _ in range(count):
            notes.skip(Rule.IGNORED if tag in IGNORED else Rule.UNKNOWN, "junction", tag)
    kind = choice(element, "type", _TYPES)
    connections = (_connection(found, kind, notes) for found in groups.get("connection", ()))
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
        controllers=tuple(required(found, "id") for found in groups.get("controller", ())),
        main_road=RoadId(main_road) if main_road else None,
    )


def _connection(element: Element, kind: str, notes: Notes) -> Connection | None:
    if kind in {"virtual", "crossing"} and element.get("incomingRoad") is None:
        # Virtual connections (<predecessor>, <successor>) name roads beside the main road.
        notes.skip(Rule.IGNORED, f"{kind} junction", "connection")
        return None
    if element.get("linkedRoad") and element.get("connectingRoad"):
        raise refusal(element, "has both connectingRoad and linkedRoad")
    target = "linkedRoad" if element.get("linkedRoad") else "connectingRoad"
    links = [child for child in element if child.tag == "laneLink"]
    return Connection(
        id=element.get("id", ""),
        incoming_road=RoadId(required(element, "incomingRoad")),
        connecting_road=RoadId(required(element, target)),
        contact_point=choice(element, "contactPoint", _CONTACT_POINTS),
        lane_links=tuple(
            (integer(link, "from", limit=MAX_LANE_ID), integer(link, "to", limit=MAX_LANE_ID))
            for link in links
        ),
    )


def parse_controller(element: Element, notes: Notes) -> Controller:
    """One controller with the signals it controls."""
    controls = [child for child in element if child.tag == "control"]
    return Controller(
        id=required(element, "id"),
        name=element.get("name", ""),
        sequence=_sequence(element, notes),
        controls=tuple(
            (required(control, "signalId"), control.get("type", "")) for control in controls
        ),
    )


def _sequence(element: Element, notes: Notes) -> int | None:
    text = element.get("sequence", "").strip()
    if not text:
        return None
    if not text.isdecimal():
        notes.add(Rule.UNKNOWN_VALUE, element, f"sequence={shown(text)} is no number of steps")
        return None
    return int(text[:9])
