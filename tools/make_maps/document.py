"""From a :class:`Builder` to the text of an .xodr file."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from tools.make_maps.builder import Builder

GEO_REFERENCE = "+proj=tmerc +lat_0=48 +lon_0=11 +k=1 +x_0=0 +y_0=0 +datum=WGS84 +units=m +no_defs"
OUTLINE = {"id": "0", "fillType": "asphalt", "outer": "true", "closed": "true"}
EMPTY = {"elevationProfile", "lateralProfile", "link"}
"""Elements that say nothing when they are empty."""

DEFAULTS = {
    "lane": {"level": "false"},
    "road": {"rule": "RHT"},
    "roadMark": {"weight": "standard"},
    "object": {
        "subtype": "None",
        "dynamic": "no",
        "pitch": "0",
        "roll": "0",
        "hdg": "0",
        "height": "0.0",
        "orientation": "none",
    },
    "signal": {"pitch": "0", "roll": "0", "hOffset": "0"},
}
"""Optional attributes that say nothing when they have these values."""

LENGTHS = {"s", "sOffset", "x", "y", "length", "t", "u", "v", "width"}
"""Attributes in metres, written to 0.01 mm."""
POLYNOMIALS = {"a", "b", "c", "d", "curvature", "curvStart", "curvEnd"} | {
    power + axis for power in "abcd" for axis in "UV"
}
"""Attributes written with eight digits."""


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
        revMinor="7",
        name=builder.name,
        version="1.00",
        date="2026-01-01T00:00:00",
        north=f"{north:.0f}",
        south=f"{south:.0f}",
        east=f"{east:.0f}",
        west=f"{west:.0f}",
        vendor="odscen",
    )
    ET.SubElement(header, "geoReference").text = GEO_REFERENCE
    return header


def _tidy_road(road: ET.Element) -> ET.Element:
    """Write what the library lacks and leave out what says nothing."""
    for item in road.iter("object"):
        _outline(item)
    for parent in list(road.iter()):
        for child in list(parent):
            empty = not len(child) and not child.attrib and not child.text
            if empty and child.tag in EMPTY:
                parent.remove(child)
        for name, value in DEFAULTS.get(parent.tag, {}).items():
            if parent.get(name) == value:
                del parent.attrib[name]
    for signals in road.iter("signals"):
        # The schema wants signals before references.
        signals[:] = sorted(signals, key=lambda item: item.tag)
    for signal in road.iter("signal"):
        if signal.get("country") == "OPENDRIVE":
            signal.set("country", "OpenDRIVE")  # the library writes countries in capitals
    return road


def _outline(item: ET.Element) -> None:
    """Move an outline to where CARLA reads it: 1.4's place, which later versions allow."""
    for group in item.findall("outlines"):
        item.remove(group)
        for outline in group.findall("outline"):
            outline.attrib.clear()
            outline.attrib.update(OUTLINE)
            item.append(outline)


MIRRORED = {
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
}
"""Attributes that change their sign when a map is mirrored at the y axis."""


def mirrored(root: ET.Element) -> ET.Element:
    """Mirror a map at the y axis, so that its traffic keeps left."""
    for road in root.iter("road"):
        road.set("rule", "LHT")
    for geometry in root.iter("geometry"):
        geometry.set("hdg", str(math.pi - float(geometry.get("hdg", "0"))))
    negative = [
        (e, name) for tag, names in MIRRORED.items() for e in root.iter(tag) for name in names
    ]
    for element, name in negative:
        if name in element.attrib:
            element.set(name, str(-float(element.get(name, "0"))))
    for section in root.iter("laneSection"):
        _swap_sides(section)
    for link in root.iter("laneLink"):
        link.attrib.update({name: str(-int(lane)) for name, lane in link.attrib.items()})
    for tag, low, high in (("validity", "fromLane", "toLane"), ("header", "west", "east")):
        for element in root.iter(tag):
            first, last = (-int(element.get(name, "0")) for name in (high, low))
            element.set(low, str(first))
            element.set(high, str(last))
    return root


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
    """Write the tree with few digits, the same on every machine."""
    for element in root.iter():
        for name, value in element.attrib.items():
            if name in LENGTHS or (name in POLYNOMIALS and element.tag != "control"):
                element.set(name, _plain(f"{float(value):.5f}" if name in LENGTHS else value))
            elif name == "hdg":
                heading = math.remainder(float(value), 2.0 * math.pi)
                element.set(name, _plain(f"{heading:.8f}"))
            elif name in ("max", "value", "zOffset", "height", "inner", "outer", "z"):
                element.set(name, _plain(value))
    ET.indent(root, "")
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _plain(value: str) -> str:
    """Shortest form of at most eight digits; ``true`` and ``undefined`` stay."""
    try:
        number = float(value)
    except ValueError:
        return value
    short = f"{number:.8g}"
    return "0" if abs(number) < 1e-12 else short
