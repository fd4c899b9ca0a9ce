"""A motorway: on-ramp, weaving stretch, off-ramp, and an acceleration lane that ends."""

from __future__ import annotations

import math
from dataclasses import replace

from scenariogeneration import xodr

from tools.make_maps.builder import Builder
from tools.make_maps.parts import End, LaneSpec, Pose, Profile, RoadRecord

WIDTH = 3.75
LANES = (
    LaneSpec("driving", WIDTH, "broken", "both", key="1"),
    LaneSpec("driving", WIDTH, "broken", "both", key="2"),
    LaneSpec("driving", WIDTH, "solid", "none", key="3"),
)
SHOULDER = LaneSpec("shoulder", 2.5, key="shoulder")
VERGE = (LaneSpec("shoulder", 1.0, key="verge"),)
EDGE = ((0.0, "solid", "none"),)
MAIN = Profile((*LANES, SHOULDER), VERGE, EDGE)
OPEN = replace(LANES[2], mark="broken", change="both")
AUXILIARY = LaneSpec("driving", WIDTH, "solid", "none", key="4")
WEAVE = Profile((*LANES[:2], OPEN, AUXILIARY, SHOULDER), VERGE, EDGE)
ENTRY = replace(AUXILIARY, kind="entry")
MERGE = Profile((*LANES[:2], OPEN, ENTRY, SHOULDER), VERGE, EDGE)
TAPER = Profile((*LANES[:2], OPEN, replace(ENTRY, width_end=0.0), SHOULDER), VERGE, EDGE)
RAMP = Profile((LaneSpec("driving", WIDTH, "solid", "none"), LaneSpec("shoulder", 1.5)), (), EDGE)
LINK = 60.0
"""Metres that a junction on the motorway takes."""


def motorway_weave(name: str) -> Builder:
    """Two carriageways; the second is the first turned around."""
    builder = Builder(name)
    _carriageway(builder, Pose(0.0, -6.0, 0.0))
    _carriageway(builder, Pose(1500.0, 6.0, math.pi))
    return builder


def _carriageway(builder: Builder, start: Pose) -> None:
    through = [(0, 0), (1, 1), (2, 2)]
    first = _main(builder, start, 300.0, MAIN)
    weave = _main(builder, first.end.ahead(LINK), 360.0, WEAVE, limit=100.0)
    second = _main(builder, weave.end.ahead(LINK), 200.0, MAIN)
    merge = _main(
        builder,
        second.end.ahead(LINK),
        400.0,
        MERGE,
        sections=[(200.0, TAPER), (290.0, MAIN)],
    )
    on = _ramp(builder, weave.start, joining=True)
    off = _ramp(builder, weave.end, joining=False)
    late = _ramp(builder, merge.start, joining=True)
    for before, after, extra in (
        (first, weave, (End(on, "end"), End(weave, "start"), [(0, 3)])),
        (weave, second, (End(weave, "end"), End(off, "start"), [(3, 0)])),
        (second, merge, (End(late, "end"), End(merge, "start"), [(0, 3)])),
    ):
        ramp = extra[0] if extra[0].record not in (before, after) else extra[1]
        junction = builder.new_junction([End(before, "end"), End(after, "start"), ramp])
        builder.connect(
            junction, End(before, "end"), End(after, "start"), through, speed=100.0, kind="motorway"
        )
        builder.connect(junction, *extra, speed=80.0, kind="motorway")


def _main(
    builder: Builder,
    start: Pose,
    length: float,
    profile: Profile,
    *,
    limit: float = 130.0,
    sections: list[tuple[float, Profile]] | None = None,
) -> RoadRecord:
    return builder.road(
        start,
        [xodr.Line(length)],
        profile,
        speed=limit,
        kind="motorway",
        sections=sections or (),
    )


def _ramp(builder: Builder, at: Pose, *, joining: bool) -> RoadRecord:
    """One-lane ramp that starts or ends beside the fourth lane at ``at``."""
    along = 1.0 if joining else -1.0
    mouth = at.ahead(-along * LINK).left(-3 * WIDTH - 5.0)
    mouth = Pose(mouth.x, mouth.y, at.h + along * math.radians(5.0))
    if joining:
        bend = [xodr.Arc(1 / 150.0, length=120.0), xodr.Line(80.0)]
        start = _before(mouth, 80.0, 150.0, 120.0)
        return builder.road(start, bend, RAMP, speed=80.0, kind="motorway")
    bend = [xodr.Line(80.0), xodr.Arc(-1 / 150.0, length=120.0)]
    return builder.road(mouth, bend, RAMP, speed=80.0, kind="motorway")


def _before(end: Pose, line: float, radius: float, arc: float) -> Pose:
    """Start of a left bend followed by a straight that leads to ``end``."""
    bend_end = end.ahead(-line)
    centre = bend_end.left(radius)
    h = end.h - arc / radius
    return Pose(centre.x + radius * math.sin(h), centre.y - radius * math.cos(h), h)
