"""Damaged runs of a workspace: rebuilt from their records and their map, or set aside.

Part of :mod:`odscen.app.doctor`.
"""

from __future__ import annotations

import os
import re
import shutil
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from odscen.app.map_repairs import NO_SUMS, RepairStep, listed, set_aside
from odscen.app.maps import load_map
from odscen.app.running.reports import write_report
from odscen.base.checksums import MISSING, SUMS_FILE, file_digest, read_sums, write_sums
from odscen.base.errors import DamagedFile, InputError, OdscenError
from odscen.base.folder_locks import is_locked
from odscen.figures.by_place.analysis_times import AnalysisTimes
from odscen.figures.measures.summary import actors_from_json
from odscen.records.run_plan import Plan
from odscen.runs import layout
from odscen.runs.checkpoint import last_number, read_checkpoint
from odscen.runs.ended import read_summary
from odscen.runs.measured import read_run_data, write_figures
from odscen.runs.new_run import run_lock
from odscen.runs.run_status import read_status, unfinished, write_status
from odscen.runs.run_sums import damaged_in, seal_again, seal_run, seal_start, without_sums
from odscen.sumo.runner.long_runs import about

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from odscen.maps.store import Workspace

_NET = f"{layout.SUMO_FOLDER}/{layout.NET_FILE}"
_STATUS = DamagedFile(layout.STATUS_FILE, "its own checksum", "another one")
_LINE = re.compile(rb"([0-9a-f]{64})  (.+)")


def see_to_run(workspace: Workspace, run: Path, *, repair: bool) -> Iterator[RepairStep]:
    """Yield a step if a run is damaged, or has no checksums; none for one that is going on."""
    if is_locked(run) or not _is_run(run):
        return
    damaged = _list_damage(run)
    step = RepairStep("run", run.name, "found", listed(damaged))
    if damaged:
        yield _repair_files(workspace, run, damaged, step) if repair else step
    elif without_sums(run):
        if repair:
            with run_lock(run):
                (seal_start if unfinished(run) else seal_run)(run)
        yield replace(step, action="sealed" if repair else "found", words=NO_SUMS)


def _is_run(run: Path) -> bool:
    names = (layout.SUMMARY_FILE, layout.STATUS_FILE, SUMS_FILE)
    return any((run / name).is_file() for name in names)


def _list_damage(run: Path) -> list[DamagedFile]:
    damaged = damaged_in(run)
    return [*damaged, _STATUS] if read_status(run) == {} else damaged


def _repair_files(
    workspace: Workspace, run: Path, damaged: Sequence[DamagedFile], step: RepairStep
) -> RepairStep:
    with run_lock(run):
        try:
            done = [
                _rebuild_file(workspace, run, damaged_file)
                for damaged_file in _order_for_repair(damaged)
            ]
            if left := _list_damage(run):
                raise InputError(f"still: {listed(left)}")
        except (OdscenError, ValueError, KeyError) as error:
            root = workspace.root if run.parent == workspace.runs else run.parent
            place = set_aside(run, root)
            words = f"{step.words}; cannot be rebuilt: {error}"
            return replace(step, action="set aside", words=words, place=str(place))
    return replace(step, action="rebuilt", words=f"{step.words}; {'; '.join(done)}")


def _order_for_repair(damaged: Sequence[DamagedFile]) -> list[DamagedFile]:
    """The list of checksums first, as others are compared with it; the report last."""
    if any(damaged_file.file == SUMS_FILE for damaged_file in damaged):
        return [damaged_file for damaged_file in damaged if damaged_file.file == SUMS_FILE]
    figures = [damaged_file for damaged_file in damaged if _is_figures(damaged_file.file)][
        :1
    ]  # all are written at once
    others = [damaged_file for damaged_file in damaged if not _is_figures(damaged_file.file)]
    return sorted(
        [*others, *figures], key=lambda damaged_file: damaged_file.file == layout.REPORT_FILE
    )


