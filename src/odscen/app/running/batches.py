"""Several runs: checked, prepared, simulated and reported as one is, some at a time.

>>> import odscen
>>> workspace = odscen.Workspace.open()
>>> workspace.add_map(Path("Town01.xodr"))
>>> paths = odscen.generate(workspace)
>>> runs = odscen.run_many(workspace, paths, settings=odscen.RunSettings(until=300.0))
"""

from __future__ import annotations

import threading
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import replace
from typing import TYPE_CHECKING

from odscen.app.running.interruptible import Interruptible
from odscen.app.running.runs import carry_out, check_given, prepare_run
from odscen.app.scenarios import scenario_name
from odscen.base.errors import InputError
from odscen.runs.new_run import refuse_finished_run
from odscen.runs.reporter import SILENT, Progress, Reporter
from odscen.runs.run_settings import AS_DESIGNED
from odscen.sumo.runner.forked_worker import expect_runs
from odscen.sumo.runner.run_folder import SumoPreparedRun

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from concurrent.futures import Future

    from odscen.app.running.runs import CheckedRun
    from odscen.base.given_files import GivenPath
    from odscen.maps.store import Workspace
    from odscen.runs.finished_run import Run
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario

_LISTEN = 0.2
"""Wall seconds after which a wait looks for Ctrl-C."""
_GRACE = 2.0
"""Wall seconds in which a run that is prepared may come to where it is stopped in good order."""


class _StoppedError(Exception):
    """Another run of the same call has failed to start, or the user has interrupted."""


class _StoppableReporter(Reporter):
    """Passes on what is reported of one of several runs, and ends it with the others."""

    def __init__(self, own: Reporter, name: str, stopping: threading.Event) -> None:
        self._own, self._name, self._stopping = own, name, stopping

    def started(self) -> None:
        self._own.started()

    def advanced(self, progress: Progress) -> None:
        if self._stopping.is_set():  # ends the worker process of the run too
            raise _StoppedError
        self._own.advanced(progress)

    def said(self, words: str) -> None:
        named = words.startswith(f"{self._name}: ")
        self._own.said(words if named else f"{self._name}: {words}")

    def finished(self, run: Run) -> None:
        self._own.finished(run)

    @property
    def cancelled(self) -> bool:
        return self._stopping.is_set() or self._own.cancelled


def run_all(
    runs: Sequence[CheckedRun],
    *,
    processes: int = 1,
    reports: bool = True,
    figures: bool = True,
    reporter: Reporter = SILENT,
    refused: Callable[[str, InputError], None] | None = None,
) -> tuple[Run, ...]:
    """Prepare and carry out several runs.

    Parameters
    ----------
    processes
        How many run at a time.
    reports
        Whether reports are written.
    figures
        Whether figures of runs without a report are computed at once, see :func:`run_many`.
    reporter
        Its :meth:`~odscen.runs.reporter.Reporter.of_run` hears of each run, by its name, from the
        threads that wait for the runs; ``finished`` in the order in which they end.
    refused
        Called with the name of a run that cannot be prepared, and why; the others go on. Without
        it, the first such run ends all.

    Returns
    -------
    tuple of Run
        In the order of ``runs``, without those refused.
    """
    stopping, preparing = threading.Event(), Interruptible()
    expect_runs(len(runs))

    def carry_out_one(run: CheckedRun) -> Run | None:
        own = _StoppableReporter(reporter.of_run(run.name), run.name, stopping)
        try:
            with preparing.computing():
                prepared = prepare_run(run, reporter=own)
            if isinstance(prepared, SumoPreparedRun) and prepared.plan.slice_length is not None:
                own.said(str(prepared.expected))
            return carry_out(run, prepared, reporter=own, reports=reports, figures=figures)
        except InputError as error:
            if refused is None:
                raise
            refused(run.name, error)
            return None

    with ThreadPoolExecutor(max_workers=max(1, processes)) as pool:
        futures: list[Future[Run | None]] = []
        try:
            futures.extend(pool.submit(carry_out_one, run) for run in runs)
            # Polars has system calls go on after Ctrl-C (pola-rs/polars, issue 21739): a wait
            # without a timeout would hear of it when it is over.
            running = set(futures)
            while running:
                ended, running = wait(running, timeout=_LISTEN, return_when=FIRST_EXCEPTION)
                for future in ended:
                    future.result()
            results = (future.result() for future in futures)
            return tuple(run for run in results if run is not None)
        except BaseException:
            stopping.set()
            pool.shutdown(wait=False, cancel_futures=True)
            try:  # runs come to where they stop; what is large and being prepared is broken off
                wait(futures, timeout=_GRACE)
            finally:
                preparing.break_off()
            raise


def run_many(
    workspace: Workspace,
    scenarios: Sequence[Scenario | GivenPath],
    *,
    settings: RunSettings = AS_DESIGNED,
    seeds: Sequence[int] | None = None,
    out: GivenPath | None = None,
    overwrite: bool = False,
    processes: int = 1,
    reports: bool = True,
    figures: bool = True,
    reporter: Reporter = SILENT,
) -> tuple[Run, ...]:
    """Check scenarios, run them, several at a time, and write their reports.

    Parameters
    ----------
    workspace
        Has the maps.
    scenarios
        Scenarios, or their files.
    settings
        How each is run.
    seeds
        Runs each scenario once with each of these, as ``NAME-seed-N``.
    out
        Folder that gets one folder per scenario; the workspace's ``runs`` if not given.
    overwrite
        Whether runs that have ended are replaced in ``out``; in the workspace's ``runs`` they are.
    processes
        How many run at a time.
    reports
        Whether reports are written; later :func:`odscen.app.running.reports.renew_report` writes
        one.
    figures
        Whether figures of runs without a report are computed at once. Otherwise they are
        computed from its records when it is opened: by ``run.summary`` and ``run.figures``,
        ``odscen report``, the page, comparisons. Where something is expected of a run they are
        computed at once.
    reporter
        See :func:`run_all`.

    Returns
    -------
    tuple of Run
        In the order of ``scenarios``, and of ``seeds`` for each; completed or failed, see
        ``status``.

    Raises
    ------
    ScenarioError
        If a scenario has errors; none is run then.
    NotFoundError
        If the workspace does not have a map.
    ConflictError
        If a run that has ended is in a folder and is not to be replaced; none is run then.
    WorkspaceError
        If a folder cannot be written, or the disk cannot hold a run.
    """
    names: set[str] = set()
    runs = []
    for scenario in scenarios:
        own = _own_name(scenario_name(scenario), names)
        checked = check_given(workspace, scenario, name=own, out=out, settings=settings)
        for problem in checked.unsupported:
            reporter.of_run(own).said(f"{own}: {problem.message}")
        runs += [checked] if seeds is None else [_with_seed(checked, seed) for seed in seeds]
    if out is not None and not overwrite:
        for run in runs:
            refuse_finished_run(run.folder)
    return run_all(runs, processes=processes, reports=reports, figures=figures, reporter=reporter)


def _with_seed(run: CheckedRun, seed: int) -> CheckedRun:
    name = f"{run.name}-seed-{seed}"
    settings = replace(run.settings, seed=seed)
    return replace(run, name=name, folder=run.folder.with_name(name), settings=settings)


def _own_name(name: str, taken: set[str]) -> str:
    """Return a name that no other scenario of the same call has."""
    own, number = name, 1
    while own in taken:
        number += 1
        own = f"{name}-{number}"
    taken.add(own)
    return own
