"""``<lanes>``: sections, lanes and what hangs on them (section 11)."""

from __future__ import annotations

import itertools
import re
import sys
from dataclasses import replace
from operator import attrgetter
from typing import TYPE_CHECKING, Final, TypeVar

from odscen.base.errors import OpenDriveError
from odscen.base.shown import shown, shown_id
from odscen.opendrive.parse_rules import (
    MAX_LANE_ID,
    MAX_ROAD_LENGTH,
    MAX_WIDTH,
    S_TOLERANCE,
    STEP_BACK,
    Notes,
    Rule,
)
from odscen.opendrive.parse_values import (
    cubics,
    fill_missing,
    ordered_s,
    speed,
    spelt_choice,
    start_at_zero,
)
from odscen.opendrive.parse_xml import (
    Element,
    boolean,
    children,
    integer,
    number,
    number_or,
    only,
    refusal,
    unread,
)
from odscen.opendrive.road_model import (
    DRIVABLE_TYPES,
    Lane,
    LaneAccess,
    LaneChange,
    LaneHeight,
    LaneSection,
    LaneSpeed,
    RoadMark,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

READ: Final = frozenset(
    {"link", "width", "border", "height", "roadMark", "speed", "access", "userData"}
)
IGNORED: Final = frozenset({"material", "rule", "visibility"})
_LANE_CHANGES: Final[dict[str | None, LaneChange]] = {
    None: "both",  # the standard's default (section 11.9)
    "": "both",
    "both": "both",
    "increase": "increase",
    "decrease": "decrease",
    "none": "none",
}
R = TypeVar("R", LaneAccess, LaneHeight, LaneSpeed, RoadMark)


_TEMPORARY: Final = "temporary"
"""The lane layer of 1.9 for road works; the other one is permanent, or has no name."""


def permanent_lanes(road: Element, found: list[Element], notes: Notes) -> list[Element]:
    """The ``<lanes>`` of a road without those of road works (1.9, section 11.2).

    The permanent layer is as long as the road, and holds as long as nothing is in the way. Lanes of
    the temporary one have priority where they are; the file does not say when that is.
    """
    temporary = [lanes for lanes in found if lanes.get("layer", "").strip().lower() == _TEMPORARY]
    if not temporary or len(temporary) == len(found):
        return found
    detail = "the temporary lane layer is left out: traffic keeps to the permanent lanes"
    notes.add(Rule.TEMPORARY_LANES, road, detail)
    return [lanes for lanes in found if lanes not in temporary]


def open_sole_layer(lanes: Element, notes: Notes) -> dict[str, list[Element]]:
    """Children of ``<lanes>`` by name: those of its lane layer (1.9) where it has nothing but one.

    Of several layers, as for road works, which one traffic keeps to is not known.
    """
    groups = children(lanes)
    layers = [
        layer
        for tag, found in groups.items()
        if "layer" in tag.lower()
        for layer in found
        if layer.find("laneSection") is not None
    ]
    if "laneSection" in groups or len(layers) != 1:
        return groups
    notes.add(Rule.VERSION, layers[0], "the only lane layer, as OpenDRIVE 1.9 has them, holds")
    offsets = {tag: groups[tag] for tag in ("laneOffset",) if tag in groups}
    return {**offsets, **children(layers[0])}


def parse_sections(
    lanes: Element, groups: dict[str, list[Element]], length: float, notes: Notes
) -> tuple[LaneSection, ...]:
    """All lane sections of a road of ``length`` metres."""
    elements = groups.get("laneSection", [])
    if not elements:
        layers = [tag for tag in groups if "layer" in tag.lower()]
        if layers:
            raise refusal(
                lanes,
                f"the lanes are in several <{shown_id(layers[0])}> elements: which of the lane "
                "layers of OpenDRIVE 1.9 traffic keeps to is not clear; save the map with one, or "
                "as 1.8 or older",
            )
        raise refusal(lanes, "there is no laneSection")
    starts: list[float] = []
    fill_missing(elements[0], ("s",), notes)
    for element in elements:
        s = number(element, "s", limit=MAX_ROAD_LENGTH)
        s = s if starts else start_at_zero(element, "s", s, notes)
        if starts and s < starts[-1]:
            s = ordered_s(element, "s", s, starts[-1], notes)
        if s > length + STEP_BACK:
            raise refusal(element, f"s={s:g} is beyond the road's length of {length:g}")
        if s > length:
            detail = f"s={s:.9g} is beyond the road's length of {length:.9g}; it starts there"
            notes.add(Rule.RECORD_ORDER, element, detail)
        starts.append(min(s, length))
    if abs(starts[0]) > S_TOLERANCE:
        raise refusal(elements[0], f"the first laneSection starts at s={starts[0]:g}, not at 0")
    ends = [*starts[1:], length]
    return tuple(
        _parse_section(element, s, s_end, notes)
        for element, s, s_end in zip(elements, starts, ends, strict=True)
    )


def _parse_section(element: Element, s: float, s_end: float, notes: Notes) -> LaneSection:
    if s_end <= s:
        notes.add(Rule.ZERO_LENGTH, element, f"starts and ends at s={s:g}; its lanes have no place")
    groups = children(element)
    lanes: list[Lane] = []
    for side in ("left", "center", "right"):
        container = only(groups, side)
        if container is None:
            continue
        for child in container:
            if child.tag == "lane":
                lanes.append(_parse_lane(child, side, s, s_end, notes))
            elif child.tag != "userData":
                notes.skip(Rule.UNKNOWN, side, str(child.tag))
    if not any(lane.id == 0 for lane in lanes):
        notes.add(Rule.NO_CENTER, element, "there is no center lane")
        lanes.append(Lane(0, "none"))
    lanes.sort(key=lambda lane: -lane.id)
    lanes = _open_sole_lane(lanes)
    _check_ids(element, [lane.id for lane in lanes], notes)
    return LaneSection(
        s,
        s_end,
        {lane.id: lane for lane in lanes},
        single_side=_drawn_boolean(element, "singleSide", notes),
    )


def _open_sole_lane(lanes: list[Lane]) -> list[Lane]:
    """Make the only lane of a narrow road one for driving, as 1.8 has it: open both ways.

    Up to 1.7 such a lane has the type ``bidirectional``, as has that in the middle of a road on
    which both directions turn left.
    """
    sole = [n for n, lane in enumerate(lanes) if lane.type == "bidirectional"]
    if len(sole) != 1 or any(lane.type in DRIVABLE_TYPES for lane in lanes):
        return lanes
    opened = replace(lanes[sole[0]], type="driving", direction="both")
    return [opened if n == sole[0] else lane for n, lane in enumerate(lanes)]


def _drawn_boolean(element: Element, name: str, notes: Notes) -> bool:
    """A boolean that nothing depends on: another value counts as not given."""
    try:
        return boolean(element, name)
    except OpenDriveError as error:
        notes.add(Rule.PAINT, element, f"{error.problem}; it counts as not given")
        return False


def _check_ids(element: Element, ids: list[int], notes: Notes) -> None:
    """Check lane ids, given in descending order."""
    if len(set(ids)) != len(ids):
        twice = next(a for a, b in itertools.pairwise(ids) if a == b)
        raise refusal(element, f"there are two lanes with the id {twice}")
    if ids[0] - ids[-1] + 1 != len(ids):
        shown = ", ".join(map(str, ids[:20]))
        notes.add(Rule.LANE_NUMBERS, element, f"lane ids leave numbers out: {shown}")


_SIDES: Final = {"left": 1, "center": 0, "right": -1}


def _parse_lane(element: Element, side: str, s0: float, s_end: float, notes: Notes) -> Lane:
    lane_id = integer(element, "id", limit=MAX_LANE_ID)
    if (lane_id > 0) - (lane_id < 0) != _SIDES[side]:
        if not lane_id or side == "center":
            problem = f"lane {lane_id} is in <{side}>: whether it is the centre line is not clear"
            raise refusal(element, problem)
        other = "left" if lane_id > 0 else "right"
        detail = f"lane {lane_id} is in <{side}>; by the sign of its id it lies on the {other}"
        notes.add(Rule.LANE_SIDE, element, detail)
    groups = children(element)
    if not READ.issuperset(groups):
        for tag, count in unread(groups, READ).items():
            notes.skip(Rule.IGNORED if tag in IGNORED else Rule.UNKNOWN, "lane", tag, count)
    predecessors, successors = _lane_links(only(groups, "link"), notes)
    for records in (groups.get("width"), groups.get("border")):
        _start_at_section(records[0] if records else None, notes)
    widths = cubics(groups.get("width", ()), "sOffset", s0, s_end, notes)
    borders = cubics(groups.get("border", ()), "sOffset", s0, s_end, notes)
    if lane_id:
        _check_widths(element, groups, notes)
    return Lane(
        id=lane_id,
        type=_parse_lane_type(element, notes),
        level=_drawn_boolean(element, "level", notes),
        widths=widths,
        borders=borders,
        heights=_parse_heights(groups.get("height", ()), s0, notes),
        road_marks=_road_marks(groups.get("roadMark", ()), s0, notes),
        speeds=_parse_speeds(groups.get("speed", ()), s0, notes),
        access=_parse_access(groups.get("access", ()), s0, notes),
        predecessors=predecessors,
        successors=successors,
        direction=element.get("direction", "standard"),
    )


_LANE_TYPES: Final = {
    name.lower(): name
    for name in (
        *("shoulder", "border", "driving", "stop", "none", "restricted", "parking", "median"),
        *("biking", "sidewalk", "walking", "curb", "exit", "entry", "onRamp", "offRamp", "rail"),
        *("connectingRamp", "slipLane", "tram", "shared", "bus", "taxi", "HOV", "bidirectional"),
        *("mwyEntry", "mwyExit", "special1", "special2", "special3", "roadWorks"),
    )
}
"""Lane types of 1.4 to 1.8 by their names in lower case."""


def _parse_lane_type(element: Element, notes: Notes) -> str:
    """Type of a lane in the standard's spelling; as it is where the standard does not know it."""
    text = element.get("type")
    if text is None:
        if element.get("id") != "0":
            notes.add(Rule.UNKNOWN_VALUE, element, "type is missing; no road user uses the lane")
        return "none"
    known = _LANE_TYPES.get(text.strip().lower())
    if known is None or known == text:
        return sys.intern(text)
    notes.add(Rule.SPELLING, element, f"type={shown(text)} is read as {known}")
    return known


def _start_at_section(record: Element | None, notes: Notes) -> None:
    """Have the first width or border of a lane begin where its section does, if it nearly does."""
    text = None if record is None else record.get("sOffset")
    if record is None or text in (None, "0", "0.0"):
        return
    try:
        s = number(record, "sOffset")
    except OpenDriveError:
        return  # that is said where it is read
    if start_at_zero(record, "sOffset", s, notes) != s:
        record.set("sOffset", "0")


def _check_widths(element: Element, groups: dict[str, list[Element]], notes: Notes) -> None:
    widths, borders = groups.get("width"), groups.get("border")
    first = widths or borders
    if not first:
        notes.add(Rule.NO_WIDTH, element, "there is neither width nor border; the width is 0")
        return
    if widths and borders:
        notes.add(Rule.WIDTH_AND_BORDER, element, "has width and border; border is not used")
    start = number(first[0], "sOffset")
    if start > S_TOLERANCE:
        raise refusal(first[0], f"starts at sOffset={start:g}: nothing is said before")
    for width in first:
        if abs(float(width.get("a", ""))) > MAX_WIDTH:
            raise refusal(width, f"a={width.get('a')} is beyond the limit of {MAX_WIDTH:g} m")


def _lane_links(link: Element | None, notes: Notes) -> tuple[tuple[int, ...], tuple[int, ...]]:
    linked: dict[str, list[int]] = {"predecessor": [], "successor": []}
    for element in () if link is None else link:
        if element.tag not in linked or element.get("layer", "") == _TEMPORARY:
            continue
        if not element.get("id", "").strip():
            notes.add(Rule.DANGLING_LINK, element, "it names no lane; the link is left out")
            continue
        try:
            linked[str(element.tag)].append(integer(element, "id", limit=MAX_LANE_ID))
        except OpenDriveError as error:
            notes.add(Rule.DANGLING_LINK, element, f"{error.problem}; the link is left out")
    return tuple(linked["predecessor"]), tuple(linked["successor"])


def _parse_s(element: Element, s0: float) -> float:
    return s0 + number_or(element, "sOffset", 0.0)


def _parse_heights(elements: Sequence[Element], s0: float, notes: Notes) -> tuple[LaneHeight, ...]:
    heights = []
    for element in elements:
        names = ("inner", "outer")
        if not any(element.get(name) for name in names):
            names = ("heightInner", "heightOuter")
            if not any(element.get(name) for name in names):
                names = ("inner", "outer")  # missing is what the message then says
            else:
                notes.add(Rule.OLD_NAMES, element, "heightInner, heightOuter are inner, outer")
        try:
            inner, outer = (number(element, name) for name in names)
            heights.append((element, LaneHeight(_parse_s(element, s0), inner, outer)))
        except OpenDriveError as error:
            notes.add(Rule.PAINT, element, f"{error.problem}; the height is left out")
    return _sort_records(heights, notes)


def _parse_speeds(elements: Sequence[Element], s0: float, notes: Notes) -> tuple[LaneSpeed, ...]:
    speeds: list[tuple[Element, LaneSpeed]] = []
    for element in elements:
        value = speed(element, notes)
        if value is None:
            continue
        try:
            speeds.append((element, LaneSpeed(_parse_s(element, s0), value)))
        except OpenDriveError as error:
            notes.add(Rule.SPEED, element, f"{error.problem}; no speed is given")
    return _sort_records(speeds, notes)


_ACCESS_RULES: Final[dict[str | None, str]] = {
    None: "",
    "": "",
    "allow": "allow",
    "deny": "deny",
}


def _parse_access(elements: Sequence[Element], s0: float, notes: Notes) -> tuple[LaneAccess, ...]:
    """One record per restriction: an attribute up to 1.7, elements below from 1.8 on."""
    accesses = []
    for element in elements:
        rule = spelt_choice(element, "rule", _ACCESS_RULES, notes, otherwise="")
        below = [str(child.get("type", "")) for child in element if child.tag == "restriction"]
        given = below or [str(element.get("restriction", ""))]
        names = [name for text in given for name in _spell_restrictions(text, element, notes)]
        if not names:
            notes.add(
                Rule.ACCESS_LEFT_OUT, element, "it names no road user; the access is left out"
            )
        try:
            s = _parse_s(element, s0)
        except OpenDriveError as error:
            detail = f"{error.problem}; the access is left out"
            notes.add(Rule.ACCESS_LEFT_OUT, element, detail)
            continue
        accesses += [(element, LaneAccess(s, rule, name)) for name in names]
    return _sort_records(accesses, notes)


_RESTRICTIONS: Final = {
    name.lower(): name
    for name in (
        *("simulator", "autonomousTraffic", "pedestrian", "passengerCar", "bus", "delivery"),
        *("emergency", "taxi", "throughTraffic", "truck", "trucks", "bicycle", "motorcycle"),
        *("HOV", "none"),
    )
}
"""Road users of ``<access>`` by their names in lower case (``e_accessRestrictionType``)."""


def _spell_restrictions(text: str, element: Element, notes: Notes) -> list[str]:
    """The road users that a restriction names, in the standard's spelling where they are known."""
    if text in _RESTRICTIONS.values():
        return [text]
    whole = _RESTRICTIONS.get(re.sub(r"[\s_-]+", "", text.lower()))
    parts = [part for part in re.split(r"[\s,;|]+", text) if part]
    known = [_RESTRICTIONS.get(part.lower()) for part in parts]
    names = [whole] if whole else [name for name in known if name]
    if not whole and len(names) < len(parts):
        return [text.strip()]
    if names:
        detail = f"restriction={shown(text)} is read as {', '.join(names)}"
        notes.add(Rule.SPELLING, element, detail)
    return names


def _road_marks(elements: Sequence[Element], s0: float, notes: Notes) -> tuple[RoadMark, ...]:
    intern = sys.intern
    marks: list[RoadMark] = []
    placed: list[Element] = []
    for element in elements:
        get = element.get
        lane_change = spelt_choice(element, "laneChange", _LANE_CHANGES, notes, otherwise="both")
        try:
            s = _parse_s(element, s0)
        except OpenDriveError as error:
            notes.add(Rule.PAINT, element, f"{error.problem}; the mark is left out")
            continue
        kind = get("type")
        if not kind:
            notes.add(Rule.PAINT, element, "attribute type is missing or empty; nothing is painted")
        marks.append(
            RoadMark(
                s,
                intern(kind or "none"),
                intern(get("color", "standard")),
                intern(get("weight", "standard")),
                _painted_width(element, notes),
                lane_change,
            )
        )
        placed.append(element)
    return _sort_records(list(zip(placed, marks, strict=True)), notes)


def _painted_width(element: Element, notes: Notes) -> float:
    """Width of a mark, metres; 0, which stands for the usual one, if it is no number."""
    try:
        return number_or(element, "width", 0.0)
    except OpenDriveError as error:
        notes.add(Rule.PAINT, element, f"{error.problem}; the mark has the usual width")
        return 0.0


_start = attrgetter("s")


def _sort_records(found: Sequence[tuple[Element, R]], notes: Notes) -> tuple[R, ...]:
    """Records with the elements that they are from, in ascending order of s."""
    for (_, before), (element, record) in itertools.pairwise(found):
        if record.s < before.s:
            detail = f"is below that of the {element.tag} before; they are put in order"
            notes.add(Rule.MARK_ORDER, element, f"sOffset={element.get('sOffset')} {detail}")
            break
    # Stable: of two at the same s the later one holds.
    return tuple(sorted((record for _, record in found), key=_start))
