"""Tables of a signal program: splits of its stages, and its detectors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.markup import Markup, element, number
from odscen.records.light_programs import stage_spans
from odscen.reports.page_templates import html_table
from odscen.reports.signals.stage_diagrams import detector_label, detector_purpose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.records.light_programs import LightProgram, ShownPlan

SPLIT_HEADS = ("Stage", "Green, s", "Split, s", "Split, %", "Groups")
DETECTOR_HEADS = ("Detector", "Number", "Before the stop line, m", "Gap, s", "For")


def split_rows(light: LightProgram, plan: ShownPlan) -> list[tuple[str, ...]]:
    """Cells of :data:`SPLIT_HEADS` for each stage; its split is green and what follows it."""
    rows: list[tuple[str, ...]] = []
    for stage in stage_spans(plan):
        green = number(stage.seconds, 1)
        if stage.most > stage.least:
            green = f"{number(stage.least, 1)} to {number(stage.most, 1)}"
        groups = ", ".join(stage.groups(light))
        call = " (on call)" if stage.on_call else ""
        share = number(100.0 * stage.split / plan.cycle, 0)
        rows.append((f"{stage.id}{call}", green, number(stage.split, 1), share, groups))
    return rows


def detector_rows(light: LightProgram) -> list[tuple[str, ...]]:
    """Cells of :data:`DETECTOR_HEADS`; detectors with one name and purpose are one row."""
    loops: dict[tuple[str, ...], int] = {}
    for one in light.detectors:
        before, gap = number(one.ahead, 1), number(one.gap, 1)
        if one.bus:
            before, gap = f"0 to {number(one.length, 0)}", ""
        elif one.call:
            before, gap = "", ""
        row = (detector_label(light, one), before, gap, detector_purpose(one))
        loops[row] = loops.get(row, 0) + 1
    return [(name, str(count), *more) for (name, *more), count in loops.items()]


def split_table(light: LightProgram, plan: ShownPlan) -> Markup:
    """Splits of a plan."""
    label = f"Splits of junction {light.junctions[0]}, plan {plan.id}"
    return html_table(SPLIT_HEADS, _html(split_rows(light, plan), numbers=(1, 2, 3)), label=label)


def detector_table(light: LightProgram) -> Markup | None:
    """Detectors of a light; ``None`` if it has none."""
    if not light.detectors:
        return None
    label = f"Detectors of junction {light.junctions[0]}"
    return html_table(DETECTOR_HEADS, _html(detector_rows(light), numbers=(1, 2, 3)), label=label)


def _html(rows: Sequence[Sequence[str]], *, numbers: Sequence[int]) -> list[Markup]:
    return [
        element(
            "tr",
            element("th", row[0], scope="row"),
            *(
                element("td", cell, class_="n" if at in numbers else None)
                for at, cell in enumerate(row[1:], 1)
            ),
        )
        for row in rows
    ]
