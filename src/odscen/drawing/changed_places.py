"""Where two maps differ, as marks on the drawing of the map after."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.arrays import offsets
from odscen.drawing.map_drawing import Lines
from odscen.drawing.svg_layers import PlaceMarks

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray
    from odscen.changes.map_change import ChangePlace, MapChange
    from odscen.opendrive.lanes import RoadTable

_STEP = 2.0
_KINDS = (
    ("removed", "Removed", "#d6006c"),
    ("added", "Added", "#00894c"),
    ("changed", "Changed", "#0b6bcb"),
    ("moved", "Moved", "#7c3aed"),
)


def changed_places(
    changes: Sequence[MapChange], before: RoadTable, after: RoadTable
) -> list[PlaceMarks]:
    """Marks of changes by kind: lines along roads and lanes, rings around points.

    Parameters
    ----------
    changes
        Those without a place are left out.
    before, after
        The maps evaluated; what was added lies in the map after, all else in the map before.

    Returns
    -------
    list[PlaceMarks]
        Removed, added, changed, moved; each only if there is any.
    """
    marks = []
    for kind, name, color in _KINDS:
        table = after if kind == "added" else before
        places = [
            change.place for change in changes if change.kind == kind and change.place is not None
        ]
        points = [_line_of_place(table, place) for place in dict.fromkeys(places)]
        single = [xy for xy in points if len(xy) == 1]
        long = [xy for xy in points if len(xy) > 1]
        if points:
            xy = np.concatenate(single) if single else np.zeros((0, 2))
            lines = Lines(
                np.concatenate(long) if long else np.zeros((0, 2)), offsets(map(len, long))
            )
            marks.append(PlaceMarks(name, color, xy, lines))
    return marks


def _line_of_place(table: RoadTable, place: ChangePlace) -> FloatArray:
    """Points of a place, shape ``(N, 2)``, metres; one point for what has no length."""
    length = place.s1 - place.s0
    s = np.linspace(place.s0, place.s1, max(2, int(length / _STEP) + 1)) if length else [place.s0]
    at = np.asarray(s, dtype=np.float64)
    road = table.road_index[place.road]
    rows = np.full(at.size, road)
    if place.lane:
        sections = table.section_at(rows, np.minimum(at, np.nextafter(place.s1, -np.inf)))
        keys = [(place.road, int(section), place.lane) for section in sections]
        known = np.array([key in table.lane_index for key in keys])
        if known.any():
            lanes = np.array([table.lane_index[key] for key in keys if key in table.lane_index])
            points = table.lane_points(lanes, at[known])
            return np.stack([points.x, points.y], axis=1)
    t = table.lane_offset(rows, at) if place.t is None else np.full(at.size, place.t)
    x, y, _ = table.points(rows, at, t)
    return np.stack([x, y], axis=1)
