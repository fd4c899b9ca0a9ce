"""``<road>``: attributes, links, types, plan view and profiles (sections 8 to 10)."""

from __future__ import annotations

import math
from itertools import pairwise
from operator import attrgetter
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from odscen.base.errors import OpenDriveError
from odscen.base.ids import JunctionId, RoadId
from odscen.base.shown import shown, shown_id
from odscen.opendrive.parse_furniture import parse_objects, parse_signals
from odscen.opendrive.parse_lanes import open_sole_layer, parse_sections, permanent_lanes
from odscen.opendrive.parse_rules import (
    CURVE_TOLERANCE,
    MAX_COORDINATE,
    MAX_NUMBER,
    MAX_ROAD_LENGTH,
    MAX_TURNING,
    POINT_LENGTH,
    S_TOLERANCE,
    SLIVER_LENGTH,
    STEP_BACK,
    Notes,
    Rule,
)
from odscen.opendrive.parse_values import (
    cubics,
    fill_missing,
    speed,
    spelt_choice,
    start_at_zero,
)
from odscen.opendrive.parse_xml import (
    Element,
    children,
    choice,
    number,
    only,
    positive,
    refusal,
    required,
)
from odscen.opendrive.road_model import (
    ContactPoint,
    Cubic,
    Geometry,
    GeometryKind,
    Road,
    RoadLink,
    RoadType,
    TrafficRule,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

READ: Final = frozenset(
    {"link", "type", "planView", "elevationProfile", "lateralProfile", "lanes", "objects"}
    | {"signals"}
)
IGNORED: Final = frozenset({"surface", "railroad"})
_TRAFFIC_RULES: Final[dict[str | None, TrafficRule]] = {
    None: "RHT",
    "": "RHT",
    "RHT": "RHT",
    "LHT": "LHT",
}
_LINKED: Final[dict[str, Literal["road", "junction"]]] = {"road": "road", "junction": "junction"}
_CONTACT_POINTS: Final[dict[str | None, ContactPoint | None]] = {
    None: None,
    "": None,
    "start": "start",
    "end": "end",
}


def parse_road(element: Element, notes: Notes) -> Road:
    """One road; references to other elements are checked later."""
    groups = children(element)
    for tag, found in groups.items():
        if tag not in READ and tag != "userData":
            rule = Rule.IGNORED if tag in IGNORED else Rule.UNKNOWN
            notes.skip(rule, "road", tag, len(found))
    _fill_lengths(element, notes)
    link = only(groups, "link")
    length, is_point = _parse_length_or_point(element, link, notes)
    lateral = _container_children(groups, "lateralProfile", {"superelevation"}, notes)
    if len(groups.get("lanes", ())) > 1:
        groups["lanes"] = permanent_lanes(element, groups["lanes"], notes)
    lanes = only(groups, "lanes")
    if lanes is None:
        raise refusal(element, "there is no <lanes>")
    lane_groups = open_sole_layer(lanes, notes)
    signals, references = parse_signals(groups.get("signals", ()), notes)
    return Road(
        id=RoadId(required(element, "id")),
        name=element.get("name", ""),
        length=length,
        junction=_parse_junction_id(element, notes),
        rule=spelt_choice(element, "rule", _TRAFFIC_RULES, notes),
        predecessor=_road_link(link, "predecessor", notes),
        successor=_road_link(link, "successor", notes),
        types=_road_types(groups.get("type", ()), notes),
        geometry=_plan_view(element, groups, length if is_point else None, notes),
        elevation=_parse_profile(
            _container_children(groups, "elevationProfile", {"elevation"}, notes),
            "elevation",
            length,
            notes,
        ),
        superelevation=_parse_profile(lateral, "superelevation", length, notes),
        lane_offset=_parse_profile(lane_groups, "laneOffset", length, notes),
        sections=parse_sections(lanes, lane_groups, length, notes),
        objects=parse_objects(groups.get("objects", ()), notes),
        signals=signals,
        signal_references=references,
    )


def _fill_lengths(road: Element, notes: Notes) -> None:
    """Put the lengths that are missing, of geometries and of a road, where the others say them."""
    plan = road.findall("planView/geometry")
    starts = [geometry.get("s", "0") for geometry in plan]
    for row, geometry in enumerate(plan):
        if geometry.get("length") is not None:
            continue
        end = starts[row + 1] if row + 1 < len(plan) else road.get("length")
        _put_length(geometry, _sum_of(end, starts[row], -1.0), notes)
    if plan and road.get("length") is None:
        _put_length(road, _sum_of(plan[-1].get("length"), starts[-1]), notes)


def _sum_of(text: str | None, other: str, sign: float = 1.0) -> float:
    """The sum of two numbers; NaN if one of them is none."""
    try:
        return float(text or "nan") + sign * float(other)
    except ValueError:
        return math.nan


def _put_length(element: Element, length: float, notes: Notes) -> None:
    if length > 0.0:
        element.set("length", repr(length))
        notes.add(Rule.MISSING_NUMBER, element, f"length is missing; it is {length:.6g} m")


def _parse_length_or_point(
    element: Element, link: Element | None, notes: Notes
) -> tuple[float, bool]:
    """Length of a road, metres, and whether it is a point that joins two roads."""
    length = number(element, "length", limit=MAX_ROAD_LENGTH)
    joined = {} if link is None else children(link)
    ends = [only(joined, name) for name in ("predecessor", "successor")]
    if length == 0.0 and all(end is not None and end.get("elementId") for end in ends):
        detail = f"length is 0; it joins two others and counts as {POINT_LENGTH:g} m long"
        notes.add(Rule.POINT_ROAD, element, detail)
        return POINT_LENGTH, True
    return positive(element, "length", limit=MAX_ROAD_LENGTH), False


def _parse_junction_id(element: Element, notes: Notes) -> JunctionId | None:
    text = element.get("junction")
    if text is None or not text.strip():
        detail = "junction is missing" if text is None else "junction is empty"
        notes.add(Rule.JUNCTION_ATTRIBUTE, element, f"{detail}; the road is in no junction")
        return None
    return None if text.strip() == "-1" else JunctionId(text)


def _road_link(link: Element | None, tag: str, notes: Notes) -> RoadLink | None:
    if link is None:
        return None
    element = only(children(link), tag)
    if element is None:
        return None
    element_type = _LINKED.get(element.get("elementType", "").strip().lower())
    if element_type and element_type != element.get("elementType"):
        detail = f"elementType={shown(element.get('elementType'))} is read as {element_type}"
        notes.add(Rule.SPELLING, element, detail)
    if "elementType" not in element.attrib and element.get("contactPoint"):
        # A link to a junction has no contact point.
        detail = "elementType is missing; it has a contactPoint, as links to roads have"
        notes.add(Rule.UNKNOWN_VALUE, element, detail)
        element_type = "road"
    if element_type is None:
        detail = f"elementType={shown(element.get('elementType'))} is neither road nor junction"
        notes.add(Rule.DANGLING_LINK, element, f"{detail}; the link is left out")
        return None
    # Which end a link without contactPoint means is looked for once all roads are known.
    contact_point = spelt_choice(element, "contactPoint", _CONTACT_POINTS, notes, otherwise=None)
    element_s = element.get("elementS") or None
    return RoadLink(
        element_type,
        required(element, "elementId"),
        contact_point,
        None if element_s is None else number(element, "elementS", limit=MAX_ROAD_LENGTH),
        element.get("elementDir"),
    )


def _road_types(elements: Sequence[Element], notes: Notes) -> tuple[RoadType, ...]:
    types: list[RoadType] = []
    for element in elements:
        limits = [child for child in element if child.tag == "speed"]
        try:
            s = number(element, "s", limit=MAX_ROAD_LENGTH)
        except OpenDriveError as error:
            if types:
                notes.add(Rule.UNKNOWN_VALUE, element, f"{error.problem}; the type is left out")
                continue
            # Of the first type of a road one knows where it begins.
            notes.add(Rule.UNKNOWN_VALUE, element, f"{error.problem}; it begins at s=0")
            s = 0.0
        given = {speed(limit, notes) for limit in limits}
        if len(given) > 1:
            notes.add(Rule.SPEED, element, f"there are {len(limits)} speeds; no speed is given")
        own = given.pop() if len(given) == 1 else None
        types.append(RoadType(s, element.get("type", ""), own))
    for before, after in pairwise(types):
        if after.s < before.s:
            detail = f"is below that of the {elements[0].tag} before; they are put in order"
            notes.add(Rule.MARK_ORDER, elements[0], f"s={after.s:g} {detail}")
            break
    return tuple(sorted(types, key=attrgetter("s")))


def _container_children(
    groups: dict[str, list[Element]], tag: str, read: set[str], notes: Notes
) -> dict[str, list[Element]]:
    """Children of an optional container; those without effect are noted."""
    element = only(groups, tag)
    if element is None:
        return {}
    found = children(element)
    for child, elements in found.items():
        if child not in read and child != "userData":
            known = child in {"shape", "crossSectionSurface", "crossfall"}
            notes.skip(Rule.IGNORED if known else Rule.UNKNOWN, tag, child, len(elements))
    return found


# ----------------------------------------------------------------------------- plan view
def _plan_view(
    road: Element, groups: dict[str, list[Element]], point: float | None, notes: Notes
) -> tuple[Geometry, ...]:
    """Geometries of a road; of one that is a ``point`` a line of that many metres."""
    plan_view = only(groups, "planView")
    elements = [] if plan_view is None else children(plan_view).get("geometry", [])
    if not elements:
        raise refusal(road, "there is no planView geometry")
    fill_missing(elements[0], ("s",), notes)
    geometry: list[Geometry] = []
    if point is not None:
        limits = {"x": MAX_COORDINATE, "y": MAX_COORDINATE, "hdg": MAX_NUMBER}
        x, y, hdg = (number(elements[0], name, limit=most) for name, most in limits.items())
        return (Geometry(0.0, x, y, hdg, point, GeometryKind.LINE, ()),)
    for element in elements:
        found = _holding_a_point(element, notes)
        if found is not None and _goes_on_behind(geometry, found, element, notes):
            geometry.append(found)
    if not geometry:
        raise refusal(road, "every planView geometry has the length 0")
    first = geometry[0]
    geometry[0] = first._replace(s=start_at_zero(elements[0], "s", first.s, notes))
    if abs(geometry[0].s) > S_TOLERANCE:
        raise refusal(road, f"the planView starts at s={geometry[0].s:g}, not at 0")
    return tuple(geometry)


def _holding_a_point(element: Element, notes: Notes) -> Geometry | None:
    """A geometry, or ``None`` if it is too short to hold a point or to say anything sensible."""
    s = number(element, "s", limit=MAX_ROAD_LENGTH)
    length = number(element, "length", limit=MAX_ROAD_LENGTH)
    if -SLIVER_LENGTH <= length <= 0.0:
        notes.add(Rule.ZERO_LENGTH, element, f"length is {length:g}; the geometry is left out")
        return None
    if not 0.0 < length <= SLIVER_LENGTH:
        return _parse_geometry(element, s, notes)
    try:
        return _parse_geometry(element, s, notes)
    except OpenDriveError as error:
        detail = f"{error.problem}; the geometry of {length:.3g} m is left out"
        notes.add(Rule.SLIVER, error.element or element, detail)
        return None


def _goes_on_behind(
    geometry: list[Geometry], new: Geometry, element: Element, notes: Notes
) -> bool:
    """Whether ``new`` goes on behind ``geometry``, of which slivers that it starts at are dropped.

    Raises
    ------
    OpenDriveError
        If it starts at or before a geometry, and neither of both is a sliver.
    """
    while geometry and new.s <= geometry[-1].s:
        before = geometry[-1]
        # Files of single precision do not tell s apart that are nearer to each other than this.
        least = max(STEP_BACK, float(np.spacing(np.float32(before.s))))
        if new.s < before.s - STEP_BACK or min(new.length, before.length) > least:
            raise refusal(
                element, f"s={new.s:g} is not beyond the s={before.s:g} of the geometry before"
            )
        rule = Rule.SAME_S if new.s == before.s else Rule.RECORD_ORDER
        which = "geometry" if new.length <= before.length else "geometry before"
        detail = f"s={new.s:.9g} is not beyond the s={before.s:.9g} of the geometry before"
        short = min(new.length, before.length)
        notes.add(rule, element, f"{detail}; the {which}, of {short:.3g} m, is left out")
        if new.length <= before.length:
            return False
        geometry.pop()
    return True


def _parse_geometry(element: Element, s: float, notes: Notes) -> Geometry:
    shapes = [shape for shape in element if shape.tag != "userData"]
    if len(shapes) != 1:
        raise refusal(element, f"there are {len(shapes)} shapes where one must be")
    shape = shapes[0]
    try:
        kind = GeometryKind(str(shape.tag))
    except ValueError as err:
        raise refusal(element, f"<{shown_id(str(shape.tag))}> is no known shape") from err
    length = positive(element, "length", limit=MAX_ROAD_LENGTH)
    params = _parse_params(shape, kind, length, notes)
    turning = length * max(map(abs, params), default=0.0)
    if kind in {GeometryKind.ARC, GeometryKind.SPIRAL} and turning > MAX_TURNING:
        raise refusal(shape, f"turns by about {turning:g} rad; the limit is {MAX_TURNING:g}")
    return Geometry(
        s,
        number(element, "x", limit=MAX_COORDINATE),
        number(element, "y", limit=MAX_COORDINATE),
        number(element, "hdg"),
        length,
        kind,
        params,
    )


_PARAMETERS: Final[dict[GeometryKind, tuple[str, ...]]] = {
    GeometryKind.LINE: (),
    GeometryKind.ARC: ("curvature",),
    GeometryKind.SPIRAL: ("curvStart", "curvEnd"),
    GeometryKind.POLY3: ("a", "b", "c", "d"),
    GeometryKind.PARAM_POLY3: ("aU", "bU", "cU", "dU", "aV", "bV", "cV", "dV"),
}


def _parse_params(
    shape: Element, kind: GeometryKind, length: float, notes: Notes
) -> tuple[float, ...]:
    values = tuple(number(shape, name) for name in _PARAMETERS[kind])
    if kind is not GeometryKind.PARAM_POLY3:
        return values
    if not (any(values[1:4]) or any(values[5:8])):
        raise refusal(shape, "all coefficients but aU and aV are 0: the curve is a point")
    if not _is_normalized(shape, values, length, notes):
        return values
    # p = ds / length, so that the k-th coefficient is divided by length^k.
    return tuple(value / length ** (i % 4) for i, value in enumerate(values))


_P_RANGES: Final[dict[str | None, bool]] = {
    "arcLength": False,
    "normalized": True,
    None: True,
    "": True,
}


def _is_normalized(shape: Element, values: Sequence[float], length: float, notes: Notes) -> bool:
    """Whether p of a paramPoly3 runs to 1, not to its length.

    Where ``pRange`` says neither, the one by which the curve is as long as it is said to be holds.
    """
    known = {str(name).lower() for name in _P_RANGES}
    p_range = shape.get("pRange")
    if p_range is None or p_range.strip().lower() in known:
        return spelt_choice(shape, "pRange", _P_RANGES, notes)
    fits = []
    for name, most in (("arcLength", length), ("normalized", 1.0)):
        p = np.linspace(0.0, most, 65)
        u, v = (np.polynomial.polynomial.polyval(p, values[i : i + 4]) for i in (0, 4))
        curve = float(np.hypot(np.diff(u), np.diff(v)).sum())
        if abs(curve - length) <= CURVE_TOLERANCE * length:
            fits.append(name)
    if len(fits) != 1:
        return choice(shape, "pRange", _P_RANGES)
    detail = (
        f"pRange={shown(p_range)} is read as {fits[0]}, by which the curve is as long as it says"
    )
    notes.add(Rule.UNKNOWN_VALUE, shape, detail)
    return fits[0] == "normalized"


def _parse_profile(
    groups: dict[str, list[Element]], tag: str, length: float, notes: Notes
) -> tuple[Cubic, ...]:
    """Records of a whole road; zero where the file starts late."""
    elements = groups.get(tag, [])
    records = cubics(elements, "s", 0.0, length, notes)
    if records and records[0].s > S_TOLERANCE:
        detail = f"starts at s={records[0].s:g}; the {tag} is 0 before"
        notes.add(Rule.LATE_START, elements[0], detail)
        records = (Cubic(0.0, 0.0, 0.0, 0.0, 0.0), *records)
    return records
