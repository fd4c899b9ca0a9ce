"""Where the places of a map lie: what is coloured when figures are drawn by place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from odscen.drawing.map_drawing import Lines

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.arrays import FloatArray
    from odscen.lanegraph.graphs import MapGraph


_TOLERANCE = 0.5
"""Metres by which a drawn lane may leave its centre."""


@dataclass(frozen=True, slots=True, eq=False)
class PlaceShapes:
    """Segments and junctions as lines and points, OpenDRIVE frame, metres.

    Attributes
    ----------
    segments
        The centres of the lanes of each road segment.
    junctions
        Middle of each junction.
    """

    segments: Mapping[str, Lines]
    junctions: Mapping[str, FloatArray]

    @property
    def points(self) -> FloatArray:
        """Every point of the shapes, shape ``(N, 2)``."""
        lines = [lines.xy for lines in self.segments.values()]
        middles = [middle[np.newaxis] for middle in self.junctions.values()]
        return np.concatenate([np.empty((0, 2)), *lines, *middles])


def place_shapes(graph: MapGraph) -> PlaceShapes:
    """Shapes of all places of a map on which vehicles drive."""
    import shapely

    lanes, segments = graph.lanes, graph.segments
    xy = np.column_stack([lanes.x, lanes.y])
    junction = np.array([kind == "junction" for kind in segments.kinds])
    # Nodes are in the order of their lanes: a piece ends where lane or segment changes.
    begins = np.flatnonzero(
        np.concatenate(
            ([True], (np.diff(lanes.lane) != 0) | (np.diff(lanes.segment) != 0))[: len(xy)]
        )
    )
    ends = np.append(begins[1:], len(xy))
    pieces: dict[str, list[FloatArray]] = {}
    for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
        row = int(lanes.segment[begin])
        if junction[row]:
            continue
        # The next node of the lane, in the segment behind, closes the gap between two pieces.
        same_lane = end < len(xy) and lanes.lane[end] == lanes.lane[begin]
        piece = xy[begin : end + same_lane]
        if len(piece) > 1:
            line = shapely.simplify(shapely.LineString(piece), _TOLERANCE)
            pieces.setdefault(segments.ids[row], []).append(shapely.get_coordinates(line))
    middles = {
        str(name): xy[lanes.segment == row].mean(axis=0)
        for row, name in enumerate(segments.ids)
        if junction[row] and (lanes.segment == row).any()
    }
    return PlaceShapes({name: _lines(parts) for name, parts in pieces.items()}, middles)


def _lines(parts: list[FloatArray]) -> Lines:
    start = np.cumsum([0, *(len(part) for part in parts)])
    return Lines(np.concatenate(parts), start)
