"""What a bus takes up beside its path in a junction.

SUMO draws a body as the chord of its path: in a bend the middle lies inside of it, by the sagitta
of the arc.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray
    from odscen.convert.model.right_of_way import Movement

BUS_LENGTH = 12.0
"""Metres of the longest body that turns are made for."""

MOST_SWEPT = 4.0
"""Metres that are added to the width of an internal lane, at most."""

LEAST_BENT = 0.25
"""Metres that a path which goes straight on bends aside, from which on that is allowed for."""

_STRAIGHT = math.radians(30.0)
"""Turns of less than that go straight on."""

_STEP = 0.5
"""Metres between the places at which a body is looked at."""


def swept_width(movement: Movement, length: float) -> float:
    """Metres by which an internal lane is wider for a bus: SUMO keeps others off a lane's width.

    Half of what a lane is wider lies on the side of the flank: hence twice the sagitta.

    Parameters
    ----------
    length
        Metres of the path.
    """
    radius = length / max(abs(movement.turn), 1e-3)
    aside = max(BUS_LENGTH**2 / (8.0 * radius), bent_aside(movement))
    return min(2.0 * aside, MOST_SWEPT)


def bent_aside(movement: Movement) -> float:
    """Metres to which a bus that goes straight on over a bent path, as of an S, leaves it.

    0 for turns, for straight paths and for those that bend aside by less than ``LEAST_BENT``.
    """
    if abs(movement.turn) >= _STRAIGHT:
        return 0.0
    path = _with_ends(movement.shape[:, :2])
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))))
    places = np.arange(0.0, along[-1], _STEP)
    xy = np.column_stack([np.interp(places, along, path[:, k]) for k in (0, 1)])
    body = round(BUS_LENGTH / _STEP)
    deepest = max(_sagitta(xy[n : n + body + 1]) for n in range(len(xy) - body))
    return deepest if deepest >= LEAST_BENT else 0.0


def _with_ends(path: FloatArray) -> FloatArray:
    """Path ``(K, 2)`` with the length of a bus straight on before and behind it."""
    first, last = path[0] - path[1], path[-1] - path[-2]
    before = path[0] + first / np.hypot(*first) * BUS_LENGTH
    behind = path[-1] + last / np.hypot(*last) * BUS_LENGTH
    return np.vstack([before, path, behind])


def _sagitta(arc: FloatArray) -> float:
    """Metres to which an arc ``(K, 2)`` leaves its chord."""
    chord = arc[-1] - arc[0]
    offset = arc - arc[0]
    return float(np.abs(chord[0] * offset[:, 1] - chord[1] * offset[:, 0]).max() / np.hypot(*chord))
