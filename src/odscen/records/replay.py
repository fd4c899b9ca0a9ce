"""A recorded run as columns, for a player: who was where at each time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.categories import Category
from odscen.base.frames import SumoPose, sumo_to_xodr

if TYPE_CHECKING:
    import polars as pl

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.records.run_plan import Plan

SPEED_ERROR = 0.1
"""m/s by which SUMO's speed may differ from that of positions before it is replaced."""
LANE_JOINT = 0.06
"""Metres that positions slip where lanes meet: what SUMO's shortest lane is long, and rounding."""
SPEED_OF, BODY_CENTRE = "odscen.speed_of", "body_centre"
"""What the metadata of a file with trajectories has whose speeds are those of body centres."""
_JUMPED, _UNSEEN = 0.5, 2.0
"""Metres, and m/s that SUMO's speed may leave out: further elsewhere is a jump and no speed."""

_OPTIONAL = {"z": "z", "lane": "lane", "pos": "pos", "slope": "slope_deg"}


def body_centres(
    trajectories: pl.DataFrame, plan: Plan, *, by_centres: bool = False
) -> pl.DataFrame:
    """Where the road users of a plan were.

    Parameters
    ----------
    trajectories
        As read from ``trajectories.parquet``.
    plan
        Gives the length of each body, its category, and the offset between the frames.
    by_centres
        Whether speeds were recorded of body centres, not of fronts. Where a body turns on the spot,
        its front moves and its centre does not.

    Returns
    -------
    polars.DataFrame
        One row per road user and record, sorted by time; columns ``time``, ``id``, ``category``,
        ``row`` (of the plan), ``x``, ``y``, ``hdg``, ``speed``, and of ``z``, ``lane``, ``pos``,
        ``slope_deg`` those that were recorded. Rows without a place are left out. ``speed`` (m/s)
        is that of the front's positions, or of the centre's, as of all pedestrians, see
        :func:`speeds_of_positions`.
    """
    import polars as pl

    columns = trajectories.columns
    prefix = next((p for p in ("vehicle_", "person_", "") if f"{p}x" in columns), None)
    clock = next((name for name in ("timestep_time", "time") if name in columns), None)
    if prefix is None or clock is None:
        return _empty_positions()
    names = {name: f"{prefix}{name}" for name in ("id", "x", "y", "angle", "speed")}
    names |= {ours: f"{prefix}{old}" for old, ours in _OPTIONAL.items() if prefix + old in columns}
    actors = pl.DataFrame(
        {
            "id": [actor.id for actor in plan.actors],
            "category": [str(actor.category) for actor in plan.actors],
            "length": [actor.length for actor in plan.actors],
        },
        schema={"id": pl.String, "category": pl.String, "length": pl.Float64},
    ).with_row_index("row")
    rows = (
        trajectories.select(
            pl.col(clock).cast(pl.Float64).alias("time"),
            *(pl.col(old).alias(new) for new, old in names.items()),
        )
        .with_columns(pl.col("x", "y", "angle", "speed").cast(pl.Float64))
        .filter(pl.all_horizontal(pl.col("x", "y").is_finite()))
        .join(actors, on="id", how="inner", maintain_order="left")
        .sort("time", maintain_order=True)
    )
    x, y, angle, length = (rows[name].to_numpy() for name in ("x", "y", "angle", "length"))
    time, row, speed = (rows[name].to_numpy() for name in ("time", "row", "speed"))
    walking = (rows["category"] == Category.PEDESTRIAN).to_numpy()
    pose = sumo_to_xodr(SumoPose(x, y, 0.0, angle), length=length, net_offset=plan.net_offset)
    # People turn on the spot, which moves their front by half a step.
    centred = walking | by_centres
    x, y = np.where(centred, pose.x, x), np.where(centred, pose.y, y)
    extra = [name for name in _OPTIONAL.values() if name in rows.columns]
    return rows.with_columns(
        pl.col("row").cast(pl.Int64),
        x=np.asarray(pose.x),
        y=np.asarray(pose.y),
        hdg=np.asarray(pose.hdg),
        speed=speeds_of_positions(time, row, x, y, angle, speed, walking, by_centres=by_centres),
    ).select("time", "id", "category", "row", "x", "y", "hdg", "speed", *extra)


