"""Trajectories made alike, so that the parts of a long run read as one table; room for a part.

SUMO names the columns after whatever comes first in a file, ``vehicle_x`` or ``person_x``, and
writes a file without columns if no road user is there.
"""

from __future__ import annotations

import shutil
from typing import TYPE_CHECKING

from odscen.base.errors import SimulationError
from odscen.runs.checkpoint import slice_size

if TYPE_CHECKING:
    from pathlib import Path

RESERVE = 1.5
"""Room that a slice must find, as a multiple of what the one before it took."""


def tidy_part(path: Path) -> None:
    """Give trajectories the columns that all have; remove a file without any road user.

    Raises
    ------
    SimulationError
        If it is not a whole Parquet file.
    """
    if not path.is_file():
        return
    import polars as pl

    try:
        columns = list(pl.read_parquet_schema(path))
    except (OSError, pl.exceptions.PolarsError) as error:
        raise SimulationError(
            f"SUMO has not written the trajectories to the end; the disk may be full: {error}"
        ) from error
    if "timestep_time" not in columns or len(columns) < 2:
        path.unlink()
        return
    names = {name: f"vehicle_{name.removeprefix('person_')}" for name in columns}
    names = {old: new for old, new in names.items() if old.startswith("person_")}
    if names:
        renamed = path.with_suffix(".renamed")
        pl.scan_parquet(path).rename(names).sink_parquet(renamed)
        renamed.replace(path)


def check_room(run: Path, before: int) -> None:
    """Make sure that the disk holds another slice like the one before.

    Parameters
    ----------
    before
        Number of the slice before.

    Raises
    ------
    SimulationError
        If not; nothing is torn then.
    """
    needed = int(RESERVE * slice_size(run, before))
    free = shutil.disk_usage(run).free
    if free < needed:
        raise SimulationError(
            f"the disk is nearly full: slice {before + 1} needs about "
            f"{needed / 1e6:,.0f} MB, {free / 1e6:,.0f} MB are free"
        )
