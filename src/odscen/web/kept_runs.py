"""Runs whose folder is there: what they say of themselves, and their files."""

from __future__ import annotations

import hashlib
import json
import re
from contextlib import suppress
from typing import TYPE_CHECKING

from pydantic import ValidationError

from odscen.app.scenarios import SUFFIX
from odscen.base.checksums import read_checked, read_sums
from odscen.base.durations import clock
from odscen.base.errors import ConflictError, DamagedError, InputError, NotFoundError, OdscenError
from odscen.maps.folder_names import check_name
from odscen.runs import layout
from odscen.runs.deferred_figures import measured_summary
from odscen.runs.ended import RECORDS_ONLY, read_summary
from odscen.runs.run_status import going, read_status, unfinished, unfinished_words
from odscen.runs.run_sums import REPAIR, check_run_files, damaged_in
from odscen.sumo.runner.long_runs import about
from odscen.web.wire.run_messages import (
    RunContent,
    RunFile,
    RunInfo,
    RunProgress,
    RunSlices,
    RunState,
)
from odscen.web.wire.summary_messages import RunSummary

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

SUFFIXES = (".html", ".json", ".csv", ".parquet", ".log")
"""Of files that can be downloaded."""
_NUMBER = r"-[1-9]\d*"
_INNER = {layout.SETTINGS_FILE, layout.STATUS_FILE}
_INNER_FOLDERS = {layout.SUMO_FOLDER, layout.SLICES_FOLDER}


class KeptRuns:
    """Folders of runs, of this server or of anybody else."""

    def __init__(self, runs: Path) -> None:
        self._runs = runs
        self._checked: dict[str, FileStates] = {}

    def folder(self, run: str) -> Path:
        """Folder of a run that is finished, or in slices and not.

        Raises
        ------
        NotFoundError
            If there is none.
        """
        folder = self._runs / check_name(run, what="run")
        if _file_of_run(folder) is None:
            raise NotFoundError("run", run, self.by_age())
        return folder

    def whole(self, run: str) -> Path:
        """Folder of a run whose files are all as they were written, with all of its figures.

        They are compared with their checksums when a run is opened first, and after any change.

        Raises
        ------
        NotFoundError
            If there is no such run.
        DamagedError
            If one is not as it was written.
        """
        folder = self.folder(run)
        states = _file_states(folder)
        if self._checked.get(run) != states:
            check_run_files(folder)
            if self._records_only(folder):
                measured_summary(folder)
                states = _file_states(folder)
            self._checked[run] = states
        return folder

    def complete(self, run: str) -> None:
        """Have the figures of a run computed if it has its records only; damage shows elsewhere."""
        with suppress(OdscenError):
            if self._records_only(self.folder(run)):
                self.whole(run)

    def _records_only(self, folder: Path) -> bool:
        """Whether its figures have not been computed yet."""
        try:
            return not unfinished(folder) and bool(read_summary(folder).get(RECORDS_ONLY))
        except InputError:
            return False

    def finished_file(self, run: str, name: str) -> Path:
        """A file that a run has written at its end.

        Raises
        ------
        ConflictError
            If the run has not ended; says how to resume it.
        NotFoundError
            If it was never written.
        DamagedError
            If a file of the run is not as it was written.
        """
        path = self.whole(run) / name
        if not path.is_file():
            if (words := unfinished_words(path.parent)) is not None:
                raise ConflictError(words)
            raise NotFoundError(f"{name} of run", run, [])
        return path

    def by_age(self) -> list[str]:
        """Names of all runs, the newest last."""
        folders = self._runs.iterdir() if self._runs.is_dir() else ()
        runs_by_age = [
            (file.stat().st_mtime, path.name) for path in folders if (file := _file_of_run(path))
        ]
        return [name for _, name in sorted(runs_by_age)]

    def info(self, run: str) -> RunInfo:
        """What a run says of itself."""
        folder = self.folder(run)
        summary = self.summary(run)
        if unfinished(folder) or not (folder / layout.SUMMARY_FILE).is_file():
            return _describe_unfinished(folder, summary)
        state: RunState = "failed"
        if summary is not None and summary.status == "completed":
            state = "stopped" if summary.stopped else "completed"
        damage = _summary_damage(folder)
        if damage is not None:
            state = "failed"
        return RunInfo(
            run=run,
            state=state,
            scenario=run if summary is None else summary.scenario,
            map=None if summary is None else summary.map,
            summary=summary,
            error=damage or (None if summary is None else summary.error),
            finished=self.end_time(run),
        )

    def summary(self, run: str) -> RunSummary | None:
        """Key figures; ``None`` until there are some, or if they cannot be read."""
        try:
            return RunSummary.model_validate_json(
                (self._runs / run / layout.SUMMARY_FILE).read_bytes()
            )
        except (OSError, ValidationError):
            return None

    def end_time(self, run: str) -> float | None:
        """When the summary was written, seconds since 1970."""
        try:
            return (self._runs / run / layout.SUMMARY_FILE).stat().st_mtime
        except OSError:
            return None

    def slices(self, run: str) -> RunSlices | None:
        """How much of a long run that has not ended is complete; ``None`` for others."""
        status = read_status(self._runs / run)
        if status is None:
            return None
        return RunSlices(
            done=status.get("slices", 0),
            length=status.get("slice_length") or 0.0,
            time=status.get("time", 0.0),
        )

    def content(self, run: str) -> RunContent:
        """What a run's scenario says: a digest without its name and description, and its counts."""
        try:
            folder = self.folder(run)
            document = json.loads(read_checked(folder, layout.SCENARIO_FILE, read_sums(folder)))
            document.pop("name", None)
            document.pop("description", None)
            demand = document.get("demand", {})
            counts = sum(len(part["rows"]) for part in demand.get("counts", ()))
            clock_time = float(demand.get("clock", 0.0))
        except DamagedError as error:
            if (folder / layout.SCENARIO_FILE).is_file():
                raise
            raise NotFoundError("scenario of run", run, []) from error
        except (ValueError, RecursionError, AttributeError, KeyError, TypeError) as error:
            raise NotFoundError("scenario of run", run, []) from error
        digest = hashlib.sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()
        return RunContent(digest=digest, counts=counts, clock=clock_time)

    def files(self, run: str) -> list[RunFile]:
        """Files of a run that can be downloaded, by name."""
        folder = self.folder(run)
        return [
            RunFile(name=path.relative_to(folder).as_posix(), size=path.stat().st_size)
            for path in sorted(_files_of_run(folder))
        ]

    def file(self, run: str, name: str) -> Path:
        """One of :meth:`files`; :class:`NotFoundError` for any other name.

        Raises
        ------
        DamagedError
            If it is not as it was written.
        """
        known = [file.name for file in self.files(run)]
        if name not in known:
            raise NotFoundError(f"file of run {run!r}", name, known)
        folder = self.folder(run)
        if wrong := damaged_in(folder, only=name):
            raise DamagedError(str(folder), wrong, advice=REPAIR)
        return folder / name


