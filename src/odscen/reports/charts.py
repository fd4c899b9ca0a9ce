"""Charts as SVG text: small, sharp in print, and coloured by the page's style sheet.

Direct SVG and not matplotlib: no second of import time, a tenth of the size, and the same chart is
readable on a light and on a dark page, because colours are classes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.markup import Markup, element, join, number
from odscen.reports.report_words import has_clock, time_words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from odscen.base.arrays import FloatArray


_WIDTH, _HEIGHT = 760.0, 270.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 52.0, 20.0, 30.0, 40.0
_HOURS = (0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 12.0, 24.0)
_SIXTIETHS = (1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 60.0)


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """One line of a chart.

    Attributes
    ----------
    label
        Name in the legend.
    style
        Class that gives the colour, for example ``c-car``.
    y
        Shape ``(B,)``; NaN leaves a gap.
    low, high
        Shape ``(B,)``: band around the line, if any.
    """

    label: str
    style: str
    y: FloatArray
    low: FloatArray | None = None
    high: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class TimeUnit:
    """How times are written on an axis."""

    name: str
    seconds: float

    @classmethod
    def for_span(cls, seconds: float) -> TimeUnit:
        """Seconds, minutes or hours, whichever gives small numbers."""
        if seconds <= 300.0:
            return cls("s", 1.0)
        return cls("min", 60.0) if seconds <= 4 * 3600.0 else cls("h", 3600.0)


def nice_ticks(low: float, high: float, *, count: int = 5) -> list[float]:
    """Round numbers, 1, 2 or 5 times a power of ten apart, that enclose ``low`` and ``high``."""
    span = max(high - low, 1e-9)
    raw = span / count
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(power * factor for factor in (1.0, 2.0, 5.0, 10.0) if power * factor >= raw - 1e-12)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [index * step for index in range(first, last + 1)]


class Axis(NamedTuple):
    """Where an axis begins and ends, its ticks with their labels, and what it shows."""

    low: float
    high: float
    ticks: Sequence[tuple[float, str]]
    name: str


def value_axis(top: float, name: str, *, tight: bool = False) -> Axis:
    """Axis from zero to a round number not below ``top``; to ``top`` itself if ``tight``."""
    ticks = nice_ticks(0.0, top if top > 0 else 1.0)
    high = top if tight and top > 0 else ticks[-1]
    shown = [(value, _tick_text(value)) for value in ticks if value <= high]
    return Axis(0.0, high, shown, name)


def time_axis(end: float) -> Axis:
    """Axis of the seconds from 0 to ``end``: times of day, or in the unit of small numbers."""
    if has_clock():
        return clock_axis(0.0, end)
    unit = TimeUnit.for_span(end)
    span = end / unit.seconds
    steps = _HOURS if unit.seconds == 3600.0 else _SIXTIETHS
    step = next((step for step in steps if span / step <= 9), nice_ticks(0.0, span, count=8)[1])
    values = np.arange(0.0, span + 1e-9, step).tolist()
    ticks = [(value * unit.seconds, _tick_text(value)) for value in values]
    return Axis(0.0, end, ticks, f"time since the start, {unit.name}")


def clock_axis(begin: float, end: float) -> Axis:
    """Axis of a stretch of the run, labelled ``17:15``: of day, or since the start.

    Within the first hour without a clock the labels are minutes.
    """
    steps = (1, 2, 5, 10, 15, 30, 60, 120, 180, 360)
    step = next((60.0 * step for step in steps if end - begin <= step * 540.0), 43_200.0)
    first = np.ceil(begin / step - 1e-9) * step + 0.0  # not -0
    values = np.arange(first, end + 1e-6, step).tolist()
    if not has_clock() and end <= 3600.0:
        minutes = [(value, f"{value / 60.0:.0f}") for value in values]
        return Axis(begin, end, minutes, "time since the start, min")
    name = "time of day" if has_clock() else "time since the start, h:min"
    return Axis(begin, end, [(value, time_words(value)) for value in values], name)


def line_chart(
    time: FloatArray,
    series: Sequence[Series],
    *,
    y_label: str,
    description: str,
    height: float = _HEIGHT,
    end: float | None = None,
) -> Markup:
    """Chart of lines over time.

    Parameters
    ----------
    time
        Shape ``(B,)``: seconds.
    series
        Lines of the same shape.
    y_label
        What is shown, with its unit.
    description
        One sentence for those who cannot see it.
    height
        Of the drawing, whose width is 760.
    end
        Where the axis of time ends, seconds; with the last value if not given.
    """
    top = max((_peak_of_line(line) for line in series), default=0.0)
    frame = ChartFrame(
        time_axis(max(float(time[-1]) if end is None else end, 1.0)),
        value_axis(top, y_label),
        height,
    )
    parts = [
        _draw_band(frame, time, line)
        for line in series
        if line.low is not None and line.high is not None
    ]
    parts += [
        element("path", d=_line_data(frame, time, line.y), class_=f"line {line.style}")
        for line in series
    ]
    return chart(frame, parts, description=description, keys=_draw_legend(series))


@dataclass(frozen=True, slots=True, eq=False)
class Dots:
    """One group of dots of a chart; ``style`` is the class that gives the colour."""

    label: str
    style: str
    x: FloatArray
    y: FloatArray
    titles: Sequence[str] = ()


def dot_chart(
    groups: Sequence[Dots], *, x_label: str, y_label: str, description: str, joined: bool = False
) -> Markup:
    """Chart of dots; both axes start at zero.

    Parameters
    ----------
    groups
        Each with a colour of its own; ``titles``, one per dot, show when it is pointed at.
    joined
        Whether a thin line leads from dot to dot, through all groups in their order.
    """
    x, y = (np.concatenate([getattr(dots, key) for dots in groups]) for key in ("x", "y"))
    x_axis, y_axis = (
        value_axis(float(values.max(initial=0.0)), name)
        for values, name in ((x, x_label), (y, y_label))
    )
    frame = ChartFrame(x_axis, y_axis, height=360.0)
    parts = dot_parts(frame, groups, joined=joined)
    entries = [(dots.style, dots.label) for dots in groups]
    return chart(frame, parts, description=description, keys=legend(entries))


def dot_parts(frame: ChartFrame, groups: Sequence[Dots], *, joined: bool = False) -> list[Markup]:
    """Dots of a chart, and the thin line that joins them in their order if wanted."""
    parts = []
    if joined:
        x, y = (np.concatenate([getattr(dots, key) for dots in groups]) for key in ("x", "y"))
        parts.append(element("path", d=_line_data(frame, x, y), class_="trail"))
    for dots in groups:
        circles = []
        places = np.column_stack([frame.x(dots.x), frame.y(dots.y)]).tolist()
        for (a, b), title in zip(places, dots.titles or [""] * len(places), strict=True):
            words = element("title", title) if title else None
            circles.append(element("circle", words, cx=number(a, 1), cy=number(b, 1), r=4))
        parts.append(element("g", *circles, class_=f"dots {dots.style}"))
    return parts


@dataclass(frozen=True, slots=True)
class ChartFrame:
    """From values to places in a chart of ``height``, in the units of its drawing."""

    x_axis: Axis
    y_axis: Axis
    height: float = _HEIGHT

    def x(self, value: FloatArray | float) -> FloatArray | float:
        """From the left edge of the drawing."""
        axis = self.x_axis
        return _LEFT + (value - axis.low) / (axis.high - axis.low) * (_WIDTH - _LEFT - _RIGHT)

    def y(self, value: FloatArray | float) -> FloatArray | float:
        """From its upper edge."""
        axis = self.y_axis
        share = (value - axis.low) / (axis.high - axis.low)
        return self.height - _BOTTOM - share * (self.height - _TOP - _BOTTOM)


def chart(
    frame: ChartFrame, parts: Sequence[Markup], *, description: str, keys: Markup | None = None
) -> Markup:
    """Axes, what lies between them, and a legend below."""
    drawn = [element("title", description)]
    drawn += [_grid_line(frame, *tick) for tick in frame.y_axis.ticks]
    drawn += [_x_tick(frame, *tick) for tick in frame.x_axis.ticks]
    drawn += parts
    drawn.append(text_at(_LEFT - 42, 14, frame.y_axis.name, class_="axis-name"))
    x_name = text_at(
        _WIDTH - _RIGHT,
        frame.height - 4,
        frame.x_axis.name,
        class_="axis-name",
        text_anchor="end",
    )
    drawn.append(x_name)
    view = f"0 0 {number(_WIDTH)} {number(frame.height)}"
    svg = element("svg", *drawn, viewBox=view, role="img", class_="chart")
    return element("div", svg, keys, class_="chart-box", tabindex="0")


def legend(entries: Sequence[tuple[str, str]]) -> Markup:
    """Swatches with their words; pairs of class and words."""
    items = [element("span", element("i", class_=f"swatch {style}"), words)
             for style, words in entries]  # fmt: skip
    return element("div", *items, class_="legend")


def _peak_of_line(line: Series) -> float:
    curve = line.y if line.high is None else np.fmax(line.high, line.y)
    finite = curve[np.isfinite(curve)]
    return float(finite.max()) if finite.size else 0.0


def text_at(x: float, y: float, text: str, **attributes: str) -> Markup:
    """Text of a chart."""
    return element("text", text, x=float(x), y=float(y), **attributes)


def _grid_line(frame: ChartFrame, value: float, label: str) -> Markup:
    y = float(frame.y(value))
    line = element(
        "path", d=f"M{number(_LEFT)} {number(y)}H{number(_WIDTH - _RIGHT)}", class_="grid"
    )
    return join([line, text_at(_LEFT - 8, y + 4, label, text_anchor="end")])


def _x_tick(frame: ChartFrame, value: float, label: str) -> Markup:
    x, bottom = float(frame.x(value)), frame.height - _BOTTOM
    line = element("path", d=f"M{number(x)} {number(bottom)}v4", class_="tick")
    return join([line, text_at(x, bottom + 17, label, text_anchor="middle")])


def _tick_text(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000 else number(value, 3)


def _runs_of_true(valid: NDArray[np.bool_]) -> list[slice]:
    """Stretches of consecutive true values."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], valid, [False])).astype(np.int8)))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _format_points(x: FloatArray, y: FloatArray) -> str:
    return " ".join(
        f"{number(a, 1)},{number(b, 1)}" for a, b in zip(x.tolist(), y.tolist(), strict=True)
    )


