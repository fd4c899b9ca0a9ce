"""A comparison as one HTML page, in the dress of the run report."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.markup import Markup, element, join, number
from odscen.experiments.place_map import place_map
from odscen.figures.measures.comparison import Finding
from odscen.reports.charts import Dots, dot_chart, legend
from odscen.reports.page_templates import html_page, html_table, page_head, report_section
from odscen.reports.report_sections import DENSITY, FLOW, column
from odscen.reports.report_words import stretch

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.experiments.comparisons import Row, RunComparison, RunSet
    from odscen.experiments.place_map import PlaceStyles
    from odscen.reports.report_maps import PlaceShapes

STEPS = (0.05, 0.15, 0.3)
"""Limits between the colours of the map, as shares of the value in A."""

REPORTED = 0.01
"""Share of the value in A from which a clear difference is in the summary."""

LEAST_VEHICLES = 10.0
"""Vehicles that have passed a place on both sides, on average, for it to have a colour."""

_ROW, _LABELS, _RIGHT, _WIDTH, _FOOT = 26.0, 310.0, 32.0, 760.0, 44.0


def comparison_page(result: RunComparison) -> str:
    """Page of a comparison: what is clear, all figures, places, and the flow diagram."""
    a, b = result.a, result.b
    title = a.scenario if a.scenario == b.scenario else f"{a.scenario} and {b.scenario}"
    figures = [row for row in result.rows if row.key.kind == "run"]
    head = page_head(
        "Comparison of runs",
        title,
        element("p", element("b", "A "), _describe_side(a.name, a.runs)),
        element("p", element("b", "B "), _describe_side(b.name, b.runs)),
        *(element("p", note, class_="soft") for note in result.notes),
    )
    parts = [
        head,
        _summary_section(figures),
        _chart_section(figures),
        _table_section(figures),
        _place_section(result),
        _diagram_section(a, b),
    ]
    return html_page(f"{title} - comparison", join([part for part in parts if part]))


def _describe_side(name: str, seeds: Iterable[int]) -> str:
    listed = sorted(seeds)
    return f"{name} (seed{'s' if len(listed) > 1 else ''} {', '.join(map(str, listed))})"


def _summary_section(figures: Sequence[Row]) -> Markup:
    clear = [row for row in figures if row.says is Finding.CLEAR]
    clear.sort(key=lambda row: -abs(row.difference.relative or np.inf))
    if not figures or all(row.says is Finding.SAME for row in figures):
        content = element("p", "A and B are the same in every figure.")
    elif not any(map(_is_large_enough, clear)):
        words = "Whatever is clear is too small to matter." if clear else "Each may be random."
        content = element("p", f"No difference to speak of. {words}")
    else:
        content = element(
            "ul",
            *(element("li", _describe_difference(row)) for row in filter(_is_large_enough, clear)),
        )
    explained = (
        "clear means statistically significant: the 95 % confidence interval of the difference "
        "leaves out zero. It takes at least two runs a side, better five or more."
    )
    return report_section("Summary", content, explained=explained, ident="short")


def _is_large_enough(row: Row) -> bool:
    """Whether a clear difference is large enough for the summary."""
    return abs(row.difference.relative or 1.0) >= REPORTED


def _describe_difference(row: Row) -> str:
    found, figure = row.difference, row.key.entry
    if found.a is None or found.b is None:
        return figure.label
    values = f"{figure.written(found.a)} in A, {figure.written(found.b)} in B"
    word = "more" if found.b > found.a else "less"
    share = f"{number(100.0 * abs(found.relative), 1)} % {word} in B: " if found.relative else ""
    return f"{figure.label}: {share}{values}{_describe_improvement(row)}."


def _describe_improvement(row: Row) -> str:
    improves = row.improves
    return "" if improves is None else f"; {'B' if improves else 'A'} is better"


def _chart_section(figures: Sequence[Row]) -> Markup | None:
    shown = [row for row in figures if row.difference.relative]
    if not shown:
        return None
    explained = (
        "each dot is the difference of one figure, as a share of its value in A; right of the line "
        "in the middle it is larger in B. The bar is its 95 % confidence interval: if it does not "
        "touch the line, the difference is clear (statistically significant). Bars that are cut "
        "at the edge reach further. Figures that are equal are left out."
    )
    return report_section(
        "Differences", _interval_chart(shown), explained=explained, ident="differences"
    )


def _interval_chart(rows: Sequence[Row]) -> Markup:
    shares = np.array([100.0 * (row.difference.relative or 0.0) for row in rows])
    reach = _axis_reach(float(np.abs(shares).max()))
    height = len(rows) * _ROW + _FOOT
    middle = (_LABELS + _WIDTH - _RIGHT) / 2.0
    scale = (_WIDTH - _RIGHT - _LABELS) / 2.0 / reach

    def x(share: float) -> float:
        return middle + scale * min(max(share, -reach), reach)

    parts = [element("title", "Differences of all figures in per cent, with their intervals")]
    bottom = height - _FOOT
    for share in np.linspace(-reach, reach, 5).tolist():
        line = f"M{number(x(share))} 4V{number(bottom)}"
        parts.append(element("path", d=line, class_="zero" if share == 0.0 else "grid"))
        words = f"{'+' if share > 0 else ''}{number(share, 1)} %"
        parts.append(element("text", words, x=x(share), y=bottom + 17, text_anchor="middle"))
    name = "difference of B from A, per cent of A"
    parts.append(element("text", name, x=_WIDTH - _RIGHT, y=height - 6, class_="axis-name",
                         text_anchor="end"))  # fmt: skip
    for index, (row, share) in enumerate(zip(rows, shares.tolist(), strict=True)):
        y = index * _ROW + _ROW / 2.0 + 4.0
        style = "difference clear" if row.says is Finding.CLEAR else "difference"
        marks = [element("text", row.key.entry.label, x=_LABELS - 12, y=y + 4,
                         text_anchor="end", class_="axis-name")]  # fmt: skip
        found = row.difference
        if found.low is not None and found.high is not None and found.a:
            low, high = (100.0 * value / abs(found.a) for value in (found.low, found.high))
            bar = f"M{number(x(low), 1)} {number(y)}H{number(x(high), 1)}"
            marks.append(element("path", d=bar, class_="interval"))
        marks.append(element("circle", cx=x(share), cy=y, r=5))
        parts.append(
            element("g", element("title", _describe_difference(row)), *marks, class_=style)
        )
    svg = element("svg", *parts, viewBox=f"0 0 {number(_WIDTH)} {number(height)}", role="img",
                  class_="chart tall")  # fmt: skip
    keys = legend([("c-clear", "clear"), ("c-unclear", "may be random, or too few runs")])
    return element("div", svg, keys, class_="chart-box", tabindex="0")


def _axis_reach(largest: float) -> float:
    """Round end of the axis, per cent; figures that grow manifold are cut."""
    return next((end for end in (1.0, 2.0, 5.0, 10.0, 20.0, 50.0) if largest <= end), 100.0)


_HEADS = ("Figure", "Unit", "A", "B", "B - A", "95 % confidence interval", "Verdict")


def _table_section(figures: Sequence[Row]) -> Markup:
    explained = (
        "A and B are means over the runs of each side. If the same comparison were made many "
        "times, 19 of 20 such intervals would hold the true difference; one that leaves out zero "
        "is clear, one that holds zero may be random."
    )
    rows = [_table_row(row) for row in figures]
    table = html_table(_HEADS, rows)
    return report_section("All figures", table, explained=explained, ident="figures")


def _table_row(row: Row) -> Markup:
    cells = row.cells
    clear = row.says is Finding.CLEAR
    says = row.says + (_describe_improvement(row) if clear else "")
    return element(
        "tr",
        element("th", row.key.label, scope="row"),
        element("td", cells[1]),
        *(element("td", text, class_="n") for text in cells[2:6]),
        element("td", says, class_="fair wrap" if clear else None),
    )


def _place_section(result: RunComparison) -> Markup | None:
    if not result.places:
        return None
    explained = (
        "on the map, red places are slower in B, or have a longer stopped delay, and blue ones "
        "are better; "
        f"places that fewer than {LEAST_VEHICLES:g} vehicles pass stay grey. The table has "
        "segments by mean speed and junctions by stopped delay; large changes where many vehicles "
        "pass come first."
    )
    rows = [_table_row(row) for row in result.places]
    drawn = None if result.a.shapes is None else _change_map(result, result.a.shapes)
    table = html_table(_HEADS, rows, label="Places")
    return report_section(
        "Largest changes by place", drawn, table, explained=explained, ident="places"
    )


def grade(worse: float) -> str:
    """Class of the colour of a change, a share of the value before; positive is worse."""
    step = int(np.searchsorted(STEPS, abs(worse)))
    return f"d{3 - step if worse > 0 else 3 + step}"


_GRADES = (
    "over 30 % worse in B", "15 to 30 % worse", "5 to 15 % worse", "about the same",
    "5 to 15 % better", "15 to 30 % better", "over 30 % better in B",
)  # fmt: skip


def _change_map(result: RunComparison, shapes: PlaceShapes) -> Markup | None:
    junctions = {row.key.place for row in result.places if row.key.kind == "junction"}
    svg = place_map(
        shapes,
        _grade_places(result),
        title="Map of the roads and junctions, coloured by how they have changed",
        names={name: name for name in junctions},
    )
    if svg is None:
        return None
    keys = [(f"d{index}", grade) for index, grade in enumerate(_GRADES)]
    return element("div", svg, legend([*keys, ("los-none", "too few vehicles")]),
                   class_="map-figure")  # fmt: skip


def _grade_places(result: RunComparison) -> PlaceStyles:
    """Colour and words of each place with traffic on both sides."""
    passed = {
        (str(row.key.kind), row.key.place): min(row.difference.a or 0.0, row.difference.b or 0.0)
        for row in result.rows
        if row.key.figure == "vehicles"
    }
    styles: PlaceStyles = {}
    for row in result.place_rows:
        key = (str(row.key.kind), row.key.place)
        difference = row.difference
        if passed.get(key, 0.0) < LEAST_VEHICLES or difference.difference is None:
            continue
        # A junction's wait may be next to nothing in A: seconds count there.
        base = max(abs(difference.a or 0.0), 1.0)
        worse = -1.0 if row.improves else 1.0
        share = worse * abs(difference.difference) / base
        values = (f"{row.key.entry.written(value or 0.0)} in {side}"
                  for value, side in ((difference.a, "A"), (difference.b, "B")))  # fmt: skip
        styles[key] = (grade(share), f"{row.key.entry.label} {', '.join(values)}")
    return styles


def _diagram_section(a: RunSet, b: RunSet) -> Markup | None:
    groups = [dots for runs, name in ((a, "A"), (b, "B")) if (dots := _runs_as_dots(runs, name))]
    if len(groups) < 2:
        return None
    drawn = dot_chart(
        groups,
        x_label=DENSITY,
        y_label=FLOW,
        description="Flow of the network over its density, in A and in B",
    )
    explained = (
        "each dot is one interval of one run: density and flow of the network. If the dots of one "
        "side lie higher at the same density, its network serves a higher flow; if they reach "
        "further to the right, it is more congested."
    )
    return report_section(
        "Macroscopic fundamental diagram", drawn, explained=explained, ident="diagram"
    )


def _runs_as_dots(runs: RunSet, name: str) -> Dots | None:
    import polars as pl

    tables = [table.filter(pl.col("density") > 0) for table in runs.networks]
    if sum(table.height for table in tables) < 2:
        return None
    busy = pl.concat(tables)
    titles = [f"{name}, {stretch(begin, end)}" for begin, end in busy.select("begin", "end").rows()]
    return Dots(f"runs of {name}", f"side-{name.lower()}", column(busy, "density"),
                column(busy, "flow"), titles)  # fmt: skip
