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

    from odscen.sumo.worker.completer import Written

COMPLETER = "odscen.sumo.worker.completer"


class Completion:
    """Completes each slice while the next one runs."""

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
        self._written: Written | None = None
        self._busy = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self.begin()
            self.wait()
        finally:
            self._connection.close()
            self._process.wait()

    def take(self, written: Written) -> None:
        """Take a slice, once the one before is complete.

        Raises
        ------
        SimulationError, OSError
            If the one before could not be completed.
        """
        self.wait()
        self._written = written

    def begin(self) -> None:
        """Begin: SUMO has read the state, so that it may be moved."""
        if self._written is not None:
            written, self._written = self._written, None
            self._ask(written)

    def wait(self) -> None:
        """Wait until the slice that has been begun is complete.

        Raises
        ------
        SimulationError, OSError
            If it could not be completed.
        """
        if not self._busy:
            return
        self._busy = False
        try:
            error = self._connection.recv()
        except (EOFError, OSError):
            raise self._gone() from None
        if error is not None:
            raise error

    def write_results(self) -> None:
        """Complete the last slice and write the outcome of every actor.

        Raises
        ------
        SimulationError, OSError
            If that could not be done.
        """
        self.begin()
        self.wait()
        self._ask(None)
        self.wait()

    def _ask(self, what: Written | None) -> None:
        try:
            self._connection.send(what)
        except OSError:
            raise self._gone() from None
        self._busy = True

    def _gone(self) -> SimulationError:
        code = self._process.wait()
        return SimulationError(
            f"the process that completes what was recorded has ended with exit code {code}; "
            "the memory may have been too small"
        )
