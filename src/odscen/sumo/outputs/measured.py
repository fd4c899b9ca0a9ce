"""Figures of traffic of a run, from what is in its folder."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.results.measures.conflicts import conflict_figures
from odscen.results.measures.lane_places import LanePlaces
from odscen.results.measures.queues import queue_lengths
from odscen.results.measures.run_traffic import traffic_of_run
from odscen.results.measures.traffic import traffic_figures
from odscen.results.measures.traffic_files import figures_json, write_tables
from odscen.results.measures.traffic_sums import intervals
from odscen.sumo.folder import layout
from odscen.sumo.folder.recorded import read_conflicts, read_lanes, read_trips, trajectory_files

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.results.measures.traffic import TrafficFigures


def read_figures(run: Path, *, end: float, meso: bool = False) -> TrafficFigures | None:
    """Figures by place and time of a run that lasted ``end`` seconds.

    Parameters
    ----------
    meso
        Whether it was mesoscopic: nobody stands in its trajectories, so that there are no queues.

    Returns
    -------
    ``None`` if nothing was measured on lanes, or no vehicle was there.

    Raises
    ------
    InputError
        If the places of lanes cannot be read.
    """
    import polars as pl

    lanes = read_lanes(run)
    file = run / layout.LANE_PLACES_FILE
    if lanes is None or not file.is_file():
        return None
    places = LanePlaces.from_json(file.read_text(encoding="utf-8"))
    files = trajectory_files(run)
    queues = None
    if files and not meso:
        queues = queue_lengths(pl.scan_parquet(files), places, intervals(lanes, end))
    return traffic_figures(lanes, places, end=end, queues=queues)


def write_figures(run: Path, *, end: float, meso: bool = False) -> dict[str, float | None]:
    """Write ``figures.json`` and the tables of a run, and return the figures of the whole run."""
    figures = read_figures(run, end=end, meso=meso)
    of_run = traffic_of_run(figures, read_trips(run))
    conflicts = read_conflicts(run)
    if conflicts is not None:
        of_run |= conflict_figures(conflicts)
    if figures is not None:
        text = figures_json(figures, of_run)
        (run / layout.FIGURES_FILE).write_text(text, encoding="utf-8")
        write_tables(figures, run / layout.FIGURES_FOLDER)
    return of_run
