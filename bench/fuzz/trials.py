"""One trial: the commands it runs, and what became of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bench.fuzz.damage import Generator
from bench.fuzz.limits import Ended, Limits
from bench.fuzz.material import Material
from bench.fuzz.results import wrong_in_run
from bench.fuzz.verdicts import Finding, Verdict, judge, left_over, listing, worst

WHOLE = 20
"""One of so many trials starts the real command line."""
UNTIL = "8"
SUMO_LIMIT = "10"


@dataclass(slots=True)
class Trial:
    """One trial: its folder, its chance, and what became of its commands."""

    material: Material
    limits: Limits
    folder: Path
    seed: int
    rng: Generator
    findings: list[Finding] = field(default_factory=list)
    peak: int = 0
    counts: Counter[str] = field(default_factory=Counter)

    def command(
        self,
        *argv: str,
        writes: Sequence[Path] = (),
        plain: bool = False,
        seconds: float | None = None,
    ) -> Ended:
        """Run a command and judge it.

        A refused command may change nothing in the workspace and in ``writes``, but a run that
        failed leaves its folder; none may leave anything temporary.
        """
        roots = [self.folder / "workspace", self.folder / "tmp", self.folder / "cwd", *writes]
        before = listing(roots)
        ended = self.limits.run(
            argv, self.folder, whole=self.seed % WHOLE == 0, plain=plain, seconds=seconds
        )
        self.peak = max(self.peak, ended.peak)
        finding = judge(ended)
        if not finding.verdict.failed:
            left = left_over(before, listing(roots), refused=ended.code == 2)
            if left:
                finding = Finding(Verdict.LEFTOVER, f"{finding.words} ({left})")
        self.findings.append(finding)
        return ended

    def ask(self, about: str, question: Callable[[], str]) -> Ended:
        """Ask a process of its own what is wrong with a result; the words are the find."""
        ended = self.limits.run((about,), self.folder, question=question)
        self.peak = max(self.peak, ended.peak)
        self.findings.append(judge(ended))
        return ended

    def run(self, scenario: Path, used: Sequence[str], *more: str) -> Ended:
        """Run a scenario for a few seconds, and look at what it has recorded."""
        out = self.folder / "workspace" / "runs"
        ended = self.command(
            "run",
            str(scenario),
            "--until",
            UNTIL,
            "--time-limit",
            SUMO_LIMIT,
            "--out",
            str(out),
            *more,
            *used,
        )
        for run in sorted(out.glob("*")) if ended.code == 0 else ():
            if (run / "summary.json").exists() and run.name not in ("done", "sliced"):
                self.ask("result of run", lambda run=run: wrong_in_run(run))
        return ended

    def wrong(self, words: str) -> None:
        """Add a find: a result that is not what it should be."""
        self.findings.append(Finding(Verdict.WRONG, words))

    @property
    def finding(self) -> Finding:
        return worst(self.findings)

    def used(self, *parts: str) -> list[str]:
        """``--workspace`` with a copy of parts of the one that was prepared."""
        return ["--workspace", str(self.material.copy_workspace(self.folder, *parts))]


Target = Callable[[Trial], str]
"""Makes one trial; gives the kind of damage."""


def trial_rng(target: str, seed: int) -> Generator:
    """The chance of one trial: the same for the same target and seed, on any machine."""
    return np.random.default_rng([seed, *target.encode()])
