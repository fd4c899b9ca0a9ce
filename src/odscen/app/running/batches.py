"""Several runs: checked, prepared, simulated and reported as one is, some at a time.

>>> import odscen
>>> workspace = odscen.Workspace.open()
>>> workspace.add_map(Path("Town01.xodr"))
>>> paths = odscen.generate(workspace)
>>> runs = odscen.run_many(workspace, paths, settings=odscen.RunSettings(until=300.0))
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from odscen.app.running.runs import check_given, prepare_run, report_run
from odscen.app.scenarios import scenario_name
from odscen.runs.run_settings import AS_DESIGNED
from odscen.sumo.runner.run_jobs import RunJob
from odscen.sumo.runner.run_jobs import run_many as run_jobs

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from odscen.app.maps import LoadedMap
    from odscen.app.running.runs import CheckedRun
    from odscen.base.errors import InputError
    from odscen.maps.store import Workspace
    from odscen.records.assignment_steps import AssignmentStep
    from odscen.runs.finished_run import Run
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.runner.run_jobs import PreparedRun
    from odscen.sumo.worker.protocol import Progress


def run_all(
    runs: Sequence[CheckedRun],
    *,
    processes: int = 1,
    reports: bool = True,
    figures: bool = True,
    progress: Callable[[RunJob, Progress], None] | None = None,
    done: Callable[[RunJob, Run], None] | None = None,
    refused: Callable[[RunJob, InputError], None] | None = None,
    tell: Callable[[str], None] | None = None,
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
    progress, done
        Called from the threads that wait for the runs, ``done`` in the order in which they end.
    refused
        Called with a run that cannot be prepared, and why; the others go on. Without it, the first
        such run ends all.
    tell
        Called with what the user should know before a long run, and after each iteration of routes.

    Returns
    -------
    tuple of Run
        In the order of ``runs``, without those refused.
    """
    jobs = [_job(run, report=reports, figures=figures, tell=tell) for run in runs]
    return run_jobs(
        jobs, processes=processes, progress=progress, done=done, refused=refused, tell=tell
    )


def run_many(
    workspace: Workspace,
    scenarios: Sequence[Scenario | Path],
    *,
    settings: RunSettings = AS_DESIGNED,
    seeds: Sequence[int] | None = None,
    out: Path | None = None,
    processes: int = 1,
    reports: bool = True,
    figures: bool = True,
    progress: Callable[[RunJob, Progress], None] | None = None,
    done: Callable[[RunJob, Run], None] | None = None,
    tell: Callable[[str], None] | None = None,
) -> tuple[Run, ...]:
    """Check scenarios, run them in SUMO, several at a time, and write their reports.

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
    progress, done
        Called from the threads that wait for the runs, ``done`` in the order in which they end.
    tell
        Called with what the user should know before a long run.

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
    WorkspaceError
        If a folder cannot be written, or the disk cannot hold a run.
    """
    names: set[str] = set()
    runs = []
    for scenario in scenarios:
        own = _own_name(scenario_name(scenario), names)
        checked = check_given(workspace, scenario, name=own, out=out, settings=settings)
        runs += [checked] if seeds is None else [_with_seed(checked, seed) for seed in seeds]
    return run_all(
        runs,
        processes=processes,
        reports=reports,
        figures=figures,
        progress=progress,
        done=done,
        tell=tell,
    )


def _job(
    run: CheckedRun, *, report: bool, figures: bool, tell: Callable[[str], None] | None
) -> RunJob:
    kept: list[LoadedMap] = []  # the map may be removed while the run goes on

    def get_ready() -> PreparedRun:
        kept.append(run.map)
        return prepare_run(run, iterated=None if tell is None else iterated)

    def iterated(step: AssignmentStep) -> None:
        if tell is not None:
            tell(f"{run.name}: {step.words}")

    def finish(folder: Path, summary: Mapping[str, Any]) -> None:
        report_run(folder, summary, kept.pop())

    return RunJob(run.name, get_ready, run.folder, finish if report else None, figures)


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
