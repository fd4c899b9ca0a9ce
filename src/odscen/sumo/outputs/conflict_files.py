"""From SUMO's log of conflicts and the trajectories to ``conflicts.parquet``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.errors import SimulationError
from odscen.figures.measures.conflicts import conflict_table, walking_conflicts
from odscen.runs.layout import CONFLICTS_FILE, SSM_FILE, TRAJECTORIES_FILE
from odscen.runs.xml_rows import elements

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import polars as pl
    from lxml import etree

    from odscen.records.run_plan import Plan


# --------------------------- the log of SUMO's SSM device; odscen.sumo.realize.sumocfg says what it
_KINDS = {
    **dict.fromkeys((1, 2, 3, 18), "following"),
    **dict.fromkeys((4, 5, 6, 7, 8, 19), "merging"),
}
"""By SUMO's number of the encounter; the others are of routes that cross."""

_MEASURES = {"minTTC": "ttc", "maxDRAC": "drac", "PET": "pet"}


def logged_conflicts(
    file: Path, *, net_offset: tuple[float, float] = (0.0, 0.0)
) -> Iterator[dict[str, object]]:
    """Rows for :func:`odscen.figures.measures.conflicts.conflict_table` from the device's log.

    Parameters
    ----------
    net_offset
        What SUMO's network adds to OpenDRIVE coordinates, metres.

    Raises
    ------
    SimulationError
        If the log is not whole.
    """
    from lxml import etree

    try:
        for conflict in elements(file, "conflict"):
            yield _conflict_row(conflict, net_offset)
    except etree.XMLSyntaxError as error:
        raise SimulationError(f"{file.name} is not whole: {error}") from error


def _conflict_row(conflict: etree._Element, net_offset: tuple[float, float]) -> dict[str, object]:
    row: dict[str, object] = {
        "begin": float(conflict.get("begin", "nan")),
        "end": float(conflict.get("end", "nan")),
        "one": conflict.get("ego"),
        "other": conflict.get("foe"),
        "kind": "crossing",
        "x": None,
        "y": None,
    }
    placed = False
    for measure in conflict:
        name = _MEASURES.get(str(measure.tag))
        value = measure.get("value", "NA")
        if name is None:
            continue
        row[name] = None if value == "NA" else float(value)
        if value != "NA" and not placed:
            row["kind"] = _KINDS.get(int(measure.get("type", "9")), "crossing")
            # Bodies that overlap from the start have a value, and `NA` for a place.
            position = measure.get("position", "NA").split(",")
            if len(position) > 1:
                row["x"] = float(position[0]) - net_offset[0]
                row["y"] = float(position[1]) - net_offset[1]
            placed = True
    return row


# --------------------------- from SUMO's log of conflicts and the trajectories to conflicts.parquet
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
