"""Computing in other threads that can be broken off, as Ctrl-C breaks off the main one."""

from __future__ import annotations

import ctypes
import threading
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator


class BrokenOff(BaseException):
    """Raised in a thread whose computing is broken off; like KeyboardInterrupt, no error."""


class Interruptible:
    """What threads compute, all of which can be broken off at once.

    Only the main thread hears of signals, and Python ends when the others have ended: a thread
    that prepares a large run would compute on for minutes.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._threads = set[int]()
        self._over = False

    @contextmanager
    def computing(self) -> Iterator[None]:
        """Let this thread be interrupted until the block ends: between two steps of Python.

        Raises
        ------
        BrokenOff
            If :meth:`break_off` is called meanwhile, or was before.
        """
        mine = threading.get_ident()
        with self._lock:
            if self._over:
                raise BrokenOff
            self._threads.add(mine)
        try:
            yield
        finally:
            with self._lock:
                self._threads.discard(mine)

    def break_off(self) -> None:
        """Interrupt all who compute, and those who are about to."""
        with self._lock:
            self._over = True
            for thread in self._threads:
                ctypes.pythonapi.PyThreadState_SetAsyncExc(
                    ctypes.c_ulong(thread), ctypes.py_object(BrokenOff)
                )
