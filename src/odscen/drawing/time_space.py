"""Time-space diagram of a green wave: red of each light, and the bands between."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.markup import Markup, element, number
from odscen.drawing.legend import INK

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

WIDTH, HEIGHT = 960.0, 540.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 112.0, 76.0, 64.0, 52.0
_BAR = 5.0
_CYCLES = 2.5
_TICKS = (5.0, 10.0, 20.0, 30.0, 60.0)
_MOST_TICKS = 16
COLORS = {"out": "#2f78c4", "back": "#c7772e"}
RED = "#d64545"
GREY = "#d9dde1"
NAMES = {"out": "band along", "back": "band back"}


class DiagramLight(NamedTuple):
    """A light: metres along, seconds of offset, and windows of green (begin, seconds) each way."""

    name: str
    metres: float
    offset: float
    out: tuple[tuple[float, float], ...]
    back: tuple[tuple[float, float], ...]


class DiagramBand(NamedTuple):
    """A band: ``out`` or ``back``, when it begins at each light, and its seconds."""

    way: str
    times: tuple[float, ...]
    seconds: float


def time_space_svg(
    lights: Sequence[DiagramLight], bands: Sequence[DiagramBand], *, cycle: float, title: str
) -> str:
    """SVG document of two and a half cycles; distance upwards, time to the right.

    The upper half of the bar of a light is red where those who drive along have red, the lower half
    where those who drive back have.
    """
    diagram = _Diagram(lights, cycle)
    shapes = [
        element("title", f"Time-space diagram, {title}"),
        element("rect", width=WIDTH, height=HEIGHT, fill="#ffffff"),
        *diagram.axis(),
        element("g", *diagram.bands(bands), clip_path="url(#plot)"),
        *diagram.lights(),
        *_draw_heading(bands, cycle, title),
    ]
    clip = element("clipPath", diagram.plot(), id="plot")
    drawn = element(
        "svg",
        element("defs", clip),
        *shapes,
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {number(WIDTH)} {number(HEIGHT)}",
        width=WIDTH,
        height=HEIGHT,
        font_family="system-ui, sans-serif",
        font_size=12,
        fill=INK,
    )
    return f"{drawn}\n"


class _Diagram:
    def __init__(self, lights: Sequence[DiagramLight], cycle: float) -> None:
        self._lights = lights
        self._cycle = cycle
        self._until = _CYCLES * cycle
        self._far = max((light.metres for light in lights), default=1.0) or 1.0

    def x(self, second: float) -> float:
        return _LEFT + (WIDTH - _LEFT - _RIGHT) * second / self._until

    def y(self, metres: float) -> float:
        return HEIGHT - _BOTTOM - 14.0 - (HEIGHT - _TOP - _BOTTOM - 28.0) * metres / self._far

    def plot(self) -> Markup:
        return element(
            "rect", x=_LEFT, y=_TOP, width=WIDTH - _LEFT - _RIGHT, height=HEIGHT - _TOP - _BOTTOM
        )

    def axis(self) -> Iterator[Markup]:
        step = next((value for value in _TICKS if self._until / value <= _MOST_TICKS), 120.0)
        bottom = HEIGHT - _BOTTOM
        for tick in range(int(self._until / step) + 1):
            x = self.x(tick * step)
            yield element("line", x1=x, x2=x, y1=_TOP, y2=bottom, stroke=GREY)
            yield element("text", number(tick * step), x=x, y=bottom + 18.0, text_anchor="middle")
        middle = (_LEFT + WIDTH - _RIGHT) / 2.0
        yield element("text", "time, s", x=middle, y=bottom + 38.0, text_anchor="middle")

    def bands(self, bands: Sequence[DiagramBand]) -> Iterator[Markup]:
        for band in bands:
            color = COLORS[band.way]
            first = -math.ceil(max(band.times) / self._cycle) - 1
            for turn in range(first, math.ceil(_CYCLES) + 1):
                shift = turn * self._cycle
                places = list(zip(band.times, self._lights, strict=True))
                front = [(self.x(t + shift), self.y(place.metres)) for t, place in places]
                rear = [
                    (self.x(t + shift + band.seconds), self.y(place.metres)) for t, place in places
                ]
                points = " ".join(f"{number(x)},{number(y)}" for x, y in (*front, *rear[::-1]))
                yield element("polygon", points=points, fill=color, fill_opacity=0.22, stroke=color)

    def lights(self) -> Iterator[Markup]:
        for light in self._lights:
            y = self.y(light.metres)
            for windows, top in ((light.out, y - _BAR), (light.back, y)):
                for begin, end in self._red_spans(windows, light.offset):
                    yield element(
                        "rect", x=self.x(begin), y=top, width=self.x(end) - self.x(begin),
                        height=_BAR - 0.5, fill=RED,
                    )  # fmt: skip
            yield element("text", light.name, x=_LEFT - 10.0, y=y, text_anchor="end",
                          font_weight=600)  # fmt: skip
            under = f"{number(light.metres, 0)} m"
            yield element("text", under, x=_LEFT - 10.0, y=y + 14.0, text_anchor="end",
                          font_size=11)  # fmt: skip
            yield element(
                "text", f"+{number(light.offset, 1)} s", x=WIDTH - _RIGHT + 10.0, y=y + 4.0
            )

    def _red_spans(
        self, windows: Sequence[tuple[float, float]], offset: float
    ) -> Iterator[tuple[float, float]]:
        """Begin and end of red in the picture; none for a direction that nobody drives."""
        if not windows:
            return
        last = int(_CYCLES) + 2
        greens = sorted(
            (begin + offset + turn * self._cycle, begin + offset + turn * self._cycle + seconds)
            for begin, seconds in windows
            for turn in range(-3, last)
        )
        for (_, end), (begin, _) in pairwise(greens):
            left, right = max(end, 0.0), min(begin, self._until)
            if right - left > 1e-6:
                yield left, right


def _draw_heading(bands: Sequence[DiagramBand], cycle: float, title: str) -> Iterator[Markup]:
    yield element("text", title, x=_LEFT, y=24.0, font_size=16, font_weight=600)
    keys: list[tuple[str, str, float]] = [
        (
            COLORS[band.way],
            f"{NAMES[band.way]}: {number(band.seconds, 1)} s, "
            f"{number(100.0 * band.seconds / cycle, 0)} % of {number(cycle, 1)} s",
            0.4,
        )
        for band in bands
    ]
    keys.append((RED, "red: above for those along, below for those back", 1.0))
    x = _LEFT
    for color, words, opacity in keys:
        yield element("rect", x=x, y=38.0, width=14.0, height=10.0, fill=color,
                      fill_opacity=opacity)  # fmt: skip
        yield element("text", words, x=x + 20.0, y=47.0)
        x += 36.0 + 6.4 * len(words)
    yield element("text", "offset", x=WIDTH - _RIGHT + 10.0, y=_TOP - 4.0, font_size=11)
