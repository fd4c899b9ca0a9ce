"""Figures of segments, junctions and actors, which baselines and comparisons hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.measures.figure import (
    CLOCK,
    COUNT,
    KMH,
    ActorFigure,
    Better,
    JunctionFigure,
    SegmentFigure,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    import polars as pl


def _make_column(name: str) -> Callable[[], pl.Expr]:
    def column() -> pl.Expr:
        import polars as pl

        return pl.col(name)

    return column


def _free_speed() -> pl.Expr:
    """m/s, from the length in km."""
    import polars as pl

    return 1000.0 * pl.col("length") / pl.col("free_flow_time")


FIGURES = (
    SegmentFigure(
        name="vehicles",
        unit="",
        label="vehicles",
        definition="Vehicles that came into the segment or started there.",
        source="SUMO lane data, entered and departed",
        tolerance="5 % or 1",
        display=COUNT,
        column=_make_column("vehicles"),
    ),
    SegmentFigure(
        name="mean_speed",
        unit="m/s",
        label="mean speed",
        definition="Space mean speed, stops included.",
        source="Edie (1963); SUMO lane data",
        better=Better.HIGHER,
        tolerance="10 % or 1 m/s",
        display=KMH,
        column=_make_column("speed"),
        tells=True,
    ),
    SegmentFigure(
        name="free_speed",
        unit="m/s",
        label="free-flow speed",
        definition="Speed that the drivers desired: length over free-flow time.",
        source="SUMO lane data, timeLoss",
        better=Better.HIGHER,
        tolerance="5 % or 0.5 m/s",
        display=KMH,
        column=_free_speed,
    ),
    JunctionFigure(
        name="vehicles",
        unit="",
        label="vehicles",
        definition="Vehicles that entered the junction.",
        source="SUMO lane data, entered and departed",
        tolerance="5 % or 1",
        display=COUNT,
        column=_make_column("vehicles"),
    ),
    JunctionFigure(
        name="waiting_time",
        unit="s",
        label="stopped delay",
        definition="Time below 0.1 m/s per vehicle, from the junction before, or its start, "
        "through this one.",
        source="SUMO lane data, waitingTime",
        better=Better.LOWER,
        tolerance="10 % or 1.5 s",
        display=CLOCK,
        column=_make_column("waiting"),
        tells=True,
    ),
    ActorFigure(
        name="travel_time",
        unit="s",
        label="travel time",
        definition="Time from insertion to arrival; not of members of flows, which differ by seed.",
        source="SUMO, departed and arrived",
        better=Better.LOWER,
        tolerance="10 % or 5 s",
        display=CLOCK,
        compute=lambda outcome: outcome.travel_time,
    ),
)
