"""A map as a printed sheet: drawing, name and figures, legend, scale bar, north arrow.

SVG without scripts and without anything from outside. The same map gives the same bytes.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import InputError, MissingDependencyError
from odscen.base.given_files import as_path
from odscen.base.markup import Markup, element, join, number
from odscen.base.text_files import write_file, write_text
from odscen.drawing.legend import INK, RenderOptions, legend, legend_entries, place_entries
from odscen.drawing.palette import FONT
from odscen.drawing.svg_layers import (
    LayerOptions,
    graph_layers,
    map_layers,
    place_layer,
    segment_layer,
)

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from odscen.base.arrays import Bounds
    from odscen.base.given_files import GivenPath
    from odscen.drawing.map_drawing import MapDrawing
    from odscen.drawing.svg_layers import PlaceMarks
    from odscen.lanegraph.graphs import MapGraph
    from odscen.lanegraph.map_statistics import MapStatistics
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.road_model import OpenDrive

_PAPER, _LAND, _SOFT = "#ffffff", "#f3f1ea", "#5d6870"
_SHEET = 1200.0
"""Width of the sheet; all sizes below are in these units."""
_MARGIN, _HEAD = 36.0, 74.0
_SYMBOL = 18.0
_RING = 8.0


_OVER_PICTURE = 0.6
"""Opacity of roads that lie over a picture."""


class Underlay(NamedTuple):
    """A PNG or JPEG under a map, and its pixels.

    ``affine`` are a to f of ``x = a column + b row + c``, ``y = d column + e row + f``, metres.
    """

    content: bytes
    media_type: str
    width: int
    height: int
    affine: tuple[float, float, float, float, float, float]


def render_svg(
    odr: OpenDrive,
    table: RoadTable,
    *,
    name: str = "",
    graph: MapGraph | None = None,
    options: RenderOptions | None = None,
) -> str:
    """Draw a map from its road model.

    Parameters
    ----------
    odr, table
        The road model and its evaluation.
    name
        Title of the sheet; the header's name if empty.
    graph
        To be drawn on top, as ``options`` say.
    """
    from odscen.drawing.map_shapes import map_drawing
    from odscen.lanegraph.map_statistics import map_statistics

    drawing = map_drawing(odr, table, name=name or odr.header.name)
    figures = map_statistics(odr, table, graph)
    return render_drawing(drawing, statistics=figures, graph=graph, options=options)


def render_drawing(
    drawing: MapDrawing,
    *,
    statistics: MapStatistics | None = None,
    graph: MapGraph | None = None,
    options: RenderOptions | None = None,
    view: Bounds | None = None,
    marks: Sequence[PlaceMarks] = (),
    underlay: Underlay | None = None,
) -> str:
    """Draw a map from its shapes.

    Parameters
    ----------
    statistics
        For the line of figures below the name.
    graph
        Lane graph, pedestrian graph and segments, to be drawn as ``options`` say.
    view
        Part of the map to show, metres; all of it by default.
    marks
        Places to be circled on top of everything, with an entry of the legend per kind.
    underlay
        Picture that lies under the roads, which are drawn lighter then.

    Returns
    -------
    str
        A whole SVG document.
    """
    options = options or RenderOptions()
    frame = _SheetFrame.around(view or drawing.bounds, margins=options.margins)
    if view is not None:
        drawing = drawing.clipped(frame.bounds)
    marks = [kind for kind in marks if kind.total]
    inside = _draw_inside(drawing, graph, options, frame)
    if underlay is not None:
        inside = _draw_underlay(underlay) + element("g", inside, opacity=_OVER_PICTURE)
    if marks:
        inside += place_layer(marks, radius=_RING / frame.scale)
    parts = [element("rect", width=frame.width, height="100%", fill=_PAPER)]
    foot = 0.0
    if options.margins:
        parts.append(_draw_head(drawing, statistics, frame))
        entries = legend_entries(drawing, graph, options) + place_entries(marks)
        low = frame.top + frame.height
        listed, foot = legend(entries, left=frame.left, top=low, width=frame.inner)
        parts.append(listed)
    parts.append(_draw_map(frame, inside))
    height = frame.top + frame.height + frame.margin + foot
    svg = element(
        "svg",
        element("title", f"Map {drawing.name}".strip()),
        *parts,
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {number(frame.width)} {number(height)}",
        width=frame.width,
        height=height,
        font_family=FONT,
    )
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{svg}\n'


@dataclass(frozen=True, slots=True)
class _SheetFrame:
    """Where the map lies on the sheet; ``scale`` in sheet units per metre."""

    bounds: Bounds
    scale: float
    left: float
    top: float
    width: float
    height: float
    margin: float

    @classmethod
    def around(cls, bounds: Bounds, *, margins: bool) -> _SheetFrame:
        """Fit the bounds, with some land around them, into a sheet of a decent shape."""
        wide, tall = bounds[2] - bounds[0], bounds[3] - bounds[1]
        land = max(4.0, 0.025 * max(wide, tall))
        wide, tall = wide + 2 * land, tall + 2 * land
        wide, tall = max(wide, tall * 0.75), max(tall, wide * 0.28)
        x, y = (bounds[0] + bounds[2]) / 2.0, (bounds[1] + bounds[3]) / 2.0
        margin = _MARGIN if margins else 0.0
        scale = (_SHEET - 2 * margin) / wide
        shown = (x - wide / 2.0, y - tall / 2.0, x + wide / 2.0, y + tall / 2.0)
        top = margin + _HEAD if margins else 0.0
        return cls(shown, scale, margin, top, _SHEET, tall * scale, margin)

    @property
    def inner(self) -> float:
        """Width of the map on the sheet."""
        return self.width - 2 * self.margin


def _draw_inside(
    drawing: MapDrawing, graph: MapGraph | None, options: RenderOptions, frame: _SheetFrame
) -> Markup:
    symbol = min(max(_SYMBOL / frame.scale, 1.6), 40.0)
    layer_options = LayerOptions(
        symbol_size=symbol, symbols=False, speed_limits=options.speed_limits
    )
    parts = [map_layers(drawing, layer_options)]
    if graph is not None and options.segments:
        parts.append(segment_layer(graph, width=max(2.5, 5.0 / frame.scale)))
    if graph is not None and options.graph:
        size = min(max(1.4 / frame.scale, 0.3), 0.7)
        parts.append(graph_layers(graph, node_size=size, bounds=frame.bounds))
    if options.symbols:
        only = replace(drawing, areas=(), marks=())
        parts.append(map_layers(only, replace(layer_options, symbols=True, ground=False)))
    return join(parts)


def _draw_underlay(picture: Underlay) -> Markup:
    """The picture, in the map's centimetres; nothing of it is outside the document."""
    a, b, c, d, e, f = picture.affine
    matrix = (100 * a, -100 * d, 100 * b, -100 * e, 100 * c, -100 * f)
    data = base64.b64encode(picture.content).decode("ascii")
    return element(
        "image",
        width=float(picture.width),
        height=float(picture.height),
        transform=f"matrix({' '.join(f'{value:.9g}' for value in matrix)})",
        preserveAspectRatio="none",
        href=f"data:{picture.media_type};base64,{data}",
    )


