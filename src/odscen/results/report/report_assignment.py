"""Routes by travel time in the report: how the iterations converged."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.markup import Markup, element, number
from odscen.results.report.page_templates import html_table, report_section
from odscen.results.report.plots import Axis, ChartFrame, Dots, chart, dot_parts, value_axis

if TYPE_CHECKING:
    from odscen.results.records.assignment_steps import Assignment, AssignmentStep

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
