"""Legend of a map sheet: what occurs in the drawing, and only that."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.base.markup import Markup, element, join, number
from odscen.drawing.palette import (
    AREA_COLORS,
    AREA_NAMES,
    CROSSWALK_COLOR,
    PEDESTRIAN_NODE_COLOR,
    RELATION_COLORS,
    SEGMENT_COLORS,
    SYMBOL_NAMES,
    VEHICLE_NODE_COLOR,
)
from odscen.drawing.svg_layers import symbol_shapes, symbol_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.drawing.map_drawing import MapDrawing
    from odscen.drawing.svg_layers import PlaceMarks
    from odscen.lanegraph.graphs import MapGraph


@dataclass(frozen=True, slots=True)
class RenderOptions:
    """What the sheet shows.

    Attributes
    ----------
    symbols, speed_limits
        Lights and signs; speed-limit signs on top.
    graph
        Lane graph and pedestrian graph, if one is given.
    segments
        Segments of the graph, in alternating colours, if one is given.
    margins
        Name, figures, legend, scale; without them only the map is drawn.
    """

    symbols: bool = True
    speed_limits: bool = False
    graph: bool = True
    segments: bool = False
    margins: bool = True


INK = "#22282e"
_ROW = 24.0
_CHAR = 0.56
"""Width of a letter over its font size, on average."""


def legend_entries(
    drawing: MapDrawing, graph: MapGraph | None, options: RenderOptions
) -> list[tuple[Markup, str]]:
    """Swatches and names of what occurs, and only that."""
    present = {area.kind for area in drawing.areas}
    entries = [
        (_draw_box(AREA_COLORS[kind]), AREA_NAMES[kind]) for kind in AREA_NAMES if kind in present
    ]
    if drawing.crosswalks.total:
        entries.append((_draw_zebra(), "Crosswalk"))
    if options.symbols:
        kinds = {symbol.kind for symbol in drawing.symbols}
        kinds -= set() if options.speed_limits else {"speed_limit"}
        entries += [
            (_draw_sign(kind), text) for kind, text in SYMBOL_NAMES.items() if kind in kinds
        ]
    if graph is not None and options.segments:
        entries.append((_draw_bands(), "Segments"))
    if graph is not None and options.graph:
        entries += _graph_entries(graph)
    return entries


def place_entries(marks: Sequence[PlaceMarks]) -> list[tuple[Markup, str]]:
    """Rings and names of circled places, with how many there are of each kind."""
    return [(_draw_ring(kind.color), f"{kind.name} ({kind.total})") for kind in marks]


def _graph_entries(graph: MapGraph) -> list[tuple[Markup, str]]:
    names = ("Successor", "Lane change left", "Lane change right")
    relations = set(graph.lanes.relation.tolist())
    entries = [(_draw_dot(VEHICLE_NODE_COLOR), "Vehicle node")]
    entries += [
        (_draw_stroke(RELATION_COLORS[k]), name) for k, name in enumerate(names) if k in relations
    ]
    if len(graph.walks.x):
        entries.append((_draw_dot(PEDESTRIAN_NODE_COLOR), "Pedestrian node"))
    return entries


def _draw_box(color: str) -> Markup:
    return element("rect", y=-7, width=18, height=14, rx=3, fill=color)


def _draw_zebra() -> Markup:
    bars = [
        element("rect", x=x, y=-5, width=2.5, height=10, fill="#fff") for x in (2.5, 7.75, 13.0)
    ]
    ground = element("rect", y=-8, width=18, height=16, rx=3, fill=CROSSWALK_COLOR)
    return join([ground, element("rect", x=1.5, y=-5, width=15, height=10, fill="#7b828b"), *bars])


def _draw_sign(kind: str) -> Markup:
    parts = [element("use", href=f"#k-s-{kind}")]
    if kind == "speed_limit":
        parts.append(symbol_text("50", size=40, fill="#1d2126"))
    return element("g", *parts, transform="translate(9 0) scale(.19)")


def _draw_dot(color: str) -> Markup:
    return element("circle", cx=9, r=5.5, fill=color, stroke=INK, stroke_width=0.5)


def _draw_ring(color: str) -> Markup:
    return element("circle", cx=9, r=6, fill="none", stroke=color, stroke_width=3)


def _draw_bands() -> Markup:
    bands = [
        element("rect", x=6 * k, y=-7, width=6, height=14, fill=color, opacity=0.6)
        for k, color in enumerate(SEGMENT_COLORS[:3])
    ]
    return join(bands)


def _draw_stroke(color: str) -> Markup:
    return element("path", d="M0 0h18", stroke=color, stroke_width=3)


def legend(
    entries: list[tuple[Markup, str]], *, left: float, top: float, width: float
) -> tuple[Markup, float]:
    """Set the entries in as many rows as it takes; gives the markup and its height."""
    if not entries:
        return Markup(""), 0.0
    x, y = left, top + 30.0
    parts = [symbol_shapes("k-")]
    for swatch, text in entries:
        wide = 27.0 + len(text) * 14.5 * _CHAR + 24.0
        if x + wide > left + width + 24.0:
            x, y = left, y + _ROW
        place = f"translate({number(x)} {number(y)})"
        label = element("text", text, x=27, y=5, font_size=14.5, fill=INK)
        parts.append(element("g", swatch, label, transform=place))
        x += wide
    return join(parts), y - top + 2.0