def _draw_map(frame: _SheetFrame, inside: Markup) -> Markup:
    """Nest the map, in centimetres, into the sheet; the nested viewport clips it."""
    low_x, low_y, high_x, high_y = frame.bounds
    cm = (low_x * 100, -high_y * 100, (high_x - low_x) * 100, (high_y - low_y) * 100)
    return element(
        "svg",
        element("rect", x=cm[0], y=cm[1], width=cm[2], height=cm[3], fill=_LAND),
        inside,
        x=frame.left,
        y=frame.top,
        width=frame.inner,
        height=frame.height,
        viewBox=" ".join(number(value) for value in cm),
    )


def _draw_text(
    x: float, y: float, text: str, *, size: float, fill: str = INK, **attributes: str
) -> Markup:
    return element(
        "text", text, x=float(x), y=float(y), font_size=float(size), fill=fill, **attributes
    )


def _draw_head(drawing: MapDrawing, statistics: MapStatistics | None, frame: _SheetFrame) -> Markup:
    name = drawing.name if len(drawing.name) <= 60 else drawing.name[:59] + "…"
    size = min(30.0, 800.0 / (0.62 * max(len(name), 1)))
    parts = [
        _draw_text(frame.left, frame.margin + 26, name or "Map", size=size, font_weight="700"),
        _scale_bar(frame),
        _draw_north_arrow(frame.width - frame.margin - 14, frame.margin + 30),
    ]
    if statistics is not None:
        line = " · ".join(_describe_statistics(statistics))
        parts.append(_draw_text(frame.left, frame.margin + 52, line, size=15, fill=_SOFT))
    return join(parts)


