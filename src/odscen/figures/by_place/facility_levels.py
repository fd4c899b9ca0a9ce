"""Facility, control delay, density and level of service as columns of the tables by place."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from odscen.figures.by_place.facilities import Facility, junction_facilities
from odscen.figures.by_place.group_figures import (
    GROUP_RATES,
    GROUP_SUMS,
    GROUP_WORST,
    over_capacity,
)
from odscen.figures.by_place.level_of_service import (
    FEWEST,
    highway_level,
    junction_level,
    street_level,
)
from odscen.figures.by_place.traffic_sums import SPREAD

if TYPE_CHECKING:
    import polars as pl

    from odscen.figures.by_place.facilities import FacilityData

CONTROL = ("passages", "control_seconds")
"""Columns of junctions and movements that sum up over time."""

_UNGRADED = (Facility.MAJOR.value, Facility.UNCONTROLLED.value)
"""HCM grades neither what goes first at a two-way stop, nor a junction where nobody gives way."""


def with_missing(table: pl.DataFrame) -> pl.DataFrame:
    """Add what tables by place of earlier versions lack, as null."""
    import polars as pl

    types = {"facility": pl.String, "passages": pl.Int64}
    types |= {"lane_group": pl.String, "demand": pl.Int64}
    names: tuple[str, ...] = ()
    if "segment" in table.columns:
        names = ("facility", "lane_density", "car_seconds", "lane_metres", SPREAD, "spread")
    elif "junction" in table.columns:
        names = ("facility", "control_delay", *CONTROL)
        if "movement" in table.columns:
            names += ("lane_group", *GROUP_SUMS, *GROUP_WORST, *GROUP_RATES)
    return table.with_columns(
        pl.lit(None, types.get(name, pl.Float64)).alias(name)
        for name in names
        if name not in table.columns
    )


def with_control(
    sums: pl.DataFrame, found: FacilityData | None, place: Literal["junction", "movement"]
) -> pl.DataFrame:
    """Add ``facility``, ``passages`` and ``control_seconds``; null if not known."""
    import polars as pl

    if found is None:
        return sums.with_columns(
            facility=pl.lit(None, pl.String),
            passages=pl.lit(None, pl.Int64),
            control_seconds=pl.lit(None, pl.Float64),
        )
    kinds = junction_facilities(found.movements)
    delays = found.by_junction
    if place == "movement":
        # Movements from several lanes are as their strictest one.
        kinds = found.movements.group_by("movement").agg(pl.col("facility").sort().last())
        delays = found.by_movement
    rows = sums.join(kinds, on=place, how="left", maintain_order="left")
    if delays is None:
        return rows.with_columns(
            passages=pl.lit(None, pl.Int64), control_seconds=pl.lit(None, pl.Float64)
        )
    return rows.join(delays, on=(place, "begin"), how="left", maintain_order="left").with_columns(
        pl.col(name).fill_null(0) for name in CONTROL
    )


def with_density(sums: pl.DataFrame, found: FacilityData | None) -> pl.DataFrame:
    """Add ``facility``, ``car_seconds`` and ``lane_metres`` to segments; null but of highways."""
    import polars as pl

    density = pl.DataFrame(
        schema={
            "segment": pl.String,
            "begin": pl.Float64,
            "car_seconds": pl.Float64,
            "lane_metres": pl.Float64,
        }
    )
    if found is not None:
        density = found.density.select(density.columns)
    highways = density.group_by("segment").agg(pl.col("lane_metres").max())
    rows = sums.join(
        density.drop("lane_metres"), on=("segment", "begin"), how="left", maintain_order="left"
    ).join(highways, on="segment", how="left", maintain_order="left")
    there = pl.col("lane_metres").is_not_null()
    kind = pl.when(there).then(pl.lit(Facility.HIGHWAY.value))
    return rows.with_columns(
        facility=kind.otherwise(pl.lit(Facility.STREET.value)),
        car_seconds=pl.when(there).then(pl.col("car_seconds").fill_null(0.0)),
    )


def place_level(*, capacity: bool = False) -> pl.Expr:
    """Level of a junction or movement; F where vehicles are stopped and none gets in.

    With ``capacity`` also where v/c is above 1: of movements, for HCM grades whole junctions by
    delay alone.
    """
    import polars as pl

    col = pl.col
    blocked = (col("vehicles") == 0) & (col("standing") >= 1.0)
    delay = pl.coalesce("control_delay", "delay")
    number = pl.coalesce("passages", "vehicles")
    ungraded = col("facility").is_in(_UNGRADED).fill_null(value=False)
    enough = (number >= FEWEST) & ~ungraded
    level = pl.when(enough).then(junction_level(delay, col("control")))
    failed = blocked | (over_capacity() & ~ungraded) if capacity else blocked
    return pl.when(failed).then(pl.lit("F")).otherwise(level)


def place_measure() -> pl.Expr:
    """By what a junction or movement is graded; null where HCM grades none."""
    import polars as pl

    col = pl.col
    some = col("facility") == Facility.TWO_WAY_STOP.value
    control = (
        pl.when(some).then(pl.lit("control delay of minor movements"))
        .otherwise(pl.lit("control delay"))
    )  # fmt: skip
    known = col("control_delay").is_not_null()
    ungraded = col("facility").is_in(_UNGRADED).fill_null(value=False)
    found = pl.when(known).then(control).otherwise(pl.lit("delay on approaches and inside"))
    return pl.when(~ungraded).then(found)


def segment_measure() -> pl.Expr:
    """By what a segment is graded."""
    import polars as pl

    highway = pl.col("facility") == Facility.HIGHWAY.value
    return (
        pl.when(highway).then(pl.lit("cars per km and lane"))
        .otherwise(pl.lit("speed over free-flow speed"))
    )  # fmt: skip


def segment_level(free_seconds: pl.Expr) -> pl.Expr:
    """Level of a segment: of highways by density, of others by speed over free-flow speed.

    F also where vehicles stand and hardly any gets in.
    """
    import polars as pl

    col = pl.col
    share = pl.when(col("seconds") > 0).then(free_seconds / col("seconds"))
    of_kind = (
        pl.when(col("facility") == Facility.HIGHWAY.value)
        .then(highway_level(col("lane_density")))
        .otherwise(street_level(share))
    )
    blocked = (col("standing") >= 1.0) & (of_kind == "F")
    return pl.when((col("vehicles") >= FEWEST) | blocked).then(of_kind)
