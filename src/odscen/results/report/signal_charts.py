"""Signal programs as pictures: a diagram of stages, and bars of what each group shows when."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.markup import Markup, element, number

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.results.records.light_programs import LightProgram, ProgramPhase, ShownPlan

SIDE = 132.0
"""Pixels of the picture of a stage."""

_MARGIN = 12.0
_LABEL, _ROW, _BAR, _WIDTH, _AXIS = 92.0, 17.0, 11.0, 760.0, 22.0
_LETTERS = {"G": "green", "g": "permissive", "y": "yellow"}
_TICKS = (5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0)
_MOST_TICKS = 14


class TimeBar(NamedTuple):
    """What a group shows from a second to another: ``green``, ``permissive`` or ``yellow``."""

    begin: float
    end: float
    shown: str


def stage_diagram(light: LightProgram, plan: ShownPlan) -> Markup | None:
    """One small picture per stage: who has green, and who of them gives way.

    Returns
    -------
    ``None`` if the ways of the movements are not known.
    """
    points = [p for group in light.groups for path in group.paths for p in path]
    if not points:
        return None
    frame = _Frame.around(points)
    stages = [phase for phase in _stages(plan) if phase.stage]
    return element("div", *(_stage(light, phase, frame) for phase in stages), class_="stages")


def _stages(plan: ShownPlan) -> Iterator[ProgramPhase]:
    """Stages once each; their seconds together where one is in two phases."""
    last: ProgramPhase | None = None
    for phase in plan.phases:
        if not phase.stage:
            continue
        if last is not None and last.stage == phase.stage:
            free = last.seconds if phase.most > phase.least else 0.0
            last = phase._replace(
                seconds=last.seconds + phase.seconds,
                least=free + phase.least,
                most=free + phase.most,
            )
            continue
        if last is not None:
            yield last
        last = phase
    if last is not None:
        yield last


class _Frame(NamedTuple):
    """From metres to pixels of a stage's picture."""

    x0: float
    y1: float
    scale: float

    @classmethod
    def around(cls, points: Sequence[tuple[float, float]]) -> _Frame:
        xs, ys = [x for x, _ in points], [y for _, y in points]
        span = max(max(xs) - min(xs), max(ys) - min(ys), 1.0)
        scale = (SIDE - 2 * _MARGIN) / span
        x0 = (min(xs) + max(xs)) / 2.0 - SIDE / 2.0 / scale
        y1 = (min(ys) + max(ys)) / 2.0 + SIDE / 2.0 / scale
        return cls(x0, y1, scale)

    def path(self, points: Sequence[tuple[float, float]]) -> str:
        return "M" + " L".join(
            f"{number((x - self.x0) * self.scale, 1)} {number((self.y1 - y) * self.scale, 1)}"
            for x, y in points
        )


def _stage(light: LightProgram, phase: ProgramPhase, frame: _Frame) -> Markup:
    lines: list[Markup] = []
    heads: list[Markup] = []
    names = []
    for group in light.groups:
        shown = {phase.state[n] for n in group.links} & {"G", "g"}
        if shown:
            names.append(group.id)
        for link, path in zip(group.links, group.paths, strict=True):
            kind = _LETTERS.get(phase.state[link], "red")
            style = f"movement {kind}" + (" walk" if group.walk else "")
            line = element("path", d=frame.path(path), class_=style)
            if kind == "red":
                lines.insert(0, line)
            else:
                lines.append(line)
                if not group.walk and len(path) > 1:
                    heads.append(_head(path, frame, kind))
    words = f"stage {phase.stage}: {number(phase.seconds, 1)} s"
    if phase.most > phase.least:
        words = f"stage {phase.stage}: {number(phase.least, 1)} to {number(phase.most, 1)} s"
    picture = element(
        "svg",
        element("title", f"{words}; green: {', '.join(names)}"),
        *lines,
        *heads,
        viewBox=f"0 0 {number(SIDE)} {number(SIDE)}",
        width=SIDE,
        height=SIDE,
        role="img",
    )
    call = " on call" if phase.on_call else ""
    return element(
        "figure",
        picture,
        element("figcaption", element("b", words), element("span", f"{' '.join(names)}{call}")),
    )


