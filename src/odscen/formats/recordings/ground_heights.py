"""Heights of the ground below road users: SUMO's networks are flat unless asked for heights."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    import polars as pl

    from odscen.base.arrays import FloatArray
    from odscen.sumo.realize.sumo_map import SumoMap


def ground_heights(
    sumo_map: SumoMap, rows: pl.DataFrame, lengths: Mapping[str, float]
) -> FloatArray:
    """Height of the map below the middle of each body, shape ``(N,)``, metres.

    On a SUMO lane between the nodes of the lane graph that lie on it, by position along it, so that
    it is right where roads cross on two levels; elsewhere that of the nearest node.

    Parameters
    ----------
    rows
        Trajectories: ``x`` and ``y`` of the middle, perhaps ``lane`` and ``pos`` of the front.
    lengths
        Of each body by ``id``, metres.
    """
    from scipy.spatial import cKDTree

    graph, places = sumo_map.graph, sumo_map.lane_places
    xy = np.column_stack([rows["x"].to_numpy(), rows["y"].to_numpy()])
    nodes = np.concatenate(
        [np.column_stack([part.x, part.y, part.z]) for part in (graph.lanes, graph.walks)]
    )
    if not len(nodes):
        return np.zeros(len(xy))
    heights: FloatArray = nodes[cKDTree(nodes[:, :2]).query(xy)[1], 2]
    if "lane" not in rows.columns or "pos" not in rows.columns:
        return heights
    row_of = {name: row for row, name in enumerate(places.lanes)}
    names, which = np.unique(rows["lane"].fill_null("").to_numpy(), return_inverse=True)
    lane = np.array([row_of.get(str(name), -1) for name in names], dtype=np.int64)[which]
    half = np.array([0.5 * lengths[str(name)] for name in rows["id"]])
    pos = rows["pos"].cast(float).fill_null(np.nan).to_numpy() - half
    for part in np.unique(lane[lane >= 0]).tolist():
        own = np.flatnonzero(places.lane == part)
        at = np.flatnonzero((lane == part) & np.isfinite(pos))
        if len(own) and len(at):
            own = own[np.argsort(places.pos[own], kind="stable")]
            heights[at] = np.interp(pos[at], places.pos[own], graph.lanes.z[own])
    return heights
