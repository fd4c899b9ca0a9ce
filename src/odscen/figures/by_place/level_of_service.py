"""Level of service, A to F, as the Highway Capacity Manual defines it (HCM, 7th edition, 2022)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import polars as pl

Level = Literal["A", "B", "C", "D", "E", "F"]
JunctionControl = Literal["signal", "priority"]

SIGNAL_DELAY = (10.0, 20.0, 35.0, 55.0, 80.0)
"""Control delay (s per vehicle) up to which a signalised intersection has level A, B, ... E: HCM
Exhibit 19-8."""
PRIORITY_DELAY = (10.0, 15.0, 25.0, 35.0, 50.0)
"""The same without a signal: HCM Exhibits 20-2 (two-way stop), 21-8 (all-way stop) and 22-8
(roundabout)."""
STREET_SPEED = (0.80, 0.67, 0.50, 0.40, 0.30)
"""Share of the free-flow speed above which vehicles on an urban street travel for level A, B, ...
E: HCM Exhibit 18-1, whose speeds are these shares of the base free-flow speed."""

HIGHWAY_DENSITY = tuple(round(bound / 1.609344, 2) for bound in (11.0, 18.0, 26.0, 35.0, 45.0))
"""Passenger cars per km and lane up to which a freeway or multilane highway has level A, B, ... E:
HCM Exhibit 12-15, whose bounds are 11, 18, 26, 35 and 45 pc/mi/ln."""
FEWEST = 10
"""A place with fewer vehicles has no level: a mean over a handful says nothing of the place."""

_LEVELS: tuple[Level, ...] = ("A", "B", "C", "D", "E", "F")


def street_level(share: pl.Expr) -> pl.Expr:
    """Level of a segment by travel speed over free-flow speed; null where that is null."""
    return _grade_value(share, [share > bound for bound in STREET_SPEED])


def highway_level(density: pl.Expr) -> pl.Expr:
    """Level of a freeway or multilane highway by passenger cars per km and lane."""
    return _grade_value(density, [density <= bound for bound in HIGHWAY_DENSITY])


def junction_level(delay: pl.Expr, control: pl.Expr) -> pl.Expr:
    """Level of a junction or movement by delay (s per vehicle) and :data:`JunctionControl`."""
    import polars as pl

    return (
        pl.when(control == "signal")
        .then(_grade_value(delay, [delay <= bound for bound in SIGNAL_DELAY]))
        .otherwise(_grade_value(delay, [delay <= bound for bound in PRIORITY_DELAY]))
    )


def _grade_value(value: pl.Expr, reached: list[pl.Expr]) -> pl.Expr:
    import polars as pl

    level = pl.lit(_LEVELS[-1])
    for word, condition in zip(_LEVELS[-2::-1], reversed(reached), strict=True):
        level = pl.when(condition).then(pl.lit(word)).otherwise(level)
    return pl.when(value.is_not_null()).then(level)
