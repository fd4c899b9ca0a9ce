"""How far bodies on the ground are from each other: rectangles that are turned."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.scenario.story.road_view import ActorView, Point


def body_distance(one: ActorView, other: ActorView) -> float:
    """Metres between two bodies, 0 where they overlap.

    Of two that do not, a corner of one of them is nearest.
    """
    dx, dy = other.x - one.x, other.y - one.y
    reach = (one.length + one.width + other.length + other.width) / 2.0
    if abs(dx) <= reach and abs(dy) <= reach and overlap(one.corners, other.corners):
        return 0.0
    return min(_nearest(one, other.corners), _nearest(other, one.corners))


def _nearest(body: ActorView, points: Sequence[Point]) -> float:
    """Metres from a body to the nearest of some points outside of it."""
    x, y, c, s = body.x, body.y, math.cos(body.hdg), math.sin(body.hdg)
    half, side = body.length / 2.0, body.width / 2.0
    least = math.inf
    for px, py in points:
        dx, dy = px - x, py - y
        ahead, aside = abs(dx * c + dy * s) - half, abs(dy * c - dx * s) - side
        away = math.hypot(ahead, aside) if ahead > 0.0 and aside > 0.0 else max(ahead, aside, 0.0)
        least = min(least, away)
    return least


def polygon_distance(one: Sequence[Point], other: Sequence[Point]) -> float:
    """Metres between two convex polygons, 0 where they overlap."""
    if overlap(one, other):
        return 0.0
    return min(
        _to_edge(corner, *edge)
        for corners, edges in ((one, other), (other, one))
        for corner in corners
        for edge in _edges(edges)
    )


def overlap(one: Sequence[Point], other: Sequence[Point]) -> bool:
    """Whether two convex polygons overlap or touch: no side of either lies between them."""
    for (ax, ay), (bx, by) in (*_edges(one), *_edges(other)):
        nx, ny = by - ay, ax - bx
        first = [nx * x + ny * y for x, y in one]
        second = [nx * x + ny * y for x, y in other]
        if max(first) < min(second) or max(second) < min(first):
            return False
    return True


def point_distance(corners: Sequence[Point], point: Point) -> float:
    """Metres from a convex polygon to a point, 0 inside."""
    return polygon_distance(corners, (point, point))


def _edges(corners: Sequence[Point]) -> Iterator[tuple[Point, Point]]:
    return zip(corners, (*corners[1:], corners[0]), strict=True)


def _to_edge(point: Point, start: Point, end: Point) -> float:
    dx, dy = end[0] - start[0], end[1] - start[1]
    square = dx * dx + dy * dy
    px, py = point[0] - start[0], point[1] - start[1]
    share = min(1.0, max(0.0, (px * dx + py * dy) / square)) if square > 0.0 else 0.0
    return math.hypot(px - share * dx, py - share * dy)
