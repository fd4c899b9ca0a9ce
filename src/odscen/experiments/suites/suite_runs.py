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

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from odscen.base.errors import InputError
    from odscen.experiments.suites.suite import Suite
    from odscen.experiments.suites.suite_loading import LoadedCase
    from odscen.runs.finished_run import Run
    from odscen.sumo.runner.run_jobs import RunJob
    from odscen.sumo.worker.protocol import Progress


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
        jobs: dict[Path, tuple[LoadedCase, int]] = {}
        runs = []
        for case in cases:
            for seed in case.case.seeds:
                if seed in case.runs or seed in case.refused:
                    continue
                name = f"{case.case.name}/seed-{seed}"
                folder = place.root / name
                jobs[folder] = case, seed
                settings = replace(case.run.settings, seed=seed)
                runs.append(replace(case.run, name=name, folder=folder, settings=settings))
        if not runs:
            return
        follow = _Follow(len(runs), self.tell)

        def done(job: RunJob, result: Run) -> None:
            case, seed = jobs[job.out]
            case.runs[seed] = _seed_result(case, seed, result, self.suite, kept=place.keep)
            if not place.keep:
                shutil.rmtree(result.folder)
            follow.done(job)

        def refused(job: RunJob, error: InputError) -> None:
            case, seed = jobs[job.out]
            case.refused[seed] = f"seed {seed}: {error}"
            follow.done(job)

        run_all(
            runs,
            processes=self.processes,
            reports=place.keep,
            progress=follow.step,
            done=done,
            refused=refused,
        )


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
