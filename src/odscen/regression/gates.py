"""Run a suite: scenarios times seeds, each judged by its expectations and its baseline."""

from __future__ import annotations

import hashlib
import shutil
import tempfile
import threading
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.app.runs import check_run, run_all
from odscen.app.scenarios import read_scenario
from odscen.base.errors import InputError, in_file
from odscen.convert.model.conversion_settings import ConversionSettings
from odscen.regression.baseline import (
    baseline_of,
    changed_inputs,
    fingerprint,
    read_baseline,
    write_baseline,
)
from odscen.regression.measure import measure
from odscen.regression.verdict import hold_against
from odscen.results.measures.expectations import evaluate, needs_criticality
from odscen.results.records.outcomes import RunStatus
from odscen.sumo.realize.recording import Recording
from odscen.sumo.realize.run_settings import RunSettings
from odscen.workspace.asset_catalogue import shipped_assets
from odscen.workspace.store import name_from_file

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.app.runs import CheckedRun
    from odscen.convert.model.conversion_settings import ConverterName
    from odscen.regression.baseline import Baseline, Fingerprint
    from odscen.regression.measure import Measured
    from odscen.regression.suite import Case, Suite
    from odscen.regression.verdict import BaselineVerdict
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.folder.finished_run import Run
    from odscen.sumo.runner.run_jobs import RunJob
    from odscen.sumo.worker.protocol import Progress
    from odscen.workspace.map_entry import MapEntry
    from odscen.workspace.store import Workspace


class CaseStatus(StrEnum):
    """Verdict on a scenario of a suite; ``error`` if a run of it failed."""

    PASSED = "passed"
    FAILED = "failed"
    ERROR = "error"

    @property
    def label(self) -> str:
        """In words."""
        return "run failed" if self is CaseStatus.ERROR else self.value


@dataclass(frozen=True, slots=True)
class SeedResult:
    """One run of a case; ``error`` in SUMO's words if it failed, ``missed`` in ours."""

    seed: int
    wall_seconds: float
    error: str | None
    missed: tuple[str, ...]
    figures: Measured


@dataclass(frozen=True, slots=True)
class CaseResult:
    """What became of one scenario of a suite.

    Attributes
    ----------
    changed_inputs
        What the runs are made of that the baseline was not made of; empty without a baseline.
    verdict
        Against the baseline; ``None`` without one.
    problems
        Every reason to fail, in words.
    updated
        Whether the baseline was written anew.
    """

    case: Case
    map_name: str
    runs: tuple[SeedResult, ...]
    changed_inputs: tuple[str, ...] = ()
    verdict: BaselineVerdict | None = None
    problems: tuple[str, ...] = ()
    updated: bool = False

    @property
    def status(self) -> CaseStatus:
        """``error`` if a run failed, ``failed`` if one fell short, else ``passed``."""
        if any(run.error for run in self.runs):
            return CaseStatus.ERROR
        return CaseStatus.FAILED if self.problems else CaseStatus.PASSED

    @property
    def wall_seconds(self) -> float:
        """Of all runs, one after the other."""
        return sum(run.wall_seconds for run in self.runs)


@dataclass(frozen=True, slots=True)
class SuiteResult:
    """A suite that has been run."""

    suite: Suite
    cases: tuple[CaseResult, ...]

    @property
    def exit_code(self) -> int:
        """0 all passed; 1 something differs or falls short; 3 a run failed."""
        found = {case.status for case in self.cases}
        return 3 if CaseStatus.ERROR in found else 1 if CaseStatus.FAILED in found else 0


@dataclass(slots=True)
class _Loaded:
    """A case with its scenario on the map that it will run on; ``run`` is without a seed."""

    case: Case
    run: CheckedRun
    made_of: Fingerprint
    baseline: Baseline | None
    runs: dict[int, SeedResult] = field(default_factory=dict)


