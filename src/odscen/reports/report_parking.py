"""Parking in the report: how many places were taken, area by area, and where the areas are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.markup import Markup, element, number
from odscen.figures.measures.figure import ReportSection
from odscen.records.traces import bin_width
from odscen.reports.charts import Series, line_chart
from odscen.reports.page_templates import html_table, report_section
from odscen.reports.report_figures import card_grid, figure_cards

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.figures.by_place.parking_use import AreaUse, ParkingUse
    from odscen.records.run_plan import PlannedParking

_HEADS = (
    "Area", "Segment", "Places", "Trips begun", "Trips ended", "Diverted", "Most taken",
    "Occupancy, %", "Full, % of time",
)  # fmt: skip

MOST_ROWS = 60
"""Areas in the table; of more, those that were fullest."""


def parking_section(parking: ParkingUse, values: Mapping[str, Any]) -> Markup:
    """Cards over all areas, places taken over time, and a row for each area."""
    used = [(one, parking.use(one.id)) for one in parking.areas]
    shown = used
    if len(used) > MOST_ROWS:
        fullest = sorted(used, key=lambda row: -row[1].occupancy)[:MOST_ROWS]
        shown = [row for row in used if row in fullest]
    explained = (
        "a place is taken from when a car has stopped in it until it leaves. Diverted are trips "
        "that were to end in an area and drove to another, because it was full when they came "
        "near. Numbers of areas are on the map."
    )
    if len(shown) < len(used):
        explained += f" Of {len(used):,} areas, the {len(shown)} with the highest occupancy."
    return report_section(
        "Parking",
        card_grid(figure_cards(ReportSection.PARKING, values)),
        _chart(parking),
        html_table(_HEADS, [_row(one, use) for one, use in shown], label="Parking areas"),
        explained=explained,
        ident="parking",
    )


def parking_layer(areas: Sequence[PlannedParking], dot: float) -> Markup | None:
    """Ids of the areas at their places, in the map's centimetres."""
    if not areas:
        return None
    size = round(dot * 380)
    parts = []
    for one in areas:
        title = element("title", f"parking {one.id}, {one.places} places, segment {one.segment}")
        x, y = round(one.x * 100), round(-one.y * 100)
        text = element(
            "text", one.id, x=x, y=y + size // 3, font_size=size, text_anchor="middle",
            fill="#1c4fa0", stroke="#fff", stroke_width=size // 6, paint_order="stroke",
        )  # fmt: skip
        parts.append(element("g", title, text))
    return element("g", *parts, class_="parking-areas")


def _chart(parking: ParkingUse) -> Markup:
    taken = parking.taken()
    width = bin_width(parking.end - parking.begin)
    times = np.arange(parking.begin, parking.end + width / 2.0, width)
    rows = np.searchsorted(taken.time, times, side="right") - 1
    places = sum(one.places for one in parking.areas)
    series = [
        Series("occupied", "c-running", taken.places[rows].astype(np.float64)),
        Series("places", "c-waiting", np.full(len(times), float(places))),
    ]
    text = "Occupied parking places over time, in all areas"
    return line_chart(times, series, y_label="places", description=text, end=parking.end)


def _row(one: PlannedParking, use: AreaUse) -> Markup:
    counts = (use.places, use.begun, use.ended, use.diverted, use.highest)
    shares = (use.occupancy * 100.0, use.full * 100.0)
    return element(
        "tr",
        element("td", one.id),
        element("td", one.segment),
        *(element("td", f"{value:,}", class_="num") for value in counts),
        *(element("td", number(value, digits=0), class_="num") for value in shares),
    )
