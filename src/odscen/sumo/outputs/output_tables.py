"""What SUMO writes while it runs, put into a folder and made into the tables that we keep.

The configuration names all of it, so that plain ``sumo -c`` records the same beside it.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from odscen.base.errors import SimulationError
from odscen.results.measures.summary import Trip, actors_text
from odscen.results.records.run_records import events_text
from odscen.sumo.folder.layout import (
    ACTORS_FILE,
    EMISSIONS_FILE,
    EVENTS_FILE,
    LANES_FILE,
    STOPINFO_FILE,
    TRIPINFO_FILE,
    TRIPS_FILE,
    VISITS_FILE,
)
from odscen.sumo.outputs.lane_measures import lane_table
from odscen.sumo.outputs.stop_table import stop_table
from odscen.sumo.outputs.trip_table import trip_table

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path


def outputs_to(folder: Path, sumo: Path) -> list[str]:
    """Arguments by which everything that SUMO writes goes to ``folder``, under its own name.

    Parameters
    ----------
    sumo
        Folder of the configuration, which names of outputs are relative to.
    """
    return ["--output-prefix", f"{os.path.relpath(folder, sumo)}/"]


def tidy_outputs(
    folder: Path,
    lengths: Mapping[str, Mapping[str, float]],
    *,
    present: Mapping[str, int],
    last: bool,
) -> None:
    """Replace SUMO's lane data, emissions, tripinfo and stops by our tables.

    Parameters
    ----------
    lengths, present
        As of :func:`odscen.sumo.outputs.lane_measures.lane_table`.
    last
        Whether the run has ended, so that trips without an arrival are trips.

    Raises
    ------
    SimulationError
        If SUMO has not written them to their end.
    """
    from lxml import etree
    from polars.exceptions import PolarsError

    lanes, emissions = folder / LANES_FILE, folder / EMISSIONS_FILE
    tripinfo, stopinfo = folder / TRIPINFO_FILE, folder / STOPINFO_FILE
    try:
        if lanes.is_file():
            rows = lane_table(lanes, emissions if emissions.is_file() else None, lengths, present)
            lanes.unlink()
            if rows.height:
                rows.write_parquet(lanes)
            emissions.unlink(missing_ok=True)
        if tripinfo.is_file():
            trips = trip_table(tripinfo, unfinished=last)
            if trips.height:
                trips.write_parquet(folder / TRIPS_FILE)
            tripinfo.unlink()
        if stopinfo.is_file():
            stop_table(stopinfo).write_parquet(folder / VISITS_FILE)
            stopinfo.unlink()
    except (etree.XMLSyntaxError, PolarsError) as error:
        msg = f"SUMO has not written its measurements to the end; the disk may be full: {error}"
        raise SimulationError(msg) from error


def trips_in(file: Path) -> dict[str, Trip]:
    """What a table of trips says of each actor; empty if there is none."""
    import polars as pl

    if not file.is_file():
        return {}
    table = pl.read_parquet(file, columns=["id", "time_loss", "waiting_time", "waiting_count"])
    return {name: Trip(*values) for name, *values in table.iter_rows()}


def write_results(run: Path, events: Iterable[str], actors: Iterable[str]) -> None:
    """Write ``events.json`` and ``actors.json`` from their rows."""
    with (run / EVENTS_FILE).open("w", encoding="utf-8") as out:
        out.writelines(events_text(events))
    with (run / ACTORS_FILE).open("w", encoding="utf-8") as out:
        out.writelines(actors_text(actors))
