"""One command in limits of memory and time, and what it left: no process outlives its trial.

Commands run in a fork of this process, which has imported them before: a start of Python would take
longer than most trials. A sample goes through the real command line (``whole``).
"""

from __future__ import annotations

import atexit
import ctypes
import os
import re
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil

import odscen

SECONDS = 15.0
MEMORY = 1_500_000_000
GRACE = 3.0
"""Seconds in which processes that a command has started may end after it."""
TRACEBACK = 70
"""Exit code of a command that raised anything but one of our errors."""
WRONG_RESULT = 71
"""Exit code of a question whose answer is that a result is wrong."""
_SUBREAPER = 36
_DROP_FOR_GOOD = 24
_CAPABILITIES_VERSION = 0x20080522
_ANYWHERE = (1, 2)
"""CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH."""
_SOURCES = str(Path(odscen.__file__).parents[1])


@dataclass(frozen=True, slots=True)
class Ended:
    """How a command ended: ``code`` is negative for a signal.

    ``peak`` are the bytes of the largest of its processes,
    ``hung`` and ``large`` say that it was killed for that, ``orphans`` what it left running.
    """

    argv: tuple[str, ...]
    code: int
    out: str
    err: str
    seconds: float
    peak: int
    hung: bool = False
    large: bool = False
    orphans: tuple[str, ...] = ()


@dataclass(slots=True)
class Limits:
    """Runs commands; ``own`` are processes of the bench itself, such as the server."""

    seconds: float = SECONDS
    memory: int = MEMORY
    own: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        # What a command leaves running becomes our child, and is seen.
        ctypes.CDLL(None).prctl(_SUBREAPER, 1, 0, 0, 0)

    def start(
        self,
        argv: Sequence[str],
        folder: Path,
        *,
        whole: bool = False,
        plain: bool = False,
        environment: Mapping[str, str] | None = None,
        question: Callable[[], str] | None = None,
        before: Callable[[], None] | None = None,
    ) -> int:
        """Start ``odscen ARGV`` in ``folder/cwd``; output goes to ``folder``; its process id.

        Parameters
        ----------
        question
            Asked instead of the command: what is wrong with a result, in words; none if nothing is.
        before
            Called in the new process, after its output goes to the folder.
        """
        for name in ("cwd", "tmp"):
            (folder / name).mkdir(parents=True, exist_ok=True)
        pid = os.fork()
        if pid == 0:
            call = question and (lambda: _answer(question))
            _child(tuple(argv), folder, whole, plain, dict(environment or {}), call, before)
        return pid

    def run(
        self, argv: Sequence[str], folder: Path, *, seconds: float | None = None, **how: Any
    ) -> Ended:
        """Run ``odscen ARGV`` to its end, or to the limits."""
        begin = time.perf_counter()
        pid = self.start(argv, folder, **how)
        return self.wait(pid, tuple(argv), folder, begin=begin, seconds=seconds)

    def wait(
        self,
        pid: int,
        argv: tuple[str, ...],
        folder: Path,
        *,
        begin: float,
        clean: bool = True,
        seconds: float | None = None,
    ) -> Ended:
        """Wait for a command, and for what it has started; kill what goes over the limits."""
        peak, hung, large = 0, False, False
        pause = 0.005
        while True:
            done, status = os.waitpid(pid, os.WNOHANG)
            if done:
                break
            peak = max(peak, high_water_of_tree(pid))
            hung = time.perf_counter() - begin > (seconds or self.seconds) * busy()
            large = peak > self.memory
            if hung or large:
                kill_tree(pid)
                _, status = os.waitpid(pid, 0)
                break
            time.sleep(pause)
            pause = min(pause * 1.5, 0.03)
        took = time.perf_counter() - begin
        orphans = self.clean(GRACE if not (hung or large) else 0.0) if clean else ()
        return Ended(
            argv,
            os.waitstatus_to_exitcode(status),
            _read(folder / "out"),
            _read(folder / "err"),
            took,
            peak,
            hung,
            large,
            () if hung or large else orphans,
        )

    def clean(self, grace: float) -> tuple[str, ...]:
        """Wait for processes that were left; kill those that stay, and name them."""
        end = time.perf_counter() + grace
        while left := self._left():
            if time.perf_counter() > end:
                names = tuple(" ".join(_words(one))[:120] for one in left)
                for one in left:
                    kill_tree(one.pid)
                    with suppress(ChildProcessError):
                        os.waitpid(one.pid, 0)
                return names
            time.sleep(0.05)
        return ()

    def _left(self) -> list[psutil.Process]:
        found = []
        for one in psutil.Process().children():
            if one.pid in self.own:
                continue
            with suppress(ChildProcessError):
                if os.waitpid(one.pid, os.WNOHANG)[0] == 0:
                    found.append(one)
        return found