def _rebuild_file(workspace: Workspace, run: Path, damaged_file: DamagedFile) -> str:
    """Rebuild a file of a run; what was done, in words.

    Raises
    ------
    InputError
        If it cannot be rebuilt.
    """
    if damaged_file.file == SUMS_FILE:
        return _list_again(run)
    if damaged_file.file == _NET:
        return _net_again(workspace, run, damaged_file)
    if damaged_file.file == layout.STATUS_FILE:
        return _status_again(run)
    if _is_figures(damaged_file.file):
        return _figures_again(run)
    if damaged_file.file == layout.REPORT_FILE:
        return _report_again(workspace, run)
    if damaged_file.expected == MISSING:  # somebody has put it there
        return _set_file_aside(run, damaged_file.file)
    if damaged_file.file == layout.LOG_FILE or (
        damaged_file.file == layout.SUMMARY_FILE and unfinished(run)
    ):
        return _set_file_aside(run, damaged_file.file)
    raise InputError(f"nothing else says what was in {damaged_file.file}")


def _is_figures(name: str) -> bool:
    return name == layout.FIGURES_FILE or name.startswith(f"{layout.FIGURES_FOLDER}/")


def _list_again(run: Path) -> str:
    """Write the list anew if its lines, but perhaps the one that is damaged, are true."""
    lines = (run / SUMS_FILE).read_bytes().splitlines()
    found = [_LINE.fullmatch(line) for line in lines[:-1]]
    names = [match[2].decode("utf-8", "replace") for match in found if match]
    wrong = [match for match in found if match is None or not _holds_true(run, match)]
    if len(wrong) > 1:
        raise InputError(f"{len(wrong)} of its lines are not true")
    whole = {name: file_digest(run / name) for name in names if (run / name).is_file()}
    if wrong:  # the damage is in this line, so that its file is looked for among the others
        (seal_start if unfinished(run) else _seal_all)(run)
    else:
        write_sums(run, whole)
    return f"wrote {SUMS_FILE} anew"


def _seal_all(run: Path) -> None:
    (run / SUMS_FILE).unlink()
    seal_run(run)


def _holds_true(run: Path, match: re.Match[bytes]) -> bool:
    with suppress(OSError, ValueError):
        return file_digest(run / match[2].decode()) == match[1].decode()
    return False


def _net_again(workspace: Workspace, run: Path, damaged_file: DamagedFile) -> str:
    """Take the network of the run's map, if it is the same."""
    known = about(run) if unfinished(run) else read_summary(run)
    entry = workspace.map_for(str(known.get("map")), str(known.get("map_sha256")))
    net = entry.checked("net")
    if file_digest(net) != damaged_file.expected:
        raise InputError(f"map {entry.name!r} has another network today")
    target = run / damaged_file.file
    target.unlink(missing_ok=True)
    try:
        os.link(net, target)
    except OSError:
        shutil.copyfile(net, target)
    return f"took the network of map {entry.name!r}"


def _status_again(run: Path) -> str:
    plan = Plan.from_json((run / layout.PLAN_FILE).read_text(encoding="utf-8"))
    number = last_number(run)
    write_status(run, plan, read_checkpoint(run, number) if number else None)
    return f"wrote {layout.STATUS_FILE} anew"


def _figures_again(run: Path) -> str:
    summary = read_summary(run)
    outcomes = actors_from_json((run / layout.ACTORS_FILE).read_text(encoding="utf-8"))
    end, meso = float(summary["sim_seconds"]), bool(summary.get("meso"))
    times = AnalysisTimes.of_summary(summary)
    write_figures(run, read_run_data(run, outcomes, end=end, meso=meso, times=times))
    return "computed the figures anew"


def _report_again(workspace: Workspace, run: Path) -> str:
    summary, loaded = read_summary(run), None
    with suppress(InputError):  # the map is not there any more
        loaded = load_map(workspace.map_for(summary["map"], summary["map_sha256"]))
    write_report(run, summary, loaded=loaded)
    seal_again(run, layout.REPORT_FILE)
    return "wrote the report anew" if loaded else "wrote the report anew, without the map"


def _set_file_aside(run: Path, name: str) -> str:
    """Set a file aside that nothing is computed from."""
    place = set_aside(run / name, run.parent)
    sums = read_sums(run) or {}
    write_sums(run, {key: digest for key, digest in sums.items() if key != name})
    return f"set {name} aside: {place}"