def speeds_of_positions(
    time: FloatArray,
    row: IntArray,
    x: FloatArray,
    y: FloatArray,
    angle_deg: FloatArray,
    speed: FloatArray,
    walking: BoolArray,
    *,
    by_centres: bool = False,
) -> FloatArray:
    """Speeds at which road users really moved: fronts of vehicles, or their centres.

    SUMO's speed is that along the centre line of a lane of the length that its edge has: it leaves
    out what a vehicle moves aside, is that of another arc beside the centre, and of a person
    that is moved it is none at all. Where the way from the record before differs from it, that
    counts.

    Parameters
    ----------
    time, row, x, y, angle_deg, speed
        Of shape ``(N,)``, sorted by time: seconds, number of the road user, metres, SUMO's angle,
        m/s.
    walking
        Who is on foot, of shape ``(N,)``; places are those of centres there.
    by_centres
        Whether places and speeds are those of centres. Bodies turn about these without moving them,
        so that a way is anything from the chord to the arc.

    Returns
    -------
    m/s, of shape ``(N,)``; first records, those after a gap or a jump, and those more than a second
    after the one before, keep SUMO's.
    """
    if len(time) < 2:
        return speed
    order = np.argsort(row, kind="stable")
    time, x, y, angle, old = (part[order] for part in (time, x, y, angle_deg, speed))
    row, walking = row[order], walking[order]
    passed = np.diff(time)
    same = (row[1:] == row[:-1]) & (passed > 1e-6)
    if not same.any():
        return speed
    step = float(np.median(passed[same]))
    same &= (passed < 1.5 * step) & (step <= 1.0 + 1e-6)
    passed = np.where(same, passed, 1.0)
    # The arc over the chord between two places.
    half = 0.5 * np.radians(np.abs(np.mod(np.diff(angle) + 180.0, 360.0) - 180.0))
    half = np.clip(half, 1e-6, 0.5)
    straight = np.hypot(np.diff(x), np.diff(y)) / passed
    covered = straight * half / np.sin(half)
    if by_centres:
        covered = np.clip(old[1:], straight, covered)
    covered = np.where(walking[1:], straight, covered)
    error = np.where(same, covered - old[1:], 0.0)
    same &= np.abs(error) * passed < _JUMPED + _UNSEEN * passed
    error = np.where(same, error, 0.0)
    # Vehicles slip by centimetres where lanes meet, which is no speed unless it goes on.
    slips = ~walking[1:] & (np.abs(error) * passed < LANE_JOINT)
    error = np.where(slips, _median_of_three(error, same), error)
    error[np.abs(error) <= SPEED_ERROR] = 0.0
    speeds = np.empty_like(speed)
    speeds[order] = np.maximum(old + np.concatenate(([0.0], error)), 0.0)
    return speeds


def _median_of_three(values: FloatArray, joined: BoolArray) -> FloatArray:
    """Medians of each value and its neighbours, itself where one of them is not joined."""
    before = np.concatenate((values[:1], np.where(joined[:-1], values[:-1], values[1:])))
    after = np.concatenate((np.where(joined[1:], values[1:], values[:-1]), values[-1:]))
    low, high = np.minimum(before, after), np.maximum(before, after)
    return np.clip(values, low, high)


def _empty_positions() -> pl.DataFrame:
    import polars as pl

    numbers = dict.fromkeys(("x", "y", "hdg", "speed"), pl.Float64)
    ids = {"time": pl.Float64, "id": pl.String, "category": pl.String, "row": pl.Int64}
    return pl.DataFrame(schema={**ids, **numbers})


def replay_columns(
    trajectories: pl.DataFrame, plan: Plan, *, every: int = 1, by_centres: bool = False
) -> dict[str, Any]:
    """Columns of what SUMO recorded; rows sorted by time.

    Parameters
    ----------
    trajectories
        As read from ``trajectories.parquet``.
    every
        Take each ``every``-th step.
    by_centres
        As of :func:`body_centres`.

    Returns
    -------
    ``times`` of shape ``(T,)``; ``first`` of shape ``(T + 1,)``, the rows of time ``i`` being
    ``first[i]`` up to ``first[i + 1]``; ``actor`` (row of the plan), ``x``, ``y``, ``hdg``, and
    ``speed`` of shape ``(R,)``: body centres in the OpenDRIVE frame, metres, radians, m/s.
    """
    import polars as pl

    rows = body_centres(trajectories, plan, by_centres=by_centres)
    times, number = np.unique(rows["time"].to_numpy(), return_inverse=True)
    kept = number % every == 0
    rows, number, times = rows.filter(pl.Series(kept)), number[kept] // every, times[::every]
    actor, x, y, hdg, speed = (rows[name].to_numpy() for name in ("row", "x", "y", "hdg", "speed"))
    first = np.searchsorted(number, np.arange(len(times) + 1))
    return _rounded_columns(times, first, actor, x, y, hdg, speed)


def _rounded_columns(
    times: np.ndarray,
    first: np.ndarray,
    actor: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    hdg: np.ndarray,
    speed: np.ndarray,
) -> dict[str, Any]:
    """Round to the centimetre, to 1e-4 rad and to 0.01 m/s, which no screen shows."""
    return {
        "times": np.round(times, 3),
        "first": first,
        "actor": actor,
        "x": np.round(x, 2),
        "y": np.round(y, 2),
        "hdg": np.round(hdg, 4),
        "speed": np.round(speed, 2),
    }
