"""The maps, one function each."""

from __future__ import annotations

import math
from collections.abc import Callable

from scenariogeneration import xodr

from tools.make_maps.builder import Builder
from tools.make_maps.motorway import motorway_weave
from tools.make_maps.parts import End, Pose, Profile, street
from tools.make_maps.roundabout import roundabout_arms
from tools.make_maps.rural import rural_hills

ORIGIN = Pose(0.0, 0.0, 0.0)
EAST, NORTH, WEST, SOUTH = (k * math.pi / 2 for k in range(4))


def signal_crossing(name: str) -> Builder:
    """Four arms, lights, crosswalks, bicycle lanes; left-turn lanes from east and west."""
    builder = Builder(name)
    main, side = street(1, 0, bikes=True), street(bikes=True)
    arms = [
        _arm(builder, heading, main if heading in (EAST, WEST) else side, reach=22.0, length=110.0)
        for heading in (EAST, NORTH, WEST, SOUTH)
    ]
    builder.crossing(arms, control="lights")
    return builder


def t_junction_signs(name: str) -> Builder:
    """Main road west-east, a side road from the south with a stop sign, a yield sign further on."""
    builder = Builder(name)
    east = _arm(builder, EAST, street(), reach=15.0, length=60.0)
    west = _arm(builder, WEST, street(), reach=15.0, length=120.0)
    south = _arm(builder, SOUTH, street(), reach=15.0, length=90.0, speed=30.0)
    builder.crossing([east, south, west], control="stop", major=(0, 2))
    far = _arm(builder, EAST, street(), reach=15.0, length=100.0, centre=Pose(90.0, 0.0, 0.0))
    north = _arm(builder, NORTH, street(), reach=15.0, length=90.0, centre=Pose(90.0, 0.0, 0.0))
    near = End(east.record, "start")
    builder.crossing([far, north, near], control="yield", major=(0, 2))
    return builder


def roundabout(name: str) -> Builder:
    """Four arms with crosswalks, yield signs, one lane around."""
    builder = Builder(name)
    arms = [
        _arm(builder, heading, street(), reach=26.0, length=100.0)
        for heading in (EAST, NORTH, WEST, SOUTH)
    ]
    roundabout_arms(builder, Pose(0.0, 0.0, 0.0), dict(zip(range(4), arms, strict=True)))
    return builder


def left_hand_crossing(name: str) -> Builder:
    """Made for right-hand traffic and mirrored when written."""
    builder = Builder(name)
    arms = [
        _arm(builder, heading, street(), reach=16.0, length=100.0)
        for heading in (EAST, NORTH, WEST, SOUTH)
    ]
    builder.crossing(arms, control="lights")
    return builder


def town_5x5(name: str) -> Builder:
    """Five by five blocks: lights on the avenue, a roundabout, stop and yield signs, priority."""
    return _town(name, columns=6, rows=6, avenue=2, roundabouts={(4, 4), (1, 3)})


def large_town(name: str) -> Builder:
    """Twelve by twelve streets: 140 junctions."""
    return _town(name, columns=12, rows=12, avenue=5, roundabouts={(2, 2), (9, 3), (8, 8)})


def _arm(
    builder: Builder,
    heading: float,
    profile: Profile,
    *,
    reach: float,
    length: float,
    centre: Pose = ORIGIN,
    speed: float = 50.0,
) -> End:
    """Straight road that ends ``reach`` metres from ``centre``, coming from ``heading``."""
    far = Pose(centre.x, centre.y, heading).ahead(reach + length)
    start = far.back()
    record = builder.road(start, [xodr.Line(length)], profile, speed=speed)
    return End(record, "end")


PITCH = 100.0
"""Metres between streets of a town."""
REACH = 15.0
"""Metres from the middle of a junction to the end of its arms."""
WIDE_REACH = 19.0
"""The same along the avenue, which has two lanes each way."""
ROUND_REACH = 26.0


