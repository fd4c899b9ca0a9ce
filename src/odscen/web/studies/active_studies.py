"""Studies in the folder ``studies`` of a workspace: one is carried out at a time."""

from __future__ import annotations

import itertools
import os
import shutil
from contextlib import suppress
from typing import TYPE_CHECKING

from odscen.app.scenarios import SUFFIX
from odscen.base.atomic_folders import discard
from odscen.base.checksums import check_files
from odscen.base.errors import ConflictError, InputError, NotFoundError
from odscen.experiments.plan import StudyPlan
from odscen.experiments.studies import (
    PAGE_FILE,
    STUDY_FILE,
    TABLE_FILE,
    begin_study_of,
    carry_out_study,
    read_study,
    study_state,
)
from odscen.experiments.study_page import SHOWN_FIGURES, write_study_page
from odscen.experiments.work import LocalExecutor
from odscen.maps.folder_names import check_name, plain_name
from odscen.scenario.document.problems import validated
from odscen.web.studies.study_messages import MOST_PAGE_RUNS, StudyInfo, StudyProblem
from odscen.web.studies.under_way import OneAtATime, UnderWay

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from odscen.experiments.studies import StudyState
    from odscen.maps.store import Workspace
    from odscen.web.studies.study_messages import ResumeStudy, StudyStatus, StudyWish

MOST_PROBLEMS = 20
_DOWNLOADS = (TABLE_FILE, PAGE_FILE)


