"""How far travel times can be relied on.

With ``x`` = travel time over free-flow time of each vehicle that arrived, the latter its travel
time less its time loss (FHWA, *Travel Time Reliability: Making It There On Time, All The Time*,
FHWA-HOP-06-070).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.measures.figure import Basis, Better, Display, ReportSection, RunFigure

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    import polars as pl

    from odscen.figures.measures.figure import RunData

_FHWA = "FHWA-HOP-06-070"
_RATIOS = "travel time over free-flow time"
_RATIO = Display("", digits=2)


def _travel_time_ratios(run: RunData) -> pl.Series:
    if _RATIOS not in run.kept:
        run.kept[_RATIOS] = _compute_trip_ratios(run.trips)
    ratios: pl.Series = run.kept[_RATIOS]
    return ratios


def _compute_trip_ratios(trips: pl.DataFrame | None) -> pl.Series:
    import polars as pl

    if trips is None:
        return pl.Series(dtype=pl.Float64)
    free = trips["duration"] - trips["time_loss"]
    driven = ~trips["person"] & trips["arrival"].is_not_null() & (free > 0)
    return (trips["duration"] / free).filter(driven)


def _mean_ratio(run: RunData) -> float | None:
    mean = _travel_time_ratios(run).mean()
    return mean if isinstance(mean, float) else None


def _late_ratio(run: RunData) -> float | None:
    return _travel_time_ratios(run).quantile(0.95, "linear")


def _buffer_index(run: RunData) -> float | None:
    mean, late = _mean_ratio(run), _late_ratio(run)
    return None if mean is None or late is None else late / mean - 1.0


FEW_PER_HOUR = 100.0
"""Vehicles that arrive in an hour, below which an index says little of traffic."""


def _say_what_it_shows(values: Mapping[str, Any]) -> str:
    """Of few vehicles, as at night, the index is that of lights and signs, and not of traffic."""
    words = "mean travel time over free-flow time"
    arrivals = values.get("throughput")
    if arrivals is None or arrivals >= FEW_PER_HOUR:
        return words
    return f"{words}; with so few vehicles what red lights and signs cost them, not traffic"


FIGURES = (
    RunFigure(
        name="travel_time_index",
        unit="",
        label="travel time index",
        definition="Mean of travel time over free-flow time, of vehicles that arrived.",
        source=_FHWA,
        better=Better.LOWER,
        basis=Basis.TRIPS,
        display=_RATIO,
        section=ReportSection.KEY_FIGURES,
        note=_say_what_it_shows,
        compute=_mean_ratio,
    ),
    RunFigure(
        name="planning_time_index",
        unit="",
        label="planning time index (95th percentile)",
        definition="95th percentile of travel time over free-flow time, of vehicles that arrived.",
        source=_FHWA,
        better=Better.LOWER,
        basis=Basis.TRIPS,
        display=_RATIO,
        section=ReportSection.KEY_FIGURES,
        note="95th percentile travel time over free-flow time",
        compute=_late_ratio,
    ),
    RunFigure(
        name="buffer_index",
        unit="",
        label="buffer index",
        definition="What one has to add to the mean travel time to be on time on 19 of 20 trips, "
        "as a share of that mean.",
        source=_FHWA,
        better=Better.LOWER,
        basis=Basis.TRIPS,
        compute=_buffer_index,
    ),
)
