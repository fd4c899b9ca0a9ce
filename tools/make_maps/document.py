"""From a :class:`Builder` to the text of an .xodr file."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET

import numpy as np

from tools.make_maps.builder import Builder

GEO_REFERENCE = (
    "+proj=tmerc +lat_0=48.0 +lon_0=11.0 +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m +no_defs"
)
NUMBER = re.compile(r"-?\d+(\.\d+)?(e[-+]?\d+)?", re.IGNORECASE)
TEXTS = {
    "id",
    "type",
    "subtype",
    "elementId",
    "incomingRoad",
    "connectingRoad",
    "junction",
    "name",
    "version",
}
"""Attributes whose digits are names, not numbers."""

OUTLINE = {"id": "0", "fillType": "asphalt", "outer": "true", "closed": "true", "laneType": "none"}
EMPTY = {"elevationProfile", "lateralProfile", "link"}
"""Elements that say nothing when they are empty."""


def document(builder: Builder) -> ET.Element:
    """Make the whole tree: header, roads, controllers, junctions, in the order of the schema."""
    root = ET.Element("OpenDRIVE")
    root.append(_header(builder))
    for record in builder.roads:
        root.append(_tidy_road(record.road.get_element()))
    for number, name, signals in builder.controllers:
        controller = ET.SubElement(root, "controller", id=str(number), name=name, sequence="0")
        for signal in signals:
            ET.SubElement(controller, "control", signalId=signal, type="0")
    for junction in builder.junctions:
        element = junction.get_element()
        for high, low in builder.priorities.get(junction.id, []):
            ET.SubElement(element, "priority", high=str(high), low=str(low))
        for sequence, number in enumerate(builder.junction_controllers.get(junction.id, [])):
            ET.SubElement(element, "controller", id=str(number), type="0", sequence=str(sequence))
        root.append(element)
    return root


def _header(builder: Builder) -> ET.Element:
    xy = np.array([(p.x, p.y) for r in builder.roads for p in (r.start, r.end)])
    west, south = np.floor(xy.min(axis=0) - 20)
    east, north = np.ceil(xy.max(axis=0) + 20)
    header = ET.Element(
        "header",
        revMajor="1",
        revMinor="5",
        name=builder.name,
        version="1.00",
        date="2026-01-01T00:00:00",
        north=str(north),
        south=str(south),
        east=str(east),
        west=str(west),
        vendor="odscen",
    )
    ET.SubElement(header, "geoReference").text = GEO_REFERENCE
    return header


def _tidy_road(road: ET.Element) -> ET.Element:
    """Put things where OpenDRIVE 1.5 and CARLA look for them, and leave out what says nothing."""
    for item in road.iter("object"):
        _tidy_object(item)
    for parent in list(road.iter()):
        for child in list(parent):
            if _says_nothing(child):
                parent.remove(child)
    signals = road.find("signals")
    if signals is not None:
        signals[:] = sorted(signals, key=lambda item: item.tag)
        for signal in signals.iter("signal"):
            if signal.get("country") == "OPENDRIVE":
                signal.set("country", "OpenDRIVE")  # the library writes country codes in capitals
    return road


def _tidy_object(item: ET.Element) -> None:
    """CARLA reads an outline only if it is a child of the object itself."""
    for group in item.findall("outlines"):
        item.remove(group)
        for outline in group.findall("outline"):
            outline.attrib.clear()
            outline.attrib.update(OUTLINE)
            for number, corner in enumerate(outline):
                corner.set("id", str(number))
            item.append(outline)
    item.set("validLength", "0")


def _says_nothing(element: ET.Element) -> bool:
    if element.tag == "roadMark":
        return element.get("type") == "none"
    empty = not len(element) and not element.attrib and not element.text
    return empty and element.tag in EMPTY


NEGATED = {
    "geometry": ("x",),
    "arc": ("curvature",),
    "spiral": ("curvStart", "curvEnd"),
    "paramPoly3": ("aV", "bV", "cV", "dV"),
    "laneOffset": ("a", "b", "c", "d"),
    "superelevation": ("a", "b", "c", "d"),
    "object": ("t", "hdg"),
    "signal": ("t", "hOffset"),
    "signalReference": ("t",),
    "cornerLocal": ("v",),
    "laneLink": ("from", "to"),
    "validity": ("fromLane", "toLane"),
}
"""What changes sign in a mirror."""


def mirrored(root: ET.Element) -> ET.Element:
    """Mirror a map at the y axis, so that its traffic keeps left."""
    for element in root.iter():
        for name in NEGATED.get(element.tag, ()):
            if name in element.attrib:
                element.set(name, str(-float(element.get(name, "0"))))
        if element.tag == "road":
            element.set("rule", "LHT")
        elif element.tag == "geometry":
            element.set("hdg", str(math.pi - float(element.get("hdg", "0"))))
        elif element.tag == "laneSection":
            _swap_sides(element)
        elif element.tag == "validity":
            _swap(element, "fromLane", "toLane")
        elif element.tag == "header":
            element.set("west", str(-float(element.get("west", "0"))))
            element.set("east", str(-float(element.get("east", "0"))))
            _swap(element, "west", "east")
    return root


def _swap(element: ET.Element, one: str, other: str) -> None:
    first, second = element.attrib[one], element.attrib[other]
    element.set(one, second)
    element.set(other, first)


def _swap_sides(section: ET.Element) -> None:
    for lane in section.iter("lane"):
        for element in (lane, *lane.iter("predecessor"), *lane.iter("successor")):
            element.set("id", str(-int(element.get("id", "0"))))
    left, right = section.find("left"), section.find("right")
    for side, name in ((left, "right"), (right, "left")):
        if side is not None:
            side.tag = name
            side[:] = sorted(side, key=lambda lane: -int(lane.get("id", "0")))
    order = ["left", "center", "right"]
    section[:] = sorted(section, key=lambda side: order.index(side.tag))


def text(root: ET.Element) -> str:
    """Write the tree with numbers of seven digits, the same on every machine."""
    for element in root.iter():
        for name, value in element.attrib.items():
            if name not in TEXTS and NUMBER.fullmatch(value):
                element.set(name, _short(float(value)))
    ET.indent(root, "")
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _short(value: float) -> str:
    rounded = f"{value:.7g}" if abs(value) > 1e-12 else "0"
    return "0" if float(rounded) == 0 else rounded
