"""What stands or is painted at the arms of junctions."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from scenariogeneration import xodr

from tools.make_maps.parts import SOLID, End, car_lanes, carriageway, inner_border, road_mark

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from tools.make_maps.builder import Builder, Link
    from tools.make_maps.parts import LaneSpec

CROSSWALK = 2.5
"""Metres from the end of the road to the middle of a crosswalk."""
CROSSWALK_LENGTH = 3.0
"""Metres along the road."""
STOP_LINE = 5.0
"""Metres before the end of the road."""
STOP_LINE_ALONE = 1.0
"""The same where there is no crosswalk."""
CROSSWALK_REACH = 0.3
"""Metres that a crosswalk reaches onto the sidewalks."""
SOLID_BEFORE = 25.0
"""Metres before the end of the road where lines that may be crossed end."""
SIGN_BESIDE = 0.6
"""Metres from the carriageway's edge to the post of a sign or light."""

SIGNS = {
    "DE": {"stop": "206", "yield": "205", "priority": "306"},
    "FR": {"stop": "AB4", "yield": "AB3a", "priority": "AB6"},
    "SE": {"stop": "B2", "yield": "B1", "priority": "B4"},
}
"""Types of signs by country (docs/opendrive-coverage.md)."""


def crosswalk(builder: Builder, end: End, *, back: float = CROSSWALK) -> None:
    """Paint a crosswalk from sidewalk to sidewalk; its middle is ``back`` metres before the end."""
    low = end.offset - carriageway(_side(end, -1)) - CROSSWALK_REACH
    high = end.offset + carriageway(_side(end, 1)) + CROSSWALK_REACH
    made = xodr.Object(
        end.at(back),
        (low + high) / 2,
        xodr.ObjectType.crosswalk,
        id=str(builder.new_id("object")),
        name="Crosswalk",
        length=CROSSWALK_LENGTH,
        width=high - low,
        height=0.0,
    )
    u, v = CROSSWALK_LENGTH / 2, (high - low) / 2
    outline = xodr.Outline(closed=True)
    # CARLA expects the first corner once more at the end.
    for corner in ((-u, -v), (u, -v), (u, v), (-u, v), (-u, -v)):
        outline.add_corner(xodr.CornerLocal(*corner, 0.0, 0.0))
    made.add_outline(outline)
    end.record.road.add_object(made)


def stop_line(builder: Builder, end: End, *, back: float) -> None:
    """Paint a stop line across the lanes that arrive."""
    lanes, side = end.lanes(arriving=True), end.side(arriving=True)
    if not car_lanes(lanes):
        return
    width = carriageway(lanes)
    end.record.road.add_object(
        xodr.Object(
            end.at(back),
            end.offset + side * width / 2,
            xodr.ObjectType.roadMark,
            id=str(builder.new_id("object")),
            name="StopLine",
            orientation=end.orientation,
            length=0.4,
            width=width,
            height=0.0,
        )
    )


def sign(
    builder: Builder,
    end: End,
    kind: str,
    name: str,
    *,
    back: float = STOP_LINE,
    lanes: Sequence[int] = (),
    dynamic: bool = False,
    country: str = "DE",
) -> str:
    """Put up a sign, or with ``dynamic`` a light, for the lanes that arrive; returns its id.

    ``lanes`` are the positions of the lanes it is for, all lanes for cars if not given. A light for
    some of the inner lanes hangs above them, everything else stands on the right.
    """
    coming, side = end.lanes(arriving=True), end.side(arriving=True)
    cars = car_lanes(coming)
    chosen = sorted(lanes or cars)
    aside = carriageway(coming) + SIGN_BESIDE
    if chosen[-1] != cars[-1]:
        aside = inner_border(coming, chosen[0]) + coming[chosen[0]].width / 2
    number = str(builder.new_id("signal"))
    made = xodr.Signal(
        end.at(back),
        end.offset + side * aside,
        "OpenDRIVE" if dynamic else country,
        kind,
        "-1",
        id=number,
        name=name,
        dynamic=xodr.Dynamic.yes if dynamic else xodr.Dynamic.no,
        zOffset=3.0 if dynamic else 2.0,
        orientation=end.orientation,
        height=1.0 if dynamic else 0.6,
        width=0.4 if dynamic else 0.6,
    )
    ids = sorted(side * (i + 1) for i in chosen)
    made.add_validity(ids[0], ids[-1])
    end.record.road.add_signal(made)
    return number


def walk_light(builder: Builder, end: End, sign_of_side: int, *, back: float = CROSSWALK) -> str:
    """Put up a light for those who step off the sidewalk of one side; returns its id.

    ``back`` is where the middle of the crosswalk is.
    """
    lanes = _side(end, sign_of_side)
    lane = next(i for i, spec in enumerate(lanes) if spec.kind == "sidewalk")
    number = str(builder.new_id("signal"))
    made = xodr.Signal(
        end.at(back - CROSSWALK_LENGTH / 2),
        end.offset + sign_of_side * (carriageway(lanes) + SIGN_BESIDE),
        "OpenDRIVE",
        "1000002",
        "-1",
        id=number,
        name="WalkLight",
        dynamic=xodr.Dynamic.yes,
        zOffset=2.2,
        # As for the traffic that arrives: netconvert puts a light for both directions at both ends
        # of the road.
        orientation=end.orientation,
        height=0.8,
        width=0.3,
    )
    made.add_validity(sign_of_side * (lane + 1), sign_of_side * (lane + 1))
    end.record.road.add_signal(made)
    return number


