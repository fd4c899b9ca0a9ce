"""Many trials in one process: what a fork and its imports cost is paid once.

A trial in a batch is the same as one alone, but that its commands are called one after the other in
one process, that nothing is simulated, and that no real command line is started. What fails is
tried again alone, with its folder kept; what then does not fail is told as such.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

from bench.fuzz.limits import SECONDS, TRACEBACK, Ended, busy, call_command, high_water
from bench.fuzz.trials import Trial, trial_rng
from bench.fuzz.verdicts import Finding, Tried, Verdict, judge, left_over, listing

BATCH = 24
LONGEST = 90.0
"""Seconds for a batch, on a machine with nothing else to do."""
_ALONE = ("run", "resume", "dataset", "test", "serve")
_COUNTED = ("sweep", "study", "search")
"""Commands that simulate, and those that do unless they only count."""

BATCHED = (
    "config",
    "edits of files",
    "feed",
    "graph form",
    "history",
    "lights",
    "map",
    "openscenario",
    "picture",
    "recording",
    "run folder",
    "scenario",
    "study plan",
    "sweep plan",
    "tables",
    "weights",
)


class BatchTrial(Trial):
    """A trial whose commands are called in this process."""

    def command(
        self,
        *argv: str,
        writes: Sequence[Path] = (),
        plain: bool = False,
        seconds: float | None = None,
    ) -> Ended:
        del plain
        simulates = argv[0] in _ALONE or (
            argv[0] in _COUNTED and argv[1:2] != ("status",) and "--dry-run" not in argv
        )
        if simulates:
            return Ended(argv, 1, "", "", 0.0, 0)
        roots = [self.folder / "workspace", self.folder / "tmp", self.folder / "cwd", *writes]
        before = listing(roots)
        ended = _called(argv, self.folder)
        finding = judge(ended)
        if ended.seconds > (seconds or SECONDS) * busy():
            finding = Finding(Verdict.HANG, f"{finding.words} (after {ended.seconds:.1f} s)")
        if not finding.verdict.failed:
            left = left_over(before, listing(roots), refused=ended.code == 2)
            if left:
                finding = Finding(Verdict.LEFTOVER, f"{finding.words} ({left})")
        self.findings.append(finding)
        return ended

    def ask(self, about: str, question: Callable[[], str]) -> Ended:
        words = ""
        try:
            words = question()
        except Exception:
            last = traceback.format_exc().strip().splitlines()[-1]
            self.findings.append(Finding(Verdict.TRACEBACK, f"{about}: {last}"))
        if words:
            self.findings.append(Finding(Verdict.WRONG, f"{about}: {words}"[:400]))
        return Ended((about,), 0, words, "", 0.0, 0)


def _called(argv: tuple[str, ...], folder: Path) -> Ended:
    """Call a command with its streams in files of the trial, as one that is started has them."""
    for name in ("cwd", "tmp"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    kept = [os.dup(number) for number in (1, 2)]
    for number, name in ((1, "out"), (2, "err")):
        handle = os.open(folder / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
        os.dup2(handle, number)
        os.close(handle)
    os.environ["TMPDIR"] = str(folder / "tmp")
    os.environ["ODSCEN_WORKSPACE"] = str(folder / "cwd" / "unasked")
    tempfile.tempdir = None
    os.chdir(folder / "cwd")
    finders = list(sys.meta_path)
    begin = time.perf_counter()
    try:
        code = call_command(argv)
    except BaseException:
        code = TRACEBACK
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        sys.meta_path[:] = finders
        for number, handle in zip((1, 2), kept, strict=True):
            os.dup2(handle, number)
            os.close(handle)
    took = time.perf_counter() - begin
    out, err = ((folder / name).read_text("utf-8", "replace") for name in ("out", "err"))
    return Ended(argv, code, out, err, took, 0)


def try_batch(
    alone: Trial, target: str, function: Callable[[Trial], str], seeds: Sequence[int]
) -> list[Tried]:
    """Make trials in one process; ``alone`` has the material, the limits and the folder."""
    told = alone.folder / "told.jsonl"

    def work() -> str:
        for seed in seeds:
            _tell(told, {"began": seed})
            folder = alone.folder / str(seed)
            folder.mkdir()
            rng = trial_rng(target, seed)
            trial = BatchTrial(alone.material, alone.limits, folder, seed, rng)
            begin = time.perf_counter()
            try:
                kind = function(trial)
            except Exception:
                kind = "not made"
                words = traceback.format_exc().strip().splitlines()[-1]
                trial.findings.append(Finding(Verdict.WRONG, f"the bench itself: {words}"))
            took, peak = time.perf_counter() - begin, high_water(os.getpid())
            tried = Tried(target, seed, kind, trial.finding, took, peak, dict(trial.counts))
            _tell(told, asdict(tried))
            shutil.rmtree(folder, ignore_errors=True)
        return ""

    ended = alone.limits.run(
        ("batch", target), alone.folder, question=work, seconds=LONGEST, environment={}
    )
    return _told(told, target, ended)


def _tell(file: Path, what: object) -> None:
    with file.open("a", encoding="utf-8") as lines:
        lines.write(json.dumps(what) + "\n")


def _told(file: Path, target: str, ended: Ended) -> list[Tried]:
    """Trials as their process has told them, and the one in which it died."""
    rows = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
    found = []
    for row in rows:
        if "finding" in row:
            said = row.pop("finding")
            found.append(Tried(finding=Finding(Verdict(said["verdict"]), said["words"]), **row))
    finding = judge(ended)
    if finding.verdict.failed:
        began = [row["began"] for row in rows if "began" in row]
        seed = began[-1] if began else 0
        found = [one for one in found if one.seed != seed]
        found.append(Tried(target, seed, "the batch", finding, ended.seconds, ended.peak))
    return found
