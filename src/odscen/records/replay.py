"""A recorded run as columns, for a player: who was where at each time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.records.body_centres import body_centres

if TYPE_CHECKING:
    import polars as pl

    from odscen.records.run_plan import Plan


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

    rows = body_centres(trajectories, plan)
    times, number = np.unique(rows["time"].to_numpy(), return_inverse=True)
    kept = number % every == 0
    rows, number, times = rows.filter(pl.Series(kept)), number[kept] // every, times[::every]
    actor, x, y, hdg, speed = (rows[name].to_numpy() for name in ("row", "x", "y", "hdg", "speed"))
    first = np.searchsorted(number, np.arange(len(times) + 1))
    return _columns(times, first, actor, x, y, hdg, speed)


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
