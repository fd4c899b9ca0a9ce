"""Words of C++ libraries, which they write to the process's file descriptors 1 and 2."""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@contextmanager
def captured_output(log: Path) -> Iterator[TextIO]:
    """Send the process's file descriptors 1 and 2 to ``log``; yield the real stdout.

    C++ code writes to the descriptors, not to ``sys.stdout``, so these are what is redirected. The
    real stdout is inheritable: a process that helps can hold it open, too.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    kept = os.dup(1), os.dup(2)
    with log.open("ab") as target, os.fdopen(os.dup(1), "w", encoding="utf-8") as real:
        os.dup2(target.fileno(), 1)
        os.dup2(target.fileno(), 2)
        os.set_inheritable(real.fileno(), True)
        try:
            yield real
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            for descriptor, copy in zip((1, 2), kept, strict=True):
                os.dup2(copy, descriptor)
                os.close(copy)
