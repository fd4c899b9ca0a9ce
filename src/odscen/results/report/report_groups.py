"""Lane groups in the report: v/c, and queues in metres against the room that there is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.markup import Markup, element, number
from odscen.results.by_place.traffic import over_run
from odscen.results.report.page_templates import html_table, report_section

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
        ``lane_groups`` of :class:`odscen.results.by_place.traffic.TrafficFigures`.
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
        "approach that share a movement. v/c is demand over capacity, at traffic lights; above 1 "
        "the level of service is F. A queue reaches from the stop line to the rear of its last "
        "vehicle. "
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
