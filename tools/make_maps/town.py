"""Towns on a grid: an avenue with lights, a priority road, roundabouts, smaller streets."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import accumulate, cycle, islice
from typing import TYPE_CHECKING

from scenariogeneration import xodr

from tools.make_maps import roundabout
from tools.make_maps.builder import Builder
from tools.make_maps.crossing import crossing
from tools.make_maps.crossings import EAST, NORTH, SOUTH, WEST, WIDE_REACH
from tools.make_maps.geometry import Pose
from tools.make_maps.parts import End, street

if TYPE_CHECKING:
    from collections.abc import Sequence

Node = tuple[int, int]
"""Column and row of a junction."""
Arms = dict[Node, dict[int, End]]
"""Ends of streets at each junction, by direction: quarters of a turn from east."""

PITCHES = (105.0, 90.0, 125.0, 95.0, 115.0)
"""Metres between neighbouring streets, over and over."""
REACH = 14.0
"""Metres from the middle of a junction to the end of its arms."""
BEND_RADIUS = 30.0


@dataclass(frozen=True)
class Grid:
    """Layout of a town.

    Attributes
    ----------
    columns, rows
        Number of streets from south to north and from west to east.
    avenue
        Row with two lanes each way and lights.
    priority
        Column whose traffic has priority.
    roundabouts
        Junctions that are roundabouts.
    west, south
        Metres from the origin of the map to the first junction.
    """

    columns: int
    rows: int
    avenue: int
    priority: int
    roundabouts: frozenset[Node]
    west: float = 0.0
    south: float = 0.0

    def place(self, node: Node) -> Pose:
        """Middle of a junction, looking east."""
        x, y = _offsets(self.columns)[node[0]], _offsets(self.rows)[node[1]]
        return Pose(self.west + x, self.south + y, 0.0)

    def reach(self, node: Node) -> float:
        """Metres from the middle of a junction to the end of its arms."""
        if node in self.roundabouts:
            return roundabout.REACH
        return WIDE_REACH if node[1] == self.avenue else REACH

    def nodes(self) -> list[Node]:
        """All places where streets meet or bend."""
        return [(i, j) for i in range(self.columns) for j in range(self.rows)]

    def corners(self) -> list[Node]:
        """Nodes that are bends, not junctions."""
        return [(i, j) for i in (0, self.columns - 1) for j in (0, self.rows - 1)]

    def extent(self) -> tuple[float, float]:
        """Metres from the first junction to the last, eastwards and northwards."""
        return _offsets(self.columns)[-1], _offsets(self.rows)[-1]


def _offsets(count: int) -> list[float]:
    return list(accumulate(islice(cycle(PITCHES), count - 1), initial=0.0))


SMALL = Grid(6, 6, 2, 3, frozenset({(4, 4), (1, 3)}))


def town_5x5(name: str) -> Builder:
    """Five by five blocks with 32 places where streets meet."""
    return _town(name, SMALL)


def large_town(name: str) -> Builder:
    """Twelve by twelve streets with 140 places where they meet."""
    return _town(name, Grid(12, 12, 5, 6, frozenset({(2, 2), (9, 3), (8, 8)})))


def _town(name: str, grid: Grid) -> Builder:
    builder = Builder(name)
    add_junctions(builder, grid, add_streets(builder, grid))
    return builder


def add_streets(builder: Builder, grid: Grid) -> Arms:
    """Add all streets of a town, and tell where they end."""
    arms: Arms = {node: {} for node in grid.nodes()}
    corners = grid.corners()
    for node in arms:
        for direction, other in ((0, (node[0] + 1, node[1])), (1, (node[0], node[1] + 1))):
            if other in arms and node not in corners and other not in corners:
                _street(builder, grid, arms, node, other, direction)
    for corner in corners:
        _bend(builder, grid, arms, corner)
    return arms


def add_junctions(builder: Builder, grid: Grid, arms: Arms) -> None:
    """Join the streets of a town where they meet."""
    for node in arms:
        if node not in grid.corners():
            _junction(builder, grid, node, arms[node])


def _street(
    builder: Builder,
    grid: Grid,
    arms: Arms,
    node: Node,
    other: Node,
    direction: int,
) -> None:
    """Add the street from ``node`` to its neighbour in the east (0) or north (1)."""
    here, there = grid.place(node), grid.place(other)
    length = math.hypot(there.x - here.x, there.y - here.y) - grid.reach(node) - grid.reach(other)
    avenue = direction == 0 and node[1] == grid.avenue
    major = avenue or (direction == 1 and node[0] == grid.priority)
    name = f"East Street {node[1] + 1}" if direction == 0 else f"North Street {node[0] + 1}"
    record = builder.road(
        here.turned(direction * math.pi / 2).ahead(grid.reach(node)),
        [xodr.Line(length)],
        street(2 if avenue else 1),
        speed=50.0 if major else 30.0,
        name="Avenue" if avenue else name,
    )
    arms[node][direction] = End(record, "start")
    arms[other][direction + 2] = End(record, "end")


def _bend(builder: Builder, grid: Grid, arms: Arms, corner: Node) -> None:
    """Road around a corner of the town, from the junction beside it to the one above or below."""
    i, j = corner
    beside = (1 if i == 0 else i - 1, j)
    above = (i, 1 if j == 0 else j - 1)
    towards, away = (WEST if i == 0 else EAST), (NORTH if j == 0 else SOUTH)
    turn = math.remainder(away - towards, 2.0 * math.pi)
    middle, first, last = grid.place(corner), grid.place(beside), grid.place(above)
    geometries = [
        xodr.Line(abs(middle.x - first.x) - grid.reach(beside) - BEND_RADIUS),
        xodr.Arc(math.copysign(1.0 / BEND_RADIUS, turn), length=BEND_RADIUS * math.pi / 2),
        xodr.Line(abs(middle.y - last.y) - grid.reach(above) - BEND_RADIUS),
    ]
    start = first.turned(towards).ahead(grid.reach(beside))
    record = builder.road(start, geometries, street(), speed=30.0, name="Ring Street")
    arms[beside][round(towards / (math.pi / 2))] = End(record, "start")
    arms[above][(round(away / (math.pi / 2)) + 2) % 4] = End(record, "end")


def _junction(builder: Builder, grid: Grid, node: Node, arms: dict[int, End]) -> None:
    if node in grid.roundabouts:
        roundabout.roundabout_arms(builder, grid.place(node), arms)
        return
    directions = sorted(arms)
    ends = [arms[direction] for direction in directions]
    through = _opposite(directions)
    if node[1] == grid.avenue:
        control, major = "lights", []
    elif len(ends) == 3:
        control, major = "yield", through
    elif node[0] == grid.priority:
        control, major = "stop", [k for k, d in enumerate(directions) if d % 2 == 1]
    elif (node[0] + node[1]) % 2:
        control, major = "yield", [k for k, d in enumerate(directions) if d % 2 == 0]
    else:
        control, major = "none", []
    crossing(builder, ends, control=control, major=major)


def _opposite(directions: Sequence[int]) -> list[int]:
    """Positions of the arms that have another one opposite."""
    return [k for k, d in enumerate(directions) if (d + 2) % 4 in directions]