def _head(path: Sequence[tuple[float, float]], frame: _Frame, kind: str) -> Markup:
    """Triangle at the end of a movement."""
    (x0, y0), (x1, y1) = path[-2:]
    length = max(((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5, 1e-9)
    ux, uy = (x1 - x0) / length, (y1 - y0) / length
    size = 7.0 / frame.scale
    tip = (x1 + ux * size * 0.6, y1 + uy * size * 0.6)
    left = (x1 - ux * size * 0.6 - uy * size * 0.5, y1 - uy * size * 0.6 + ux * size * 0.5)
    right = (x1 - ux * size * 0.6 + uy * size * 0.5, y1 - uy * size * 0.6 - ux * size * 0.5)
    return element("path", d=f"{frame.path([tip, left, right])} Z", class_=f"head {kind}")


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
        kind = next((_LETTERS[one] for one in "Ggy" if one in letters), "")
        if not kind:
            continue
        if bars and bars[-1].end == begin and bars[-1].shown == kind:
            bars[-1] = bars[-1]._replace(end=end)
        else:
            bars.append(TimeBar(begin, end, kind))
    return bars


def bar_chart(
    rows: Sequence[tuple[str, Sequence[TimeBar]]],
    *,
    begin: float,
    end: float,
    axis: str,
    description: str,
    marks: Sequence[float] = (),
) -> Markup:
    """Bars of green and yellow, one row for each group; a thin line where it is red.

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
    """
    scale = _Scale(begin, end, (_WIDTH - _LABEL - 10.0) / max(end - begin, 1e-9))
    bottom = _ROW * len(rows) + 2.0
    parts: list[Markup] = [element("title", description), *_ticks(scale, bottom)]
    for row, (name, bars) in enumerate(rows):
        parts += _group_row(scale, name, bars, _ROW * row + _ROW / 2.0 + 1.0)
    for mark in marks:
        at = number(scale.x(mark), 1)
        parts.append(element("line", x1=at, x2=at, y1=0, y2=number(bottom), class_="mark"))
    height = bottom + _AXIS + 12.0
    place = {"x": number(_WIDTH - 10.0), "y": number(height - 4.0)}
    parts.append(element("text", axis, **place, class_="name", text_anchor="end"))
    picture = element(
        "svg",
        *parts,
        viewBox=f"0 0 {number(_WIDTH)} {number(height)}",
        role="img",
        class_="chart bars",
    )
    return element("div", picture, class_="chart-box")


class _Scale(NamedTuple):
    """Seconds that are shown, and pixels of one of them."""

    begin: float
    end: float
    pixels: float

    def x(self, second: float) -> float:
        return _LABEL + (min(max(second, self.begin), self.end) - self.begin) * self.pixels


def _ticks(scale: _Scale, bottom: float) -> Iterator[Markup]:
    span = scale.end - scale.begin
    step = next((one for one in _TICKS if span / one <= _MOST_TICKS), 1200.0)
    tick = -(-scale.begin // step) * step
    while tick <= scale.end + 1e-9:
        at = number(scale.x(tick), 1)
        yield element("line", x1=at, x2=at, y1=0, y2=number(bottom), class_="grid")
        place = {"x": at, "y": number(bottom + 14.0)}
        yield element("text", number(tick), **place, text_anchor="middle")
        tick += step


def _group_row(
    scale: _Scale, name: str, bars: Sequence[TimeBar], middle: float
) -> Iterator[Markup]:
    place = {"x": number(_LABEL - 8.0), "y": number(middle + 4.0)}
    yield element("text", name, **place, text_anchor="end")
    ends = {"x1": number(_LABEL), "x2": number(scale.x(scale.end), 1)}
    yield element("line", **ends, y1=number(middle), y2=number(middle), class_="red")
    for bar in bars:
        if bar.end <= scale.begin or bar.begin >= scale.end:
            continue
        left, right = scale.x(bar.begin), scale.x(bar.end)
        words = f"{bar.shown} {number(bar.end - bar.begin, 1)} s from {number(bar.begin, 1)} s"
        yield element(
            "rect",
            element("title", f"{name}: {words}"),
            x=number(left, 1),
            y=number(middle - _BAR / 2.0),
            width=number(max(right - left, 0.5), 1),
            height=number(_BAR),
            class_=f"bar {bar.shown}",
        )
