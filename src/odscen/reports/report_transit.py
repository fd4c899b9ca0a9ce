"""Public transport in the report: what became of the timetable, stop by stop."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.markup import Markup, element, number
from odscen.figures.measures.figure import ReportSection
from odscen.figures.measures.timetable import LATE, stops_served
from odscen.reports.page_templates import html_table, report_section
from odscen.reports.report_figures import card_grid, figure_cards

if TYPE_CHECKING:
    from collections.abc import Mapping

    import polars as pl

_HEADS = ("Line", "Stop", "Visits", "Mean dwell time, s", "Mean lateness, s", "On time, %")


def transit_section(visits: pl.DataFrame, values: Mapping[str, Any]) -> Markup | None:
    """Cards over all lines, and a row for each stop of each line.

    Parameters
    ----------
    visits
        From :func:`odscen.runs.recorded.read_visits`.
    """
    if visits.is_empty():
        return None
    rows = [
        element(
            "tr",
            element("td", line),
            element("td", stop),
            element("td", f"{count:,}", class_="num"),
            element("td", number(dwell, digits=1), class_="num"),
            element("td", "-" if late is None else number(late, digits=1), class_="num"),
            element("td", "-" if share is None else f"{share:.0%}".rstrip("%"), class_="num"),
        )
        for line, stop, count, dwell, late, share in stops_served(visits).iter_rows()
    ]
    explained = (
        "stops in the order in which trips of a line serve them first. A departure is on time if "
        f"it is at most {LATE / 60:g} min late; none is early, as vehicles wait. "
        "Visits that had not ended with the run are left out."
    )
    return report_section(
        "Public transport",
        card_grid(figure_cards(ReportSection.TRANSIT, values)),
        html_table(_HEADS, rows, label="Stops of lines"),
        explained=explained,
        ident="transit",
    )
