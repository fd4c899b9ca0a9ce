"""Queues at junctions from trajectories: how many vehicles are stopped at one time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from odscen.figures.by_place.traffic_sums import INTERVAL

if TYPE_CHECKING:
    import polars as pl

    from odscen.figures.by_place.lane_places import LanePlaces

STOPPED = 0.1
"""m/s; slower counts as standing, as in SUMO's ``waitingTime``."""
_SHARE = 0.05
"""Of the moments of an interval, in which the queue may be longer than ``queue_p95``."""
_NEEDED = ("timestep_time", "vehicle_lane", "vehicle_speed")


def queue_lengths(
    trajectories: pl.LazyFrame, places: LanePlaces, clock: pl.DataFrame, *, since: float = 0.0
) -> pl.DataFrame | None:
    """Greatest queue, and that which 95 % of the moments do not exceed; junction and interval.

    The queue are all vehicles that are stopped on the approaches to the junction and in it.
    Junctions and intervals without any are left out.

    Parameters
    ----------
    trajectories
        As recorded, see docs/runs.md.
    clock
        ``begin`` and ``end`` of each interval, from
        :func:`odscen.figures.by_place.traffic_sums.intervals`.
    since
        Seconds from which the run is analysed.

    Returns
    -------
    ``junction``, ``begin``, ``end``, ``queue_max``, ``queue_p95``, and ``queue_p95_run``: that of
    all moments that are analysed. ``None`` if lane or speed were not recorded.
    """
    import polars as pl

    if not set(_NEEDED) <= set(trajectories.collect_schema()):
        return None
    moments = (
        trajectories.select(time=pl.col("timestep_time").cast(pl.Float64))
        .unique()
        .sort("time")
        .join_asof(clock.lazy(), left_on="time", right_on="begin", coalesce=False)
        .drop_nulls("begin")
    )
    in_interval = moments.group_by("begin").agg(pl.len().alias("moments"))
    kind = trajectories.collect_schema()["vehicle_lane"]
    # Names of junctions come last: there are very many rows.
    names = places.ways["junction"].unique().sort().to_frame().with_row_index("place")
    leads = places.ways.join(names, on="junction").select(
        "place", lane=pl.col("lane").cast(kind, strict=False)
    )
    standing = (
        trajectories.filter(pl.col("vehicle_speed") < STOPPED)
        .select(time=pl.col("timestep_time").cast(pl.Float64), lane="vehicle_lane")
        .join(leads.lazy(), on="lane")
        .group_by("place", "time")
        .agg(pl.len().alias("queue"))
        .join(names.lazy(), on="place")
        .join(moments, on="time")
    )
    # Moments without a queue have no row: the rank is counted from the longest.
    rank = (pl.col("moments").first() * _SHARE).floor().cast(pl.Int64)
    ordered = pl.col("queue").sort(descending=True)
    analysed = pl.col("begin") >= since - 1e-6
    number = int(moments.filter(analysed).select(pl.len()).collect().item())
    of_run = ordered.get(math.floor(number * _SHARE), null_on_oob=True)
    run = (
        standing.filter(analysed)
        .group_by("junction")
        .agg(queue_p95_run=of_run.fill_null(0).cast(pl.Float64))
    )
    return (
        standing.join(in_interval, on="begin")
        .group_by("junction", *INTERVAL)
        .agg(
            queue_max=pl.col("queue").max().cast(pl.Float64),
            queue_p95=ordered.get(rank, null_on_oob=True).fill_null(0).cast(pl.Float64),
        )
        .join(run, on="junction", how="left")
        .with_columns(pl.col("queue_p95_run").fill_null(0.0))
        .sort("junction", "begin")
        .collect(engine="streaming")
    )
