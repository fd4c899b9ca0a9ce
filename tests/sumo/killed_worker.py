"""The worker, killed with signal 9 just before the ``KILL_AT``-th time it changes the run folder.

Run in place of :mod:`odscen.sumo.worker.simulate`. With ``KILL_AFTER_SLICE`` it is the first time
after that slice is complete. ``KILL_COMPLETER_AT`` and ``KILL_BOTH_AT`` are about the process that
completes slices, see ``killed_completer``. ``FILE_LIMIT`` makes every file longer than so many
bytes fail as on a full disk; with ``MEMORY_LEFT`` it gets so many bytes more than it has at first.
Changes are counted in a file beside the run folder, as each slice has a process of its own. With
``SLICES_BY_EXEC`` these are not forked.
"""

from __future__ import annotations

import os
import resource
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from odscen.runs.checkpoint import slice_folder
from odscen.sumo.worker import completion, slice_processes
from odscen.sumo.worker.simulate import main

CHANGES = ("os.rename", "os.remove", "os.mkdir", "open")


def kill_before_change(run: str, due: Callable[[], bool], *, both: bool = False) -> None:
    """Install what kills this process, or all, before a change for which ``due`` says so."""

    def hook(event: str, args: tuple[object, ...]) -> None:
        if event not in CHANGES or not str(args[0]).startswith(run):
            return
        if event == "open" and "w" not in str(args[1]):
            return
        if due():
            (os.killpg if both else os.kill)(0 if both else os.getpid(), signal.SIGKILL)

    sys.addaudithook(hook)


def reached(run: Path, name: str) -> Callable[[], bool]:
    """Return what counts the changes, and says whether the one named by a variable is there."""
    count = run.parent / f"{name}.count"

    def reach() -> bool:
        with count.open("ab") as file:
            file.write(b".")
            return file.tell() == int(os.environ[name])

    return reach


if __name__ == "__main__":
    folder = Path(sys.argv[1]).parent
    if "KILL_AT" in os.environ:
        kill_before_change(str(folder), reached(folder, "KILL_AT"))
    if "KILL_AFTER_SLICE" in os.environ:
        last = slice_folder(folder, int(os.environ["KILL_AFTER_SLICE"]))
        kill_before_change(str(folder), last.is_dir)
    if "KILL_COMPLETER_AT" in os.environ or "KILL_BOTH_AT" in os.environ:
        completion.COMPLETER = "tests.sumo.killed_completer"
    if "SLICES_BY_EXEC" in os.environ:
        slice_processes.POSSIBLE = False
    if "FILE_LIMIT" in os.environ:
        limit = int(os.environ["FILE_LIMIT"])
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
    if "MEMORY_LEFT" in os.environ:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        most = pages * resource.getpagesize() + int(os.environ["MEMORY_LEFT"])
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    sys.exit(main())
