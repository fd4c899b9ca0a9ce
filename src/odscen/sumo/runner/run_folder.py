"""What a run folder holds: what a run is made of, and what is left of it when it has ended."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from odscen.base.version import __version__
from odscen.figures.by_place.analysis_times import AnalysisTimes
from odscen.figures.judging.actor_measures import RunRecords
from odscen.figures.judging.criteria import criteria_rows
from odscen.figures.judging.expectations import evaluate
from odscen.figures.measures.figure import RunData, SummaryPart
from odscen.figures.measures.gridlock import find_incidents, incident_summary
from odscen.figures.measures.registry import COUNTS, figure_values
from odscen.figures.measures.summary import actors_from_json
from odscen.figures.measures.usability import failed_run, run_usability
from odscen.records.light_programs import programs_to_json
from odscen.records.outcomes import RunStatus
from odscen.records.run_events import events_from_json
from odscen.runs import layout
from odscen.runs.deferred_figures import compute_figures
from odscen.runs.ended import RECORDS_ONLY
from odscen.runs.found_files import found_files
from odscen.runs.judged import read_judged
from odscen.runs.run_settings import AS_DESIGNED
from odscen.sumo.outputs.signal_log import signal_logs

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.figures.by_place.lane_places import LanePlaces
    from odscen.records.light_programs import LightProgram
    from odscen.records.run_plan import Plan
    from odscen.runs.run_settings import RunSettings
    from odscen.sumo.runner.forecast import Forecast
    from odscen.sumo.runner.worker_process import Ended

Finish = Callable[["Path", Mapping[str, Any]], None]
"""Called with the folder and the summary of a run that has completed: the place for a report."""

FORMAT = "odscen-run"
VERSION = 1


@dataclass(frozen=True, slots=True)
class PreparedRun:
    """Everything that a run is made of; nothing on disk yet but the network.

    Attributes
    ----------
    plan
        What is to happen, actor by actor.
    sumo_files
        Text by file name: routes, configuration and perhaps signals, from
        :func:`odscen.sumo.realize.realization.realize`.
    net
        SUMO network file of the map.
    settings
        How it is run; ``plan`` and ``sumo_files`` were made by the same.
    scenario_json
        The scenario document, kept in the run folder.
    problems, notes
        What could not be realized, and which routes had to be repaired, in words.
    about
        Further fields of the summary, for example the map's name and hash.
    expected
        What it will need on disk and in memory.
    places
        Where each lane lies; figures of traffic by place need them.
    lights
        What each traffic light shows; figures of signals need it.
    assignment_json
        How routes by travel time were found, kept in the run folder.
    """

    plan: Plan
    sumo_files: Mapping[str, str]
    net: Path
    settings: RunSettings = AS_DESIGNED
    scenario_json: str | None = None
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    about: Mapping[str, Any] = field(default_factory=dict)
    expected: Forecast | None = None
    places: LanePlaces | None = None
    lights: tuple[LightProgram, ...] = ()
    assignment_json: str | None = None


def write_run_folder(prepared: PreparedRun, folder: Path) -> None:
    """Write what a run starts from: the scenario, the plan, and the SUMO files."""
    if prepared.scenario_json is not None:
        (folder / layout.SCENARIO_FILE).write_text(prepared.scenario_json, encoding="utf-8")
    (folder / layout.PLAN_FILE).write_text(prepared.plan.to_json(), encoding="utf-8")
    if prepared.places is not None:
        (folder / layout.LANE_PLACES_FILE).write_text(prepared.places.to_json(), encoding="utf-8")
    if prepared.assignment_json is not None:
        (folder / layout.ASSIGNMENT_FILE).write_text(prepared.assignment_json, encoding="utf-8")
    if prepared.lights:
        text = programs_to_json(prepared.lights)
        (folder / layout.LIGHTS_FILE).write_text(text, encoding="utf-8")
    sumo = folder / layout.SUMO_FOLDER
    sumo.mkdir()
    write_sumo_files(prepared.sumo_files, prepared.net, sumo, link=True)


def write_sumo_files(files: Mapping[str, str], net: Path, folder: Path, *, link: bool) -> None:
    """Write the SUMO files and the network into ``folder``.

    With ``link`` the network is a hard link where the file system has them: many runs on one map
    then hold it once. What a user takes away should be a copy.
    """
    for name, text in sorted(files.items()):
        (folder / name).write_text(text, encoding="utf-8")
    target = folder / layout.NET_FILE
    if link:
        try:
            os.link(net, target)
        except OSError:
            pass
        else:
            return
    shutil.copyfile(net, target)


def make_summary(
    prepared: PreparedRun, folder: Path, ended: Ended, *, figures: bool = True
) -> dict[str, Any]:
    """What ``summary.json`` says of a run that has ended, well or badly.

    Without ``figures`` those of a run that nothing is expected of are left for
    :func:`odscen.runs.deferred_figures.measured_summary`.
    """
    plan, done = prepared.plan, ended.done
    judged = bool(plan.criteria or prepared.settings.expectations)
    # A long run may have been in the hands of several processes.
    wall_seconds = done.wall_seconds if done and plan.slice_length else ended.wall_seconds
    summary: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "usable": failed_run(ended.error).to_dict(),
        "status": RunStatus.FAILED if ended.error or not done else RunStatus.COMPLETED,
        "error": ended.error,
        "stopped": bool(done and done.stopped),
        "scenario": plan.scenario,
        **prepared.about,
        "seed": plan.seed,
        "until": plan.until,
        "step_length": plan.step_length,
        "sim_seconds": done.sim_seconds if done else None,
        "steps": done.steps if done else None,
        "wall_seconds": round(wall_seconds, 3),
        "real_time_factor": round(done.sim_seconds / wall_seconds, 2) if done else None,
        "actors": dict.fromkeys(COUNTS) | {"planned": len(plan.actors)},
        "insertion_error_max": None,
        "figures": {},
        "gridlock": None,
    }
    if done:
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
        incidents = find_incidents(plan, outcomes, events, end=done.sim_seconds)
        summary["gridlock"] = incident_summary(incidents)
        until = plan.until if done.stopped else None
        verdict = run_usability(outcomes, incidents, end=done.sim_seconds, until=until)
        summary["usable"] = (failed_run(ended.error) if ended.error else verdict).to_dict()
    records = read_judged(folder) if done and judged else RunRecords()
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
        "sumo": _sumo_version(),
        "python": ".".join(map(str, sys.version_info[:3])),
    }
    return summary


@cache
def _sumo_version() -> str:
    return version("libsumo")


def drop_torn_records(folder: Path) -> None:
    """Remove Parquet files without their end, and what SUMO wrote that was not made into tables.

    A killed run leaves them, and nothing can read them.
    """
    for name in (layout.LANES_FILE, layout.EMISSIONS_FILE, layout.TRIPINFO_FILE, layout.SSM_FILE):
        (folder / name).unlink(missing_ok=True)
    for log in signal_logs(folder):
        log.unlink(missing_ok=True)
    file = folder / layout.TRAJECTORIES_FILE
    if not file.is_file():
        return
    with file.open("rb") as opened:
        opened.seek(max(0, file.stat().st_size - 4))
        whole = opened.read() == b"PAR1"
    if not whole:
        file.unlink()
