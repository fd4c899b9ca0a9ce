"""Rewrites of OpenDRIVE text for netconvert 1.28, which fails on some valid input.

The map itself stays as it is: the road model is read from the original. What is rewritten here
changes neither the geometry nor the lanes that netconvert makes, and each rewrite is reported.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from lxml import etree

from odscen.convert.report import Entry, Fate
from odscen.convert.rewrites import flat_access, no_includes, plain_ids, widths_from_borders
from odscen.errors import OpenDriveError
from odscen.opendrive.model import DRIVABLE_TYPES

if TYPE_CHECKING:
    from collections.abc import Iterator

_STRAIGHT = 1e-9
"""1/m: netconvert divides by the curvature of arcs; below this one they are lines."""

_SAME_S = 1e-6
_JOINT = 0.01
"""Length in metres of the connecting roads that stand for the links of direct junctions."""


def prepare_for_netconvert(xodr: bytes) -> tuple[bytes, tuple[Entry, ...]]:
    """Rewrite what netconvert cannot read, and say what was rewritten.

    Raises
    ------
    OpenDriveError
        If the text is not XML.
    """
    parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=True)
    try:
        root = etree.fromstring(xodr, parser)
    except etree.XMLSyntaxError as error:
        msg = f"not XML: {error}"
        raise OpenDriveError(msg) from error
    notes = [
        *plain_ids(root),
        *flat_access(root),
        *no_includes(root),
        *widths_from_borders(root),
        *_speeds(root),
        *_signals(root),
        *_straight_curves(root),
        *_direct_junctions(root),
    ]
    if not notes:
        return xodr, ()
    return etree.tostring(root, encoding="utf-8", xml_declaration=True), tuple(notes)


def _all(parent: etree._Element, name: str) -> list[etree._Element]:
    """Descendants by local name; OpenDRIVE files come with and without a namespace."""
    return list(parent.iter(f"{{*}}{name}"))


def _children(parent: etree._Element, name: str) -> list[etree._Element]:
    return list(parent.iterchildren(f"{{*}}{name}"))


def _child(parent: etree._Element, name: str) -> etree._Element | None:
    return next(parent.iterchildren(f"{{*}}{name}"), None)


def _road_of(element: etree._Element) -> str:
    road = next(element.iterancestors("{*}road"), None)
    return "road ?" if road is None else f"road {road.get('id', '?')}"


def _signals(root: etree._Element) -> Iterator[Entry]:
    """Give signals without a type one; netconvert refuses them."""
    for signal in _all(root, "signal"):
        for name in ("type", "subtype"):
            if not signal.get(name):
                signal.set(name, "-1")
                if name == "type":
                    element = f"{_road_of(signal)} > signal {signal.get('id', '?')}"
                    yield Entry(Fate.REPAIRED, element, "empty type given to netconvert as -1")


def _straight_curves(root: etree._Element) -> Iterator[Entry]:
    """Make lines of arcs of curvature zero; netconvert divides by it."""
    for arc in _all(root, "arc"):
        if abs(_number(arc, "curvature")) < _STRAIGHT:
            geometry = arc.getparent()
            place = "?" if geometry is None else geometry.get("s", "?")
            yield Entry(
                Fate.REPAIRED,
                f"{_road_of(arc)} > planView > geometry s={place}",
                "arc of curvature 0 given to netconvert as a line",
            )
            arc.tag = etree.QName(etree.QName(arc).namespace, "line").text
            arc.attrib.clear()


def _number(element: etree._Element, name: str) -> float:
    try:
        return float(element.get(name, ""))
    except ValueError:
        return math.nan


def _speeds(root: etree._Element) -> Iterator[Entry]:
    """Write the limits of road types into drivable lanes: netconvert reads only those of lanes."""
    count = 0
    for road in _all(root, "road"):
        types = [(_number(kind, "s"), _child(kind, "speed")) for kind in _children(road, "type")]
        limits = [(s, speed) for s, speed in types if speed is not None and _is_limit(speed)]
        if not limits:
            continue
        count += 1
        sections = _all(road, "laneSection")
        starts = [_number(section, "s") for section in sections]
        for section, start in zip(sections, starts, strict=True):
            here = [speed for s, speed in limits if s <= start + _SAME_S] or [limits[0][1]]
            for lane in _all(section, "lane"):
                if lane.get("type") in DRIVABLE_TYPES and _child(lane, "speed") is None:
                    _insert_speed(lane, here[-1])
        for s, _ in limits:
            if s > _SAME_S and not any(abs(s - start) <= _SAME_S for start in starts):
                element = f"road {road.get('id', '?')} > type s={s:g}"
                yield Entry(Fate.LOST, element, "SUMO changes limits only where a section begins")
    if count:
        reason = f"limits of the types of {count} roads given to netconvert as those of the lanes"
        yield Entry(Fate.REPAIRED, "map", reason)


def _is_limit(speed: etree._Element) -> bool:
    return _number(speed, "max") > 0.0


def _insert_speed(lane: etree._Element, limit: etree._Element) -> None:
    speed = etree.Element(
        etree.QName(etree.QName(lane).namespace, "speed"),
        {"sOffset": "0", "max": limit.get("max", ""), "unit": limit.get("unit", "m/s")},
    )
    lane.append(speed)


class _End(NamedTuple):
    """An end of a road: its lanes there, and whether s grows towards it."""

    road: etree._Element
    contact: str
    lanes: dict[int, etree._Element]


def _direct_junctions(root: etree._Element) -> Iterator[Entry]:
    """Give each link of a direct junction a connecting road of a centimetre."""
    roads = {road.get("id", ""): road for road in _all(root, "road")}
    for junction in _all(root, "junction"):
        if junction.get("type") != "direct":
            continue
        junction_id = junction.get("id", "")
        joined = 0
        for connection in list(junction.iterchildren("{*}connection")):
            incoming = roads.get(connection.get("incomingRoad", ""))
            linked = roads.get(connection.get("linkedRoad", ""))
            if incoming is None or linked is None:
                continue
            name = _free_id(roads, f"{junction_id}.{connection.get('id', '')}")
            road = _joint(name, junction_id, connection, incoming, linked)
            if road is None:
                continue
            roads[name] = road
            junction.addprevious(road)
            joined += 1
        junction.attrib.pop("type")
        yield Entry(
            Fate.REPAIRED,
            f"junction {junction_id}",
            f"direct junction given to netconvert with {joined} connecting roads of {_JOINT} m",
        )


def _free_id(taken: dict[str, etree._Element], wanted: str) -> str:
    while wanted in taken:
        wanted += "_"
    return wanted


def _joint(
    name: str,
    junction: str,
    connection: etree._Element,
    incoming: etree._Element,
    linked: etree._Element,
) -> etree._Element | None:
    """Make the connecting road from the incoming road's end at the junction to the linked road."""
    near = _end_at(incoming, junction)
    far = _end(linked, connection.get("contactPoint", "start"))
    if near is None or far is None:
        return None
    x, y, hdg = _pose(near)
    make = _Maker(etree.QName(incoming).namespace)
    road = make(None, "road", name="", length=str(_JOINT), id=name, junction=junction)
    links = make(road, "link")
    for tag, end in (("predecessor", near), ("successor", far)):
        target = {"elementId": end.road.get("id", ""), "contactPoint": end.contact}
        make(links, tag, elementType="road", **target)
    plan = make(road, "planView")
    pose = {"x": repr(x), "y": repr(y), "hdg": repr(hdg)}
    make(make(plan, "geometry", s="0", **pose, length=str(_JOINT)), "line")
    _joint_lanes(make, make(road, "lanes"), connection, near, far)
    connection.attrib.pop("linkedRoad")
    connection.set("connectingRoad", name)
    connection.set("contactPoint", "start")
    return road


