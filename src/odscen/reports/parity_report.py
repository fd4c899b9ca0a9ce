"""The parity report as a page: figures, where on the map, when, who and which lights."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.markup import Markup, element, join, number
from odscen.drawing.svg_layers import LayerOptions, map_layers
from odscen.figures.measures.parity import error_curve, errors_by_place
from odscen.records.traces import bin_width
from odscen.reports.charts import Series, line_chart
from odscen.reports.page_templates import html_page, html_table, page_head, report_section
from odscen.reports.report_maps import CATEGORIES, fitted_view, scale_bar, swatch

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

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

_HEADS = ("Median", "95th percentile", "99th percentile", "Largest")


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
    parts = [
        _head(title, figures),
        _errors(figures),
        _map(states, drawing),
        _time(states),
        _departures(figures["departures"]),
        _lights(figures["lights"]),
        _worst(figures["worst"]),
        _absent(figures["absent"]),
    ]
    body = join([part for part in parts if part])
    return html_page(f"{title} - SUMO and CARLA compared", body)


def _head(title: str, figures: Mapping[str, Any]) -> Markup:
    position, heading = figures["position_error_m"], figures["heading_error_deg"]
    wrong = figures["lights"]["wrong"]
    if position is None:
        style, words = "bad", "CARLA showed no road user"
    elif position["max"] <= GOAL_M and heading["max"] <= GOAL_DEG and not wrong:
        style, words = "good", "Both worlds agree"
    else:
        style, words = "fair", "The two worlds differ in places"
    share = figures["share_mirrored"]
    shown = "" if share is None else f"{number(100.0 * share, 2)} % of SUMO's road users"
    sentence = (
        f"In {figures['steps']:,} steps CARLA showed {shown or 'no road user'}; those beyond the "
        "radius that was asked for are left out on purpose."
    )
    kind = "SUMO and CARLA compared"
    return page_head(kind, title, element("p", sentence), verdict=words, style=style)


def _errors(figures: Mapping[str, Any]) -> Markup:
    rows = [_error_row("all road users", figures["mirrored"], figures)]
    rows += [
        _error_row(CATEGORIES[key].lower(), figures["by_category"][key]["samples"], part)
        for key in CATEGORIES
        if (part := figures["by_category"].get(key))
    ]
    heads = ("Category", "Samples", *(f"Position: {name.lower()}" for name in _HEADS))
    table = html_table((*heads, "Height: largest", "Heading: largest"), rows)
    explained = (
        "a sample is one road user in one step. Position is the horizontal distance between the "
        f"two bodies' centres; a mirror is to keep it within {number(GOAL_M * 100)} cm, and "
        f"heading within {number(GOAL_DEG)} degrees."
    )
    return report_section("Position and heading errors", table, explained=explained, ident="errors")


def _error_row(name: str, samples: int, part: Mapping[str, Any]) -> Markup:
    position = part["position_error_m"] or {}
    cells = [
        element("td", _length(position.get(key)), class_=_verdict(position.get(key), GOAL_M))
        for key in ("p50", "p95", "p99", "max")
    ]
    height, heading = part["height_error_m"] or {}, part["heading_error_deg"] or {}
    turn = heading.get("max")
    cells.append(element("td", _length(height.get("max"))))
    text = "-" if turn is None else f"{number(turn, 3)}°"
    cells.append(element("td", text, class_=_verdict(turn, GOAL_DEG)))
    return element("tr", element("th", name, scope="row"), element("td", f"{samples:,}"), *cells)


def _verdict(value: float | None, goal: float) -> str | None:
    return None if value is None else "good" if value <= goal else "bad"


def _length(value: float | None) -> str:
    if value is None:
        return "-"
    if value < NOTHING:
        return "under 0.1 mm"
    return f"{number(value * 100.0, 2)} cm" if value < 1.0 else f"{number(value, 2)} m"


def _map(states: pl.DataFrame, drawing: MapDrawing | None) -> Markup | None:
    corner, error = errors_by_place(states, size=CELL)
    bounds = fitted_view(corner, drawing)
    if bounds is None or not len(corner):
        return None
    layers = []
    if drawing is not None:
        options = LayerOptions(symbol_size=2.0, prefix="map-")
        layers.append(element("g", map_layers(drawing.clipped(bounds), options), class_="map"))
    step = np.searchsorted(STEPS_M, error, side="left")
    side = round(CELL * 100)
    whole = np.rint(corner * 100.0).astype(np.int64)
    for index in range(len(STEPS_M) + 1):
        chosen = whole[step == index].tolist()
        data = "".join(f"M{x} {-y}h{side}v{-side}h{-side}z" for x, y in chosen)
        if data:
            layers.append(element("path", d=data, class_=f"cell e{index}"))
    cm = [round(value * 100) for value in (bounds[0], -bounds[3])]
    size = [round((bounds[2] - bounds[0]) * 100), round((bounds[3] - bounds[1]) * 100)]
    svg = element(
        "svg",
        element("title", "Map: largest distance between SUMO and CARLA by place"),
        *layers,
        scale_bar(bounds),
        viewBox=" ".join(map(str, cm + size)),
        class_="run-map",
        role="img",
    )
    names = [f"up to {_length(STEPS_M[0])}"]
    names += [f"up to {_length(limit)}" for limit in STEPS_M[1:]] + [f"over {_length(STEPS_M[-1])}"]
    legend = element(
        "div", *(swatch(f"e{i}", name) for i, name in enumerate(names)), class_="legend"
    )
    explained = (
        f"each square is {number(CELL)} m wide and has the colour of the largest position error "
        "there."
    )
    figure = element("div", svg, legend, class_="map-figure")
    return report_section("Position error by place", figure, explained=explained, ident="map")


def _time(states: pl.DataFrame) -> Markup | None:
    last = states["time"].max()
    if not isinstance(last, float) or states["position"].null_count() == states.height:
        return None
    explained = "a rise that never falls again means that one world has slipped against the other."
    if states["position"].max() < NOTHING:  # type: ignore[operator]
        words = element("p", "The position error was below 0.1 mm at all times.", class_="good")
        return report_section("Position error over time", words, explained=explained, ident="time")
    time, median, most = error_curve(states, width=bin_width(max(last, 1.0)))
    lines = [
        Series("largest", "c-bus", most * 100.0),
        Series("median", "c-all", median * 100.0),
    ]
    chart = line_chart(
        time, lines, y_label="distance, cm", description="Distance between the worlds over time"
    )
    return report_section("Position error over time", chart, explained=explained, ident="time")


def _departures(departures: Mapping[str, Any]) -> Markup:
    rows = []
    for name, key, unit in (
        ("SUMO after the plan", "sumo_after_plan_s", "s"),
        ("SUMO's start off the planned place", "sumo_off_plan_m", "m"),
        ("CARLA after SUMO", "carla_after_sumo_s", "s"),
    ):
        values = departures[key] or {}
        cells = [
            element("td", f"{number(values[p], 3)} {unit}" if p in values else "-")
            for p in ("p50", "p95", "p99", "max")
        ]
        rows.append(element("tr", element("th", name, scope="row"), *cells))
    counts = (
        f"{departures['planned']:,} planned, {departures['in_sumo']:,} inserted in SUMO, "
        f"{departures['in_carla']:,} were seen in CARLA."
    )
    explained = (
        "a departure in SUMO is late when there was no room; one in CARLA when the server refused "
        "it at first."
    )
    table = html_table(("Difference", *_HEADS), rows)
    return report_section(
        "Departures: planned, SUMO, CARLA",
        element("p", counts),
        table,
        explained=explained,
        ident="starts",
    )


def _lights(lights: Mapping[str, Any]) -> Markup | None:
    if not lights["signals"]:
        return None
    share = number(100.0 * lights["share_same"], 3)
    words = f"{lights['signals']:,} lights showed the same in {share} % of all steps."
    rows = [
        element(
            "tr",
            element("th", row["signal"], scope="row"),
            element("td", f"{row['steps']:,}"),
            element("td", f"{number(row['since'], 2)} s"),
        )
        for row in lights["worst"]
    ]
    table = html_table(("Signal", "Steps that differ", "Since"), rows) if rows else None
    explained = "signals are named as in the OpenDRIVE map."
    return report_section(
        "Traffic lights",
        element("p", words, class_="bad" if rows else "good"),
        table,
        explained=explained,
        ident="lights",
    )


def _worst(worst: Sequence[Mapping[str, Any]]) -> Markup | None:
    worth = [row for row in worst if row["position"] >= NOTHING]
    if not worth:
        return None
    rows = [
        element(
            "tr",
            element("th", row["actor"], scope="row"),
            element("td", row["category"]),
            element("td", f"{number(row['time'], 2)} s"),
            element("td", _length(row["position"]), class_=_verdict(row["position"], GOAL_M)),
            element("td", f"{number(row['heading'], 3)}°"),
            element("td", f"{number(row['x'], 1)}, {number(row['y'], 1)}"),
        )
        for row in worth
    ]
    heads = ("Road user", "Category", "At", "Position", "Heading", "Place (x, y)")
    explained = "each road user is listed once, at its largest error."
    return report_section(
        "Largest errors", html_table(heads, rows), explained=explained, ident="worst"
    )


def _absent(absent: Sequence[Mapping[str, Any]]) -> Markup | None:
    if not absent:
        return None
    rows = [
        element(
            "tr",
            element("th", row["actor"], scope="row"),
            element("td", f"{row['steps']:,}"),
            element("td", f"{number(row['since'], 2)} s"),
        )
        for row in absent[:ABSENT]
    ]
    more = f"{len(absent) - ABSENT:,} more are in parity.json." if len(absent) > ABSENT else None
    explained = "they were beyond the radius or the number asked for, or the server refused them."
    table = html_table(("Not shown in CARLA", "Steps", "Since"), rows)
    note = element("p", more) if more else None
    return report_section("Not shown", table, note, explained=explained, ident="absent")
