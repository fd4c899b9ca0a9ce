"""The ground below the pictures of a junction: its shape, from the drawing of the map."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.markup import Markup, element, number

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.base.arrays import Bounds, FloatArray
    from odscen.drawing.map_drawing import Lines, MapDrawing

_KINDS = {
    "walked": ("sidewalk", "curb"),
    "paved": ("road", "bus", "bicycle", "shoulder", "parking", "restricted"),
}
"""Kinds of areas by the class of their shape, in the order they are painted."""

_SEAM = 0.05
"""Metres by which areas grow, so that none is left between two that touch."""

_TOLERANCE = 0.15
"""Metres by which an outline may be off."""


class PictureFrame(NamedTuple):
    """From metres of the OpenDRIVE frame to pixels of a square picture.

    Attributes
    ----------
    x0, y1
        Metres at the upper left corner.
    scale
        Pixels per metre.
    side
        Pixels.
    """

    x0: float
    y1: float
    scale: float
    side: float

    @classmethod
    def around(
        cls, points: Sequence[tuple[float, float]], *, side: float, margin: float
    ) -> PictureFrame:
        """Square with all points (x, y in metres, at least one) ``margin`` pixels from its rim."""
        xs, ys = [x for x, _ in points], [y for _, y in points]
        span = max(max(xs) - min(xs), max(ys) - min(ys), 1.0)
        scale = (side - 2.0 * margin) / span
        x0 = (min(xs) + max(xs)) / 2.0 - side / 2.0 / scale
        y1 = (min(ys) + max(ys)) / 2.0 + side / 2.0 / scale
        return cls(x0, y1, scale, side)

    @property
    def bounds(self) -> Bounds:
        """What is in the picture, metres."""
        span = self.side / self.scale
        return self.x0, self.y1 - span, self.x0 + span, self.y1

    def point(self, x: float, y: float) -> tuple[float, float]:
        """Pixels of a point in metres."""
        return (x - self.x0) * self.scale, (self.y1 - y) * self.scale

    def path(self, points: Sequence[tuple[float, float]] | FloatArray) -> str:
        """``d`` of a path through points in metres."""
        return "M" + " L".join(
            f"{number(x, 1)} {number(y, 1)}" for x, y in (self.point(*one) for one in points)
        )


def junction_ground(drawing: MapDrawing, frame: PictureFrame) -> Markup:
    """Outlines of carriageways and sidewalks in a picture, and its stop lines.

    Shapes have the classes ``paved``, ``walked`` and ``stop-line``; whoever shows them has colours
    for these.
    """
    from shapely import box

    bounds = frame.bounds
    near = drawing.clipped(bounds)
    window = box(*bounds)
    shapes = []
    for name, kinds in _KINDS.items():
        rings = [ring for area in near.areas if area.kind in kinds for ring in _each(area.rings)]
        if outline := _outline(rings, window, frame):
            shapes.append(element("path", d=outline, class_=name))
    shapes += [
        element("path", d=frame.path(line), class_="stop-line")
        for line in _each(near.stop_lines.touching(bounds))
    ]
    return element("g", *shapes, class_="ground")


def _each(lines: Lines) -> Iterator[FloatArray]:
    for begin, end in zip(lines.start[:-1].tolist(), lines.start[1:].tolist(), strict=True):
        yield lines.xy[begin:end]


def _outline(rings: Sequence[FloatArray], window: object, frame: PictureFrame) -> str:
    """Outline of all rings together inside of the window; empty if there is nothing."""
    import shapely

    areas = [shapely.make_valid(shapely.Polygon(ring)) for ring in rings if len(ring) > 2]
    if not areas:
        return ""
    whole = shapely.union_all(shapely.buffer(np.array(areas), _SEAM, join_style="mitre"))
    inside = shapely.simplify(shapely.intersection(whole, window), _TOLERANCE)
    parts = [part for part in shapely.get_parts(inside) if part.geom_type == "Polygon"]
    rings_of = [ring for part in parts for ring in (part.exterior, *part.interiors)]
    return " ".join(f"{frame.path(shapely.get_coordinates(ring)[:-1])} Z" for ring in rings_of)
