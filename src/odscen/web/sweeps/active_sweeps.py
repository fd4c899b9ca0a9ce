"""Sweeps that a page has started: one at a time, in a thread that waits for its runs."""

from __future__ import annotations

import itertools
import os
import re
import shutil
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from odscen.base.atomic_folders import discard
from odscen.base.checksums import check_files
from odscen.base.errors import ConflictError, InputError, NotFoundError
from odscen.experiments.ineffective import variables_without_effect
from odscen.experiments.sweeps import (
    PAGE_FILE,
    PATIENCE,
    SWEEP_FILE,
    TABLE_FILE,
    CaseRuns,
    SweepSettings,
    begin_sweep,
    estimate,
    opened_case,
    read_plan,
    read_sweep,
    read_table,
    refuse_unknown,
    settings_from_dict,
    sweep,
)
from odscen.maps.folder_names import check_name
from odscen.runs import layout
from odscen.scenario.sweeps.sweep_plan import plan_from_data
from odscen.sumo.worker.behaviour.behaviour_doors import is_installed
from odscen.web.studies.under_way import OneAtATime, UnderWay
from odscen.web.sweeps.sweep_messages import PlannedSweep, SweepInfo

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.experiments.sweeps import Sweep
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.sweeps.sweep_plan import SweepPlan
    from odscen.web.sweeps.sweep_messages import SweepState, SweepWish

_FILES = re.compile(
    rf"{re.escape(PAGE_FILE)}|{re.escape(TABLE_FILE)}|cases/case-\d+(\.scenario\.json|\.xosc)"
    rf"|runs/case-\d+/{re.escape(layout.REPORT_FILE)}"
)
"""What of a sweep can be downloaded."""


