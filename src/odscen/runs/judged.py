"""What verdicts on a run are made of, read from its folder."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.figures.judging.actor_measures import RunRecords
from odscen.figures.judging.lane_departure import DrivenLanes
from odscen.figures.measures.summary import actors_from_json
from odscen.records.replay import body_centres
from odscen.records.run_events import events_from_json
from odscen.records.run_plan import Plan
from odscen.runs import layout
from odscen.runs.net_facts import read_net_facts
from odscen.runs.recorded import read_conflicts, trajectory_files

if TYPE_CHECKING:
    from pathlib import Path

    import polars as pl


def read_judged(folder: Path) -> RunRecords:
    """Read outcomes, events and conflicts; speeds are read when they are asked for.

    Raises
    ------
    OSError
        If the run failed before it had any.
    """
    return RunRecords(
        actors_from_json((folder / layout.ACTORS_FILE).read_text(encoding="utf-8")),
        events_from_json((folder / layout.EVENTS_FILE).read_text(encoding="utf-8")),
        read_conflicts(folder),
        lambda actor: _read_speeds(folder, actor),
        lambda actor: _read_bodies(folder, actor),
        lambda: _read_lanes(folder),
    )


def _read_lanes(folder: Path) -> DrivenLanes | None:
    facts = read_net_facts(folder)
    if facts is None:
        return None
    plan = Plan.from_json((folder / layout.PLAN_FILE).read_text(encoding="utf-8"))
    offset = np.array(plan.net_offset)
    follows: dict[str, list[str]] = {}
    for lane, following in facts.follows.iter_rows():
        follows.setdefault(lane, []).append(following)
    shapes = {name: facts.shapes[name] - offset for name in facts.widths}
    return DrivenLanes(shapes, facts.widths, follows)


def _read_speeds(folder: Path, actor: str) -> pl.DataFrame | None:
    import polars as pl

    files = trajectory_files(folder)
    if not files:
        return None
    table = pl.scan_parquet(files)
    named = table.collect_schema().names()
    for kind in ("vehicle", "person"):
        if f"{kind}_speed" not in named:
            continue
        found = (
            table.filter(pl.col(f"{kind}_id") == actor)
            .select(time="timestep_time", speed=f"{kind}_speed")
            .cast(pl.Float64)
            .collect()
        )
        if not found.is_empty():
            return found
    return None


def _read_bodies(folder: Path, actor: str) -> pl.DataFrame | None:
    import polars as pl

    files = trajectory_files(folder)
    plan = Plan.from_json((folder / layout.PLAN_FILE).read_text(encoding="utf-8"))
    planned = next(
        (planned_actor for planned_actor in plan.actors if planned_actor.id == actor), None
    )
    if not files or planned is None:
        return None
    table = pl.scan_parquet(files)
    named = [name for name in table.collect_schema().names() if name in ("vehicle_id", "person_id")]
    if not named:
        return None
    ours = pl.any_horizontal(pl.col(name).cast(pl.String) == actor for name in named)
    found = body_centres(table.filter(ours).collect(), plan).select("time", "x", "y", "hdg")
    if found.is_empty():
        return None
    return found.with_columns(length=pl.lit(planned.length), width=pl.lit(planned.width))
