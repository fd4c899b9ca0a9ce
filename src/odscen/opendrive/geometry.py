"""The plan view evaluated (section 9): line, arc, spiral, poly3, paramPoly3, all roads at once.

s is the arc length of the reference line in the x/y plane. Lines and arcs share one closed form,
spirals are Fresnel integrals; the cubics are run through by arc length, which is found from their
parameter by quadrature and inverted by Newton's method.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.arrays import FloatArray, IntArray, offsets
from odscen.opendrive.profiles import locate
from odscen.opendrive.road_model import Geometry, GeometryKind

if TYPE_CHECKING:
    from collections.abc import Sequence

_BEND, _SPIRAL, _CUBIC = 0, 1, 2
_KINDS = {
    GeometryKind.LINE: _BEND,
    GeometryKind.ARC: _BEND,
    GeometryKind.SPIRAL: _SPIRAL,
    GeometryKind.POLY3: _CUBIC,
    GeometryKind.PARAM_POLY3: _CUBIC,
}
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(64)
_PIECES = 32
_EVEN = 3.0
_PIECE_NODES, _PIECE_WEIGHTS = np.polynomial.legendre.leggauss(8)


class PlanPoints(NamedTuple):
    """Points of reference lines; ``curvature`` and its change by s in 1/m and 1/m^2."""

    x: FloatArray
    y: FloatArray
    hdg: FloatArray
    curvature: FloatArray
    change: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class PlanView:
    """Flattened geometries of all roads; rows ``first[i]`` to ``first[i + 1]`` are of road ``i``.

    ``cubic`` names the row of :class:`CubicCurves` of a poly3 or paramPoly3, -1 for the others.
    """

    first: IntArray
    s: FloatArray
    x: FloatArray
    y: FloatArray
    hdg: FloatArray
    length: FloatArray
    kind: IntArray
    curvature: FloatArray
    change: FloatArray
    cubic: IntArray
    curves: CubicCurves

    @classmethod
    def of(cls, roads: Sequence[tuple[Geometry, ...]]) -> PlanView:
        """Table of one tuple of geometries per road."""
        flat = [geometry for road in roads for geometry in road]
        rows = np.array([g[:5] for g in flat], dtype=np.float64).reshape(-1, 5)
        kind = np.fromiter((_KINDS[g.kind] for g in flat), np.int64, len(flat))
        bends = np.array([_start_bend(g) for g in flat], dtype=np.float64).reshape(-1, 2)
        is_cubic = kind == _CUBIC
        cubics = [g for g in flat if _KINDS[g.kind] == _CUBIC]
        return cls(
            first=offsets(map(len, roads)),
            s=rows[:, 0].copy(),
            x=rows[:, 1].copy(),
            y=rows[:, 2].copy(),
            hdg=rows[:, 3].copy(),
            length=rows[:, 4].copy(),
            kind=kind,
            curvature=bends[:, 0].copy(),
            change=bends[:, 1].copy(),
            cubic=np.where(is_cubic, np.cumsum(is_cubic) - 1, -1),
            curves=CubicCurves.of(cubics),
        )

    def at(self, road: IntArray, s: FloatArray) -> PlanPoints:
        """Points at ``s`` of each road; beyond its ends a road continues straight."""
        row = locate(self.s, self.first, road, s)
        return self.at_rows(row, s - self.s[row])

    def at_rows(self, row: IntArray, ds: FloatArray) -> PlanPoints:
        """Points ``ds`` metres behind the start of each geometry; beyond its ends straight on."""
        inside = np.minimum(np.maximum(ds, 0.0), self.length[row])
        points = self._evaluate_inside(row, inside)
        over = ds - inside
        if not over.any():
            return points
        x = points.x + over * np.cos(points.hdg)
        y = points.y + over * np.sin(points.hdg)
        return points._replace(x=x, y=y)

    def _evaluate_inside(self, row: IntArray, ds: FloatArray) -> PlanPoints:
        hdg = self.hdg[row]
        curvature = self.curvature[row]
        change = self.change[row]
        # The chord of an arc: ds sinc(curvature ds / 2), turned by half its angle. Lines are arcs
        # of curvature 0.
        half = 0.5 * curvature * ds
        chord = ds * np.sinc(half / np.pi)
        u = chord * np.cos(half)
        v = chord * np.sin(half)
        turn = ds * (curvature + 0.5 * change * ds)
        bend = curvature + change * ds
        kind = self.kind[row]
        if (kind != _BEND).any():
            at = np.flatnonzero(kind == _SPIRAL)
            u[at], v[at] = _evaluate_spiral(curvature[at], change[at], ds[at])
            at = np.flatnonzero(kind == _CUBIC)
            if at.size:
                change = change.copy()
                u[at], v[at], turn[at], bend[at], change[at] = self.curves.at(
                    self.cubic[row[at]], ds[at]
                )
        cos, sin = np.cos(hdg), np.sin(hdg)
        x = self.x[row] + u * cos - v * sin
        y = self.y[row] + u * sin + v * cos
        return PlanPoints(x, y, hdg + turn, bend, change)


def _start_bend(geometry: Geometry) -> tuple[float, float]:
    """Curvature at the start and its change by s."""
    if geometry.kind is GeometryKind.ARC:
        return geometry.params[0], 0.0
    if geometry.kind is GeometryKind.SPIRAL:
        start, end = geometry.params
        return start, (end - start) / geometry.length
    return 0.0, 0.0


def _evaluate_spiral(
    curvature: FloatArray, change: FloatArray, ds: FloatArray
) -> tuple[FloatArray, FloatArray]:
    r"""End of a spiral that starts at the origin along u.

    .. math:: u + i v = \int_0^{ds} e^{i (\kappa \tau + \sigma \tau^2 / 2)} d\tau

    With sigma > 0 the square is completed: the integral is a difference of Fresnel integrals at
    :math:`(\kappa + \sigma \tau) / \sqrt{\pi \sigma}`, turned by
    :math:`-\kappa^2 / (2 \sigma)`; sigma < 0 is its mirror image. Where the curvature
    hardly changes these are large and their difference loses digits; Gauss-Legendre quadrature of
    the integral itself is then exact to rounding, as the whole turns by less than 100 rad.
    """
    scale = np.sqrt(np.pi * np.abs(change))
    ends = np.maximum(np.abs(curvature), np.abs(curvature + change * ds))
    closed = (np.abs(change) * ds * ds > 1e-3) & (ends < 30.0 * scale)
    point = np.empty(ds.shape, dtype=np.complex128)
    at = np.flatnonzero(closed)
    if at.size:
        sign = np.sign(change[at])
        k, sigma, root = sign * curvature[at], np.abs(change[at]), scale[at]
        from scipy.special import fresnel  # late: few runs have spirals, and it takes long to load

        sin0, cos0 = fresnel(k / root)
        sin1, cos1 = fresnel((k + sigma * ds[at]) / root)
        moved = (cos1 - cos0) + 1j * (sin1 - sin0)
        moved *= np.exp(-0.5j * k * k / sigma) * (np.pi / root)
        point[at] = moved.real + 1j * sign * moved.imag
    at = np.flatnonzero(~closed)
    if at.size:
        tau = 0.5 * ds[at, None] * (_NODES + 1.0)
        phase = tau * (curvature[at, None] + 0.5 * change[at, None] * tau)
        point[at] = 0.5 * ds[at] * (np.exp(1j * phase) @ _WEIGHTS)
    return point.real, point.imag


@dataclass(frozen=True, slots=True, eq=False)
class CubicCurves:
    """poly3 and paramPoly3 as ``u(p), v(p)``, with arc length by p tabulated piece by piece.

    ``coefficients`` has shape ``(M, 2, 4)`` (u and v), ``p_end`` ``(M,)``, ``lengths``
    ``(M, pieces + 1)``: arc length from the start to each p of an even division of [0, p_end].
    ``stretch`` is arc length per metre of s: a paramPoly3 is run through in exactly its ``length``,
    which differs from its arc length by the rounding of the file.
    """

    coefficients: FloatArray
    p_end: FloatArray
    lengths: FloatArray
    stretch: FloatArray

    @classmethod
    def of(cls, geometries: Sequence[Geometry]) -> CubicCurves:
        """Table of poly3 and paramPoly3 geometries."""
        is_param = np.array([len(g.params) == 8 for g in geometries], dtype=bool)
        # poly3: v(u) = a + b u + c u^2 + d u^3, that is u = p.
        rows = [g.params if len(g.params) == 8 else (0, 1, 0, 0, *g.params) for g in geometries]
        coefficients = np.array(rows, dtype=np.float64).reshape(-1, 2, 4)
        # A poly3 with v(u) bent covers less than its length in u, never more.
        p_end = np.array([g.length for g in geometries], dtype=np.float64)
        curves = cls(coefficients, p_end, np.zeros((len(rows), _PIECES + 1)), np.ones(len(rows)))
        if not geometries:
            return curves
        width = p_end[:, None, None] / _PIECES
        p = width * (np.arange(_PIECES)[None, :, None] + 0.5 * (_PIECE_NODES + 1.0))
        speed = np.hypot(
            *_curve_derivatives(coefficients.transpose(1, 2, 0)[..., None, None], p)[1]
        )
        pieces = 0.5 * width[:, :, 0] * (speed @ _PIECE_WEIGHTS)
        lengths = np.concatenate([np.zeros((len(rows), 1)), np.cumsum(pieces, axis=1)], axis=1)
        stretch = np.where(is_param, lengths[:, -1] / p_end, 1.0)
        return cls(coefficients, p_end, lengths, stretch)

    def start_heading(self, row: IntArray, hdg: FloatArray) -> FloatArray:
        """``hdg`` turned by the slope at p = 0 where ``row`` names a curve (is not -1)."""
        if not self.p_end.size:
            return hdg
        slope = np.arctan2(self.coefficients[row, 1, 1], self.coefficients[row, 0, 1])
        return np.where(row >= 0, hdg + slope, hdg)

    def parameter(self, row: IntArray, ds: FloatArray) -> FloatArray:
        """Give p at ``ds`` metres of s: the inverse of the arc length by p."""
        wanted = ds * self.stretch[row]
        table = self.lengths[row]
        piece = np.clip((table <= wanted[:, None]).sum(axis=1) - 1, 0, _PIECES - 1)
        width = self.p_end[row] / _PIECES
        start = piece * width
        before = np.take_along_axis(table, piece[:, None], axis=1)[:, 0]
        after = np.take_along_axis(table, piece[:, None] + 1, axis=1)[:, 0]
        span = np.where(after > before, after - before, 1.0)
        p: FloatArray = start + (wanted - before) / span * width
        coefficients = self.coefficients[row].transpose(1, 2, 0)
        for _ in range(4):  # Newton: the derivative of arc length by p is the speed
            length = before + _arc_lengths(coefficients, start, p)
            here = np.hypot(*_curve_derivatives(coefficients, p)[1])
            p += (wanted - length) / np.maximum(here, 1e-9)
        return p

    def astray(self) -> FloatArray:
        """Metres of arc length that :meth:`parameter` is off at most, tried along each curve.

        Shape ``(M,)``. Newton's method does not arrive where a curve bends within far less than a
        piece of its table; where it runs through all pieces about as fast it does, untried.
        """
        worst = np.zeros(len(self.p_end))
        pieces = np.diff(self.lengths, axis=1)
        doubted = np.flatnonzero(~(pieces.max(axis=1) <= _EVEN * pieces.min(axis=1)))
        tried = np.arange(1, 2 * _PIECES + 1) / (2 * _PIECES)
        row = np.repeat(doubted, len(tried))
        # Of a poly3 and of a paramPoly3 alike p_end is the length in s.
        ds = (self.p_end[doubted, None] * tried).ravel()
        p = self.parameter(row, ds)
        width = self.p_end[row] / _PIECES
        piece = np.clip(np.floor(p / width), 0, _PIECES - 1)
        before = self.lengths[row, piece.astype(np.int64)]
        coefficients = self.coefficients[row].transpose(1, 2, 0)
        gone = before + _arc_lengths(coefficients, piece * width, p)
        off = np.abs(gone - ds * self.stretch[row]).reshape(-1, len(tried))
        off[np.isnan(off)] = np.inf
        worst[doubted] = off.max(axis=1, initial=0.0)
        return worst

    def at(
        self, row: IntArray, ds: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
        """u, v, heading, curvature and its change by s, ``ds`` metres behind the start."""
        p = self.parameter(row, ds)
        (u, v), (u1, v1), (u2, v2), (u3, v3) = _curve_derivatives(
            self.coefficients[row].transpose(1, 2, 0), p
        )
        speed2 = np.maximum(u1 * u1 + v1 * v1, 1e-18)
        speed = np.sqrt(speed2)
        cross = u1 * v2 - v1 * u2
        curvature = cross / (speed2 * speed)
        # d/dp of cross / speed^3, per metre of arc length
        change = (u1 * v3 - v1 * u3) / (speed2 * speed2)
        change -= 3.0 * cross * (u1 * u2 + v1 * v2) / (speed2 * speed2 * speed2)
        return u, v, np.arctan2(v1, u1), curvature, change


def _arc_lengths(coefficients: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Arc length of each curve between two parameters within one piece of its table."""
    half = 0.5 * (end - start)
    nodes = start[:, None] + half[:, None] * (_PIECE_NODES + 1.0)
    speed = np.hypot(*_curve_derivatives(coefficients[..., None], nodes)[1])
    length: FloatArray = half * (speed @ _PIECE_WEIGHTS)
    return length


ArrayPair = tuple[FloatArray, FloatArray]


def _curve_derivatives(
    coefficients: FloatArray, p: FloatArray
) -> tuple[ArrayPair, ArrayPair, ArrayPair, ArrayPair]:
    """(u, v) and their first three derivatives by p.

    The first two axes of ``coefficients`` are (u or v, power), the others broadcast with ``p``.
    """
    parts = []
    for a, b, c, d in (coefficients[0], coefficients[1]):
        zero = np.zeros(p.shape)
        parts.append(
            (
                a + p * (b + p * (c + p * d)),
                b + p * (2.0 * c + p * 3.0 * d),
                2.0 * c + 6.0 * d * p,
                6.0 * d + zero,
            )
        )
    (u0, u1, u2, u3), (v0, v1, v2, v3) = parts
    return (u0, v0), (u1, v1), (u2, v2), (u3, v3)
