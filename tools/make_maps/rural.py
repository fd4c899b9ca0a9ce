"""A country road over hills: spirals, arcs, paramPoly3, superelevation, no-passing lines."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scenariogeneration import xodr

from tools.make_maps import furniture
from tools.make_maps.builder import Builder
from tools.make_maps.crossing import crossing
from tools.make_maps.geometry import Geometry, Pose, length_of, shift, smooth
from tools.make_maps.parts import BROKEN, SOLID, End, LaneSpec, Mark, Profile, RoadRecord

if TYPE_CHECKING:
    from collections.abc import Sequence

SIDE = (
    LaneSpec("driving", 3.5, SOLID, key="car 0"),
    LaneSpec("shoulder", 1.0, key="shoulder"),
)
TRACK = Profile(
    (replace(SIDE[0], width=3.0), SIDE[1]), (replace(SIDE[0], width=3.0), SIDE[1]), BROKEN
)
LIMIT = 100
"""km/h where nothing else is said."""
NEAR_JUNCTION = 120.0
"""Metres before a junction without overtaking, at 70 km/h."""
SIGHT = 100.0
"""Metres before a bend without overtaking for those who come towards it."""
BANK = 0.05
"""Slope across the road in bends of up to 200 m radius, less in wider ones."""
POCKET = 3.25
"""Width of the left-turn lane."""
POCKET_LENGTH = 70.0
TAPER = 35.0
"""Metres over which the left-turn lane opens."""
SIGN_ASIDE = 7.0
"""Metres from the reference line to the signs, clear of the shoulder beside the left-turn lane."""
REACH = 16.0
"""Metres from the middle of a junction to the end of its arms."""


class Straight(NamedTuple):
    """Line of ``length`` metres."""

    length: float


class Bend(NamedTuple):
    """Spiral, arc, spiral; ``radius`` is positive for a bend to the left."""

    radius: float
    arc: float
    ease: float


class Shift(NamedTuple):
    """Move ``aside`` metres to the left over ``length`` metres, by a paramPoly3."""

    length: float
    aside: float


Part = Straight | Bend | Shift


@dataclass(frozen=True)
class Zone:
    """Stretch of a road with a limit; in bends with superelevation."""

    start: float
    end: float
    part: Part | None
    limit: int


def rural_hills(name: str) -> Builder:
    """Three roads of together 4.7 km, two side roads."""
    builder = Builder(name)
    west = _road(
        builder,
        Pose(0.0, 0.0, 0.35),
        (
            Straight(260.0),
            Bend(-230.0, 200.0, 70.0),
            Straight(120.0),
            Bend(170.0, 190.0, 60.0),
            Shift(240.0, 30.0),
            Bend(-320.0, 160.0, 80.0),
            Straight(180.0),
        ),
        heights=(20.0, 26.0, 34.0, 30.0, 18.0, 14.0, 22.0, 27.0, 25.0),
        junctions=(False, True),
    )
    middle = _road(
        builder,
        west.end.ahead(2 * REACH),
        (
            Straight(170.0),
            Bend(150.0, 210.0, 55.0),
            Shift(200.0, -24.0),
            Straight(90.0),
            Bend(-95.0, 190.0, 45.0),
            Bend(210.0, 170.0, 60.0),
            Straight(170.0),
        ),
        heights=(25.0, 33.0, 45.0, 52.0, 49.0, 40.0, 34.0, 36.0, 36.0),
        junctions=(True, True),
        pocket=True,
    )
    east = _road(
        builder,
        middle.end.ahead(2 * REACH),
        (
            Straight(190.0),
            Bend(-260.0, 260.0, 75.0),
            Shift(260.0, 36.0),
            Bend(190.0, 170.0, 60.0),
            Straight(240.0),
        ),
        heights=(36.0, 30.0, 19.0, 12.0, 15.0, 22.0, 20.0),
        junctions=(True, False),
    )
    _side_road(builder, west, middle, turn=-math.radians(80.0), control="stop")
    _side_road(builder, middle, east, turn=math.radians(95.0), control="yield")
    return builder


def _side_road(
    builder: Builder, before: RoadRecord, after: RoadRecord, *, turn: float, control: str
) -> None:
    """Narrow road that leaves to the side between two roads."""
    mouth = before.end.ahead(REACH).turned(turn).ahead(REACH)
    radius = math.copysign(180.0, -turn)
    geometries = [
        xodr.Line(60.0),
        xodr.Spiral(0.0, 1 / radius, length=40.0),
        xodr.Arc(1 / radius, length=90.0),
        xodr.Spiral(1 / radius, 0.0, length=40.0),
        xodr.Line(60.0),
    ]
    height = before.heights[1]
    track = builder.road(
        mouth,
        geometries,
        TRACK,
        name="Side road",
        speed=50.0,
        kind="rural",
        heights=(height, height + 4.0),
    )
    crossing(
        builder,
        [End(before, "end"), End(track, "start"), End(after, "start")],
        control=control,
        major=(0, 2),
        crosswalks=False,
        speed=50.0,
        kind="rural",
    )


def _road(
    builder: Builder,
    start: Pose,
    parts: Sequence[Part],
    *,
    heights: Sequence[float],
    junctions: tuple[bool, bool],
    pocket: bool = False,
) -> RoadRecord:
    """Add a road.

    Parameters
    ----------
    builder
        The map so far.
    start
        Pose of the road's start.
    parts
        What the reference line is made of.
    heights
        At equal distances along the road.
    junctions
        Whether the road starts, and ends, at a junction.
    pocket
        Whether a left-turn lane opens before the end.
    """
    made = [_geometries(part) for part in parts]
    ends = list(accumulate(sum(map(length_of, pieces)) for pieces in made))
    zones = [
        Zone(begin, end, part, _limit(part))
        for begin, end, part in zip([0.0, *ends], ends, parts, strict=False)
    ]
    plain = ends[-1] - (TAPER + POCKET_LENGTH if pocket else 0.0)
    centre = tuple(m for m in _centre_marks(zones, ends[-1], junctions) if m.offset < plain - 1.0)
    record = builder.road(
        start,
        [piece for pieces in made for piece in pieces],
        Profile(SIDE, SIDE, centre),
        name="Hill Road",
        speed=_limits(zones, junctions)[0][1],
        kind="rural",
        sections=_pocket(plain) if pocket else (),
    )
    record.heights = (heights[0], heights[-1])
    _heights(record, heights)
    _banks(record, zones)
    _speeds(builder, record, _limits(zones, junctions))
    return record


def _pocket(s: float) -> list[tuple[float, Profile]]:
    """Lane sections of a left-turn lane that opens at s.

    The lane offset moves the lanes left by half of the new lane's width: both sides widen alike.
    """
    opening = LaneSpec("driving", 0.0, BROKEN, width_end=POCKET, key="pocket")
    lane = replace(opening, width=POCKET, width_end=None)
    return [
        (s, Profile((opening, *SIDE), SIDE, SOLID, 0.0, POCKET / 2)),
        (s + TAPER, Profile((lane, *SIDE), SIDE, SOLID, POCKET / 2)),
    ]


def _geometries(part: Part) -> list[Geometry]:
    if isinstance(part, Straight):
        return [xodr.Line(part.length)]
    if isinstance(part, Shift):
        return [shift(part.length, part.aside)]
    k = 1.0 / part.radius
    return [
        xodr.Spiral(0.0, k, length=part.ease),
        xodr.Arc(k, length=part.arc),
        xodr.Spiral(k, 0.0, length=part.ease),
    ]


def _limit(part: Part) -> int:
    """Limit that keeps the lateral acceleration in a bend under about 2.5 m/s2."""
    if not isinstance(part, Bend):
        return LIMIT
    comfortable = math.sqrt(2.5 * abs(part.radius)) * 3.6
    return min(LIMIT, int(comfortable // 10 * 10))


def _limits(zones: Sequence[Zone], junctions: tuple[bool, bool]) -> list[tuple[float, int]]:
    """Limits from each s on, without repetitions."""
    length = zones[-1].end
    steps = sorted({0.0, *(zone.start for zone in zones), NEAR_JUNCTION, length - NEAR_JUNCTION})
    found: list[tuple[float, int]] = []
    for s in steps:
        limit = min(zone.limit for zone in zones if zone.start <= s < zone.end)
        near = (junctions[0] and s < NEAR_JUNCTION) or (
            junctions[1] and s >= length - NEAR_JUNCTION
        )
        limit = min(limit, 70) if near else limit
        if not found or found[-1][1] != limit:
            found.append((s, limit))
    return found


def _speeds(builder: Builder, record: RoadRecord, limits: Sequence[tuple[float, int]]) -> None:
    """Limits as road types and as signs, for both directions."""
    furniture.speed_sign(builder, record.road, 15.0, -SIGN_ASIDE, limits[0][1])
    furniture.speed_sign(builder, record.road, record.length - 15.0, SIGN_ASIDE, limits[-1][1])
    for (_, before), (s, limit) in pairwise(limits):
        record.road.add_type(xodr.RoadType.rural, s, speed=limit, speed_unit="km/h")
        furniture.speed_sign(builder, record.road, s, -SIGN_ASIDE, limit)
        furniture.speed_sign(builder, record.road, s, SIGN_ASIDE, before)


def _centre_marks(
    zones: Sequence[Zone], length: float, junctions: tuple[bool, bool]
) -> tuple[Mark, ...]:
    """Who may overtake where: nobody in bends, nobody towards a bend or a junction."""
    forward: list[tuple[float, float]] = []
    backward: list[tuple[float, float]] = []
    for zone in zones:
        if isinstance(zone.part, Bend):
            forward.append((zone.start - SIGHT, zone.end))
            backward.append((zone.start, zone.end + SIGHT))
    if junctions[0]:
        backward.append((0.0, NEAR_JUNCTION))
    if junctions[1]:
        forward.append((length - NEAR_JUNCTION, length))
    steps = sorted({0.0, *(max(0.0, s) for pair in (*forward, *backward) for s in pair)})
    marks: list[Mark] = []
    for s in steps:
        if s >= length - 1.0:
            break
        closed = tuple(
            any(begin <= s < end for begin, end in stretches) for stretches in (forward, backward)
        )
        # Of the centre line's two strokes the left one is named first; ids grow to the left.
        kind, change = {
            (False, False): ("broken", "both"),
            (True, False): ("broken_solid", "decrease"),
            (False, True): ("solid_broken", "increase"),
            (True, True): ("solid", "none"),
        }[closed[0], closed[1]]
        if not marks or marks[-1].kind != kind:
            marks.append(Mark(s, kind, change))
    return tuple(marks)


def _heights(record: RoadRecord, heights: Sequence[float]) -> None:
    """Hermite pieces through ``heights``, level at both ends, so that roads join."""
    s = np.linspace(0.0, record.length, len(heights))
    z = np.array(heights)
    slope = np.gradient(z, s)
    slope[[0, -1]] = 0.0
    for i, d in enumerate(np.diff(s)):
        rise = (z[i + 1] - z[i]) / d
        record.road.add_elevation(
            float(s[i]),
            float(z[i]),
            float(slope[i]),
            float((3 * rise - 2 * slope[i] - slope[i + 1]) / d),
            float((slope[i] + slope[i + 1] - 2 * rise) / d**2),
        )


def _banks(record: RoadRecord, zones: Sequence[Zone]) -> None:
    """Turn the cross-section over a bend's first spiral, back over the second."""
    level = smooth(0.0, 0.0, 1.0)
    banks = {0.0: level}
    for zone in zones:
        s, bend = zone.start, zone.part
        if not isinstance(bend, Bend):
            continue
        # Positive superelevation falls to the right: a left bend wants the other way.
        bank = -math.copysign(BANK * min(1.0, 200.0 / abs(bend.radius)), bend.radius)
        banks[s] = smooth(0.0, bank, bend.ease)
        banks[s + bend.ease] = (bank, 0.0, 0.0, 0.0)
        banks[s + bend.ease + bend.arc] = smooth(bank, 0.0, bend.ease)
        banks[zone.end] = level
    for s, coefficients in sorted(banks.items()):
        record.road.add_superelevation(s, *coefficients)
