"""How well lines keep to their timetable, and how full parking places are."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.measures.figure import Basis, Better, Display, ReportSection, RunFigure

if TYPE_CHECKING:
    import polars as pl

    from odscen.figures.measures.figure import RunData

LATE = 300.0
"""Seconds behind schedule up to which a departure is on time, as TCRP Report 165 has it; earlier
than scheduled none departs."""

_SOURCE = "SUMO stop output; TCRP Report 165 (TCQSM, 3rd edition), on-time performance"


def lateness(visits: pl.DataFrame) -> pl.DataFrame:
    """Visits with a scheduled departure, and seconds behind it in column ``late``."""
    import polars as pl

    late = (pl.col("departure") - pl.col("scheduled")).clip(lower_bound=0.0).alias("late")
    return visits.filter(pl.col("scheduled").is_not_null()).with_columns(late)


def stops_served(visits: pl.DataFrame) -> pl.DataFrame:
    """A row for each line and stop in the order in which trips serve them.

    Columns ``line``, ``stop``, ``visits``, ``dwell`` (mean, s), ``late`` (mean, s) and ``on_time``
    (share of scheduled departures), null without a timetable; ``boarded``, ``alighted`` (persons)
    and ``on_board`` (mean of persons on arrival).
    """
    import polars as pl

    known = visits.with_columns(
        pl.col("actor").str.replace(r"\.\d+$", "").alias("line"),
        (pl.col("departure") - pl.col("arrival")).alias("dwell"),
        (pl.col("departure") - pl.col("scheduled")).clip(lower_bound=0.0).alias("late"),
    )
    return (
        known.group_by("line", "stop", maintain_order=True)
        .agg(
            pl.len().alias("visits"),
            pl.col("dwell").mean(),
            pl.col("late").mean(),
            (pl.col("late") <= LATE).mean().alias("on_time"),
            *(
                (pl.col("boarded").sum(), pl.col("alighted").sum(), pl.col("on_board").mean())
                if "boarded" in visits.columns  # runs of before have no passengers
                else ()
            ),
        )
        .sort("line", maintain_order=True)
    )


def _count_served(run: RunData) -> float:
    return float(0 if run.visits is None else run.visits.height)


def _mean_lateness(run: RunData) -> float | None:
    return None if run.visits is None else _number_or_none(lateness(run.visits)["late"].mean())


def _compute_on_time_share(run: RunData) -> float | None:
    if run.visits is None:
        return None
    return _number_or_none((lateness(run.visits)["late"] <= LATE).mean())


def _count_parked(run: RunData) -> float | None:
    return None if run.parking is None else float(run.parking.use().ended)


def _count_diverted(run: RunData) -> float | None:
    return None if run.parking is None else float(run.parking.use().diverted)


def _mean_occupancy(run: RunData) -> float | None:
    return None if run.parking is None else run.parking.use().occupancy


def _number_or_none(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) else None


FIGURES = (
    RunFigure(
        name="stops_served",
        unit="",
        label="stops served",
        definition="Visits of stops by vehicles of lines that have ended.",
        source="SUMO stop output",
        better=Better.HIGHER,
        basis=Basis.STOPS,
        display=Display("", digits=0),
        section=ReportSection.TRANSIT,
        compute=_count_served,
    ),
    RunFigure(
        name="departure_lateness",
        unit="s",
        label="mean lateness",
        definition="Mean time by which scheduled departures from stops were late.",
        source=_SOURCE,
        better=Better.LOWER,
        tolerance="2 % or 1 s",
        basis=Basis.STOPS,
        display=Display("s", digits=1),
        section=ReportSection.TRANSIT,
        compute=_mean_lateness,
    ),
    RunFigure(
        name="on_time_departures",
        unit="",
        label="departures on time",
        definition=f"Share of scheduled departures no more than {LATE / 60:g} min late.",
        source=_SOURCE,
        better=Better.HIGHER,
        basis=Basis.STOPS,
        display=Display("%", 100.0, 1),
        section=ReportSection.TRANSIT,
        compute=_compute_on_time_share,
    ),
    RunFigure(
        name="parked_trips",
        unit="",
        label="trips ended in a parking place",
        definition="Trips that ended by taking a parking place.",
        source="SUMO stop output",
        better=Better.HIGHER,
        basis=Basis.PARKING,
        display=Display("", digits=0),
        section=ReportSection.PARKING,
        compute=_count_parked,
    ),
    RunFigure(
        name="parking_diverted",
        unit="",
        label="trips diverted to other parking",
        definition="Trips that ended in another parking area than planned, as that was full.",
        source="SUMO stop output, against the plan of the run",
        better=Better.LOWER,
        basis=Basis.PARKING,
        display=Display("", digits=0),
        section=ReportSection.PARKING,
        compute=_count_diverted,
    ),
    RunFigure(
        name="parking_occupancy",
        unit="",
        label="parking occupancy",
        definition="Mean share of the parking places of the region that were taken.",
        source="SUMO stop output",
        better=Better.NEITHER,
        basis=Basis.PARKING,
        display=Display("%", 100.0, 1),
        section=ReportSection.PARKING,
        compute=_mean_occupancy,
    ),
)
