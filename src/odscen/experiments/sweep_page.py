"""A sweep as one HTML page: the boundary between safe and not, all cases at a glance, each one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from odscen.base.markup import Markup, element, join, number
from odscen.experiments.table import column_units
from odscen.reports.charts import Axis, ChartFrame, chart, legend, nice_ticks, text_at
from odscen.reports.page_templates import html_page, html_table, page_head, report_section

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.arrays import BoolArray, FloatArray


def safe_boundary(points: FloatArray, safe: BoolArray) -> FloatArray:
    """Find the boundary between safe cases and others in the plane of two parameters.

    Neighbours are those of a Delaunay triangulation with both parameters stretched to the same
    length; each stretch of the boundary joins the middles of two edges between a safe case and
    another.

    Parameters
    ----------
    points
        Shape ``(N, 2)``: values of the parameters; rows that are equal count once, as not safe if
        one of them is not.
    safe
        Shape ``(N,)``.

    Returns
    -------
    Shape ``(S, 2, 2)``: ends of the stretches, in the units of the parameters.
    """
    none = np.empty((0, 2, 2))
    points, where = np.unique(points, axis=0, return_inverse=True)
    merged = np.ones(len(points), dtype=bool)
    np.logical_and.at(merged, where.ravel(), safe)
    span = np.ptp(points, axis=0) if len(points) else np.zeros(2)
    if len(points) < 3 or merged.all() or not merged.any() or (span == 0).any():
        return none
    from scipy.spatial import Delaunay, QhullError

    try:
        triangles = Delaunay((points - points.min(axis=0)) / span).simplices
    except QhullError:  # all on one line
        return none
    stretches = []
    for triangle in triangles[np.lexsort(triangles.T[::-1])]:
        pairs = ((triangle[a], triangle[b]) for a, b in ((0, 1), (1, 2), (0, 2)))
        middles = [(points[a] + points[b]) / 2.0 for a, b in pairs if merged[a] != merged[b]]
        if len(middles) == 2:
            stretches.append(middles)
    return np.array(stretches) if stretches else none


SAFE, CALM, UNSAFE, OTHER = "c-safe", "c-calm", "c-unsafe", "c-other"
_WORDS: Final = {
    SAFE: "safe",
    CALM: "safe, no encounter",
    UNSAFE: "not safe",
    OTHER: "not run",
}
MOST_LINES: Final = 2_000
"""Cases that are drawn as lines; of more, evenly chosen ones."""
_DEFAULT_MEASURE: Final = "min_ttc"


@dataclass(frozen=True, slots=True)
class SweepShown:
    """What the page shows.

    Attributes
    ----------
    title
        Name of the scenario.
    units
        Of the parameters that are varied, by name, in order.
    limits
        What safe means, in words.
    rows
        One per case: ``case``, ``status``, ``safe``, ``detail``, the parameters and measures.
    links
        Files of each case, relative to the page: pairs of words and path.
    """

    title: str
    units: Mapping[str, str]
    limits: Sequence[str]
    rows: Sequence[Mapping[str, Any]]
    links: Mapping[str, Sequence[tuple[str, str]]]

    @property
    def names(self) -> list[str]:
        """Parameters."""
        return list(self.units)

    def column(self, name: str) -> FloatArray:
        """Values of a column; NaN where there is none."""
        values = (row.get(name) for row in self.rows)
        return np.array([np.nan if value is None else float(value) for value in values])

    @property
    def styles(self) -> list[str]:
        """Class of each case."""
        return [_style_of_case(row) for row in self.rows]


def sweep_page(sweep: SweepShown) -> str:
    """Write the page; the same sweep gives the same text."""
    safe = sum(row["safe"] is True for row in sweep.rows)
    run = sum(row["safe"] is not None for row in sweep.rows)
    head = page_head(
        "Sweep",
        sweep.title,
        element("p", f"{len(sweep.rows)} cases of {', '.join(sweep.names)}"),
        element("p", f"Safe: {'; '.join(sweep.limits)}.", class_="soft"),
        verdict=f"{safe} of {run} safe",
        style="good" if safe == run and run else "bad" if safe == 0 else "fair",
    )
    sections = [
        _draw_plane(sweep),
        _draw_influence(sweep),
        _draw_parallel_lines(sweep),
        _render_case_table(sweep),
    ]
    return html_page(f"{sweep.title} - sweep", join([head, *(s for s in sections if s)]))


def _style_of_case(row: Mapping[str, Any]) -> str:
    if row["safe"] is None:
        return OTHER
    if not row["safe"]:
        return UNSAFE
    return CALM if row.get("min_ttc") is None and row.get("min_pet") is None else SAFE


def _draw_keys(styles: Sequence[str]) -> Markup:
    return legend([(style, words) for style, words in _WORDS.items() if style in styles])


def _make_axis(values: FloatArray, name: str, unit: str) -> Axis:
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    room = 0.04 * (high - low) or max(abs(low) * 0.05, 0.5)
    ticks = [(v, number(v, 4)) for v in nice_ticks(low, high) if low - room <= v <= high + room]
    return Axis(low - room, high + room, ticks, f"{name}, {unit}" if unit else name)


def _draw_plane(sweep: SweepShown) -> Markup | None:
    """Two parameters as a plane; of one, it against the least time to collision."""
    names = sweep.names[:2]
    if len(names) == 1:
        if np.isnan(sweep.column(_DEFAULT_MEASURE)).all():
            return None
        names.append(_DEFAULT_MEASURE)
    units = {**column_units(), **sweep.units}
    x, y = (sweep.column(name) for name in names)
    across, up = (_make_axis(v, name, units[name]) for v, name in zip((x, y), names, strict=True))
    frame = ChartFrame(across, up, height=400.0)
    drawn: list[Markup] = []
    if len(sweep.names) == 2:
        drawn += [_draw_boundary(frame, sweep, x, y)]
    styles = sweep.styles
    for style in dict.fromkeys(styles):
        dots = [
            element(
                "circle",
                element("title", _describe_case(row, sweep)),
                cx=number(float(frame.x(a)), 1),
                cy=number(float(frame.y(b)), 1),
                r=4 if len(sweep.rows) <= 500 else 2.5,
            )
            for row, own, a, b in zip(sweep.rows, styles, x.tolist(), y.tolist(), strict=True)
            if own == style and np.isfinite([a, b]).all()
        ]
        drawn.append(element("g", *dots, class_=f"dots {style}"))
    about = f"Cases by {names[0]} and {names[1]}, coloured by whether they are safe."
    explained = "each dot is a case"
    explained += ", hollow where there was no encounter. " if CALM in styles else ". "
    if len(sweep.names) == 2:
        explained += (
            "The line is the boundary between safe and not, half-way between neighbouring cases."
        )
    elif len(sweep.names) > 2:
        explained += "Cases at one place differ in the other parameters."
    return report_section(
        "Safe and not" if len(sweep.names) != 1 else "Safe along the parameter",
        chart(frame, drawn, description=about, keys=_draw_keys(styles)),
        explained=explained,
        ident="boundary",
    )


def _draw_boundary(frame: ChartFrame, sweep: SweepShown, x: FloatArray, y: FloatArray) -> Markup:
    known = np.array([row["safe"] is not None for row in sweep.rows])
    safe = np.array([row["safe"] is True for row in sweep.rows])
    found = safe_boundary(np.column_stack([x, y])[known], safe[known])
    data = "".join(
        f"M{number(float(frame.x(a)), 1)},{number(float(frame.y(b)), 1)}"
        f"L{number(float(frame.x(c)), 1)},{number(float(frame.y(d)), 1)}"
        for (a, b), (c, d) in found.tolist()
    )
    return element("path", d=data or "M0,0", class_="safe-boundary")


def _draw_influence(sweep: SweepShown) -> Markup | None:
    """How each parameter goes with how close it was, as rank correlation."""
    from scipy.stats import spearmanr

    measure = sweep.column(_DEFAULT_MEASURE)
    known = np.isfinite(measure)
    if known.sum() < 8 or np.ptp(measure[known]) == 0:
        return None
    rows = []
    for name in sweep.names:
        values = sweep.column(name)[known]
        if np.ptp(values) == 0:
            continue
        found = spearmanr(values, measure[known])
        correlation = number(float(found.statistic), 2)
        rows.append(element("tr", element("td", name), element("td", correlation, class_="n")))
    if not rows:
        return None
    explained = (
        "Spearman's rank correlation of each parameter with the least time to collision: 1 if more "
        "of it is always safer, -1 if always more dangerous, near 0 if it says little by itself. "
        f"Of {int(known.sum())} cases that have one."
    )
    table = html_table(["parameter", "correlation"], rows, label="Influence of the parameters")
    return report_section("What matters", table, explained=explained, ident="influence")


def _draw_parallel_lines(sweep: SweepShown) -> Markup:
    """Parallel coordinates: an axis for each parameter and measure, a line for each case."""
    measures = [
        name for name in (_DEFAULT_MEASURE, "min_pet", "impact_speed", "max_drac")
        if np.isfinite(sweep.column(name)).any()
    ]  # fmt: skip
    names = [*sweep.names, *measures]
    units = {**column_units(), **sweep.units}
    width, top, bottom = 760.0, 46.0, 330.0
    at = np.linspace(70.0, width - 70.0, len(names)) if len(names) > 1 else np.array([width / 2])
    heights, axes = [], []
    drawn = [element("title", "All cases: one line each, one axis for each parameter and measure.")]
    for place, name in zip(at.tolist(), names, strict=True):
        values = sweep.column(name)
        axis = _make_axis(values, name, units.get(name, ""))
        heights.append(bottom - (values - axis.low) / (axis.high - axis.low) * (bottom - top))
        axes.append(_draw_upright_axis(axis, place, top, bottom))
    styles = sweep.styles
    chosen = np.unique(np.linspace(0, len(styles) - 1, min(len(styles), MOST_LINES)).astype(int))
    for style in (OTHER, CALM, SAFE, UNSAFE):
        lines = [
            _draw_case_line(
                at, [h[index] for h in heights], _describe_case(sweep.rows[index], sweep)
            )
            for index in chosen.tolist()
            if styles[index] == style
        ]
        drawn.append(element("g", *lines, class_=f"case-lines {style}"))
    svg = element("svg", *drawn, *axes, viewBox="0 0 760 350", role="img", class_="chart")
    explained = (
        "each line is a case; it meets each axis at its value. Where a case has no such measure, "
        "without an encounter or a collision, the line has a gap."
    )
    if len(chosen) < len(styles):
        explained += f" {len(chosen):,} of {len(styles):,} cases are drawn."
    box = element("div", svg, _draw_keys(styles), class_="chart-box", tabindex="0")
    return report_section("All cases", box, explained=explained, ident="cases")


def _draw_upright_axis(axis: Axis, x: float, top: float, bottom: float) -> Markup:
    parts = [
        element("path", d=f"M{number(x)} {number(top)}V{number(bottom)}", class_="grid"),
        text_at(x, top - 14, axis.name, class_="axis-name", text_anchor="middle"),
    ]
    for value, label in axis.ticks:
        y = bottom - (value - axis.low) / (axis.high - axis.low) * (bottom - top)
        parts.append(text_at(x - 5, y + 4, label, text_anchor="end", class_="over"))
    return join(parts)


def _draw_case_line(at: FloatArray, heights: Sequence[float], words: str) -> Markup:
    data, pen = "", "M"
    for x, y in zip(at.tolist(), heights, strict=True):
        if np.isfinite(y):
            data += f"{pen}{number(x, 1)},{number(float(y), 1)}"
            pen = "L"
        else:
            pen = "M"
    return element("path", element("title", words), d=data)


def _render_case_table(sweep: SweepShown) -> Markup:
    measures = [key for key in sweep.rows[0] if key not in {"case", "safe", "status", "detail"}]
    names = [*sweep.names, *(key for key in measures if _has_measure(sweep, key))]
    units = {**column_units(), **sweep.units}
    heads = ["case", "", "safe", *(f"{n}, {units[n]}" if units.get(n) else n for n in names)]
    rows = []
    for row in sweep.rows:
        links = [element("a", words, href=path) for words, path in sweep.links[row["case"]]]
        files = element("td", *(part for link in links for part in (link, " ")))
        cells = [element("td", row["case"]), files, element("td", _describe_verdict(row))]
        cells += [element("td", _format_value(row[name]), class_="n") for name in names]
        rows.append(element("tr", *cells))
    box = element("input", id="filter", type="search", placeholder="for example: not safe")
    field = element("label", "Filter ", box, class_="filter")
    table = html_table(heads, rows, label="Cases", id_="actors-table")
    explained = "a scenario file runs alone as it did in the sweep."
    return report_section("Each case", field, table, explained=explained, ident="table")


def _has_measure(sweep: SweepShown, measure: str) -> bool:
    """Whether a column is a measure that some case has."""
    return measure not in sweep.units and any(row[measure] is not None for row in sweep.rows)


def _describe_verdict(row: Mapping[str, Any]) -> str:
    if row["safe"] is None:
        return f"{row['status']}: {row['detail']}"
    return _WORDS[_style_of_case(row)]


def _format_value(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return number(float(value), 3) if isinstance(value, int | float) else str(value)


def _describe_case(row: Mapping[str, Any], sweep: SweepShown) -> str:
    values = ", ".join(f"{name} {_format_value(row[name])}" for name in sweep.names)
    return f"{row['case']}: {values}: {_describe_verdict(row)}"