class _Maker:
    """Makes elements in one namespace."""

    def __init__(self, namespace: str | None) -> None:
        self._namespace = namespace

    def __call__(
        self, parent: etree._Element | None, tag: str, **attributes: str
    ) -> etree._Element:
        name = etree.QName(self._namespace, tag)
        if parent is None:
            return etree.Element(name, attributes)
        return etree.SubElement(parent, name, attributes)


def _joint_lanes(
    make: _Maker, lanes: etree._Element, connection: etree._Element, near: _End, far: _End
) -> None:
    """Make one lane for each lane link, which is changed to lead to it."""
    made: dict[str, list[etree._Element]] = {"left": [], "right": []}
    for link in connection.iterchildren("{*}laneLink"):
        start, end = int(link.get("from", "0")), int(link.get("to", "0"))
        lane = near.lanes.get(start)
        if lane is None or end not in far.lanes:
            continue
        # Right of the joint lies what is right when one leaves the incoming road.
        right = (start < 0) == (near.contact == "end")
        side = made["right" if right else "left"]
        own = str(-len(side) - 1 if right else len(side) + 1)
        element = make(None, "lane", id=own, type=lane.get("type", "driving"), level="false")
        links = make(element, "link")
        make(links, "predecessor", id=str(start))
        make(links, "successor", id=str(end))
        make(element, "width", sOffset="0", a="3", b="0", c="0", d="0")
        side.append(element)
        link.set("to", own)
    section = make(lanes, "laneSection", s="0")
    if made["left"]:
        make(section, "left").extend(reversed(made["left"]))
    make(make(section, "center"), "lane", id="0", type="none", level="false")
    if made["right"]:
        make(section, "right").extend(made["right"])


def _end_at(road: etree._Element, junction: str) -> _End | None:
    links = _child(road, "link")
    if links is None:
        return None
    for tag, contact in (("successor", "end"), ("predecessor", "start")):
        link = _child(links, tag)
        if (
            link is not None
            and link.get("elementType") == "junction"
            and link.get("elementId") == junction
        ):
            return _end(road, contact)
    return None


def _end(road: etree._Element, contact: str) -> _End | None:
    sections = _all(road, "laneSection")
    if not sections:
        return None
    section = sections[-1 if contact == "end" else 0]
    return _End(road, contact, {int(lane.get("id", "0")): lane for lane in _all(section, "lane")})


def _pose(end: _End) -> tuple[float, float, float]:
    """Start of a joint: exact at a road's start; at its end where the last geometry starts.

    netconvert takes positions of joints only to place the junction's node, whose shape follows from
    the roads that meet there.
    """
    geometries = _all(end.road, "geometry")
    if not geometries:
        return 0.0, 0.0, 0.0
    geometry = geometries[-1 if end.contact == "end" else 0]
    x, y, hdg = (_number(geometry, name) for name in ("x", "y", "hdg"))
    if end.contact == "end":
        length = _number(geometry, "length")
        return x + length * math.cos(hdg), y + length * math.sin(hdg), hdg
    return x, y, hdg + math.pi