def _files_of_run(folder: Path) -> Iterator[Path]:
    for path in (*folder.glob("*"), *folder.glob("*/*")):
        inner = path.name in _INNER or path.parent.name in _INNER_FOLDERS
        if path.is_file() and path.suffix in SUFFIXES and not inner:
            yield path


def _file_of_run(folder: Path) -> Path | None:
    """Return the file that makes a folder a run: its summary, or its status if it has not ended."""
    files = (folder / name for name in (layout.SUMMARY_FILE, layout.STATUS_FILE))
    return next((file for file in files if file.is_file()), None)


FileStates = dict[str, tuple[int, int]]
"""Size and time of change of each file of a run, by its path in it.

The time is that of the file's node, which a program cannot set back.
"""


def _file_states(folder: Path) -> FileStates:
    found = ((path, path.stat()) for path in folder.rglob("*") if path.is_file())
    return {str(path): (state.st_size, state.st_ctime_ns) for path, state in found}


def _summary_damage(folder: Path) -> str | None:
    """What is wrong with a run as far as its summary shows, in words."""
    try:
        read_checked(folder, layout.SUMMARY_FILE, read_sums(folder))
        read_summary(folder)
    except InputError as error:
        return f"The run is damaged: {error}\n{REPAIR}."
    return None


def _describe_unfinished(folder: Path, summary: RunSummary | None) -> RunInfo:
    """Describe a run in slices that has not ended, from what it last said of itself."""
    status = read_status(folder) or {}
    at, until = float(status.get("time", 0.0)), float(status.get("until", 0.0))
    state: RunState = going(folder) or "interrupted"
    message = (
        f"Interrupted at {clock(at)} of {clock(until)} h. odscen resume {folder.name} resumes it."
    )
    if not status:
        message = f"Interrupted; {layout.STATUS_FILE} is damaged. {REPAIR}."
    if summary is not None and summary.error:
        message = f"{message}\n{summary.error}"
    return RunInfo(
        run=folder.name,
        state=state,
        scenario=str(status.get("scenario", folder.name)),
        map=about(folder).get("map"),
        progress=RunProgress(
            time=at,
            until=until,
            **{key: status.get(key, 0) for key in ("running", "departed", "arrived", "planned")},
        ),
        error=message if state == "interrupted" else None,
        slices=KeptRuns(folder.parent).slices(folder.name),
    )


def numbered_stem(scenario: str) -> str:
    """Beginning of the ids of a scenario's runs that a server has started; a number follows."""
    return scenario[:56]


def names_of_runs(scenario: str, scenarios: Path) -> re.Pattern[str]:
    """Ids of a scenario's runs: numbered ones of a server, and the one that ``odscen run`` makes.

    That has the name of the scenario; where it is a numbered one of another scenario in the folder
    ``scenarios``, it counts as that.
    """
    numbered = rf"{re.escape(numbered_stem(scenario))}{_NUMBER}"
    other = re.sub(rf"{_NUMBER}$", "", scenario)
    if other != scenario and (scenarios / f"{other}{SUFFIX}").is_file():
        return re.compile(numbered)
    return re.compile(rf"{re.escape(scenario)}|{numbered}")
