"""Bodies on the ground: oriented boxes, and a crowd of them that answers what overlaps.

Boxes are plan-view rectangles in the OpenDRIVE frame; two boxes on different levels (a bridge over
a road) do not touch.
"""

from __future__ import annotations

from itertools import product
from math import cos, floor, hypot, sin
from typing import TYPE_CHECKING, NamedTuple, Protocol

from odscen.base.categories import DEFAULT_BODY, Body

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.lanegraph.graphs import LaneGraph, PedestrianGraph
    from odscen.scenario.document.scenario_document import Actor

LEVEL_HEIGHT = 3.0
"""Bodies whose places differ by more than this in height (m) are on different levels."""

TOUCH = 1e-6
"""Boxes that overlap by less than this (m) only touch; rounding would decide otherwise."""
SIDE_GAP = 0.2
"""Free width kept between two sampled bodies side by side, metres."""
_AROUND = sorted(product((-1, 0, 1), repeat=2), key=lambda step: abs(step[0]) + abs(step[1]))
"""A cell of the grid and those around it, as steps from it: the likeliest first."""


class ModelBodies(Protocol):
    """What has the sizes of models."""

    def dimensions(self, model: str) -> Body | None:
        """Size of a model, ``None`` if there is no such model."""


def body_of(actor: Actor, assets: ModelBodies | None = None) -> Body:
    """Size of an actor: its own, that of its model if the catalogue knows it, or the usual one."""
    usual = DEFAULT_BODY[actor.category]
    if actor.size is not None:
        return Body(actor.size.length, actor.size.width, actor.size.height or usual.height)
    if assets is not None and actor.model is not None:
        body = assets.dimensions(actor.model)
        if body is not None:
            return body
    return usual


class Box(NamedTuple):
    """Rectangle around (x, y) at height z; ``ux, uy`` is its unit vector forward; metres."""

    x: float
    y: float
    z: float
    ux: float
    uy: float
    half_length: float
    half_width: float

    @property
    def radius(self) -> float:
        """Of the circle around the rectangle."""
        return hypot(self.half_length, self.half_width)


def box_at(
    graph: LaneGraph | PedestrianGraph,
    node: int,
    body: Body,
    *,
    lateral_offset: float = 0.0,
    longitudinal_offset: float = 0.0,
    gap: float | None = None,
) -> Box:
    """Box of a body whose centre is on a node, but for its offsets to the left and ahead (m).

    With a ``gap``, the box is grown so that two boxes that do not overlap leave that much free
    length between the bodies, and :data:`SIDE_GAP` of free width.
    """
    hdg = float(graph.hdg[node])
    ux, uy = cos(hdg), sin(hdg)
    return Box(
        float(graph.x[node]) - uy * lateral_offset + ux * longitudinal_offset,
        float(graph.y[node]) + ux * lateral_offset + uy * longitudinal_offset,
        float(graph.z[node]),
        ux,
        uy,
        body.length / 2 + (0.0 if gap is None else gap / 2),
        body.width / 2 + (0.0 if gap is None else SIDE_GAP / 2),
    )


def overlap(a: Box, b: Box) -> bool:
    """Whether two boxes share ground: separating axes, the two directions of either box."""
    dx, dy = b.x - a.x, b.y - a.y
    # No corner is farther from its centre than this, and of a crowd most boxes are.
    reach = a.half_length + a.half_width + b.half_length + b.half_width
    if dx * dx + dy * dy > reach * reach or abs(a.z - b.z) > LEVEL_HEIGHT:
        return False
    along = abs(a.ux * b.ux + a.uy * b.uy)
    across = abs(a.ux * b.uy - a.uy * b.ux)
    # How far the other box reaches along and across this one's direction.
    b_along = b.half_length * along + b.half_width * across - TOUCH
    b_across = b.half_length * across + b.half_width * along - TOUCH
    a_along = a.half_length * along + a.half_width * across - TOUCH
    a_across = a.half_length * across + a.half_width * along - TOUCH
    return (
        abs(dx * a.ux + dy * a.uy) < a.half_length + b_along
        and abs(dy * a.ux - dx * a.uy) < a.half_width + b_across
        and abs(dx * b.ux + dy * b.uy) < b.half_length + a_along
        and abs(dy * b.ux - dx * b.uy) < b.half_width + a_across
    )


class Crowd:
    """Boxes in a grid; adding and asking cost about the same for any number of them.

    Parameters
    ----------
    reach
        At least twice the radius of the largest box that will be added or asked about, metres.
    """

    def __init__(self, reach: float) -> None:
        self._cell = reach
        self._cells: dict[tuple[int, int], list[tuple[int, Box]]] = {}

    def add(self, label: int, box: Box) -> None:
        """Add a box under a number that :meth:`touching` gives back."""
        self._cells.setdefault(self._cell_of(box), []).append((label, box))

    def touching(self, box: Box) -> Iterator[int]:
        """Numbers of the boxes that overlap ``box``."""
        column, row = self._cell_of(box)
        for i, j in _AROUND:
            for label, other in self._cells.get((column + i, row + j), ()):
                if overlap(box, other):
                    yield label

    def is_free(self, box: Box) -> bool:
        """Whether nothing overlaps ``box``."""
        return next(self.touching(box), None) is None

    def _cell_of(self, box: Box) -> tuple[int, int]:
        return floor(box.x / self._cell), floor(box.y / self._cell)
