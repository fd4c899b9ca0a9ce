"""Where a run was fast and where it stood: figures per segment and per junction.

Vehicles only. A vehicle is in the segment of the lane-graph node nearest to its front on the same
SUMO lane; on the short lanes that have no node, the nearest of all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import polars as pl

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

STANDS = 0.1
"""m/s; slower counts as standing, as in SUMO's ``waitingTime``."""

_APART = 1e6
"""Metres put between the lanes in the search, so that a node of another lane is never nearest."""


@dataclass(frozen=True, slots=True, eq=False)
class PlaceIndex:
    """Nodes of the lane graph on the SUMO network.

    Attributes
    ----------
    xy
        Shape ``(N, 2)``, metres, SUMO's frame.
    lane
        Row of ``lanes`` per node, shape ``(N,)``; -1 where SUMO has no lane.
    lanes
        SUMO lane ids.
    segment
        Row of ``segments`` per node, shape ``(N,)``.
    segments
        Segment ids.
    junction
        Per segment, whether it is a junction.
    """

    xy: FloatArray
    lane: NDArray[np.integer]
    lanes: Sequence[str]
    segment: NDArray[np.integer]
    segments: Sequence[str]
    junction: Sequence[bool]

    def segments_at(self, lane: Sequence[str | None], xy: FloatArray) -> IntArray:
        """Rows of the segments of places ``xy``, shape ``(M, 2)``, on the lanes named."""
        from scipy.spatial import cKDTree

        row_of = {name: row for row, name in enumerate(self.lanes)}
        row = np.array([row_of.get(name, -1) if name else -1 for name in lane], dtype=np.int64)
        has_nodes = np.zeros(len(self.lanes) + 1, dtype=np.bool_)
        has_nodes[self.lane] = True
        has_nodes[-1] = False
        on_lane = has_nodes[row]
        found = np.empty(len(row), dtype=np.int64)
        by_lane = cKDTree(np.column_stack([self.xy, self.lane * _APART]))
        found[on_lane] = by_lane.query(np.column_stack([xy, row * _APART])[on_lane])[1]
        found[~on_lane] = cKDTree(self.xy).query(xy[~on_lane])[1]
        return np.asarray(self.segment, dtype=np.int64)[found]


def figures_by_place(
    trajectories: pl.DataFrame, vehicles: Mapping[str, str], index: PlaceIndex
) -> dict[tuple[str, str], dict[str, float]]:
    """Figures per ``("segment", id)`` and ``("junction", id)``.

    Segments: ``vehicles`` that passed, ``mean_speed`` (space mean) and ``v85`` (speed that 85 % of
    all records stay below, m/s). Junctions: ``vehicles``, and ``waiting_time``, the seconds that
    one of them stood on its way from the junction before, or its start, through this one.

    Parameters
    ----------
    trajectories
        As read from ``trajectories.parquet``.
    vehicles
        Category by id, of the actors to count.
    """
    import polars as pl

    needed = ("timestep_time", "vehicle_id", "vehicle_x", "vehicle_y", "vehicle_speed")
    if any(name not in trajectories.columns for name in (*needed, "vehicle_lane")):
        return {}
    rows = trajectories.filter(
        pl.col("vehicle_id").is_in(list(vehicles)) & pl.col("vehicle_x").is_finite()
    )
    if rows.is_empty():
        return {}
    step = rows.select(pl.col("timestep_time").unique().sort().diff().min()).item() or 0.0
    segment = index.segments_at(
        rows["vehicle_lane"].to_list(), rows.select("vehicle_x", "vehicle_y").to_numpy()
    )
    crossing = np.where(np.asarray(index.junction)[segment], segment, -1)
    rows = rows.select(
        pl.col("vehicle_id").alias("id"),
        pl.col("timestep_time").alias("time"),
        pl.col("vehicle_speed").cast(pl.Float64).alias("speed"),
        pl.Series("segment", segment),
        pl.Series("junction", crossing),
    ).sort("id", "time")
    found = {
        ("segment", index.segments[row]): {"vehicles": float(n), "mean_speed": mean, "v85": v85}
        for row, n, mean, v85 in rows.group_by("segment", maintain_order=True)
        .agg(
            pl.col("id").n_unique().alias("vehicles"),
            pl.col("speed").mean().alias("mean_speed"),
            pl.col("speed").quantile(0.85, "linear").alias("v85"),
        )
        .iter_rows()
    }
    ahead = pl.when(pl.col("junction") >= 0).then(pl.col("junction")).backward_fill().over("id")
    waits = (
        rows.with_columns(ahead.alias("ahead"))
        .drop_nulls("ahead")
        .group_by("ahead", maintain_order=True)
        .agg(pl.col("id").n_unique(), (pl.col("speed") < STANDS).sum().alias("standing"))
    )
    for row, passed, standing in waits.iter_rows():
        figures = {"vehicles": float(passed), "waiting_time": standing * float(step) / passed}
        found["junction", index.segments[row]] = figures
    return found
