"""Where safe cases end: lines half-way between neighbours that are safe and not."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray


def safe_boundary(points: FloatArray, safe: BoolArray) -> FloatArray:
    """Find the boundary between safe cases and others in the plane of two parameters.

    Neighbours are those of a Delaunay triangulation with both parameters stretched to the same
    length; each stretch of the boundary joins the middles of two edges between a safe case and
    another.

    Parameters
    ----------
    points
        Shape ``(N, 2)``: values of the parameters; rows that are equal count once, as not safe if
        one of them is not.
    safe
        Shape ``(N,)``.

    Returns
    -------
    Shape ``(S, 2, 2)``: ends of the stretches, in the units of the parameters.
    """
    none = np.empty((0, 2, 2))
    points, where = np.unique(points, axis=0, return_inverse=True)
    merged = np.ones(len(points), dtype=bool)
    np.logical_and.at(merged, where.ravel(), safe)
    span = np.ptp(points, axis=0) if len(points) else np.zeros(2)
    if len(points) < 3 or merged.all() or not merged.any() or (span == 0).any():
        return none
    from scipy.spatial import Delaunay, QhullError

    try:
        triangles = Delaunay((points - points.min(axis=0)) / span).simplices
    except QhullError:  # all on one line
        return none
    stretches = []
    for triangle in triangles[np.lexsort(triangles.T[::-1])]:
        pairs = ((triangle[a], triangle[b]) for a, b in ((0, 1), (1, 2), (0, 2)))
        middles = [(points[a] + points[b]) / 2.0 for a, b in pairs if merged[a] != merged[b]]
        if len(middles) == 2:
            stretches.append(middles)
    return np.array(stretches) if stretches else none
