"""A map of the catalogue drawn into a file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.catalog.render import RenderOptions, render_drawing, svg_to_png
from odscen.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.catalog.store import MapEntry


def draw_map(
    entry: MapEntry, out: Path, *, width: int, with_graph: bool, with_segments: bool = False
) -> None:
    """Write a drawing of a map as SVG or PNG, by the ending of ``out``.

    Raises
    ------
    InputError
        If the ending is another.
    MissingDependencyError
        For PNG, if ``cairosvg`` is not installed.
    """
    if out.suffix.lower() not in (".svg", ".png"):
        msg = f"a drawing is written as .svg or .png, not {out.suffix or 'without ending'}"
        raise InputError(msg, file=str(out))
    options = RenderOptions(graph=with_graph, segments=with_segments)
    graph = entry.graph() if with_graph or with_segments else None
    statistics = entry.statistics()
    svg = render_drawing(entry.drawing(), statistics=statistics, graph=graph, options=options)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        if out.suffix.lower() == ".png":
            out.write_bytes(svg_to_png(svg, width=width))
        else:
            out.write_text(svg, encoding="utf-8")
    except OSError as error:
        raise InputError(error.strerror or str(error), file=str(out)) from error
