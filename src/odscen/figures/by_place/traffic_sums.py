"""Sums over lanes: what was driven, waited and emitted at each place in each interval."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    import polars as pl

    from odscen.figures.by_place.lane_places import LanePlaces

EMISSIONS = ("co2", "co", "hc", "nox", "pmx", "fuel")
"""Columns of emissions and fuel, grams."""
INTERVAL = ("begin", "end")
TRAFFIC = ("seconds", "distance", *EMISSIONS)
LOST = ("time_loss", "standing_seconds")
SUMS = ("vehicles", *TRAFFIC, *LOST)
"""Columns that are sums over time."""
SPREAD = "spread_seconds"
"""Column of segments: of ``seconds``, those known of whole lanes only, and shared by length."""


def intervals(lanes: pl.DataFrame, end: float) -> pl.DataFrame:
    """All intervals up to ``end``, those without vehicles included; ``begin`` and ``end``."""
    import polars as pl

    seen = [(0.0, 0.0), *lanes.select(INTERVAL).unique().sort("begin").rows(), (end, end)]
    period = max((last - first for first, last in seen), default=0.0) or end
    found = []
    for (begin, last), (following, _) in pairwise(seen):
        if last > begin:
            found.append((begin, last))
        empty = math.ceil((following - last) / period - 1e-6)
        edges = [min(last + k * period, following) for k in range(empty + 1)]
        found += pairwise(edges)
    return pl.DataFrame(found, schema=dict.fromkeys(INTERVAL, pl.Float64), orient="row")


def summable(lanes: pl.DataFrame) -> pl.DataFrame:
    """Lane data with all columns that are summed here; missing emissions are null."""
    import polars as pl

    missing = [pl.lit(None, pl.Float64).alias(n) for n in EMISSIONS if n not in lanes.columns]
    return lanes.rename({"waiting": "standing_seconds"}).with_columns(missing)


def network_sums(lanes: pl.DataFrame, clock: pl.DataFrame, places: LanePlaces) -> pl.DataFrame:
    """Sums over all lanes; ``vehicles`` are those under way at the begin or started since."""
    import polars as pl

    found = lanes.group_by(INTERVAL).agg(_sum_columns("departed", "arrived", *TRAFFIC, *LOST))
    length = float(places.lanes.filter("motor").unique("lane")["length"].sum())
    under_way = (pl.col("departed") - pl.col("arrived")).cum_sum().shift(1, fill_value=0)
    return _fill_grid(clock, found, INTERVAL).with_columns(
        (under_way + pl.col("departed")).alias("vehicles"), pl.lit(length / 1000.0).alias("length")
    )


def segment_sums(parts: pl.DataFrame, clock: pl.DataFrame, places: LanePlaces) -> pl.DataFrame:
    """Sums per segment, of the parts of lanes in it.

    Parameters
    ----------
    parts
        From :func:`odscen.figures.by_place.lane_parts.lane_parts`.
    """
    found = parts.group_by("segment", *INTERVAL).agg(_sum_columns(*SUMS, SPREAD))
    return _fill_intervals(found, clock, places.segments)


def junction_sums(lanes: pl.DataFrame, clock: pl.DataFrame, places: LanePlaces) -> pl.DataFrame:
    """Sums per junction: traffic and emissions in it, time lost there and on its approaches."""
    import polars as pl

    inside = pl.col("via").is_not_null()
    found = (
        lanes.join(places.ways, on="lane")
        .group_by("junction", *INTERVAL)
        .agg(
            _came_in().filter(inside).sum().alias("vehicles"),
            *(_sum_known(pl.col(name).filter(inside), name) for name in TRAFFIC),
            *_sum_columns(*LOST),
        )
    )
    return _fill_intervals(found, clock, places.junctions)


def movement_sums(lanes: pl.DataFrame, clock: pl.DataFrame, places: LanePlaces) -> pl.DataFrame:
    """Sums per movement; time lost before the junction is shared by the vehicles of a lane.

    Time lost on a lane of the last edge is that of the vehicles which entered the junction from it,
    time lost elsewhere that of all which entered from the last edge; in the same interval, or else
    in the next in which one did.
    """
    import polars as pl

    rows = lanes.join(places.ways, on="lane")
    connections = (
        rows.filter(pl.col("via").is_not_null())
        .group_by("movement", "approach", "source", "via", *INTERVAL)
        .agg(
            pl.col("entered").filter(pl.col("lane") == pl.col("via")).sum().alias("through"),
            _came_in().sum().alias("vehicles"),
            *_sum_columns(*TRAFFIC, *LOST),
        )
    )
    before = rows.filter(pl.col("via").is_null())
    used = before.select(pl.col("lane").is_in(connections["source"].unique().implode())).to_series()
    by_lane = _share_lost_time(
        before.filter(used).with_columns(source="lane"), connections, "source"
    )
    by_edge = _share_lost_time(before.filter(~used), connections, "approach")
    found = (
        connections.join(by_lane, on=("source", "begin"), how="left", suffix="_of_lane")
        .join(by_edge, on=("approach", "begin"), how="left", suffix="_of_edge")
        .with_columns(
            pl.col(name)
            + pl.col("through")
            * (pl.col(f"{name}_of_lane").fill_null(0) + pl.col(f"{name}_of_edge").fill_null(0))
            for name in LOST
        )
        .group_by("movement", *INTERVAL)
        .agg(_sum_columns(*SUMS))
    )
    return _fill_intervals(found, clock, places.movements)


def _share_lost_time(lost: pl.DataFrame, connections: pl.DataFrame, by: str) -> pl.DataFrame:
    """Time lost per vehicle that entered a junction from a lane or edge in an interval."""
    import polars as pl

    entered = connections.group_by(by, "begin").agg(pl.col("through").sum().alias("by_all"))
    return (
        lost.select(by, "begin", *LOST)
        .sort("begin")
        .join_asof(
            entered.filter(pl.col("by_all") > 0).sort("begin").with_columns(then="begin"),
            on="begin",
            by=by,
            strategy="forward",
            check_sortedness=False,
        )
        .drop_nulls("then")
        .group_by(by, pl.col("then").alias("begin"))
        .agg(pl.col(name).sum() / pl.col("by_all").first() for name in LOST)
    )


def _came_in() -> pl.Expr:
    """Vehicles that came into a junction by its first lanes, or started on one of its lanes."""
    import polars as pl

    first = pl.col("lane") == pl.col("via")
    return pl.when(first).then("entered").otherwise(0) + pl.col("departed")


@lru_cache(maxsize=16)
def _sum_columns(*names: str) -> Sequence[pl.Expr]:
    import polars as pl

    return [_sum_known(pl.col(name), name) for name in names]


def _sum_known(column: pl.Expr, name: str) -> pl.Expr:
    """Sum of a column; null where it was not recorded at all."""
    import polars as pl

    if name not in EMISSIONS:
        return column.sum().alias(name)
    return pl.when(pl.col(name).count() > 0).then(column.sum()).alias(name)


def _fill_intervals(found: pl.DataFrame, clock: pl.DataFrame, places: pl.DataFrame) -> pl.DataFrame:
    """One row for each place that a vehicle came to and each interval; length in km."""
    import polars as pl

    key = places.columns[0]
    seen = places.join(found, on=key, how="semi").sort(key)
    grid = seen.with_columns(pl.col("length") / 1000.0).join(clock, how="cross")
    return _fill_grid(grid, found, (key, *INTERVAL))


def _fill_grid(grid: pl.DataFrame, found: pl.DataFrame, keys: Sequence[str]) -> pl.DataFrame:
    """Rows of ``found`` on those of ``grid``; zeros where there are none."""
    import polars as pl

    recorded = {name for name in EMISSIONS if found[name].count()}
    zero = [pl.col(n).fill_null(0) for n in found.columns if n not in {*EMISSIONS, *keys}]
    zero += [pl.col(name).fill_null(0) for name in sorted(recorded)]
    return grid.join(found, on=keys, how="left", maintain_order="left").with_columns(zero)