def busy() -> float:
    """How many times longer everything takes here, as other processes want the same processors.

    A machine at its limit makes no hang of what is slow on it.
    """
    return max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))


def kill_tree(pid: int) -> None:
    """Kill a process and all that it started."""
    with suppress(psutil.Error):
        one = psutil.Process(pid)
        for each in [*one.children(recursive=True), one]:
            with suppress(psutil.Error):
                each.kill()


def _child(
    argv: tuple[str, ...],
    folder: Path,
    whole: bool,
    plain: bool,
    more: Mapping[str, str],
    call: Callable[[], int] | None,
    before: Callable[[], None] | None,
) -> None:
    """What the fork does; it never returns."""
    code = TRACEBACK
    try:
        _settle(folder, more)
        if plain:
            _give_up_rights()
        if before is not None:
            before()
        if whole:
            os.execv(sys.executable, [sys.executable, "-m", "odscen", *argv])
        code = call_command(argv) if call is None else call()
    except BaseException:
        traceback.print_exc()
    finally:
        with suppress(Exception):
            atexit._run_exitfuncs()
        with suppress(Exception):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)


def _settle(folder: Path, more: Mapping[str, str]) -> None:
    os.setsid()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler if number == 2 else signal.SIG_DFL)
    atexit._clear()
    with Path(os.devnull).open() as nothing:
        os.dup2(nothing.fileno(), 0)
    for number, name in ((1, "out"), (2, "err")):
        handle = os.open(folder / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
        os.dup2(handle, number)
        os.close(handle)
    sys.stdout = os.fdopen(1, "w", encoding="utf-8", errors="surrogateescape", closefd=False)
    sys.stderr = os.fdopen(2, "w", encoding="utf-8", errors="backslashreplace", closefd=False)
    os.environ.update(
        {
            "TMPDIR": str(folder / "tmp"),
            "COLUMNS": "200",
            "PYTHONPATH": _SOURCES,
            "ODSCEN_WORKSPACE": str(folder / "cwd" / "unasked"),
            **more,
        }
    )
    tempfile.tempdir = None
    os.chdir(folder / "cwd")


def _give_up_rights() -> None:
    """Do without what root has: to write and read where permissions forbid it."""
    libc = ctypes.CDLL(None)
    header = (ctypes.c_uint32 * 2)(_CAPABILITIES_VERSION, 0)
    sets = (ctypes.c_uint32 * 6)()
    libc.capget(header, sets)
    for number in _ANYWHERE:
        libc.prctl(_DROP_FOR_GOOD, number, 0, 0, 0)
        for kind in range(3):  # effective, permitted, inheritable
            sets[kind] &= ~(1 << number)
    libc.capset(header, sets)


def call_command(argv: tuple[str, ...]) -> int:
    """Call a command in this process; its exit code."""
    from odscen.cli import main

    sys.argv = ["odscen", *argv]
    try:
        main()
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else 1 if stop.code else 0
    except KeyboardInterrupt:
        return 130
    return 0


def _answer(question: Callable[[], str]) -> int:
    words = question()
    sys.stderr.write(words)
    return WRONG_RESULT if words else 0


def high_water_of_tree(pid: int) -> int:
    """Bytes of memory that the largest process of a tree has had."""
    try:
        tree = [pid, *(one.pid for one in psutil.Process(pid).children(recursive=True))]
    except psutil.Error:
        return 0
    return max((high_water(one) for one in tree), default=0)


def high_water(pid: int) -> int:
    """Bytes of memory that a process has had at most; 0 if it has ended."""
    try:
        text = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return 0
    found = re.search(r"^VmHWM:\s*(\d+) kB", text, re.MULTILINE)
    return int(found[1]) * 1024 if found else 0


def _words(one: psutil.Process) -> list[str]:
    try:
        return one.cmdline() or [one.name()]
    except psutil.Error:
        return [f"process {one.pid}"]


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