class Sweeps:
    """Sweeps in the folder ``sweeps`` of a workspace, going on and finished."""

    def __init__(self, workspace: Workspace) -> None:
        self._workspace = workspace
        self._folder = workspace.sweeps
        self._work = OneAtATime("sweep")

    def plan(self, scenario: Scenario, wish: SweepWish) -> PlannedSweep:
        """Say what a sweep will take; runs one case of it.

        Raises
        ------
        InputError
            If it is not possible.
        """
        plan, settings = plan_from_data(wish.plan), _settings_of_wish(wish)
        count, tried = len(plan.cases()), estimate(
            self._workspace, scenario, plan, settings=settings
        )  # fmt: skip
        processes = _limit_processes(wish.processes)
        return PlannedSweep(
            cases=count,
            tried=tried.case,
            case_seconds=tried.seconds,
            seconds=tried.seconds * count / min(processes, count) if tried.whole else None,
            disk=tried.disk * count,
            free=shutil.disk_usage(self._workspace.root).free,
            processes=processes,
            patience=PATIENCE,
            without_effect=[
                f"{name} has no effect: {reason}"
                for name, reason in variables_without_effect(scenario, plan).items()
            ],
        )

    def start(self, name: str, scenario: Scenario, wish: SweepWish) -> str:
        """Start a sweep of a scenario; its id.

        Raises
        ------
        InputError
            If the plan, a limit or a figure is not possible.
        ConflictError
            If another sweep is under way.
        """
        plan, settings = plan_from_data(wish.plan), _settings_of_wish(wish)
        refuse_unknown(plan.names, scenario)
        CaseRuns(scenario, self._folder, settings)  # an unknown figure or limit is refused
        plan.cases()
        with self._work.lock:
            self._work.refuse_more()
            folder = self._free_folder(name)
            begin_sweep(folder, scenario, plan, settings)
            self._submit_sweep(folder.name, scenario, plan, settings, wish.processes)
        return folder.name

    def resume(self, name: str, processes: int) -> None:
        """Run what is missing of a sweep.

        Raises
        ------
        NotFoundError
            If there is none of that name.
        ConflictError
            If nothing is missing, or a sweep is under way.
        InputError
            If it is driven by code that only its folder names.
        """
        folder = self._folder_of(name)
        scenario, plan, description = read_sweep(folder)
        with self._work.lock:
            self._work.refuse_more()
            if _is_whole(folder):
                raise ConflictError(
                    f"sweep {name!r} has all of its cases; there is nothing to resume"
                )
            settings = settings_from_dict(description)
            if settings.behaviour is not None and not is_installed(settings.behaviour):
                raise InputError(
                    f"sweep {name!r} is driven by code that its folder names, "
                    f"{settings.behaviour.shown!r}; what a folder says is not executed: resume it "
                    "with odscen sweep, which names it again"
                )
            self._submit_sweep(name, scenario, plan, settings, processes)

    def stop(self, name: str) -> None:
        """Stop a sweep; cases that are under way are given up, those that have ended are kept.

        Raises
        ------
        NotFoundError, ConflictError
            If there is none of that name, or it is not under way.
        """
        self._folder_of(name)
        self._work.stop(name)

    def remove(self, name: str) -> None:
        """Delete a sweep with its runs.

        Raises
        ------
        NotFoundError, ConflictError
            If there is none of that name, or it is under way.
        """
        folder = self._folder_of(name)
        with self._work.lock:
            self._work.forget(name)
            discard(folder)

    def info(self, name: str) -> SweepInfo:
        """How far a sweep is; :class:`NotFoundError` if there is none of that name."""
        folder = self._folder_of(name)
        plan, _ = read_plan(folder)
        cases, state = len(plan.cases()), self._state_of_sweep(name, folder)
        known, live = self._work.known(name), self._work.live(name)
        ended = _count_ended(folder) if live is None else max(live.ended, live.before)
        safe, unsafe = _count_verdicts(folder) if state == "done" else (None, None)
        return SweepInfo(
            sweep=name,
            scenario=_scenario_of(name),
            state=state,
            parameters=list(plan.names),
            method=plan.method,
            cases=cases,
            ended=ended,
            seconds_left=None if live is None else live.seconds_left(cases),
            safe=safe,
            unsafe=unsafe,
            error=None if known is None else known.error,
            changed=folder.stat().st_mtime,
        )

    def rows(self, scenario: str | None = None) -> list[SweepInfo]:
        """All sweeps, or those of one scenario, the newest last."""
        folders = self._folder.iterdir() if self._folder.is_dir() else ()
        found = []
        for folder in sorted(folders):
            if (folder / SWEEP_FILE).is_file() and not folder.name.startswith("."):
                with suppress(InputError, OSError):  # not a name of ours, or just removed
                    found.append(self.info(folder.name))
        wanted = [row for row in found if scenario is None or row.scenario == _name_stem(scenario)]
        return sorted(wanted, key=lambda row: (row.changed, row.sweep))

    def table(self, name: str) -> tuple[Sweep, Scenario, dict[str, Any]]:
        """Table of a sweep as far as it is, its scenario, and how it is judged."""
        folder = self._folder_of(name)
        scenario, _, settings = read_sweep(folder)
        return read_table(folder), scenario, settings

    def file(self, name: str, path: str) -> Path:
        """A file of a sweep.

        Raises
        ------
        NotFoundError
            If there is no such sweep, or file, or it is not one for download.
        """
        file = self._folder_of(name) / path
        if not _FILES.fullmatch(path) or not file.is_file():
            raise NotFoundError(f"file of sweep {name!r}", path, [])
        if not path.startswith("runs/"):  # a run has checksums of its own
            check_files(file.parents[path.count("/")], only=(path,))
        return file

    def case(self, name: str, case: str) -> Scenario:
        """One case as a scenario of numbers that runs alone as it did in the sweep.

        Raises
        ------
        NotFoundError
            If there is no such case, or it is not possible.
        """
        return opened_case(self._folder_of(name), case)

    def close(self) -> None:
        """Stop what is under way; it can be resumed."""
        self._work.close()

    def _submit_sweep(
        self,
        name: str,
        scenario: Scenario,
        plan: SweepPlan,
        settings: SweepSettings,
        processes: int,
    ) -> None:
        folder, processes = self._folder / name, _limit_processes(processes)

        def work(known: UnderWay) -> None:
            def done(ended: int, _count: int) -> None:
                known.ended = ended

            sweep(
                self._workspace,
                scenario,
                plan,
                folder,
                settings=settings,
                processes=processes,
                check=known.check,
                done=done,
            )

        self._work.start(name, _count_ended(folder), work)

    def _state_of_sweep(self, name: str, folder: Path) -> SweepState:
        if self._work.live(name) is not None:
            return "running"
        if _is_whole(folder):
            return "done"
        known = self._work.known(name)
        return "stopped" if known is None or known.error is None else "failed"

    def _folder_of(self, name: str) -> Path:
        folder = self._folder / check_name(name, what="sweep")
        if not (folder / SWEEP_FILE).is_file():
            raise NotFoundError("sweep", name, [row.sweep for row in self.rows()])
        return folder

    def _free_folder(self, scenario: str) -> Path:
        numbers = itertools.count(1)
        names = (f"{_name_stem(scenario)}-{number}" for number in numbers)
        return next(self._folder / name for name in names if not (self._folder / name).exists())


def _settings_of_wish(wish: SweepWish) -> SweepSettings:
    return SweepSettings(wish.safe, wish.figures, seed=wish.seed)


def _limit_processes(processes: int) -> int:
    """No more at a time than the machine has cores."""
    return min(processes, os.cpu_count() or 1)


def _name_stem(scenario: str) -> str:
    """Beginning of the names of a scenario's sweeps; a number follows."""
    return scenario[:56]


def _scenario_of(sweep: str) -> str:
    """Name of the scenario of a sweep that a server has started."""
    return re.sub(r"-[1-9]\d*$", "", sweep)


def _is_whole(folder: Path) -> bool:
    return all((folder / name).is_file() for name in (TABLE_FILE, PAGE_FILE))


def _count_ended(folder: Path) -> int:
    return sum(1 for _ in folder.glob(f"runs/case-*/{layout.SUMMARY_FILE}"))


def _count_verdicts(folder: Path) -> tuple[int, int]:
    """How many cases are safe, and how many are not."""
    safe = read_table(folder).table["safe"].to_list()
    return safe.count(True), safe.count(False)
