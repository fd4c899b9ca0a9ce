"""Emissions and fuel: over time, and where most of them arise."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.markup import Markup, element, number
from odscen.figures.by_place.traffic import over_run
from odscen.reports.charts import Series
from odscen.reports.page_templates import html_table, report_section
from odscen.reports.report_figures import Card, card_grid
from odscen.reports.report_flow import column, network_chart

if TYPE_CHECKING:
    import polars as pl

    from odscen.figures.by_place.traffic import TrafficFigures

SHOWN = 12

SUBSTANCES = {
    "co2": ("carbon dioxide (CO2)", "c-truck"),
    "fuel": ("fuel", "c-bus"),
    "nox": ("nitrogen oxides (NOx)", "c-motorcycle"),
    "co": ("carbon monoxide (CO)", "c-van"),
    "hc": ("hydrocarbons (HC)", "c-bicycle"),
    "pmx": ("particulate matter (PMx)", "c-other"),
}
"""Words and colour by column, in the order of the legends."""

_CHARTS = (
    ("kg/h", 1000.0, ("co2", "fuel"), "Carbon dioxide and fuel over time"),
    ("g/h", 1.0, ("nox", "hc", "pmx"), "Pollutants over time"),
)


def emission_section(figures: TrafficFigures) -> Markup | None:
    """Totals, charts and the places with most; ``None`` if emissions were not recorded."""
    network = figures.network.sort("begin")
    if network.is_empty() or not (network["co2"].sum() or 0.0):
        return None
    total = over_run(network).row(0, named=True)
    parts = [
        card_grid(
            Card(words, _mass(total[name]))
            for name, (words, _) in SUBSTANCES.items()
            if total[name] is not None
        )
    ]
    if network.height > 1:
        parts += _charts(network)
    parts += [element("h3", "Places with the highest emissions"), _places(figures, total["co2"])]
    explained = (
        "exhaust emissions and fuel consumption, by the handbook of emission factors (HBEFA) for "
        "average vehicles of each category; brakes and tyres are not included. A share is that "
        "of the whole network. High emissions per vehicle at a place mean that vehicles stop "
        "and start there."
    )
    return report_section("Emissions and fuel", *parts, explained=explained, ident="emissions")


def _charts(network: pl.DataFrame) -> list[Markup]:
    hours = (column(network, "end") - column(network, "begin")) / 3600.0
    charts = []
    for label, unit, names, text in _CHARTS:
        series = [
            Series(SUBSTANCES[name][0], SUBSTANCES[name][1], column(network, name) / hours / unit)
            for name in names
            if name in network.columns and network[name].is_not_null().any()
        ]
        charts.append(element("h3", text))
        charts.append(network_chart(network, series, y_label=label, description=text))
    return charts


def _places(figures: TrafficFigures, total: float) -> Markup:
    import polars as pl

    tables = [
        over_run(table).select(
            pl.lit(kind).alias("kind"),
            pl.col(place).alias("place"),
            "vehicles",
            pl.col("co2", "fuel", "nox", "pmx").cast(pl.Float64),
        )
        for kind, place, table in (
            ("road", "segment", figures.segments),
            ("junction", "junction", figures.junctions),
        )
    ]
    most = (
        pl.concat(tables)
        .filter(pl.col("co2").is_not_null())
        .sort(["co2", "place"], descending=[True, False])
        .head(SHOWN)
    )
    heads = (
        "Place",
        "Kind",
        "CO2, kg",
        "Share, %",
        "CO2 per vehicle, g",
        "Fuel, kg",
        "NOx, g",
        "PMx, g",
        "Vehicles",
    )
    rows = [_row(row, total) for row in most.iter_rows(named=True)]
    return html_table(heads, rows, label="Places with the highest emissions", class_="places")


def _row(row: dict[str, Any], total: float) -> Markup:
    each = row["co2"] / row["vehicles"] if row["vehicles"] else None
    numbers = (
        number(row["co2"] / 1000.0, 1),
        number(100.0 * row["co2"] / total, 1),
        "-" if each is None else number(each, 0),
        number((row["fuel"] or 0.0) / 1000.0, 1),
        number(row["nox"] or 0.0, 1),
        number(row["pmx"] or 0.0, 2),
        f"{row['vehicles']:,}",
    )
    return element(
        "tr",
        element("th", row["place"], scope="row"),
        element("td", row["kind"]),
        *(element("td", text, class_="n") for text in numbers),
    )


def _mass(grams: float) -> str:
    for unit, size in (("t", 1e6), ("kg", 1e3)):
        if grams >= size:
            return f"{number(grams / size, 1)} {unit}"
    return f"{number(grams, 1)} g"
