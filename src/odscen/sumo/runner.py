"""Runs: from a prepared scenario to a finished run folder, one process per run.

A run folder appears whole or not at all: it is made beside its final place and renamed when the run
has ended, well or badly. A failed run is a folder too, with status ``failed``, the reason and the
log; nothing that goes wrong inside SUMO raises here.
"""

from __future__ import annotations

import os
import shutil
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Literal

from odscen import __version__
from odscen.catalog.folders import new_folder
from odscen.errors import WorkspaceError
from odscen.results.expectations import COUNTS, evaluate
from odscen.results.summary import actor_counts, actors_from_json, key_figures, summary_to_json
from odscen.sumo import layout
from odscen.sumo.process import run_worker

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from odscen.results.expectations import Expectation
    from odscen.results.records import Plan
    from odscen.sumo.process import Companion, Ended
    from odscen.sumo.progress import OnProgress, Progress

RunStatus = Literal["completed", "failed"]

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
        :func:`odscen.sumo.realize.realize`.
    net
        SUMO network file of the map.
    scenario_json
        The scenario document, kept in the run folder.
    problems, notes
        What could not be realized, and which routes had to be repaired, in words.
    about
        Further fields of the summary, for example the map's name and hash.
    """

    plan: Plan
    sumo_files: Mapping[str, str]
    net: Path
    scenario_json: str | None = None
    problems: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    about: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class RunResult:
    """A finished run: its folder, and ``summary`` as in ``summary.json``."""

    folder: Path
    summary: Mapping[str, Any]

    @property
    def status(self) -> RunStatus:
        """``completed`` if the simulation ended by itself, whatever became of the actors."""
        status: RunStatus = self.summary["status"]
        return status

    @property
    def expectations_met(self) -> bool:
        """Whether every expectation has passed; true if there is none."""
        return all(verdict["passed"] for verdict in self.summary["expectations"])

    @property
    def exit_code(self) -> int:
        """0 completed, 1 completed with failed expectations, 3 failed."""
        if self.status == "failed":
            return 3
        return 0 if self.expectations_met else 1

    def to_dict(self) -> dict[str, Any]:
        """Return the summary with the folder and absolute paths of its files."""
        files = {name: str(self.folder / file) for name, file in self.summary["files"].items()}
        return {**self.summary, "folder": str(self.folder), "files": files}


def run_prepared(
    prepared: PreparedRun,
    out: Path,
    *,
    expectations: Sequence[Expectation] = (),
    progress: OnProgress | None = None,
    time_limit: float | None = None,
    finish: Callable[[Path, Mapping[str, Any]], None] | None = None,
    live: Companion | None = None,
    simulate: Callable[[Path], Ended] | None = None,
) -> RunResult:
    """Run in a new folder ``out``; whatever was there is replaced.

    Parameters
    ----------
    progress
        Called in this thread, a few times a second.
    time_limit
        Wall seconds after which the run is stopped and has failed.
    finish
        Called with the folder and the summary when a run has completed, before the folder appears:
        the place to add a report.
    live
        Makes it a run that can be watched and steered, or that goes in step with another.
    simulate
        Runs what is in a folder and writes the results there, instead of SUMO's worker.

    Raises
    ------
    WorkspaceError
        If the folder cannot be written.
    """
    try:
        with new_folder(out) as folder:
            write_run_folder(prepared, folder)
            if simulate is None:
                ended = run_worker(folder, progress=progress, time_limit=time_limit, live=live)
            else:
                ended = simulate(folder)
            if ended.done is None:
                _drop_torn_trajectories(folder)
            summary = _summary(prepared, folder, ended, expectations)
            if finish is not None and ended.done is not None:
                finish(folder, summary)
                summary["files"] = _files(folder)
            (folder / layout.SUMMARY_FILE).write_text(summary_to_json(summary), encoding="utf-8")
    except OSError as error:
        msg = f"run folder {out}: {error.strerror or error} ({error.filename or ''})"
        raise WorkspaceError(msg) from error
    return RunResult(out, summary)


class _StoppedError(Exception):
    """Another run of the same call has failed to start, or the user has interrupted."""


@dataclass(frozen=True, slots=True)
class RunJob:
    """One run of several: ``prepare`` is called when its turn comes; ``out`` is its folder."""

    name: str
    prepare: Callable[[], PreparedRun]
    out: Path


def run_many(
    jobs: Sequence[RunJob],
    *,
    processes: int = 1,
    expectations: Sequence[Expectation] = (),
    progress: Callable[[RunJob, Progress], None] | None = None,
    done: Callable[[RunJob, RunResult], None] | None = None,
    time_limit: float | None = None,
    finish: Callable[[Path, Mapping[str, Any]], None] | None = None,
) -> tuple[RunResult, ...]:
    """Run several scenarios, ``processes`` at a time; results in the order of ``jobs``.

    ``progress`` and ``done`` are called from the threads that wait for the processes, ``done`` in
    the order in which runs end. An error in preparing a run ends all of it: scenarios are checked
    before they are run.
    """
    stopping = threading.Event()

    def one(job: RunJob) -> RunResult:
        def follow(message: Progress) -> None:
            if stopping.is_set():  # ends this worker process too
                raise _StoppedError
            if progress is not None:
                progress(job, message)

        result = run_prepared(
            job.prepare(),
            job.out,
            expectations=expectations,
            progress=follow,
            time_limit=time_limit,
            finish=finish,
        )
        if done is not None:
            done(job, result)
        return result

    with ThreadPoolExecutor(max_workers=max(1, processes)) as pool:
        futures = [pool.submit(one, job) for job in jobs]
        try:
            return tuple(future.result() for future in futures)
        except BaseException:
            stopping.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def write_run_folder(prepared: PreparedRun, folder: Path) -> None:
    """Write what a run starts from: the scenario, the plan, and the SUMO files."""
    if prepared.scenario_json is not None:
        (folder / layout.SCENARIO_FILE).write_text(prepared.scenario_json, encoding="utf-8")
    (folder / layout.PLAN_FILE).write_text(prepared.plan.to_json(), encoding="utf-8")
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


def _summary(
    prepared: PreparedRun, folder: Path, ended: Ended, expectations: Sequence[Expectation]
) -> dict[str, Any]:
    plan, done = prepared.plan, ended.done
    summary: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "status": "completed" if done else "failed",
        "error": ended.error,
        "stopped": bool(done and done.stopped),
        "scenario": plan.scenario,
        **prepared.about,
        "seed": plan.seed,
        "until": plan.until,
        "step_length": plan.step_length,
        "sim_seconds": done.sim_seconds if done else None,
        "steps": done.steps if done else None,
        "wall_seconds": round(ended.wall_seconds, 3),
        "real_time_factor": round(done.sim_seconds / ended.wall_seconds, 2) if done else None,
        "actors": dict.fromkeys(COUNTS) | {"planned": len(plan.actors)},
        "insertion_error_max": None,
        "figures": {},
    }
    if done:
        text = (folder / layout.ACTORS_FILE).read_text(encoding="utf-8")
        outcomes = actors_from_json(text)
        figures = key_figures(outcomes)
        summary["actors"] = actor_counts(outcomes)
        summary["insertion_error_max"] = figures["insertion_error_max"]
        summary["figures"] = figures
    summary["expectations"] = [
        {"expectation": v.expectation, "value": v.value, "passed": v.passed}
        for v in evaluate(expectations, summary)
    ]
    summary["problems"] = list(prepared.problems)
    summary["notes"] = list(prepared.notes)
    summary["files"] = _files(folder)
    summary["versions"] = {
        "odscen": __version__,
        "sumo": version("libsumo"),
        "python": ".".join(map(str, sys.version_info[:3])),
    }
    return summary


def _drop_torn_trajectories(folder: Path) -> None:
    """Remove a Parquet file without its end: a killed run leaves one, and nothing can read it."""
    file = folder / layout.TRAJECTORIES_FILE
    if not file.is_file():
        return
    with file.open("rb") as opened:
        opened.seek(max(0, file.stat().st_size - 4))
        whole = opened.read() == b"PAR1"
    if not whole:
        file.unlink()


def _files(folder: Path) -> dict[str, str]:
    """Files of a run by what they are, relative to its folder; only those that are there."""
    sumo = layout.SUMO_FOLDER
    names = {
        "scenario": layout.SCENARIO_FILE,
        "plan": layout.PLAN_FILE,
        "net": f"{sumo}/{layout.NET_FILE}",
        "routes": f"{sumo}/{layout.ROUTES_FILE}",
        "signals": f"{sumo}/{layout.SIGNALS_FILE}",
        "config": f"{sumo}/{layout.CONFIG_FILE}",
        "trajectories": layout.TRAJECTORIES_FILE,
        "events": layout.EVENTS_FILE,
        "actors": layout.ACTORS_FILE,
        "report": layout.REPORT_FILE,
        "parity": layout.PARITY_FILE,
        "parity_figures": layout.PARITY_FIGURES_FILE,
        "log": layout.LOG_FILE,
    }
    found = {key: name for key, name in names.items() if (folder / name).is_file()}
    return {**found, "summary": layout.SUMMARY_FILE}
