"""What is recorded in a run folder: one file of a run in one piece, parts of a run in slices."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from odscen.base.stored_files import tables
from odscen.figures.measures.conflicts import conflicts_of_slices
from odscen.records.replay import BODY_CENTRE, SPEED_OF
from odscen.records.row_text import with_numbered_names
from odscen.runs.layout import (
    CALLS_FILE,
    CONFLICTS_FILE,
    LANE_SEGMENTS_FILE,
    LANES_FILE,
    LIGHT_STATES_FILE,
    RECORDED,
    STAYS_FILE,
    TRAJECTORIES_FILE,
    TRIPS_FILE,
    VISITS_FILE,
)

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import polars as pl

_TIME = "timestep_time"
_UNUSED = ("vehicle_z", "vehicle_angle")
"""Columns that no figure is made of."""


class Recorded(NamedTuple):
    """Trajectories as they were written; of ``every`` records of a road user the first.

    ``by_centres`` says that speeds are those of body centres: of runs that SUMO did not record.
    """

    rows: pl.DataFrame
    every: int = 1
    by_centres: bool = False


def recorded_files(run: Path, file: str) -> list[Path]:
    """Parquet files of one thing that a run records, in order of time; empty if there are none.

    Those of a run in slices are alike and read as one table: ``polars.scan_parquet(files)``, DuckDB
    ``'RUN/trajectories/*.parquet'``.

    Parameters
    ----------
    file
        Of :data:`odscen.runs.layout.RECORDED`: its name in the folder of a run in one piece.
    """
    path = run / file
    return [path] if path.is_file() else sorted((run / RECORDED[file]).glob("part-*.parquet"))


def trajectory_files(run: Path) -> list[Path]:
    """Parquet files of the trajectories; empty if none were recorded, or no road user was there."""
    return recorded_files(run, TRAJECTORIES_FILE)


IN_MEMORY = 32 << 20
"""Bytes of trajectories that are read once and kept, instead of each time that they are used.

Some two million rows, of 44 bytes each.
"""


def scan_trajectories(run: Path) -> pl.LazyFrame | None:
    """Trajectories to compute with; ``None`` if none were recorded, or no road user was there.

    Names of those that are kept are numbered, see
    :mod:`odscen.records.row_text`, and without what figures are not made of.
    """
    import polars as pl

    files = trajectory_files(run)
    if not files:
        return None
    table = pl.scan_parquet(files).drop(_UNUSED, strict=False)
    if sum(file.stat().st_size for file in files) > IN_MEMORY:
        return table
    return with_numbered_names(table.collect()).lazy()


def read_trajectories(run: Path, *, most: int | None = None) -> Recorded | None:
    """Read what was recorded.

    Parameters
    ----------
    most
        Rows; of a run that has more every second, third, ... record is left out.

    Returns
    -------
    ``None`` if nothing was recorded.

    Raises
    ------
    InputError
        If a file is no table, as may be in a run without checksums.
    """
    import polars as pl

    files = trajectory_files(run)
    if not files:
        return None
    with tables(_name_of_records(files)):
        table = pl.scan_parquet(files)
        count = table.select(pl.len()).collect().item()
        by_centres = pl.read_parquet_metadata(files[0]).get(SPEED_OF) == BODY_CENTRE
        if most is None or count <= most or _TIME not in table.collect_schema():
            return Recorded(table.collect(), by_centres=by_centres)
        every = -(-count // most)
        times = table.select(pl.col(_TIME).unique().sort()).collect(engine="streaming")[_TIME]
        kept = times.gather_every(every)
        rows = table.join(kept.to_frame().lazy(), on=_TIME, how="semi", maintain_order="left")
        return Recorded(rows.collect(engine="streaming"), every, by_centres)


def read_lanes(run: Path) -> pl.DataFrame | None:
    """Read what was measured on each lane and interval, sorted by ``begin`` and ``lane``.

    Columns as in :mod:`odscen.sumo.outputs.output_tables`.

    Returns
    -------
    ``None`` if nothing was recorded, or no vehicle was there.
    """
    return _read_recorded(run, LANES_FILE)


def read_lane_segments(run: Path) -> pl.DataFrame | None:
    """Read what a run without trajectories has summed up on parts of lanes.

    Columns as of :func:`odscen.figures.by_place.lane_parts.part_sums`.

    Returns
    -------
    ``None`` if that was not recorded.
    """
    return _read_recorded(run, LANE_SEGMENTS_FILE)


def read_trips(run: Path) -> pl.DataFrame | None:
    """Read the trips of vehicles and persons in order of arrival, the unfinished last.

    Columns as in :mod:`odscen.sumo.outputs.output_tables`.

    Returns
    -------
    ``None`` if nothing was recorded, or no road user was there.
    """
    return _read_recorded(run, TRIPS_FILE)


def read_conflicts(run: Path) -> pl.DataFrame | None:
    """Read who came close to whom, see :func:`odscen.figures.measures.conflicts.conflict_table`.

    Returns
    -------
    ``None`` if nothing was recorded.
    """
    import polars as pl

    files = recorded_files(run, CONFLICTS_FILE)
    with tables(_name_of_records(files)):
        return conflicts_of_slices([pl.read_parquet(file) for file in files]) if files else None


def read_light_states(run: Path) -> pl.DataFrame | None:
    """Read what each light showed: columns of :mod:`odscen.sumo.outputs.signal_log`.

    Returns
    -------
    Sorted by light and time, each row another state or program than the one before; ``None`` if the
    map has no lights.
    """
    import polars as pl

    states = _read_recorded(run, LIGHT_STATES_FILE)
    if states is None:
        return None
    shown = pl.struct("program", "state")
    with tables(str(run / LIGHT_STATES_FILE)):
        return states.sort("light", "time", maintain_order=True).filter(
            (shown != shown.shift(1).over("light")).fill_null(value=True)
        )


def read_calls(run: Path) -> pl.DataFrame | None:
    """Read when which detector saw somebody: ``detector``, ``begin`` and ``end``, s.

    Returns
    -------
    Sorted by detector and time; ``None`` if no light has detectors. Who is there when a slice ends
    is in two rows.
    """
    return _read_recorded(run, CALLS_FILE)


def read_visits(run: Path) -> pl.DataFrame | None:
    """Read who was at which stop when: columns of :mod:`odscen.sumo.outputs.output_tables`.

    Returns
    -------
    In order of departure; ``None`` if the scenario has no lines.
    """
    return _read_recorded(run, VISITS_FILE)


def read_stays(run: Path) -> pl.DataFrame | None:
    """Read which car was in which parking area when.

    Returns
    -------
    Columns of :func:`odscen.sumo.outputs.output_tables.stay_table`, in order of arrival;
    ``None`` if no trip of the scenario parks.
    """
    stays = _read_recorded(run, STAYS_FILE)
    return None if stays is None else stays.sort("arrival", "actor")


def _read_recorded(run: Path, file: str) -> pl.DataFrame | None:
    import polars as pl

    files = recorded_files(run, file)
    with tables(_name_of_records(files)):
        return pl.read_parquet(files) if files else None


def _name_of_records(files: Sequence[Path]) -> str:
    """What a file is called that cannot be read: its path, or the folder of several."""
    return str(files[0] if len(files) == 1 else files[0].parent) if files else ""
