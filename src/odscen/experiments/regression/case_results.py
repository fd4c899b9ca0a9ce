"""What became of the scenarios of a suite: values, for the terminal, JSON and the reports."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from odscen.experiments.regression.baseline import Baseline, Fingerprint
    from odscen.experiments.regression.causes import Cause
    from odscen.experiments.regression.detection import Sizing
    from odscen.experiments.regression.measure import Measured
    from odscen.experiments.regression.verdict import BaselineVerdict
    from odscen.experiments.suites.suite import Case, Suite
    from odscen.maps.map_entry import MapEntry


class CaseStatus(StrEnum):
    """Verdict on a scenario of a suite, the worst first.

    ``error``: it could not be run, or a run failed. ``failed``: an expectation or a tolerance is
    not met. ``missing``: the baseline has the scenario, or a seed, and the suite does not.
    ``new``: the baseline is not there. ``changed``: it passes, with other inputs than the
    baseline's or with better figures. ``passed``: as it was.
    """

    ERROR = "error"
    FAILED = "failed"
    MISSING = "missing"
    NEW = "new"
    CHANGED = "changed"
    PASSED = "passed"

    @property
    def passes(self) -> bool:
        """Whether CI may go on."""
        return self in (CaseStatus.CHANGED, CaseStatus.PASSED)


@dataclass(frozen=True, slots=True)
class SeedResult:
    """One run of a case.

    Attributes
    ----------
    error
        Why it failed, in SUMO's words; ``None`` if it did not.
    missed
        Expectations that it does not meet, in ours.
    folder
        Where it is kept; ``None`` if it was deleted.
    unusable
        Why its figures cannot be used, if the suite expects that they can; one of ``missed``.
    """

    seed: int
    wall_seconds: float
    error: str | None
    missed: tuple[str, ...]
    figures: Measured
    folder: Path | None = None
    unusable: str | None = None


@dataclass(frozen=True, slots=True)
class CaseResult:
    """What became of one scenario of a suite.

    Attributes
    ----------
    map_name
        Of the map that the scenario names; empty if it could not be read.
    entry
        The map that it was run on, whose name may be another; ``None`` if it was not run.
    made_of
        What its runs were made of.
    baseline
        What it was held against.
    causes
        What the runs are made of that the baseline was not made of, the likeliest first; empty
        without a baseline.
    verdict
        Against the baseline; ``None`` without one.
    errors, failures, missing, new
        The reasons for a status, in words, the worst first.
    error_code
        Exit code of its errors: 2 for bad input, 3 for a run or tool that failed.
    sizing
        What its seeds were chosen for; ``None`` where the suite names them.
    notes
        What else should be known.
    updated
        Whether the baseline was written anew.
    """

    case: Case
    runs: tuple[SeedResult, ...] = ()
    map_name: str = ""
    entry: MapEntry | None = None
    made_of: Fingerprint = field(default_factory=dict)
    baseline: Baseline | None = None
    causes: tuple[Cause, ...] = ()
    verdict: BaselineVerdict | None = None
    errors: tuple[str, ...] = ()
    failures: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    new: tuple[str, ...] = ()
    error_code: int = 3
    sizing: Sizing | None = None
    notes: tuple[str, ...] = ()
    updated: bool = False

    @property
    def name(self) -> str:
        """Of the scenario."""
        return self.case.name

    @property
    def status(self) -> CaseStatus:
        """The worst that can be said of it."""
        reasons = {
            CaseStatus.ERROR: self.errors,
            CaseStatus.FAILED: self.failures,
            CaseStatus.MISSING: self.missing,
            CaseStatus.NEW: self.new,
            CaseStatus.CHANGED: self.causes or self.better,
        }
        return next((status for status, found in reasons.items() if found), CaseStatus.PASSED)

    @property
    def label(self) -> str:
        """Status in words."""
        if self.status is CaseStatus.CHANGED and self.better:
            return "changed (better)"
        return "baseline written" if self.updated and self.status.passes else self.status.value

    @property
    def unusable(self) -> tuple[str, ...]:
        """Why the figures of runs cannot be used, seed by seed; empty if they can."""
        return tuple(run.unusable for run in self.runs if run.unusable)

    @property
    def better(self) -> bool:
        """Whether figures are better than the baseline by more than their tolerance."""
        return self.verdict is not None and bool(self.verdict.better)

    @property
    def changed_inputs(self) -> tuple[str, ...]:
        """The causes in words."""
        return tuple(cause.words for cause in self.causes)

    @property
    def problems(self) -> tuple[str, ...]:
        """Every reason not to pass, in words."""
        return (*self.errors, *self.failures, *self.missing, *self.new)

    @property
    def exit_code(self) -> int:
        """0 passes; 1 differs or falls short; 2 cannot be used; 3 a run failed."""
        if self.status is CaseStatus.ERROR:
            return self.error_code
        return 0 if self.status.passes else 1

    @property
    def wall_seconds(self) -> float:
        """Of all runs, one after the other."""
        return sum(run.wall_seconds for run in self.runs)

    @property
    def rank(self) -> tuple[int, float]:
        """Order by badness: the status, then how far the worst figure is off."""
        verdict = self.verdict
        worst = max((change.score for change in verdict.failing), default=0.0) if verdict else 0.0
        return list(CaseStatus).index(self.status), -worst


@dataclass(frozen=True, slots=True)
class SuiteResult:
    """A suite that has been run; ``cases`` are in its order, those that are missing at the end."""

    suite: Suite
    cases: tuple[CaseResult, ...]

    @property
    def exit_code(self) -> int:
        """The largest of the scenarios' codes: 3 before 2 before 1."""
        return max((case.exit_code for case in self.cases), default=0)

    @property
    def worst_first(self) -> tuple[CaseResult, ...]:
        """The scenarios, those to look at first first."""
        return tuple(sorted(self.cases, key=lambda case: (case.rank, case.name)))

    @property
    def counts(self) -> Mapping[CaseStatus, int]:
        """How many scenarios have each verdict, the worst first; without those that none has."""
        found = [case.status for case in self.cases]
        return {status: found.count(status) for status in CaseStatus if status in found}

    @property
    def touched(self) -> Mapping[str, tuple[str, ...]]:
        """Names of the scenarios that each changed input touches; maps by name."""
        found: dict[str, list[str]] = {}
        for case in self.cases:
            for cause in case.causes:
                words = f"the map {case.map_name}" if cause.name == "map" else cause.words
                found.setdefault(words, []).append(case.name)
        return {words: tuple(names) for words, names in found.items()}
