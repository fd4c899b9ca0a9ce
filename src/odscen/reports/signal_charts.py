"""Time bars of signal programs: what each group shows when, and the stages above."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.markup import Markup, element, number

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.records.light_programs import LightProgram, ShownPlan

WIDTH = 760.0
"""Pixels of a chart in a report."""

_ROW, _BAR, _AXIS, _RIGHT = 17.0, 11.0, 22.0, 10.0
_LETTER = 7.6
"""Pixels of a letter of a name, on average."""
_HEAD = 26.0
"""Pixels of the row of stages."""
_BAR_KINDS = {"G": "green", "g": "permissive", "y": "yellow"}
_HALF = {"green": _BAR / 2.0, "permissive": _BAR / 4.0, "yellow": _BAR / 2.0}
"""Half of the height of a bar, pixels."""
_BETWEEN = {"yellow": "yellow", "all-red": "all red", "between": "between stages"}
_TICKS = (5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0)
_MOST_TICKS = 14


class TimeBar(NamedTuple):
    """What a group shows from a second to another: ``green``, ``permissive`` or ``yellow``."""

    begin: float
    end: float
    shown: str


def program_bars(plan: ShownPlan, links: Sequence[int]) -> list[TimeBar]:
    """What the movements ``links`` show in one cycle of a plan, red left out."""
    rows, now = [], 0.0
    for phase in plan.phases:
        rows.append((now, phase.state))
        now += phase.seconds
    return shown_bars([*rows, (now, "")], links)


def shown_bars(rows: Sequence[tuple[float, str]], links: Sequence[int]) -> list[TimeBar]:
    """What movements show over time, red left out; the last row says only when that ends."""
    bars: list[TimeBar] = []
    for (begin, state), (end, _) in pairwise(rows):
        letters = {state[n] for n in links}
        kind = next((_BAR_KINDS[name] for name in "Ggy" if name in letters), "")
        if not kind:
            continue
        if bars and bars[-1].end == begin and bars[-1].shown == kind:
            bars[-1] = bars[-1]._replace(end=end)
        else:
            bars.append(TimeBar(begin, end, kind))
    return bars


class PhaseSpan(NamedTuple):
    """A stretch of the cycle: ``stage`` with its id, ``yellow``, ``all-red`` or ``between``."""

    begin: float
    end: float
    kind: str
    stage: str = ""


def phase_spans(plan: ShownPlan) -> list[PhaseSpan]:
    """Stages of a plan and what lies between them, in order; together they are the cycle.

    Yellow is what shows yellow to a group, all-red what shows green to none, and the rest between
    stages is for pedestrian clearance and groups that begin before the others.
    """
    spans: list[PhaseSpan] = []
    now = 0.0
    for phase in plan.phases:
        begin, now = now, now + phase.seconds
        kind = "between"
        if phase.stage:
            kind = "stage"
        elif "y" in phase.state:
            kind = "yellow"
        elif not set(phase.state) & {"G", "g"}:
            kind = "all-red"
        if spans and (spans[-1].kind, spans[-1].stage) == (kind, phase.stage):
            spans[-1] = spans[-1]._replace(end=now)
        else:
            spans.append(PhaseSpan(begin, now, kind, phase.stage))
    return spans


class BarScale(NamedTuple):
    """Seconds that a chart shows, and where: its width, its left margin, pixels of a second."""

    begin: float
    end: float
    left: float
    pixels: float
    width: float

    @classmethod
    def of(
        cls, names: Sequence[str], *, begin: float, end: float, width: float = WIDTH
    ) -> BarScale:
        """Scale of a chart with rows of these names."""
        longest = max(map(len, (*names, "Stage")))
        left = min(max(_LETTER * longest + 14.0, 40.0), 0.25 * width)
        return cls(begin, end, left, (width - left - _RIGHT) / max(end - begin, 1e-9), width)

    def x(self, second: float) -> float:
        """Pixels of a second, which may be before the begin or after the end."""
        return self.left + (min(max(second, self.begin), self.end) - self.begin) * self.pixels

    @property
    def shares(self) -> tuple[float, float]:
        """Where the bars begin and end, as shares of the width."""
        return self.left / self.width, (self.width - _RIGHT) / self.width


def plan_chart(light: LightProgram, plan: ShownPlan, *, width: float = WIDTH) -> Markup:
    """Signal timing plan: the stages of a cycle, and below what each group shows."""
    words = f"cycle {number(plan.cycle)} s, offset {number(plan.offset)} s"
    return bar_chart(
        [(group.id, program_bars(plan, group.links)) for group in light.groups],
        begin=0.0,
        end=plan.cycle,
        axis=f"seconds of the cycle; {words}",
        description=f"Signal timing plan of junction {light.junctions[0]}: {words}",
        spans=phase_spans(plan),
        width=width,
    )


def plan_height(light: LightProgram) -> float:
    """Pixels of :func:`plan_chart`."""
    return _HEAD + _ROW * len(light.groups) + 2.0 + _AXIS + 12.0


def plan_scale(light: LightProgram, plan: ShownPlan, *, width: float = WIDTH) -> BarScale:
    """Scale of :func:`plan_chart`."""
    names = [group.id for group in light.groups]
    return BarScale.of(names, begin=0.0, end=plan.cycle, width=width)


def bar_chart(
    rows: Sequence[tuple[str, Sequence[TimeBar]]],
    *,
    begin: float,
    end: float,
    axis: str,
    description: str,
    marks: Sequence[float] = (),
    spans: Sequence[PhaseSpan] = (),
    width: float = WIDTH,
) -> Markup:
    """Bars of green and yellow, one row for each group; a thin line where it is red.

    Green that gives way is lower than green, and yellow runs out to a point, so that no one has to
    tell colours apart.

    Parameters
    ----------
    rows
        Names and bars.
    begin, end
        Seconds that are shown.
    axis
        What the seconds are.
    marks
        Seconds at which a dashed line is drawn: a cycle begins.
    spans
        Stages of a cycle, drawn above the bars.
    width
        Pixels.
    """
    scale = BarScale.of([name for name, _ in rows], begin=begin, end=end, width=width)
    top = _HEAD if spans else 0.0
    bottom = top + _ROW * len(rows) + 2.0
    parts: list[Markup] = [element("title", description), *_draw_ticks(scale, top, bottom)]
    parts += _span_row(scale, spans)
    for row, (name, bars) in enumerate(rows):
        parts += _group_row(scale, name, bars, top + _ROW * row + _ROW / 2.0 + 1.0)
    for mark in marks:
        at = number(scale.x(mark), 1)
        parts.append(element("line", x1=at, x2=at, y1=0, y2=number(bottom), class_="mark"))
    height = bottom + _AXIS + 12.0
    place = {"x": number(width - _RIGHT), "y": number(height - 4.0)}
    parts.append(element("text", axis, **place, class_="name", text_anchor="end"))
    return element(
        "svg",
        *parts,
        viewBox=f"0 0 {number(width)} {number(height)}",
        role="img",
        class_="chart bars",
    )


def _draw_ticks(scale: BarScale, top: float, bottom: float) -> Iterator[Markup]:
    span = scale.end - scale.begin
    most = min(_MOST_TICKS, int((scale.width - scale.left) / 40.0))
    step = next((value for value in _TICKS if span / value <= most), 1200.0)
    tick = -(-scale.begin // step) * step
    while tick <= scale.end + 1e-9:
        at = number(scale.x(tick), 1)
        yield element("line", x1=at, x2=at, y1=number(top), y2=number(bottom), class_="grid")
        place = {"x": at, "y": number(bottom + 14.0)}
        yield element("text", number(tick), **place, text_anchor="middle")
        tick += step


def _span_row(scale: BarScale, spans: Sequence[PhaseSpan]) -> Iterator[Markup]:
    """Stages with their seconds where there is room, else with their ids."""
    if spans:
        yield _draw_name(scale, "Stage", 15.0)
    for span in spans:
        left, wide = scale.x(span.begin), scale.x(span.end) - scale.x(span.begin)
        seconds = f"{number(span.end - span.begin, 1)} s"
        what = f"stage {span.stage}" if span.stage else _BETWEEN[span.kind]
        style = "span" if span.stage else f"span {span.kind}"
        place = {"x": number(left, 1), "width": number(max(wide, 0.5), 1)}
        title = element("title", f"{what}: {seconds} from {number(span.begin, 1)} s")
        yield element("rect", title, **place, y=2, height=18, class_=style)
        words = next(
            (
                name
                for name in (f"{span.stage}: {seconds}", span.stage)
                if span.stage and _LETTER * len(name) < wide
            ),
            None,
        )
        if words:
            at = number(left + wide / 2.0, 1)
            yield element("text", words, x=at, y=15, text_anchor="middle", class_="in")


def _draw_name(scale: BarScale, name: str, y: float) -> Markup:
    room = int((scale.left - 12.0) / _LETTER)
    short = name if len(name) <= room + 1 else f"{name[:room]}…"
    title = element("title", name) if short != name else None
    place = {"x": number(scale.left - 8.0), "y": number(y)}
    return element("text", title, short, **place, text_anchor="end")


def _group_row(
    scale: BarScale, name: str, bars: Sequence[TimeBar], middle: float
) -> Iterator[Markup]:
    yield _draw_name(scale, name, middle + 4.0)
    ends = {"x1": number(scale.left), "x2": number(scale.x(scale.end), 1)}
    yield element("line", **ends, y1=number(middle), y2=number(middle), class_="red")
    for bar in bars:
        if bar.end <= scale.begin or bar.begin >= scale.end:
            continue
        left, right = scale.x(bar.begin), max(scale.x(bar.end), scale.x(bar.begin) + 0.5)
        words = f"{bar.shown} {number(bar.end - bar.begin, 1)} s from {number(bar.begin, 1)} s"
        title = element("title", f"{name}: {words}")
        half = _HALF[bar.shown]
        corners = [(left, -half), (right, -half), (right, half), (left, half)]
        if bar.shown == "yellow":
            corners = [(left, -half), (right, -1.0), (right, 1.0), (left, half)]
        points = " ".join(f"{number(x, 1)},{number(middle + y, 1)}" for x, y in corners)
        yield element("polygon", title, points=points, class_=f"bar {bar.shown}")
