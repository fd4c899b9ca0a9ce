"""Faults from outside: kills at random instants, concurrent starts, full and read-only disks."""

from __future__ import annotations

import ctypes
import os
import re
import resource
import shutil
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from bench.fuzz.damage import pick
from bench.fuzz.limits import Ended, kill_tree
from bench.fuzz.material import CROSSING
from bench.fuzz.trials import Trial
from bench.fuzz.verdicts import Finding, Verdict, judge, left_over, listing

UNTIL, SLICE = "600", "60"
PATIENCE = 120.0
"""Seconds in which a long run that nothing is wrong with must end."""
ORPHAN_GRACE = 15.0
"""Seconds in which a worker whose runner was killed must have noticed."""
RESULTS = ("actors.json", "events.json")
TABLES = ("trajectories", "lanes", "trips", "signal_states", "detector_calls")


def _wrong(trial: Trial, words: str) -> None:
    trial.findings.append(Finding(Verdict.WRONG, words))


def _left(trial: Trial, where: str) -> None:
    """Nothing temporary may be left in the workspace."""
    found = left_over({}, listing([trial.folder / "workspace"]), refused=False)
    if found:
        trial.findings.append(Finding(Verdict.LEFTOVER, f"{where}: {found}"))


def kills(trial: Trial) -> str:
    """A command killed at a random instant, then done again."""
    if trial.rng.random() < 0.5:
        return _killed_build(trial)
    return _killed_run(trial)


def _killed_build(trial: Trial) -> str:
    used, rng = trial.used(), trial.rng
    source = trial.material.map_files[int(rng.integers(5))]
    number = pick(rng, (signal.SIGKILL, signal.SIGTERM, signal.SIGINT))
    argv = ["maps", "add", str(source), "--name", "killed", *used]
    after = _kill(trial, argv, float(rng.uniform(0.0, 3.0)), number)
    if number != signal.SIGKILL:
        _left(trial, f"maps add after {number.name}")
    trial.command("maps", "list", *used)
    if trial.command(*argv).code:
        _wrong(trial, f"the map cannot be added after {number.name}")
    _left(trial, f"maps add again after {number.name}")
    return f"maps add, {number.name} {after}"


def _kill(trial: Trial, argv: list[str], seconds: float, number: signal.Signals) -> str:
    """Start the real command line and send it a signal; how it ended then."""
    begin = time.perf_counter()
    pid = trial.limits.start(argv, trial.folder, whole=True)
    time.sleep(seconds)
    with suppress(ProcessLookupError):
        os.kill(pid, number)
    ended = trial.limits.wait(
        pid, tuple(argv), trial.folder, begin=begin, clean=False, seconds=ORPHAN_GRACE
    )
    left = trial.limits.clean(ORPHAN_GRACE)
    if left:
        trial.findings.append(Finding(Verdict.LEFTOVER, f"{number.name}: still runs: {left[0]}"))
    if ended.hung:
        trial.findings.append(Finding(Verdict.HANG, f"{number.name} does not end {argv[:2]}"))
    if number != signal.SIGKILL and ended.code >= 0:
        finding = judge(ended) if ended.code in (0, 1, 2, 3) else Finding(Verdict.FINE)
        if finding.verdict.failed or "Traceback" in ended.err:
            trial.findings.append(Finding(Verdict.TRACEBACK, f"{number.name}: {ended.err[-300:]}"))
    return "after its end" if ended.code == 0 else f"at {seconds:.1f} s"


def _run_argv(trial: Trial, used: list[str]) -> list[str]:
    runs = str(trial.folder / "workspace" / "runs")
    return [
        "run",
        str(trial.material.file("sliced.scenario.json")),
        "--until",
        UNTIL,
        "--slice",
        SLICE,
        "--out",
        runs,
        *used,
    ]


