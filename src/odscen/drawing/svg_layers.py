"""A map drawing as SVG groups, bottom to top, in centimetres with y down.

Every element carries a class (``m-road``, ``m-mark``, ...) beside its colour, so that a page can
repaint the map for a dark background.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.base.markup import Markup, element, join, number, path_data
from odscen.drawing.map_drawing import BRIDGE
from odscen.drawing.palette import (
    AREA_COLORS,
    CROSSWALK_COLOR,
    FONT,
    MARK_COLORS,
    PEDESTRIAN_NODE_COLOR,
    RELATION_COLORS,
    SEGMENT_COLORS,
    SYMBOL_NAMES,
    VEHICLE_NODE_COLOR,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from odscen.base.arrays import Bounds, FloatArray, IntArray
    from odscen.drawing.map_drawing import Lines, MapDrawing, Symbol
    from odscen.lanegraph.graphs import MapGraph


@dataclass(frozen=True, slots=True)
class LayerOptions:
    """What to draw, and how large symbols are.

    Attributes
    ----------
    symbol_size
        Height of a traffic light in metres; all symbols follow it.
    ground, symbols, speed_limits
        What to show: everything on the ground, signs and lights, speed limits among them.
    prefix
        Put before every ``id``, so that two maps can be in one page.
    """

    symbol_size: float = 4.0
    ground: bool = True
    symbols: bool = True
    speed_limits: bool = False
    prefix: str = ""


def map_layers(drawing: MapDrawing, options: LayerOptions) -> Markup:
    """Surfaces, markings, crosswalks, stop lines and symbols of a map."""
    parts = _draw_ground(drawing, options) if options.ground else []
    if options.symbols:
        parts.append(_draw_symbols(drawing, options))
    return join([part for part in parts if part])


def _draw_ground(drawing: MapDrawing, options: LayerOptions) -> list[Markup]:
    parts = [_draw_rings(drawing.buildings, class_="m-building", fill="#e4dfd6", stroke="#c9c2b5")]
    for level in sorted({area.level for area in drawing.areas}):
        parts += [_draw_surfaces(drawing, level, options), _draw_markings(drawing, level)]
    return [
        *parts,
        _draw_rings(drawing.parking_spaces, class_="m-mark", fill="none", stroke="#ffffff"),
        _draw_crosswalks(drawing, options),
        _stop_lines(drawing.stop_lines),
    ]


def svg_xy(lines: Lines) -> str:
    """``d`` of lines with y down."""
    return path_data(lines.xy * (1.0, -1.0), lines.start)


def svg_rings(lines: Lines) -> str:
    """``d`` of rings with y down."""
    return path_data(lines.xy * (1.0, -1.0), lines.start, closed=True)


def _draw_rings(lines: Lines, **attributes: str) -> Markup:
    if lines.total == 0:
        return Markup("")
    width = 8 if "stroke" in attributes else None
    return element("path", d=svg_rings(lines), stroke_width=width, **attributes)


def _stop_lines(lines: Lines) -> Markup:
    if lines.total == 0:
        return Markup("")
    line = element("path", d=svg_xy(lines), class_="m-mark", stroke="#ffffff", stroke_width=40)
    return element("g", line, fill="none")


def _draw_surfaces(drawing: MapDrawing, level: int, options: LayerOptions) -> Markup:
    order = list(AREA_COLORS)
    areas = sorted(
        (area for area in drawing.areas if area.level == level), key=lambda a: order.index(a.kind)
    )
    data = {area.kind: svg_rings(area.rings) for area in areas}
    parts = []
    for mark in drawing.marks:
        if mark.level == level and mark.color == BRIDGE:
            # A light edge and a dark one under it lift a bridge off what it crosses.
            sides = svg_xy(mark.lines)
            for width, color, style in ((200, "#6b6f75", "m-edge"), (130, "#f3f1ea", "m-casing")):
                line = element("path", d=sides, class_=style, stroke=color, stroke_width=width)
                parts.append(element("g", line, fill="none"))
    seam = 24 if level else 6
    for kind, rings in data.items():
        # The stroke in the same colour closes hairlines: between lanes, and where a bridge begins.
        color = AREA_COLORS[kind]
        style = f"m-area m-{kind}"
        parts.append(
            element("path", d=rings, class_=style, fill=color, stroke=color, stroke_width=seam)
        )
    return element("g", *parts, id=f"{options.prefix}level-{level}", stroke_linejoin="round")


def _draw_markings(drawing: MapDrawing, level: int) -> Markup:
    parts = []
    for mark in drawing.marks:
        if mark.level != level or mark.color == BRIDGE:
            continue
        dash = None if mark.dash is None else " ".join(number(d * 100, 0) for d in mark.dash)
        parts.append(
            element(
                "path",
                d=svg_xy(mark.lines),
                class_=f"m-mark m-mark-{mark.color}",
                stroke=MARK_COLORS.get(mark.color, MARK_COLORS["white"]),
                stroke_width=round(mark.width * 100),
                stroke_dasharray=dash,
            )
        )
    return element("g", *parts, fill="none") if parts else Markup("")


def _draw_crosswalks(drawing: MapDrawing, options: LayerOptions) -> Markup:
    if drawing.crosswalks.total == 0:
        return Markup("")
    outline = svg_rings(drawing.crosswalks)
    halo = round(max(60.0, options.symbol_size * 22.0))
    return join(
        [
            element(
                "path",
                d=outline,
                class_="m-crosswalk",
                fill=CROSSWALK_COLOR,
                stroke=CROSSWALK_COLOR,
                stroke_width=halo,
                stroke_linejoin="round",
            ),
            element("path", d=outline, class_="m-crosswalk-ground", fill="#7b828b"),
            _draw_rings(drawing.bars, class_="m-bar", fill="#ffffff"),
        ]
    )


def symbol_shapes(prefix: str) -> Markup:
    """``<defs>`` of the symbols: 100 units high, centred on the origin."""
    octagon = " ".join(
        f"{number(46 * np.cos(a), 1)},{number(46 * np.sin(a), 1)}"
        for a in np.pi / 8 + np.arange(8) * np.pi / 4
    )
    light = element("rect", x=-24, y=-54, width=48, height=108, rx=18, fill="#fff")
    light += element("rect", x=-19, y=-49, width=38, height=98, rx=14, fill="#22262b")
    for y, color in ((-29, "#ff4b3e"), (0, "#ffc93c"), (29, "#35c46a")):
        light += element("circle", cx=0, cy=y, r=11, fill=color)
    walker = element("rect", x=-24, y=-40, width=48, height=80, rx=18, fill="#fff")
    walker += element("rect", x=-19, y=-35, width=38, height=70, rx=14, fill="#22262b")
    for y, color in ((-15, "#ff4b3e"), (15, "#35c46a")):
        walker += element("circle", cx=0, cy=y, r=11, fill=color)
    stop = element("polygon", points=octagon, fill="#c8102e", stroke="#fff", stroke_width=9)
    stop += symbol_text("STOP", size=27, fill="#fff")
    give_way = element(
        "polygon",
        points="-44,-36 44,-36 0,40",
        fill="#fff",
        stroke="#c8102e",
        stroke_width=15,
        stroke_linejoin="round",
    )
    limit = element("circle", r=43, fill="#fff", stroke="#c8102e", stroke_width=13)
    shapes = {
        "traffic_light": light,
        "pedestrian_light": walker,
        "stop": stop,
        "yield": give_way,
        "speed_limit": limit,
    }
    return element("defs", *(element("g", s, id=f"{prefix}s-{k}") for k, s in shapes.items()))


def symbol_text(text: str, *, size: float, fill: str) -> Markup:
    """Text in the middle of a symbol."""
    return element(
        "text",
        text,
        y=round(size * 0.36, 1),
        font_size=size,
        font_weight=700,
        text_anchor="middle",
        font_family=FONT,
        fill=fill,
    )


def _draw_symbols(drawing: MapDrawing, options: LayerOptions) -> Markup:
    shown = [
        symbol
        for symbol in drawing.symbols
        if symbol.kind in SYMBOL_NAMES and (options.speed_limits or symbol.kind != "speed_limit")
    ]
    if not shown:
        return Markup("")
    # Lights last: they lie on top where signs share their pole.
    shown.sort(key=lambda symbol: list(SYMBOL_NAMES).index(symbol.kind), reverse=True)
    uses = [_draw_symbol(symbol, options) for symbol in shown]
    return element("g", symbol_shapes(options.prefix), *uses, class_="m-symbols")


def _draw_symbol(symbol: Symbol, options: LayerOptions) -> Markup:
    place = f"translate({round(symbol.x * 100)} {round(-symbol.y * 100)})"
    scale = number(options.symbol_size, 2)
    use = element("use", href=f"#{options.prefix}s-{symbol.kind}")
    if symbol.text:
        use += symbol_text(symbol.text, size=40 if len(symbol.text) < 3 else 31, fill="#1d2126")
    return element("g", use, transform=f"{place} scale({scale})")


class PlaceMarks(NamedTuple):
    """Places of one kind to be marked on a map, metres, OpenDRIVE frame.

    ``xy``, shape ``(N, 2)``, are circled; ``lines`` are drawn over.
    """

    name: str
    color: str
    xy: FloatArray
    lines: Lines | None = None

    @property
    def total(self) -> int:
        """How many places there are."""
        return len(self.xy) + (self.lines.total if self.lines is not None else 0)


def place_layer(marks: Sequence[PlaceMarks], *, radius: float) -> Markup:
    """Circles of ``radius`` metres around places, and lines, in the colours of their kinds.

    They lie on a light rim, so that they show on every surface; the middle stays clear. Places of
    one kind that lie within one ring share it.
    """
    rings = [
        _circle_path(_spread_places(kind.xy, radius), radius) + _overlay_path(kind)
        for kind in marks
    ]
    rim, line = round(radius * 48.0), round(radius * 28.0)
    parts = []
    for kind, ring in zip(marks, rings, strict=True):
        parts.append(element("path", d=ring, class_="m-place-rim", stroke="#fff", stroke_width=rim))
        parts.append(
            element("path", d=ring, class_="m-place", stroke=kind.color, stroke_width=line)
        )
    return element("g", *parts, class_="m-places", fill="none", stroke_linecap="round")


def _overlay_path(kind: PlaceMarks) -> str:
    return "" if kind.lines is None or not kind.lines.total else svg_xy(kind.lines)


def _spread_places(xy: FloatArray, radius: float) -> FloatArray:
    """Places no two of which lie within ``radius``; every other lies within it of one of them."""
    left, kept = xy, []
    while len(left):
        kept.append(left[0])
        left = left[np.hypot(*(left - left[0]).T) > radius]
    return np.array(kept).reshape(-1, 2)


def _circle_path(xy: FloatArray, radius: float) -> str:
    r = max(1, round(radius * 100.0))
    places = np.rint(xy * (100.0, -100.0)).astype(np.int64).tolist()
    half = f"a{r} {r} 0 1 0"
    return "".join(f"M{x - r} {y}{half} {2 * r} 0{half} {-2 * r} 0z" for x, y in places)


def graph_layers(
    graph: MapGraph, *, node_size: float = 0.35, bounds: Bounds | None = None
) -> Markup:
    """Lane graph and pedestrian graph in the colours of requirement R22.

    Parameters
    ----------
    node_size
        Radius of a node in metres.
    bounds
        Rectangle in metres; what does not touch it is left out.
    """
    lanes, walks = graph.lanes, graph.walks
    parts = []
    places = np.stack([lanes.x, lanes.y], axis=1)
    shown = _within_bounds(places, bounds)
    edge_shown = shown[lanes.source] | shown[lanes.target]
    for relation, color in enumerate(RELATION_COLORS):
        rows = np.flatnonzero(edge_shown & (lanes.relation == relation))
        parts.append(_draw_edges(places, lanes.source[rows], lanes.target[rows], color, node_size))
    walk_places = np.stack([walks.x, walks.y], axis=1)
    walk_shown = _within_bounds(walk_places, bounds)
    rows = np.flatnonzero(walk_shown[walks.source] | walk_shown[walks.target])
    parts.append(
        _draw_edges(walk_places, walks.source[rows], walks.target[rows], "#b39700", node_size)
    )
    parts.append(_draw_dots(places[shown], VEHICLE_NODE_COLOR, node_size))
    parts.append(_draw_dots(walk_places[walk_shown], PEDESTRIAN_NODE_COLOR, node_size))
    return element("g", *parts, class_="m-graph", fill="none", stroke_linecap="round")


def _within_bounds(places: FloatArray, bounds: Bounds | None) -> NDArray[np.bool_]:
    if bounds is None:
        return np.ones(len(places), dtype=np.bool_)
    inside: NDArray[np.bool_] = np.all((places >= bounds[:2]) & (places <= bounds[2:]), axis=1)
    return inside


def segment_layer(graph: MapGraph, *, width: float) -> Markup:
    """Segments as broad translucent bands along their lanes; neighbours differ in colour."""
    lanes, segments = graph.lanes, graph.segments
    colors = _segment_colors(len(segments.ids), segments.adjacency.tolist())
    inside = lanes.relation == 0
    inside &= lanes.segment[lanes.source] == lanes.segment[lanes.target]
    places = np.stack([lanes.x, lanes.y], axis=1)
    color_of_edge = colors[lanes.segment[lanes.source]]
    parts = []
    for index, color in enumerate(SEGMENT_COLORS):
        rows = np.flatnonzero(inside & (color_of_edge == index))
        parts.append(
            _draw_edges(places, lanes.source[rows], lanes.target[rows], color, width * 2.5)
        )
    return element("g", *parts, class_="m-segments", fill="none", opacity=0.45)


def _segment_colors(count: int, adjacency: list[list[int]]) -> IntArray:
    """First colour that no earlier neighbour has, taken round when all are."""
    neighbours: list[set[int]] = [set() for _ in range(count)]
    for a, b in adjacency:
        neighbours[a].add(b)
        neighbours[b].add(a)
    colors: list[int] = []
    for index, near in enumerate(neighbours):
        used = {colors[other] for other in near if other < index}
        free = (k for k in range(len(SEGMENT_COLORS)) if k not in used)
        colors.append(next(free, index % len(SEGMENT_COLORS)))
    return np.array(colors, dtype=np.int64)


def _draw_edges(
    places: FloatArray, source: NDArray[Any], target: NDArray[Any], color: str, size: float
) -> Markup:
    xy = np.stack([places[source], places[target]], axis=1).reshape(-1, 2) * (1.0, -1.0)
    data = path_data(xy, np.arange(len(source) + 1, dtype=np.int64) * 2)
    return element("path", d=data, stroke=color, stroke_width=round(size * 40))


def _draw_dots(places: FloatArray, color: str, size: float) -> Markup:
    whole = np.rint(places * (100.0, -100.0)).astype(np.int64).tolist()
    data = "".join(f"M{x} {y}h0" for x, y in whole).replace(" -", "-")
    return element("path", d=data, stroke=color, stroke_width=round(size * 200))
