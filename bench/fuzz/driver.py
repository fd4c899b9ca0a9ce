"""Which trial comes next, for how long, and the table of what came of them."""

from __future__ import annotations

import argparse
import gc
import importlib
import json
import os
import pkgutil
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path

import odscen
from bench.common import OUT
from bench.fuzz.batches import BATCH, BATCHED, try_batch
from bench.fuzz.byte_targets import BYTE_TARGETS
from bench.fuzz.edit_targets import edit_trial
from bench.fuzz.fault_targets import FAULT_TARGETS
from bench.fuzz.file_targets import FILE_TARGETS
from bench.fuzz.folder_targets import FOLDER_TARGETS
from bench.fuzz.handed_targets import HANDED_TARGETS
from bench.fuzz.limits import Limits
from bench.fuzz.material import Material, prepare
from bench.fuzz.process_targets import PROCESS_TARGETS
from bench.fuzz.received_targets import RECEIVED_TARGETS
from bench.fuzz.request_targets import handmade_trial, schema_trial
from bench.fuzz.served import Served
from bench.fuzz.state_targets import STATE_TARGETS
from bench.fuzz.trials import Trial, trial_rng
from bench.fuzz.verdicts import Finding, Tried, Verdict

MINUTES = 60.0
ALONE = 6
"""One turn of so many of a target that has batches is a trial alone."""
PROGRESS = 300.0
KEPT = OUT / "fuzz"
REQUESTS = {
    "edits": (edit_trial, 3.0),
    "requests by hand": (handmade_trial, 1.5),
    "requests by schema": (schema_trial, 1.5),
}
_SKIPPED_IMPORTS = ("odscen.__main__", "odscen.carla", "odscen.sumo.worker.simulation.session")
"""What a command imports only in a process of its own."""


class Bench:
    """All that trials share."""

    def __init__(self, root: Path) -> None:
        import_all()
        self.root = root
        self.limits = Limits()
        self.material = Material(root / "material", ())
        self.served = Served(self.material, self.limits, root)
        targets: dict[str, tuple[Callable[[Trial], str], float]] = {
            **FILE_TARGETS,
            **FOLDER_TARGETS,
            **FAULT_TARGETS,
            **HANDED_TARGETS,
            **RECEIVED_TARGETS,
            **STATE_TARGETS,
            **PROCESS_TARGETS,
            **BYTE_TARGETS,
        }
        for name, (target, share) in REQUESTS.items():
            targets[name] = (self._with_server(target), share)
        self.targets = targets

    def prepare(self, made: Path | None = None) -> None:
        """Make what is to be damaged, in a folder that another bench may use again."""
        self.material = self.served.material = prepare(made or self.material.root, self.limits)

    def _with_server(self, target: Callable[[Trial, Served], str]) -> Callable[[Trial], str]:
        return lambda trial: target(trial, self.served)

    def attempt(self, target: str, seed: int) -> Tried:
        """Make one trial; its folder is kept if it failed."""
        tried = self._once(target, seed)
        if tried.finding.verdict is Verdict.HANG:  # a machine that is busy is no hang
            again = self._once(target, seed)
            return tried if again.finding.verdict is Verdict.HANG else again
        return tried

    def _once(self, target: str, seed: int) -> Tried:
        folder = self.root / "trial"
        folder.mkdir()
        trial = Trial(self.material, self.limits, folder, seed, trial_rng(target, seed))
        begin = time.perf_counter()
        try:
            kind = self.targets[target][0](trial)
        except Exception:  # a trial that cannot be made is to be seen, and the others go on
            kind = "not made"
            words = traceback.format_exc().strip().splitlines()[-1]
            trial.findings.append(Finding(Verdict.WRONG, f"the bench itself: {words}"))
        took = time.perf_counter() - begin
        counts = dict(trial.counts)
        tried = Tried(target, seed, kind, trial.finding, took, trial.peak, counts)
        self.limits.clean(0.0)
        if tried.finding.verdict.failed:
            keep(folder, tried)
        shutil.rmtree(folder, ignore_errors=True)
        return tried

    def close(self) -> None:
        """End what was started, and remove what was made."""
        self.served.stop()
        shutil.rmtree(self.root, ignore_errors=True)

    def attempt_batch(self, target: str, seeds: Sequence[int]) -> list[Tried]:
        """Make trials in one process; what fails is tried again alone."""
        folder = self.root / "trial"
        folder.mkdir()
        alone = Trial(self.material, self.limits, folder, seeds[0], trial_rng(target, seeds[0]))
        tried = try_batch(alone, target, self.targets[target][0], seeds)
        self.limits.clean(0.0)
        shutil.rmtree(folder, ignore_errors=True)
        found = []
        for one in tried:
            again = self.attempt(target, one.seed) if one.finding.verdict.failed else one
            if one.finding.verdict.failed and not again.finding.verdict.failed:
                words = f"in a batch only: {one.finding.words}"
                again = replace(one, finding=Finding(one.finding.verdict, words))
            found.append(again)
        return found


