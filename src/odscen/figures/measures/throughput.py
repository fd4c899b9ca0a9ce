"""How much traffic the roads carried, and where it was delayed most."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.measures.figure import CLOCK, Basis, Better, Display, ReportSection, RunFigure

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    from odscen.figures.measures.figure import RunData

LEAST_VEHICLES = 5
"""A junction that fewer vehicles enter in a run is not looked at for the worst delay."""


def _measure_throughput(run: RunData) -> float:
    network = run.network
    hours = (network["end"] - network["begin"]) / 3600.0
    return float(network["arrived"] / hours)


def _worst_junction_delay(run: RunData) -> float | None:
    import polars as pl

    if run.traffic is None:
        return None
    junctions = run.traffic.whole["junctions"]
    entered = junctions.filter(junctions["vehicles"] >= LEAST_VEHICLES)
    control = pl.when(pl.col("passages") >= LEAST_VEHICLES).then("control_delay")
    shown = control if entered["passages"].count() else pl.col("delay")
    worst = entered.select(shown.alias("shown"))["shown"].max()
    return worst if isinstance(worst, float) else None


def _describe_arrivals(values: Mapping[str, Any]) -> str:
    arrivals = values.get("throughput")
    return "" if arrivals is None else f"{arrivals:,.0f} arrived per hour"


FIGURES = (
    RunFigure(
        name="vehicle_km",
        unit="km",
        label="vehicle-kilometres travelled",
        definition="Kilometres of all vehicles, arrived or not.",
        source="SUMO lane data, distance",
        basis=Basis.ROADS,
        display=Display("km", digits=0),
        section=ReportSection.KEY_FIGURES,
        note=_describe_arrivals,
        compute=lambda run: float(run.network["distance"]) / 1000.0,
    ),
    RunFigure(
        name="throughput",
        unit="veh/h",
        label="throughput",
        definition="Vehicles that arrived, per hour.",
        source="SUMO lane data, arrived",
        better=Better.HIGHER,
        basis=Basis.ROADS,
        display=Display("veh/h", digits=0),
        compute=_measure_throughput,
    ),
    RunFigure(
        name="worst_junction_delay",
        unit="s",
        label="highest junction delay",
        definition="Control delay per vehicle of the junction with the highest, of those that "
        f"{LEAST_VEHICLES} vehicles or more enter; at two-way stops of the minor movements. "
        "Without trajectories all that is lost on the approaches and in it.",
        source="HCM, 7th edition, control delay, from trajectories",
        better=Better.LOWER,
        basis=Basis.ROADS,
        display=CLOCK,
        section=ReportSection.KEY_FIGURES,
        note="control delay per vehicle",
        compute=_worst_junction_delay,
    ),
)
