"""Run the scenarios of a suite, each with its seeds, and take down what comes out."""

from __future__ import annotations

import shutil
import threading
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

from odscen.app.running.batches import run_all
from odscen.base.errors import in_file
from odscen.experiments.regression.case_results import SeedResult
from odscen.experiments.regression.measure import measure
from odscen.experiments.regression.own_figures import own_values
from odscen.figures.judging.criteria import missed_rows, missed_words
from odscen.figures.judging.expectations import CRITERIA, USABLE, evaluate
from odscen.records.outcomes import RunStatus
from odscen.runs.judged import read_judged
from odscen.runs.reporter import Reporter

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from odscen.base.errors import InputError
    from odscen.experiments.suites.suite import Suite
    from odscen.experiments.suites.suite_loading import LoadedCase
    from odscen.runs.finished_run import Run
    from odscen.runs.reporter import Progress


class RunPlace(NamedTuple):
    """Where runs lie, in a folder per scenario and seed, and whether they stay, with reports."""

    root: Path
    keep: bool


@dataclass(frozen=True, slots=True)
class SeedRunner:
    """Runs scenarios of a suite, ``processes`` at a time."""

    suite: Suite
    processes: int = 1
    tell: Callable[[str, float], None] | None = None

    def run(self, cases: Sequence[LoadedCase], place: RunPlace) -> None:
        """Run each case with those of its seeds that it was not run with, and keep the results."""
        jobs: dict[str, tuple[LoadedCase, int]] = {}
        runs = []
        for case in cases:
            for seed in case.case.seeds:
                if seed in case.runs or seed in case.refused:
                    continue
                name = f"{case.case.name}/seed-{seed}"
                folder = place.root / name
                jobs[name] = case, seed
                settings = replace(case.run.settings, seed=seed)
                runs.append(replace(case.run, name=name, folder=folder, settings=settings))
        if not runs:
            return

        def keep_result(name: str, result: Run) -> None:
            case, seed = jobs[name]
            case.runs[seed] = _seed_result(case, seed, result, self.suite, kept=place.keep)
            if not place.keep:
                shutil.rmtree(result.folder)

        def note_refusal(name: str, error: InputError) -> None:
            case, seed = jobs[name]
            case.refused[seed] = f"seed {seed}: {error}"
            follow.set_share(name, 1.0)

        follow = _SuiteProgress(len(runs), self.tell, keep_result)
        run_all(
            runs,
            processes=self.processes,
            reports=place.keep,
            reporter=follow,
            refused=note_refusal,
        )


class _SuiteProgress(Reporter):
    """Adds up the progress of runs that go on at the same time, and keeps their results."""

    def __init__(
        self,
        total: int,
        tell: Callable[[str, float], None] | None,
        keep_result: Callable[[str, Run], None],
    ) -> None:
        self._shares: dict[str, float] = {}
        self._total = total
        self._tell = tell
        self._lock = threading.Lock()
        self.keep_result = keep_result

    def of_run(self, name: str) -> Reporter:
        return _SeedProgress(self, name)

    def set_share(self, name: str, share: float) -> None:
        """Say how much of a run is done."""
        with self._lock:
            self._shares[name] = share
            total = sum(self._shares.values()) / self._total
        if self._tell is not None:
            self._tell(name, total)


class _SeedProgress(Reporter):
    """One of the runs."""

    def __init__(self, suite: _SuiteProgress, name: str) -> None:
        self._suite, self._name = suite, name

    def advanced(self, progress: Progress) -> None:
        share = progress.time / progress.until if progress.until else 0.0
        self._suite.set_share(self._name, min(share, 1.0))

    def finished(self, run: Run) -> None:
        self._suite.keep_result(self._name, run)
        self._suite.set_share(self._name, 1.0)


def _seed_result(
    loaded: LoadedCase, seed: int, result: Run, suite: Suite, *, kept: bool
) -> SeedResult:
    summary = result.summary
    folder, seconds = result.folder if kept else None, summary["wall_seconds"]
    if result.status is RunStatus.FAILED:
        error = f"seed {seed}: the run failed: {summary['error']}"
        return SeedResult(seed, seconds, error, (), measure(result.folder, summary), folder)
    with in_file(str(suite.file)):
        own = own_values(suite.figures, result, beside=suite.file.parent)
    summary = {**summary, "figures": {**summary["figures"], **own}}
    verdicts = evaluate(loaded.case.expectations, summary, read_judged(result.folder))
    failed = [row for row in verdicts if not row.passed]
    unusable = None
    if USABLE.text in [row.expectation for row in failed]:
        unusable = f"seed {seed}: {result.usability.get('headline', 'not judged')}"
    missed = [
        f"seed {seed}: expected {verdict.expectation}, but it is "
        f"{'nothing' if verdict.value is None else f'{verdict.value:g}'}"
        for verdict in failed
        if verdict.expectation not in (USABLE.text, CRITERIA.text)
    ]
    if CRITERIA.text in [row.expectation for row in failed]:
        missed += [f"seed {seed}: {missed_words(row)}" for row in missed_rows(summary)]
    return SeedResult(
        seed,
        seconds,
        None,
        (*filter(None, [unusable]), *missed),
        measure(result.folder, summary),
        folder,
        unusable=unusable,
    )