def keep(folder: Path, tried: Tried) -> None:
    """Keep the folder of a trial with what is to be known of it."""
    kept = KEPT / f"{tried.target.replace(' ', '-')}-{tried.seed}"
    shutil.rmtree(kept, ignore_errors=True)
    kept.parent.mkdir(parents=True, exist_ok=True)
    special = [path for path in folder.rglob("*") if not (path.is_dir() or path.is_file())]
    for path in special:  # pipes cannot be copied, and links may lead nowhere
        path.unlink(missing_ok=True)
    for path in folder.glob("odd.xodr"):
        if path.is_file() and path.stat().st_size > 1e9:
            path.unlink()
    shutil.copytree(folder, kept, dirs_exist_ok=True, symlinks=True)
    (kept / "trial.json").write_text(json.dumps(asdict(tried), indent=2), encoding="utf-8")


def import_all() -> None:
    """Import what commands import, so that their forks need not."""
    for module in pkgutil.walk_packages(odscen.__path__, "odscen."):
        if not module.name.startswith(_SKIPPED_IMPORTS):
            importlib.import_module(module.name)
    gc.freeze()


def main(argv: Sequence[str] | None = None) -> None:
    """Run the bench; exit code 1 if anything failed."""
    options = _options(sys.argv[1:] if argv is None else argv)
    root = Path(tempfile.mkdtemp(prefix="odscen-fuzz-"))
    bench = Bench(root)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends with what it has started
    try:
        bench.prepare(options.material)
        begin = time.perf_counter()
        known = sorted(bench.targets)
        chosen = [options.target] if options.target else options.targets or known
        if unknown := set(chosen) - set(known):
            sys.exit(f"no target {', '.join(sorted(unknown))}; there are {', '.join(known)}")
        if options.seed is not None:
            tried = [_one(bench, name, options.seed) for name in chosen]
        else:
            tried = _many(bench, _turns(bench, chosen, options, begin), options.first, begin)
    finally:
        bench.close()
    print(table(tried, time.perf_counter() - begin))
    if options.json:
        text = json.dumps([asdict(one) for one in tried], indent=1)
        options.json.write_text(text, encoding="utf-8")
    sys.exit(any(one.finding.verdict.failed for one in tried))


