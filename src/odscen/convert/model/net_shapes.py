"""Shapes that SUMO runs without, but netconvert and netedit need to keep a network as it is.

netconvert computes the shape of an edge and of what lies inside junctions anew, unless the edge has
one and connections have theirs (SUMO's NIImporter_SUMO).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray

_SHARPEST = 0.5
"""Cosine of half a bend: at sharper ones the border is cut short."""


class LinkPath(NamedTuple):
    """How a connection runs through its junction.

    Attributes
    ----------
    shape
        Shape ``(K, 3)``: all its internal lanes one after the other.
    speed
        m/s of the first of them.
    waits_at
        Metres to the place where vehicles wait within the junction; ``None`` if there is none.
    """

    shape: FloatArray
    speed: float
    waits_at: float | None


def border(shape: FloatArray, out: float) -> FloatArray:
    """Line ``out`` metres to the left of another one.

    netconvert spreads the lanes of an edge from its border towards the opposite direction.

    Parameters
    ----------
    shape
        Shape ``(K, 3)``, metres.

    Returns
    -------
    Shape ``(K, 3)``, metres.
    """
    steps = np.diff(shape[:, :2], axis=0)
    ahead = steps / np.maximum(np.hypot(*steps.T), 1e-9)[:, None]
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    before, after = np.concatenate([left[:1], left]), np.concatenate([left, left[-1:]])
    middle = before + after
    middle /= np.maximum(np.hypot(*middle.T), 1e-9)[:, None]
    bend = np.maximum(np.einsum("ij,ij->i", middle, after), _SHARPEST)
    line = shape.copy()
    line[:, :2] += middle * (out / bend)[:, None]
    return line
