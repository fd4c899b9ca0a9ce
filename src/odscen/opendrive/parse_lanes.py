"""``<lanes>``: sections, lanes and what hangs on them (section 11)."""

from __future__ import annotations

import itertools
import sys
from typing import TYPE_CHECKING, Final, TypeVar

from odscen.opendrive.parse_rules import (
    MAX_LANE_ID,
    MAX_ROAD_LENGTH,
    MAX_WIDTH,
    S_TOLERANCE,
    Notes,
    Rule,
)
from odscen.opendrive.parse_values import cubics, speed
from odscen.opendrive.parse_xml import (
    Element,
    boolean,
    children,
    choice,
    integer,
    number,
    number_or,
    only,
    refusal,
    required,
    unread,
)
from odscen.opendrive.road_model import (
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
R = TypeVar("R", LaneHeight, LaneSpeed, RoadMark)


def parse_sections(
    lanes: Element, groups: dict[str, list[Element]], length: float, notes: Notes
) -> tuple[LaneSection, ...]:
    """All lane sections of a road of ``length`` metres."""
    elements = groups.get("laneSection", [])
    if not elements:
        raise refusal(lanes, "there is no laneSection")
    starts: list[float] = []
    for element in elements:
        s = number(element, "s", limit=MAX_ROAD_LENGTH)
        if starts and s < starts[-1]:
            problem = f"s={s:g} is below the s={starts[-1]:g} of the section before"
            raise refusal(element, problem)
        if s > length:
            raise refusal(element, f"s={s:g} is beyond the road's length of {length:g}")
        starts.append(s)
    if abs(starts[0]) > S_TOLERANCE:
        raise refusal(elements[0], f"the first laneSection starts at s={starts[0]:g}, not at 0")
    ends = [*starts[1:], length]
    return tuple(
        _section(element, s, s_end, notes)
        for element, s, s_end in zip(elements, starts, ends, strict=True)
    )


def _section(element: Element, s: float, s_end: float, notes: Notes) -> LaneSection:
    if s_end <= s:
        notes.add(Rule.ZERO_LENGTH, element, f"starts and ends at s={s:g}; its lanes have no place")
    groups = children(element)
    found: list[Lane] = []
    for side in ("left", "center", "right"):
        container = only(groups, side)
        if container is None:
            continue
        for child in container:
            if child.tag == "lane":
                found.append(_lane(child, side, s, notes))
            elif child.tag != "userData":
                notes.skip(Rule.UNKNOWN, side, str(child.tag))
    if not any(lane.id == 0 for lane in found):
        notes.add(Rule.NO_CENTER, element, "there is no center lane")
        found.append(Lane(0, "none"))
    found.sort(key=lambda lane: -lane.id)
    _check_ids(element, [lane.id for lane in found], notes)
    return LaneSection(
        s,
        s_end,
        {lane.id: lane for lane in found},
        single_side=boolean(element, "singleSide"),
    )


def _check_ids(element: Element, ids: list[int], notes: Notes) -> None:
    """Check lane ids, given in descending order."""
    if len(set(ids)) != len(ids):
        twice = next(a for a, b in itertools.pairwise(ids) if a == b)
        raise refusal(element, f"there are two lanes with the id {twice}")
    if ids[0] - ids[-1] + 1 != len(ids):
        shown = ", ".join(map(str, ids[:20]))
        notes.add(Rule.LANE_NUMBERS, element, f"lane ids leave numbers out: {shown}")


_SIDES: Final = {"left": 1, "center": 0, "right": -1}


def _lane(element: Element, side: str, s0: float, notes: Notes) -> Lane:
    lane_id = integer(element, "id", limit=MAX_LANE_ID)
    if (lane_id > 0) - (lane_id < 0) != _SIDES[side]:
        raise refusal(element, f"lane {lane_id} is in <{side}>")
    groups = children(element)
    if not READ.issuperset(groups):
        for tag, count in unread(groups, READ).items():
            notes.skip(Rule.IGNORED if tag in IGNORED else Rule.UNKNOWN, "lane", tag, count)
    predecessors, successors = _lane_links(only(groups, "link"))
    widths = cubics(groups.get("width", ()), "sOffset", s0, notes)
    borders = cubics(groups.get("border", ()), "sOffset", s0, notes)
    if lane_id:
        _check_widths(element, groups, notes)
    return Lane(
        id=lane_id,
        type=sys.intern(element.get("type", "none")),
        level=boolean(element, "level"),
        widths=widths,
        borders=borders,
        heights=_heights(groups.get("height", ()), s0),
        road_marks=_road_marks(groups.get("roadMark", ()), s0),
        speeds=_speeds(groups.get("speed", ()), s0, notes),
        access=_access(groups.get("access", ()), s0),
        predecessors=predecessors,
        successors=successors,
        direction=element.get("direction", "standard"),
    )


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


def _lane_links(link: Element | None) -> tuple[tuple[int, ...], tuple[int, ...]]:
    if link is None:
        return (), ()
    predecessors: list[int] = []
    successors: list[int] = []
    for element in link:
        if element.tag == "predecessor":
            predecessors.append(integer(element, "id", limit=MAX_LANE_ID))
        elif element.tag == "successor":
            successors.append(integer(element, "id", limit=MAX_LANE_ID))
    return tuple(predecessors), tuple(successors)


def _s(element: Element, s0: float) -> float:
    return s0 + number_or(element, "sOffset", 0.0)


def _heights(elements: Sequence[Element], s0: float) -> tuple[LaneHeight, ...]:
    return _ordered(
        elements,
        tuple(
            LaneHeight(_s(element, s0), number(element, "inner"), number(element, "outer"))
            for element in elements
        ),
    )


def _speeds(elements: Sequence[Element], s0: float, notes: Notes) -> tuple[LaneSpeed, ...]:
    found = ((element, speed(element, notes)) for element in elements)
    return _ordered(
        elements,
        tuple(LaneSpeed(_s(element, s0), value) for element, value in found if value is not None),
    )


def _access(elements: Sequence[Element], s0: float) -> tuple[LaneAccess, ...]:
    """One record per restriction: an attribute up to 1.7, elements below from 1.8 on."""
    records = []
    for element in elements:
        rule = choice(element, "rule", {None: "allow", "allow": "allow", "deny": "deny"})
        below = [str(child.get("type", "")) for child in element if child.tag == "restriction"]
        names = below or [str(element.get("restriction", ""))]
        records += [LaneAccess(_s(element, s0), rule, name) for name in names]
    return tuple(records)


def _road_marks(elements: Sequence[Element], s0: float) -> tuple[RoadMark, ...]:
    intern = sys.intern
    marks: list[RoadMark] = []
    for element in elements:
        get = element.get
        lane_change = choice(element, "laneChange", _LANE_CHANGES)
        marks.append(
            RoadMark(
                _s(element, s0),
                intern(get("type") or required(element, "type")),
                intern(get("color", "standard")),
                intern(get("weight", "standard")),
                number_or(element, "width", 0.0),
                lane_change,
            )
        )
    return _ordered(elements, tuple(marks))


def _ordered(elements: Sequence[Element], records: tuple[R, ...]) -> tuple[R, ...]:
    for i in range(1, len(records)):
        if records[i].s < records[i - 1].s:
            problem = f"sOffset={records[i].s:g} is below that of the record before"
            raise refusal(elements[min(i, len(elements) - 1)], problem)
    return records
