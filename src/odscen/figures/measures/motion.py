"""Whether road users moved as bodies can: the plausibility check of recorded motion.

Every pair of records of one road user is held against what its body and its driver can do; what is
beyond is a finding with place, time and cause. Bounds per category are in :data:`BOUNDS`. A road
user that a rule moves, that is teleported or has collided moves by force: its findings say so, and
are not counted as implausible.

Sources of the bounds: lateral and longitudinal accelerations beyond those that drivers choose,
Bosetti, Da Lio and Saroldi, "On the human control of vehicles", European Transport Research Review
6, 2014, and AASHTO, "A Policy on Geometric Design", 2018, table 3-7; braking of 4.5 m/s2 and more
as that of emergencies, Fambro et al., "Determination of Stopping Sight Distances", NCHRP Report
400, 1997; steering, UNECE Regulation 107 and usual turning circles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.bends import largest_curvature
from odscen.base.categories import Category
from odscen.base.stored_files import tables
from odscen.figures.measures.figure import COUNT, Basis, Better, ReportSection, RunFigure
from odscen.records.replay import LANE_JOINT, SPEED_ERROR
from odscen.records.run_events import EventKind

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    import polars as pl

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.figures.measures.figure import RunData
    from odscen.records.run_events import Event
    from odscen.records.run_plan import Plan, PlannedActor

MOTION_TABLE = "motion.csv"
"""Name of the table of findings in the folder of figures."""

LONGEST_STEP = 1.0
"""Seconds between records; with more nothing of this can be seen."""


class MotionKind(StrEnum):
    """What can be wrong with a motion, in the order of the report."""

    JUMP = "jump"
    LATERAL_SPEED = "lateral speed"
    LATERAL_ACCELERATION = "lateral acceleration"
    ACCELERATION = "acceleration"
    HARD_BRAKING = "hard braking"
    BRAKING = "braking"
    JERK = "jerk"
    YAW_RATE = "yaw rate"
    BACKWARDS = "backwards"
    RECORDED_SPEED = "recorded speed"
    OFF_ROAD = "off the road"
    OVERLAP = "overlap"


KIND_UNITS: dict[MotionKind, str] = {
    MotionKind.JUMP: "m",
    MotionKind.LATERAL_SPEED: "m/s",
    MotionKind.LATERAL_ACCELERATION: "m/s2",
    MotionKind.ACCELERATION: "m/s2",
    MotionKind.HARD_BRAKING: "m/s2",
    MotionKind.BRAKING: "m/s2",
    MotionKind.JERK: "m/s3",
    MotionKind.YAW_RATE: "rad/s",
    MotionKind.BACKWARDS: "m",
    MotionKind.RECORDED_SPEED: "m/s",
    MotionKind.OFF_ROAD: "m",
    MotionKind.OVERLAP: "m",
}
"""Unit of the value of each kind."""


class MotionCause(StrEnum):
    """What a finding comes from; rules, teleports and collisions move by force.

    A path is tight where a lane of the map bends more than the wheels of the body steer.
    """

    RULE = "rule"
    TELEPORT = "teleport"
    COLLISION = "collision"
    EMERGENCY_STOP = "emergency stop"
    LANE_CHANGE = "lane change"
    TIGHT_PATH = "tight path"
    JUNCTION = "junction"
    LANE = "lane"


FORCED = (MotionCause.RULE, MotionCause.TELEPORT, MotionCause.COLLISION)
"""Causes that move a road user by force."""


@dataclass(frozen=True, slots=True)
class MotionBounds:
    """What the motion of a category is held against; infinite where nothing is.

    Attributes
    ----------
    lateral_speed
        m/s of the body's centre at right angles to its heading.
    lateral_acceleration, acceleration, braking
        m/s2; ``braking`` is what a body can, :data:`HARD_BRAKING` what a driver wants.
    jerk
        m/s3.
    steering_deg
        Angle of the wheels at most; the wheelbase is :data:`WHEELBASE` of the length.
    """

    lateral_speed: float
    lateral_acceleration: float
    acceleration: float
    braking: float
    jerk: float
    steering_deg: float


_WALKS = MotionBounds(math.inf, math.inf, 4.0, math.inf, math.inf, math.inf)
BOUNDS: dict[str, MotionBounds] = {
    Category.CAR: MotionBounds(2.0, 4.0, 5.0, 10.0, 15.0, 40.0),
    Category.VAN: MotionBounds(2.0, 4.0, 5.0, 10.0, 15.0, 40.0),
    Category.TRUCK: MotionBounds(2.0, 3.0, 3.0, 8.0, 15.0, 45.0),
    Category.BUS: MotionBounds(2.0, 3.0, 3.0, 8.0, 15.0, 50.0),
    Category.MOTORCYCLE: MotionBounds(2.0, 6.0, 8.0, 10.0, 20.0, 40.0),
    Category.BICYCLE: MotionBounds(2.0, 4.0, 3.0, 8.0, 15.0, 60.0),
    Category.PEDESTRIAN: _WALKS,
}
HARD_BRAKING = 4.5
"""m/s2: drivers brake harder in emergencies only."""
WHEELBASE = 0.6
"""Share of a body's length."""
WINDOW = 0.5
"""Seconds over which accelerations and jerk are means, at least: less is noise of lane shapes."""
JUMPED = 0.5
"""Metres that a road user is elsewhere than its speed says, beyond its lateral speed."""
WALKED = 3.0
"""m/s that a pedestrian may be faster than recorded before that is a jump."""
BACKED = 0.1
"""Metres backwards from one record to the next."""
YAW_SLACK = 0.05
"""Radians of heading between two records that are rounding and the bends of lane shapes."""
OFF_LANE = 0.3
"""Metres that the centre of a body may be beyond the border of the lanes."""
TOUCHING = 0.1
"""Metres by which bodies have to overlap."""
SAMPLED = 1.0
"""Seconds between the records at which overlaps and lanes are looked at, at least."""
_BEND = 2.0
"""Metres over which a bend of a lane is measured."""
_SHORT = 8.0
"""Metres of the diagonal of a body; longer ones are few."""
_EPISODE = 1.0
"""Seconds: findings of a road user that are closer are one."""
_AFTER = 5.0
"""Seconds after a collision in which what happens comes from it."""
_CHUNK = 2_000_000
"""Rows that are looked at together, about."""

