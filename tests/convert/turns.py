"""Movements for tests of right of way and lights."""

from __future__ import annotations

import math

import numpy as np

from odscen.convert.model.right_of_way import Movement, Sign


def turn_left(source: str, target: str, xy: list[tuple[float, float]]) -> Movement:
    """Turn from lane 0 of one edge to lane 0 of another, along points in metres."""
    shape = np.array([(x, y, 0.0) for x, y in xy])
    into, out = (math.atan2(*(shape[n + 1] - shape[n])[1::-1]) for n in (0, -2))
    lanes = (source, 0), (target, 0)
    return Movement(*lanes, shape, 3.5, into, out, 13.9, Sign.NONE, False, frozenset())
