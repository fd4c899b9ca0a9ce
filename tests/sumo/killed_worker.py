"""The worker, killed with signal 9 just before the ``KILL_AT``-th time it changes the run folder.

Run in place of :mod:`odscen.sumo.worker`. ``FILE_LIMIT`` makes every file longer than so many bytes
fail as on a full disk.
"""

from __future__ import annotations

import itertools
import os
import resource
import signal
import sys
from pathlib import Path

from odscen.sumo.worker import main

CHANGES = ("os.rename", "os.remove", "os.mkdir", "open")


def kill_before_change(run: str, number: int) -> None:
    """Install what kills this process."""
    left = itertools.count(1)

    def hook(event: str, args: tuple[object, ...]) -> None:
        if event not in CHANGES or not str(args[0]).startswith(run):
            return
        if event == "open" and "w" not in str(args[1]):
            return
        if next(left) == number:
            os.kill(os.getpid(), signal.SIGKILL)

    sys.addaudithook(hook)


if __name__ == "__main__":
    if "KILL_AT" in os.environ:
        kill_before_change(str(Path(sys.argv[1]).parent), int(os.environ["KILL_AT"]))
    if "FILE_LIMIT" in os.environ:
        limit = int(os.environ["FILE_LIMIT"])
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    sys.exit(main())
