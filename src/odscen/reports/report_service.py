"""Level of service: the report's map from A to F, and its tables of the worst places."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.markup import Markup, element, join, number, path_data
from odscen.figures.by_place.level_of_service import FEWEST
from odscen.figures.by_place.traffic import over_run
from odscen.reports.charts import legend
from odscen.reports.page_templates import html_table, report_section
from odscen.reports.report_maps import fitted_view, scale_bar, view_box
from odscen.reports.report_words import stretch

if TYPE_CHECKING:
    from collections.abc import Mapping

    import polars as pl

    from odscen.figures.by_place.traffic import TrafficFigures
    from odscen.reports.report_maps import PlaceShapes

LEVELS = {
    "A": "A: free flow",
    "B": "B: reasonably free",
    "C": "C: stable",
    "D": "D: nearly unstable",
    "E": "E: at capacity",
    "F": "F: congested",
}
"""Levels of service with the words of the legends."""

SHOWN = 12
"""Rows of each table at most, the worst first."""

FEW = 20
"""Vehicles that a place has to have had to be among the worst: one unlucky driver is no jam."""


def service_map(figures: TrafficFigures, shapes: PlaceShapes) -> Markup | None:
    """Map of the levels over the run and in its busiest interval; ``None`` if no vehicle drove."""
    return _service_map(figures, shapes, worst_places(over_run(figures.junctions)))


def service_section(figures: TrafficFigures) -> Markup | None:
    """Tables of the worst places; ``None`` if there are none."""
    worst = worst_places(over_run(figures.junctions))
    turns = worst_places(over_run(figures.movements))
    parts: list[Markup] = []
    for title, place, shown, table in (
        ("Junctions with the highest delay", "junction", worst, figures.junctions),
        ("Turning movements with the highest delay", "movement", turns, figures.movements),
    ):
        if shown:
            parts += [element("h3", title), _place_table(place, shown, table)]
    if not parts:
        return None
    explained = (
        "levels from A (free flow) to F (demand exceeds capacity), with the limits of the Highway "
        "Capacity Manual, 7th edition, for each kind of facility: junctions and turning movements "
        "by control delay per vehicle, at a two-way stop of the minor movements only; streets by "
        "travel speed as a share of free-flow speed, freeways and multilane highways by passenger "
        f"cars per km and lane. Fewer than {FEWEST} vehicles have no level. The strip shows the "
        "level over the whole run, from left to right. A queue is the number of stopped vehicles. "
        f"Places are named as in the editor; those with fewer than {FEW} vehicles are not listed."
    )
    return report_section("Level of service", *parts, explained=explained, ident="service")


def worst_places(rows: pl.DataFrame) -> list[dict[str, Any]]:
    """Return the places with the longest delay first; those with traffic only."""
    import polars as pl

    shown = rows.with_columns(shown=pl.coalesce("control_delay", "delay"))
    number = pl.coalesce("passages", "vehicles")
    busy = shown.filter((number >= FEW) & pl.col("shown").is_not_null())
    place = "movement" if "movement" in rows.columns else "junction"
    return busy.sort(["shown", place], descending=[True, False]).head(SHOWN).to_dicts()


def _place_table(place: str, shown: list[dict[str, Any]], table: pl.DataFrame) -> Markup:
    import polars as pl

    heads = ["Junction" if place == "junction" else "Turning movement: from, through, to"]
    if place == "junction":
        heads.append("Control")
    heads += ["Level", "Control delay, s", "Mean queue", "Longest queue", "Vehicles"]
    heads += ["Over time", "Worst from"]
    if place == "movement":
        heads.remove("Longest queue")
    rows = []
    for row in shown:
        times = table.filter(pl.col(place) == row[place]).sort("begin")
        cells = [element("th", str(row[place]).replace(">", " > "), scope="row")]
        if place == "junction":
            cells.append(element("td", row["facility"] or row["control"]))
        cells += [element("td", graded(row)), _cell(row["shown"], 1)]
        cells.append(_cell(row["standing"], 1))
        if place == "junction":
            cells.append(_cell(row["queue_max"], 0))
        cells.append(element("td", f"{row['vehicles']:,}", class_="n"))
        cells += [element("td", level_strip(times)), element("td", _worst_time(times))]
        rows.append(element("tr", *cells))
    label = "Worst junctions" if place == "junction" else "Worst turning movements"
    return html_table(heads, rows, label=label, class_="places")


def _cell(value: float | None, digits: int) -> Markup:
    return element("td", "-" if value is None else number(value, digits), class_="n")


def _worst_time(times: pl.DataFrame) -> str:

    control = times["passages"].count() > 0
    known = times.with_columns(shown="control_delay" if control else "delay").drop_nulls("shown")
    if known.is_empty():
        return "-"
    row = known.sort(["shown", "begin"], descending=[True, False]).row(0, named=True)
    return f"{stretch(row['begin'], row['end']).split(' to ')[0]}, {number(row['shown'], 0)} s"


def graded(row: Mapping[str, Any]) -> Markup:
    """The letter on its colour; of a place with too few vehicles how many they were."""
    if row["level"] is not None:
        return level_badge(row["level"])
    number = row["vehicles"] if row.get("passages") is None else row["passages"]
    return Markup("-") if number >= FEWEST else element("span", f"n/a ({number:,} vehicles)")


def level_badge(level: str | None) -> Markup:
    """The letter on its colour."""
    if level is None:
        return Markup("-")
    return element("span", element("b", level), class_=f"badge los-{level.lower()}")


def level_strip(times: pl.DataFrame) -> Markup:
    """Band of the levels of one place over time, the first interval at the left."""
    rows = times.select("begin", "end", "level").rows()
    begin, end = rows[0][0], rows[-1][1]
    shapes: dict[str, list[str]] = {}
    for start, stop, level in rows:
        if level is not None:
            x, width = ((value / (end - begin)) * 960 for value in (start - begin, stop - start))
            shapes.setdefault(level, []).append(f"M{x:.0f} 0h{width:.0f}v10h-{width:.0f}z")
    parts = [
        element("path", d="".join(data), class_=f"los-{level.lower()}")
        for level, data in sorted(shapes.items())
    ]
    words = f"level over time, between {min(shapes)} and {max(shapes)}" if shapes else "no traffic"
    return element(
        "svg", element("title", words), *parts, viewBox="0 0 960 10", role="img", class_="strip",
        preserveAspectRatio="none",
    )  # fmt: skip


def _service_map(
    figures: TrafficFigures, shapes: PlaceShapes, worst: list[dict[str, Any]]
) -> Markup | None:
    bounds = fitted_view(shapes.points, None)
    if bounds is None:
        return None
    extent = max(bounds[2] - bounds[0], bounds[3] - bounds[1])
    busiest = _busiest(figures.network)
    views = {"run": ("The whole run", over_run(figures.segments), over_run(figures.junctions))}
    if busiest is not None and figures.network.height > 1:
        begin, end = busiest
        words = f"The busiest time, {stretch(begin, end)}"
        tables = (figures.segments, figures.junctions)
        segments, junctions = (table.filter(table["begin"] == begin) for table in tables)
        views["peak"] = (words, segments, junctions)
    roads = [
        element("path", id=f"place-{index}", d=path_data(lines.xy * (1, -1), lines.start))
        for index, lines in enumerate(shapes.segments.values())
    ]
    layers = [
        element("g", _layer(shapes, segments, junctions, extent), class_=f"for-{key}")
        for key, (_, segments, junctions) in views.items()
    ]
    svg = element(
        "svg",
        element("title", "Map of the roads and junctions, coloured by level of service"),
        element("defs", *roads),
        *layers,
        _names(shapes, worst, extent),
        scale_bar(bounds),
        viewBox=view_box(bounds),
        class_="run-map",
        role="img",
    )
    return element(
        "div", *view_switch("service", {key: view[0] for key, view in views.items()}), svg,
        level_legend(), class_="map-figure",
    )  # fmt: skip


def view_switch(group: str, views: Mapping[str, str]) -> list[Markup]:
    """Radio buttons before a drawing, the first chosen; the style sheet shows what is checked.

    Parameters
    ----------
    views
        Words by key: ``KEY`` shows what has the class ``for-KEY``.
    """
    if len(views) < 2:
        return []
    parts = []
    for place, (key, words) in enumerate(views.items()):
        name = f"show-{key}"
        checked = None if place else "checked"
        parts.append(element("input", type="radio", name=f"{group}-view", id=name, class_=name,
                             checked=checked))  # fmt: skip
        parts.append(element("label", words, for_=name))
    return parts


def level_legend() -> Markup:
    """Colours of the levels, and of places without traffic."""
    entries = [(f"los-{level.lower()}", words) for level, words in LEVELS.items()]
    return legend([*entries, ("los-none", f"no traffic, or fewer than {FEWEST} vehicles")])


def _busiest(network: pl.DataFrame) -> tuple[float, float] | None:
    """Interval with most vehicles on the road."""
    if network.is_empty():
        return None
    row = network.sort(["running", "begin"], descending=[True, False]).row(0, named=True)
    return row["begin"], row["end"]


def _layer(
    shapes: PlaceShapes, segments: pl.DataFrame, junctions: pl.DataFrame, extent: float
) -> Markup:
    found = {row["segment"]: row for row in segments.iter_rows(named=True)}
    parts = []
    for index, name in enumerate(shapes.segments):
        row = found.get(name)
        level = None if row is None else row["level"]
        words = f"{name}: no traffic"
        if row is not None and row["speed"] is not None:
            said = f"level {level}" if level else f"n/a ({row['vehicles']:,} vehicles)"
            words = f"{name}: {said}, {number(row['speed'] * 3.6, 0)} km/h"
        parts.append(
            element("use", element("title", words), href=f"#place-{index}", class_=_style(level))
        )
    width = round(100 * max(3.0, extent / 350.0))
    roads = element("g", *parts, class_="los-roads", stroke_width=width)
    busy = {row["junction"]: row for row in junctions.iter_rows(named=True) if row["level"]}
    radius = round(100 * min(extent / 90.0, 12.0))
    discs = []
    for name, (x, y) in shapes.junctions.items():
        row = busy.get(name)
        if row is None:
            continue
        lost = "no vehicle enters it"
        delay = row["delay"] if row["control_delay"] is None else row["control_delay"]
        if delay is not None:
            lost = f"{number(delay, 0)} s control delay per vehicle"
        words = f"{name}: level {row['level']}, {lost}"
        cx, cy = round(x * 100), round(-y * 100)
        disc = element("circle", cx=cx, cy=cy, r=radius, class_=_style(row["level"]))
        letter = element("text", row["level"], x=cx, y=cy, font_size=round(radius * 1.4),
                         class_=f"on-{row['level'].lower()}")  # fmt: skip
        discs.append(element("g", element("title", words), disc, letter))
    return join([roads, element("g", *discs, class_="los-discs", stroke_width=round(width / 5))])


def _style(level: str | None) -> str:
    return f"los-{level.lower()}" if level else "los-none"


def _names(shapes: PlaceShapes, worst: list[dict[str, Any]], extent: float) -> Markup:
    """Names of the junctions that the table lists, where there is room."""
    size = extent * 1.7
    written: list[tuple[float, float]] = []
    parts = []
    for row in worst:
        name = str(row["junction"])
        middle = shapes.junctions.get(name)
        if middle is None:
            continue
        x, y = (middle * (100.0, -100.0)).tolist()
        y -= size * 0.9
        if any(abs(x - a) < size * 4 and abs(y - b) < size * 1.2 for a, b in written):
            continue
        written.append((x, y))
        parts.append(element("text", name, x=round(x), y=round(y), font_size=round(size)))
    return element("g", *parts, class_="place-names")
