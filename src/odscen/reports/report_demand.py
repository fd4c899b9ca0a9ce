"""Demand in the report: how routes by travel time converged, and counts against traffic."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.markup import Markup, element, number
from odscen.reports.charts import (
    Axis,
    ChartFrame,
    Dots,
    chart,
    dot_parts,
    legend,
    value_axis,
)
from odscen.reports.page_templates import html_table, report_section

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.records.assignment_steps import Assignment, AssignmentStep

_HEADS = (
    "Iteration", "Gap, %", "Mean travel time, s", "Routes changed", "Arrived", "Teleported",
    "Not inserted",
)  # fmt: skip


def assignment_section(assignment: Assignment) -> Markup | None:
    """Chart of the gap by iteration, and a row for each; ``None`` without any."""
    if not assignment.steps:
        return None
    reached = "reached" if assignment.gap <= assignment.wanted else "not reached"
    explained = (
        "the scenario was run once for each iteration, and after each some trips changed to the "
        "route that had been quickest. The gap is the share of all travel time that trips would "
        f"save on the quickest routes. The routes of iteration {assignment.used} are driven: a gap "
        f"of {100 * assignment.gap:.2f} %; {100 * assignment.wanted:g} % was wanted and is "
        f"{reached}. Where signals and queues differ from one iteration to the next, the gap does "
        "not come down to 0."
    )
    table = html_table(_HEADS, [_row(step) for step in assignment.steps], label="Iterations")
    return report_section(
        "Routes by travel time",
        convergence_chart(assignment),
        table,
        explained=explained,
        ident="assignment",
    )


def convergence_chart(assignment: Assignment) -> Markup:
    """Gap in per cent over the iterations; the one that is driven is marked."""
    steps = assignment.steps
    last = max(len(steps), 2)
    every = max(1, -(-last // 10))
    ticks = [(float(n), str(n)) for n in range(1, last + 1) if n == 1 or n % every == 0]
    gaps = np.array([100.0 * step.gap for step in steps])
    frame = ChartFrame(
        Axis(1.0, float(last), ticks, "iteration"),
        value_axis(max(float(gaps.max()), 100.0 * assignment.wanted), "gap, %"),
    )
    numbers = np.array([float(step.iteration) for step in steps])
    titles = [step.words for step in steps]
    dots = Dots("gap", "c-car", numbers, gaps, titles)
    parts = dot_parts(frame, [dots], joined=True)
    wanted = float(frame.y(100.0 * assignment.wanted))
    left, right = float(frame.x(1.0)), float(frame.x(float(last)))
    line = f"M{number(left)} {number(wanted)}H{number(right)}"
    parts.insert(0, element("path", element("title", "wanted"), d=line, class_="trail"))
    description = "Gap of the routes by iteration; the horizontal line is the gap wanted"
    return chart(frame, parts, description=description)


def _row(step: AssignmentStep) -> Markup:
    mean = "-" if step.travel_time is None else number(step.travel_time, digits=1)
    cells = (
        f"{100 * step.gap:.2f}", mean, f"{step.changed:,}", f"{step.arrived:,}",
        f"{step.teleported:,}", f"{step.waiting:,}",
    )  # fmt: skip
    head = element("th", str(step.iteration), scope="row")
    return element("tr", head, *(element("td", cell, class_="n") for cell in cells))


class ShownCount(NamedTuple):
    """A count and what traffic makes of it; times in seconds, ``why`` where GEH is above 5."""

    place: str
    begin: float
    end: float
    counted: float
    modelled: float
    geh: float
    why: str


GOOD_GEH = 5.0
MOST_ROWS = 200
"""Counts that are not met that the table names."""


def counts_section(
    counts: Sequence[ShownCount], *, heading: str, rmse: float, hours: tuple[int, int] = (0, 0)
) -> Markup:
    """Scatter plot of counts and traffic, and a row for each count that is not met.

    Parameters
    ----------
    rmse
        Root of the mean squared difference, vehicles.
    hours
        How many whole hours of a place are within GEH 5, and how many there are, if slices of
        counts make up hours.
    """
    missed = [one for one in counts if one.geh > GOOD_GEH]
    met = len(counts) - len(missed)
    share = met / len(counts) if counts else 0.0
    explained = (
        f"{met:,} of {len(counts):,} counts are within GEH 5 ({share:.1%}); the root of the mean "
        f"squared difference is {rmse:.1f} vehicles. On the line traffic is what was counted."
    )
    good, there = hours
    if there:
        explained += f" Of the whole hours, {good:,} of {there:,} are ({good / there:.1%})."
    heads = ("Place", "From, s", "To, s", "Counted", "Traffic", "GEH", "Why not")
    worst = sorted(missed, key=lambda one: (-one.geh, one.place, one.begin))[:MOST_ROWS]
    table = html_table(heads, [_count_row(one) for one in worst], label="Counts not met")
    ident = heading.lower().replace(" ", "-")
    return report_section(
        heading,
        scatter_chart(counts),
        table if worst else None,
        explained=explained,
        ident=ident,
    )


def scatter_chart(counts: Sequence[ShownCount]) -> Markup:
    """Traffic over counts, vehicles in each slice; both axes alike, with the line of equals."""
    top = max((max(one.counted, one.modelled) for one in counts), default=1.0)
    frame = ChartFrame(
        value_axis(top, "counted, vehicles"), value_axis(top, "traffic, vehicles"), height=420.0
    )
    groups = []
    for good, label, style in ((True, "GEH up to 5", "c-arrived"), (False, "above", "c-waiting")):
        mine = [one for one in counts if (one.geh <= GOOD_GEH) is good]
        x, y = (np.array([float(getattr(one, key)) for one in mine]) for key in _AXES)
        titles = [f"{one.place}: {one.counted:g} counted, {one.modelled:g}" for one in mine]
        groups.append(Dots(label, style, x, y, titles))
    high = frame.x_axis.high
    ends = [float(value) for value in (frame.x(0.0), frame.y(0.0), frame.x(high), frame.y(high))]
    a, b, c, d = (number(value) for value in ends)
    line = element("path", d=f"M{a} {b}L{c} {d}", class_="trail")
    keys = legend([(dots.style, dots.label) for dots in groups])
    description = "Traffic against counts; on the diagonal both are equal"
    return chart(frame, [line, *dot_parts(frame, groups)], description=description, keys=keys)


_AXES = ("counted", "modelled")


def _count_row(one: ShownCount) -> Markup:
    cells = (f"{one.begin:g}", f"{one.end:g}", f"{one.counted:g}", f"{one.modelled:g}")
    return element(
        "tr",
        element("th", one.place, scope="row"),
        *(element("td", cell, class_="n") for cell in (*cells, f"{one.geh:.1f}")),
        element("td", one.why, class_="wrap"),
    )
