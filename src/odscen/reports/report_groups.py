"""Lane groups and stations in the report: v/c, queues in metres, and what was counted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.markup import Markup, element, number
from odscen.figures.by_place.traffic import over_run
from odscen.reports.page_templates import html_table, report_section
from odscen.reports.report_words import stretch

if TYPE_CHECKING:
    import polars as pl

SHOWN = 12
"""Rows at most, the longest queues first."""
_HEADS = (
    "Lane group: from, through, to", "v/c", "Demand, veh/h", "Capacity, veh/h", "Mean queue, m",
    "95th percentile, m", "Longest, m", "Storage, m", "Over storage", "Spillback",
)  # fmt: skip


def group_section(groups: pl.DataFrame) -> Markup | None:
    """Table of the lane groups with the longest queues; ``None`` if there are none.

    Parameters
    ----------
    groups
        ``lane_groups`` of :class:`odscen.figures.by_place.traffic.TrafficFigures`.
    """
    import polars as pl

    if groups.is_empty():
        return None
    rows = over_run(groups).sort(["queue_metres_p95", "lane_group"], descending=[True, False])
    hours = (pl.col("end") - pl.col("begin")) / 3600.0
    shown = rows.head(SHOWN).with_columns(
        demand=pl.col("demand") / hours, capacity=pl.col("capacity") / hours
    )
    table = html_table(
        list(_HEADS),
        [_row(row) for row in shown.iter_rows(named=True)],
        label="Lane groups with the longest queues",
        class_="places",
    )
    explained = (
        "a lane group is what the Highway Capacity Manual analyses as one: the lanes of an "
        "approach that share a movement. v/c is demand over capacity, of those who give way or "
        "have a light; above 1 the level of service is F. A queue reaches from the stop line to "
        "the rear of its last vehicle. "
        "Over storage: the share of the time in which it is longer than the lanes of the group; "
        "spillback: in which it reaches the junction behind, or the edge of the map. The 95th "
        "percentile is that of the worst interval."
    )
    return report_section("Capacity and queues", table, explained=explained, ident="groups")


def _row(row: dict[str, object]) -> Markup:
    def cell(name: str, digits: int, *, factor: float = 1.0, unit: str = "") -> Markup:
        value = row[name]
        words = f"{number(value * factor, digits)}{unit}" if isinstance(value, int | float) else "-"
        return element("td", words, class_="n")

    return element(
        "tr",
        element("th", str(row["lane_group"]).replace(">", " > "), scope="row"),
        cell("vc", 2),
        cell("demand", 0),
        cell("capacity", 0),
        cell("queue_metres", 0),
        cell("queue_metres_p95", 0),
        cell("queue_metres_max", 0),
        cell("storage", 0),
        cell("overflow", 1, factor=100.0, unit=" %"),
        cell("spillback", 1, factor=100.0, unit=" %"),
    )


MOST_STATIONS = 200
"""Rows at most; the file has all."""
_STATION_COLUMNS = (
    ("vehicles", "Vehicles", 0, 1.0),
    ("flow", "veh/h", 0, 1.0),
    ("speed", "Speed, km/h", 1, 3.6),
    ("occupancy", "Occupancy, %", 1, 100.0),
    ("travel_time", "Travel time, s", 1, 1.0),
    ("travel_time_p95", "95th percentile, s", 1, 1.0),
    ("left", "Left", 0, 1.0),
    ("balance", "Balance", 0, 1.0),
)


def station_section(stations: pl.DataFrame) -> Markup | None:
    """Table of stations by interval, see :mod:`odscen.figures.by_place.station_figures`."""
    if stations.is_empty():
        return None
    rows = []
    for row in stations.head(MOST_STATIONS).iter_rows(named=True):
        cells = [
            element("th", row["station"], scope="row"),
            element("td", row["kind"]),
            element("td", stretch(row["begin"], row["end"])),
        ]
        for name, _, digits, factor in _STATION_COLUMNS:
            value = row[name]
            words = "-" if value is None else number(value * factor, digits)
            cells.append(element("td", words, class_="n"))
        rows.append(element("tr", *cells))
    heads = ["Station", "Kind", "Time", *(words for _, words, _, _ in _STATION_COLUMNS)]
    explained = (
        "detectors count who crosses them; sections the time of those that completed them in the "
        "interval; cordons who came in, who left, and the balance of both since the start of the "
        "run."
    )
    if stations.height > MOST_STATIONS:
        explained += (
            f" The first {MOST_STATIONS} of {stations.height:,} rows; figures/stations.csv has all."
        )
    table = html_table(heads, rows, label="Stations by interval", class_="places")
    return report_section("Stations", table, explained=explained, ident="stations")