def _options(argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m bench fuzz")
    parser.add_argument("--minutes", type=float, default=MINUTES, help="of trials")
    parser.add_argument(
        "--rounds", type=int, help="turns of each target, the same trials on any machine"
    )
    parser.add_argument("--targets", type=lambda text: text.split(","), metavar="NAME,...")
    parser.add_argument("--first", type=int, default=1, help="seed of the first trials")
    parser.add_argument("--seed", type=int, help="one trial of each target, and keep its folder")
    parser.add_argument("--target", help="one target")
    parser.add_argument(
        "--material", type=Path, metavar="FOLDER", help="what is damaged; made there if need be"
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all trials")
    return parser.parse_args(argv)


def _one(bench: Bench, target: str, seed: int) -> Tried:
    tried = bench.attempt(target, seed)
    print(f"{target} {seed}: {tried.kind}: {tried.finding.verdict}: {tried.finding.words}")
    return tried


def _turns(
    bench: Bench, chosen: Sequence[str], options: argparse.Namespace, begin: float
) -> Iterator[str]:
    """Targets, each as often as asked, or until the time is up by their shares of it."""
    if options.rounds is not None:
        for _ in range(options.rounds):
            yield from chosen
        return
    spent = dict.fromkeys(chosen, 0.0)
    while time.perf_counter() - begin < options.minutes * 60.0:
        target = min(chosen, key=lambda name: (spent[name] / bench.targets[name][1], name))
        start = time.perf_counter()
        yield target
        spent[target] += time.perf_counter() - start


def _many(bench: Bench, targets: Iterable[str], first: int, begin: float) -> list[Tried]:
    """Trials of targets, turn by turn; seeds count up from ``first``."""
    seeds: dict[str, int] = {}
    tried: list[Tried] = []
    turns: Counter[str] = Counter()
    told = begin
    for target in targets:
        turns[target] += 1
        seed = seeds.get(target, first)
        if target in BATCHED and turns[target] % ALONE:
            mine = range(seed, seed + BATCH)
            found = bench.attempt_batch(target, mine)
        else:
            mine = range(seed, seed + 1)
            found = [bench.attempt(target, seed)]
        seeds[target] = mine.stop
        tried += found
        for failure in _failures(found):
            print(failure, flush=True)
        if time.perf_counter() - told > PROGRESS:
            told = time.perf_counter()
            print(f"{(told - begin) / 60.0:.0f} minutes: {len(tried):,} trials", flush=True)
    return tried


def _failures(tried: Sequence[Tried]) -> list[str]:
    return [
        (
            f"{one.finding.verdict} --target {one.target!r} --seed {one.seed}: {one.kind}: "
            f"{one.finding.words}"
        )
        .encode("utf-8", "backslashreplace")
        .decode()
        for one in tried
        if one.finding.verdict.failed
    ]


def table(tried: Sequence[Tried], seconds: float) -> str:
    """Tried and failed by target, with the seeds that failed."""
    rows = [("target", "seeds", "tried", "fine", "refused", "failed", "slowest, s", "largest, GB")]
    for name in sorted({one.target for one in tried}):
        own = [one for one in tried if one.target == name]
        rows.append(_row(name, own))
    rows.append(_row("all", tried))
    widths = [max(len(row[n]) for row in rows) for n in range(len(rows[0]))]
    lines = [
        "  ".join(
            cell.ljust(width) if n < 2 else cell.rjust(width)
            for n, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]
    verdicts = Counter(one.finding.verdict for one in tried if one.finding.verdict.failed)
    lines.append(
        f"{seconds / 60.0:.1f} minutes, {_processor_minutes():.1f} of one processor; "
        + (
            ", ".join(f"{number} {verdict}" for verdict, number in sorted(verdicts.items()))
            or "nothing failed"
        )
    )
    counted: Counter[str] = Counter()
    for one in tried:
        counted.update(one.counts)
    lines += [f"{what}: {number:,}" for what, number in sorted(counted.items())]
    skipped = {one.finding.words for one in tried if one.finding.verdict is Verdict.SKIPPED}
    lines += [f"skipped: {words}" for words in sorted(skipped)]
    if verdicts:
        lines += _failures(tried)  # once more: of a long log often the end only is kept
        lines.append(f"folders of the failures: {os.path.relpath(KEPT)}")
    return "\n".join(lines)


def _processor_minutes() -> float:
    """What this process and those that it has waited for have computed."""
    spent = os.times()
    return (spent.user + spent.system + spent.children_user + spent.children_system) / 60.0


def _row(name: str, own: Sequence[Tried]) -> tuple[str, ...]:
    verdicts = Counter(one.finding.verdict for one in own)
    seeds = [one.seed for one in own]
    return (
        name,
        f"{min(seeds)}-{max(seeds)}" if name != "all" and seeds else "",
        str(len(own)),
        str(verdicts[Verdict.FINE]),
        str(verdicts[Verdict.REFUSED]),
        str(sum(one.finding.verdict.failed for one in own)),
        f"{max((one.seconds for one in own), default=0.0):.1f}",
        f"{max((one.peak for one in own), default=0) / 1e9:.2f}",
    )
