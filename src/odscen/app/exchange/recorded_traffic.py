"""Recorded traffic of the disk: files of others, and runs of odscen."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl

from odscen.app.exchange.imports import DiskFile
from odscen.base.given_files import as_path
from odscen.formats.tracks.read_recording import read_recording, time_window
from odscen.formats.tracks.recorded_traffic import RecordedTraffic, complete_tracks
from odscen.records.run_plan import Plan
from odscen.runs import layout
from odscen.runs.finished_run import Run

if TYPE_CHECKING:
    from odscen.base.given_files import GivenPath


def read_recorded_traffic(
    path: GivenPath, *, window: str = "", columns: str = "", part: str = ""
) -> RecordedTraffic:
    """Tracks of recorded traffic, whatever the schema of its file is.

    Read are INTERACTION, SinD, levelX (highD, inD, rounD, exiD), NGSIM and Argoverse 2, OSI traces
    (``.osi``, MCAP) and omega-prime, CommonRoad, other tables, and runs of odscen.

    Parameters
    ----------
    path
        A file, or the folder of a run. Files that belong to it lie beside it.
    window
        ``FROM..TO``, seconds or H:MM:SS as the file counts them; rows outside are not read.
    columns
        Of a table of no published schema, what its columns are:
        ``time=ms*0.001,id=vehicle,x=east,y=north``.
    part
        Which of several recordings that a file has: ``case_id`` of INTERACTION, ``Location`` of
        NGSIM.

    Returns
    -------
    RecordedTraffic
        ``rows``: the table of tracks, in metres, seconds and radians.

    Raises
    ------
    InputError
        If it is nothing of these, or damaged; names the file, the element and the value.
    """
    file = as_path(path)
    if file.is_dir():
        return _tracks_of_run(Run.open(file), window)
    options = {"window": window, "columns": columns, "case": part, "location": part}
    return read_recording(DiskFile(file), options)


def _tracks_of_run(run: Run, window: str) -> RecordedTraffic:
    rows = run.trajectories().filter(pl.col("time").is_between(*time_window(window)))
    plan = Plan.from_json((run.folder / layout.PLAN_FILE).read_text(encoding="utf-8"))
    bodies = pl.DataFrame(
        [(actor.id, actor.length, actor.width) for actor in plan.actors],
        schema={"id": pl.String, "length": pl.Float64, "width": pl.Float64},
        orient="row",
    )
    return complete_tracks(
        rows.rename({"category": "kind"}).join(bodies, on="id", how="left"), "odscen"
    )
