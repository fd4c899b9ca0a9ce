"""What the stations of a study counted: detectors, travel-time sections and cordons by interval."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.by_place.line_crossings import line_crossings

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from odscen.figures.by_place.facilities import NetFacts
    from odscen.records.planned_stations import PlannedStation

COLUMNS = (
    "station", "kind", "begin", "end", "vehicles", "flow", "speed", "occupancy", "travel_time",
    "travel_time_p95", "left", "balance",
)  # fmt: skip


def station_figures(
    trajectories: pl.LazyFrame,
    stations: Sequence[PlannedStation],
    facts: NetFacts,
    clock: pl.DataFrame,
) -> pl.DataFrame | None:
    """One row for each station and interval, also those without vehicles.

    Parameters
    ----------
    clock
        ``begin`` and ``end`` of each interval, s.

    Returns
    -------
    ``station``, ``kind``, ``begin``, ``end``, ``vehicles`` (that crossed a detector, completed a
    section, or entered a cordon), ``flow`` (those per hour); of detectors ``speed`` (m/s, mean of
    those that crossed) and ``occupancy`` (share of the time in which a vehicle is on it, mean of
    its lanes); of sections ``travel_time`` and ``travel_time_p95`` (s, of those that completed
    it); of cordons ``left`` and ``balance`` (those that have entered less those that have left,
    until the end). ``None`` if lane, place or speed were not recorded.
    """
    import polars as pl

    col = pl.col
    lines = {
        f"{one.id} {name}": getattr(one, name)
        for one in stations
        for name in ("first", "second")
        if getattr(one, name)
    }
    crossed = line_crossings(trajectories, lines, facts)
    if crossed is None:
        return None
    parts = [_station(one, crossed, clock) for one in stations]
    number = (col("end") - col("begin")) / 3600.0
    empty = [pl.lit(None, pl.Float64).alias(name) for name in COLUMNS]
    rows = [
        part.with_columns(one for one in empty if one.meta.output_name() not in part.columns)
        for part in parts
    ]
    return pl.concat(
        [row.with_columns(flow=col("vehicles") / number).select(COLUMNS) for row in rows],
        how="vertical_relaxed",
    )


def _station(one: PlannedStation, crossed: pl.DataFrame, clock: pl.DataFrame) -> pl.DataFrame:
    import polars as pl

    col = pl.col
    first = crossed.filter(col("line") == f"{one.id} first")
    second = crossed.filter(col("line") == f"{one.id} second")
    if one.kind == "detector":
        share = col("covered").sum() / len(one.first)
        found = _on_clock(
            first, clock, vehicles=pl.len(), speed=col("speed").mean(), occupied=share
        ).with_columns(occupancy=col("occupied").fill_null(0.0) / (col("end") - col("begin")))
    elif one.kind == "section":
        done = second.sort("time").join_asof(
            first.select("id", "time", came="time").sort("time"), on="time", by="id"
        )
        took = col("time") - col("came")
        found = _on_clock(
            done.drop_nulls("came"),
            clock,
            vehicles=pl.len(),
            travel_time=took.mean(),
            travel_time_p95=took.quantile(0.95, interpolation="linear"),
        )
    else:
        out = _on_clock(second, clock, left=pl.len()).select("begin", "left")
        found = (
            _on_clock(first, clock, vehicles=pl.len())
            .join(out, on="begin")
            .with_columns(left=col("left").fill_null(0))
            .with_columns(
                balance=col("vehicles").fill_null(0).cast(pl.Int64).cum_sum()
                - col("left").cast(pl.Int64).cum_sum()
            )
        )
    return found.with_columns(
        col("vehicles").fill_null(0).cast(pl.Int64),
        station=pl.lit(one.id),
        kind=pl.lit(one.kind),
    )


def _on_clock(rows: pl.DataFrame, clock: pl.DataFrame, **sums: pl.Expr) -> pl.DataFrame:
    found = (
        rows.sort("time")
        .join_asof(clock.sort("begin"), left_on="time", right_on="begin", coalesce=False)
        .drop_nulls("begin")
        .group_by("begin")
        .agg(**sums)
    )
    return clock.join(found, on="begin", how="left", maintain_order="left").sort("begin")
