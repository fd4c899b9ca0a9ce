"""A map of the catalogue drawn into a file."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING, Protocol

import numpy as np

from odscen.base.arrays import offsets
from odscen.base.errors import InputError
from odscen.convert.verify.fidelity_result import NEAR
from odscen.drawing.legend import RenderOptions
from odscen.drawing.map_drawing import Lines
from odscen.drawing.map_sheet import Underlay, render_drawing, svg_to_png
from odscen.drawing.svg_layers import PlaceMarks

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from odscen.base.arrays import FloatArray
    from odscen.convert.verify.fidelity_result import Fidelity
    from odscen.maps.background import Background
    from odscen.maps.map_entry import MapEntry


_LINE_COLORS = ("#1667d9", "#0b8f4d", "#b832c7", "#00a7c4", "#a0742f", "#555555")
_PLACE_COLORS = ("#f0a202", "#d7263d")
_AROUND = 20.0
"""Metres around lines that are shown."""


class _Placed(Protocol):
    @property
    def x(self) -> float: ...
    @property
    def y(self) -> float: ...


def draw_map(
    entry: MapEntry,
    out: Path,
    *,
    width: int,
    with_graph: bool,
    with_segments: bool = False,
    background: Background | None = None,
) -> None:
    """Write a drawing of a map as SVG or PNG, by the ending of ``out``.

    A ``background`` lies under the roads, and is in the file.

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
    svg = render_drawing(
        entry.drawing(),
        statistics=statistics,
        graph=graph,
        options=options,
        underlay=None if background is None else _read_underlay(background),
    )
    _write_picture(svg, out, width=width)


def _read_underlay(background: Background) -> Underlay:
    return Underlay(
        background.read(),
        background.media_type,
        background.width,
        background.height,
        background.affine,
    )


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


def draw_lines_on_map(
    entry: MapEntry,
    lines: Mapping[str, Sequence[FloatArray]],
    places: Mapping[str, FloatArray],
    out: Path,
    *,
    width: int = 2400,
) -> None:
    """Write a drawing of the part of a map around lines and circled places, each by their kind.

    Parameters
    ----------
    lines, places
        By name of the kind, metres in the OpenDRIVE frame: polylines of shape ``(n, 2)``, and
        places of shape ``(N, 2)``.

    Raises
    ------
    InputError, MissingDependencyError
        As :func:`draw_map`.
    """
    _check_ending(out)
    nowhere = np.empty((0, 2))
    marks = [
        PlaceMarks(kind, color, nowhere, Lines(np.concatenate(each), offsets(map(len, each))))
        for (kind, each), color in zip(lines.items(), cycle(_LINE_COLORS), strict=False)
    ]
    marks += [
        PlaceMarks(kind, color, xy)
        for (kind, xy), color in zip(places.items(), cycle(_PLACE_COLORS), strict=False)
    ]
    all_of_them = np.concatenate([line for each in lines.values() for line in each])
    low, high = all_of_them.min(axis=0) - _AROUND, all_of_them.max(axis=0) + _AROUND
    view = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    _write_picture(render_drawing(entry.drawing(), view=view, marks=marks), out, width=width)


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
