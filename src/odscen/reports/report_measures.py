"""Measures of the scenario: the report's table, and their places on its map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.markup import Markup, element, join, path_data
from odscen.reports.page_templates import html_table, report_section
from odscen.reports.report_words import duration

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.records.run_plan import PlannedMeasure

LABELS = {
    "closure": "Closure",
    "roadworks": "Roadworks",
    "incident": "Incident",
    "speed_limit": "Speed limit",
    "permission": "Permission",
    "signal_outage": "Signal out of order",
}
"""Words for the kinds of measures."""


def measure_section(measures: Sequence[PlannedMeasure], stranded: int = 0) -> Markup | None:
    """Table of the measures; ``None`` if there are none.

    Parameters
    ----------
    stranded
        How many actors they have left without a route.
    """
    if not measures:
        return None
    rows = [_row(number, one) for number, one in enumerate(measures, start=1)]
    table = html_table(("No.", "Measure", "What", "From", "Until"), rows, label="Measures")
    verb = "road user was" if stranded == 1 else "road users were"
    left = f"{stranded:,} {verb} stranded: every route to the goal was closed." if stranded else ""
    explained = (
        "what the scenario closes, narrows, limits or switches off, and when, in seconds after the "
        "start; the number is on the map. Drivers know of a closure when it begins and take the "
        "quickest other route in free flow."
    )
    said = element("p", left) if left else None
    return report_section("Measures", table, said, explained=explained, ident="measures")


def measure_layer(measures: Sequence[PlannedMeasure], dot: float) -> Markup | None:
    """Places of the measures with their numbers, in the map's centimetres."""
    parts = [_place(number, one, dot) for number, one in enumerate(measures, start=1) if one.lines]
    return element("g", *parts, class_="measures") if parts else None


def _row(number: int, one: PlannedMeasure) -> Markup:
    cells = (
        element("th", str(number), scope="row"),
        element("td", f"{LABELS.get(one.kind, one.kind)} {one.id}"),
        element("td", one.words, class_="wrap"),
        element("td", duration(one.begin) or "0 s", class_="n"),
        element("td", duration(one.end), class_="n"),
    )
    return element("tr", join(list(cells)))


def _place(number: int, one: PlannedMeasure, dot: float) -> Markup:
    title = element("title", f"{number}: {one.id}, {one.words}")
    lines = [np.array(line).reshape(-1, 2) * (1.0, -1.0) for line in one.lines]
    starts = np.cumsum([0, *(len(line) for line in lines)])
    points = [(line[0] * 100).round().astype(int).tolist() for line in lines if len(line) == 1]
    data = path_data(np.concatenate(lines), starts) + "".join(f"M{x} {y}h0" for x, y in points)
    longest = max(lines, key=len)
    x, y = (longest[len(longest) // 2] * 100).round().astype(int).tolist()
    shown = element("path", d=data, stroke_width=round(dot * 160))
    label = element("text", str(number), x=x, y=y, font_size=round(dot * 420))
    return element("g", title, shown, label)
