"""How much lines bend."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def largest_curvature(line: ArrayLike, window: float) -> float:
    """Find the most that a line turns within ``window`` metres, divided by these.

    Parameters
    ----------
    line
        Points, m, shape ``(N, 2)`` or ``(N, 3)`` of which x and y count.
    window
        Metres; a bend between two points of the line counts as one of that length.

    Returns
    -------
    float
        1/m; 0 of a line of fewer than three different points.
    """
    points = np.asarray(line, dtype=np.float64)[:, :2]
    steps = np.diff(points, axis=0)
    metres = np.hypot(steps[:, 0], steps[:, 1])
    steps, metres = steps[metres > 0.01], metres[metres > 0.01]
    if len(steps) < 2:
        return 0.0
    heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    along = np.cumsum(metres) - 0.5 * metres
    # The heading turns evenly from the middle of each step to that of the next.
    turned = np.abs(np.interp(along + window, along, heading) - heading)
    return float(turned.max() / window)
