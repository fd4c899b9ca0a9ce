"""How fast drivers take curves: the advisory speed of lanes that bend.

The limit of a lane stays the legal one; what is driven in a curve is what feels comfortable to the
side, and less than that is driven by nobody's order. Lateral accelerations that drivers choose fall
with speed: 2.5 to 3 m/s2 in turns at 20 to 30 km/h, 2 m/s2 at 100 km/h (Bosetti, Da Lio and
Saroldi, "On the human control of vehicles: an experimental study of acceleration", European
Transport Research Review 6, 2014; Reymond et al., "Role of lateral acceleration in curve driving",
Human Factors 43, 2001; side friction demands of AASHTO, "A Policy on Geometric Design of Highways
and Streets", 2018, table 3-7, lie below). Each driver's speed factor spreads them.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray
    from odscen.opendrive.lanes import RoadTable

_SPEEDS = np.array([0.0, 20.0, 40.0, 60.0, 80.0, 100.0, 130.0]) / 3.6
_LATERAL = np.array([3.1, 3.1, 2.7, 2.4, 2.2, 2.0, 1.8])
"""m/s2 that the median driver chooses at these speeds, m/s."""

_SLOPES = np.append(np.diff(_LATERAL) / np.diff(_SPEEDS), 0.0)
"""By which it changes from each speed to the next, 1/s."""

_FASTEST = 199.0
"""m/s from which on a bend is none."""

HEAVY = 0.65
"""Share of it that drivers of trucks and buses choose: loads shift and roll over, people stand."""

TURNING = 0.93
"""Share of it in junctions, where drivers look for others: 2 to 3 m/s2 in turns."""

HEAVY_CLASSES = ("truck", "trailer", "bus", "coach")
"""SUMO's vehicle classes that this is of."""

WINDOW = 6.0
"""Metres over which a bend is a mean: drivers do not follow every kink of a line."""

BINDING = 0.92
"""Share of the limit from which on a curve is none to slow down for."""

LEAST_CURVE = 10.0
"""Metres of a curve, or between curves, at least."""

LEAST_SPEED = 2.0
"""m/s."""

_BAND = np.log(1.25)
"""Speeds within a quarter of each other are one curve's."""

_STRAIGHT = 1e-6
"""1/m."""

_MARGIN = 3.0
"""Metres before and behind a bend in which its speed is driven, too."""


def comfortable_speed(curvature: FloatArray | float, *, share: float = 1.0) -> FloatArray:
    """Speed in m/s at which drivers take a bend.

    Parameters
    ----------
    curvature
        1/m, of any sign and shape.
    share
        Of the lateral acceleration that drivers of cars choose.

    Returns
    -------
    The same shape; infinite where it is straight. ``v^2 |curvature| = a(v)``.
    """
    bend = np.abs(np.asarray(curvature, dtype=np.float64)) / share
    # v^2 |curvature| - a(v) grows with v: its root is above the last speed at which it is below 0.
    piece = (bend[..., None] * _SPEEDS[1:] ** 2 < _LATERAL[1:]).sum(axis=-1)
    slope, first = _SLOPES[piece], _LATERAL[piece] - _SLOPES[piece] * _SPEEDS[piece]
    with np.errstate(divide="ignore", invalid="ignore"):
        speed = (slope + np.sqrt(slope * slope + 4.0 * bend * first)) / (2.0 * bend)
    straight = (speed > _FASTEST) | (bend * share < _STRAIGHT)
    return np.where(straight, np.inf, np.maximum(speed, LEAST_SPEED))