def _line_data(frame: ChartFrame, time: FloatArray, y: FloatArray) -> str:
    x, height = np.asarray(frame.x(time)), np.asarray(frame.y(y))
    # A lone value would be invisible as a line: a stub with round caps shows as a dot.
    return "".join(
        f"M{_format_points(x[run], height[run])}" + ("h0.1" if run.stop - run.start == 1 else "")
        for run in _runs_of_true(np.isfinite(y))
    )


def _draw_band(frame: ChartFrame, time: FloatArray, line: Series) -> Markup:
    low, high = np.asarray(line.low), np.asarray(line.high)
    x, below, above = np.asarray(frame.x(time)), np.asarray(frame.y(low)), np.asarray(frame.y(high))
    data = "".join(
        f"M{_format_points(x[run], above[run])} {_format_points(x[run][::-1], below[run][::-1])}z"
        for run in _runs_of_true(np.isfinite(low) & np.isfinite(high))
    )
    return element("path", d=data, class_=f"band {line.style}")


def _draw_legend(series: Sequence[Series]) -> Markup | None:
    if len(series) < 2 and all(line.low is None for line in series):
        return None
    entries = [(line.style, line.label) for line in series]
    if (banded := next((line for line in series if line.low is not None), None)) is not None:
        words = "8 of 10 values lie in this band (10th to 90th percentile)"
        entries.append((f"band {banded.style}", words))
    return legend(entries)
