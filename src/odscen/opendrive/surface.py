r"""The road surface: from reference line and superelevation to points and directions in space.

With the reference line's heading :math:`\psi`, slope :math:`\theta` and superelevation
:math:`\rho`, road coordinates (s, t, h) are at ``R(s) + t e_t + h e_h``, where ``e_t`` is the level
left-hand normal turned by :math:`\rho` about the line's direction ``e_s`` (section 8).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray
    from odscen.opendrive.geometry import PlanPoints


class ReferencePoints(NamedTuple):
    """Points of reference lines, shape ``(N,)`` each; metres and radians.

    ``pitch`` is the angle of the slope, positive uphill; ``roll`` the superelevation, positive when
    the left side is higher.
    """

    x: FloatArray
    y: FloatArray
    z: FloatArray
    hdg: FloatArray
    curvature: FloatArray
    pitch: FloatArray
    roll: FloatArray


class LineOffset(NamedTuple):
    """t of a line with its first and second derivative by s."""

    t: FloatArray
    slope: FloatArray
    bend: FloatArray


def on_surface(
    line: ReferencePoints, t: FloatArray, h: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """R + t e_t + h e_h in inertial coordinates."""
    sin_p, cos_p = np.sin(line.pitch), np.cos(line.pitch)
    sin_r, cos_r = np.sin(line.roll), np.cos(line.roll)
    # In the frame (level direction, level left normal, up) of the reference line:
    # e_t = (-sin_r sin_p, cos_r, sin_r cos_p), e_h = (-cos_r sin_p, -sin_r, cos_r cos_p).
    ahead = -(t * sin_r + h * cos_r) * sin_p
    left = t * cos_r - h * sin_r
    up = (t * sin_r + h * cos_r) * cos_p
    sin, cos = np.sin(line.hdg), np.cos(line.hdg)
    return (
        line.x + ahead * cos - left * sin,
        line.y + ahead * sin + left * cos,
        line.z + up,
    )


def line_direction(
    plan: PlanPoints,
    elevation: tuple[FloatArray, FloatArray, FloatArray],
    superelevation: tuple[FloatArray, FloatArray, FloatArray],
    line: LineOffset,
) -> tuple[FloatArray, FloatArray]:
    r"""Heading relative to the reference line, and pitch, of the line ``R(s) + t(s) e_t(s)``.

    The derivative by s, in the frame (level direction, level left normal, up) of the reference
    line: ``(1, 0, z') + t' e_t + t e_t'`` with :math:`e_t = (-sin\rho sin\theta, cos\rho,
    sin\rho cos\theta)`; the frame itself turns with the curvature.
    """
    _, slope, bend = elevation
    roll, twist, _ = superelevation
    pitch = np.arctan(slope)
    pitch_rate = bend / (1.0 + slope * slope)
    sin_p, cos_p = np.sin(pitch), np.cos(pitch)
    sin_r, cos_r = np.sin(roll), np.cos(roll)
    k, t, t1 = plan.curvature, line.t, line.slope
    ahead_rate = -twist * cos_r * sin_p - sin_r * cos_p * pitch_rate - k * cos_r
    left_rate = -twist * sin_r - k * sin_r * sin_p
    up_rate = twist * cos_r * cos_p - sin_r * sin_p * pitch_rate
    ahead = 1.0 - t1 * sin_r * sin_p + t * ahead_rate
    left = t1 * cos_r + t * left_rate
    up = slope + t1 * sin_r * cos_p + t * up_rate
    return np.arctan2(left, ahead), np.arctan2(up, np.hypot(ahead, left))


def line_curvature(plan: PlanPoints, line: LineOffset) -> FloatArray:
    r"""Curvature in the plane of the line at offset t(s), positive to the left as s grows.

    With :math:`q = 1 - \kappa t` the line's direction is (q, t') in the reference line's frame, so
    that :math:`\kappa_t = (\kappa + (t'' q + t' (\kappa' t + \kappa t')) / v^2) / v`,
    :math:`v^2 = q^2 + t'^2`. Superelevation is left out: it changes this by its square.
    """
    k, k1 = plan.curvature, plan.change
    q = 1.0 - k * line.t
    v2 = np.maximum(q * q + line.slope * line.slope, 1e-12)
    turn = (line.bend * q + line.slope * (k1 * line.t + k * line.slope)) / v2
    return (k + turn) / np.sqrt(v2)
