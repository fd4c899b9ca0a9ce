"""Figures of a run, computed at its end or when they are first asked for.

The records of a run are always complete. Where figures are not waited for, as in a batch of many
runs, ``summary.json`` says ``"records_only": true`` and has none; they are computed when the run is
opened, and written as they would have been at its end, byte for byte.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.base.errors import in_file
from odscen.base.folder_locks import locked
from odscen.base.system_errors import disk_errors
from odscen.base.to_disk import all_to_disk, to_disk, write_whole
from odscen.figures.by_place.analysis_times import AnalysisTimes
from odscen.figures.measures.figure import RunData
from odscen.figures.measures.registry import figure_values
from odscen.figures.measures.summary import actors_from_json, summary_to_json
from odscen.records.row_text import rounded
from odscen.runs import layout
from odscen.runs.ended import RECORDS_ONLY, read_summary
from odscen.runs.found_files import found_files
from odscen.runs.measured import read_run_data, write_figures
from odscen.runs.run_status import unfinished
from odscen.runs.run_sums import (
    check_run_files,
    seal_run,
    unseal_interrupted,
    without_sums,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence
    from pathlib import Path

    from odscen.figures.measures.figure import RunFigure, Values
    from odscen.figures.measures.summary import ActorOutcome

_PATIENCE = 60.0
"""Wall seconds to wait for another process that computes the same."""


def compute_figures(
    folder: Path, summary: dict[str, Any], outcomes: Sequence[ActorOutcome]
) -> None:
    """Compute the figures of a run from its records: tables into its folder, values in ``summary``.

    Raises
    ------
    InputError
        If the records cannot be read, or times do not fit what was measured.
    """
    end, meso = float(summary["sim_seconds"]), bool(summary.get("meso"))
    times = AnalysisTimes.of_summary(summary)
    data = read_run_data(folder, outcomes, end=end, meso=meso, times=times)
    write_figures(folder, data)
    summary["figures"] = rounded(figure_values(data))
    summary["insertion_error_max"] = summary["figures"]["insertion_error_max"]


def figure_of_actors(run: Path, summary: Mapping[str, Any], figure: RunFigure) -> float | None:
    """Value of a figure that is made of what became of the actors, as the summary will have it.

    Raises
    ------
    InputError
        If the run does not have that any more.
    """
    first = AnalysisTimes.of_summary(summary).warm_up
    with in_file(str(run / layout.ACTORS_FILE)), disk_errors(f"run folder {run}"):
        actors = actors_from_json((run / layout.ACTORS_FILE).read_text(encoding="utf-8"))
    counted = [actor for actor in actors if actor.depart >= first]
    data = RunData(counted, end=float(summary["sim_seconds"]))
    values: Values = rounded(figure_values(data, [figure]))
    return values[figure.name]


def measured_summary(run: Path) -> dict[str, Any]:
    """Summary of a run that has ended, with its figures; they are computed if they are not there.

    Raises
    ------
    InputError
        If no run has ended here, or its records cannot be read.
    DamagedError
        If figures are to be computed from files that are not as they were written.
    ConflictError
        If another process works on the run.
    WorkspaceError
        If they cannot be written.
    """
    summary = read_summary(run)
    if not summary.get(RECORDS_ONLY):
        return summary
    with (
        disk_errors(f"run folder {run}"),
        locked(run, what=f"run {run.name!r}", patience=_PATIENCE),
    ):
        summary = read_summary(run)
        if not summary.pop(RECORDS_ONLY, False):  # another process has been quicker
            return summary
        check_run_files(run)
        text = (run / layout.ACTORS_FILE).read_text(encoding="utf-8")
        compute_figures(run, summary, actors_from_json(text))
        summary["files"] = found_files(run)
        _sync_tables(run)
        unseal_interrupted(run)  # first: this process may be killed in between
        write_whole(run / layout.SUMMARY_FILE, summary_to_json(summary))
        seal_run(run)
    return summary


def checked_summary(run: Path, *, leave: Collection[str] = ()) -> dict[str, Any]:
    """Summary of a run that has ended, when all of its files are as they were written.

    Raises
    ------
    InputError
        If no run has ended here.
    DamagedError
        With each file that is not as it was written.
    """
    if not unfinished(run) and ((run / layout.SUMMARY_FILE).is_file() or not without_sums(run)):
        check_run_files(run, leave=leave)
    return read_summary(run)


def whole_summary(run: Path, *, leave: Collection[str] = ()) -> dict[str, Any]:
    """Do as :func:`checked_summary`, and compute figures if they are not there."""
    summary = checked_summary(run, leave=leave)
    return measured_summary(run) if summary.get(RECORDS_ONLY) else summary


def _sync_tables(run: Path) -> None:
    """Bring the tables to the disk before the summary says that they are there."""
    if (run / layout.FIGURES_FILE).is_file():
        to_disk(run / layout.FIGURES_FILE)
    if (run / layout.FIGURES_FOLDER).is_dir():
        all_to_disk(run / layout.FIGURES_FOLDER)
    to_disk(run)
