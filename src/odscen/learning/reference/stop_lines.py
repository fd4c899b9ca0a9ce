"""How far before the end of a strip vehicles stop: where a crosswalk crosses it, before that."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.lanegraph.graphs import WalkKind

if TYPE_CHECKING:
    from odscen.base.arrays import FloatArray
    from odscen.lanegraph.graphs import LaneGraph, PedestrianGraph
    from odscen.learning.reference.road_strips import Strips

BEFORE_END = 14.0
"""Metres before the end of a strip in which a crosswalk belongs to its junction."""
_NEAR = 1.3
"""Metres from a crosswalk to the nodes that it lies on."""


def setbacks(lanes: LaneGraph, strips: Strips, walks: PedestrianGraph | None) -> FloatArray:
    """Metres from the end of its strip to where its last crosswalk begins, for each node, ``(N,)``.

    0 without a crosswalk near the end.
    """
    from scipy.spatial import cKDTree

    count = len(strips.ahead)
    near = np.flatnonzero(strips.on_road & (strips.to_end < BEFORE_END))
    if walks is None or not len(near):
        return np.zeros(count)
    crossing = np.flatnonzero(walks.kind == WalkKind.CROSSWALK)
    if not len(crossing):
        return np.zeros(count)
    share = np.linspace(0.0, 1.0, 13)
    one, other = walks.source[crossing], walks.target[crossing]
    places = [
        (along[one][:, None] * (1.0 - share) + along[other][:, None] * share).ravel()
        for along in (walks.x, walks.y)
    ]
    far, _ = cKDTree(np.column_stack(places)).query(np.column_stack([lanes.x[near], lanes.y[near]]))
    crossed = near[far < _NEAR]
    found = np.zeros(count)
    np.maximum.at(found, strips.root[crossed], strips.to_end[crossed] + 1.0)
    at_root: FloatArray = found[strips.root]
    return at_root
