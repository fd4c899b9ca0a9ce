"""Work on files from outside, in a process of its own with limits of memory, time and output.

What a file makes of it is then the child's end, never ours. A child that has ended its work well
waits for more, for its imports take longer than a small map; one waits at most.
"""

from __future__ import annotations

import atexit
import json
import os
import selectors
import signal
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from odscen.base.error_data import error_from_data
from odscen.base.errors import ToolError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from odscen.maps.allowances import Allowance

_TICK = 0.2
"""Seconds between two looks at the clock, and two calls of the function that is told progress."""
_MOST_KEPT = 256 << 20
"""Bytes that a child may have needed at most if it is to wait for more work."""
_WORDS_KEPT = 2000

_OUT_OF_MEMORY = ("bad_alloc", "MemoryError", "memory allocation of")
"""What C++, Python and Rust say when they end for want of memory."""

_ROOT = str(Path(__file__).parents[2])
# Neither the folder of the caller nor that of a script may hide modules of Python's.
_START = (
    f"import sys; sys.path.append({_ROOT!r}); from odscen.maps.child_worker import main; main()"
)


def work_in_child(
    name: str,
    *,
    what: str,
    arguments: Mapping[str, Any],
    folders: tuple[Path, ...],
    allowance: Allowance,
    progress: Callable[[str, float], None] | None = None,
) -> dict[str, Any]:
    """Do a job in a child process.

    Parameters
    ----------
    name
        Of a job of :mod:`odscen.maps.child_jobs`, or of a function elsewhere, as
        ``module:function``.
    what
        What is done, for messages, such as "building the map".
    arguments
        Of the job; names of files and values that JSON can have.
    folders
        Folders that the child may write into: the first one for temporary files. It removes them
        if this process ends before it.
    progress
        Called with what is done and the share done, again and again while nothing changes too.
        What it raises ends the work, and passes through.

    Returns
    -------
    dict
        What the job returns.

    Raises
    ------
    LimitError
        If the work passes a limit of ``allowance``.
    ToolError
        If the child dies of something else.
    OdscenError, OSError
        What the work itself raises.
    """
    request = {
        "name": name,
        "arguments": dict(arguments),
        "folders": [str(folder) for folder in folders],
        "memory": allowance.memory,
        "seconds": allowance.seconds,
        "output": allowance.output,
    }
    child = _take_child()
    try:
        tell = progress or (lambda _what, _share: None)
        answer = child.ask(request, tell, seconds=allowance.wall_seconds)
    except BaseException:
        child.end()
        raise
    if "died" in answer:
        _raise_for_death(*child.end(), what, allowance)
    if answer.get("peak", _MOST_KEPT) < _MOST_KEPT and not {"limit", "fault"} & set(answer):
        _give_back(child)
    else:
        child.end()
    _raise_for(answer, what, allowance)
    done: dict[str, Any] = answer["done"]
    return done


def keep_ready() -> None:
    """Have a child wait for work, so that the first file does not wait for its imports."""
    _give_back(_take_child())


class _Child:
    """A process that works on one job at a time."""

    def __init__(self) -> None:
        # Words of libraries on their way down; for messages only.
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the child
        self._process = process = subprocess.Popen(
            [sys.executable, "-P", "-c", _START],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            # Of its own, so that Ctrl-C reaches us alone, and that it ends with what it started.
            start_new_session=True,
            # What many threads set aside would make the memory depend on the machine.
            env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        )
        assert process.stdin is not None
        assert process.stdout is not None
        self._stdin, self._stdout = process.stdin, process.stdout

    @property
    def alive(self) -> bool:
        """Whether it waits for work."""
        return self._process.poll() is None

    def ask(
        self, request: Mapping[str, Any], progress: Callable[[str, float], None], *, seconds: float
    ) -> dict[str, Any]:
        """Give it a job and wait for the answer."""
        os.ftruncate(self._log.fileno(), 0)
        self._log.seek(0)  # the child's place in it as well
        with suppress(BrokenPipeError):
            self._stdin.write(json.dumps(request).encode() + b"\n")
            self._stdin.flush()
        deadline = time.monotonic() + seconds
        told: tuple[str, float] = ("starting", 0.0)
        for message in self._read_messages():
            if "progress" in message:
                told = message["progress"][0], message["progress"][1]
            elif message:
                return message
            progress(*told)
            if time.monotonic() > deadline:
                return {"limit": "wall"}
        return {"died": True}

    def _read_messages(self) -> Iterator[dict[str, Any]]:
        """What it says until it dies, and nothing whenever it says nothing for a moment."""
        received = b""
        with selectors.DefaultSelector() as selector:
            selector.register(self._stdout, selectors.EVENT_READ)
            while True:
                if not selector.select(_TICK):
                    yield {}
                    continue
                part = os.read(self._stdout.fileno(), 1 << 16)
                if not part:
                    return
                *lines, received = (received + part).split(b"\n")
                for line in lines:
                    yield json.loads(line)

    def end(self) -> tuple[int, str]:
        """End it, if it has not ended, with whatever it has started.

        Returns
        -------
        Its exit code, and the end of what libraries said.
        """
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        code = self._process.wait()
        size = self._log.seek(0, os.SEEK_END)
        self._log.seek(max(0, size - _WORDS_KEPT))
        words = self._log.read().decode("utf-8", "replace")
        self.forget()
        return code, words

    def forget(self) -> None:
        """Close the connection."""
        for file in (self._stdin, self._stdout, self._log):
            with suppress(OSError):  # what was not written when it died
                file.close()


_lock = threading.Lock()
_waiting: list[_Child] = []
_foreign: list[_Child] = []


def _take_child() -> _Child:
    """A child that waits for work, or a new one."""
    with _lock:
        while _waiting:
            child = _waiting.pop()
            if child.alive:
                return child
            child.end()
    return _Child()


def _give_back(child: _Child) -> None:
    with _lock:
        if not _waiting:
            _waiting.append(child)
            return
    child.end()


@atexit.register
def end_waiting() -> None:
    """End the child that waits for work."""
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGINT):  # it is ending, whoever asks for it now
            signal.signal(number, signal.SIG_IGN)
    with _lock:
        while _waiting:
            _waiting.pop().end()


def _leave_children() -> None:
    """Leave the children to the process that has them: their pipes must end with it."""
    global _lock  # noqa: PLW0603 - another thread may have held it
    _lock = threading.Lock()
    for child in _waiting:
        child.forget()
    _foreign.extend(_waiting)
    _waiting.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_children)


def _raise_for(answer: Mapping[str, Any], what: str, allowance: Allowance) -> None:
    """Raise what the work, or its limits, have raised."""
    if "limit" in answer:
        raise allowance.passed(what, answer["limit"])
    if "error" in answer:
        raise error_from_data(answer["error"])
    if "os_error" in answer:
        raise OSError(*answer["os_error"])
    if "fault" in answer:
        raise ToolError(f"{what} failed, which is a fault of odscen: {answer['fault']}")


def _raise_for_death(code: int, words: str, what: str, allowance: Allowance) -> NoReturn:
    if code == -getattr(signal, "SIGXCPU", 24):
        raise allowance.passed(what, "time")
    if code < 0:
        name = signal.Signals(-code).name if -code in set(signal.Signals) else str(-code)
        reason = f"was ended by signal {name}"
        if name == "SIGKILL":
            reason += ", perhaps by the system for want of memory"
    else:
        reason = f"ended with exit code {code}"
    if any(sign in words for sign in _OUT_OF_MEMORY):
        raise allowance.passed(what, "memory")
    raise ToolError(f"{what} failed: its process {reason}", output=words)
