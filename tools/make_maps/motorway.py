"""A motorway with two interchanges and a weaving stretch between them.

Each carriageway is a road of its own, one being the other turned around by 180 degrees. From west
to east: an exit lane and an off-ramp, a bridge, an on-ramp that becomes the fourth lane of the
weaving stretch, which leads to the next off-ramp, a bridge, an on-ramp and an entry lane that ends.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from scenariogeneration import xodr

from tools.make_maps import furniture
from tools.make_maps.builder import Builder
from tools.make_maps.crossing import crossing
from tools.make_maps.geometry import Pose, shift
from tools.make_maps.parts import BROKEN, SOLID, End, LaneSpec, Profile, RoadRecord

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

WIDTH = 3.75
LANES = tuple(LaneSpec("driving", WIDTH, BROKEN, key=f"car {i}") for i in range(3))
CLOSED = (*LANES[:2], replace(LANES[2], marks=SOLID))
"""The three through lanes where there is no fourth beside them."""
SHOULDER = LaneSpec("shoulder", 2.5, key="shoulder")
VERGE = (LaneSpec("shoulder", 1.0, key="verge"),)
MAIN = Profile((*CLOSED, SHOULDER), VERGE, SOLID)
FOURTH = LaneSpec("driving", WIDTH, SOLID, key="fourth")
WEAVE = Profile((*LANES, FOURTH, SHOULDER), VERGE, SOLID)
EXIT = Profile((*LANES, replace(FOURTH, kind="exit"), SHOULDER), VERGE, SOLID)
ENTRY = Profile((*LANES, replace(FOURTH, kind="entry"), SHOULDER), VERGE, SOLID)
RAMP = Profile((FOURTH, SHOULDER), (), SOLID)
COUNTRY = Profile(
    (LaneSpec("driving", 3.5, SOLID, key="car 0"), LaneSpec("shoulder", 1.0, key="shoulder")),
    (LaneSpec("driving", 3.5, SOLID, key="car 0"), LaneSpec("shoulder", 1.0, key="shoulder")),
    BROKEN,
)

LENGTH = 2400.0
FIRST, SECOND = 650.0, 1750.0
"""x of the two bridges."""
MEDIAN = 3.0
"""Metres from the middle of the motorway to each carriageway's inner border."""
ASIDE = 70.0
"""Metres from the middle of the motorway to the junctions at the end of the ramps."""
REACH = 18.0
"""Metres from the middle of those junctions to the end of their arms."""
RAMP_LENGTH = 280.0
LINK = 40.0
"""Metres that a junction on the motorway takes."""
SHOULDER_OPENS = 70.0
"""Metres over which the shoulder beside a ramp comes and goes."""
BRIDGE_HEIGHT = 6.5
SIGN_BESIDE = 0.8
"""Metres from the outer border of the shoulder to a speed sign."""


def motorway_weave(name: str) -> Builder:
    """Two carriageways, two bridges, four junctions where ramps meet the roads over the bridges."""
    builder = Builder(name)
    ramps: dict[tuple[int, int], tuple[End, End]] = {}
    for side in (-1, 1):
        for number, pair in enumerate(_carriageway(builder, side)):
            ramps[number if side < 0 else 1 - number, side] = pair
    for number, x in enumerate((FIRST, SECOND)):
        bridge = builder.road(
            Pose(x, REACH - ASIDE, math.pi / 2),
            [xodr.Line(2 * (ASIDE - REACH))],
            COUNTRY,
            name=f"Bridge {number + 1}",
            speed=70.0,
            kind="rural",
            heights=(BRIDGE_HEIGHT, BRIDGE_HEIGHT),
        )
        for side in (-1, 1):
            _interchange(
                builder, x, side, End(bridge, "start" if side < 0 else "end"), ramps[number, side]
            )
    return builder


def _frame(side: int, x: float, y: float) -> Pose:
    """Place on a carriageway: x along it, y to the left of the motorway's middle."""
    if side < 0:
        return Pose(x, y, 0.0)
    return Pose(LENGTH - x, -y, math.pi)


