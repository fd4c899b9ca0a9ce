"""What a replay in three dimensions lies on: drawing, heights and weather, for its script."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.lanegraph.node_heights import node_heights

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.arrays import Bounds
    from odscen.drawing.map_drawing import MapDrawing
    from odscen.lanegraph.graphs import LaneGraph, MapGraph, PedestrianGraph


def ground_values(
    drawing: MapDrawing, graph: MapGraph, weather: Mapping[str, float], bounds: Bounds
) -> dict[str, Any]:
    """Values of the script; of the map only what touches ``bounds``, m.

    Parameters
    ----------
    weather
        Parameters by the names that CARLA has for them.
    """
    lanes, walks = node_heights(graph)
    nodes = _node_columns(graph.lanes, lanes, bounds)
    beside = _node_columns(graph.walks, walks, bounds)
    return {
        "drawing": json.loads(drawing.clipped(bounds).to_json()),
        "heights": {"z": nodes.pop("z"), "walks": beside.pop("z")},
        "nodes": {**nodes, "walks": beside},
        "weather": dict(weather),
    }


def _node_columns(
    graph: LaneGraph | PedestrianGraph, z: np.ndarray, bounds: Bounds
) -> dict[str, list[float]]:
    """Places of nodes that have heights, to the centimetre and 1e-3 rad."""
    low_x, low_y, high_x, high_y = bounds
    x, y = graph.x, graph.y
    inside = (low_x <= x) & (x <= high_x) & (low_y <= y) & (y <= high_y)
    rows = np.flatnonzero(inside) if len(z) else np.empty(0, dtype=np.int64)
    columns = {"x": x, "y": y, "z": z} if len(z) else dict.fromkeys("xyz", np.empty(0))
    return {
        **{name: np.round(values[rows], 2).tolist() for name, values in columns.items()},
        "hdg": np.round(graph.hdg[rows], 3).tolist(),
    }
