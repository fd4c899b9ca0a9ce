"""Start the worker process in a prepared run folder and follow it to its end."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Protocol

from odscen.base.errors import SimulationError
from odscen.base.system_errors import ADVICE, NO_MEMORY, system_words
from odscen.runs.layout import LOG_FILE, PLAN_FILE
from odscen.runs.new_run import SimulationOutcome
from odscen.runs.reporter import Progress
from odscen.sumo.runner.forked_worker import ForkedWorker, worker_environment
from odscen.sumo.worker.protocol import (
    Command,
    Done,
    EgoPose,
    Failed,
    FrameMessage,
    MoreRules,
    Outside,
    ShotMessage,
    State,
    decode,
    encode,
)
from odscen.sumo.worker.slice_processes import POSSIBLE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from odscen.sumo.worker.protocol import Left, Lockstep, Message, Pace

WORKER = "odscen.sumo.worker.simulate"
SILENT_FOR = 5.0
"""Wall seconds in which a worker that is called off may say nothing."""


class Companion(Protocol):
    """Who goes with a run while it lasts: a watcher, or another simulator in step with it.

    Methods are called in the thread that follows the worker.
    """

    @property
    def failure(self) -> str | None:
        """Why the run has failed although SUMO has not: its results until then are kept."""

    @property
    def start(self) -> Pace | Lockstep:
        """How the worker is to go."""

    def attach(self, process: subprocess.Popen[bytes]) -> None:
        """Connect with a worker that has just been started with a pipe as its stdin."""

    def take(self, message: Message, payload: bytes) -> None:
        """Take in what the worker says."""

    def detach(self) -> None:
        """Learn that the worker has ended, however it did."""


def run_worker(
    folder: Path,
    *,
    progress: Callable[[Progress], None] | None = None,
    time_limit: float | None = None,
    live: Companion | None = None,
    keep: tuple[int, ...] = (),
    forked: bool = False,
    results: Callable[[Left], None] | None = None,
    called_off: Callable[[], bool] = lambda: False,
) -> SimulationOutcome:
    """Run the simulation prepared in ``folder``.

    Never raises for what happens inside the process: a crash, an error of SUMO's or running out of
    time are described in the result.

    Parameters
    ----------
    folder
        Holds ``plan.json`` and ``sumo/``.
    progress
        Called with each progress message, in this thread.
    time_limit
        Wall seconds after which the process is killed.
    live
        Makes it a run that can be watched and steered, or that goes in step with another.
    keep
        File descriptors that the process inherits.
    forked
        Whether its process may be forked by one that has done the imports; not for a run that is
        live.
    results
        Makes the results of a small run from what a forked process has left: to that, all that
        Python does is dear, and the first table costs as much as the simulation.
    called_off
        Whether it is to end before its time: a worker that says nothing for :data:`SILENT_FOR`
        seconds after that, as SUMO may be in a step that does not end, is killed. ``progress`` is
        called once more then.
    """
    start = time.perf_counter()
    late = threading.Event()
    # Python's own words (a traceback before the worker has opened its log) belong in the log too.
    with (
        (folder / LOG_FILE).open("ab") as log,
        _start_process(
            folder / PLAN_FILE,
            log.fileno(),
            live,
            keep,
            forked=forked and POSSIBLE,
            raw=results is not None,
        ) as process,
    ):
        timer = _kill_after(process, time_limit, late)
        watch = _SilenceWatch(process, called_off)
        watch.start()
        try:
            if results is not None:
                import polars as pl  # its import takes longer than a short simulation

                del pl
            last = _follow_process(process, progress, live, watch)
        except BaseException:  # an interrupt, or the caller's progress function
            _kill_process(process)
            raise
        finally:
            watch.ended.set()
            if timer is not None:
                timer.cancel()
            if live is not None:
                live.detach()
    seconds = time.perf_counter() - start
    if isinstance(last, Done) and not process.returncode and results is not None:
        last = _with_results(last, results)
    if isinstance(last, Done) and not process.returncode:
        return SimulationOutcome(
            last.sim_seconds,
            last.steps,
            seconds,
            error=live.failure if live else None,
            stopped=last.stopped,
            work_seconds=last.wall_seconds,
        )
    if watch.killed:
        words = "SUMO was in a step that did not end when the run was called off, and was killed"
        return SimulationOutcome(None, None, seconds, error=words)
    if late.is_set():
        words = f"stopped after the time limit of {time_limit:g} s"
        return SimulationOutcome(None, None, seconds, error=words)
    reason = last.reason if isinstance(last, Failed) else _exit_words(process.returncode)
    words = sumo_words(folder)
    reason = _with_lack(folder, reason, words)
    if words:
        reason = f"{reason}\n{words}"
    return SimulationOutcome(None, None, seconds, error=reason)


def _with_results(done: Done, make: Callable[[Left], None]) -> Done | Failed:
    """Make the results that the worker has left."""
    if done.left is None:
        return done
    try:
        make(done.left)
    except SimulationError as error:
        return Failed(str(error))
    except OSError as error:
        return Failed(system_words(error))
    except MemoryError:
        return Failed(NO_MEMORY)
    return done


def _start_process(
    plan: Path,
    log: int,
    live: Companion | None,
    keep: tuple[int, ...],
    *,
    forked: bool,
    raw: bool,
) -> subprocess.Popen[bytes] | ForkedWorker:
    """Start the process of a simulation."""
    if forked:
        return ForkedWorker(plan, stderr=log, keep=keep, raw=raw)
    command = [sys.executable, "-m", WORKER, str(plan)]
    if live is not None:
        command.append(encode(live.start))
    return subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL if live is None else subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=log,
        # A terminal sends Ctrl-C to all of its processes. A worker that it reached would end as
        # a failed run, and the folder of a run that was called off would appear.
        start_new_session=True,
        env=worker_environment(),
        pass_fds=keep,
    )


def _follow_process(
    process: subprocess.Popen[bytes] | ForkedWorker,
    progress: Callable[[Progress], None] | None,
    live: Companion | None,
    watch: _SilenceWatch,
) -> Done | Failed | None:
    """Pass on what the worker says; return the last thing it said of its end."""
    last: Done | Failed | None = None
    so_far = Progress(0.0, 0.0, running=0, departed=0, arrived=0, planned=0)
    if live is not None and not isinstance(process, ForkedWorker):
        live.attach(process)
    for message, payload in messages(process):
        watch.heard = time.monotonic()
        if live is not None:
            live.take(message, payload)
        if isinstance(message, Progress) and progress is not None:
            so_far = message
            progress(message)
        elif isinstance(message, Done | Failed):
            last = message
    if watch.killed and progress is not None:
        progress(so_far)  # where who has called it off raises
    return last


def messages(process: subprocess.Popen[bytes] | ForkedWorker) -> Iterator[tuple[Message, bytes]]:
    """Yield what the worker says, each message with the bytes that belong to it."""
    if process.stdout is None:
        return
    for line in process.stdout:
        message = decode(line)
        if message is None or isinstance(message, Command | EgoPose | Outside | MoreRules):
            continue
        size = message.size if isinstance(message, FrameMessage | State | ShotMessage) else 0
        yield message, process.stdout.read(size)


def sumo_words(folder: Path, *, lines: int = 12) -> str:
    """SUMO's error messages in a run's log, else its last lines."""
    try:
        text = (folder / LOG_FILE).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
    last_lines = [line.rstrip() for line in text.splitlines() if line.strip()]
    first = next((i for i, line in enumerate(last_lines) if line.startswith("Error")), None)
    return "\n".join(last_lines[-lines:] if first is None else last_lines[first : first + lines])


def _kill_after(
    process: subprocess.Popen[bytes] | ForkedWorker, seconds: float | None, late: threading.Event
) -> threading.Timer | None:
    if seconds is None:
        return None

    def kill() -> None:
        late.set()
        _kill_process(process)

    timer = threading.Timer(seconds, kill)
    timer.daemon = True
    timer.start()
    return timer


class _SilenceWatch(threading.Thread):
    """Kills a worker that is called off and does not hear of it."""

    def __init__(
        self, process: subprocess.Popen[bytes] | ForkedWorker, called_off: Callable[[], bool]
    ) -> None:
        super().__init__(daemon=True)
        self._process, self._called_off = process, called_off
        self.heard = time.monotonic()
        self.ended = threading.Event()
        self.killed = False

    def run(self) -> None:
        since: float | None = None
        while not self.ended.wait(SILENT_FOR / 10.0):
            if not self._called_off():
                since = None
                continue
            since = since or time.monotonic()
            if time.monotonic() - max(since, self.heard) > SILENT_FOR:
                self.killed = True
                _kill_process(self._process)
                return


def _kill_process(process: subprocess.Popen[bytes] | ForkedWorker) -> None:
    """End the worker and whatever it has started: its session is its own."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