def sharpest_bend(shape: FloatArray) -> float:
    """Greatest curvature of a line over :data:`WINDOW`, 1/m.

    Parameters
    ----------
    shape
        Vertices, ``(K, 2)`` or more columns, metres.
    """
    steps = np.diff(np.asarray(shape)[:, :2], axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    steps, lengths = steps[lengths > 1e-6], lengths[lengths > 1e-6]
    if len(lengths) < 2:
        return 0.0
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    # The heading of each chord is that of its middle; between them it turns evenly.
    ends = np.cumsum(lengths)
    middles = ends - 0.5 * lengths
    window = min(WINDOW, float(ends[-1]))
    start = np.linspace(0.0, ends[-1] - window, max(2, int(ends[-1] - window) + 2))
    turned = np.interp(start + window, middles, headings) - np.interp(start, middles, headings)
    return float(np.abs(turned).max() / window)


class RoadCurves:
    """Bends of all roads of a map.

    Parameters
    ----------
    table
        Of the map.
    roads
        Rows of the roads that are asked for.
    """

    def __init__(self, table: RoadTable, roads: Sequence[int]) -> None:
        self._table = table
        length = np.array([table.road_length[road] for road in roads], dtype=np.float64)
        counts = np.ceil(length).astype(np.int64) + 1
        owner = np.repeat(np.arange(len(roads)), counts)
        first = np.cumsum(counts) - counts
        s = (np.arange(counts.sum()) - first[owner]) * (length / np.maximum(counts - 1, 1))[owner]
        rows = np.asarray(roads, dtype=np.int64)[owner]
        before = np.maximum(s - WINDOW / 2.0, 0.0)
        behind = np.minimum(s + WINDOW / 2.0, length[owner])
        turned = table.reference(rows, behind).hdg - table.reference(rows, before).hdg
        turned = np.mod(turned + np.pi, 2.0 * np.pi) - np.pi
        bend = turned / np.maximum(behind - before, 1e-3)
        self._profiles = {
            road: (s[a : a + n], bend[a : a + n])
            for road, a, n in zip(roads, first.tolist(), counts.tolist(), strict=True)
        }

    def lane_bends(self, road: int, offsets: FloatArray, start: float, end: float) -> FloatArray:
        """Sharpest curvature of lanes between two places of a road, 1/m, without its sign.

        Parameters
        ----------
        offsets
            t of the centre of each lane, metres, shape ``(L,)``.
        start, end
            Metres of s.
        """
        s, bend = self._profiles[road]
        # A bend that reaches in from the next part is that one's, and slowed down for before it.
        left_out = min(WINDOW, 0.25 * (end - start))
        inside = bend[(s >= start + left_out) & (s <= end - left_out)]
        if not len(inside):
            inside = np.array([np.interp(0.5 * (start + end), s, bend)])
        sharp = inside[np.argmax(np.abs(inside))]
        bends: FloatArray = np.abs(sharp) / np.maximum(1.0 - sharp * offsets, 0.2)
        return bends

    def cuts(self, road: int, limit: float) -> list[float]:
        """Places at which a road is cut because another speed is driven behind them, s in metres.

        Parameters
        ----------
        limit
            Highest of the road, m/s: curves that can be driven with it are none.
        """
        s, bend = self._profiles[road]
        speed = comfortable_speed(bend) if np.abs(bend).max(initial=0.0) > 1e-6 else None
        if speed is None or not (speed < BINDING * limit).any() or len(s) < 3:
            return []
        speed = np.where(speed < BINDING * limit, speed, np.inf)
        reach = max(1, round(_MARGIN / (s[1] - s[0])))
        slow = np.array([speed[max(0, k - reach) : k + reach + 1].min() for k in range(len(speed))])
        bands = speed_bands(slow)
        edges = [0, *(np.flatnonzero(np.diff(bands)) + 1).tolist(), len(s)]
        parts = [[a, b, float(slow[a:b].min())] for a, b in pairwise(edges)]
        # A part that is too short joins the neighbour that is slower, as nobody drives faster
        # for a few metres; the slowest takes its room from what it joins.
        while len(parts) > 1:
            n = min(range(len(parts)), key=lambda k: s[int(parts[k][1]) - 1] - s[int(parts[k][0])])
            a, b, own = parts[n]
            if s[int(b) - 1] - s[int(a)] >= LEAST_CURVE - 1.0:
                break
            sides = [k for k in (n - 1, n + 1) if 0 <= k < len(parts)]
            other = min(sides, key=lambda k: abs(np.log(min(parts[k][2], 200.0) / min(own, 200.0))))
            low, high = min(n, other), max(n, other)
            parts[low : high + 1] = [
                [parts[low][0], parts[high][1], min(own, float(parts[other][2]))]
            ]
        return [float(s[int(a)]) for a, _, _ in parts[1:]]


def speed_bands(speeds: FloatArray | float) -> FloatArray:
    """Whole numbers that are the same for speeds (m/s) of one curve; -1 where there is none."""
    known = np.asarray(speeds, dtype=np.float64)
    finite = np.isfinite(known)
    return np.where(finite, np.floor(np.log(np.where(finite, known, 1.0)) / _BAND), -1.0)
