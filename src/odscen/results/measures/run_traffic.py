"""Figures of traffic of a whole run: emissions, reliability, throughput."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.results.measures.traffic import over_run

if TYPE_CHECKING:
    import polars as pl

    from odscen.results.measures.traffic import TrafficFigures

TRAFFIC_FIGURES = (
    "co2_total",
    "fuel_total",
    "nox_total",
    "pmx_total",
    "co2_per_km",
    "travel_time_index",
    "planning_time_index",
    "buffer_index",
    "vehicle_km",
    "throughput",
    "worst_junction_delay",
)
LEAST_VEHICLES = 5
"""A junction that fewer vehicles enter in a run is not looked at for the worst delay."""


def traffic_of_run(
    figures: TrafficFigures | None, trips: pl.DataFrame | None
) -> dict[str, float | None]:
    """One number for each of :data:`TRAFFIC_FIGURES`; ``None`` where it is not known.

    - ``co2_total``, ``fuel_total`` (kg), ``nox_total``, ``pmx_total`` (g), ``vehicle_km``, and
      ``co2_per_km`` (g per vehicle-kilometre): of all vehicles, arrived or not.
    - ``throughput``: vehicles that arrived, per hour.
    - ``worst_junction_delay``: s per vehicle, of the junction with the greatest.
    - ``travel_time_index``, ``planning_time_index``, ``buffer_index``: see :func:`reliability`.
    """
    found: dict[str, float | None] = dict.fromkeys(TRAFFIC_FIGURES)
    if figures is not None:
        network = over_run(figures.network).row(0, named=True)
        grams = {name: network[name] for name in ("co2", "fuel", "nox", "pmx")}
        found["vehicle_km"] = network["distance"] / 1000.0
        for name, unit in (("co2", 1000.0), ("fuel", 1000.0), ("nox", 1.0), ("pmx", 1.0)):
            found[f"{name}_total"] = None if grams[name] is None else grams[name] / unit
        if grams["co2"] is not None and found["vehicle_km"]:
            found["co2_per_km"] = grams["co2"] / found["vehicle_km"]
        hours = (network["end"] - network["begin"]) / 3600.0
        found["throughput"] = network["arrived"] / hours
        junctions = over_run(figures.junctions)
        entered = junctions.filter(junctions["vehicles"] >= LEAST_VEHICLES)
        found["worst_junction_delay"] = entered["delay"].max()  # type: ignore[assignment]
    if trips is not None:
        found |= reliability(trips)
    return found


def reliability(trips: pl.DataFrame) -> dict[str, float | None]:
    """How much longer vehicles travel than with a free road, and how far that can be relied on.

    With ``x`` = travel time over free-flow time of each vehicle that arrived, the latter its travel
    time less its time loss (FHWA, *Travel Time Reliability: Making It There On Time, All The Time*,
    FHWA-HOP-06-070): ``travel_time_index`` = mean of ``x``, ``planning_time_index`` = its 95th
    percentile, ``buffer_index`` = what one has to add to the mean to be in time on 19 of 20 trips,
    as share of the mean.

    Parameters
    ----------
    trips
        From :func:`odscen.sumo.folder.recorded.read_trips`.
    """
    import polars as pl

    free = pl.col("duration") - pl.col("time_loss")
    ratios = trips.filter(~pl.col("person") & pl.col("arrival").is_not_null() & (free > 0)).select(
        x=pl.col("duration") / free
    )["x"]
    mean, late = ratios.mean(), ratios.quantile(0.95, "linear")
    if not isinstance(mean, float) or late is None:
        return dict.fromkeys(("travel_time_index", "planning_time_index", "buffer_index"))
    return {
        "travel_time_index": mean,
        "planning_time_index": late,
        "buffer_index": late / mean - 1.0,
    }
