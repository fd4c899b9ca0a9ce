"""A signal program on one sheet: an SVG file that needs nothing else."""

from __future__ import annotations

from importlib.resources import files
from typing import TYPE_CHECKING

from odscen.base.markup import Markup, element, number
from odscen.records.light_programs import stage_spans
from odscen.reports.signal_charts import plan_chart, plan_height
from odscen.reports.signal_pictures import (
    SIDE,
    SITE,
    JunctionPictures,
    detector_label,
    detector_purpose,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from odscen.drawing.map_drawing import MapDrawing
    from odscen.records.light_programs import LightProgram, ShownPlan
    from odscen.reports.signal_pictures import (
        StagePicture,
    )


CONTROL_WORDS = {
    "fixed": "fixed-time",
    "extended": "fixed-time, extended",
    "actuated": "actuated",
}
"""What controls of lights are called."""

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
    for detector in light.detectors:
        before, gap = number(detector.ahead, 1), number(detector.gap, 1)
        if detector.bus:
            before, gap = f"0 to {number(detector.length, 0)}", ""
        elif detector.call:
            before, gap = "", ""
        row = (detector_label(light, detector), before, gap, detector_purpose(detector))
        loops[row] = loops.get(row, 0) + 1
    return [(name, str(count), *more) for (name, *more), count in loops.items()]


WIDTH = 1120.0
"""Pixels of a sheet."""

_EDGE, _GAP, _LINE = 32.0, 14.0, 20.0
_COLORS = """\
:root { --paper: #ffffff; --ink: #1f252b; --soft: #5b6670; --line: #d9dcdd; --land: #f1efe8; }
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #16191d; --ink: #e8eaec; --soft: #a5afb8; --line: #3a4149; --land: #1b1f24;
    --paved: #343b43; --walked: #2a2d2e; --paint: #aeb5bc; --closed: #6d7680; --go: #4cc27d;
    --go-soft: #2f6d49; --amber: #e8b93a; --stop: #8a4a45; --detector: #7fb2ea; --span: #3a424b;
    --bus-area: #f5a344;
  }
}
.sheet { font-family: system-ui, 'Segoe UI', 'Helvetica Neue', Arial, sans-serif; }
.sheet > text { fill: var(--ink); font-size: 14px; }
.sheet > text.title { font-size: 22px; font-weight: 650; }
.sheet > text.heading { font-size: 16px; font-weight: 650; }
.sheet > text.soft, .sheet > text.soft tspan { fill: var(--soft); font-size: 13px; }
.sheet .frame { fill: var(--land); }
.sheet .rule { stroke: var(--line); }
"""


def signal_sheet(light: LightProgram, *, drawing: MapDrawing | None = None, title: str = "") -> str:
    """SVG document with the junction, its detectors, and stages, time bar and splits of each plan.

    Parameters
    ----------
    light
        What it is told to show.
    drawing
        Of the map, for the shape of the junction.
    title
        Of what it is, such as the name of the scenario.
    """
    return f"{_Sheet(light, drawing, title).document()}\n"


def signal_style() -> str:
    """Style of the shapes, without colours of the document that they are in."""
    return (files("odscen.reports") / "assets" / "signals.css").read_text(encoding="utf-8")


class _Sheet:
    """Parts that are laid one below the other; ``_y`` is where the next one begins."""

    def __init__(self, light: LightProgram, drawing: MapDrawing | None, title: str) -> None:
        self._light = light
        self._pictures = JunctionPictures(light, drawing)
        self._title = title
        self._parts: list[Markup] = []
        self._y = _EDGE

    def document(self) -> Markup:
        light = self._light
        name = f"Traffic light of junction {', '.join(light.junctions)}"
        control = CONTROL_WORDS[light.control]
        whose = "program of the scenario" if light.own else "program of the map"
        self._draw_text(name, style="title", height=30.0)
        subtitle = " · ".join(part for part in (self._title, control, whose) if part)
        self._draw_text(subtitle, style="soft", height=26.0)
        self._draw_junction()
        for plan in light.plans:
            self._draw_plan(plan)
        self._draw_legend()
        height = self._y + _EDGE
        return element(
            "svg",
            element("title", name),
            element("style", Markup(_COLORS + signal_style())),
            element("rect", width=WIDTH, height=height, style="fill: var(--paper)"),
            self._pictures.ground(),
            *self._parts,
            xmlns="http://www.w3.org/2000/svg",
            viewBox=f"0 0 {number(WIDTH)} {number(height)}",
            width=WIDTH,
            height=height,
            class_="sheet",
        )

    def _draw_text(
        self, words: str, *, x: float = _EDGE, style: str | None = None, height: float = _LINE
    ) -> None:
        self._parts.append(element("text", words, x=x, y=self._y + 0.75 * height, class_=style))
        self._y += height

    def _draw_framed(self, picture: Markup, x: float, y: float, side: float) -> None:
        self._parts.append(element("rect", x=x, y=y, width=side, height=side, rx=6, class_="frame"))
        self._parts.append(element("svg", picture, x=x, y=y, width=side, height=side))

    def _draw_junction(self) -> None:
        """Picture of the junction, and beside it plans, groups and detectors."""
        light, begin = self._light, self._y
        site = self._pictures.site()
        x = _EDGE
        if site is not None:
            self._draw_framed(site, _EDGE, begin, SITE)
            x += SITE + 2.0 * _GAP
        self._draw_table(
            "Signal groups",
            ("Group", "Movements"),
            [(group.id, ", ".join(group.movements)) for group in light.groups],
            x=x,
            columns=(0.0, 80.0),
        )
        if light.detectors:
            columns = (0.0, 100.0, 170.0, 350.0, 420.0)
            self._draw_table(
                "Detectors", DETECTOR_HEADS, detector_rows(light), x=x, columns=columns
            )
        self._y = max(self._y, begin + (SITE if site is not None else 0.0)) + _GAP

    def _draw_table(
        self,
        heading: str,
        heads: Sequence[str],
        rows: Sequence[Sequence[str]],
        *,
        x: float,
        columns: Sequence[float],
    ) -> None:
        self._draw_text(heading, x=x, style="heading", height=24.0)
        for number_, row in enumerate((heads, *rows)):
            y = self._y + 0.75 * _LINE
            style = "soft" if number_ == 0 else None
            for at, cell in zip(columns, row, strict=True):
                self._parts.append(element("text", cell, x=x + at, y=y, class_=style))
            self._y += _LINE
        self._y += _GAP

    def _draw_plan(self, plan: ShownPlan) -> None:
        light = self._light
        self._parts.append(
            element("line", x1=_EDGE, x2=WIDTH - _EDGE, y1=self._y, y2=self._y, class_="rule")
        )
        self._y += _GAP
        words = f"cycle {number(plan.cycle)} s, offset {number(plan.offset)} s"
        head = f"Plan {plan.id}: {words}" if len(light.plans) > 1 else words.capitalize()
        self._draw_text(head, style="heading", height=26.0)
        self._draw_stages(self._pictures.stages(plan))
        width, height = WIDTH - 2.0 * _EDGE, plan_height(light)
        chart = plan_chart(light, plan, width=width)
        self._parts.append(element("svg", chart, x=_EDGE, y=self._y, width=width, height=height))
        self._y += height + _GAP
        columns = (0.0, 140.0, 260.0, 360.0, 460.0)
        self._draw_table("Splits", SPLIT_HEADS, split_rows(light, plan), x=_EDGE, columns=columns)

    def _draw_stages(self, stages: Sequence[StagePicture]) -> None:
        each = 168.0
        row = int((WIDTH - 2.0 * _EDGE) // each)
        for begin in range(0, len(stages), row):
            for column, stage in enumerate(stages[begin : begin + row]):
                x = _EDGE + column * each
                self._draw_framed(stage.picture, x, self._y, SIDE)
                for style, line, words in ((None, 16.0, stage.words), ("soft", 32.0, stage.detail)):
                    y = self._y + SIDE + line
                    self._parts.append(element("text", words, x=x, y=y, class_=style))
            self._y += SIDE + 44.0

    def _draw_legend(self) -> None:
        x = _EDGE
        for picture, words in legend_shapes([self._light]):
            room = 52.0 + 7.2 * len(words)
            if x + room > WIDTH - _EDGE:
                x, self._y = _EDGE, self._y + _LINE
            self._parts.append(
                element("svg", picture, x=x, y=self._y, width=24, height=14, class_="bars")
            )
            self._parts.append(element("text", words, x=x + 30.0, y=self._y + 12.0, class_="soft"))
            x += room
        self._y += 20.0


def legend_shapes(lights: Iterable[LightProgram]) -> Iterator[tuple[Markup, str]]:
    """Shapes of the pictures of lights in 24 by 14 pixels, with what they mean."""

    def line(style: str) -> Markup:
        return element("path", d="M1 7 L23 7", class_=f"movement {style}")

    yield line("green"), "green"
    yield line("permissive"), "green that gives way"
    yield line("green walk"), "crossing with green"
    yield line("red"), "red"
    yellow = element("polygon", points="2,1 22,6 22,8 2,13", class_="bar yellow")
    yield yellow, "yellow"
    for kind, words in (("all-red", "all red"), ("between", "between stages")):
        yield element("rect", x=2, y=2, width=20, height=10, class_=f"span {kind}"), words
    yield element("rect", x=6, y=3, width=12, height=8, class_="loop"), "detector"
    yield element("circle", cx=12, cy=7, r=5, class_="loop call"), "waiting place with a call"
    if any(detector.bus for light in lights for detector in light.detectors):
        band = element("rect", x=1, y=3, width=22, height=8, class_="bus-area")
        yield band, "area in which buses are seen"


def legend_picture(shape: Markup) -> Markup:
    """One of :func:`legend_shapes` as a picture beside its words."""
    return element("svg", shape, width=24, height=14, class_="bars", aria_hidden="true")
