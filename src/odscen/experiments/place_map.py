"""A map on which places are coloured by what figures say of them: for pages that compare."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.markup import Markup, element, path_data
from odscen.reports.report_maps import fitted_view, scale_bar, view_box

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.arrays import FloatArray
    from odscen.reports.report_maps import PlaceShapes

PlaceStyles = dict[tuple[str, str], tuple[str, str]]
"""Class and words of each place, by kind and name."""

IDLE = ("los-none", "too few vehicles")


def place_map(
    shapes: PlaceShapes,
    styles: PlaceStyles,
    *,
    title: str,
    names: Mapping[str, str],
    text: float = 0.017,
) -> Markup | None:
    """Draw segments as lines and junctions as discs; ``None`` if there is nothing to draw.

    Parameters
    ----------
    styles
        Of the places with a colour; the others are idle.
    names
        Labels of the places that have one.
    text
        Height of the labels, a share of the map's extent.
    """
    bounds = fitted_view(shapes.points, None)
    if bounds is None:
        return None
    extent = max(bounds[2] - bounds[0], bounds[3] - bounds[1])
    size = round(100 * extent * text)
    parts, labels = [], []
    for name, lines in shapes.segments.items():
        style, words = styles.get(("segment", name), IDLE)
        data = path_data(lines.xy * (1, -1), lines.start)
        about = element("title", f"{name}: {words}")
        parts.append(element("path", about, d=data, class_=style))
        if name in names:
            x, y = _middle_of_line(lines.xy[: int(lines.start[1])])
            labels.append(_draw_label(names[name], round(x * 100), round(-y * 100), size))
    width = round(100 * max(3.0, extent / 350.0))
    radius = round(100 * min(extent / 110.0, 10.0))
    discs = []
    for name, (x, y) in shapes.junctions.items():
        style, words = styles.get(("junction", name), IDLE)
        cx, cy = round(x * 100), round(-y * 100)
        about = element("title", f"{name}: {words}")
        discs.append(element("circle", about, cx=cx, cy=cy, r=radius, class_=style))
        if name in names:
            labels.append(_draw_label(names[name], cx, cy - round(radius * 1.4), size))
    return element(
        "svg",
        element("title", title),
        element("g", *parts, class_="change-roads", stroke_width=width),
        element("g", *discs, class_="los-discs", stroke_width=round(width / 5)),
        element("g", *labels, class_="place-names"),
        scale_bar(bounds),
        viewBox=view_box(bounds),
        class_="run-map",
        role="img",
    )


def _middle_of_line(line: FloatArray) -> tuple[float, float]:
    """Point half way along a polyline."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    x, y = (float(np.interp(along[-1] / 2.0, along, axis)) for axis in line.T)
    return x, y


def _draw_label(text: str, x: int, y: int, size: int) -> Markup:
    return element("text", text, x=x, y=y, font_size=size)
