"""From SUMO's log of conflicts and the trajectories to ``conflicts.parquet``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.figures.measures.conflicts import conflict_table, walking_conflicts
from odscen.runs.layout import CONFLICTS_FILE, SSM_FILE, TRAJECTORIES_FILE
from odscen.sumo.outputs.ssm_log import logged_conflicts

if TYPE_CHECKING:
    from pathlib import Path

    import polars as pl

    from odscen.records.run_plan import Plan

_NAMES = {
    "timestep_time": "time",
    "vehicle_id": "id",
    "vehicle_x": "x",
    "vehicle_y": "y",
    "vehicle_angle": "angle",
}


def tidy_conflicts(folder: Path, plan: Plan) -> None:
    """Replace SUMO's log in ``folder``, if there is one, by the table of all conflicts.

    Raises
    ------
    SimulationError
        If the log is not whole.
    """
    log = folder / SSM_FILE
    if not log.is_file():
        return
    rows = [*logged_conflicts(log, net_offset=plan.net_offset), *_walking_conflicts(folder, plan)]
    conflict_table(rows).write_parquet(folder / CONFLICTS_FILE)
    log.unlink()


def _walking_conflicts(folder: Path, plan: Plan) -> list[dict[str, object]]:
    """Conflicts of people on foot; none if not every step was recorded."""
    import polars as pl

    file = folder / TRAJECTORIES_FILE
    if not file.is_file() or not any(actor.person for actor in plan.actors):
        return []
    traces = _read_traces(pl.scan_parquet(file), plan.net_offset)
    steps = traces["time"].unique().sort().diff().drop_nulls()
    if not len(steps) or float(steps.median() or 0.0) > 1.5 * plan.step_length:  # type: ignore[arg-type]
        return []
    return walking_conflicts(traces, plan.actors)


def _read_traces(rows: pl.LazyFrame, offset: tuple[float, float]) -> pl.DataFrame:
    import polars as pl

    return (
        rows.select(pl.col(old).alias(new) for old, new in _NAMES.items())
        .filter(pl.col("x").is_finite())
        .with_columns(
            pl.col("time").cast(pl.Float64), pl.col("x") - offset[0], pl.col("y") - offset[1]
        )
        .collect()
    )