def _killed_run(trial: Trial) -> str:
    expected = _expected(trial)
    used, rng = trial.used("maps"), trial.rng
    argv, run = _run_argv(trial, used), trial.folder / "workspace" / "runs" / "sliced"
    story = []
    for _ in range(int(pick(rng, (1, 2, 3)))):
        number = pick(rng, (signal.SIGKILL, signal.SIGKILL, signal.SIGTERM))
        story.append(f"{number.name} {_kill(trial, argv, float(rng.uniform(0.5, 5.0)), number)}")
        if (run / "summary.json").exists():
            break
        argv = ["resume", str(run), *used] if (run / "status.json").exists() else argv
    if not (run / "summary.json").exists():
        ended = trial.command(*argv, seconds=PATIENCE)
        if ended.code:
            _wrong(trial, f"not resumed after {story}: {ended.err[-200:]}")
            return "run"
    _left(trial, "run")
    if _results(run) != expected:
        _wrong(trial, f"other results after {story}")
    return "run: " + ", ".join(story)


def _expected(trial: Trial) -> dict[str, bytes]:
    """Results of the same run left alone, computed once."""
    kept = trial.material.root / "alone"
    if not kept.exists():
        material = trial.material
        ended = trial.limits.run(
            [
                "run",
                str(material.file("sliced.scenario.json")),
                "--until",
                UNTIL,
                "--slice",
                SLICE,
                "--out",
                str(kept),
                "--workspace",
                str(material.workspace),
            ],
            trial.folder,
            seconds=PATIENCE,
        )
        if ended.code:
            raise RuntimeError(f"the run alone fails: {ended.err}")
    return _results(kept / "sliced")


def _results(run: Path) -> dict[str, bytes]:
    files = [run / name for name in RESULTS]
    files += [path for name in TABLES for path in sorted((run / name).glob("*.parquet"))]
    return {str(path.relative_to(run)): path.read_bytes() for path in files if path.is_file()}


def starts(trial: Trial) -> str:
    """The same thing started three times at once."""
    what = pick(trial.rng, ("run", "run", "maps add", "resume"))
    used = trial.used("maps", "runs/sliced") if what == "resume" else trial.used("maps")
    argvs = {
        "run": _run_argv(trial, used),
        "maps add": ["maps", "add", str(trial.material.map_files[1]), *used],
        "resume": [
            "resume",
            str(trial.folder / "workspace" / "runs" / "sliced"),
            "--time-limit",
            "2",
            *used,
        ],
    }
    ended = _at_once(trial, argvs[what], float(trial.rng.uniform(0.0, 0.5)))
    codes = sorted(one.code for one in ended)
    for one in ended:
        finding = judge(one)
        if finding.verdict.failed:
            trial.findings.append(finding)
    if what == "run":
        run = trial.folder / "workspace" / "runs" / "sliced"
        if 0 not in codes or any(code not in (0, 2) for code in codes):
            _wrong(trial, f"three runs at once end with {codes}: {ended[-1].err[-200:]}")
        elif _results(run) != _expected(trial):
            _wrong(trial, "three runs at once: other results")
    elif what == "maps add" and codes != [0, 0, 0]:
        _wrong(trial, f"three times maps add at once end with {codes}")
    _left(trial, what)
    return f"{what} three times: {codes}"


def _at_once(trial: Trial, argv: list[str], between: float) -> list[Ended]:
    folders = [trial.folder / f"at-once-{number}" for number in range(3)]
    begin, started = time.perf_counter(), []
    for folder in folders:
        folder.mkdir()
        started.append(trial.limits.start(argv, folder))
        time.sleep(between)
    ended = [
        trial.limits.wait(pid, tuple(argv), folder, begin=begin, clean=False, seconds=PATIENCE)
        for pid, folder in zip(started, folders, strict=True)
    ]
    trial.limits.clean(ORPHAN_GRACE)
    return ended


def disks(trial: Trial) -> str:
    """A disk that is full, or may not be written, or no more files can be opened."""
    kind = pick(trial.rng, ("full", "full", "read-only", "handles"))
    return {"full": _full_disk, "read-only": _read_only, "handles": _no_handles}[kind](trial)


_FULL = re.compile(r"space|full|too large|write", re.IGNORECASE)


