"""The trajectories in a run folder: one file of a run in one piece, parts of a run in slices."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from odscen.sumo.layout import TRAJECTORIES_FILE, TRAJECTORIES_FOLDER

if TYPE_CHECKING:
    from pathlib import Path

    import polars as pl

_TIME = "timestep_time"


class Recorded(NamedTuple):
    """Trajectories as SUMO wrote them; of ``every`` records of a road user the first."""

    rows: pl.DataFrame
    every: int = 1


def trajectory_files(run: Path) -> list[Path]:
    """Parquet files of a run, in order of time; empty if none were recorded, or nobody was there.

    Those of a run in slices are alike and read as one table: ``polars.scan_parquet(files)``, DuckDB
    ``'RUN/trajectories/*.parquet'``.
    """
    one = run / TRAJECTORIES_FILE
    return [one] if one.is_file() else sorted((run / TRAJECTORIES_FOLDER).glob("part-*.parquet"))


def read_trajectories(run: Path, *, most: int | None = None) -> Recorded | None:
    """Read what was recorded.

    Parameters
    ----------
    most
        Rows; of a run that has more every second, third, ... record is left out.

    Returns
    -------
    ``None`` if nothing was recorded.
    """
    import polars as pl

    files = trajectory_files(run)
    if not files:
        return None
    table = pl.scan_parquet(files)
    count = table.select(pl.len()).collect().item()
    if most is None or count <= most or _TIME not in table.collect_schema():
        return Recorded(table.collect())
    every = -(-count // most)
    times = table.select(pl.col(_TIME).unique().sort()).collect(engine="streaming")[_TIME]
    kept = times.gather_every(every)
    rows = table.join(kept.to_frame().lazy(), on=_TIME, how="semi", maintain_order="left")
    return Recorded(rows.collect(engine="streaming"), every)
