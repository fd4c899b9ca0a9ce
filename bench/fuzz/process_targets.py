"""Trials with odd surroundings: streams that are closed, names that are no text, limits, TMPDIR.

All start the real command line, for streams and limits are met while Python starts.
"""

from __future__ import annotations

import os
import resource
import shutil
import time
from collections.abc import Callable
from pathlib import Path

from bench.fuzz.damage import pick
from bench.fuzz.material import CROSSING
from bench.fuzz.trials import Target, Trial
from bench.fuzz.verdicts import Finding, Verdict, judge, left_over, listing

SECONDS = 60.0
"""A command takes longer where all its imports are its own."""


def _calls(trial: Trial, workspace: Path, out: str) -> dict[str, list[str]]:
    """Commands that read and write, with ``out`` as the name of what they write."""
    material, used = trial.material, ["--workspace", str(workspace)]
    done, turned = str(material.file("done.scenario.json")), material.file("turned.scenario.json")
    run = str(workspace / "runs" / "done")
    return {
        "run": ["run", done, "--until", "3", "--out", out, *used],
        "check": ["check", done, *used],
        "generate": ["generate", "--map", CROSSING, "--out", out, *used],
        "report": ["report", run, "--out", f"{out}.html", *used],
        "compare": ["compare", run, run, "--html", f"{out}.html", *used],
        "export": ["export", run, "--to", "pyg", "--out", out, *used],
        "export a scenario": ["export", done, "--to", "openscenario", "--out", out, *used],
        "import": ["import", str(material.file("osc") / "scene.xosc"), "--out", out, *used],
        "sweep": ["sweep", str(turned), "--vary", "gap=6,8", "--out", out, "--dry-run", *used],
        "study": [
            *("study", "run", str(material.file("study.toml")), "--dry-run", "--out", out),
            *used,
        ],
        "maps add": ["maps", "add", str(material.map_files[1]), *used],
        "maps list": ["maps", "list", "--json", *used],
        "maps render": ["maps", "render", CROSSING, "--out", f"{out}.svg", *used],
        "maps network": ["maps", "network", CROSSING, "--out", f"{out}.net.xml", *used],
        "doctor": ["doctor", *used],
        "help": ["--help"],
        "usage": ["run", "--nothing"],
    }


def odd_names(trial: Trial) -> str:
    """Names of files and folders that are no text, or no name, for what is written and read."""
    rng = trial.rng
    name = pick(rng, _NAMES)
    workspace = trial.material.copy_workspace(trial.folder, "maps", "runs/done")
    where = pick(rng, ("out", "out", "workspace", "source", "cwd"))
    base = os.fsencode(trial.folder) + b"/"
    out = os.fsdecode(base + name) if where == "out" else str(trial.folder / "written")
    if where == "workspace":
        other = Path(os.fsdecode(base + name))
        try:
            workspace.rename(other)
            workspace = other
        except OSError:
            where = "out"
    calls = _calls(trial, workspace, out)
    command = pick(rng, sorted(calls))
    argv = calls[command]
    if where == "source":
        for number, word in enumerate(argv):
            if word.endswith((".scenario.json", ".xodr", ".xosc", ".toml")):
                suffix = word[word.index(".") :].encode()
                copy = base + name.replace(b"/", b"") + suffix
                try:
                    shutil.copy(word, copy)
                except OSError:
                    continue
                argv = [*argv[:number], os.fsdecode(copy), *argv[number + 1 :]]
    environment = pick(rng, _LOCALES)
    _run(trial, argv, environment=environment)
    return f"{command}, {where} {name!r}, {environment}"