def run_suite(
    workspace: Workspace,
    suite: Suite,
    *,
    processes: int = 1,
    update_baseline: bool = False,
    out: Path | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> SuiteResult:
    """Run every scenario of a suite with every seed, and judge what comes out.

    Parameters
    ----------
    processes
        How many run at a time.
    update_baseline
        Write baselines anew of what comes out, instead of holding it against them.
    out
        Keeps the runs there, one folder per scenario and seed, with reports; else they are deleted.

    Raises
    ------
    InputError
        If a map, a scenario or a baseline cannot be used; nothing is run then.
    """
    loaded = _load(workspace, suite, with_baseline=not update_baseline)
    jobs: dict[str, tuple[_Loaded, int]] = {}
    with tempfile.TemporaryDirectory(prefix="odscen-test-") as temporary:
        root = out or Path(temporary)
        runs = []
        for case in loaded:
            for seed in case.case.seeds:
                name = f"{case.case.name}/seed-{seed}"
                jobs[name] = case, seed
                settings = replace(case.run.settings, seed=seed)
                runs.append(replace(case.run, name=name, folder=root / name, settings=settings))
        follow = _Follow(len(runs), progress)

        def done(job: RunJob, result: Run) -> None:
            case, seed = jobs[job.name]
            case.runs[seed] = _seed_result(case, seed, result)
            if out is None:
                shutil.rmtree(result.folder)
            follow.done(job)

        keep = out is not None
        run_all(runs, processes=processes, reports=keep, progress=follow.step, done=done)
    return SuiteResult(suite, tuple(_judge(case, update=update_baseline) for case in loaded))


class _Follow:
    """Adds up the progress of runs that go on at the same time."""

    def __init__(self, total: int, tell: Callable[[str, float], None] | None) -> None:
        self._shares: dict[str, float] = {}
        self._total = total
        self._tell = tell
        self._lock = threading.Lock()

    def step(self, job: RunJob, message: Progress) -> None:
        share = message.time / message.until if message.until else 0.0
        self._set(job.name, min(share, 1.0))

    def done(self, job: RunJob) -> None:
        self._set(job.name, 1.0)

    def _set(self, name: str, share: float) -> None:
        with self._lock:
            self._shares[name] = share
            total = sum(self._shares.values()) / self._total
        if self._tell is not None:
            self._tell(name, total)


def _load(workspace: Workspace, suite: Suite, *, with_baseline: bool) -> list[_Loaded]:
    maps = {name_from_file(path): path for path in suite.maps}
    loaded = []
    for case in suite.cases:
        scenario = read_scenario(case.file)
        with in_file(str(case.file)):
            entry = _map_of(workspace, scenario, maps, suite.converter)
            # The suite names the map to test on; a baseline knows if it is not the one of before.
            reference = scenario.map.model_copy(update={"sha256": entry.sha256})
            scenario = scenario.model_copy(update={"map": reference})
            settings = _settings(case, suite)
            run = check_run(workspace, scenario, name=case.name, settings=settings, entry=entry)
        network = None if entry.converter == "odscen" else entry.net_sha256
        made_of = fingerprint(scenario, entry.sha256, settings, network=network)
        baseline = read_baseline(case.baseline) if with_baseline and case.baseline else None
        run = replace(run, assets=shipped_assets())  # a baseline holds in every workspace
        loaded.append(_Loaded(case, run, made_of, baseline))
    return loaded


def _map_of(
    workspace: Workspace,
    scenario: Scenario,
    maps: Mapping[str, Path],
    converter: ConverterName | None,
) -> MapEntry:
    """Find the map of the suite, built in the workspace if need be; else the workspace's own.

    A map of that name and another content or converter in the workspace is left alone.
    """
    name = scenario.map.name
    if name not in maps:
        own = workspace.map_for(name, scenario.map.sha256)
        if converter in (None, own.converter):
            return own
    source = maps[name] if name in maps else own.path("xodr")
    wished = ConversionSettings(spacing=scenario.map.spacing, converter=converter or "odscen")
    try:
        content = source.read_bytes()
    except OSError as error:
        raise InputError(error.strerror or str(error), file=str(source)) from error
    sha256 = hashlib.sha256(content).hexdigest()
    for entry in workspace.maps():
        if (entry.sha256, entry.conversion) == (sha256, wished):
            return entry
    free = name not in workspace.map_names()
    new = name if free else f"{name[:40]}-{sha256[:8]}-{wished.converter}"
    return workspace.add_map(source, name=new, settings=wished)


def _settings(case: Case, suite: Suite) -> RunSettings:
    return RunSettings(
        until=case.until,
        step_length=case.step_length,
        recording=Recording(criticality=needs_criticality(case.expectations)),
        time_limit=suite.time_limit,
    )


def _seed_result(loaded: _Loaded, seed: int, result: Run) -> SeedResult:
    summary = result.summary
    missed = [
        f"seed {seed}: expected {verdict.expectation}, but it is "
        f"{'nothing' if verdict.value is None else f'{verdict.value:g}'}"
        for verdict in evaluate(loaded.case.expectations, summary)
        if not verdict.passed
    ]
    error = None
    if result.status is RunStatus.FAILED:
        error = f"seed {seed}: the run failed: {summary['error']}"
        missed = []
    figures = measure(result.folder, summary)
    return SeedResult(seed, summary["wall_seconds"], error, tuple(missed), figures)


def _judge(loaded: _Loaded, *, update: bool) -> CaseResult:
    case = loaded.case
    runs = tuple(loaded.runs[seed] for seed in case.seeds)
    problems = [run.error for run in runs if run.error]
    problems += [missed for run in runs for missed in run.missed]
    figures = {run.seed: run.figures for run in runs if not run.error}
    if case.baseline is None or (update and len(figures) < len(runs)):
        return CaseResult(case, loaded.run.entry.name, runs, problems=tuple(problems))
    if update:
        write_baseline(baseline_of(figures, loaded.made_of), case.baseline, scenario=case.name)
        return CaseResult(case, loaded.run.entry.name, runs, problems=tuple(problems), updated=True)
    if loaded.baseline is None:
        problems.append(f"there is no baseline {case.baseline}; write it with --update-baseline")
        return CaseResult(case, loaded.run.entry.name, runs, problems=tuple(problems))
    unknown = sorted(figures.keys() - set(loaded.baseline.seeds))
    if unknown:
        listed = ", ".join(map(str, unknown))
        problems.append(f"the baseline has no seed {listed}; write it with --update-baseline")
    verdict = hold_against(loaded.baseline, figures, case.tolerances)
    inputs = changed_inputs(loaded.baseline.fingerprint, loaded.made_of)
    problems += [change.words for change in verdict.failing]
    return CaseResult(case, loaded.run.entry.name, runs, inputs, verdict, tuple(problems))
