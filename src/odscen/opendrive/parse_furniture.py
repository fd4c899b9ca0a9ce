"""``<objects>`` and ``<signals>`` of a road (sections 13 and 14)."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Final

from odscen.base.errors import OpenDriveError
from odscen.base.shown import shown
from odscen.opendrive.parse_rules import MAX_COORDINATE, Notes, Rule
from odscen.opendrive.parse_values import speed_factor, validities
from odscen.opendrive.parse_xml import (
    Element,
    boolean,
    children,
    number,
    number_or,
    only,
    optional_number,
    required,
)
from odscen.opendrive.road_model import (
    Corner,
    ObjectRepeat,
    Outline,
    RoadObject,
    Signal,
    SignalReference,
    Validity,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

IGNORED: Final = frozenset({"bridge", "tunnel", "objectReference"})


def parse_objects(containers: Sequence[Element], notes: Notes) -> tuple[RoadObject, ...]:
    """All objects of a road, in the order of the file."""
    objects = []
    for element in chain.from_iterable(containers):
        if element.tag == "object":
            try:
                objects.append(_parse_object(element, notes))
            except OpenDriveError as error:
                detail = f"{error.problem}; the object is left out"
                notes.add(Rule.OBJECT_LEFT_OUT, error.element or element, detail)
        elif element.tag != "userData":
            rule = Rule.IGNORED if element.tag in IGNORED else Rule.UNKNOWN
            notes.skip(rule, "objects", str(element.tag))
    return tuple(objects)


_OBJECT_READ: Final = frozenset({"outline", "outlines", "repeat", "validity", "userData"})
_OBJECT_IGNORED: Final = frozenset({"material", "parkingSpace", "markings", "borders", "surface"})


def _parse_object(element: Element, notes: Notes) -> RoadObject:
    groups = children(element)
    for tag in groups:
        if tag not in _OBJECT_READ:
            rule = Rule.IGNORED if tag in _OBJECT_IGNORED else Rule.UNKNOWN
            notes.skip(rule, "object", tag)
    outlines = only(groups, "outlines")
    found = [*groups.get("outline", ())]  # 1.4: directly below the object
    if outlines is not None:
        found += children(outlines).get("outline", [])
    return RoadObject(
        id=required(element, "id"),
        type=element.get("type", ""),
        subtype=element.get("subtype", ""),
        name=element.get("name", ""),
        s=number(element, "s"),
        t=number(element, "t"),
        z_offset=number_or(element, "zOffset", 0.0),
        hdg=number_or(element, "hdg", 0.0),
        pitch=number_or(element, "pitch", 0.0),
        roll=number_or(element, "roll", 0.0),
        orientation=element.get("orientation", "none"),
        length=optional_number(element, "length"),
        width=optional_number(element, "width"),
        height=optional_number(element, "height"),
        radius=optional_number(element, "radius"),
        valid_length=optional_number(element, "validLength"),
        outlines=tuple(_parse_outline(outline, notes) for outline in found),
        repeats=tuple(_parse_repeat(repeat) for repeat in groups.get("repeat", ())),
        validities=validities(groups.get("validity", ())),
    )


def _parse_outline(element: Element, notes: Notes) -> Outline:
    corners = []
    for child in element:
        if child.tag == "cornerLocal":
            u, v = (number(child, name, limit=MAX_COORDINATE) for name in ("u", "v"))
            z = number_or(child, "z", 0.0)
            if not child.get("z", "").strip():
                notes.add(Rule.UNKNOWN_VALUE, child, "z is missing; the corner is on the ground")
            corners.append(Corner(True, u, v, z, number_or(child, "height", 0.0)))
        elif child.tag == "cornerRoad":
            s, t = (number(child, name, limit=MAX_COORDINATE) for name in ("s", "t"))
            z = number_or(child, "dz", 0.0)
            corners.append(Corner(False, s, t, z, number_or(child, "height", 0.0)))
    return Outline(
        tuple(corners),
        closed=boolean(element, "closed", default=True),
        outer=boolean(element, "outer", default=True),
    )


def _parse_repeat(element: Element) -> ObjectRepeat:
    t_start = number_or(element, "tStart", 0.0)
    return ObjectRepeat(
        number(element, "s"),
        number(element, "length"),
        number(element, "distance"),
        t_start,
        number_or(element, "tEnd", t_start),
    )


def parse_signals(
    containers: Sequence[Element], notes: Notes
) -> tuple[tuple[Signal, ...], tuple[SignalReference, ...]]:
    """All signals and signal references of a road, in the order of the file."""
    signals = []
    references = []
    for element in chain.from_iterable(containers):
        try:
            if element.tag == "signal":
                signals.append(_parse_signal(element, notes))
                continue
            if element.tag == "signalReference":
                references.append(_parse_reference(element, notes))
                continue
        except OpenDriveError as error:
            detail = f"{error.problem}; the {element.tag} is left out"
            notes.add(Rule.SIGNAL_LEFT_OUT, error.element or element, detail)
            continue
        if element.tag != "userData":
            notes.skip(Rule.UNKNOWN, "signals", str(element.tag))
    return tuple(signals), tuple(references)


_SIGNAL_READ: Final = frozenset({"validity", "dependency", "userData"})
_SIGNAL_IGNORED: Final = frozenset(
    {"reference", "positionRoad", "positionInertial", "physicalPosition", "semantics"}
    | {"staticBoard", "vmsBoard", "vmsGroup"}
)


def _parse_signal(element: Element, notes: Notes) -> Signal:
    groups = children(element)
    for tag in groups:
        if tag not in _SIGNAL_READ:
            rule = Rule.IGNORED if tag in _SIGNAL_IGNORED else Rule.UNKNOWN
            notes.skip(rule, "signal", tag)
    unit = element.get("unit", "")
    value = _parse_value(element, notes)
    factor = speed_factor(unit)
    return Signal(
        id=required(element, "id"),
        name=element.get("name", ""),
        s=number(element, "s"),
        t=_drawn_number(element, "t", notes) or 0.0,
        z_offset=_drawn_number(element, "zOffset", notes) or 0.0,
        h_offset=_drawn_number(element, "hOffset", notes) or 0.0,
        orientation=element.get("orientation", "none"),
        dynamic=_parse_dynamic(element, notes),
        country=element.get("country", ""),
        type=element.get("type", ""),
        subtype=element.get("subtype", ""),
        value=value if value is None or factor is None else value * factor,
        unit="m/s" if factor is not None else unit,
        text=element.get("text", ""),
        width=_drawn_number(element, "width", notes),
        height=_drawn_number(element, "height", notes),
        validities=_usable_validities(groups.get("validity", ()), notes),
        dependencies=_parse_dependencies(groups.get("dependency", ())),
    )


def _parse_value(element: Element, notes: Notes) -> float | None:
    """The value of a signal, if it is a number: what it means does not depend on it."""
    try:
        return optional_number(element, "value")
    except OpenDriveError as error:
        notes.add(Rule.UNKNOWN_VALUE, element, f"{error.problem}; the signal has no value")
        return None


def _parse_dynamic(element: Element, notes: Notes) -> bool:
    text = element.get("dynamic", "no")
    if text not in {"yes", "no"}:
        notes.add(Rule.UNKNOWN_VALUE, element, f"dynamic={shown(text)} counts as 'no'")
    return text == "yes"


def _parse_dependencies(elements: Sequence[Element]) -> tuple[tuple[str, str], ...]:
    named = ((element.get("id"), element.get("type", "")) for element in elements)
    return tuple((name, kind) for name, kind in named if name)


def _parse_reference(element: Element, notes: Notes) -> SignalReference:
    return SignalReference(
        id=required(element, "id"),
        s=number(element, "s"),
        t=_drawn_number(element, "t", notes) or 0.0,
        orientation=element.get("orientation", "none"),
        validities=_usable_validities(children(element).get("validity", ()), notes),
    )


def _usable_validities(elements: Sequence[Element], notes: Notes) -> tuple[Validity, ...]:
    """Validities of a signal without those that cannot be read."""
    found: list[Validity] = []
    for element in elements:
        try:
            found += validities([element])
        except OpenDriveError as error:
            notes.add(Rule.UNKNOWN_VALUE, element, f"{error.problem}; the validity is left out")
    return tuple(found)


def _drawn_number(element: Element, name: str, notes: Notes) -> float | None:
    """A number that only says how a signal looks; ``None`` if it is none."""
    try:
        return number(element, name) if name == "t" else optional_number(element, name)
    except OpenDriveError as error:
        notes.add(Rule.PAINT, element, f"{error.problem}; it is not used")
        return None
