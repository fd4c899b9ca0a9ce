"""Shapes of the pedestrian network: lane alignments cut and divided, outlines of walking areas."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray
    from odscen.convert.model.lane_alignment import LaneAlignment, Stretch


TRIM = 0.6
"""Metres that an edge keeps off the middle of a walking area."""


def triple(place: FloatArray) -> tuple[float, float, float]:
    """x, y, z as plain numbers, from shape ``(3,)``."""
    x, y, z = (float(value) for value in place)
    return x, y, z


def line_across(shape: FloatArray, which: int, width: float) -> FloatArray:
    """Line across the start (0) or the end (-1) of a shape, shape ``(2, 3)``."""
    step = shape[1] - shape[0] if which == 0 else shape[-1] - shape[-2]
    length = max(float(np.hypot(step[0], step[1])), 1e-9)
    normal = np.array([-step[1], step[0], 0.0]) / length * (width / 2.0)
    result: FloatArray = np.stack([shape[which] - normal, shape[which] + normal])
    return result


def area_outline(legs: Sequence[FloatArray]) -> FloatArray:
    """Outline of a walking area, shape ``(N, 3)``: hull of the ends of walks that meet in it."""
    points = np.concatenate(list(legs))
    z = float(points[:, 2].mean())
    hull = shapely.MultiPoint(points[:, :2]).convex_hull
    if hull.geom_type != "Polygon" or hull.area < 0.05:
        hull = hull.buffer(TRIM, quad_segs=1)
    outline = np.array(hull.exterior.coords)[:-1]
    return np.column_stack((outline, np.full(len(outline), z)))


def thirds(alignment: LaneAlignment) -> list[LaneAlignment]:
    """Divide an alignment into three parts of about the same extent."""
    third = sum(stretch.extent for stretch in alignment) / 3.0
    head, rest = divided(alignment, third)
    return [head, *divided(rest, third)]


def divided(alignment: LaneAlignment, extent: float) -> tuple[LaneAlignment, LaneAlignment]:
    """Divide an alignment after ``extent`` metres of s.

    Raises
    ------
    ValueError
        If it has no stretch.
    """
    for index, stretch in enumerate(alignment):
        if extent < stretch.extent or index == len(alignment) - 1:
            share = min(max(extent / stretch.extent, 0.1), 0.9)
            middle = stretch.start + share * (stretch.end - stretch.start)
            head, tail = stretch._replace(end=middle), stretch._replace(start=middle)
            return (*alignment[:index], head), (tail, *alignment[index + 1 :])
        extent -= stretch.extent
    raise ValueError("nothing to divide")


def trimmed(alignment: LaneAlignment, *, start: bool, end: bool) -> LaneAlignment:
    """Take :data:`TRIM` off the ends that meet others, at most a quarter of the last stretch."""
    result = list(alignment)
    if start:
        old = result[0]
        result[0] = old._replace(start=old.start + cut(old))
    if end:
        old = result[-1]
        result[-1] = old._replace(end=old.end - cut(old))
    return tuple(result)


def cut(stretch: Stretch) -> float:
    """By how much a stretch is shortened at a walking area: metres of s along its direction."""
    return min(TRIM, stretch.extent / 4.0) * (1.0 if stretch.end > stretch.start else -1.0)