def _carriageway(builder: Builder, side: int) -> list[tuple[End, End]]:
    """Add a carriageway; off-ramp and on-ramp of its first and second interchange."""
    off = [x - REACH - RAMP_LENGTH for x in (FIRST, SECOND)]
    on = [x + REACH + RAMP_LENGTH for x in (FIRST, SECOND)]

    def main(
        start: float,
        end: float,
        profile: Profile,
        limit: int,
        sections: Sequence[tuple[float, Profile]] = (),
    ) -> RoadRecord:
        record = builder.road(
            _frame(side, start, -MEDIAN),
            [xodr.Line(end - start)],
            profile,
            name="Motorway west" if side > 0 else "Motorway east",
            speed=limit,
            kind="motorway",
            sections=sections,
        )
        # Where a ramp runs beside the road at first, the sign stands behind the place it leaves.
        between = profile.right[-1].width == 0.0
        edge = sum(lane.width for lane in (MAIN if between else profile).right)
        s = SHOULDER_OPENS + 30.0 if between else 10.0
        furniture.speed_sign(builder, record.road, s, -edge - SIGN_BESIDE, limit)
        return record

    opening = replace(
        EXIT, right=(*LANES, replace(EXIT.right[3], width=0.0, width_end=WIDTH), SHOULDER)
    )
    closing = replace(ENTRY, right=(*LANES, replace(ENTRY.right[3], width_end=0.0), SHOULDER))
    roads = [
        main(0.0, off[0] - LINK, MAIN, 130, [(110.0, opening), (180.0, EXIT)]),
        _between_ramps(main, off[0], on[0]),
        main(on[0] + LINK, off[1] - LINK, WEAVE, 100),
        _between_ramps(main, off[1], on[1]),
        main(on[1] + LINK, LENGTH, ENTRY, 130, [(140.0, closing), (220.0, MAIN)]),
    ]
    ramps = []
    for number in (0, 1):
        leaves = _ramp(builder, side, off[number], leaving=True)
        joins = _ramp(builder, side, on[number] - RAMP_LENGTH, leaving=False)
        before, middle, after = roads[2 * number : 2 * number + 3]
        _fork(builder, before, middle, End(leaves, "start"))
        _fork(builder, middle, after, End(joins, "end"))
        ramps.append((End(leaves, "end"), End(joins, "start")))
    return ramps


def _between_ramps(main: Callable[..., RoadRecord], start: float, end: float) -> RoadRecord:
    """Stretch from an off-ramp to an on-ramp, whose shoulder opens and closes beside them."""
    opening = replace(SHOULDER, width=0.0, width_end=SHOULDER.width)
    closing = replace(SHOULDER, width_end=0.0)
    length = end - start
    return main(
        start,
        end,
        replace(MAIN, right=(*CLOSED, opening)),
        130,
        [
            (SHOULDER_OPENS, MAIN),
            (length - SHOULDER_OPENS, replace(MAIN, right=(*CLOSED, closing))),
        ],
    )


def _ramp(builder: Builder, side: int, x: float, *, leaving: bool) -> RoadRecord:
    """One-lane ramp between the place of the fourth lane and the road over the bridge."""
    near, far = -MEDIAN - 3 * WIDTH, -ASIDE + WIDTH / 2
    start = _frame(side, x, near if leaving else far)
    record = builder.road(
        start,
        [shift(RAMP_LENGTH, far - near if leaving else near - far)],
        RAMP,
        name="Off-ramp" if leaving else "On-ramp",
        speed=60.0,
        kind="motorway",
        heights=(0.0, BRIDGE_HEIGHT) if leaving else (BRIDGE_HEIGHT, 0.0),
    )
    edge = sum(lane.width for lane in RAMP.right)
    furniture.speed_sign(builder, record.road, 60.0, -edge - SIGN_BESIDE, 60)
    return record


def _fork(builder: Builder, before: RoadRecord, after: RoadRecord, ramp: End) -> None:
    """Junction where a ramp leaves from, or comes into, the fourth lane."""
    start, end = End(before, "end"), End(after, "start")
    junction = builder.new_junction([start, end, ramp])
    through = [(i, i) for i in range(3)]
    builder.connect(junction, start, end, through, speed=130.0, kind="motorway")
    lane, shoulder = ([(3, 0), (4, 1)], [(0, 3), (1, 4)])
    if ramp.at_end:
        builder.connect(junction, ramp, end, shoulder, speed=80.0, kind="motorway")
        furniture.sign(builder, ramp, "205", "Yield", back=5.0)
        builder.priorities[junction.id] = [(before.id, ramp.record.id)]
    else:
        builder.connect(junction, start, ramp, lane, speed=80.0, kind="motorway")


def _interchange(
    builder: Builder, x: float, side: int, bridge: End, ramps: tuple[End, End]
) -> None:
    """Junction of off-ramp, on-ramp, the road over the bridge, and the road on from it."""
    outward = math.copysign(math.pi / 2, side)
    outer = builder.road(
        Pose(x, side * (ASIDE + REACH), outward),
        [xodr.Line(160.0)],
        COUNTRY,
        name="Country road",
        speed=70.0,
        kind="rural",
        heights=(BRIDGE_HEIGHT, 0.0),
    )
    crossing(
        builder,
        [bridge, ramps[0], End(outer, "start"), ramps[1]],
        control="stop",
        major=(0, 2),
        crosswalks=False,
        speed=50.0,
        kind="rural",
    )
