"""How far along its lane a vehicle is, from where it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import polars as pl

    from odscen.base.arrays import FloatArray
    from odscen.figures.by_place.facilities import NetFacts

NEEDED = ("timestep_time", "vehicle_id", "vehicle_lane", "vehicle_x", "vehicle_y", "vehicle_speed")
"""Columns of trajectories that positions are found from."""


def positions(rows: pl.DataFrame, facts: NetFacts) -> pl.Series:
    """Metres from the start of the lane to the front of the vehicle, for each row.

    The nearest place on the centre line of the lane, as SUMO itself has it where lines are longer
    or shorter than lanes.

    Parameters
    ----------
    rows
        ``lane``, ``x`` and ``y`` (m, SUMO's frame).
    """
    import numpy as np
    import polars as pl

    lengths = dict(facts.limits.select("lane", "length").rows())
    found = np.zeros(rows.height)
    points = np.column_stack([rows["x"].to_numpy(), rows["y"].to_numpy()])
    by_lane = rows.select("lane").with_row_index("row").group_by("lane").agg("row")
    for lane, numbers in zip(by_lane["lane"], by_lane["row"], strict=True):
        own = numbers.to_numpy()
        found[own] = _along(facts.shapes[lane], points[own]) * lengths[lane]
    return pl.Series("pos", found)


def _along(shape: FloatArray, points: FloatArray) -> FloatArray:
    """Share of a line ``(K, 2)`` up to the place on it that is nearest to each point."""
    import numpy as np

    starts, steps = shape[:-1], np.diff(shape, axis=0)
    metres = np.hypot(*steps.T)
    squares = np.maximum(metres**2, 1e-12)
    ends = np.concatenate(([0.0], np.cumsum(metres)))
    best, along = np.full(len(points), np.inf), np.zeros(len(points))
    for start, step, square, length, before in zip(
        starts, steps, squares, metres, ends[:-1], strict=True
    ):
        share = np.clip(((points - start) * step).sum(axis=1) / square, 0.0, 1.0)
        distance = np.hypot(*(points - start - share[:, None] * step).T)
        closer = distance < best
        best = np.where(closer, distance, best)
        along = np.where(closer, before + share * length, along)
    whole: FloatArray = along / max(float(ends[-1]), 1e-9)
    return whole