def _town(
    name: str, *, columns: int, rows: int, avenue: int, roundabouts: set[tuple[int, int]]
) -> Builder:
    """Grid of streets; row ``avenue`` has two lanes each way; the four corners are bends."""
    builder = Builder(name)
    arms: dict[tuple[int, int], dict[int, End]] = {
        (i, j): {} for i in range(columns) for j in range(rows)
    }
    corners = {(0, 0), (columns - 1, 0), (0, rows - 1), (columns - 1, rows - 1)}
    wide = street(1, width=3.25)

    def reach(node: tuple[int, int]) -> float:
        if node in roundabouts:
            return ROUND_REACH
        return WIDE_REACH if node[1] == avenue else REACH

    for node in sorted(arms):
        for direction, step in ((0, (1, 0)), (1, (0, 1))):
            other = (node[0] + step[0], node[1] + step[1])
            if other not in arms or node in corners or other in corners:
                continue
            profile = wide if direction == 0 and node[1] == avenue else street()
            start = Pose(node[0] * PITCH, node[1] * PITCH, direction * math.pi / 2)
            length = PITCH - reach(node) - reach(other)
            record = builder.road(
                start.ahead(reach(node)),
                [xodr.Line(length)],
                profile,
                speed=50.0 if profile is wide else 30.0 if direction else 50.0,
            )
            arms[node][direction] = End(record, "start")
            arms[other][direction + 2] = End(record, "end")
    for corner in sorted(corners):
        _bend(builder, arms, corner, columns, rows, reach)
    for node in sorted(arms):
        if node not in corners:
            _town_node(builder, node, arms[node], avenue, roundabouts)
    return builder


def _bend(
    builder: Builder,
    arms: dict[tuple[int, int], dict[int, End]],
    corner: tuple[int, int],
    columns: int,
    rows: int,
    reach: Callable[[tuple[int, int]], float],
) -> None:
    """Road around a corner of the town, from the junction beside it to the one above or below."""
    i, j = corner
    beside = (1, j) if i == 0 else (columns - 2, j)
    above = (i, 1) if j == 0 else (i, rows - 2)
    towards_corner = WEST if i == 0 else EAST
    away = NORTH if j == 0 else SOUTH
    turn = math.remainder(away - towards_corner, 2.0 * math.pi)
    radius = 25.0
    start = Pose(beside[0] * PITCH, beside[1] * PITCH, towards_corner).ahead(reach(beside))
    geometries = [
        xodr.Line(PITCH - reach(beside) - radius),
        xodr.Arc(math.copysign(1.0 / radius, turn), length=radius * math.pi / 2),
        xodr.Line(PITCH - reach(above) - radius),
    ]
    record = builder.road(start, geometries, street(), speed=30.0)
    arms[beside][round(towards_corner / (math.pi / 2))] = End(record, "start")
    arms[above][(round(away / (math.pi / 2)) + 2) % 4] = End(record, "end")


def _town_node(
    builder: Builder,
    node: tuple[int, int],
    arms: dict[int, End],
    avenue: int,
    roundabouts: set[tuple[int, int]],
) -> None:
    if node in roundabouts:
        roundabout_arms(builder, Pose(node[0] * PITCH, node[1] * PITCH, 0.0), arms)
        return
    directions = sorted(arms)
    ends = [arms[direction] for direction in directions]
    along = [k for k, direction in enumerate(directions) if direction in (0, 2)]
    if node[1] == avenue:
        builder.crossing(ends, control="lights", speed=30.0)
    elif len(ends) == 3:
        builder.crossing(ends, control="yield", major=_through(directions))
    elif node[0] % 2:
        builder.crossing(ends, control="stop", major=along)
    else:
        builder.crossing(ends, control="none")


def _through(directions: list[int]) -> tuple[int, ...]:
    """Positions of the two arms of a T that lie opposite each other."""
    return tuple(k for k, d in enumerate(directions) if (d + 2) % 4 in directions)


MAPS: dict[str, Callable[[str], Builder]] = {
    "signal_crossing": signal_crossing,
    "t_junction_signs": t_junction_signs,
    "roundabout": roundabout,
    "motorway_weave": motorway_weave,
    "rural_hills": rural_hills,
    "town_5x5": town_5x5,
    "left_hand_crossing": left_hand_crossing,
}
ON_DEMAND: dict[str, Callable[[str], Builder]] = {"large_town": large_town}
