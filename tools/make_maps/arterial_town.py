"""Towns of arterials: wide fast roads with lights, left-turn lanes, ramps, and minor streets.

``arterial_town_07`` is the town of seed 7; the same name gives the same map. What is drawn: the
grid, two to five lanes each way and 60 to 105 km/h on arterials, one lane or two and 30 to 50 km/h
on minor streets, with or without left-turn lanes, sidewalks, and ramps that join and leave an
arterial between junctions, and who goes first where minor streets meet each other or an arterial.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from scenariogeneration import xodr

from tools.make_maps.builder import Builder
from tools.make_maps.crossing import crossing
from tools.make_maps.parts import BROKEN, SOLID, End, LaneSpec, Profile, RoadRecord, street
from tools.make_maps.town_grid import EAST, NORTH, SOUTH, WEST, Node, TownGrid, draw_offsets

if TYPE_CHECKING:
    from tools.make_maps.geometry import Geometry, Pose

COUNT = 50
"""Towns that have a name."""
HELD_BACK = range(30, 50)
"""Seeds on which nothing was chosen: ``docs/capacity.md`` measures on them."""

POCKET = 3.25
POCKET_LENGTH, TAPER = 60.0, 30.0
"""Metres of a left-turn lane, and over which it opens."""
RAMP_LENGTH, LINK = 160.0, 50.0
"""Metres of a ramp, and of the junction where it joins or leaves."""
LEAST_WITH_RAMP = 260.0
"""Metres of road between two junctions that has room for a ramp."""
STUB = 150.0
"""Metres of the roads that lead out of town."""


@dataclass(frozen=True)
class ArterialGrid(TownGrid):
    """Layout of a town.

    Attributes
    ----------
    pockets
        Whether junctions have left-turn lanes: of each column, then of each row.
    walks
        Whether roads have sidewalks and crosswalks; where not, there are ramps.
    """

    pockets: tuple[bool, ...]
    walks: bool

    def is_arterial(self, line: int) -> bool:
        """Whether a road is one of the fast and wide ones."""
        return self.speeds[line] >= 60

    def room(self, node: Node) -> float:
        """Metres from the middle of a junction to the end of its arms."""
        return 14.0 + 3.6 * max(
            self.lanes[line] + self.pockets[line]
            for line in (self.line(node, EAST), self.line(node, NORTH))
        )


def arterial_town(name: str) -> Builder:
    """Town whose seed is the number at the end of its name."""
    rng = random.Random(f"arterial town {int(name.rpartition('_')[2])}")
    grid = _draw_grid(rng)
    builder = Builder(name)
    arms: dict[Node, dict[int, End]] = {node: {} for node in grid.nodes()}
    for node, other, direction in grid.roads():
        _add_road(builder, grid, arms, node, other, direction, rng)
    for node, own in arms.items():
        _add_stubs(builder, grid, arms, node)
        _add_junction(builder, grid, node, own, rng)
    return builder


def arterial_crossing(name: str) -> Builder:
    """One crossing with lights of a road of three lanes each way, 80 km/h, and one of two, 50."""
    grid = ArterialGrid((0.0,), (0.0,), (2, 3), (50, 80), (True, True), walks=False)
    builder = Builder(name)
    ends = []
    for direction in (EAST, NORTH, WEST, SOUTH):
        here = grid.place((0, 0)).turned(direction * math.pi / 2).ahead(grid.room((0, 0)))
        line = grid.line((0, 0), direction)
        record = _straight(builder, grid, line, here, 3.0 * STUB, start=True, end=False)
        ends.append(End(record, "start"))
    crossing(builder, ends, control="lights", crosswalks=False, speed=50.0)
    return builder


def _draw_grid(rng: random.Random) -> ArterialGrid:
    columns, rows = rng.randint(2, 4), rng.randint(2, 3)
    long = rng.choice((200.0, 300.0, 420.0))
    town_pockets = rng.random() < 0.6
    lanes, speeds, pockets = [], [], []
    for number in range(columns + rows):
        # One road each way is an arterial in any town.
        if number in (0, columns) or rng.random() < 0.5:
            lanes.append(rng.choice((2, 3, 3, 4, 5)))
            speeds.append(rng.choice((60, 70, 80, 90, 105)))
            pockets.append(town_pockets and rng.random() < 0.8)
        else:
            lanes.append(rng.choice((1, 1, 2)))
            speeds.append(rng.choice((30, 40, 50, 50)))
            pockets.append(town_pockets and rng.random() < 0.3)
    return ArterialGrid(
        draw_offsets(rng, columns, long),
        draw_offsets(rng, rows, long),
        tuple(lanes),
        tuple(speeds),
        tuple(pockets),
        rng.random() < 0.5,
    )


def _cross_section(grid: ArterialGrid, line: int) -> Profile:
    """Profile between two junctions."""
    full = street(grid.lanes[line])
    if grid.walks:
        return full
    side = tuple(lane for lane in full.right if lane.kind != "sidewalk")
    return Profile(side, side, full.centre)


def _with_pocket(profile: Profile, side: int, first: float, last: float) -> Profile:
    """Profile with a left-turn lane of a side, so wide where its section starts and ends.

    The reference line is half a lane beside the middle of what is then there, so that lanes of
    opposite arms face each other.
    """
    pocket = LaneSpec("driving", first, BROKEN, last, key="pocket")
    lanes = (pocket, *profile.lanes(side))
    return replace(
        profile,
        left=lanes if side > 0 else profile.left,
        right=profile.right if side > 0 else lanes,
        centre=SOLID,
        offset=-side * first / 2.0,
        offset_end=-side * last / 2.0,
    )


def _sections(
    grid: ArterialGrid, line: int, length: float, *, start: bool, end: bool
) -> list[tuple[float, Profile]]:
    """Lane sections of a road, with left-turn lanes before junctions at its start and end."""
    plain = _cross_section(grid, line)
    room = POCKET_LENGTH + TAPER
    if not grid.pockets[line] or length < room * (start + end) + 20.0:
        return [(0.0, plain)]
    sections = []
    if start:
        sections += [
            (0.0, _with_pocket(plain, 1, POCKET, POCKET)),
            (POCKET_LENGTH, _with_pocket(plain, 1, POCKET, 0.0)),
        ]
    sections.append((room if start else 0.0, plain))
    if end:
        sections += [
            (length - room, _with_pocket(plain, -1, 0.0, POCKET)),
            (length - POCKET_LENGTH, _with_pocket(plain, -1, POCKET, POCKET)),
        ]
    return sections


def _straight(
    builder: Builder, grid: ArterialGrid, line: int, here: Pose, length: float, *, start: bool,
    end: bool,
) -> RoadRecord:  # fmt: skip
    (_, first), *others = _sections(grid, line, length, start=start, end=end)
    geometries: list[Geometry] = [xodr.Line(length)]
    return builder.road(
        here,
        geometries,
        first,
        speed=float(grid.speeds[line]),
        name=f"Road {line + 1}",
        sections=others,
    )


def _add_road(
    builder: Builder,
    grid: ArterialGrid,
    arms: dict[Node, dict[int, End]],
    node: Node,
    other: Node,
    direction: int,
    rng: random.Random,
) -> None:
    """Add the road from ``node`` to its neighbour in the east or north, perhaps with a ramp."""
    here, there = grid.place(node), grid.place(other)
    length = math.hypot(there.x - here.x, there.y - here.y) - grid.room(node) - grid.room(other)
    line = grid.line(node, direction)
    begin = here.turned(direction * math.pi / 2).ahead(grid.room(node))
    if grid.walks or not grid.is_arterial(line) or length < LEAST_WITH_RAMP:
        record = _straight(builder, grid, line, begin, length, start=True, end=True)
        arms[node][direction] = End(record, "start")
        arms[other][direction + 2] = End(record, "end")
        return
    half = (length - LINK) / 2.0
    before = _straight(builder, grid, line, begin, half, start=True, end=False)
    after = _straight(builder, grid, line, begin.ahead(half + LINK), half, start=False, end=True)
    arms[node][direction] = End(before, "start")
    arms[other][direction + 2] = End(after, "end")
    _add_ramp(builder, grid, line, (before, after), joins=rng.random() < 0.6)


def _add_ramp(
    builder: Builder,
    grid: ArterialGrid,
    line: int,
    roads: tuple[RoadRecord, RoadRecord],
    *,
    joins: bool,
) -> None:
    """Junction in the middle of a road, where a ramp joins or leaves its outermost lane."""
    before, after = End(roads[0], "end"), End(roads[1], "start")
    lanes = grid.lanes[line]
    aside = 3.25 * lanes + 3.0
    angle = math.radians(12.0)
    profile = Profile((LaneSpec("driving", 3.5, SOLID, key="car 0"),), (), SOLID)
    if joins:
        mouth = roads[0].end.left(-aside).turned(angle)
        start = mouth.ahead(-RAMP_LENGTH)
    else:
        start = roads[1].start.left(-aside).turned(-angle)
    ramp = builder.road(
        start,
        [xodr.Line(RAMP_LENGTH)],
        profile,
        speed=60.0,
        name="On-ramp" if joins else "Off-ramp",
    )
    end = End(ramp, "end" if joins else "start")
    junction = builder.new_junction([before, after, end])
    through = [(lane, lane) for lane in range(lanes)]
    speed = float(grid.speeds[line])
    builder.connect(junction, before, after, through, speed=speed)
    builder.connect(junction, after, before, through, speed=speed)
    if joins:
        builder.connect(junction, end, after, [(0, lanes - 1)], speed=60.0)
    else:
        builder.connect(junction, before, end, [(lanes - 1, 0)], speed=60.0)


def _add_stubs(
    builder: Builder, grid: ArterialGrid, arms: dict[Node, dict[int, End]], node: Node
) -> None:
    """Roads out of town: of arterials, and where a corner needs a third arm."""
    outwards = grid.outwards(node)
    outwards.sort(key=lambda direction: -grid.speeds[grid.line(node, direction)])
    for direction in outwards:
        line = grid.line(node, direction)
        if not grid.is_arterial(line) and len(arms[node]) >= 3:
            continue
        here = grid.place(node).turned(direction * math.pi / 2).ahead(grid.room(node))
        record = _straight(builder, grid, line, here, STUB, start=True, end=False)
        arms[node][direction] = End(record, "start")


def _add_junction(
    builder: Builder, grid: ArterialGrid, node: Node, arms: dict[int, End], rng: random.Random
) -> None:
    directions = sorted(arms)
    ends = [arms[direction] for direction in directions]
    lines = {grid.line(node, direction) for direction in directions}
    arterials = [line for line in lines if grid.is_arterial(line)]
    control = rng.choice(
        {0: ("none", "yield", "lights"), 1: ("lights", "lights", "none", "stop")}.get(
            len(arterials), ("lights", "lights", "lights", "lights", "lights", "none")
        )
    )
    # The arterial, or else the road from west to east, goes first where signs say who does.
    main = arterials[0] if arterials else grid.line(node, EAST)
    major = [k for k, way in enumerate(directions) if grid.line(node, way) == main]
    crossing(
        builder,
        ends,
        control=control,
        major=major if len(major) < len(ends) else [0],
        crosswalks=grid.walks,
        speed=rng.choice((30.0, 50.0)),
    )