def _commands(trial: Trial, workspace: Path) -> dict[str, list[str]]:
    used = ["--workspace", str(workspace)]
    material = trial.material
    out = str(workspace / "out.scenario.json")
    done = str(material.file("done.scenario.json"))
    return {
        "maps add": ["maps", "add", str(material.map_files[1]), *used],
        "generate": ["generate", "--map", CROSSING, "--count", "50", *used],
        "run": ["run", done, "--until", "60", *used],
        "run in slices": ["run", done, "--until", "600", "--slice", "60", *used],
        "demand": ["demand", "add", done, "--per-km", "2", "--out", out, *used],
        "report": ["report", "done", *used],
        "export": ["export", done, "--to", "sumo", "--out", str(workspace / "exported"), *used],
        "render": ["maps", "render", CROSSING, "--out", str(workspace / "x.svg"), *used],
        "compare": [
            "compare",
            str(workspace / "runs" / "done"),
            str(workspace / "runs" / "done"),
            "--html",
            str(workspace / "page.html"),
            *used,
        ],
        "webster": [
            "signals",
            "webster",
            "--no-trial",
            str(material.scenario),
            "--out",
            out,
            *used,
        ],
        "list": ["maps", "list", *used],
    }


@contextmanager
def _small_disk(folder: Path, kilobytes: int) -> Iterator[bool]:
    libc = ctypes.CDLL(None, use_errno=True)
    folder.mkdir(exist_ok=True)
    size = f"size={kilobytes}k".encode()
    if libc.mount(b"tmpfs", os.fsencode(folder), b"tmpfs", 0, size):
        yield False
        return
    try:
        yield True
    finally:
        libc.umount2(os.fsencode(folder), 2)


def _size(folder: Path) -> int:
    return sum((path.stat().st_size + 4095) // 4096 * 4 for path in folder.rglob("*")) + 64


def _full_disk(trial: Trial) -> str:
    workspace = trial.folder / "workspace"
    room = int(pick(trial.rng, (0, 4, 16, 64, 256, 1024)))
    taken = _size(trial.material.workspace / "maps") + _size(
        trial.material.workspace / "runs" / "done"
    )
    name, argv = pick(trial.rng, sorted(_commands(trial, workspace).items()))
    with _small_disk(workspace, taken + room) as mounted:
        if not mounted:
            trial.findings.append(Finding(Verdict.SKIPPED, "no file system can be mounted here"))
            return "full disk: not possible here"
        for part in ("maps", "runs/done"):
            shutil.copytree(trial.material.workspace / part, workspace / part)
        ended = trial.command(*argv, seconds=PATIENCE)
        if ended.code in (2, 3) and not _FULL.search(ended.err):
            words = f"a full disk is not named: {name}: {ended.err[-200:]}"
            trial.findings.append(Finding(Verdict.UNCLEAR, words))
        trial.limits.clean(1.0)
    return f"{name}, {room} kB free"


def _read_only(trial: Trial) -> str:
    """Permissions that forbid writing, and no rights of root."""
    workspace = trial.material.copy_workspace(trial.folder, "maps", "runs/done")
    name, argv = pick(trial.rng, sorted(_commands(trial, workspace).items()))
    folders = [workspace, *(path for path in workspace.rglob("*") if path.is_dir())]
    for path in folders:
        path.chmod(0o555)
    try:
        trial.command(*argv, plain=True, seconds=PATIENCE)
    finally:
        for path in folders:
            path.chmod(0o755)
    return f"{name}, read-only"


def _no_handles(trial: Trial) -> str:
    workspace = trial.material.copy_workspace(trial.folder, "maps", "runs/done")
    name, argv = pick(trial.rng, sorted(_commands(trial, workspace).items()))
    number = int(trial.rng.integers(5, 40))
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    # The bench itself has few open files; what it starts has as few.
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(number, 5), hard))
    try:
        pid = trial.limits.start(argv, trial.folder)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    ended = trial.limits.wait(
        pid, tuple(argv), trial.folder, begin=time.perf_counter(), seconds=PATIENCE
    )
    trial.findings.append(judge(ended))
    _left(trial, f"{name} with {number} files")
    kill_tree(pid)
    return f"{name}, {number} open files"


FAULT_TARGETS: dict[str, tuple[Callable[[Trial], str], float]] = {
    "disks": (disks, 0.3),
    "kills": (kills, 0.3),
    "starts": (starts, 0.2),
}
