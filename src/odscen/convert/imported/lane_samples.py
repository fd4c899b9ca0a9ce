"""Places along lanes of both worlds, for many lanes at once.

Two flat tables: :class:`LaneSamples` of OpenDRIVE lanes and :class:`ShapeSamples` of SUMO lanes,
both in driving direction, in the OpenDRIVE frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.lanegraph.pedestrian_graph import ROADSIDE_OFFSET

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.opendrive.lanes import RoadTable

STEP = 1.0
"""Metres between samples; curves of 6 m radius are then followed within 2 cm."""

MOST_SAMPLES = 300_000
"""Maps with more than 300 km of lanes are sampled less densely, and so are absurd ones."""


def _counts(lengths: FloatArray, step: float) -> IntArray:
    """Count samples per line, both ends included."""
    step = max(step, float(lengths.sum()) / MOST_SAMPLES)
    return np.maximum(1, np.ceil(lengths / step - 1e-9)).astype(np.int64) + 1


def _fractions(counts: IntArray) -> tuple[IntArray, IntArray, FloatArray]:
    """First sample of each line (one more at the end), line of each sample, share from 0 to 1."""
    first = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
    owner = np.repeat(np.arange(len(counts)), counts)
    within = np.arange(first[-1]) - first[owner]
    return first, owner, within / (counts[owner] - 1)


@dataclass(frozen=True, slots=True, eq=False)
class LaneSamples:
    """Samples of chosen OpenDRIVE lanes, in driving direction.

    Attributes
    ----------
    rows
        Shape ``(L,)``: the lanes, rows of ``RoadTable.lane_keys``.
    roadside
        Shape ``(L,)``: whether the walk beside the lane is meant, not the lane.
    first
        Shape ``(L + 1,)``: samples of lane ``i`` are ``first[i]`` up to ``first[i + 1]``.
    owner
        Shape ``(N,)``: position in ``rows`` of each sample.
    s, arc
        Road coordinate; length along the lane's centre line from where traffic enters it; metres.
    xyz, hdg
        Shape ``(N, 3)`` and ``(N,)``: position; driving direction in radians.
    """

    rows: IntArray
    roadside: BoolArray
    first: IntArray
    owner: IntArray
    s: FloatArray
    arc: FloatArray
    xyz: FloatArray
    hdg: FloatArray

    @classmethod
    def of(
        cls,
        table: RoadTable,
        rows: IntArray,
        *,
        roadside: BoolArray | None = None,
        step: float = STEP,
    ) -> LaneSamples:
        """Sample lane rows ``rows`` about every ``step`` metres of s, ends included."""
        roadside = np.zeros(len(rows), dtype=np.bool_) if roadside is None else roadside
        start = np.where(table.lane_forward[rows], table.lane_s0[rows], table.lane_s1[rows])
        end = np.where(table.lane_forward[rows], table.lane_s1[rows], table.lane_s0[rows])
        first, owner, share = _fractions(_counts(np.abs(end - start), step))
        s = start[owner] + share * (end - start)[owner]
        xyz, hdg = middle_points(table, rows[owner], s, roadside=roadside[owner])
        gaps = np.zeros(len(s))
        gaps[1:] = np.hypot(*np.diff(xyz[:, :2], axis=0).T)
        gaps[first[:-1]] = 0.0
        total = np.cumsum(gaps)
        turn = np.where(table.lane_forward[rows[owner]], 0.0, np.pi)
        arc = total - total[first[owner]]
        return cls(rows, roadside, first, owner, s, arc, xyz, hdg + turn)

    def chosen(self, lanes: IntArray) -> LaneSamples:
        """Keep only lanes ``lanes`` (positions in ``rows``)."""
        counts = np.diff(self.first)[lanes]
        first, owner, _ = _fractions(counts)
        samples = self.first[lanes][owner] + np.arange(first[-1]) - first[owner]
        return LaneSamples(
            self.rows[lanes],
            self.roadside[lanes],
            first,
            owner,
            self.s[samples],
            self.arc[samples],
            self.xyz[samples],
            self.hdg[samples],
        )

    def part(self, lane: int) -> slice:
        """Slice of the samples of lane ``lane`` (position in ``rows``)."""
        return slice(int(self.first[lane]), int(self.first[lane + 1]))

    def length(self, lane: int) -> float:
        """Length of the lane's centre line, metres."""
        return float(self.arc[self.first[lane + 1] - 1])

    def arc_at(self, lane: int, s: float) -> float:
        """Length along the lane from its entry to ``s``."""
        part = self.part(lane)
        known = self.s[part]
        if known[0] > known[-1]:
            return float(np.interp(-s, -known, self.arc[part]))
        return float(np.interp(s, known, self.arc[part]))

    def s_at(self, lane: int, arc: FloatArray) -> FloatArray:
        """Inverse of :meth:`arc_at` for many places."""
        part = self.part(lane)
        return np.interp(arc, self.arc[part], self.s[part])


