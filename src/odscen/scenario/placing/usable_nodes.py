"""What a simulator can use of a map: told to sampling and demand, which know no simulator."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from odscen.base.categories import DEFAULT_BODY, Category

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.arrays import BoolArray
    from odscen.base.categories import Body


@dataclass(frozen=True, slots=True)
class Usable:
    """What a simulator can use of a map; ``None`` stands for everything.

    Attributes
    ----------
    spawnable
        Shape ``(N,)``: lane-graph nodes on which a vehicle can be placed exactly.
    drivable
        Shape ``(N,)``: lane-graph nodes that a path can lead over.
    walkable
        Shape ``(P,)``: pedestrian nodes on which a walker can be placed, and arrive.
    in_junction
        Shape ``(N,)``: lane-graph nodes inside the simulator's junctions, on the way to a crosswalk
        before them for example. ``None``: those of the map's junctions.
    bodies
        Size of each category.
    """

    spawnable: BoolArray | None = None
    drivable: BoolArray | None = None
    walkable: BoolArray | None = None
    in_junction: BoolArray | None = None
    bodies: Mapping[Category, Body] = field(default_factory=lambda: DEFAULT_BODY)
