"""What the stations of a study counted: detectors, travel-time sections and cordons by interval."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.by_place.queue_metres import NEEDED, positions, record_step

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

    from odscen.figures.by_place.facilities import NetFacts
    from odscen.records.run_plan import PlannedStation


REACH = 60.0
"""Metres before and behind a line in which vehicles are followed: more than a step and a length."""


def line_crossings(
    trajectories: pl.LazyFrame, lines: Mapping[str, Sequence[tuple[str, float]]], facts: NetFacts
) -> pl.DataFrame | None:
    """Each crossing of each line.

    Parameters
    ----------
    lines
        Lanes and metres along them, by name.

    Returns
    -------
    ``line``, ``id``, ``time`` (s), ``covered`` (s, from front to rear) and ``speed`` (m/s, its
    length over that time, as loops measure it), sorted by line and time; ``None`` if lane, place or
    speed were not recorded.
    """
    import polars as pl

    if not set(NEEDED) <= set(trajectories.collect_schema()):
        return None
    col = pl.col
    reach = _station_reach(lines, facts)
    rows = (
        trajectories.select(
            id=col("vehicle_id").cast(str),
            time=col("timestep_time").cast(pl.Float64),
            lane=col("vehicle_lane").cast(str),
            x=col("vehicle_x").cast(pl.Float64),
            y=col("vehicle_y").cast(pl.Float64),
            speed=col("vehicle_speed").cast(pl.Float64),
        )
        .join(reach.select("lane").unique().lazy(), on="lane", how="semi")
        .collect(engine="streaming")
    )
    seen = (
        rows.with_columns(positions(rows, facts))
        .join(reach, on="lane")
        .join(facts.drivers.select("id", body="length"), on="id", how="left")
        .with_columns(behind=col("pos") + col("offset"), body=col("body").fill_null(5.0))
    )
    period = record_step(trajectories)
    fronts = _find_passages(seen, period)
    rears = _find_passages(seen.with_columns(behind=col("behind") - col("body")), period)
    return (
        fronts.sort("time")
        .join_asof(
            rears.select("line", "place", "id", "time", rear="time").sort("time"),
            on="time", by=("line", "place", "id"), strategy="forward",
            check_sortedness=False,  # polars cannot check it by group, and warns
        )
        .join(seen.group_by("line", "place", "id").agg(last=col("time").max()),
              on=("line", "place", "id"))
        # Who stands on it at the end, or arrives there, covers it as long as it is seen.
        .with_columns(covered=(pl.coalesce("rear", "last") - col("time")).clip(0.0))
        .with_columns(
            speed=pl.when(col("rear").is_null()).then("speed")
            .otherwise(col("body") / col("covered"))
        )
        .unique(["line", "id", "time"], keep="first", maintain_order=True)
        .select("line", "id", "time", "speed", "covered")
        .sort("line", "time", "id")
    )  # fmt: skip


def _find_passages(seen: pl.DataFrame, period: float) -> pl.DataFrame:
    import polars as pl

    col = pl.col
    key = ("line", "place", "id")
    share = -col("from") / (col("behind") - col("from"))
    return (
        seen.sort(*key, "time")
        .with_columns(
            **{"from": col("behind").shift(1).over(*key)},
            then=col("time").shift(1).over(*key),
            slower=col("speed").shift(1).over(*key),
        )
        .filter(
            (col("from") < 0.0)
            & (col("behind") >= 0.0)
            & (col("time") - col("then") < 1.5 * period)
        )
        .select(
            *key,
            "body",
            time=col("then") + share * (col("time") - col("then")),
            speed=col("slower") + share * (col("speed") - col("slower")),
        )
    )


def _station_reach(
    lines: Mapping[str, Sequence[tuple[str, float]]], facts: NetFacts
) -> pl.DataFrame:
    """Lanes around each place of each line, and what is added to positions there."""
    import polars as pl

    length = dict(facts.limits.select("lane", "length").rows())
    after: dict[str, list[str]] = {}
    before: dict[str, list[str]] = {}
    for lane, following in facts.follows.rows():
        after.setdefault(lane, []).append(following)
        before.setdefault(following, []).append(lane)
    found = []
    for line, places in lines.items():
        for number, (lane, pos) in enumerate(places):
            offsets = {lane: -pos}
            ahead = [(name, length[lane] - pos) for name in after.get(lane, ())]
            while ahead:
                next_lane, start = ahead.pop()
                if next_lane in length and next_lane not in offsets and start < REACH:
                    offsets[next_lane] = start
                    ahead += [
                        (other, start + length[next_lane]) for other in after.get(next_lane, ())
                    ]
            behind = [(name, -pos) for name in before.get(lane, ())]
            while behind:
                next_lane, end = behind.pop()
                if next_lane in length and next_lane not in offsets and end > -REACH:
                    offsets[next_lane] = end - length[next_lane]
                    behind += [(other, offsets[next_lane]) for other in before.get(next_lane, ())]
            found += [(line, number, lane, metres) for lane, metres in sorted(offsets.items())]
    names = {"line": pl.String, "place": pl.Int64, "lane": pl.String, "offset": pl.Float64}
    return pl.DataFrame(found, schema=names, orient="row")


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
        f"{station.id} {name}": getattr(station, name)
        for station in stations
        for name in ("first", "second")
        if getattr(station, name)
    }
    crossed = line_crossings(trajectories, lines, facts)
    if crossed is None:
        return None
    parts = [_figures_of_station(station, crossed, clock) for station in stations]
    number = (col("end") - col("begin")) / 3600.0
    empty = [pl.lit(None, pl.Float64).alias(name) for name in COLUMNS]
    rows = [
        part.with_columns(expr for expr in empty if expr.meta.output_name() not in part.columns)
        for part in parts
    ]
    return pl.concat(
        [row.with_columns(flow=col("vehicles") / number).select(COLUMNS) for row in rows],
        how="vertical_relaxed",
    )


def _figures_of_station(
    planned_station: PlannedStation, crossed: pl.DataFrame, clock: pl.DataFrame
) -> pl.DataFrame:
    import polars as pl

    col = pl.col
    first = crossed.filter(col("line") == f"{planned_station.id} first")
    second = crossed.filter(col("line") == f"{planned_station.id} second")
    if planned_station.kind == "detector":
        share = col("covered").sum() / len(planned_station.first)
        found = _fill_intervals(
            first, clock, vehicles=pl.len(), speed=col("speed").mean(), occupied=share
        ).with_columns(occupancy=col("occupied").fill_null(0.0) / (col("end") - col("begin")))
    elif planned_station.kind == "section":
        done = second.sort("time").join_asof(
            first.select("id", "time", came="time").sort("time"), on="time", by="id"
        )
        took = col("time") - col("came")
        found = _fill_intervals(
            done.drop_nulls("came"),
            clock,
            vehicles=pl.len(),
            travel_time=took.mean(),
            travel_time_p95=took.quantile(0.95, interpolation="linear"),
        )
    else:
        out = _fill_intervals(second, clock, left=pl.len()).select("begin", "left")
        found = (
            _fill_intervals(first, clock, vehicles=pl.len())
            .join(out, on="begin")
            .with_columns(left=col("left").fill_null(0))
            .with_columns(
                balance=col("vehicles").fill_null(0).cast(pl.Int64).cum_sum()
                - col("left").cast(pl.Int64).cum_sum()
            )
        )
    return found.with_columns(
        col("vehicles").fill_null(0).cast(pl.Int64),
        station=pl.lit(planned_station.id),
        kind=pl.lit(planned_station.kind),
    )


def _fill_intervals(rows: pl.DataFrame, clock: pl.DataFrame, **sums: pl.Expr) -> pl.DataFrame:
    found = (
        rows.sort("time")
        .join_asof(clock.sort("begin"), left_on="time", right_on="begin", coalesce=False)
        .drop_nulls("begin")
        .group_by("begin")
        .agg(**sums)
    )
    return clock.join(found, on="begin", how="left", maintain_order="left").sort("begin")