def middle_points(
    table: RoadTable, rows: IntArray, s: FloatArray, *, roadside: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Middle of lanes, or of the walks beside them: places ``(N, 3)``, headings of growing s."""
    points = table.lane_points(rows, s, at=np.where(roadside, 1.0, 0.5))
    out = np.where(roadside, ROADSIDE_OFFSET, 0.0) * np.sign(table.lane_id[rows])
    x, y = points.x - out * np.sin(points.hdg), points.y + out * np.cos(points.hdg)
    return np.column_stack((x, y, points.z)), points.hdg


class ShapeSamples(NamedTuple):
    """Samples along shapes.

    Attributes
    ----------
    first, owner
        As in :class:`LaneSamples`.
    arc
        Length along the shape (in space, as SUMO measures it), metres.
    xyz, hdg
        Position; direction of the segment in radians.
    length
        Shape ``(L,)``: length of each shape, metres.
    """

    first: IntArray
    owner: IntArray
    arc: FloatArray
    xyz: FloatArray
    hdg: FloatArray
    length: FloatArray


def sample_shapes(shapes: Sequence[FloatArray], *, step: float = STEP) -> ShapeSamples:
    """Sample polylines of shape ``(K, 3)`` about every ``step`` metres, ends included."""
    line = SampledLines.of(shapes)
    first, owner, share = _fractions(_counts(line.length, step))
    arc = share * line.length[owner]
    xyz, hdg = line.at(owner, arc)
    return ShapeSamples(first, owner, arc, xyz, hdg, line.length)


@dataclass(frozen=True, slots=True, eq=False)
class SampledLines:
    """Many polylines, evaluated together."""

    first: IntArray
    points: FloatArray
    arc: FloatArray
    start: FloatArray
    length: FloatArray

    @classmethod
    def of(cls, shapes: Sequence[FloatArray]) -> SampledLines:
        """Put shapes ``(K, 3)``, K >= 1, one after the other."""
        counts = np.array([len(shape) for shape in shapes], dtype=np.int64)
        first = np.concatenate(([0], np.cumsum(counts))).astype(np.int64)
        points = np.concatenate([*shapes, np.zeros((0, 3))])
        gaps = np.zeros(len(points))
        gaps[1:] = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
        gaps[first[:-1]] = 0.0
        arc = np.cumsum(gaps)
        start = arc[first[:-1]]
        return cls(first, points, arc, start, arc[first[1:] - 1] - start)

    def at(self, line: IntArray, arc: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points ``(N, 3)`` at ``arc`` metres along lines ``line``, and headings ``(N,)``."""
        where = self.start[line] + arc
        low, high = self.first[line], self.first[line + 1] - 1
        index = np.clip(np.searchsorted(self.arc, where, side="right") - 1, low, high - 1)
        index = np.maximum(index, low)
        after = np.minimum(index + 1, high)
        span = self.arc[after] - self.arc[index]
        share = np.divide(where - self.arc[index], span, out=np.zeros_like(where), where=span > 0)
        delta = self.points[after] - self.points[index]
        xyz = self.points[index] + np.clip(share, 0.0, 1.0)[:, None] * delta
        return xyz, np.arctan2(delta[:, 1], delta[:, 0])