def _with_lack(folder: Path, reason: str, words: str) -> str:
    """Why a worker has failed; first what the machine had no more of, if that can be told."""
    lack = None
    with suppress(OSError):
        if shutil.disk_usage(folder).free < _NO_ROOM:
            lack = ADVICE[errno.ENOSPC]
    for sign, number in _SIGNS.items():
        if lack is None and (sign in reason or sign in words):
            lack = ADVICE[number]
    return reason if lack is None or lack in reason else f"{lack}\n{reason}"


_NO_ROOM = 1 << 16
"""Bytes; with less left on the disk, what has just failed has failed for that."""
_SIGNS = {
    "No space left on device": errno.ENOSPC,
    "Read-only file system": errno.EROFS,
    "Permission denied": errno.EACCES,
    "Too many open files": errno.EMFILE,
    "bad_alloc": errno.ENOMEM,
    "MemoryError": errno.ENOMEM,
    "Cannot allocate memory": errno.ENOMEM,
    "failed to map segment from shared object": errno.ENOMEM,
}
"""What SUMO, Python and the libraries of both say where the machine lacks something."""


def _exit_words(code: int | None) -> str:
    if code is None or code == -signal.SIGKILL:
        return (
            "SUMO's process was ended by signal SIGKILL; "
            "if you have not sent it, the memory was used up: run less at a time"
        )
    if code < 0:
        name = signal.Signals(-code).name if -code in set(signal.Signals) else str(-code)
        return f"SUMO crashed: its process was ended by signal {name}"
    return f"the simulation process ended with exit code {code} without a result"
