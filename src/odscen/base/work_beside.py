"""Work that is done in a forked process beside the one that asks for it."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


@contextmanager
def work_beside(work: Callable[[], None]) -> Iterator[None]:
    """Do work that only writes files while the body of the ``with`` is done.

    It is done when the body is left; if that raises, the work ends unfinished. Work that fails is
    done once more here, so that what it raises is raised here. Where no process can be forked it is
    done after the body.

    Parameters
    ----------
    work
        Knows what it needs from before the body, and changes nothing but files.
    """
    child = _fork_for(work)
    try:
        yield
    except BaseException:
        if child is not None:
            with suppress(ProcessLookupError):
                os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
        raise
    if child is None or os.waitpid(child, 0)[1]:
        work()


def _fork_for(work: Callable[[], None]) -> int | None:
    """Fork a process that does the work; ``None`` where that cannot be."""
    if not sys.platform.startswith("linux"):  # elsewhere libraries may not outlive a fork
        return None
    try:
        child = os.fork()
    except OSError:
        return None
    if child:
        return child
    code = 1
    try:
        work()
        code = 0
    finally:
        os._exit(code)  # nothing of the parent's is flushed, closed or removed
