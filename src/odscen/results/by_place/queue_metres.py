"""Queues of lane groups in metres, from trajectories.

A vehicle is queued while it is slower than 5 mi/h and no more than :data:`GAP` behind the stop
line, or behind the rear of a queued vehicle of its lane group; whoever has joined stays queued
until it is faster, though those in front have left already. Length of the queue of a moment::

    length = max over the queued vehicles of (stop line to front + length of the vehicle)

So it is the distance from the stop line to the back of the queue, as HCM chapter 31 has it.
Vehicles are counted for the lane group by which they enter the junction, those that never do for
the one that their lane leads to.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.results.by_place.lane_positions import NEEDED, positions

if TYPE_CHECKING:
    import polars as pl

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.results.by_place.facilities import NetFacts
    from odscen.results.by_place.lane_groups import LaneGroups

QUEUED = 5.0 * 0.44704
"""m/s: slower vehicles can be queued; 5 mi/h."""
GAP = 10.0
"""Metres between the rear of one vehicle and the front of the next in a queue, at most."""
SPACE = 7.5
"""Metres that a vehicle needs: with less room behind it, a queue reaches the junction behind."""
_SHARE = 0.05
_PASSES = 3
"""Times that those who were reached by the queue pass it on to vehicles behind them."""

SUMS = ("queue_metre_seconds", "overflow_seconds", "spillback_seconds")
"""Columns that sum up over time."""
WORST = ("queue_metres_p95", "queue_metres_max")
"""Columns of which the highest counts over time."""


def queue_backs(
    trajectories: pl.LazyFrame,
    groups: LaneGroups,
    facts: NetFacts,
    *,
    period: float | None = None,
) -> pl.DataFrame | None:
    """Distance from the stop line to the back of the queue, for each lane group and moment.

    Parameters
    ----------
    period
        From :func:`record_step`, which is asked if it is not given.

    Returns
    -------
    ``lane_group``, ``time`` (s), ``metres``; without moments without a queue. ``None`` if lane,
    place or speed were not recorded.
    """
    import polars as pl

    if not set(NEEDED) <= set(trajectories.collect_schema()):
        return None
    known = groups.reach.select("lane").unique()
    slow = (
        trajectories.filter(pl.col("vehicle_speed") < QUEUED)
        .select(
            id=pl.col("vehicle_id").cast(str),
            time=pl.col("timestep_time").cast(pl.Float64),
            lane=pl.col("vehicle_lane").cast(str),
            x=pl.col("vehicle_x").cast(pl.Float64),
            y=pl.col("vehicle_y").cast(pl.Float64),
        )
        .join(known.lazy(), on="lane", how="semi")
        .sort("id", "time")
        .collect(engine="streaming")
    )
    entered = _entries(trajectories, groups)
    lengths = facts.limits.select("lane", metres="length")
    front = pl.col("ahead") + pl.col("metres") - pl.col("pos")
    rows = (
        _grouped(slow.with_columns(positions(slow, facts)), entered, groups)
        .join(facts.drivers.select("id", body="length"), on="id", how="left")
        .join(lengths, on="lane", how="left", maintain_order="left")
        .with_columns(front=front, rear=front + pl.col("body").fill_null(5.0))
    )
    step = record_step(trajectories) if period is None else period
    queued = _joined(rows, period=step)
    return (
        queued.group_by("lane_group", "time")
        .agg(metres=pl.col("rear").max())
        .sort("lane_group", "time")
    )


def record_step(trajectories: pl.LazyFrame) -> float:
    """Seconds between two records."""
    import polars as pl

    times = pl.col("timestep_time").cast(pl.Float64).unique().sort()
    step = trajectories.select(times.diff().min()).collect().item()
    return float(step or 1.0)


def _entries(trajectories: pl.LazyFrame, groups: LaneGroups) -> pl.DataFrame:
    """Who entered which junction when, by which lane group; sorted by time."""
    import polars as pl

    return (
        trajectories.select(
            id=pl.col("vehicle_id").cast(str),
            then=pl.col("timestep_time").cast(pl.Float64),
            via=pl.col("vehicle_lane").cast(str),
        )
        .join(groups.ways.lazy().select("via", "junction", "lane_group"), on="via")
        .group_by("id", "junction", "lane_group")
        .agg(pl.col("then").max())
        .sort("then")
        .collect(engine="streaming")
    )


def _grouped(slow: pl.DataFrame, entered: pl.DataFrame, groups: LaneGroups) -> pl.DataFrame:
    """The lane group of each slow vehicle, and ``ahead``: metres from its lane to the line."""
    import polars as pl

    found = (
        slow.join(groups.first, on="lane", how="left")
        .sort("time")
        .join_asof(
            entered.rename({"lane_group": "by"}),
            left_on="time",
            right_on="then",
            by=("id", "junction"),
            strategy="forward",
            check_sortedness=False,
        )
    )
    reach = groups.reach.select("lane", "lane_group", "ahead")
    leads = pl.col("ahead").is_not_null()
    # On a lane that does not lead there, one has yet to change, and stands in the other's way.
    return (
        found.join(reach, left_on=("lane", "by"), right_on=("lane", "lane_group"), how="left")
        .with_columns(
            lane_group=pl.when(leads).then("by").otherwise("other"),
            ahead=pl.coalesce("ahead", "ahead_of_other"),
        )
        .sort("id", "time")
    )


def _joined(rows: pl.DataFrame, *, period: float) -> pl.DataFrame:
    """Rows of those that are in the queue; ``period`` seconds lie between two records."""
    import polars as pl

    col = pl.col
    spell = (
        (col("id") != col("id").shift(1)).fill_null(value=True)
        | (
            (col("time").diff() > 1.5 * period)
            | (col("lane_group") != col("lane_group").shift(1))
        ).fill_null(value=True)
    ).cum_sum()  # fmt: skip
    at = ("lane_group", "time")
    # Ordered from the line backwards, one that is more than the gap behind begins another cluster.
    behind = col("front") - col("rear").cum_max().shift(1).over(*at)
    other = col("lane_group").ne_missing(col("lane_group").shift(1))
    cluster = (
        other | col("time").ne_missing(col("time").shift(1)) | (behind > GAP).fill_null(value=False)
    ).cum_sum()
    ordered = (
        rows.sort("id", "time")
        .with_columns(spell=spell)
        .with_row_index("row")
        .sort("lane_group", "time", "front", "id")
        .with_columns(cluster=cluster)
    )
    if not ordered.height:
        return ordered
    return ordered.filter(_queued(*(ordered[name].to_numpy() for name in _SORTED)))


_SORTED = ("row", "spell", "cluster", "front")


def _queued(row: IntArray, spell: IntArray, cluster: IntArray, front: FloatArray) -> BoolArray:
    """Who is in a queue; the vehicles of a moment are reached by it again and again.

    Parameters
    ----------
    row
        Place of each in the order of vehicles and times.
    spell, cluster
        Numbers of the stretch of time in which it is slow, and of the cluster that it is in, which
        are in the order of what is given.
    front
        Metres from the stop line.
    """
    first = np.flatnonzero(np.diff(cluster, prepend=cluster[0] - 1))
    queued = np.repeat(np.fmin.reduceat(front, first) <= GAP, np.diff(first, append=len(front)))
    by_time = np.argsort(row)
    place = np.arange(len(row))
    spells = spell[by_time]
    begin = np.maximum.accumulate(np.where(np.diff(spells, prepend=-1), place, 0))
    for _ in range(_PASSES):
        # Whoever has joined stays: the last that was queued lies in the same spell.
        last = np.maximum.accumulate(np.where(queued[by_time], place, -1))
        queued[by_time] = last >= begin
        reached = np.zeros(int(cluster[-1]) + 1, dtype=np.bool_)
        reached[cluster[queued]] = True
        queued = reached[cluster]
    return queued


def queue_sums(
    backs: pl.DataFrame, groups: LaneGroups, clock: pl.DataFrame, *, step: float
) -> pl.DataFrame:
    """Queues of lane groups by interval.

    Parameters
    ----------
    backs
        From :func:`queue_backs`.
    clock
        ``begin`` and ``end`` of each interval.
    step
        Seconds between two records.

    Returns
    -------
    ``lane_group``, ``begin``, ``queue_metre_seconds``, ``overflow_seconds`` (the queue was longer
    than the lanes of the group), ``spillback_seconds`` (it reached the junction behind),
    ``queue_metres_p95`` and ``queue_metres_max``; without intervals without a queue.
    """
    import polars as pl

    col = pl.col
    rank = ((col("end") - col("begin")).first() / step * _SHARE).floor().cast(pl.Int64)
    return (
        backs.sort("time")
        .join_asof(clock.sort("begin"), left_on="time", right_on="begin", coalesce=False)
        .drop_nulls("begin")
        .filter(col("time") < col("end"))
        .join(groups.groups.select("lane_group", "storage", "room"), on="lane_group")
        .group_by("lane_group", "begin")
        .agg(
            queue_metre_seconds=col("metres").sum() * step,
            overflow_seconds=(col("metres") > col("storage")).sum() * step,
            spillback_seconds=(col("metres") > col("room") - SPACE).sum() * step,
            queue_metres_p95=col("metres").sort(descending=True).get(rank, null_on_oob=True)
            .fill_null(0.0),
            queue_metres_max=col("metres").max(),
        )
        .sort("lane_group", "begin")
    )  # fmt: skip
