"""Layout that generated towns have in common: roads on a grid that is drawn from a seed."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate, product
from typing import TYPE_CHECKING

from tools.make_maps.geometry import Pose

if TYPE_CHECKING:
    import random
    from collections.abc import Iterator

EAST, NORTH, WEST, SOUTH = range(4)
Node = tuple[int, int]
"""Column and row of a junction."""


@dataclass(frozen=True)
class TownGrid:
    """Roads of a town.

    Attributes
    ----------
    columns, rows
        Metres from the first road to each, from west to east and from south to north.
    lanes, speeds
        Lanes each way and limit (km/h) of each column, then of each row.
    """

    columns: tuple[float, ...]
    rows: tuple[float, ...]
    lanes: tuple[int, ...]
    speeds: tuple[int, ...]

    def line(self, node: Node, direction: int) -> int:
        """Place of a road through a node in ``lanes`` and ``speeds``."""
        return node[0] if direction % 2 else len(self.columns) + node[1]

    def place(self, node: Node) -> Pose:
        """Middle of a junction, looking east."""
        return Pose(self.columns[node[0]], self.rows[node[1]], 0.0)

    def nodes(self) -> list[Node]:
        """All junctions."""
        return list(product(range(len(self.columns)), range(len(self.rows))))

    def roads(self) -> Iterator[tuple[Node, Node, int]]:
        """Junctions that are neighbours, and the direction from the first to the second."""
        for i, j in self.nodes():
            if i + 1 < len(self.columns):
                yield (i, j), (i + 1, j), EAST
            if j + 1 < len(self.rows):
                yield (i, j), (i, j + 1), NORTH

    def outwards(self, node: Node) -> list[int]:
        """Directions that lead out of town."""
        i, j = node
        at_border = (i == len(self.columns) - 1, j == len(self.rows) - 1, i == 0, j == 0)
        return [way for way in (EAST, NORTH, WEST, SOUTH) if at_border[way]]


def draw_offsets(rng: random.Random, count: int, long: float) -> tuple[float, ...]:
    """Metres from the first of some roads to each, about ``long`` apart."""
    return tuple(
        accumulate((rng.uniform(0.75, 1.35) * long for _ in range(count - 1)), initial=0.0)
    )