def speed_sign(builder: Builder, road: xodr.Road, s: float, t: float, limit: int) -> None:
    """Put up a speed limit sign; one right of the reference line is for traffic along s."""
    made = xodr.Signal(
        s,
        t,
        "DE",
        "274",
        str(limit),
        id=str(builder.new_id("signal")),
        name=f"Speed_{limit}",
        value=float(limit),
        unit="km/h",
        zOffset=2.0,
        orientation=xodr.Orientation.positive if t < 0 else xodr.Orientation.negative,
        height=0.6,
        width=0.6,
    )
    road.add_signal(made)


def solid_lines(end: End) -> None:
    """Make the lines solid that traffic which arrives here could cross to change lanes."""
    section, length = end.section, end.section_length
    distance = min(SOLID_BEFORE, 0.4 * length)
    arriving = section.rightlanes if end.at_end else section.leftlanes
    for lane in (section.centerlane, *arriving):
        if not lane.roadmark or lane.roadmark[-1 if end.at_end else 0].laneChange in (
            None,
            xodr.LaneChange.none,
        ):
            continue
        if end.at_end:
            lane.add_roadmark(road_mark(SOLID[0]._replace(offset=length - distance)))
        else:
            lane.roadmark[0].soffset = distance
            lane.roadmark.insert(0, road_mark(SOLID[0]))


def lights(
    builder: Builder,
    junction: xodr.Junction,
    ends: Sequence[End],
    links: Sequence[Link],
    *,
    crosswalks: bool,
) -> None:
    """Put up lights and group them into controllers.

    Arms whose axes differ by less than 45 degrees get green together; lanes that only turn left
    have a light and a group of their own. Who crosses an arm walks while that arm's traffic waits.
    """
    groups: dict[tuple[bool, bool], list[str]] = {}
    for end in ends:
        own = [link for link in links if link.start == end]
        bend = math.remainder(2.0 * (end.approach.h - ends[0].approach.h), 2.0 * math.pi)
        along = abs(bend) < math.pi / 2
        coming = end.lanes(arriving=True)
        pocket = [i for i in car_lanes(coming) if coming[i].key == "pocket"]
        rest = [i for i in car_lanes(coming) if i not in pocket]
        for lanes in filter(None, (rest, pocket)):
            light = sign(builder, end, "1000001", "Light", lanes=lanes, dynamic=True)
            groups.setdefault((along, lanes is pocket), []).append(light)
            _refer(light, (link for link in own if set(link.lanes) & set(lanes)))
        if crosswalks:
            waits = groups.setdefault((not along, False), [])
            waits += [walk_light(builder, end, side) for side in (-1, 1)]
    numbers = []
    for sequence, (_, signals) in enumerate(sorted(groups.items(), reverse=True)):
        number = builder.new_id("controller")
        builder.controllers.append((number, f"junction {junction.id} group {sequence}", signals))
        numbers.append(number)
    builder.junction_controllers[junction.id] = numbers


def _refer(light: str, links: Iterable[Link]) -> None:
    for link in links:
        reference = xodr.SignalReference(0.0, 0.0)
        reference.add_validity(-1, -1)
        link.record.road.add_signal(reference)
        reference.id = light  # the library insists on a new id when it is added


def lights_between(builder: Builder, start: End, *, back: float) -> None:
    """Put up lights at a crosswalk of a plain road, ``back`` metres before the end ``start``."""
    other = End(start.record, "start" if start.at_end else "end")
    places = ((start, back), (other, start.record.length - back))
    before = STOP_LINE - CROSSWALK
    crosswalk(builder, start, back=back)
    cars = []
    for end, middle in places:
        stop_line(builder, end, back=middle + before)
        cars.append(sign(builder, end, "1000001", "Light", back=middle + before, dynamic=True))
    walkers = [walk_light(builder, start, side, back=back) for side in (-1, 1)]
    for name, signals in (("vehicles", cars), ("pedestrians", walkers)):
        number = builder.new_id("controller")
        builder.controllers.append((number, f"road {start.record.id} {name}", signals))


def signs(
    builder: Builder,
    junction: xodr.Junction,
    ends: Sequence[End],
    control: str,
    major: Sequence[int],
    *,
    back: float,
    country: str = "DE",
) -> None:
    """Put up stop or yield signs on the arms that wait, priority signs on the others."""
    types = SIGNS[country]
    pairs = []
    for number, end in enumerate(ends):
        if not car_lanes(end.lanes(arriving=True)):
            continue
        if number in major:
            sign(builder, end, types["priority"], "Priority", back=back, country=country)
        else:
            sign(builder, end, types[control], control.title(), back=back, country=country)
            pairs += [(ends[high].record.id, end.record.id) for high in major]
    builder.priorities[junction.id] = pairs


def _side(end: End, sign_of_side: int) -> Sequence[LaneSpec]:
    return end.lanes(arriving=end.side(arriving=True) == sign_of_side)
