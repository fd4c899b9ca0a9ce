"""Shapes that SUMO runs without, but netconvert and netedit need to keep a network as it is.

netconvert computes the shape of an edge and of what lies inside junctions anew, unless the edge has
one and connections have theirs (SUMO's NIImporter_SUMO).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray
    from odscen.base.ids import SumoLaneId
    from odscen.convert.model.net import NetEdge, NetLane, NetLink

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


def link_paths(edges: Sequence[NetEdge], links: Sequence[NetLink]) -> dict[SumoLaneId, LinkPath]:
    """Paths of connections by their first internal lane."""
    lanes: dict[SumoLaneId, NetLane] = {lane.id: lane for edge in edges for lane in edge.lanes}
    of_edge = {edge.id: edge.lanes for edge in edges}
    beyond = {
        of_edge[link.source][link.source_lane].id: link.via
        for link in links
        if link.via is not None
    }
    found: dict[SumoLaneId, LinkPath] = {}
    for link in links:
        if link.via is None:
            continue
        first = lanes[link.via]
        second = beyond.get(first.id)
        if second is None:
            found[first.id] = LinkPath(first.shape, first.speed, None)
        else:
            shape = np.concatenate([first.shape, lanes[second].shape[1:]])
            found[first.id] = LinkPath(shape, first.speed, first.length)
    return found


def inner_border(lanes: Sequence[NetLane], *, lefthand: bool) -> FloatArray:
    """Border of an edge towards the opposite direction, from which netconvert spreads its lanes.

    Returns
    -------
    Shape ``(K, 3)``, metres.
    """
    shape, out = lanes[-1].shape, lanes[-1].width / 2.0
    steps = np.diff(shape[:, :2], axis=0)
    ahead = steps / np.maximum(np.hypot(*steps.T), 1e-9)[:, None]
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    before, after = np.concatenate([left[:1], left]), np.concatenate([left, left[-1:]])
    middle = before + after
    middle /= np.maximum(np.hypot(*middle.T), 1e-9)[:, None]
    bend = np.maximum(np.einsum("ij,ij->i", middle, after), _SHARPEST)
    border = shape.copy()
    border[:, :2] += middle * ((-out if lefthand else out) / bend)[:, None]
    return border