class Studies:
    """Studies of a workspace, under way and finished, whatever has begun them."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace
        self._folder = workspace.studies
        self._work = OneAtATime("study")

    def start(self, wish: StudyWish) -> str:
        """Begin a study and carry it out; its name.

        Raises
        ------
        InputError
            If the plan, or a scenario of it, cannot be used.
        ConflictError
            If there is one of that name, or another one is under way.
        """
        self._refuse_unknown(wish.scenarios)
        plan = _plan_of_wish(wish)
        with self._work.lock:
            self._work.refuse_more()
            folder = self._free_folder(wish)
            grid = begin_study_of(self._workspace, plan, folder, beside=self._workspace.scenarios)
            if grid.count > MOST_PAGE_RUNS:
                shutil.rmtree(folder)
                raise InputError(
                    f"these are {grid.count:,} runs, the page takes {MOST_PAGE_RUNS:,}: "
                    "odscen study run takes more"
                )
            self._carry_out(folder, wish.processes)
        return folder.name

    def resume(self, name: str, wish: ResumeStudy) -> None:
        """Run what is missing of a study, or what failed.

        Raises
        ------
        NotFoundError
            If there is none of that name.
        ConflictError
            If there is nothing to do, or a study is under way.
        """
        folder = self._folder_of(name)
        with self._work.lock:
            self._work.refuse_more()
            state = study_state(folder)
            if state.active:
                raise ConflictError(f"another process works on study {name!r}")
            if state.done and not (wish.failed and state.problems):
                raise ConflictError(
                    f"all runs of study {name!r} have ended; there is nothing to resume"
                )
            self._carry_out(folder, wish.processes, again=wish.failed)

    def stop(self, name: str) -> None:
        """Stop a study; runs that are under way are given up, those that have ended are kept.

        Raises
        ------
        NotFoundError, ConflictError
            If there is none of that name, or this server does not carry it out.
        """
        self._folder_of(name)
        self._work.stop(name)

    def remove(self, name: str) -> None:
        """Delete a study.

        Raises
        ------
        NotFoundError, ConflictError
            If there is none of that name, or it is under way.
        """
        folder = self._folder_of(name)
        with self._work.lock:
            self._work.forget(name)
            if study_state(folder).active:
                raise ConflictError(f"another process works on study {name!r}")
            discard(folder)

    def info(self, name: str) -> StudyInfo:
        """How far a study is; :class:`NotFoundError` if there is none of that name."""
        folder = self._folder_of(name)
        known, live = self._work.known(name), self._work.live(name)
        grid, state = read_study(folder), study_state(folder)
        return StudyInfo(
            study=name,
            state=_status_of_study(state, known, live),
            elsewhere=state.active and live is None,
            scenarios=list(grid.sources),
            variants=list(grid.plan.variant_names),
            seeds=len(grid.plan.seeds),
            runs=state.runs,
            ended=state.ended,
            completed=state.counts["completed"],
            problems=[
                StudyProblem(words=words, runs=count)
                for words, count in state.problems[:MOST_PROBLEMS]
            ],
            seconds_left=None if live is None else live.seconds_left(state.runs),
            error=None if known is None else known.error,
            changed=folder.stat().st_mtime,
        )

    def rows(self) -> list[StudyInfo]:
        """All studies, the newest last."""
        folders = self._folder.iterdir() if self._folder.is_dir() else ()
        found = []
        for folder in sorted(folders):
            if (folder / STUDY_FILE).is_file() and not folder.name.startswith("."):
                with suppress(InputError, OSError):  # of another version, or just removed
                    found.append(self.info(folder.name))
        return sorted(found, key=lambda row: (row.changed, row.study))

    def folder(self, name: str) -> Path:
        """Folder of a study; :class:`NotFoundError` if there is none of that name."""
        return self._folder_of(name)

    def file(self, name: str, path: str) -> Path:
        """A file of a study: its table, or its page, which is written when it is asked for.

        Raises
        ------
        NotFoundError
            If there is no such study, or file, or the study has not ended.
        """
        folder = self._folder_of(name)
        if path == PAGE_FILE:
            return write_study_page(folder, SHOWN_FIGURES, folder / PAGE_FILE)
        if path not in _DOWNLOADS or not (folder / path).is_file():
            raise NotFoundError(f"file of study {name!r}", path, list(_DOWNLOADS))
        check_files(folder, only=(path,))
        return folder / path

    def close(self) -> None:
        """Stop what is under way; it can be resumed."""
        self._work.close()

    def _carry_out(self, folder: Path, processes: int, *, again: bool = False) -> None:
        def work(known: UnderWay) -> None:
            def done(ended: int, _runs: int) -> None:
                known.ended = ended

            executor = LocalExecutor(
                self._workspace, min(processes, os.cpu_count() or 1), known.check
            )
            carry_out_study(folder, executor, again=again, done=done)

        state = study_state(folder)
        before = state.counts["completed"] if again else state.ended
        self._work.start(folder.name, before, work)

    def _refuse_unknown(self, scenarios: Iterable[str]) -> None:
        known = [
            scenario_file.name.removesuffix(SUFFIX) for scenario_file in self._scenario_files()
        ]
        for name in scenarios:
            if name not in known:
                raise NotFoundError("scenario", name, known)

    def _scenario_files(self) -> list[Path]:
        return sorted(self._workspace.scenarios.glob(f"*{SUFFIX}"))

    def _folder_of(self, name: str) -> Path:
        folder = self._folder / check_name(name, what="study")
        if not (folder / STUDY_FILE).is_file():
            raise NotFoundError("study", name, [row.study for row in self.rows()])
        return folder

    def _free_folder(self, wish: StudyWish) -> Path:
        if wish.name is not None:
            folder = self._folder / check_name(wish.name, what="study")
            if folder.exists():
                raise ConflictError(f"there is a study {wish.name!r}; give this one another name")
            return folder
        stem = plain_name(wish.scenarios[0])[:56]
        names = (f"{stem}-{number}" for number in itertools.count(1))
        return next(self._folder / name for name in names if not (self._folder / name).exists())


def _plan_of_wish(wish: StudyWish) -> StudyPlan:
    runs = {} if wish.until is None else {"until": wish.until}
    data = {
        "name": wish.name or wish.scenarios[0],
        "scenarios": [
            f"{check_name(scenario, what='scenario')}{SUFFIX}" for scenario in wish.scenarios
        ],
        "seeds": wish.seeds,
        "variant": [
            {"name": preset, "edits": [{"kind": "set_environment", "preset": preset}]}
            for preset in wish.weather
        ],
        "run": runs,
    }
    return validated(StudyPlan, data)


def _status_of_study(
    state: StudyState, known: UnderWay | None, live: UnderWay | None
) -> StudyStatus:
    if live is not None or state.active:
        return "running"
    if state.done and (state.folder / TABLE_FILE).is_file():
        return "done"
    return "stopped" if known is None or known.error is None else "failed"
