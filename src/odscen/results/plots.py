"""Line charts as SVG text: small, sharp in print, and coloured by the page's style sheet.

Direct SVG and not matplotlib: no second of import time, a tenth of the size, and the same chart is
readable on a light and on a dark page, because colours are classes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from odscen.catalog.markup import Markup, element, join, number

if TYPE_CHECKING:
    from collections.abc import Sequence

FloatArray = NDArray[np.float64]

_WIDTH, _HEIGHT = 760.0, 270.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 52.0, 14.0, 30.0, 40.0


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


def line_chart(
    time: FloatArray, series: Sequence[Series], *, y_label: str, description: str
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
    """
    end = max(float(time[-1]), 1.0)
    unit = TimeUnit.for_span(end)
    x_ticks = nice_ticks(0.0, end / unit.seconds, count=8)
    top = max((_peak(line) for line in series), default=0.0)
    y_ticks = nice_ticks(0.0, top if top > 0 else 1.0)
    frame = _Frame(x_ticks[-1] * unit.seconds, y_ticks[-1])
    parts = [element("title", description)]
    parts += [_grid_line(frame, value) for value in y_ticks]
    parts += [_x_tick(frame, value * unit.seconds, value) for value in x_ticks]
    for line in series:
        if line.low is not None and line.high is not None:
            parts.append(_band(frame, time, line))
    parts += [
        element("path", d=_line_data(frame, time, line.y), class_=f"line {line.style}")
        for line in series
    ]
    parts.append(_text(_LEFT - 42, 14, y_label, class_="axis-name"))
    x_name = f"time since the start, {unit.name}"
    parts.append(_text(_WIDTH - _RIGHT, _HEIGHT - 4, x_name, class_="axis-name", text_anchor="end"))
    view = f"0 0 {number(_WIDTH)} {number(_HEIGHT)}"
    svg = element("svg", *parts, viewBox=view, role="img", class_="chart")
    return element("div", svg, _legend(series), class_="chart-box")


@dataclass(frozen=True, slots=True)
class _Frame:
    """From values to places in the chart; both axes start at zero."""

    x_max: float
    y_max: float

    def x(self, value: FloatArray | float) -> FloatArray | float:
        return _LEFT + value / self.x_max * (_WIDTH - _LEFT - _RIGHT)

    def y(self, value: FloatArray | float) -> FloatArray | float:
        return _HEIGHT - _BOTTOM - value / self.y_max * (_HEIGHT - _TOP - _BOTTOM)


def _peak(line: Series) -> float:
    curve = line.y if line.high is None else np.fmax(line.high, line.y)
    finite = curve[np.isfinite(curve)]
    return float(finite.max()) if finite.size else 0.0


def _text(x: float, y: float, text: str, **attributes: str) -> Markup:
    return element("text", text, x=float(x), y=float(y), **attributes)


def _grid_line(frame: _Frame, value: float) -> Markup:
    y = float(frame.y(value))
    line = element(
        "path", d=f"M{number(_LEFT)} {number(y)}H{number(_WIDTH - _RIGHT)}", class_="grid"
    )
    return join([line, _text(_LEFT - 8, y + 4, _tick_text(value), text_anchor="end")])


def _x_tick(frame: _Frame, time: float, value: float) -> Markup:
    x, bottom = float(frame.x(time)), _HEIGHT - _BOTTOM
    line = element("path", d=f"M{number(x)} {number(bottom)}v4", class_="tick")
    return join([line, _text(x, bottom + 17, _tick_text(value), text_anchor="middle")])


def _tick_text(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000 else number(value, 3)


def _runs(valid: NDArray[np.bool_]) -> list[slice]:
    """Stretches of consecutive true values."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], valid, [False])).astype(np.int8)))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _points(x: FloatArray, y: FloatArray) -> str:
    return " ".join(
        f"{number(a, 1)},{number(b, 1)}" for a, b in zip(x.tolist(), y.tolist(), strict=True)
    )


def _line_data(frame: _Frame, time: FloatArray, y: FloatArray) -> str:
    x, height = np.asarray(frame.x(time)), np.asarray(frame.y(y))
    # A lone value would be invisible as a line: a stub with round caps shows as a dot.
    return "".join(
        f"M{_points(x[run], height[run])}" + ("h0.1" if run.stop - run.start == 1 else "")
        for run in _runs(np.isfinite(y))
    )


def _band(frame: _Frame, time: FloatArray, line: Series) -> Markup:
    low, high = np.asarray(line.low), np.asarray(line.high)
    x, below, above = np.asarray(frame.x(time)), np.asarray(frame.y(low)), np.asarray(frame.y(high))
    data = "".join(
        f"M{_points(x[run], above[run])} {_points(x[run][::-1], below[run][::-1])}z"
        for run in _runs(np.isfinite(low) & np.isfinite(high))
    )
    return element("path", d=data, class_=f"band {line.style}")


def _legend(series: Sequence[Series]) -> Markup | None:
    if len(series) < 2 and all(line.low is None for line in series):
        return None
    items = [
        element("span", element("i", class_=f"swatch {line.style}"), line.label) for line in series
    ]
    if any(line.low is not None for line in series):
        style = next(line.style for line in series if line.low is not None)
        text = "8 of 10 values lie in this band (10th to 90th percentile)"
        items.append(element("span", element("i", class_=f"swatch band {style}"), text))
    return element("div", *items, class_="legend")
