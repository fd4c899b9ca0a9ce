"""Normal SUMO lanes found on OpenDRIVE lanes, by geometry alone.

Each lane of the network is sampled; a sample belongs to the nearest OpenDRIVE lane of its kind with
the same direction. Consecutive samples on one lane make a lane mapping interval.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from odscen.convert.lane_table.table import MappingInterval, monotone
from odscen.lanegraph.pedestrian_graph import ROADSIDE_OFFSET

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.opendrive.lanes import RoadTable


STEP = 1.0
"""Metres between samples; curves of 6 m radius are then followed within 2 cm."""

MOST_SAMPLES = 300_000
"""Maps with more than 300 km of lanes are sampled less densely, and so are absurd ones."""


def _count_samples(lengths: FloatArray, step: float) -> IntArray:
    """Count samples per line, both ends included."""
    step = max(step, float(lengths.sum()) / MOST_SAMPLES)
    return np.maximum(1, np.ceil(lengths / step - 1e-9)).astype(np.int64) + 1


def _sample_fractions(counts: IntArray) -> tuple[IntArray, IntArray, FloatArray]:
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
        first, owner, share = _sample_fractions(_count_samples(np.abs(end - start), step))
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
        first, owner, _ = _sample_fractions(counts)
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
    first, owner, share = _sample_fractions(_count_samples(line.length, step))
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


REACH = 2.0
"""Metres: a SUMO lane farther than this beside an OpenDRIVE lane is not that lane."""
SAME_DIRECTION = 0.7
"""Cosine: directions up to 45 degrees apart count as the same."""
FLATTEN = 0.5
"""Share of heights that counts: decks are told apart, superelevation (SUMO has none) is not."""
NEIGHBOURS = 10
_AT_ONCE = 20_000
"""Places: keeps the memory that finding neighbours takes below 20 MB."""

_TIP = 0.5
"""Metres: shorter intervals at the ends of a SUMO lane may be mere touches of another lane."""
_STRAY = 3
"""Samples: a shorter run on another lane, between two runs on the same lane, is a stray."""


class LaneMatch(NamedTuple):
    """Places on OpenDRIVE lanes; ``lane`` is a position in ``LaneSamples.rows``, -1 for none."""

    lane: IntArray
    s: FloatArray
    deviation: FloatArray


def match(
    places: ShapeSamples,
    lanes: LaneSamples,
    table: RoadTable,
    *,
    penalty: FloatArray,
    either_way: bool = False,
) -> LaneMatch:
    """Find the nearest lane of the same direction for each place.

    Parameters
    ----------
    penalty
        Metres by which each lane must be nearer than others to be taken.
    either_way
        Whether lanes of opposite direction count too (sidewalks have none).
    """
    count = len(places.owner)
    if not count or not len(lanes.owner):
        return LaneMatch(np.full(count, -1, dtype=np.int64), np.zeros(count), np.zeros(count))
    nearest = _NearestLane(lanes, penalty, either_way=either_way).nearest(places.xyz, places.hdg)
    found = nearest >= 0
    base = np.maximum(nearest, 0)
    owner = lanes.owner[base]
    rows = lanes.rows[owner]
    rate = _compute_s_per_metre(lanes)[base]
    s = lanes.s[base] + _measure_along(places.xyz, lanes.xyz[base], lanes.hdg[base]) * rate
    low, high = table.lane_s0[rows], table.lane_s1[rows]
    deviation = np.zeros(count)
    # On a curve the point beside a place is not where the tangent has it: the second step corrects
    # the first one.
    for _ in range(2):
        s = np.clip(s, low, high)
        xyz, hdg = middle_points(table, rows, s, roadside=lanes.roadside[owner])
        hdg = hdg + np.where(table.lane_forward[rows], 0.0, np.pi)
        ahead = _measure_along(places.xyz, xyz, hdg)
        delta = places.xyz - xyz
        deviation = np.hypot(delta[:, 0], delta[:, 1])
        s = s + ahead * rate
    found &= deviation <= REACH + 1.0
    return LaneMatch(np.where(found, owner, -1), np.clip(s, low, high), deviation)


class _NearestLane:
    """Finds the samples whose lanes pass closest to places."""

    def __init__(self, lanes: LaneSamples, penalty: FloatArray, *, either_way: bool) -> None:
        self._lanes = lanes
        self._penalty = penalty
        self._either_way = either_way
        self._squeeze = np.array([1.0, 1.0, FLATTEN])
        self._tree = cKDTree(lanes.xyz * self._squeeze)
        self._first = np.zeros(len(lanes.owner), dtype=np.bool_)
        self._first[lanes.first[:-1]] = True
        self._last = np.zeros(len(lanes.owner), dtype=np.bool_)
        self._last[lanes.first[1:] - 1] = True
        steps = np.diff(lanes.first) - 1
        self._step = np.array([lanes.length(lane) for lane in range(len(steps))]) / steps
        self._reach = REACH + float(self._step.max())

    def nearest(self, xyz: FloatArray, hdg: FloatArray) -> IntArray:
        """Index of the best sample for each place, -1 for none."""
        nearest_samples = [
            self._nearest_of_some(xyz[start : start + _AT_ONCE], hdg[start : start + _AT_ONCE])
            for start in range(0, len(xyz), _AT_ONCE)
        ]
        return np.concatenate(nearest_samples)

    def _nearest_of_some(self, xyz: FloatArray, hdg: FloatArray) -> IntArray:
        lanes = self._lanes
        neighbours = min(NEIGHBOURS, len(lanes.owner))
        _, index = self._tree.query(
            xyz * self._squeeze, k=neighbours, distance_upper_bound=self._reach, workers=1
        )
        index = np.asarray(index, dtype=np.int64).reshape(len(xyz), neighbours)
        missing = index >= len(lanes.owner)
        index = np.where(missing, 0, index)
        delta = xyz[:, None, :] - lanes.xyz[index]
        cos, sin = np.cos(lanes.hdg[index]), np.sin(lanes.hdg[index])
        across = np.abs(delta[..., 1] * cos - delta[..., 0] * sin)
        beyond = self._metres_beyond_ends(delta[..., 0] * cos + delta[..., 1] * sin, index)
        agree = np.cos(hdg[:, None] - lanes.hdg[index])
        if self._either_way:
            agree = np.abs(agree)
        cost = np.hypot(across, beyond) + FLATTEN * np.abs(delta[..., 2])
        cost = np.where(missing | (agree < SAME_DIRECTION) | (across > REACH), np.inf, cost)
        best = np.argmin(cost + self._penalty[lanes.owner[index]], axis=1)
        rows = np.arange(len(best))
        return np.where(np.isfinite(cost[rows, best]), index[rows, best], -1)

    def _metres_beyond_ends(self, along: FloatArray, index: IntArray) -> FloatArray:
        """Metres that places, ``along`` metres ahead of samples, lie past the ends of the lane."""
        outside = (self._last[index] & (along > 0.0)) | (self._first[index] & (along < 0.0))
        # Elsewhere a sample half a step further on is nearer; a little more allows for curves.
        step = self._step[self._lanes.owner[index]]
        past: FloatArray = np.abs(along) - np.where(outside, 0.0, 0.6 * step)
        return np.maximum(past, 0.0)


def _measure_along(places: FloatArray, origin: FloatArray, hdg: FloatArray) -> FloatArray:
    delta = places - origin
    along: FloatArray = delta[:, 0] * np.cos(hdg) + delta[:, 1] * np.sin(hdg)
    return along


def _compute_s_per_metre(lanes: LaneSamples) -> FloatArray:
    """Change of s per metre in driving direction, at each sample."""
    ds, da = np.diff(lanes.s), np.diff(lanes.arc)
    joints = lanes.first[1:-1] - 1
    da[joints] = 0.0
    rate = np.divide(ds, da, out=np.zeros_like(ds), where=da > 1e-6)
    after, before = np.append(rate, 0.0), np.insert(rate, 0, 0.0)
    mean: FloatArray = np.where((after != 0) & (before != 0), 0.5, 1.0) * (after + before)
    return mean


def intervals_of(
    places: ShapeSamples,
    found: LaneMatch,
    lanes: LaneSamples,
    table: RoadTable,
    *,
    sumo_rows: IntArray,
    lengths: FloatArray,
) -> list[MappingInterval]:
    """Join consecutive places on one OpenDRIVE lane to intervals.

    Parameters
    ----------
    sumo_rows
        Row of the SUMO lane of each shape that was sampled.
    lengths
        Length attribute of those lanes, metres: what their positions run to.
    """
    scale = np.divide(lengths, places.length, out=np.ones_like(lengths), where=places.length > 1e-9)
    intervals: list[MappingInterval] = []
    for shape, row in enumerate(sumo_rows):
        part = slice(int(places.first[shape]), int(places.first[shape + 1]))
        pos = np.minimum(places.arc[part] * scale[shape], lengths[shape])
        runs = _find_lane_runs(found.lane[part])
        own = [
            _LaneRun(lane, pos[a:b], found.s[part][a:b], found.deviation[part][a:b])
            for lane, a, b in runs
        ]
        own = _drop_tips(_extend_runs_to_ends(own, lanes, table), lanes)
        for run in own:
            interval = MappingInterval(run.lane, int(row), run.pos, run.s, run.deviation)
            kept = monotone(interval, growing=_s_grows_along(run, lanes, table))
            if kept is not None:
                intervals.append(kept)
    return intervals


class _LaneRun(NamedTuple):
    lane: int
    pos: FloatArray
    s: FloatArray
    deviation: FloatArray


def _find_lane_runs(lane: IntArray) -> list[tuple[int, int, int]]:
    """Stretches of equal, found lanes as (lane, first, end), short strays removed."""
    cuts = np.flatnonzero(np.diff(lane)) + 1
    bounds = [0, *cuts.tolist(), len(lane)]
    runs = [(int(lane[a]), a, b) for a, b in pairwise(bounds)]
    runs = [run for run in runs if run[0] >= 0]
    kept: list[tuple[int, int, int]] = []
    for position, (row, a, b) in enumerate(runs):
        before = kept[-1] if kept else None
        after = runs[position + 1] if position + 1 < len(runs) else None
        stray = b - a < _STRAY and before and after and before[0] == after[0] != row
        if stray:
            continue
        if before and before[0] == row:
            kept[-1] = (row, before[1], b)
        else:
            kept.append((row, a, b))
    return kept


def _extend_runs_to_ends(
    runs: list[_LaneRun], lanes: LaneSamples, table: RoadTable
) -> list[_LaneRun]:
    """Extend consecutive runs to the ends of their lanes, where the next one begins.

    Between the last sample on one lane and the first on the next lie the end of the one and the
    start of the other; the position where they meet divides the step in the ratio of the two.
    """
    made = list(runs)
    for i in range(len(made) - 1):
        one, two = made[i], made[i + 1]
        _, exit_s = _find_run_ends(one, lanes, table)
        entry_s, _ = _find_run_ends(two, lanes, table)
        rest, start = abs(exit_s - one.s[-1]), abs(entry_s - two.s[0])
        step = two.pos[0] - one.pos[-1]
        if rest + start > 3.0 * step + 0.5 or step <= 0:
            continue
        share = 0.5 if rest + start < 1e-9 else rest / (rest + start)
        border = one.pos[-1] + share * step
        made[i] = _LaneRun(
            one.lane,
            np.append(one.pos, border),
            np.append(one.s, exit_s),
            np.append(one.deviation, one.deviation[-1]),
        )
        made[i + 1] = _LaneRun(
            two.lane,
            np.insert(two.pos, 0, border),
            np.insert(two.s, 0, entry_s),
            np.insert(two.deviation, 0, two.deviation[0]),
        )
    return made


def _drop_tips(runs: list[_LaneRun], lanes: LaneSamples) -> list[_LaneRun]:
    """Drop what a SUMO lane touches of the lanes before and after its own at its very ends.

    Roads overlap a little where they meet; a run that covers most of a short lane stays.
    """
    kept = list(runs)
    for end in (0, -1):
        if len(kept) < 2:
            break
        run = kept[end]
        extent = float(run.pos[-1] - run.pos[0])
        if extent < _TIP and extent < 0.5 * lanes.length(run.lane):
            kept.pop(end)
    return kept


def _s_grows_along(run: _LaneRun, lanes: LaneSamples, table: RoadTable) -> bool:
    """Whether s grows along a run; a run of one sample follows the traffic."""
    if len(run.s) > 1 and run.s[-1] != run.s[0]:
        return bool(run.s[-1] > run.s[0])
    return bool(table.lane_forward[lanes.rows[run.lane]])


def _find_run_ends(run: _LaneRun, lanes: LaneSamples, table: RoadTable) -> tuple[float, float]:
    """Values of s at which a run would enter and leave its lane."""
    row = int(lanes.rows[run.lane])
    low, high = float(table.lane_s0[row]), float(table.lane_s1[row])
    return (low, high) if _s_grows_along(run, lanes, table) else (high, low)
