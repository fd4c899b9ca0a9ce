"""SUMO's lane data as a table of what happened on each lane in each interval, in SI units.

=================================== ==============================================================
column                              meaning
=================================== ==============================================================
begin, end                          interval, s
edge, lane                          SUMO's ids
seconds                             time that vehicles spent, vehicle-seconds
distance                            that they drove, m
entered, left                       vehicles that came from and went to another edge
departed, arrived                   vehicles whose trips began and ended here
waiting                             of ``seconds``, those in which they were stopped (below 0.1 m/s)
time_loss                           of ``seconds``, those lost by driving below the desired speed
co2, co, hc, nox, pmx, fuel         g, if emissions were recorded
electricity                         Wh, if emissions were recorded
=================================== ==============================================================

A vehicle is where its front is. SUMO itself counts a vehicle on every lane that a part of its body
is on, so that its seconds add up to more than there were: by a sixth in a town of short lanes.
SUMO also gives, per lane, travel time and distance of the fronts, from which

    seconds   = traveltime * distance / length
    time_loss = seconds - distance * (sampled - timeLoss) / (speed * sampled)
    waiting   = waitingTime - of_rears, where, of the rears whose fronts are further on,
    of_rears  = (sampled - seconds) - (speed * sampled - distance) * (sampled - waitingTime)
                / (speed * sampled)

with ``sampled`` for its seconds. The second is exact if all who were on the lane wished to drive
equally fast; where it was held against the trips, the sum was less than 2 % below theirs. The third
is exact if rears that move are as fast as all who move; held against every step, the sum was less
than 2 % below.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from odscen.sumo.realize.measure_files import EMISSIONS

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    import polars as pl

_MOST_TRAVEL_TIME = 99_999.0
"""Seconds; SUMO gives 100,000 at most, and then not what it was; none where all were stopped."""
_COUNTS = ("entered", "left", "departed", "arrived")


def lane_table(
    lanes: Path,
    emissions: Path | None,
    lengths: Mapping[str, Mapping[str, float]],
    present: Mapping[str, int] | None = None,
) -> pl.DataFrame:
    """Read what SUMO has written.

    Parameters
    ----------
    lanes, emissions
        SUMO's Parquet files; ``None`` if emissions were not recorded.
    lengths
        Of lanes for vehicles, m, by edge. SUMO's mesoscopic model measures edges: what it gives
        of one is given to the first of these lanes.
    present
        How many vehicles were on each lane when a saved state was loaded. SUMO counts them as
        having entered.

    Returns
    -------
    Sorted by ``begin`` and ``lane``; without rows if no vehicle was there.
    """
    import polars as pl

    by_lane = {lane: length for lanes in lengths.values() for lane, length in lanes.items()}
    own = pl.LazyFrame(
        {"lane": list(by_lane), "length": list(by_lane.values())},
        schema={"lane": pl.String, "length": pl.Float64},
    )
    # SUMO leads teleported vehicles over the first lane of an edge, be it a sidewalk.
    rows = _rename_columns(lanes, lengths).join(own, on="lane")
    entered: tuple[pl.Expr, ...] = ()
    if emissions is not None:
        measured = _rename_columns(emissions, lengths).select("begin", "lane", *_emission_columns())
        rows = rows.join(measured, on=["begin", "lane"], how="left")
    if present:
        here = pl.LazyFrame({"lane": list(present.keys()), "present": list(present.values())})
        first = pl.col("begin") == pl.col("begin").min()
        there = pl.when(first).then("present").otherwise(0).fill_null(0)
        rows = rows.join(here, on="lane", how="left").with_columns(present=there)
        entered = ((pl.col("entered") - pl.col("present")).clip(0),)
    seconds, time_loss, waiting, kept = _measure_columns(emissions=emissions is not None)
    return (
        rows.with_columns(seconds)
        .with_columns(time_loss, waiting, *entered)
        .select(kept)
        .sort("begin", "lane")
        # To plan so small a query, and to wake threads for it, takes longer than to do it.
        .collect(engine="in-memory", optimizations=pl.QueryOptFlags.none())
    )


@cache
def _measure_columns(*, emissions: bool) -> tuple[pl.Expr, pl.Expr, pl.Expr, tuple[pl.Expr, ...]]:
    """Seconds; with them, time loss and waiting; then all columns. Made once for all runs."""
    import polars as pl

    col = pl.col
    sampled, moved = col("sampledSeconds"), col("speed") * col("sampledSeconds")
    # Where hardly a vehicle moved there is no travel time, and SUMO's density has an upper bound;
    # all were stopped for the whole interval then, a whole number of vehicles.
    at_least = col("density") * col("length") / 1000.0
    still = pl.when(col("entered") + col("left") + col("departed") + col("arrived") == 0)
    standing = still.then((at_least - 1e-3).ceil()).otherwise(at_least)
    standing *= col("end") - col("begin")
    fronts = (
        pl.when(col("traveltime").fill_null(_MOST_TRAVEL_TIME) >= _MOST_TRAVEL_TIME)
        .then(pl.min_horizontal(sampled, standing))
        .otherwise(col("traveltime") * col("distance") / col("length"))
    )
    loss = pl.when(moved > 0.0).then(
        col("seconds") - col("distance") * (sampled - col("timeLoss")) / moved
    )
    waited = col("waitingTime")
    rears = (
        pl.when(moved > 0.0)
        .then(sampled - col("seconds") - (moved - col("distance")) * (sampled - waited) / moved)
        .otherwise(sampled - col("seconds"))
    )
    seconds = fronts.fill_null(0.0).alias("seconds")
    time_loss = loss.otherwise(col("timeLoss")).fill_null(0.0).clip(0.0, col("seconds"))
    waiting = (waited - rears.clip(0.0, waited)).fill_null(0.0).clip(0.0, col("seconds"))
    emitted = (col(name.lower()).fill_null(0.0) for name in EMISSIONS) if emissions else ()
    kept = (
        *map(col, ("begin", "end", "edge", "lane", "seconds", "distance")),
        *(col(name).cast(pl.Int64) for name in _COUNTS),
        *map(col, ("waiting", "time_loss")),
        *emitted,
    )
    return seconds, time_loss.alias("time_loss"), waiting.alias("waiting"), kept


def _rename_columns(file: Path, lengths: Mapping[str, Mapping[str, float]]) -> pl.LazyFrame:
    """Rows of a file of lane data; columns lose their prefix, times become numbers."""
    import polars as pl

    rows = pl.read_parquet(file)
    if "edge_id" not in rows.columns:  # no vehicle was there, and SUMO had no columns to write
        return _empty_measures()
    renamed = {name: name.removeprefix("lane_").removeprefix("edge_") for name in rows.columns}
    renamed |= {"edge_id": "edge", "lane_id": "lane"}
    lazy = rows.lazy()
    if "lane_id" not in rows.columns:
        lazy = lazy.with_columns(
            lane_id=pl.col("edge_id").replace_strict(
                {edge: next(iter(own)) for edge, own in lengths.items()},
                default=None,
                return_dtype=pl.String,
            )
        )
    return lazy.rename(renamed, strict=False).with_columns(
        begin=pl.col("interval_begin").cast(pl.Float64),
        end=pl.col("interval_end").cast(pl.Float64),
    )


def _empty_measures() -> pl.LazyFrame:
    import polars as pl

    from odscen.sumo.realize.measure_files import LANE_ATTRIBUTES

    numbers = ("begin", "end", *LANE_ATTRIBUTES, *(f"{name}_abs" for name in EMISSIONS))
    texts = ("edge", "lane")
    return pl.LazyFrame(
        schema={**dict.fromkeys(numbers, pl.Float64), **dict.fromkeys(texts, pl.String)}
    )


@cache
def _emission_columns() -> tuple[pl.Expr, ...]:
    return tuple(map(_in_units, EMISSIONS))


def _in_units(name: str) -> pl.Expr:
    import polars as pl

    factor = 1.0 if name == "electricity" else 1e-3
    return (pl.col(f"{name}_abs") * factor).alias(name.lower())
