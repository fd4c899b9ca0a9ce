"""The parity report as a page: figures, where on the map, when, who and which lights."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.markup import Markup, element, number
from odscen.drawing.svg_layers import LayerOptions, map_layers
from odscen.figures.measures.parity import error_curve, errors_by_place
from odscen.records.traces import bin_width
from odscen.reports.charts import Series, line_chart
from odscen.reports.page_templates import render_page
from odscen.reports.report_maps import CATEGORIES, fitted_view, scale_bar, shaded_cells, view_box

if TYPE_CHECKING:
    from collections.abc import Mapping

    import polars as pl

    from odscen.drawing.map_drawing import MapDrawing

GOAL_M, GOAL_DEG = 0.05, 0.5
"""What a mirror is to keep within: metres and degrees."""
STEPS_M = (GOAL_M, 0.2, 1.0)
"""Limits between the classes of the map, metres."""
NOTHING = 1e-4
"""Metres below which a difference is that of the numbers themselves: CARLA's have 32 bits."""
CELL = 3.0
"""Metres of a cell of the map."""
ABSENT = 50
"""Rows of the list of those who were not shown, at most."""


def render_parity(
    figures: Mapping[str, Any], states: pl.DataFrame, *, drawing: MapDrawing | None = None
) -> str:
    """Write the page.

    Parameters
    ----------
    figures
        As :func:`odscen.figures.measures.parity.parity_figures` gives them.
    states
        As :func:`odscen.figures.measures.parity.with_errors` gives them.
    drawing
        Of the map, to be shown below the errors.
    """
    title = str(figures["scenario"] or "Run")
    position, heading = figures["position_error_m"], figures["heading_error_deg"]
    wrong, shown_by = figures["lights"]["wrong"], figures["shown_by"]
    if position is None:
        style, verdict = "bad", f"{shown_by} showed no road user"
    elif position["max"] <= GOAL_M and heading["max"] <= GOAL_DEG and not wrong:
        style, verdict = "good", "Both worlds agree"
    else:
        style, verdict = "fair", "The two worlds differ in places"
    errors = [("all road users", figures["mirrored"], figures)]
    errors += [
        (CATEGORIES[key].lower(), part["samples"], part)
        for key in CATEGORIES
        if (part := figures["by_category"].get(key))
    ]
    names = [f"up to {format_length(limit)}" for limit in STEPS_M]
    names.append(f"over {format_length(STEPS_M[-1])}")
    return render_page(
        "parity_report.html.j2",
        title=f"{title} - SUMO and {shown_by} compared",
        scenario=title,
        verdict=verdict,
        style=style,
        figures=figures,
        shown_by=shown_by,
        errors=errors,
        map=_error_map(states, drawing, shown_by),
        map_legend=[(f"e{i}", name) for i, name in enumerate(names)],
        over_time=_error_chart(states),
        worst=[row for row in figures["worst"] if row["position"] >= NOTHING],
        absent=figures["absent"][:ABSENT],
        format_length=format_length,
        goal_m=GOAL_M,
        goal_deg=GOAL_DEG,
        cell=CELL,
    )


def format_length(value: float | None) -> str:
    """``"3.1 cm"``, ``"2 m"``, or a dash."""
    if value is None:
        return "-"
    if value < NOTHING:
        return "under 0.1 mm"
    return f"{number(value * 100.0, 2)} cm" if value < 1.0 else f"{number(value, 2)} m"


def _error_map(states: pl.DataFrame, drawing: MapDrawing | None, shown_by: str) -> Markup | None:
    corner, error = errors_by_place(states, size=CELL)
    bounds = fitted_view(corner, drawing)
    if bounds is None or not len(corner):
        return None
    ground = None
    if drawing is not None:
        options = LayerOptions(symbol_size=2.0, prefix="map-")
        ground = element("g", map_layers(drawing.clipped(bounds), options), class_="map")
    steps = np.searchsorted(STEPS_M, error, side="left")
    return element(
        "svg",
        element("title", f"Map: largest distance between SUMO and {shown_by} by place"),
        ground,
        *shaded_cells(corner, CELL, steps, [f"e{i}" for i in range(len(STEPS_M) + 1)]),
        scale_bar(bounds),
        viewBox=view_box(bounds),
        class_="run-map",
        role="img",
    )


def _error_chart(states: pl.DataFrame) -> Markup | None:
    """Errors over time, or the words that there were none."""
    last = states["time"].max()
    if not isinstance(last, float) or states["position"].null_count() == states.height:
        return None
    if states["position"].max() < NOTHING:  # type: ignore[operator]
        return element("p", "The position error was below 0.1 mm at all times.", class_="good")
    time, median, most = error_curve(states, width=bin_width(max(last, 1.0)))
    lines = [
        Series("largest", "c-bus", most * 100.0),
        Series("median", "c-all", median * 100.0),
    ]
    return line_chart(
        time, lines, y_label="distance, cm", description="Distance between the worlds over time"
    )