def _describe_statistics(statistics: MapStatistics) -> list[str]:
    def km(length: float) -> str:
        return f"{number(length / 1000.0, 1 if length >= 10_000 else 2)} km"

    low_x, low_y, high_x, high_y = statistics.bounds
    counts = (
        (statistics.junctions, "junction"),
        (statistics.crosswalks, "crosswalk"),
        (statistics.traffic_lights, "traffic light"),
        (statistics.stop_signs, "stop sign"),
        (statistics.yield_signs, "yield sign"),
    )
    sides = {"RHT": "right-hand traffic", "LHT": "left-hand traffic", "mixed": "mixed sides"}
    return [
        f"{high_x - low_x:,.0f} × {high_y - low_y:,.0f} m",
        f"{km(statistics.driving_lane_length)} of driving lanes",
        *(f"{count} {word}{'' if count == 1 else 's'}" for count, word in counts if count),
        sides[statistics.rule],
    ]


def round_length(limit: float) -> float:
    """Largest of 1, 2 or 5 times a power of ten that is not above ``limit``."""
    from math import floor, log10

    power = 10.0 ** floor(log10(limit))
    return max(f * power for f in (1.0, 2.0, 5.0) if f * power <= limit * (1 + 1e-9))


def length_text(metres: float) -> str:
    """``"200 m"`` or ``"2 km"``."""
    return f"{number(metres / 1000.0)} km" if metres >= 1000.0 else f"{number(metres)} m"


def _scale_bar(frame: _SheetFrame) -> Markup:
    length = round_length(190.0 / frame.scale)
    right = frame.width - frame.margin - 60
    wide = length * frame.scale
    y = frame.margin + 20
    halves = element("rect", x=right - wide, y=y, width=wide, height=7.0, fill=_PAPER, stroke=INK)
    halves += element("rect", x=right - wide, y=y, width=wide / 2, height=7.0, fill=INK)
    parts = [halves]
    for share in (0.0, 0.5, 1.0):
        text = number(length * share, 3) if share < 1.0 else length_text(length)
        if length >= 1000.0 and share < 1.0:
            text = number(length * share / 1000.0, 3)
        x = right - wide + share * wide
        parts.append(_draw_text(x, y - 7, text, size=13, fill=_SOFT, text_anchor="middle"))
    return join(parts)


def _draw_north_arrow(x: float, y: float) -> Markup:
    centre, tip = number(x), number(y - 24)
    low, notch = number(y + 18), number(y + 10)
    left = element("path", d=f"M{centre} {tip}L{number(x - 11)} {low}L{centre} {notch}z")
    data = f"M{centre} {tip}L{number(x + 11)} {low}L{centre} {notch}z"
    right = element("path", d=data, fill=_PAPER)
    arrow = element("g", left, right, fill=INK, stroke=INK, stroke_linejoin="round")
    return arrow + _draw_text(x, y + 34, "N", size=13, font_weight="700", text_anchor="middle")


@dataclass(frozen=True, slots=True, repr=False)
class Picture:
    """A drawing that notebooks show, and that can be saved.

    Attributes
    ----------
    svg
        The whole SVG document; it has no scripts, and nothing in it is from elsewhere.
    """

    svg: str

    def __repr__(self) -> str:
        return f"<Picture: SVG of {len(self.svg) / 1000:.0f} kB>"

    def _repr_svg_(self) -> str:
        return self.svg

    def save(self, path: GivenPath) -> Path:
        """Write it to a file.

        Parameters
        ----------
        path
            With ``.svg``, or ``.png`` (2,400 pixels wide).

        Returns
        -------
        Path
            The file.

        Raises
        ------
        InputError
            If the file has another ending.
        MissingDependencyError
            If a PNG is wanted without ``odscen[png]``.
        WorkspaceError
            If it cannot be written.
        """
        file = as_path(path)
        if file.suffix == ".svg":
            return write_text(file, self.svg)
        if file.suffix == ".png":
            return write_file(file, svg_to_png(self.svg))
        raise InputError("a picture is a file .svg or .png", file=str(file))


def svg_to_png(svg: str, *, width: int = 2400) -> bytes:
    """Turn an SVG document into a PNG picture.

    Parameters
    ----------
    width
        Pixels.

    Raises
    ------
    MissingDependencyError
        If ``cairosvg``, or the cairo library it needs, is not installed.
    """
    try:
        import cairosvg
    except (ImportError, OSError) as error:
        raise MissingDependencyError(
            "drawing PNG needs the package cairosvg and the cairo library: "
            "pip install 'odscen[png]' (and on Debian or Ubuntu: apt install libcairo2); "
            "SVG needs neither"
        ) from error
    png: bytes = cairosvg.svg2png(bytestring=svg.encode(), output_width=width, unsafe=False)
    return png
