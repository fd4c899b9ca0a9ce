"""Demand in the report: how routes by travel time converged, and counts against traffic."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

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
from odscen.reports.page_templates import render_block

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.records.assignment_steps import Assignment


def assignment_values(assignment: Assignment) -> dict[str, Any] | None:
    """Chart of the gap by iteration, and the iterations; ``None`` without any."""
    if not assignment.steps:
        return None
    values = {name: getattr(assignment, name) for name in ("steps", "gap", "wanted", "used")}
    return {"chart": convergence_chart(assignment), **values}


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
    missed = [count for count in counts if count.geh > GOOD_GEH]
    worst = sorted(missed, key=lambda count: (-count.geh, count.place, count.begin))[:MOST_ROWS]
    return render_block(
        "counts.html.j2",
        "counts",
        heading=heading,
        ident=heading.lower().replace(" ", "-"),
        chart=scatter_chart(counts),
        worst=worst,
        met=len(counts) - len(missed),
        count=len(counts),
        rmse=rmse,
        hours=hours,
    )


def scatter_chart(counts: Sequence[ShownCount]) -> Markup:
    """Traffic over counts, vehicles in each slice; both axes alike, with the line of equals."""
    top = max((max(count.counted, count.modelled) for count in counts), default=1.0)
    frame = ChartFrame(
        value_axis(top, "counted, vehicles"), value_axis(top, "traffic, vehicles"), height=420.0
    )
    groups = []
    for good, label, style in ((True, "GEH up to 5", "c-arrived"), (False, "above", "c-waiting")):
        mine = [count for count in counts if (count.geh <= GOOD_GEH) is good]
        x, y = (
            np.array([float(getattr(count, key)) for count in mine])
            for key in ("counted", "modelled")
        )
        titles = [f"{count.place}: {count.counted:g} counted, {count.modelled:g}" for count in mine]
        groups.append(Dots(label, style, x, y, titles))
    high = frame.x_axis.high
    ends = [float(value) for value in (frame.x(0.0), frame.y(0.0), frame.x(high), frame.y(high))]
    a, b, c, d = (number(value) for value in ends)
    line = element("path", d=f"M{a} {b}L{c} {d}", class_="trail")
    keys = legend([(dots.style, dots.label) for dots in groups])
    description = "Traffic against counts; on the diagonal both are equal"
    return chart(frame, [line, *dot_parts(frame, groups)], description=description, keys=keys)
