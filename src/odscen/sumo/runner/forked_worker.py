"""Worker processes forked by one that has done the imports, see ``sumo/worker/fork_server.py``."""

from __future__ import annotations

import atexit
import json
import os
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Self

from odscen.base.errors import ResourceError
from odscen.base.shell_variables import OF_THE_SHELL
from odscen.sumo.runner.allocator import fast_allocator
from odscen.sumo.worker.slice_processes import POSSIBLE

if TYPE_CHECKING:
    from typing import BinaryIO

SERVER = "odscen.sumo.worker.fork_server"
SET_BY_POLARS = "_RJEM_MALLOC_CONF"
"""Set when polars is imported, here and there; a server may have been started before."""
_TRIES = 2
"""The server may have ended for want of work just when it was asked."""


class ForkedWorker:
    """The process of one simulation, as :class:`subprocess.Popen` is one of those started.

    Parameters
    ----------
    plan
        File of the plan.
    stderr
        Descriptor that gets its words.
    keep
        Descriptors that it holds open.
    raw
        Whether it may leave what SUMO has written to be made into tables.

    Attributes
    ----------
    stdout
        Where its messages are read.
    pid
        Number of the process, which leads a session of its own.
    returncode
        ``None`` until it has ended, and if it is not known how.

    Raises
    ------
    ResourceError
        If no process can be started.
    """

    def __init__(
        self, plan: Path, *, stderr: int, keep: tuple[int, ...] = (), raw: bool = False
    ) -> None:
        self.returncode: int | None = None
        reading, stdout = os.pipe()
        self.stdout: BinaryIO = os.fdopen(reading, "rb")
        try:
            self.pid, self._said = _fork_process(plan, (stdout, stderr, *keep), raw=raw)
        except BaseException:
            self.stdout.close()
            raise
        finally:
            os.close(stdout)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stdout.close()
        with self._said as said:
            words = said.readline().split()
        self.returncode = int(words[1]) if words else None


class _Server:
    """The process that forks, and the socket to it."""

    def __init__(self, environment: dict[str, str], *, idle: float | None = None) -> None:
        self.environment = environment
        self._control, theirs = socket.socketpair()
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", SERVER, *([] if idle is None else [str(idle)])],
                stdin=theirs.fileno(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C reaches us alone
                env=environment,
            )

    def ask(self, request: bytes, descriptors: tuple[int, ...]) -> None:
        """Ask for a process; one that has ended meanwhile shows in its silence."""
        with suppress(OSError):
            socket.send_fds(self._control, [request], descriptors)

    def suits(self, environment: dict[str, str]) -> bool:
        """Whether what it forks has this environment, but for what polars sets for itself."""
        names = {*environment, *self.environment} - {SET_BY_POLARS, *OF_THE_SHELL}
        return all(environment.get(name) == self.environment.get(name) for name in names)

    @property
    def alive(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    def end(self) -> None:
        """End it; what it has forked goes on."""
        self.forget()
        self._process.terminate()
        self._process.wait()

    def forget(self) -> None:
        """Close the connection."""
        self._control.close()


_lock = threading.Lock()
_server: _Server | None = None
_many = False


def worker_environment() -> dict[str, str]:
    """Environment of a worker; what the user has set stays."""
    # One thread simulates; those that NumPy would start only wait, and burn time in doing so.
    variables = {"OPENBLAS_NUM_THREADS": "1"}
    allocator = fast_allocator()
    if allocator is not None:
        variables["LD_PRELOAD"] = allocator
    return {**variables, **os.environ}


def get_ready(*, idle: float | None = None) -> None:
    """Start the process that forks, so that its imports are done while others are.

    Parameters
    ----------
    idle
        Wall seconds without a run after which it ends; a minute if not given.
    """
    if POSSIBLE:
        with _lock:
            _ready_server(idle)


def expect_runs(number: int) -> None:
    """Learn that so many runs will be made: of more than one the first is forked, too."""
    global _many  # noqa: PLW0603 - as above
    with _lock:
        _many = _many or number > 1


def is_one_of_many() -> bool:
    """Whether a run that is about to begin is one of many: announced, or not the first.

    Processes of many runs are forked by one that does the imports once, which costs a single run
    more than it saves, unless it has been started already; and what they record is made into tables
    here, where all that this needs is loaded once.
    """
    global _many
    with _lock:
        known, _many = _many, True
    return known


def is_ready() -> bool:
    """Whether that process has been started, so that a single run had better be forked too."""
    with _lock:
        return POSSIBLE and _server is not None and _server.alive


def _ready_server(idle: float | None = None) -> _Server:
    global _server  # noqa: PLW0603 - one for all runs of this process
    environment = worker_environment()
    if _server is not None and not (_server.alive and _server.suits(environment)):
        _server.end()
        _server = None
    if _server is None:
        _server = _Server(environment, idle=idle)
    return _server


def _fork_process(plan: Path, descriptors: tuple[int, ...], *, raw: bool) -> tuple[int, BinaryIO]:
    """Have a process forked; its number, and where its end is said."""
    try:
        folder = str(Path.cwd())
    except FileNotFoundError:
        folder = None  # it has been removed
    request = json.dumps({"plan": str(plan), "cwd": folder, "raw": raw}).encode()
    global _server  # noqa: PLW0603 - one for all runs of this process
    for _ in range(_TRIES):
        reading, said_to = os.pipe()
        said = os.fdopen(reading, "rb")
        with _lock:  # one message at a time: the socket keeps no bounds between them
            _ready_server().ask(request, (said_to, *descriptors))
            os.close(said_to)  # when nobody else holds it, the server has ended
            words = said.readline().split()
            if words[:1] == [b"pid"]:
                return int(words[1]), said
            if _server is not None:  # it is dying, which its process need not show yet
                _server.end()
                _server = None
        said.close()
    raise ResourceError("no process can be started for a simulation")


@atexit.register
def _end_server() -> None:
    with _lock:
        if _server is not None:
            _server.end()


def _after_fork() -> None:
    """Leave the server to the process that has it: its socket must close with it."""
    global _lock, _server  # noqa: PLW0603 - another thread may have held it
    _lock = threading.Lock()
    if _server is not None:
        _server.forget()
        _foreign.append(_server)
    _server = None


_foreign: list[_Server] = []

if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_after_fork)