_SCHEMA = {
    "kind": "text",
    "category": "text",
    "id": "text",
    "begin": "number",
    "end": "number",
    "x": "number",
    "y": "number",
    "lane": "text",
    "value": "number",
    "bound": "number",
    "cause": "text",
    "partner": "text",
}
COLUMNS = tuple(_SCHEMA)
"""Of the table of findings."""


@dataclass(frozen=True, slots=True)
class RoadLanes:
    """Lanes that vehicles use, for bodies off the road and changes of lanes.

    Attributes
    ----------
    edges
        Edge of each lane; those inside junctions in ``inside``, which has their lanes.
    names, lines, widths
        Ids, centre lines of shape ``(K, 2)``, metres, OpenDRIVE frame, and widths, m; equally many.
    """

    edges: Mapping[str, str]
    inside: frozenset[str]
    names: Sequence[str]
    lines: Sequence[FloatArray]
    widths: Sequence[float]
    _curvatures: dict[str, float] = field(default_factory=dict)

    def curvature_of(self, name: str) -> float:
        """Largest curvature of a lane, 1/m; 0 of one that is not known."""
        if not self._curvatures:
            self._curvatures.update(
                (lane, largest_curvature(line, _BEND))
                for lane, line in zip(self.names, self.lines, strict=True)
            )
        return self._curvatures.get(name, 0.0)


class _Step(NamedTuple):
    """Findings before they are joined: rows of the sorted table with a value of one kind."""

    kind: MotionKind
    rows: IntArray
    values: FloatArray
    bounds: FloatArray
    partners: IntArray | None = None