_NAMES = (
    b"r\xff",
    b"\xff\xfe\x1b[31m",
    "ü ß 😀".encode(),
    b"-x",
    b" ",
    b"a b",
    b"a\nb",
    b"a\tb",
    "\u202egnp".encode(),
    b"x" * 240,
    b"x" * 300,
    b"a/" * 1500,
    b"{x}%s$HOME`id`",
    b"a'b\"c",
    b"CON",
    b"..",
    b".hidden",
    b"a#b?c&d=e",
    b"\xc3",
    b"\\",
    b"<b>&amp;",
    b"nul\x01",
)
_LOCALES: tuple[dict[str, str], ...] = (
    {},
    {},
    {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"},
    {"LC_ALL": "C.UTF-8"},
    {"LC_ALL": "nonsense"},
    {"PYTHONIOENCODING": "ascii"},
    {"PYTHONIOENCODING": "latin-1"},
    {"LANG": "", "LC_ALL": "POSIX", "PYTHONUTF8": "0"},
)


def _run(
    trial: Trial,
    argv: list[str],
    *,
    environment: dict[str, str] | None = None,
    before: Callable[[], None] | None = None,
    silent: bool = False,
) -> None:
    """Run the real command line; ``silent``: its words cannot be seen, and are not asked for."""
    roots = [trial.folder]
    listed = listing(roots)
    begin = time.perf_counter()
    pid = trial.limits.start(argv, trial.folder, whole=True, environment=environment, before=before)
    ended = trial.limits.wait(pid, tuple(argv), trial.folder, begin=begin, seconds=SECONDS)
    trial.peak = max(trial.peak, ended.peak)
    finding = judge(ended)
    if silent and finding.verdict is Verdict.UNCLEAR and not ended.err.strip():
        finding = Finding(Verdict.REFUSED, finding.words)
    if not finding.verdict.failed:
        own = {str(trial.folder / name) for name in ("out", "err", "cwd", "tmp")}
        after = {name: stat for name, stat in listing(roots).items() if name not in own}
        known = {name: stat for name, stat in listed.items() if name not in own}
        if left := left_over(known, after, refused=ended.code == 2):
            finding = Finding(Verdict.LEFTOVER, f"{finding.words} ({left})")
    trial.findings.append(finding)


def streams(trial: Trial) -> str:
    """Streams that are closed, full, or pipes without a reader."""
    rng = trial.rng
    kind = pick(rng, sorted(_STREAMS))
    workspace = trial.material.copy_workspace(trial.folder, "maps", "runs/done")
    calls = _calls(trial, workspace, str(trial.folder / "out-of-it"))
    command = pick(rng, sorted(calls))
    _run(trial, calls[command], before=_STREAMS[kind], silent=True)
    return f"{command}, {kind}"


def _close(*numbers: int) -> Callable[[], None]:
    def close() -> None:
        for number in numbers:
            os.close(number)

    return close


def _full(number: int) -> Callable[[], None]:
    def fill() -> None:
        handle = os.open("/dev/full", os.O_WRONLY)
        os.dup2(handle, number)
        os.close(handle)

    return fill


def _broken_pipe(number: int) -> Callable[[], None]:
    def break_pipe() -> None:
        reading, writing = os.pipe()
        os.close(reading)
        os.dup2(writing, number)
        os.close(writing)

    return break_pipe


def _read_only() -> None:
    handle = os.open("/dev/null", os.O_RDONLY)
    os.dup2(handle, 1)
    os.close(handle)


_STREAMS: dict[str, Callable[[], None]] = {
    "all closed": _close(0, 1, 2),
    "stderr closed": _close(2),
    "stdin closed": _close(0),
    "stdin and stdout closed": _close(0, 1),
    "stdout and stderr closed": _close(1, 2),
    "stdout closed": _close(1),
    "stdout full": _full(1),
    "stderr full": _full(2),
    "stdout a broken pipe": _broken_pipe(1),
    "stderr a broken pipe": _broken_pipe(2),
    "stdout not to be written": _read_only,
}


def limits(trial: Trial) -> str:
    """Little address space, short files, few processes and handles, little stack, little time."""
    rng = trial.rng
    what, values = pick(rng, sorted(_LIMITS.items()))
    value = int(pick(rng, values))
    workspace = trial.material.copy_workspace(trial.folder, "maps", "runs/done")
    calls = _calls(trial, workspace, str(trial.folder / "out-of-it"))
    command = pick(rng, sorted(calls))

    def limit() -> None:
        number = getattr(resource, f"RLIMIT_{what}")
        resource.setrlimit(number, (value, value))

    _run(trial, calls[command], before=limit, silent=True)
    finding = trial.findings[-1]
    killed = finding.verdict is Verdict.CRASH and "(exit code -" in finding.words
    if killed and what == "CPU":  # the kernel's word, not ours
        trial.findings[-1] = Finding(Verdict.REFUSED, finding.words)
    return f"{command}, {what} {value}"


_LIMITS: dict[str, tuple[int, ...]] = {
    "AS": (600_000_000, 1_000_000_000, 1_500_000_000, 2_000_000_000, 2_100_000_000, 3_000_000_000),
    "DATA": (200_000_000, 500_000_000, 1_000_000_000),
    "FSIZE": (0, 1, 4096, 100_000, 1_000_000),
    "NOFILE": (6, 10, 16, 24, 40),
    "STACK": (256_000, 1_000_000),
    "CPU": (1,),
    "CORE": (0,),
}


def shared_temporary(trial: Trial) -> str:
    """A temporary folder in which others were first: links and folders with names like ours."""
    rng = trial.rng
    temporary = trial.folder / "tmp"
    temporary.mkdir()
    theirs = trial.folder / "theirs"
    theirs.mkdir()
    (theirs / "precious").write_text("of others", encoding="utf-8")
    (theirs / "tmpabc").mkdir()
    uid = os.getuid()
    for prefix in ("odscen", "odscen-studies", "odscen-child", "odscen-workers", "odscen-cache"):
        for suffix in (f"-{uid}", "", "-0", "-1000"):
            path = temporary / f"{prefix}{suffix}"
            if path.is_symlink() or path.exists():
                continue
            if rng.random() < 0.5:
                path.symlink_to(theirs)
            else:
                path.mkdir(mode=int(pick(rng, (0o777, 0o700, 0o000))))
    workspace = trial.material.copy_workspace(trial.folder, "maps", "runs/done")
    before = listing([theirs])
    material, used = trial.material, ["--workspace", str(workspace)]
    out = str(trial.folder / "made")
    command = pick(
        rng,
        (
            ["study", "run", str(material.file("study.toml")), "--out", out, "--jobs", "2"],
            ["run", str(material.file("done.scenario.json")), "--until", "3", "--out", out],
            ["maps", "add", str(material.map_files[1])],
            ["test", str(material.file("suite") / "suite.toml")],
            ["dataset", str(material.file("dataset.toml")), "--out", out],
        ),
    )
    how = pick(rng, ("shared", "shared", "none", "read-only", "long", "relative", "file"))
    environment = {
        "shared": {},
        "read-only": {},
        "none": {"TMPDIR": str(trial.folder / "nowhere")},
        "long": {"TMPDIR": str(_long_folder(trial.folder))},
        "relative": {"TMPDIR": "relative"},
        "file": {"TMPDIR": str(theirs / "precious")},
    }[how]
    if how == "read-only":
        temporary.chmod(0o555)
    try:
        _run(trial, [*command, *used], environment=environment)
    finally:
        temporary.chmod(0o755)
    if listing([theirs]) != before:
        trial.wrong("what others have in the temporary folder was changed through a link")
    return f"{command[0]}, {how}"


def _long_folder(folder: Path) -> Path:
    made = folder / ("x" * 100) / ("y" * 100)
    made.mkdir(parents=True)
    return made


PROCESS_TARGETS: dict[str, tuple[Target, float]] = {
    "limits": (limits, 0.3),
    "odd names": (odd_names, 0.4),
    "shared temporary": (shared_temporary, 0.2),
    "streams": (streams, 0.3),
}
"""As :data:`bench.fuzz.file_targets.FILE_TARGETS`."""
