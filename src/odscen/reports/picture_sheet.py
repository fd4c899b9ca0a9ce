"""Pictures of a run from the plan and from another simulator's camera, side by side."""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.markup import Markup, element, path_data
from odscen.drawing.svg_layers import LayerOptions, map_layers
from odscen.reports.page_templates import render_page
from odscen.reports.report_maps import CATEGORIES, scale_bar, view_box

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import Bounds, FloatArray
    from odscen.drawing.map_drawing import MapDrawing


class SheetMoment(NamedTuple):
    """One instant of a run.

    Attributes
    ----------
    time
        Simulated seconds.
    bounds
        Part of the map that the camera sees on the ground, metres; north is up.
    poses
        Shape ``(N, 3)``: centres of bodies and headings, metres and radians.
    sizes
        Shape ``(N, 2)``: length and width, metres.
    categories, ids
        Of each road user.
    jpeg
        What the camera saw.
    """

    time: float
    bounds: Bounds
    poses: FloatArray
    sizes: FloatArray
    categories: tuple[str, ...]
    ids: tuple[str, ...]
    jpeg: bytes


def render_picture_sheet(
    moments: Sequence[SheetMoment], drawing: MapDrawing, *, scenario: str, shown_by: str
) -> str:
    """Write the page: for each instant the plan, and beside it what the camera saw.

    Parameters
    ----------
    shown_by
        The simulator that the camera is in.
    """
    rows = [
        (moment.time, _draw_plan(moment, drawing, number), _embed_picture(moment, shown_by))
        for number, moment in enumerate(moments)
    ]
    present = {category for moment in moments for category in moment.categories}
    return render_page(
        "picture_sheet.html.j2",
        title=f"{scenario} - the plan and {shown_by} side by side",
        scenario=scenario,
        shown_by=shown_by,
        pictures=True,
        rows=rows,
        legend=[(f"c-{key}", name) for key, name in CATEGORIES.items() if key in present],
    )


def corners_of(moment: SheetMoment) -> FloatArray:
    """Corners of all bodies, shape ``(N, 4, 2)``, metres."""
    along = np.column_stack([np.cos(moment.poses[:, 2]), np.sin(moment.poses[:, 2])])
    across = np.column_stack([-along[:, 1], along[:, 0]])
    signs = np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)]) / 2.0
    halves = signs[None] * moment.sizes[:, None]
    corners: FloatArray = (
        moment.poses[:, None, :2]
        + halves[..., :1] * along[:, None]
        + halves[..., 1:] * across[:, None]
    )
    return corners


def _draw_plan(moment: SheetMoment, drawing: MapDrawing, number: int) -> Markup:
    options = LayerOptions(symbol_size=2.0, prefix=f"map{number}-")
    bodies = [
        element(
            "path",
            element("title", f"{name} ({CATEGORIES[category].lower()})"),
            d=path_data(shape * (1.0, -1.0), np.array([0, 4]), closed=True),
            class_=f"c-{category} body",
        )
        for shape, category, name in zip(
            corners_of(moment), moment.categories, moment.ids, strict=True
        )
    ]
    return element(
        "svg",
        element("title", f"Plan at {moment.time:g} s"),
        element("g", map_layers(drawing.clipped(moment.bounds), options), class_="map"),
        *bodies,
        scale_bar(moment.bounds),
        viewBox=view_box(moment.bounds),
        class_="run-map",
        role="img",
    )


def _embed_picture(moment: SheetMoment, shown_by: str) -> Markup:
    data = base64.b64encode(moment.jpeg).decode("ascii")
    return element(
        "img",
        src=f"data:image/jpeg;base64,{data}",
        alt=f"What {shown_by}'s camera saw at {moment.time:g} s",
    )