def check_motion(
    rows: pl.DataFrame, plan: Plan, events: Iterable[Event] = (), lanes: RoadLanes | None = None
) -> pl.DataFrame | None:
    """Find what no body or driver does in the records of a run.

    Parameters
    ----------
    rows
        Of :func:`odscen.records.replay.body_centres`: body centres in the OpenDRIVE frame.
    plan
        Has bodies, and the length of a step.
    events
        Of the run, for causes.
    lanes
        Of its network; without them bodies off the road are not found.

    Returns
    -------
    One row per finding, in order of time: ``kind``, ``category``, ``id``, ``begin``, ``end`` (s),
    ``x``, ``y`` (m, body centre at its worst), ``lane`` (of SUMO), ``value`` (worst, in the unit
    of :data:`KIND_UNITS`), ``bound``, ``cause``, ``partner`` (of overlaps). ``None`` if the records
    are more than :data:`LONGEST_STEP` apart.
    """
    import polars as pl

    times = np.unique(rows["time"].to_numpy())
    step = float(np.median(np.diff(times))) if len(times) > 1 else plan.step_length
    if step > LONGEST_STEP + 1e-6:
        return None
    forced = _forced_times(events, step)
    found = []
    chunks = max(1, -(-len(rows) // _CHUNK))
    last = max(len(times) - 1, 0)
    borders = times[np.linspace(0, last, chunks + 1).astype(int)] if len(times) else times
    for begin, end in pairwise(borders.tolist()):
        # Windows of accelerations reach into the next chunk.
        part = rows.filter(pl.col("time").is_between(begin, end + 3.0 * WINDOW))
        found.append(_check_part(part, plan, forced, lanes, step))
    table = pl.concat(found) if found else _empty_findings()
    # What lies in the reach of two chunks was found twice.
    return table.unique(subset=["kind", "id", "begin"], keep="first", maintain_order=True).sort(
        "begin", "id", "kind", maintain_order=True
    )


def _empty_findings() -> pl.DataFrame:
    import polars as pl

    types = {"text": pl.String, "number": pl.Float64}
    return pl.DataFrame(schema={name: types[kind] for name, kind in _SCHEMA.items()})


def _check_part(
    rows: pl.DataFrame,
    plan: Plan,
    forced: Mapping[str, Sequence[tuple[float, float, MotionCause]]],
    lanes: RoadLanes | None,
    step: float,
) -> pl.DataFrame:
    rows = rows.sort("row", "time", maintain_order=True)
    time, row, x, y, hdg, speed = (
        rows[name].to_numpy() for name in ("time", "row", "x", "y", "hdg", "speed")
    )
    length = np.array([actor.length for actor in plan.actors])[row]
    width = np.array([actor.width for actor in plan.actors])[row]
    names = [str(actor.category) for actor in plan.actors]
    walking = np.array([name == Category.PEDESTRIAN for name in names], dtype=bool)[row]
    limits = np.array([_bounds_row(BOUNDS.get(name, _WALKS)) for name in names]).T[:, row]
    if not len(rows):
        return _empty_findings()
    steps = _check_steps(time, row, x, y, hdg, speed, length, walking, limits, step)
    if lanes is not None:
        recorded = rows["lane"] if "lane" in rows.columns else None
        steps += _find_off_road(time, x, y, speed, walking, recorded, lanes, step)
    steps += _find_overlaps(time, row, x, y, hdg, length, width, step)
    return _join_findings(steps, rows, plan, forced, lanes, step)


def _bounds_row(bounds: MotionBounds) -> tuple[float, ...]:
    # Of the front axle, m: the least radius of its path, for a body of 1 m.
    sine = math.sin(math.radians(min(bounds.steering_deg, 90.0)))
    radius = WHEELBASE / sine if math.isfinite(bounds.steering_deg) else 0.0
    return (
        bounds.lateral_speed,
        bounds.lateral_acceleration,
        bounds.acceleration,
        bounds.braking,
        bounds.jerk,
        radius,
    )


def _check_steps(
    time: FloatArray,
    row: IntArray,
    x: FloatArray,
    y: FloatArray,
    hdg: FloatArray,
    speed: FloatArray,
    length: FloatArray,
    walking: BoolArray,
    limits: FloatArray,
    step: float,
) -> list[_Step]:
    """Findings between records of one road user; arrays of shape ``(N,)``, by user and time."""
    steps: list[_Step] = []
    dt = np.diff(time)
    joined = (row[1:] == row[:-1]) & (dt > 1e-6) & (dt < 1.5 * step)
    now = np.flatnonzero(joined)
    later, dt = now + 1, dt[now]
    lateral_bound, radius = limits[0, later], limits[5, later]
    walking = walking[later]

    def keep(
        kind: MotionKind, mask: BoolArray, values: FloatArray, bounds: FloatArray | float
    ) -> None:
        at = np.flatnonzero(mask)
        if len(at):
            known = np.broadcast_to(np.asarray(bounds, dtype=np.float64), mask.shape)[at]
            steps.append(_Step(kind, later[at], values[at], known))

    turned = np.mod(hdg[later] - hdg[now] + np.pi, 2.0 * np.pi) - np.pi
    middle = hdg[now] + 0.5 * turned
    ahead_x, ahead_y = np.cos(middle), np.sin(middle)
    dx, dy = x[later] - x[now], y[later] - y[now]
    along, aside = dx * ahead_x + dy * ahead_y, np.abs(dy * ahead_x - dx * ahead_y)
    low, high = np.minimum(speed[now], speed[later]), np.maximum(speed[now], speed[later])

    # A jump: elsewhere than the speeds of both records lead, or aside.
    beyond = np.maximum(np.maximum(along - high * dt, low * dt - along), 0.0)
    swing = np.abs(turned) * 0.5 * length[later]  # which the centre of a body makes by turning
    apart = np.hypot(beyond, np.where(walking, 0.0, np.maximum(aside - lateral_bound * dt, 0.0)))
    backwards = ~walking & (along < -BACKED - swing) & (-along < (high + 1.0) * dt)
    jumped = apart > JUMPED + swing + np.where(walking, WALKED * dt, 0.0)
    jumped &= ~backwards
    keep(MotionKind.JUMP, jumped, np.hypot(beyond, np.where(walking, 0.0, aside)), JUMPED)
    smooth = ~jumped & ~backwards
    keep(
        MotionKind.LATERAL_SPEED,
        smooth & (aside > lateral_bound * dt + 0.02),
        aside / dt,
        lateral_bound,
    )

    # Speed of the front, which SUMO's speed is of: the arc over the chord between two places.
    # People turn on the spot, so theirs is that of the centre.
    reach = np.where(limits[0] < math.inf, 0.5 * length, 0.0)
    front_x, front_y = x + reach * np.cos(hdg), y + reach * np.sin(hdg)
    chord = np.hypot(front_x[later] - front_x[now], front_y[later] - front_y[now])
    half = np.minimum(np.abs(turned), 2.0) / 2.0
    covered = chord * np.where(half > 1e-6, half / np.maximum(np.sin(half), 1e-9), 1.0) / dt
    error = np.maximum(np.maximum(chord / dt - high, low - covered), 0.0)
    excusable = SPEED_ERROR + LANE_JOINT / dt
    keep(MotionKind.RECORDED_SPEED, smooth & (error > excusable), error, excusable)

    turns = np.abs(turned)
    possible = np.where(radius > 0.0, chord / np.maximum(radius * length[later], 1e-9), np.inf)
    keep(MotionKind.YAW_RATE, smooth & (turns > possible + YAW_SLACK), turns / dt, possible / dt)
    keep(MotionKind.BACKWARDS, backwards, -along, BACKED)

    # Means over windows: velocities from positions, speeds as recorded.
    count = max(1, round(WINDOW / step))
    stretch = np.concatenate(([0], np.cumsum(~joined)))
    first = np.arange(max(0, len(time) - count))
    first = first[stretch[first] == stretch[first + count]]
    last = first + count
    gain = (speed[last] - speed[first]) / (time[last] - time[first])
    drives = limits[0, last] < math.inf
    for kind, values, bounds in (
        (MotionKind.ACCELERATION, gain, limits[2, last]),
        (MotionKind.BRAKING, -gain, limits[3, last]),
        (MotionKind.HARD_BRAKING, -gain, np.where(drives, HARD_BRAKING, math.inf)),
    ):
        at = np.flatnonzero(values > bounds + 0.05)
        if len(at):
            steps.append(_Step(kind, last[at], values[at], bounds[at]))
    first = np.arange(max(0, len(time) - 2 * count))
    first = first[stretch[first] == stretch[first + 2 * count]]
    mid, last = first + count, first + 2 * count
    one, two = time[mid] - time[first], time[last] - time[mid]
    change_x = (x[last] - x[mid]) / two - (x[mid] - x[first]) / one
    change_y = (y[last] - y[mid]) / two - (y[mid] - y[first]) / one
    span = 0.5 * (one + two)
    sideways = np.abs(change_y * np.cos(hdg[mid]) - change_x * np.sin(hdg[mid])) / span
    jumps = np.concatenate(([0], np.cumsum(_flag_rows(jumped, later, len(time)))))
    whole = jumps[last + 1] == jumps[first + 1]
    bound = limits[1, mid]
    at = np.flatnonzero(whole & (sideways > bound + 0.1))
    if len(at):
        steps.append(_Step(MotionKind.LATERAL_ACCELERATION, mid[at], sideways[at], bound[at]))
    jerk = np.abs((speed[last] - speed[mid]) / two - (speed[mid] - speed[first]) / one) / span
    bound = limits[4, mid]
    at = np.flatnonzero(whole & (jerk > bound + 0.1))
    if len(at):
        steps.append(_Step(MotionKind.JERK, mid[at], jerk[at], bound[at]))
    return steps


def _flag_rows(mask: BoolArray, rows: IntArray, count: int) -> IntArray:
    flags = np.zeros(count, dtype=np.int64)
    flags[rows[mask]] = 1
    return flags


def _sample_rows(time: FloatArray, step: float) -> BoolArray:
    """Rows at which overlaps and lanes are looked at: one record in so many."""
    every = max(1, round(SAMPLED / step))
    number = np.rint(time / step).astype(np.int64)
    sampled: BoolArray = number % every == 0
    return sampled


def _find_off_road(
    time: FloatArray,
    x: FloatArray,
    y: FloatArray,
    speed: FloatArray,
    walking: BoolArray,
    names: pl.Series | None,
    lanes: RoadLanes,
    step: float,
) -> list[_Step]:
    """Vehicles under way whose centre is beyond the border of every lane."""
    import shapely

    rows = np.flatnonzero(_sample_rows(time, step) & ~walking & (speed > 0.5))
    if not len(rows) or not len(lanes.lines):
        return []
    lines = np.array([shapely.LineString(line) for line in lanes.lines])
    half = np.asarray(lanes.widths) / 2.0
    points = shapely.points(x[rows], y[rows])
    # Most are on the lane that is recorded, which is the front's; the others may be on any.
    beyond = np.full(len(rows), np.inf)
    number = {lane: index for index, lane in enumerate(lanes.names)}
    known_lanes = [None] * len(rows) if names is None else names.gather(rows).to_list()
    own = np.array([number.get(lane or "", -1) for lane in known_lanes], dtype=np.int64)
    known = np.flatnonzero(own >= 0)
    beyond[known] = shapely.distance(points[known], lines[own[known]]) - half[own[known]]
    elsewhere = np.flatnonzero(beyond > OFF_LANE)
    beyond[elsewhere] = np.inf
    tree = shapely.STRtree(lines)
    reach = float(half.max()) + OFF_LANE
    which, near = tree.query(points[elsewhere], predicate="dwithin", distance=reach)
    which = elsewhere[which]
    np.minimum.at(beyond, which, shapely.distance(points[which], lines[near]) - half[near])
    at = np.flatnonzero(beyond > OFF_LANE)
    if not len(at):
        return []
    values = np.where(np.isfinite(beyond[at]), beyond[at], 0.0)
    far = np.flatnonzero(~np.isfinite(beyond[at]))
    if len(far):
        nearest = tree.nearest(points[at[far]])
        values[far] = shapely.distance(points[at[far]], lines[nearest]) - half[nearest]
    return [_Step(MotionKind.OFF_ROAD, rows[at], values, np.full(len(at), OFF_LANE))]


def _find_overlaps(
    time: FloatArray,
    row: IntArray,
    x: FloatArray,
    y: FloatArray,
    hdg: FloatArray,
    length: FloatArray,
    width: FloatArray,
    step: float,
) -> list[_Step]:
    """Pairs of bodies that overlap at the same time by more than :data:`TOUCHING`."""
    from scipy.spatial import cKDTree

    rows = np.flatnonzero(_sample_rows(time, step))
    if len(rows) < 2:
        return []
    # Pairs whose centres are near: of short bodies all at once, of long ones each with all.
    reach = 0.5 * np.hypot(length[rows], width[rows])
    points = np.column_stack((x[rows], y[rows], 100.0 * np.rint(time[rows] / step)))
    short = reach <= _SHORT / 2.0
    tree, few = cKDTree(points[short]), np.flatnonzero(short)
    near = tree.query_pairs(2.0 * float(reach[short].max(initial=0.0)), output_type="ndarray")
    one, other = [few[near[:, 0]]], [few[near[:, 1]]]
    long = np.flatnonzero(~short)
    if len(long):
        around = cKDTree(points).query_ball_point(points[long], reach[long] + reach.max())
        one.append(np.repeat(long, [len(some) for some in around]))
        other.append(np.concatenate([np.asarray(some, dtype=np.int64) for some in around]))
    first, second = np.concatenate(one), np.concatenate(other)
    apart = np.hypot(*(points[first, :2] - points[second, :2]).T)
    kept = (first != second) & (apart < reach[first] + reach[second])
    first, second = first[kept], second[kept]
    low, high = np.minimum(first, second), np.maximum(first, second)
    unique = np.unique(low * np.int64(len(rows)) + high)
    first, second = rows[unique // len(rows)], rows[unique % len(rows)]
    depth = _overlap_depth(first, second, x, y, hdg, length, width)
    at_last = np.flatnonzero((depth > TOUCHING) & (row[first] != row[second]))
    if not len(at_last):
        return []
    deep = depth[at_last]
    bounds = np.full(len(deep), TOUCHING)
    return [_Step(MotionKind.OVERLAP, first[at_last], deep, bounds, second[at_last])]


def _overlap_depth(
    first: IntArray,
    second: IntArray,
    x: FloatArray,
    y: FloatArray,
    hdg: FloatArray,
    length: FloatArray,
    width: FloatArray,
) -> FloatArray:
    """Metres by which pairs of rectangles overlap, least over the axes of both; below 0: apart."""
    dx, dy = x[second] - x[first], y[second] - y[first]
    depth = np.full(len(first), np.inf)
    for axis in (hdg[first], hdg[first] + np.pi / 2, hdg[second], hdg[second] + np.pi / 2):
        ux, uy = np.cos(axis), np.sin(axis)
        reach = np.zeros(len(first))
        for body in (first, second):
            ahead = np.abs(np.cos(hdg[body]) * ux + np.sin(hdg[body]) * uy)
            aside = np.abs(np.cos(hdg[body]) * uy - np.sin(hdg[body]) * ux)
            reach += 0.5 * (length[body] * ahead + width[body] * aside)
        depth = np.minimum(depth, reach - np.abs(dx * ux + dy * uy))
    return depth


def _forced_times(
    events: Iterable[Event], step: float
) -> dict[str, list[tuple[float, float, MotionCause]]]:
    """When road users were moved by force, or stopped by an emergency, s."""
    found: dict[str, list[tuple[float, float, MotionCause]]] = {}
    open_rules: dict[tuple[str, str | None], float] = {}
    gone: dict[str, float] = {}

    def add(actor: str, begin: float, end: float, cause: MotionCause) -> None:
        found.setdefault(actor, []).append((begin - 2.0 * step, end + 2.0 * step, cause))

    for event in events:
        key = event.actor, event.rule
        if event.kind is EventKind.RULE_STARTED:
            open_rules[key] = event.time
        elif event.kind in (
            EventKind.RULE_ENDED,
            EventKind.RULE_FAILED,
            EventKind.RULE_OVERRIDDEN,
        ):
            begin = open_rules.pop(key, event.time)
            add(event.actor, begin, event.time + 2.0 * WINDOW, MotionCause.RULE)
        elif event.kind is EventKind.TELEPORT_START:
            gone[event.actor] = event.time
        elif event.kind is EventKind.TELEPORT_END:
            begin = gone.pop(event.actor, event.time)
            add(event.actor, begin, event.time + 2.0 * WINDOW, MotionCause.TELEPORT)
        elif event.kind is EventKind.COLLISION:
            for actor in (event.actor, event.partner):
                if actor is not None:
                    add(actor, event.time - 1.0, event.time + _AFTER, MotionCause.COLLISION)
        elif event.kind is EventKind.EMERGENCY_STOP:
            begin, end = event.time - 1.0, event.time + 2.0
            add(event.actor, begin, end, MotionCause.EMERGENCY_STOP)
    for (actor, _), begin in open_rules.items():
        add(actor, begin, math.inf, MotionCause.RULE)
    for actor, begin in gone.items():
        add(actor, begin, math.inf, MotionCause.TELEPORT)
    return found


def _join_findings(
    steps: Sequence[_Step],
    rows: pl.DataFrame,
    plan: Plan,
    forced: Mapping[str, Sequence[tuple[float, float, MotionCause]]],
    lanes: RoadLanes | None,
    step: float,
) -> pl.DataFrame:
    """Join what follows on each other of one road user to one finding, with its worst value."""
    import polars as pl

    if not steps:
        return _empty_findings()
    columns = rows.columns
    lane_names = rows["lane"] if "lane" in columns else None
    time, row, x, y = (rows[name].to_numpy() for name in ("time", "row", "x", "y"))
    found: list[dict[str, object]] = []
    for kind, places, excesses, limits, partners in steps:
        others = np.zeros(len(places), dtype=np.int64) if partners is None else row[partners]
        order = np.lexsort((time[places], others, row[places]))
        at, values, bounds, partner = (array[order] for array in (places, excesses, limits, others))
        apart = (
            (np.diff(row[at]) != 0)
            | (np.diff(partner) != 0)
            | (np.diff(time[at]) > _EPISODE + step)
        )
        starts = np.concatenate(([0], np.flatnonzero(apart) + 1))
        ends = np.concatenate((starts[1:], [len(at)]))
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
            worst = start + int(np.argmax(values[start:end]))
            place = int(at[worst])
            actor = plan.actors[int(row[place])]
            other = None if partners is None else plan.actors[int(partner[worst])].id
            begin, last = float(time[at[start]]), float(time[at[end - 1]])
            found.append(
                {
                    "kind": str(kind),
                    "category": str(actor.category),
                    "id": actor.id,
                    "begin": begin,
                    "end": last,
                    "x": float(x[place]),
                    "y": float(y[place]),
                    "lane": None if lane_names is None else lane_names[place],
                    "value": float(values[worst]),
                    "bound": float(bounds[worst]),
                    "cause": str(
                        _find_cause((actor.id, other), begin, last, forced)
                        or _cause_by_lane(
                            lane_names,
                            row,
                            int(at[start]),
                            int(at[end - 1]),
                            lanes,
                            _least_radius(actor) if kind is MotionKind.YAW_RATE else 0.0,
                        )
                    ),
                    "partner": other,
                }
            )
    return pl.DataFrame(found, schema=_empty_findings().schema)


def _least_radius(actor: PlannedActor) -> float:
    """Metres of the tightest path on which the front of a body can be steered; 0: any."""
    return _bounds_row(BOUNDS.get(str(actor.category), _WALKS))[-1] * actor.length


def _find_cause(
    actors: Sequence[str | None],
    begin: float,
    end: float,
    forced: Mapping[str, Sequence[tuple[float, float, MotionCause]]],
) -> MotionCause | None:
    """The first of what moved one of them by force then, or stopped it."""
    causes = {
        cause
        for actor in actors
        if actor is not None
        for since, until, cause in forced.get(actor, ())
        if since <= end and begin <= until
    }
    return next((cause for cause in MotionCause if cause in causes), None)


def _cause_by_lane(
    names: pl.Series | None,
    row: IntArray,
    start: int,
    end: int,
    lanes: RoadLanes | None,
    radius: float,
) -> MotionCause:
    """A change of lanes within a few records, a path too tight, a junction, or the lane itself."""
    if names is None or lanes is None:
        return MotionCause.LANE
    near = slice(max(0, start - 3), end + 4)
    around = names[near].filter(row[near] == row[start]).to_list()
    for before, after in pairwise(around):
        if before and after and before != after:
            edge = lanes.edges.get(before)
            if edge is not None and edge == lanes.edges.get(after):
                return MotionCause.LANE_CHANGE
    if radius > 0.0 and any(lanes.curvature_of(name) * radius > 1.0 for name in around if name):
        return MotionCause.TIGHT_PATH
    if any(name in lanes.inside for name in around if name):
        return MotionCause.JUNCTION
    return MotionCause.LANE


def write_motion(found: pl.DataFrame, folder: Path) -> None:
    """Write the findings of a run beside its figures, ``motion.csv``."""
    import polars.selectors as cs

    folder.mkdir(exist_ok=True)
    found.with_columns(cs.float().round(4)).write_csv(folder / MOTION_TABLE)


def read_motion(folder: Path) -> pl.DataFrame | None:
    """Inverse of :func:`write_motion`; ``None`` if the run has none.

    Raises
    ------
    InputError
        If the table cannot be read.
    """
    import polars as pl

    file = folder / MOTION_TABLE
    if not file.is_file():
        return None
    with tables(str(file)):
        return pl.read_csv(file, schema=_empty_findings().schema)


def implausible(found: pl.DataFrame) -> pl.DataFrame:
    """Findings of motion that no force explains; hard braking is no such, but counted apart."""
    import polars as pl

    return found.filter(
        ~pl.col("cause").is_in([str(cause) for cause in FORCED])
        & (pl.col("kind") != str(MotionKind.HARD_BRAKING))
    )


def count_by_kind(found: pl.DataFrame) -> pl.DataFrame:
    """Findings by kind, category and cause: ``findings``, ``users``, worst ``value``, ``bound``."""
    import polars as pl

    order = {str(kind): number for number, kind in enumerate(MotionKind)}
    return (
        found.group_by("kind", "category", "cause")
        .agg(
            pl.len().alias("findings"),
            pl.col("id").n_unique().alias("users"),
            pl.col("value").max(),
            pl.col("bound").min(),
        )
        .with_columns(order=pl.col("kind").replace_strict(order, default=len(order)))
        .sort("order", "category", "cause")
        .drop("order")
    )


def _count_implausible(run: RunData) -> float | None:
    return None if run.motion is None else float(len(implausible(run.motion)))


def _count_hard_braking(run: RunData) -> float | None:
    if run.motion is None:
        return None
    hard = run.motion["kind"] == str(MotionKind.HARD_BRAKING)
    forced = run.motion["cause"].is_in([str(cause) for cause in FORCED])
    return float((hard & ~forced).sum())


FIGURES = (
    RunFigure(
        name="implausible_motion",
        unit="",
        label="implausible motion",
        definition="Motion that no body or driver makes: jumps, lateral speed and acceleration, "
        "acceleration, jerk, yaw rate, backwards, off the road, overlaps, a recorded speed that is "
        "not that of positions. What rules, teleports and collisions move is left out.",
        source="odscen, from the trajectories; bounds per category in docs/runs.md",
        better=Better.LOWER,
        tolerance="10 % or 5",
        basis=Basis.MOTION,
        display=COUNT,
        section=ReportSection.MOTION,
        note="findings",
        compute=_count_implausible,
    ),
    RunFigure(
        name="hard_braking",
        unit="",
        label="hard braking",
        definition="How often vehicles braked harder than 4.5 m/s\u00b2, which drivers do in "
        "emergencies only.",
        source="odscen, from the trajectories; NCHRP Report 400",
        better=Better.LOWER,
        tolerance="10 % or 5",
        basis=Basis.MOTION,
        display=COUNT,
        section=ReportSection.MOTION,
        note="beyond 4.5 m/s\u00b2",
        compute=_count_hard_braking,
    ),
)
