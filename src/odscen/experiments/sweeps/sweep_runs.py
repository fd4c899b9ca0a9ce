"""Sweeps: a scenario run with many values of its parameters, or what is missing of them."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from odscen.app.export import export
from odscen.app.running.batches import run_all
from odscen.app.running.runs import check_run
from odscen.app.scenarios import SUFFIX
from odscen.base.durations import clock
from odscen.base.errors import InputError, ScenarioError
from odscen.base.folder_locks import locked
from odscen.base.system_errors import disk_errors
from odscen.base.text_files import write_text
from odscen.experiments.sweeps.sweep_folder import SweepSettings, begin_sweep
from odscen.experiments.sweeps.sweep_table import limits_of, named_cases, rows_of, write_table
from odscen.formats.openscenario.dialect import Dialect
from odscen.records.outcomes import RunStatus
from odscen.runs.finished_run import Run
from odscen.runs.recording import Recording
from odscen.runs.reporter import SILENT, Reporter
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.json_form import dumps
from odscen.scenario.sweeps.sweep_plan import concrete

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from odscen.app.running.runs import CheckedRun
    from odscen.experiments.sweeps.sweep_table import Sweep
    from odscen.maps.store import Workspace
    from odscen.runs.reporter import Progress
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.sweeps.sweep_plan import SweepPlan

WATCHES_CLOSENESS = Recording(emissions=False, criticality=True)
"""What of each case is recorded."""


def sweep(
    workspace: Workspace,
    scenario: Scenario,
    plan: SweepPlan,
    out: Path,
    *,
    settings: SweepSettings | None = None,
    processes: int = 1,
    tell: Callable[[str], None] | None = None,
    reporter: Reporter = SILENT,
    done: Callable[[int, int], None] | None = None,
) -> Sweep:
    """Run every case of a plan; cases that ``out`` has from an earlier, interrupted time are kept.

    Parameters
    ----------
    scenario
        With the parameters.
    out
        Folder of the sweep.
    processes
        How many run at a time.
    tell
        Called with how many cases there are, and, after the first, with what the rest will take.
    reporter
        Hears of each run, from the threads that wait for runs.
    done
        Called from these with how many of how many have ended.

    Raises
    ------
    InputError
        If a parameter, limit or figure is unknown, or no case can be run.
    ConflictError
        If another sweep is in ``out``.
    """
    settings = settings or SweepSettings()
    limits = limits_of(settings)
    if settings.openscenario is not None:
        Dialect.of(settings.openscenario)  # an unknown version is refused before anything runs
    refuse_unknown(plan.names, scenario)
    with disk_errors(f"sweep {out}"), locked(out, what=f"sweep {out.name!r}"):
        cases = named_cases(plan)
        begin_sweep(out, scenario, plan, settings)
        checked, refused = checked_cases(workspace, scenario, cases, out, settings)
        if not checked:
            raise InputError(f"no case of the sweep can be run: {next(iter(refused.values()))}")
        left = [run for run in checked if not has_completed(run.folder)]
        if tell is not None:
            tell(_first_words(len(cases), len(refused), len(left), plan))
        _run(left, len(checked), processes, settings, tell=tell, reporter=reporter, done=done)
        _export(workspace, checked, out / "cases", settings.openscenario)
        rows = rows_of(scenario, cases, out, refused=refused, settings=settings, limits=limits)
        return write_table(out, scenario, plan, rows=rows, limits=limits)


def refuse_unknown(names: Sequence[str], scenario: Scenario) -> None:
    """Raise :class:`InputError` if what is varied is no parameter of the scenario."""
    for name in names:
        if name not in scenario.parameters:
            known = ", ".join(scenario.parameters) or "none"
            raise InputError(f"the scenario has no parameter {name!r}; it has {known}")


def checked_cases(
    workspace: Workspace,
    scenario: Scenario,
    cases: Mapping[str, Mapping[str, float]],
    out: Path,
    settings: SweepSettings,
) -> tuple[list[CheckedRun], dict[str, str]]:
    """Each case as a run, and those that are not possible with the reason."""
    entry = workspace.map_for(scenario.map.name, scenario.map.sha256)
    given = RunSettings(
        seed=settings.seed, recording=WATCHES_CLOSENESS, behaviour=settings.behaviour
    )
    runs, refused = [], {}
    for name, values in cases.items():
        try:
            case = concrete(scenario, values, name=name)
            run = check_run(
                workspace, case, name=name, out=out / "runs", settings=given, entry=entry
            )
        except ScenarioError as error:
            refused[name] = "; ".join([error.problem, *error.problems])
            continue
        file = out / "cases" / f"{name}{SUFFIX}"
        if not file.is_file():
            write_text(file, dumps(case))
        runs.append(run)
    return runs, refused


def _first_words(cases: int, refused: int, left: int, plan: SweepPlan) -> str:
    words = f"{cases} cases of {', '.join(plan.names)}"
    if refused:
        words += f", {refused} of them not possible"
    return f"{words}; {left} to run" if left < cases - refused else words


def _run(
    left: Sequence[CheckedRun],
    count: int,
    processes: int,
    settings: SweepSettings,
    *,
    tell: Callable[[str], None] | None,
    reporter: Reporter,
    done: Callable[[int, int], None] | None,
) -> None:
    """Run the first case alone, say what the others will take, and run them."""
    counting = _CountingReporter(reporter, count - len(left), count, done)
    for these in (left[:1], left[1:]):
        if not these:
            continue
        began = time.monotonic()
        run_all(
            these,
            processes=processes,
            reports=settings.reports,
            figures=bool(settings.figures),
            reporter=counting,
        )
        if these[0] is left[0] and len(left) > 1 and tell is not None:
            spent = time.monotonic() - began
            disk = sum(f.stat().st_size for f in these[0].folder.rglob("*") if f.is_file())
            rest = len(left) - 1
            tell(
                f"the first took {spent:.1f} s and {disk / 1e6:.1f} MB: about "
                f"{clock(rest * spent / processes + 59)} h and {rest * disk / 1e6:,.0f} MB for the "
                f"other {rest}"
            )


class _CountingReporter(Reporter):
    """Passes on what runs report, and counts those that have ended."""

    def __init__(
        self, own: Reporter, ended: int, count: int, done: Callable[[int, int], None] | None
    ) -> None:
        self._own, self._ended, self._count, self._done = own, ended, count, done

    def advanced(self, progress: Progress) -> None:
        self._own.advanced(progress)

    def finished(self, run: Run) -> None:
        self._own.finished(run)
        self._ended += 1
        if self._done is not None:
            self._done(self._ended, self._count)


def _export(
    workspace: Workspace, runs: Sequence[CheckedRun], folder: Path, version: str | None
) -> None:
    """Write each case as OpenSCENARIO beside its scenario, and the map once."""
    if version is None:
        return
    for run in runs:
        file = folder / f"{run.folder.name}{SUFFIX}"
        export(workspace, file, folder, to="openscenario", options={"version": version})


def has_completed(folder: Path) -> bool:
    """Whether a folder holds a run that has completed."""
    try:
        return Run.open(folder).status is RunStatus.COMPLETED
    except InputError:
        return False
