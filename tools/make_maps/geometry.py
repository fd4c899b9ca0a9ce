"""Poses, and reference lines between them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np
from scenariogeneration import xodr

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

Geometry: TypeAlias = xodr.Line | xodr.Arc | xodr.Spiral | xodr.ParamPoly3

_STEPS = 2000
"""Trapezoids per paramPoly3 when its length is integrated; the error is far below 0.1 mm."""


class Pose(NamedTuple):
    """Position in metres and heading in radians, counter-clockwise from +x."""

    x: float
    y: float
    h: float

    def ahead(self, distance: float) -> Pose:
        """Return the pose ``distance`` metres further on a straight line."""
        return Pose(
            self.x + distance * math.cos(self.h), self.y + distance * math.sin(self.h), self.h
        )

    def left(self, distance: float) -> Pose:
        """Return the pose ``distance`` metres to the left."""
        return Pose(
            self.x - distance * math.sin(self.h), self.y + distance * math.cos(self.h), self.h
        )

    def turned(self, angle: float) -> Pose:
        """Return the same place with the heading changed by ``angle``."""
        return Pose(self.x, self.y, math.remainder(self.h + angle, 2.0 * math.pi))

    def back(self) -> Pose:
        """Return the same place, looking the other way."""
        return self.turned(math.pi)


def turn_between(start: Pose, end: Pose) -> float:
    """Angle in radians, -pi to pi, by which ``end`` looks further left than ``start``."""
    return math.remainder(end.h - start.h, 2.0 * math.pi)


def length_of(geometry: Geometry) -> float:
    """Arc length in metres."""
    return float(geometry.get_end_data(0.0, 0.0, 0.0)[3])


def plan(start: Pose, geometries: Sequence[Geometry]) -> tuple[xodr.PlanView, Pose, float]:
    """String geometries together from ``start``; also the end and the total length."""
    view = xodr.PlanView()
    pose, s = start, 0.0
    for geometry in geometries:
        x, y, h, length = geometry.get_end_data(*pose)
        view.add_fixed_geometry(geometry, *pose, s)
        pose, s = Pose(float(x), float(y), float(h)), s + float(length)
    return view, pose, s


def shift(length: float, aside: float) -> xodr.ParamPoly3:
    """Move ``aside`` metres to the left over ``length`` metres, heading the same at both ends.

    ``v = aside (3 p^2 - 2 p^3)``, ``u = length p``, with ``p`` from 0 to 1.
    """
    u = np.array([0.0, length, 0.0, 0.0])
    v = np.array([0.0, 0.0, 3.0 * aside, -2.0 * aside])
    return _param_poly(u, v)


def curve(start: Pose, end: Pose) -> Geometry:
    """One smooth geometry from pose to pose; a line where that will do.

    A cubic Bezier curve whose handles are those of a circle for the turn between the poses
    (``4/3 tan(turn / 4)`` radii), as paramPoly3.
    """
    dx, dy = end.x - start.x, end.y - start.y
    cos, sin = math.cos(start.h), math.sin(start.h)
    u, v = dx * cos + dy * sin, dy * cos - dx * sin
    turn = turn_between(start, end)
    if abs(turn) < 1e-9 and abs(v) < 1e-9:
        return xodr.Line(u)
    chord, half = math.hypot(u, v), abs(turn) / 2.0
    handle = chord / 3.0 if half < 1e-6 else chord * 2.0 / 3.0 * math.tan(half / 2) / math.sin(half)
    out = (u - handle * math.cos(turn), v - handle * math.sin(turn))
    p0, p1, p2, p3 = np.array([(0.0, 0.0), (handle, 0.0), out, (u, v)])
    coefficients = np.array([p0, 3 * (p1 - p0), 3 * (p2 - 2 * p1 + p0), p3 - 3 * p2 + 3 * p1 - p0])
    return _param_poly(*coefficients.T)


def _param_poly(u: NDArray[np.float64], v: NDArray[np.float64]) -> xodr.ParamPoly3:
    p = np.linspace(0.0, 1.0, _STEPS + 1)
    speed = np.hypot(*(c[1] + 2 * c[2] * p + 3 * c[3] * p**2 for c in (u, v)))
    length = float(np.trapezoid(speed, dx=1.0 / _STEPS))
    return xodr.ParamPoly3(*u.tolist(), *v.tolist(), "normalized", length)


def smooth(start: float, end: float, length: float) -> tuple[float, float, float, float]:
    """Cubic from ``start`` to ``end``, level at both ends: a, b, c, d."""
    change = end - start
    return start, 0.0, 3.0 * change / length**2, -2.0 * change / length**3
