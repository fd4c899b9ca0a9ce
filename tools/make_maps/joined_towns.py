"""Copies of a town side by side, joined by country roads: a network as large as one asks for."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from scenariogeneration import xodr

from tools.make_maps.builder import Builder
from tools.make_maps.parts import End, street
from tools.make_maps.town import SMALL, add_junctions, add_streets

if TYPE_CHECKING:
    from tools.make_maps.town import Arms, Grid, Node

APART = 400.0
"""Metres between the last junction of a town and the first of the next."""


def joined_towns(name: str, *, count: int, town: Grid = SMALL) -> Builder:
    """So many towns in rows, each joined with its neighbours.

    To the east and the west the avenues are joined, to the north and the south the streets with
    priority, so that every town is reached from every other.
    """
    builder = Builder(name)
    across = math.ceil(math.sqrt(count))
    width, height = town.extent()
    grids: dict[Node, Grid] = {}
    for number in range(count):
        i, j = number % across, number // across
        west, south = i * (width + APART), j * (height + APART)
        grids[i, j] = replace(town, west=west, south=south)
    arms = {place: add_streets(builder, grid) for place, grid in grids.items()}
    for (i, j), grid in grids.items():
        for direction, other in ((0, (i + 1, j)), (1, (i, j + 1))):
            if other in grids:
                _country_road(builder, (grid, arms[i, j]), (grids[other], arms[other]), direction)
    for place, grid in grids.items():
        add_junctions(builder, grid, arms[place])
    return builder


def _country_road(
    builder: Builder, here: tuple[Grid, Arms], there: tuple[Grid, Arms], direction: int
) -> None:
    """Add the road from a town to its neighbour in the east (0) or north (1)."""
    grid = here[0]
    first, last = (grid.columns - 1, grid.avenue), (0, grid.avenue)
    if direction == 1:
        first, last = (grid.priority, grid.rows - 1), (grid.priority, 0)
    start = grid.place(first).turned(direction * math.pi / 2).ahead(grid.reach(first))
    end = there[0].place(last)
    length = math.hypot(end.x - start.x, end.y - start.y) - grid.reach(last)
    record = builder.road(
        start,
        [xodr.Line(length)],
        street(2 if direction == 0 else 1),
        speed=70.0,
        name="Country Road",
    )
    here[1][first][direction] = End(record, "start")
    there[1][last][direction + 2] = End(record, "end")
