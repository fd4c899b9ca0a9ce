"""A map of the catalogue drawn into a file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from odscen.base.errors import InputError
from odscen.convert.verify.fidelity_result import NEAR
from odscen.drawing.legend import RenderOptions
from odscen.drawing.map_sheet import render_drawing, svg_to_png
from odscen.drawing.svg_layers import PlaceMarks

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from odscen.convert.verify.fidelity_result import Fidelity
    from odscen.maps.map_entry import MapEntry


class _Placed(Protocol):
    @property
    def x(self) -> float: ...
    @property
    def y(self) -> float: ...


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
    _check_ending(out)
    options = RenderOptions(graph=with_graph, segments=with_segments)
    graph = entry.graph() if with_graph or with_segments else None
    statistics = entry.statistics()
    svg = render_drawing(entry.drawing(), statistics=statistics, graph=graph, options=options)
    _write_picture(svg, out, width=width)


def draw_fidelity(entry: MapEntry, fidelity: Fidelity, out: Path, *, width: int = 2400) -> None:
    """Write a drawing of a map with the places circled where its SUMO network departs from it.

    Raises
    ------
    InputError, MissingDependencyError
        As :func:`draw_map`.
    """
    _check_ending(out)
    svg = render_drawing(
        entry.drawing(), statistics=entry.statistics(), marks=_marks_of_departures(fidelity)
    )
    _write_picture(svg, out, width=width)


def _marks_of_departures(fidelity: Fidelity) -> list[PlaceMarks]:
    kinds: tuple[tuple[str, str, Sequence[_Placed]], ...] = (
        ("Lane not covered", "#d7263d", fidelity.gaps),
        ("Lane aside", "#b832c7", [far for far in fidelity.far_places if far.metres > NEAR]),
        ("Relation missing", "#1667d9", fidelity.missing),
        ("Relation invented", "#00a7c4", fidelity.invented),
        ("Sidewalk not covered", "#a0742f", fidelity.sidewalk_gaps),
        ("Crosswalk lost", "#f0a202", fidelity.lost_crosswalks),
        ("Unsafe green", "#0b8f4d", fidelity.unsafe_pairs),
    )
    return [
        PlaceMarks(name, color, np.array([(place.x, place.y) for place in places]))
        for name, color, places in kinds
        if places
    ]


def _check_ending(out: Path) -> None:
    if out.suffix.lower() not in (".svg", ".png"):
        raise InputError(
            f"a drawing is written as .svg or .png, not {out.suffix or 'without ending'}",
            file=str(out),
        )


def _write_picture(svg: str, out: Path, *, width: int) -> None:
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        if out.suffix.lower() == ".png":
            out.write_bytes(svg_to_png(svg, width=width))
        else:
            out.write_text(svg, encoding="utf-8")
    except OSError as error:
        raise InputError(error.strerror or str(error), file=str(out)) from error
