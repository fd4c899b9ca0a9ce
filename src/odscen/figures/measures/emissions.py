"""Emissions and fuel of all vehicles, arrived or not: SUMO's HBEFA 4.2 model, hot engines."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.measures.figure import Basis, Better, Display, ReportSection, RunFigure

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Any

    from odscen.figures.measures.figure import RunData

_HBEFA = "HBEFA 4.2, as SUMO has it"


def _total_emission(substance: str, unit: float) -> Callable[[RunData], float | None]:
    """Sum over the network in units of so many grams; ``None`` if not recorded."""

    def total(run: RunData) -> float | None:
        grams = run.network[substance]
        return None if grams is None else grams / unit

    return total


def _co2_per_km(run: RunData) -> float | None:
    grams, km = run.network["co2"], run.network["distance"] / 1000.0
    return grams / km if grams is not None and km else None


def _fuel_per_km(values: Mapping[str, Any]) -> str:
    fuel, km = values.get("fuel_total"), values.get("vehicle_km")
    return f"{fuel * 1000.0 / km:.0f} g per vehicle-kilometre" if fuel is not None and km else ""


def _co2_in_all(values: Mapping[str, Any]) -> str:
    total = values.get("co2_total")
    if total is None:
        return ""
    return f"{total:,.0f} kg in all" if total >= 10.0 else f"{total * 1000.0:,.0f} g in all"


FIGURES = (
    RunFigure(
        name="co2_total",
        unit="kg",
        label="total CO2",
        definition="Carbon dioxide of all vehicles.",
        source=_HBEFA,
        better=Better.LOWER,
        basis=Basis.ROADS,
        compute=_total_emission("co2", 1000.0),
    ),
    RunFigure(
        name="fuel_total",
        unit="kg",
        label="total fuel",
        definition="Fuel of all vehicles.",
        source=_HBEFA,
        better=Better.LOWER,
        basis=Basis.ROADS,
        section=ReportSection.KEY_FIGURES,
        note=_fuel_per_km,
        compute=_total_emission("fuel", 1000.0),
    ),
    RunFigure(
        name="nox_total",
        unit="g",
        label="total NOx",
        definition="Nitrogen oxides of all vehicles.",
        source=_HBEFA,
        better=Better.LOWER,
        basis=Basis.ROADS,
        compute=_total_emission("nox", 1.0),
    ),
    RunFigure(
        name="pmx_total",
        unit="g",
        label="total PMx",
        definition="Particulate matter of all vehicles.",
        source=_HBEFA,
        better=Better.LOWER,
        basis=Basis.ROADS,
        compute=_total_emission("pmx", 1.0),
    ),
    RunFigure(
        name="co2_per_km",
        unit="g/km",
        label="CO2 per vehicle-kilometre",
        definition="Carbon dioxide of all vehicles over the kilometres that they travelled.",
        source=_HBEFA,
        better=Better.LOWER,
        basis=Basis.ROADS,
        display=Display("g/km", digits=0),
        section=ReportSection.KEY_FIGURES,
        note=_co2_in_all,
        compute=_co2_per_km,
    ),
)
