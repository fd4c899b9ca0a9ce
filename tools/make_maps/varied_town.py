"""Towns on grids that differ in everything: what the reference generator learns from.

``varied_town_07`` is the town of seed 7. Streets, lanes, speeds, the size of junctions, and who
goes first at them are drawn; the same name gives the same map.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scenariogeneration import xodr

from tools.make_maps import roundabout
from tools.make_maps.builder import Builder
from tools.make_maps.crossing import crossing
from tools.make_maps.parts import End, street
from tools.make_maps.town_grid import EAST, NORTH, Node, TownGrid, draw_offsets

if TYPE_CHECKING:
    from collections.abc import Sequence

COUNT = 72
"""Towns that have a name."""
ARTERIAL = range(24, 32)
"""Seeds whose streets have up to four lanes each way, and whose junctions are far apart."""
STYLES = ("lights", "none", "signs", "mixed")
"""How junctions are ruled: each second of the unruled ones is wide."""


@dataclass(frozen=True)
class VariedGrid(TownGrid):
    """Layout of a town.

    Attributes
    ----------
    reach
        Metres from the middle of a junction to the end of its arms, without what lanes add.
    style
        One of :data:`STYLES`.
    closed
        Streets between two junctions that are not there.
    """

    reach: float
    style: str
    closed: frozenset[tuple[Node, int]]

    def room(self, node: Node) -> float:
        """Metres from the middle of a junction to the end of its arms."""
        most = max(self.lanes[self.line(node, EAST)], self.lanes[self.line(node, NORTH)])
        return self.reach + 4.0 * (most - 1)


def varied_town(name: str) -> Builder:
    """Town whose seed is the number at the end of its name."""
    seed = int(name.rpartition("_")[2])
    rng = random.Random(f"varied town {seed}")
    grid = _drawn(rng, seed)
    builder = Builder(name)
    arms: dict[Node, dict[int, End]] = {node: {} for node in grid.nodes()}
    for node, other, direction in grid.roads():
        if (node, direction) not in grid.closed:
            _street(builder, grid, arms, node, other, direction)
    for node, own in arms.items():
        _stubs(builder, grid, arms, node)
        _junction(builder, grid, node, own, rng)
    return builder


def _drawn(rng: random.Random, seed: int) -> VariedGrid:
    arterial = seed in ARTERIAL
    most = 3 if arterial else 5
    columns, rows = rng.randint(3, most), rng.randint(3, most)
    long = rng.choice((180.0, 300.0, 450.0) if arterial else (90.0, 130.0, 200.0))
    style = STYLES[seed % len(STYLES)]
    wide = style in ("none", "mixed") and seed % 8 >= 4
    lanes, speeds = [], []
    for _ in range(columns + rows):
        few, more = (2, rng.choice((3, 3, 4))) if arterial else (1, 2)
        lanes.append(more if rng.random() < (0.6 if wide or arterial else 0.35) else few)
        fast = rng.random() < (0.5 if wide or arterial else 0.25)
        speeds.append(rng.choice((70, 90, 100) if fast else (30, 40, 50, 50)))
    inner = [
        ((i, j), direction)
        for i in range(columns)
        for j in range(rows)
        for direction in (EAST, NORTH)
        if (0 < j < rows - 1 if direction == EAST else 0 < i < columns - 1)
    ]
    return VariedGrid(
        draw_offsets(rng, columns, long),
        draw_offsets(rng, rows, long),
        tuple(lanes),
        tuple(speeds),
        rng.uniform(20.0, 28.0) if wide else rng.uniform(13.0, 17.0),
        style,
        _closed(rng, inner),
    )


def _closed(rng: random.Random, streets: Sequence[tuple[Node, int]]) -> frozenset[tuple[Node, int]]:
    """Some of the streets, no two of which meet."""
    found, used = [], set[Node]()
    for (i, j), direction in rng.sample(streets, k=len(streets) // 6):
        ends = {(i, j), (i + 1, j) if direction == EAST else (i, j + 1)}
        if not ends & used:
            found.append(((i, j), direction))
            used |= ends
    return frozenset(found)


def _street(
    builder: Builder,
    grid: VariedGrid,
    arms: dict[Node, dict[int, End]],
    node: Node,
    other: Node,
    direction: int,
) -> None:
    """Add the street from ``node`` to its neighbour in the east or north."""
    here, there = grid.place(node), grid.place(other)
    length = math.hypot(there.x - here.x, there.y - here.y) - grid.room(node) - grid.room(other)
    line = grid.line(node, direction)
    record = builder.road(
        here.turned(direction * math.pi / 2).ahead(grid.room(node)),
        [xodr.Line(length)],
        street(grid.lanes[line]),
        speed=float(grid.speeds[line]),
        name=f"Street {line + 1}",
    )
    arms[node][direction] = End(record, "start")
    arms[other][direction + 2] = End(record, "end")


def _stubs(
    builder: Builder, grid: VariedGrid, arms: dict[Node, dict[int, End]], node: Node
) -> None:
    """Open ends of streets at every second node of the border, and where a corner needs one."""
    i, j = node
    outwards = grid.outwards(node)
    needed = max(3 - len(arms[node]), int(len(outwards) == 1 and (i + j) % 2 == 0))
    for direction in outwards[: max(needed, 0)]:
        line = grid.line(node, direction)
        here = grid.place(node).turned(direction * math.pi / 2).ahead(grid.room(node))
        record = builder.road(
            here, [xodr.Line(80.0)], street(grid.lanes[line]), speed=float(grid.speeds[line]),
            name=f"Street {line + 1}",
        )  # fmt: skip
        arms[node][direction] = End(record, "start")


def _junction(
    builder: Builder, grid: VariedGrid, node: Node, arms: dict[int, End], rng: random.Random
) -> None:
    directions = sorted(arms)
    ends = [arms[direction] for direction in directions]
    narrow = all(grid.lanes[grid.line(node, direction)] == 1 for direction in directions)
    if grid.style == "signs" and narrow and grid.room(node) > roundabout.REACH:
        roundabout.roundabout_arms(builder, grid.place(node), arms)
        return
    style = (
        rng.choice(("lights", "lights", "none", "signs")) if grid.style == "mixed" else (grid.style)
    )
    control, major = style, list[int]()
    if style == "signs":
        control, major = rng.choice(("yield", "stop")), _major(grid, node, directions)
    crossing(builder, ends, control=control, major=major, speed=rng.choice((30.0, 50.0)))


def _major(grid: VariedGrid, node: Node, directions: Sequence[int]) -> list[int]:
    """Positions of the arms of the larger street."""
    column, row = grid.line(node, NORTH), grid.line(node, EAST)
    along = (grid.lanes[column], grid.speeds[column]) > (grid.lanes[row], grid.speeds[row])
    found = [k for k, one in enumerate(directions) if one % 2 == int(along)]
    return found if 0 < len(found) < len(directions) else [0]
