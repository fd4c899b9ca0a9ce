"""Road model to OpenDRIVE text: the other direction of :mod:`odscen.opendrive.parse`.

Importers of other formats, and whatever changes a map, build the values of
:mod:`odscen.opendrive.road_model` and write them here. What is written holds to the schema of the
version in the header, 1.4 to 1.8, and reads back as the same model.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from lxml import etree

from odscen.base.errors import OpenDriveError
from odscen.base.markup import number
from odscen.opendrive.parse import read_tree
from odscen.opendrive.parse_rules import Notes
from odscen.opendrive.road_model import Controller, GeometryKind, Road

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.opendrive.road_model import (
        Cubic,
        Geometry,
        Header,
        Junction,
        Lane,
        LaneSection,
        OpenDrive,
        Outline,
        RoadLink,
        RoadObject,
        Signal,
        Validity,
    )

Element = etree._Element

_SPEED_UNITS: Final = (("km/h", 3.6), ("mph", 1 / 0.44704))
_SHORTEST: Final = 1e-9
"""Geometries of this length, metres, would have the length 0 when written."""
_SPIRAL: Final = ("curvStart", "curvEnd")
_PARAM_POLY3: Final = ("aU", "bU", "cU", "dU", "aV", "bV", "cV", "dV")


def write_opendrive(model: OpenDrive, *, vendor: str = "odscen", date: str = "") -> bytes:
    """Text of a map.

    Parameters
    ----------
    model
        Roads, junctions and controllers are written in the order of their dictionaries. ``notes``
        and the header's ``crs`` are not: they are what reading adds.
    vendor, date
        Of the header; a date only where it is that of the data, as the same map has the same bytes.

    Returns
    -------
    bytes
        UTF-8. Lengths have nine digits behind the point, angles ten, coefficients twelve that
        count, so that small differences of the arithmetic of machines do not show; geometries
        shorter than a nanometre are left out.
    """
    root = etree.Element("OpenDRIVE")
    _write_header(root, model.header, vendor, date)
    for road in model.roads.values():
        _write_road(root, road, model.header.rev_minor)
    for controller in model.controllers.values():
        _write_controller(root, controller)
    for junction in model.junctions.values():
        _write_junction(root, junction)
    return etree.tostring(root, encoding="UTF-8", xml_declaration=True, pretty_print=True)


def rewrite_opendrive(text: bytes, before: OpenDrive, after: OpenDrive) -> bytes:
    """Text of a map that was changed: what is as it was stays as the file has it.

    Parameters
    ----------
    text, before
        The file, and the map that :func:`~odscen.opendrive.parse.parse` has made of it.
    after
        The map with roads, junctions and controllers that were replaced, added or removed.

    Returns
    -------
    bytes
        UTF-8. Of roads that were replaced the objects, signals and ``userData`` that are as they
        were stay as well; other children that the road model does not have are lost.

    Raises
    ------
    OpenDriveError
        If the file has an element that was replaced twice.
    """
    root = read_tree(text, Notes())
    kinds: tuple[tuple[str, Mapping[Any, Any], Mapping[Any, Any]], ...] = (
        ("road", before.roads, after.roads),
        ("controller", before.controllers, after.controllers),
        ("junction", before.junctions, after.junctions),
    )
    for tag, old, new in kinds:
        elements: dict[str, list[Element]] = {}
        for element in root.findall(tag):
            elements.setdefault(element.get("id", ""), []).append(element)
        for key in old:
            if old[key] == new.get(key):
                continue
            places = elements.get(key, [])
            if len(places) != 1:
                raise OpenDriveError(
                    f"it is there {len(places)} times, so it cannot be changed",
                    element=f"{tag} {key}",
                )
            if key not in new:
                root.remove(places[0])
                continue
            holder = etree.Element("holder")
            _write_changed(holder, new[key], after.header.rev_minor)
            written = holder[0]
            _keep_unchanged(places[0], written, old[key], new[key])
            root.replace(places[0], written)
        added = [key for key in new if key not in old]
        last = [element for element in root if element.tag == tag]
        place = root.index(last[-1]) + 1 if last else len(root)
        for number_, key in enumerate(added):
            holder = etree.Element("holder")
            _write_changed(holder, new[key], after.header.rev_minor)
            root.insert(place + number_, holder[0])
    etree.indent(root, space="  ")
    return etree.tostring(root, encoding="UTF-8", xml_declaration=True, pretty_print=True)


def _write_changed(parent: Element, value: Road | Controller | Junction, rev_minor: int) -> None:
    if isinstance(value, Road):
        _write_road(parent, value, rev_minor)
    elif isinstance(value, Controller):
        _write_controller(parent, value)
    else:
        _write_junction(parent, value)


def _keep_unchanged(source: Element, written: Element, old: object, new: object) -> None:
    """Put elements of the file in the place of those that were written of the same values."""
    for data in source.findall("userData"):
        written.append(data)
    if not (isinstance(old, Road) and isinstance(new, Road)):
        return
    for tag, olds, news in (
        ("object", old.objects, new.objects),
        ("signal", old.signals, new.signals),
    ):
        same = {item.id: item for item in olds}
        originals = {element.get("id", ""): element for element in source.iter(tag)}
        for element in list(written.iter(tag)):
            key = element.get("id", "")
            item = next(item for item in news if item.id == key)
            if same.get(key) == item and key in originals:
                parent = element.getparent()
                if parent is not None:
                    parent.replace(element, originals[key])


def _append_element(parent: Element, tag: str, **attributes: str | float | None) -> Element:
    """Append an element: numbers as lengths, ``None`` left out, a last underscore dropped."""
    element = etree.SubElement(parent, tag)
    for name, value in attributes.items():
        if value is not None:
            element.set(name.rstrip("_"), value if isinstance(value, str) else number(value, 9))
    return element


def _format_angle(value: float) -> str:
    return number(math.remainder(value, 2.0 * math.pi), 10)


def _format_coefficient(value: float) -> str:
    return f"{value + 0.0:.12g}"  # + 0.0: no negative zero


def _write_header(root: Element, header: Header, vendor: str, date: str) -> None:
    element = _append_element(
        root,
        "header",
        revMajor=str(header.rev_major),
        revMinor=str(header.rev_minor),
        name=header.name,
        version="1.00",
        date=date or None,
        north=header.north,
        south=header.south,
        east=header.east,
        west=header.west,
        vendor=vendor,
    )
    if header.geo_reference:
        _append_element(element, "geoReference").text = header.geo_reference
    if any(header.offset):
        x, y, z, hdg = header.offset
        _append_element(element, "offset", x=x, y=y, z=z, hdg=_format_angle(hdg))


# ----------------------------------------------------------------------------- roads
def _write_road(root: Element, road: Road, rev_minor: int) -> None:
    element = _append_element(
        root,
        "road",
        name=road.name,
        length=road.length,
        id=road.id,
        junction=road.junction or "-1",
        rule=road.rule,
    )
    if road.predecessor or road.successor:
        link = _append_element(element, "link")
        _write_link(link, "predecessor", road.predecessor)
        _write_link(link, "successor", road.successor)
    for kind in road.types:
        item = _append_element(element, "type", s=kind.s, type=kind.type)
        if kind.speed is not None:
            _write_speed(item, kind.speed)
    plan = _append_element(element, "planView")
    for geometry in road.geometry:
        if geometry.length > _SHORTEST:
            _write_geometry(plan, geometry)
    if road.elevation:
        _write_cubics(_append_element(element, "elevationProfile"), "elevation", road.elevation)
    if road.superelevation:
        _write_cubics(
            _append_element(element, "lateralProfile"), "superelevation", road.superelevation
        )
    lanes = _append_element(element, "lanes")
    _write_cubics(lanes, "laneOffset", road.lane_offset)
    for section in road.sections:
        _write_section(lanes, section, rev_minor)
    if road.objects:
        objects = _append_element(element, "objects")
        for furniture in road.objects:
            _write_object(objects, furniture)
    if road.signals or road.signal_references:
        signals = _append_element(element, "signals")
        for signal in road.signals:
            _write_signal(signals, signal)
        for reference in road.signal_references:
            place = _append_element(
                signals,
                "signalReference",
                s=reference.s,
                t=reference.t,
                id=reference.id,
                orientation=reference.orientation,
            )
            _write_validities(place, reference.validities)


def _write_link(parent: Element, tag: str, link: RoadLink | None) -> None:
    if link is None:
        return
    _append_element(
        parent,
        tag,
        elementType=link.element_type,
        elementId=link.element_id,
        contactPoint=link.contact_point,
        elementS=link.element_s,
        elementDir=link.element_dir,
    )


def _write_speed(parent: Element, speed: float, **place: float) -> None:
    """A limit in the unit in which it is a whole number: as signs have it."""
    if math.isinf(speed):
        _append_element(parent, "speed", **place, max="no limit")
        return
    value, unit = _choose_sign_unit(speed)
    _append_element(parent, "speed", **place, max=value, unit=unit)


def _choose_sign_unit(speed: float) -> tuple[str, str]:
    """Speed of m/s as number and unit: km/h or mph where that is a whole number."""
    for unit, per_mps in _SPEED_UNITS:
        value = speed * per_mps
        if abs(value - round(value)) < 1e-6:
            return number(value, 9), unit
    return number(speed, 9), "m/s"


def _write_geometry(plan: Element, geometry: Geometry) -> None:
    element = _append_element(
        plan,
        "geometry",
        s=geometry.s,
        x=geometry.x,
        y=geometry.y,
        hdg=_format_angle(geometry.hdg),
        length=geometry.length,
    )
    names: Sequence[str] = {
        GeometryKind.LINE: (),
        GeometryKind.ARC: ("curvature",),
        GeometryKind.SPIRAL: _SPIRAL,
        GeometryKind.POLY3: tuple("abcd"),
        GeometryKind.PARAM_POLY3: _PARAM_POLY3,
    }[geometry.kind]
    shape = _append_element(element, geometry.kind.value)
    for name, value in zip(names, geometry.params, strict=True):
        shape.set(name, _format_coefficient(value))
    if geometry.kind is GeometryKind.PARAM_POLY3:
        shape.set("pRange", "arcLength")


def _write_cubics(
    parent: Element, tag: str, records: Iterable[Cubic], *, start: float | None = None
) -> None:
    """Profiles over s; those of a lane over its offset from the ``start`` of its section."""
    for record in records:
        place = {"s": record.s} if start is None else {"sOffset": record.s - start}
        element = _append_element(parent, tag, **place)
        for name, value in zip("abcd", record[1:], strict=True):
            element.set(name, _format_coefficient(value))


# ----------------------------------------------------------------------------- lanes
def _write_section(lanes: Element, section: LaneSection, rev_minor: int) -> None:
    element = _append_element(lanes, "laneSection", s=section.s)
    if section.single_side:
        element.set("singleSide", "true")
    ordered = sorted(section.lanes.values(), key=lambda lane: -lane.id)
    for side, sign in (("left", 1), ("center", 0), ("right", -1)):
        of_side = [lane for lane in ordered if (lane.id > 0) - (lane.id < 0) == sign]
        if of_side:
            container = _append_element(element, side)
            for lane in of_side:
                _write_lane(container, lane, section.s, rev_minor)


def _write_lane(container: Element, lane: Lane, start: float, rev_minor: int) -> None:
    element = _append_element(
        container, "lane", id=str(lane.id), type=lane.type, level=str(lane.level).lower()
    )
    if lane.direction != "standard":
        element.set("direction", lane.direction)
    if lane.predecessors or lane.successors:
        link = _append_element(element, "link")
        for tag, linked in (("predecessor", lane.predecessors), ("successor", lane.successors)):
            for lane_id in linked:
                _append_element(link, tag, id=str(lane_id))
    # Lanes have widths or borders; with both, which some files have, the widths hold.
    _write_cubics(element, "width", lane.widths, start=start)
    if not lane.widths:
        _write_cubics(element, "border", lane.borders, start=start)
    for mark in lane.road_marks:
        _append_element(
            element,
            "roadMark",
            sOffset=mark.s - start,
            type=mark.type,
            weight=mark.weight,
            color=mark.color,
            width=mark.width or None,
            laneChange=mark.lane_change,
        )
    for limit in lane.speeds:
        _write_speed(element, limit.max, sOffset=limit.s - start)
    _write_access(element, lane, start, rev_minor)
    for height in lane.heights:
        _append_element(
            element, "height", sOffset=height.s - start, inner=height.inner, outer=height.outer
        )


def _write_access(element: Element, lane: Lane, start: float, rev_minor: int) -> None:
    """One element a restriction; from 1.8 on one element a place, with its restrictions below."""
    group: Element | None = None
    last: tuple[float, str] | None = None
    for record in lane.access:
        place = {"sOffset": record.s - start, "rule": record.rule or None}
        if rev_minor < 8:
            _append_element(element, "access", **place, restriction=record.restriction)
            continue
        if group is None or last != (record.s, record.rule):
            group, last = _append_element(element, "access", **place), (record.s, record.rule)
        _append_element(group, "restriction", type=record.restriction)


# ----------------------------------------------------------------------------- furniture
def _write_object(objects: Element, item: RoadObject) -> None:
    element = _append_element(
        objects,
        "object",
        id=item.id,
        type=item.type or None,
        subtype=item.subtype or None,
        name=item.name or None,
        s=item.s,
        t=item.t,
        zOffset=item.z_offset,
        hdg=_format_angle(item.hdg),
        pitch=_format_angle(item.pitch),
        roll=_format_angle(item.roll),
        orientation=item.orientation,
        length=item.length,
        width=item.width,
        height=item.height,
        radius=item.radius,
        validLength=item.valid_length,
    )
    height, z_offset = item.height or 0.0, item.z_offset
    for repeat in item.repeats:
        _append_element(
            element,
            "repeat",
            s=repeat.s,
            length=repeat.length,
            distance=repeat.distance,
            tStart=repeat.t_start,
            tEnd=repeat.t_end,
            heightStart=height,
            heightEnd=height,
            zOffsetStart=z_offset,
            zOffsetEnd=z_offset,
        )
    # Several outlines have a container since 1.5; a single one is where 1.4 and CARLA look for it.
    several = len(item.outlines) > 1
    container = _append_element(element, "outlines") if several else element
    for number_, outline in enumerate(item.outlines):
        _write_outline(container, str(number_), outline)
    _write_validities(element, item.validities)


def _write_outline(container: Element, name: str, outline: Outline) -> None:
    element = _append_element(
        container,
        "outline",
        id=name,
        outer=str(outline.outer).lower(),
        closed=str(outline.closed).lower(),
    )
    for corner in outline.corners:
        if corner.local:
            _append_element(
                element, "cornerLocal", u=corner.a, v=corner.b, z=corner.z, height=corner.height
            )
        else:
            _append_element(
                element, "cornerRoad", s=corner.a, t=corner.b, dz=corner.z, height=corner.height
            )


def _write_signal(signals: Element, signal: Signal) -> None:
    value = None if signal.value is None else number(signal.value, 9)
    unit = signal.unit
    if unit == "m/s" and signal.value is not None:
        value, unit = _choose_sign_unit(signal.value)
    element = _append_element(
        signals,
        "signal",
        name=signal.name or None,
        id=signal.id,
        s=signal.s,
        t=signal.t,
        zOffset=signal.z_offset,
        hOffset=_format_angle(signal.h_offset),
        orientation=signal.orientation,
        dynamic="yes" if signal.dynamic else "no",
        country=signal.country or None,
        type=signal.type,
        subtype=signal.subtype,
        value=value,
        unit=unit or None,
        text=signal.text or None,
        width=signal.width,
        height=signal.height,
    )
    _write_validities(element, signal.validities)
    for signal_id, kind in signal.dependencies:
        _append_element(element, "dependency", id=signal_id, type=kind)


def _write_validities(parent: Element, validities: Iterable[Validity]) -> None:
    for validity in validities:
        _append_element(
            parent,
            "validity",
            fromLane=str(validity.from_lane),
            toLane=str(validity.to_lane),
        )


# ----------------------------------------------------------------------------- junctions
def _write_controller(root: Element, controller: Controller) -> None:
    element = _append_element(
        root,
        "controller",
        id=controller.id,
        name=controller.name,
        sequence=None if controller.sequence is None else str(controller.sequence),
    )
    for signal_id, kind in controller.controls:
        _append_element(element, "control", signalId=signal_id, type=kind or None)


def _write_junction(root: Element, junction: Junction) -> None:
    element = _append_element(
        root, "junction", id=junction.id, name=junction.name, mainRoad=junction.main_road
    )
    if junction.type != "default":
        element.set("type", junction.type)
    linked = "linkedRoad" if junction.type == "direct" else "connectingRoad"
    for connection in junction.connections:
        item = _append_element(
            element,
            "connection",
            id=connection.id,
            incomingRoad=connection.incoming_road,
            **{linked: connection.connecting_road},
            contactPoint=connection.contact_point,
        )
        for from_lane, to_lane in connection.lane_links:
            _append_element(item, "laneLink", from_=str(from_lane), to=str(to_lane))
    for priority in junction.priorities:
        _append_element(element, "priority", high=priority.high, low=priority.low)
    for sequence, controller in enumerate(junction.controllers):
        _append_element(element, "controller", id=controller, type="0", sequence=str(sequence))
