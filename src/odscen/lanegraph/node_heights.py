"""Heights of the nodes of a map's graphs, as views in three dimensions take them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from odscen.lanegraph.graphs import MapGraph

_FLAT = 0.005
"""Metres between the highest and the lowest node of lanes of a map that is flat."""
_KERB = 0.3
"""Metres by which its walks may lie above these."""


def node_heights(graph: MapGraph) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Heights of nodes, m: of lanes and of walks; both without rows where all is on one level."""
    lanes, walks = graph.lanes.z, graph.walks.z
    if np.ptp(lanes) < _FLAT and (len(walks) == 0 or np.abs(walks - lanes[0]).max() < _KERB):
        return np.empty(0), np.empty(0)
    return lanes, walks
