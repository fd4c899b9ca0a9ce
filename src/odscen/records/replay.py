"""A recorded run as columns, for a player: who was where at each time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.frames import SumoPose, sumo_to_xodr

if TYPE_CHECKING:
    import polars as pl

    from odscen.records.run_plan import Plan


_OPTIONAL = {"z": "z", "lane": "lane", "pos": "pos", "slope": "slope_deg"}


def body_centres(trajectories: pl.DataFrame, plan: Plan) -> pl.DataFrame:
    """Where the road users of a plan were.

    Parameters
    ----------
    trajectories
        As read from ``trajectories.parquet``.
    plan
        Gives the length of each body, its category, and the offset between the frames.

    Returns
    -------
    polars.DataFrame
        One row per road user and record, sorted by time; columns ``time``, ``id``, ``category``,
        ``row`` (of the plan), ``x``, ``y``, ``hdg``, ``speed``, and of ``z``, ``lane``, ``pos``,
        ``slope_deg`` those that were recorded. Rows without a place are left out.
    """
    import polars as pl

    columns = trajectories.columns
    prefix = next((p for p in ("vehicle_", "person_", "") if f"{p}x" in columns), None)
    clock = next((name for name in ("timestep_time", "time") if name in columns), None)
    if prefix is None or clock is None:
        return _empty_positions()
    names = {name: f"{prefix}{name}" for name in ("id", "x", "y", "angle", "speed")}
    names |= {ours: f"{prefix}{old}" for old, ours in _OPTIONAL.items() if prefix + old in columns}
    actors = pl.DataFrame(
        {
            "id": [actor.id for actor in plan.actors],
            "category": [str(actor.category) for actor in plan.actors],
            "length": [actor.length for actor in plan.actors],
        },
        schema={"id": pl.String, "category": pl.String, "length": pl.Float64},
    ).with_row_index("row")
    rows = (
        trajectories.select(
            pl.col(clock).cast(pl.Float64).alias("time"),
            *(pl.col(old).alias(new) for new, old in names.items()),
        )
        .with_columns(pl.col("x", "y", "angle", "speed").cast(pl.Float64))
        .filter(pl.all_horizontal(pl.col("x", "y").is_finite()))
        .join(actors, on="id", how="inner", maintain_order="left")
        .sort("time", maintain_order=True)
    )
    x, y, angle, length = (rows[name].to_numpy() for name in ("x", "y", "angle", "length"))
    pose = sumo_to_xodr(SumoPose(x, y, 0.0, angle), length=length, net_offset=plan.net_offset)
    extra = [name for name in _OPTIONAL.values() if name in rows.columns]
    return rows.with_columns(
        pl.col("row").cast(pl.Int64),
        x=np.asarray(pose.x),
        y=np.asarray(pose.y),
        hdg=np.asarray(pose.hdg),
    ).select("time", "id", "category", "row", "x", "y", "hdg", "speed", *extra)


def _empty_positions() -> pl.DataFrame:
    import polars as pl

    numbers = dict.fromkeys(("x", "y", "hdg", "speed"), pl.Float64)
    ids = {"time": pl.Float64, "id": pl.String, "category": pl.String, "row": pl.Int64}
    return pl.DataFrame(schema={**ids, **numbers})


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
    return _rounded_columns(times, first, actor, x, y, hdg, speed)


def _rounded_columns(
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
