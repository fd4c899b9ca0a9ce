"""Runs in slices, from the runner's side: a folder that is there from the start, and resuming.

While such a run goes on its folder has ``status.json`` and no ``summary.json``; when it has ended
it is like any other. Whatever ends it before its time (Ctrl-C, ``kill -9``, a full disk, power),
:func:`resume` goes on from the last complete slice and ends with the same results.
"""

from __future__ import annotations

import json
import shutil
from typing import TYPE_CHECKING, Any

from odscen.base.atomic_folders import clear_leftovers, new_folder
from odscen.base.checksums import unsealed
from odscen.base.errors import ConflictError, InputError, NotFoundError
from odscen.base.system_errors import disk_errors
from odscen.base.to_disk import write_whole
from odscen.figures.judging.expectations import parse_expectation
from odscen.figures.measures.summary import summary_to_json
from odscen.records.run_plan import Plan
from odscen.runs import layout
from odscen.runs.checkpoint import (
    clear_parts,
    last_number,
    read_checkpoint,
    survey,
)
from odscen.runs.finished_run import Run
from odscen.runs.found_files import found_files
from odscen.runs.new_run import make_summary, run_lock
from odscen.runs.reporter import SILENT
from odscen.runs.run_settings import RunSettings
from odscen.runs.run_status import (
    going,
    unfinished,
    write_status,
)
from odscen.runs.run_sums import (
    check_run_files,
    refuse_additions,
    seal_interrupted,
    seal_run,
    seal_start,
    unseal_interrupted,
)
from odscen.sumo.runner.forked_worker import is_ready
from odscen.sumo.runner.run_folder import SumoPreparedRun
from odscen.sumo.runner.worker_process import run_worker
from odscen.sumo.worker.behaviour.behaviour_doors import is_installed, read_behaviour

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.learning.behaviour.behaviour_model import BehaviourDoor
    from odscen.runs.new_run import Finish
    from odscen.runs.reporter import Reporter
    from odscen.sumo.runner.worker_process import Companion

FORMAT = "odscen-run-settings"
VERSION = 1


def run_long(
    prepared: SumoPreparedRun,
    out: Path,
    lock: int,
    *,
    reporter: Reporter = SILENT,
    finish: Finish | None = None,
    live: Companion | None = None,
) -> Run:
    """Run in slices in a new folder ``out``, which is there while it goes on.

    Parameters as in :func:`odscen.sumo.runner.run_jobs.run_prepared`; ``lock`` is that of ``out``.

    Raises
    ------
    WorkspaceError
        If the folder cannot be written.
    """
    with new_folder(out) as folder:
        prepared.write(folder)
        _write_settings(prepared, folder)
        write_status(folder, prepared.plan, None)
        seal_start(folder)
    with disk_errors(f"run folder {out}", advice=_resume_hint(out)):
        return _resume_from(prepared, out, lock, reporter, finish, live)


def resume(
    folder: Path,
    *,
    reporter: Reporter = SILENT,
    time_limit: float | None = None,
    finish: Finish | None = None,
    live: Companion | None = None,
    behaviour: BehaviourDoor | None = None,
) -> Run:
    """Go on with an interrupted run from its last complete slice.

    All that it goes on from is compared with its checksums first.

    Parameters
    ----------
    reporter
        Hears where it goes on, and which slices are damaged, too.
    behaviour
        What drives instead of SUMO, named again where the run has a program, a socket or a file:
        what a folder says is data, and is not executed for that.
    time_limit
        Wall seconds after which it is interrupted again.

    Raises
    ------
    NotFoundError
        If there is no run here.
    ConflictError
        If it has ended already, or is going on.
    DamagedError
        If what it starts from is not as it was written.
    InputError
        If it is driven by code that is named in its folder alone, or by another than is named now.
    """
    _refuse_absent(folder)
    with disk_errors(f"run folder {folder}", advice=_resume_hint(folder)), run_lock(folder) as lock:
        _refuse_absent(folder)
        clear_leftovers(folder.parent)
        check_run_files(folder)
        unsealed(folder / layout.STATUS_FILE)
        prepared = _restore_prepared(folder, time_limit)
        _refuse_unnamed_code(folder, behaviour)
        number, problems = survey(folder)
        for problem in problems:
            reporter.said(problem)
        begin = read_checkpoint(folder, number).time if number else 0.0
        reporter.said(f"resumes at {begin:g} s, after slice {number}" if number else "begins anew")
        unseal_interrupted(folder)  # first: it may be killed in between
        (folder / layout.SUMMARY_FILE).unlink(missing_ok=True)
        return _resume_from(prepared, folder, lock, reporter, finish, live)


def interrupted(runs: Path) -> list[str]:
    """Names of the runs in a folder that are interrupted, sorted."""
    if not runs.is_dir():
        return []
    return sorted(path.name for path in runs.iterdir() if going(path) == "interrupted")


def about(folder: Path) -> dict[str, Any]:
    """What a run that has not ended will say of itself, for example its map; empty if unknown."""
    try:
        settings = json.loads((folder / layout.SETTINGS_FILE).read_text(encoding="utf-8"))
        return dict(settings["about"])
    except (OSError, ValueError, KeyError, TypeError):
        return {}


