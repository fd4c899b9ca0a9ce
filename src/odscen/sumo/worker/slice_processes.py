"""Slices of a long run in processes of their own, forked from one in which SUMO never runs.

Each is as fresh as one that has been started, with the plan read and the imports done; and one
process completes the slices of all of them. On Linux only: elsewhere each slice is a process that
is started anew.
"""

from __future__ import annotations

import ctypes
import json
import os
import signal
import sys
import traceback
from typing import TYPE_CHECKING, NamedTuple, NoReturn

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

POSSIBLE = sys.platform.startswith("linux")
"""Elsewhere a process that has loaded much cannot be relied on when it is forked."""
_SET_PDEATHSIG = 1
"""Of ``prctl``: the signal that a process gets when its parent has ended."""


class End(NamedTuple):
    """How a process that ran a slice ends.

    Attributes
    ----------
    code
        The exit code of its run, if it was the last.
    following
        How the next slice is to go, as arguments; ``None`` if none follows.
    """

    code: int
    following: list[str] | None = None


def in_processes(how: Sequence[str], run: Callable[[Sequence[str]], End]) -> End:
    """Run slices until one is the last, each in a process; how that one has ended.

    A process that a signal has ended takes this one with it, by the same signal.

    Parameters
    ----------
    how
        How the first slice is to go.
    run
        Runs the next slice.
    """
    end = End(0, list(how))
    while end.following is not None:
        end = _run_in_process(end.following, run)
    return end


def _run_in_process(how: Sequence[str], run: Callable[[Sequence[str]], End]) -> End:
    host = os.getpid()
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        os.close(reading)
        _become_slice(host, writing, run, how)
    os.close(writing)
    with os.fdopen(reading, "rb") as said:
        words = said.read()
    _, status = os.waitpid(child, 0)
    if os.WIFSIGNALED(status):
        _die_of(os.WTERMSIG(status))
    code = os.waitstatus_to_exitcode(status)
    return End(code) if code else End(*json.loads(words))


def _become_slice(
    host: int, writing: int, run: Callable[[Sequence[str]], End], how: Sequence[str]
) -> NoReturn:
    """Run a slice in this process, which has just been forked."""
    code = 1
    try:
        ctypes.CDLL(None).prctl(_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != host:  # it has ended before it was asked for
            os._exit(code)
        end = run(how)
        with os.fdopen(writing, "w", encoding="utf-8") as words:
            json.dump(end, words)
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _die_of(number: int) -> NoReturn:
    """End this process by a signal, as the one before it has ended."""
    if number != signal.SIGKILL:
        signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)
    os._exit(128 + number)
