"""Whether a run in slices is going on, and how far it is: ``status.json`` and a lock beside it.

The lock is the system's own: it ends with the processes that hold it, however they end, so that a
run whose processes are gone is known to be interrupted.
"""

from __future__ import annotations

import fcntl
import json
import os
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Literal

from odscen.base.errors import ConflictError
from odscen.sumo.folder import layout
from odscen.sumo.folder.checkpoint import write_whole

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from odscen.results.records.run_records import Plan
    from odscen.sumo.folder.checkpoint import Checkpoint

FORMAT = "odscen-status"
VERSION = 1
PATIENCE = 10.0
"""Wall seconds to wait for a worker that is about to notice that its runner is gone, and for the
slice that is being completed then."""


def write_status(run: Path, plan: Plan, done: Checkpoint | None) -> None:
    """Say how far a run is; written at its start and at each boundary."""
    status = {
        "format": FORMAT,
        "version": VERSION,
        "scenario": plan.scenario,
        "time": done.time if done else 0.0,
        "until": plan.until,
        "slice_length": plan.slice_length,
        "slices": done.number if done else 0,
        "running": done.running if done else 0,
        "departed": done.recorder["departed"] if done else 0,
        "arrived": done.recorder["arrived"] if done else 0,
        "planned": len(plan.actors),
        "wall_seconds": round(done.wall_seconds, 3) if done else 0.0,
    }
    write_whole(run / layout.STATUS_FILE, json.dumps(status, indent=2) + "\n")


def read_status(run: Path) -> dict[str, Any] | None:
    """What was last said; ``None`` if the folder is not of a run in slices that has not ended."""
    try:
        status: dict[str, Any] = json.loads((run / layout.STATUS_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return status if isinstance(status, dict) and status.get("format") == FORMAT else None


def going(run: Path) -> Literal["running", "interrupted"] | None:
    """Whether processes work on a run that has not ended; ``None`` if there is none here."""
    if read_status(run) is None:
        return None
    try:
        with locked(run, patience=0.0):
            return "interrupted"
    except ConflictError:
        return "running"
    except OSError:  # a folder that we may not write in
        return "interrupted"


@contextmanager
def locked(run: Path, *, patience: float = PATIENCE) -> Iterator[int]:
    """Hold the lock of a run; yields its file descriptor, which the worker is to inherit.

    Raises
    ------
    ConflictError
        If another process holds it.
    """
    descriptor = os.open(run / layout.LOCK_FILE, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        _take(descriptor, run, patience)
        yield descriptor
    finally:
        os.close(descriptor)


def _take(descriptor: int, run: Path, patience: float) -> None:
    end = time.monotonic() + patience
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() >= end:
                msg = f"run {run.name!r} is running in another process"
                raise ConflictError(msg) from None
            time.sleep(0.05)
        else:
            return
