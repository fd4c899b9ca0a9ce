"""The worker's side of the process that completes slices: :mod:`odscen.sumo.worker.completer`."""

from __future__ import annotations

import os
import subprocess
import sys
from multiprocessing.connection import Pipe
from typing import TYPE_CHECKING, Self

from odscen.base.errors import SimulationError

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.sumo.worker.completer import WrittenSlice

COMPLETER = "odscen.sumo.worker.completer"


class CompleterGoneError(SimulationError):
    """The process that completes slices has ended before its time."""

    def __init__(self, code: int | None = None) -> None:
        ended = "has ended" if code is None else f"has ended with exit code {code}"
        super().__init__(
            f"the process that completes what was recorded {ended}; "
            "the memory may have been too small"
        )


class Completion:
    """Completes slices; what it needs to know of those before it reads while SUMO simulates."""

    def __init__(self, run: Path) -> None:
        self._connection, theirs = Pipe()
        os.set_inheritable(theirs.fileno(), True)
        # It inherits the lock of the run, which no other may touch before it has ended, too, and
        # where the worker's messages go: their reader knows from their end that both have.
        self._process = subprocess.Popen(
            [sys.executable, "-m", COMPLETER, str(run), str(theirs.fileno())],
            stdin=subprocess.DEVNULL,
            close_fds=False,
        )
        theirs.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._connection.close()
        self._process.wait()

    def complete(self, written: WrittenSlice) -> None:
        """Complete a slice.

        Raises
        ------
        CompleterGoneError
            Without the exit code, which only the process that has started it can know.
        SimulationError, OSError
            If it could not be completed.
        """
        self._ask_completer(written)

    def write_results(self) -> None:
        """Write the outcome of every actor.

        Raises
        ------
        SimulationError, OSError
            If that could not be done.
        """
        self._ask_completer(None)

    def gone(self) -> CompleterGoneError:
        """Say how the process has ended that this one has started."""
        return CompleterGoneError(self._process.wait())

    def _ask_completer(self, what: WrittenSlice | None) -> None:
        try:
            self._connection.send(what)
            error = self._connection.recv()
        except (EOFError, OSError):
            raise CompleterGoneError from None
        if error is not None:
            raise error
