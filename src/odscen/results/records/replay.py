"""A recorded run as columns, for a player: who was where at each time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.frames import SumoPose, sumo_to_xodr

if TYPE_CHECKING:
    import polars as pl

    from odscen.results.records.run_records import Plan


def replay_columns(trajectories: pl.DataFrame, plan: Plan, *, every: int = 1) -> dict[str, Any]:
    """Columns of what SUMO recorded; rows sorted by time.

    Parameters
    ----------
    trajectories
        As read from ``trajectories.parquet``.
    every
        Take each ``every``-th step.

    Returns
    -------
    ``times`` of shape ``(T,)``; ``first`` of shape ``(T + 1,)``, the rows of time ``i`` being
    ``first[i]`` up to ``first[i + 1]``; ``actor`` (row of the plan), ``x``, ``y``, ``hdg``, and
    ``speed`` of shape ``(R,)``: body centres in the OpenDRIVE frame, metres, radians, m/s.
    """
    import polars as pl

    columns = trajectories.columns
    prefix = next((p for p in ("vehicle_", "person_", "") if f"{p}x" in columns), None)
    clock = next((name for name in ("timestep_time", "time") if name in columns), None)
    if prefix is None or clock is None:
        return _columns(
            np.zeros(0), np.zeros(1, np.int64), np.zeros(0, np.int64), *[np.zeros(0)] * 4
        )
    index = {actor.id: row for row, actor in enumerate(plan.actors)}
    names = {"id": f"{prefix}id", "x": f"{prefix}x", "y": f"{prefix}y"}
    names |= {"angle": f"{prefix}angle", "speed": f"{prefix}speed", "time": clock}
    rows = (
        trajectories.select(pl.col(old).alias(new) for new, old in names.items())
        .filter(pl.col("id").is_in(list(index)) & pl.all_horizontal(pl.col("x", "y").is_finite()))
        .sort("time", maintain_order=True)
    )
    times, number = np.unique(rows["time"].to_numpy().astype(np.float64), return_inverse=True)
    kept = number % every == 0
    rows, number, times = rows.filter(pl.Series(kept)), number[kept] // every, times[::every]
    actor = np.array([index[name] for name in rows["id"].to_list()], dtype=np.int64)
    length = np.array([one.length for one in plan.actors], dtype=np.float64)
    x, y, angle, speed = (
        rows[name].to_numpy().astype(np.float64) for name in ("x", "y", "angle", "speed")
    )
    pose = sumo_to_xodr(
        SumoPose(x, y, 0.0, angle), length=length[actor], net_offset=plan.net_offset
    )
    first = np.searchsorted(number, np.arange(len(times) + 1))
    return _columns(
        times, first, actor, np.asarray(pose.x), np.asarray(pose.y), np.asarray(pose.hdg), speed
    )


def _columns(
    times: np.ndarray,
    first: np.ndarray,
    actor: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    hdg: np.ndarray,
    speed: np.ndarray,
) -> dict[str, Any]:
    """Round to the centimetre, to 1e-4 rad and to 0.01 m/s, which no screen shows."""
    return {
        "times": np.round(times, 3),
        "first": first,
        "actor": actor,
        "x": np.round(x, 2),
        "y": np.round(y, 2),
        "hdg": np.round(hdg, 4),
        "speed": np.round(speed, 2),
    }
