"""Whether a run in slices is going on, and how far it is: ``status.json``, and a lock beside it.

The lock ends with the processes that hold it, see :mod:`odscen.base.folder_locks`, so that a run
whose processes are gone is known to be interrupted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from odscen.base.checksums import seal, unsealed
from odscen.base.durations import clock
from odscen.base.errors import DamagedError
from odscen.base.folder_locks import is_locked
from odscen.base.to_disk import write_whole
from odscen.runs import layout

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.records.run_plan import Plan
    from odscen.runs.checkpoint import Checkpoint

FORMAT = "odscen-status"
VERSION = 2


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
    write_whole(run / layout.STATUS_FILE, seal(status, indent=2))


def read_status(run: Path) -> dict[str, Any] | None:
    """What was last said; ``None`` if the folder is not of a run in slices that has not ended.

    Empty if it cannot be believed: such a run has not ended, either.
    """
    if not unfinished(run):
        return None
    try:
        return unsealed(run / layout.STATUS_FILE)
    except (OSError, ValueError, DamagedError):
        return {}


def unfinished(run: Path) -> bool:
    """Whether a folder is of a run in slices that has not ended."""
    return (run / layout.STATUS_FILE).is_file()


def going(run: Path) -> Literal["running", "interrupted"] | None:
    """Whether processes work on a run that has not ended; ``None`` if there is none here."""
    if not unfinished(run):
        return None
    return "running" if is_locked(run) else "interrupted"


def unfinished_words(run: Path) -> str | None:
    """What a run in slices that has not ended is, and how to resume it; ``None`` for others."""
    state, status = going(run), read_status(run)
    if state is None or status is None:
        return None
    at = f" at {clock(status['time'])} of {clock(status['until'])} h" if status else ""
    if state == "running":
        return f"run {run.name!r} has not ended: it is running{at}"
    return f"run {run.name!r} is interrupted{at}; odscen resume {run} resumes it"
