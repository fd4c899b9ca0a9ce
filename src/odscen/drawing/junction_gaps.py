"""Gaps that the lanes of a junction leave between them.

OpenDRIVE says nothing of the surface between the lanes of a junction. Where so little of it is left
that no island would be built there, it is drawn as carriageway.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.drawing.furniture import rings_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from odscen.base.arrays import BoolArray, IntArray
    from odscen.drawing.map_drawing import Lines


SMALL = 15.0
"""Square metres up to which a gap is no island."""

_POLYGON = 3
"""shapely's number of the geometry type."""


def small_gaps(rings: Lines, junction: IntArray, road: BoolArray) -> Lines:
    """Rings of the small gaps of all junctions.

    Parameters
    ----------
    rings
        Outlines of lanes.
    junction
        Shape ``(K,)``: number of the junction that each ring lies in, or -1.
    road
        Shape ``(K,)``: whether it is carriageway. Bits of other lanes, as of bicycle lanes, that
        the carriageway and its gaps enclose are gaps as well.
    """
    import shapely

    rows = np.flatnonzero(junction >= 0)
    found: list[Any] = []
    for number in np.unique(junction[rows]).tolist():
        members = rows[junction[rows] == number]
        part = rings.take(members)
        index = np.repeat(np.arange(part.total), np.diff(part.start))
        try:
            outlines = shapely.linearrings(part.xy, indices=index)
            lanes = shapely.make_valid(shapely.polygons(outlines))
            gaps = _small_holes(lanes)
            if not road[members].all():
                gaps += _small_holes(np.concatenate([lanes[road[members]], np.array(gaps)]))
        except (shapely.errors.GEOSException, ValueError):
            continue  # a folded lane: the drawing does without the gaps beside it
        found += gaps
    return rings_of([shapely.get_coordinates(gap) for gap in found])


def _small_holes(polygons: NDArray[Any]) -> list[Any]:
    """Holes below :data:`SMALL` of the union of polygons, as polygons."""
    import shapely

    pieces = shapely.get_parts(shapely.union_all(polygons, grid_size=0.01))
    holes = [
        shapely.polygons(shapely.get_interior_ring(piece, k))
        for piece in pieces[shapely.get_type_id(pieces) == _POLYGON]
        for k in range(shapely.get_num_interior_rings(piece))
    ]
    return [hole for hole in holes if shapely.area(hole) < SMALL]
