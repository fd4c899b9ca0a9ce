"""From what has been prepared to a finished run folder, whichever simulator plays it.

A run folder appears whole or not at all: it is made beside its final place and renamed when the run
has ended, well or badly. A failed run is a folder too, with status ``failed`` and the reason.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odscen.base.atomic_folders import clear_leftovers, new_folder
from odscen.base.checksums import SUMS_FILE
from odscen.base.errors import ConflictError
from odscen.base.folder_locks import locked
from odscen.base.system_errors import disk_errors
from odscen.base.version import __version__
from odscen.figures.by_place.analysis_times import AnalysisTimes
from odscen.figures.judging.actor_measures import RunRecords
from odscen.figures.judging.criteria import criteria_rows
from odscen.figures.judging.expectations import evaluate
from odscen.figures.measures.figure import RunData, SummaryPart
from odscen.figures.measures.gridlock import find_incidents, incident_summary
from odscen.figures.measures.registry import COUNTS, figure_values
from odscen.figures.measures.summary import actors_from_json, summary_to_json
from odscen.figures.measures.usability import failed_run, run_usability
from odscen.records.light_programs import programs_to_json
from odscen.records.outcomes import RunStatus
from odscen.records.run_events import events_from_json
from odscen.runs import layout
from odscen.runs.deferred_figures import compute_figures
from odscen.runs.ended import RECORDS_ONLY
from odscen.runs.finished_run import Run
from odscen.runs.found_files import found_files
from odscen.runs.judged import read_judged
from odscen.runs.run_settings import AS_DESIGNED
from odscen.runs.run_status import read_status, unfinished
from odscen.runs.run_sums import seal_run

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from odscen.figures.by_place.lane_places import LanePlaces
    from odscen.records.light_programs import LightProgram
    from odscen.records.run_plan import Plan
    from odscen.runs.run_settings import RunSettings

Finish = Callable[[Path, Mapping[str, Any]], None]
"""Called with the folder and the summary of a run that has completed: the place for a report."""

_MARKS = (SUMS_FILE, layout.SUMMARY_FILE, layout.PLAN_FILE, layout.SCENARIO_FILE)
"""Files of which a folder of a run has at least one, also if it is damaged."""
FORMAT = "odscen-run"
VERSION = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class PreparedRun:
    """What a run is made of, whichever simulator plays it; nothing is on the disk yet.

    Attributes
    ----------
    plan
        What is to happen, actor by actor.
    settings
        How it is run; ``plan`` was made by the same.
    scenario_json
        The scenario document, kept in the run folder.
    problems, notes
        What cannot be done as designed, and what else is to be known, in words.
    about
        Further fields of the summary, for example the map's name and hash.
    places
        Where each SUMO lane lies; figures of traffic by place need them.
    lights
        What each traffic light shows; figures of signals need it.
    assignment_json
        How routes by travel time were found, kept in the run folder.
    versions
        Of the simulator and what it is made of, by name.
    """

    plan: Plan
    settings: RunSettings = AS_DESIGNED
    scenario_json: str | None = None
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    about: Mapping[str, Any] = field(default_factory=dict)
    places: LanePlaces | None = None
    lights: tuple[LightProgram, ...] = ()
    assignment_json: str | None = None
    versions: Mapping[str, str] = field(default_factory=dict)

    def write(self, folder: Path) -> None:
        """Write what the run starts from."""
        files = {
            layout.SCENARIO_FILE: self.scenario_json,
            layout.PLAN_FILE: self.plan.to_json(),
            layout.LANE_PLACES_FILE: None if self.places is None else self.places.to_json(),
            layout.ASSIGNMENT_FILE: self.assignment_json,
            layout.LIGHTS_FILE: programs_to_json(self.lights) if self.lights else None,
        }
        for name, text in files.items():
            if text is not None:
                (folder / name).write_text(text, encoding="utf-8")


@dataclass(frozen=True, slots=True)
class SimulationOutcome:
    """How a simulation ended.

    Attributes
    ----------
    sim_seconds, steps
        What was simulated; ``None`` if it failed and left nothing to compute figures from.
    wall_seconds
        From starting it to its end.
    error
        Why it failed. Together with ``sim_seconds`` what happened until then is kept.
    stopped
        Whether a user has ended it before its time.
    work_seconds
        Wall seconds of simulating, where several processes took part one after the other.
    """

    sim_seconds: float | None
    steps: int | None
    wall_seconds: float
    error: str | None = None
    stopped: bool = False
    work_seconds: float | None = None


def run_lock(folder: Path) -> AbstractContextManager[int]:
    """Hold the lock of a run folder, which need not be there.

    Raises
    ------
    ConflictError
        If another process works on it; says which, and since when.
    """
    return locked(folder, what=f"run {folder.name!r}")


def refuse_finished_run(folder: Path) -> None:
    """Refuse to replace a run that has ended, in a folder that the caller has chosen for a new one.

    Raises
    ------
    ConflictError
        If one is there.
    """
    if (folder / layout.SUMMARY_FILE).is_file() and not unfinished(folder):
        raise ConflictError(
            f"{folder} holds a run that has ended; name another folder, or say that it is to be "
            "replaced (--overwrite, in Python overwrite=True)"
        )


def _refuse_other_content(folder: Path) -> None:
    """Refuse a folder with something in it that is no run, which a new run would delete."""
    if not folder.is_dir() or any((folder / name).exists() for name in _MARKS):
        return
    if any(folder.iterdir()):
        raise ConflictError(f"{folder} is not empty, and no run is in it; name another folder")


@contextmanager
def claimed_folder(out: Path) -> Iterator[int]:
    """Hold the lock of the folder of a run that is to begin, and tidy up beside it.

    Raises
    ------
    ConflictError
        If a run that can be resumed, or is going on, is there: hours may be in it; or something
        that is no run.
    WorkspaceError
        If the disk cannot be written in the block.
    """
    with disk_errors(f"run folder {out}"), run_lock(out) as lock:
        status = read_status(out)
        if status is not None:
            at = f"it is at {status['time']:g} s" if status else "its status.json is damaged"
            raise ConflictError(
                f"run {out.name!r} has not ended ({at}); "
                f"odscen resume {out} resumes it; delete the folder to begin anew"
            )
        _refuse_other_content(out)
        clear_leftovers(out.parent)
        yield lock


def run_in_new_folder(
    prepared: PreparedRun,
    out: Path,
    simulate: Callable[[Path], SimulationOutcome],
    *,
    finish: Finish | None = None,
    figures: bool = True,
) -> Run:
    """Simulate in a new folder, which replaces ``out`` when all of it is there.

    The lock of ``out`` is held by the caller, see :func:`claimed_folder`.

    Parameters
    ----------
    simulate
        Runs what has been prepared, and leaves its records in the folder.
    finish
        See :data:`Finish`.
    figures
        Whether they are computed at once, as they are for ``finish``; see :func:`make_summary`.
    """
    with new_folder(out) as folder:
        prepared.write(folder)
        outcome = simulate(folder)
        summary = make_summary(prepared, folder, outcome, figures=figures or finish is not None)
        if finish is not None and outcome.sim_seconds is not None:
            finish(folder, summary)
            summary["files"] = found_files(folder)
        (folder / layout.SUMMARY_FILE).write_text(summary_to_json(summary), encoding="utf-8")
        seal_run(folder, hidden=True)
    return Run(out, summary)


def make_summary(
    prepared: PreparedRun, folder: Path, outcome: SimulationOutcome, *, figures: bool = True
) -> dict[str, Any]:
    """What ``summary.json`` says of a run that has ended, well or badly.

    Without ``figures`` those of a run that nothing is expected of are left for
    :func:`odscen.runs.deferred_figures.measured_summary`.
    """
    plan, seconds = prepared.plan, outcome.sim_seconds
    judged = bool(plan.criteria or prepared.settings.expectations)
    wall_seconds = outcome.wall_seconds
    if outcome.work_seconds is not None and plan.slice_length:
        wall_seconds = outcome.work_seconds
    known = seconds is not None
    summary: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "usable": failed_run(outcome.error).to_dict(),
        "status": RunStatus.FAILED if outcome.error or not known else RunStatus.COMPLETED,
        "error": outcome.error,
        "stopped": outcome.stopped,
        "scenario": plan.scenario,
        **prepared.about,
        "seed": plan.seed,
        "until": plan.until,
        "step_length": plan.step_length,
        **({"scene": True} if plan.scene else {}),
        "sim_seconds": seconds,
        "steps": outcome.steps,
        "wall_seconds": round(wall_seconds, 3),
        "real_time_factor": None if seconds is None else round(seconds / wall_seconds, 2),
        "actors": dict.fromkeys(COUNTS) | {"planned": len(plan.actors)},
        "insertion_error_max": None,
        "figures": {},
        "gridlock": None,
    }
    if seconds is not None:
        text = (folder / layout.ACTORS_FILE).read_text(encoding="utf-8")
        outcomes = actors_from_json(text)
        summary |= AnalysisTimes(plan.warm_up, plan.interval).to_dict()
        summary["actors"] = figure_values(RunData(outcomes), part=SummaryPart.ACTORS)
        if figures or judged:
            compute_figures(folder, summary, outcomes)
        else:
            summary[RECORDS_ONLY] = True
        text = (folder / layout.EVENTS_FILE).read_text(encoding="utf-8")
        events = events_from_json(text)
        incidents = find_incidents(plan, outcomes, events, end=seconds)
        summary["gridlock"] = incident_summary(incidents)
        until = plan.until if outcome.stopped else None
        verdict = run_usability(outcomes, incidents, end=seconds, until=until, scene=plan.scene)
        summary["usable"] = (failed_run(outcome.error) if outcome.error else verdict).to_dict()
    records = read_judged(folder) if known and judged else RunRecords()
    if plan.criteria:
        summary["criteria"] = criteria_rows(plan.criteria, summary, records)
    summary["expectations"] = [
        {"expectation": v.expectation, "value": v.value, "passed": v.passed}
        for v in evaluate(prepared.settings.expectations, summary, records)
    ]
    summary["problems"] = list(prepared.problems)
    summary["notes"] = list(prepared.notes)
    summary["files"] = found_files(folder)
    summary["versions"] = {
        "odscen": __version__,
        **prepared.versions,
        "python": ".".join(map(str, sys.version_info[:3])),
    }
    return summary