def _resume_from(
    prepared: SumoPreparedRun,
    folder: Path,
    lock: int,
    reporter: Reporter,
    finish: Finish | None,
    live: Companion | None,
) -> Run:
    limit = prepared.settings.time_limit
    reporter.started()
    ended = run_worker(
        folder,
        progress=reporter.advanced,
        called_off=lambda: reporter.cancelled,
        time_limit=limit,
        live=live,
        keep=(lock,),
        forked=live is None and is_ready(),
    )
    clear_parts(folder)  # a torn one takes room that what follows may need
    summary = make_summary(prepared, folder, ended)
    summary["slices"] = _describe_slices(folder)
    if ended.sim_seconds is None:
        kept = summary["slices"]["time"]
        summary["error"] = (
            f"{summary['error']}\nWhat happened up to {kept:g} s is kept; "
            f"to resume there: odscen resume {folder}"
        )
    elif finish is not None:
        finish(folder, summary)
    summary["files"] = found_files(folder)
    write_whole(folder / layout.SUMMARY_FILE, summary_to_json(summary))
    if ended.sim_seconds is None:
        seal_interrupted(folder)
    else:
        seal_run(folder)
        _clear_resuming_files(folder)
    return Run(folder, summary)


def _resume_hint(folder: Path) -> str:
    return f"then: odscen resume {folder}"


def _refuse_absent(folder: Path) -> None:
    """Refuse what cannot be resumed, as it has ended or is not there."""
    if unfinished(folder):
        return
    if (folder / layout.SUMMARY_FILE).is_file():
        raise ConflictError(f"run {folder.name!r} has ended; there is nothing to resume")
    raise NotFoundError("interrupted run", folder.name, interrupted(folder.parent))


def _describe_slices(folder: Path) -> dict[str, Any]:
    """What ``summary.json`` says of the slices: each one's end, and what it took."""
    done = [read_checkpoint(folder, n) for n in range(1, last_number(folder) + 1)]
    return {
        "time": done[-1].time if done else 0.0,
        "done": [
            {
                "time": checkpoint.time,
                "running": checkpoint.running,
                "steps": checkpoint.steps,
                "wall_seconds": round(checkpoint.wall_seconds, 3),
                "memory_mb": round(checkpoint.memory / 1e6, 1),
            }
            for checkpoint in done
        ],
    }


def _clear_resuming_files(folder: Path) -> None:
    """Remove what was there only to go on from; the run has ended."""
    (folder / layout.STATUS_FILE).unlink(missing_ok=True)
    (folder / layout.SETTINGS_FILE).unlink(missing_ok=True)
    shutil.rmtree(folder / layout.SLICES_FOLDER, ignore_errors=True)


def _write_settings(prepared: SumoPreparedRun, folder: Path) -> None:
    settings = {
        "format": FORMAT,
        "version": VERSION,
        "sealed": "whole",
        "problems": list(prepared.problems),
        "notes": list(prepared.notes),
        "about": dict(prepared.about),
        "expectations": [expectation.text for expectation in prepared.settings.expectations],
    }
    text = json.dumps(settings, indent=2, ensure_ascii=False) + "\n"
    (folder / layout.SETTINGS_FILE).write_text(text, encoding="utf-8")


def _refuse_unnamed_code(folder: Path, named: BehaviourDoor | None) -> None:
    """Refuse to execute what only the folder names: it may come from anybody."""
    path = folder / layout.SUMO_FOLDER / layout.BEHAVIOUR_FILE
    if not path.is_file():
        if named is not None:
            raise InputError("SUMO drives this run; no behaviour model is resumed in it")
        return
    stored = read_behaviour(path.read_text(encoding="utf-8"))
    if named is not None and (
        (named.name, named.command, named.socket) != (stored.name, stored.command, stored.socket)
        or (named.options and dict(named.options) != dict(stored.options))
    ):
        raise InputError(
            f"it is not what drives this run, which is {stored.shown!r} with "
            f"{dict(stored.options) or 'no options'}",
            element=named.shown,
        )
    if named is None and not is_installed(stored):
        option = "--behaviour-socket" if stored.socket is not None else "--behaviour"
        if stored.command is not None:
            option = "--behaviour-cmd"
        raise InputError(
            f"this run is driven by code that its folder names; name it again if you trust it: "
            f"odscen resume {folder} {option} {stored.name or stored.command or stored.socket!r}"
        )


def _restore_prepared(folder: Path, time_limit: float | None) -> SumoPreparedRun:
    """Read what is left to know of the run; all else is in its files."""
    path = folder / layout.SETTINGS_FILE
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        if (data["format"], data["version"]) != (FORMAT, VERSION):
            raise InputError(
                f"format {data['format']!r} version {data['version']!r} is not a run to resume",
                file=str(path),
            )
        if data.get("sealed") == "whole":  # earlier versions left some files without checksums
            refuse_additions(folder)
        expectations = tuple(parse_expectation(text) for text in data["expectations"])
        return SumoPreparedRun(
            plan=Plan.from_json((folder / layout.PLAN_FILE).read_text(encoding="utf-8")),
            sumo_files={},
            net=folder / layout.SUMO_FOLDER / layout.NET_FILE,
            settings=RunSettings(time_limit=time_limit, expectations=expectations),
            problems=tuple(data["problems"]),
            notes=tuple(data["notes"]),
            about=data["about"],
        )
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"cannot be resumed: {error!r}", file=str(path)) from error
