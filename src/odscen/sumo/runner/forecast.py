"""What a run will need on disk and in memory, said before it starts.

Rough on purpose: how long people are under way is known only afterwards. Rates are measured, see
``docs/runs.md``.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.base.errors import ResourceError
from odscen.sumo.realize.measure_files import interval_of

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from odscen.records.run_plan import Plan

CONGESTION = 2.0
"""Time under way, as a multiple of that without anybody else."""
ROW = 24
"""Bytes of trajectories for each road user and record."""
LANE_ROW = 75
"""Bytes of what is measured on a lane in an interval, with emissions."""
ACTOR = 1_600
"""Bytes of events, outcome, trip and the copy of the route for each actor."""
STATE = 600
"""Bytes of saved state for each road user that is under way."""
UNKNOWN_TIME = 300.0
"""Seconds under way of somebody whose way is not known."""

MEMORY_BASE = 300e6
MEMORY_RUNNING = 9e3
"""Bytes of memory for each road user under way; SUMO 1.28, 8-9 MB for 1,000."""
MEMORY_PLANNED = 4e3
"""Bytes of memory for each planned actor."""
COMPLETER_BASE = 150e6
COMPLETER_PLANNED = 2.7e3
"""Bytes of memory of the process that completes slices, and for each planned actor."""

_MINUTE = 60.0


@dataclass(frozen=True, slots=True)
class Forecast:
    """What a run will need: bytes, and how many will be under way at a time at most."""

    disk: int
    memory: int
    running: int

    def __str__(self) -> str:
        return (
            f"about {self.running:,} on the road at a time, {size(self.disk)} of disk, "
            f"{size(self.memory)} of memory"
        )


def forecast(
    plan: Plan, files: Mapping[str, str], *, every: float | None, lanes: int = 0
) -> Forecast:
    """Predict what a run will need.

    Parameters
    ----------
    files
        Texts that are written before it starts.
    every
        Seconds between two records of trajectories; ``None`` for every step.
    lanes
        How many are measured.
    """
    minutes = max(1, int(plan.until / _MINUTE) + 1)
    change = [0] * (minutes + 1)
    seconds = 0.0
    for actor in plan.actors:
        if actor.problem is not None:
            continue
        spent = CONGESTION * (actor.free_flow_time or UNKNOWN_TIME)
        spent = min(spent, max(0.0, plan.until - actor.depart))
        seconds += spent
        change[min(int(actor.depart / _MINUTE), minutes)] += 1
        change[min(int((actor.depart + spent) / _MINUTE) + 1, minutes)] -= 1
    running = most = 0
    for number in change:
        running += number
        most = max(most, running)
    rows = seconds / max(every or 0.0, plan.step_length) if plan.trajectories else 0.0
    slices = plan.until / plan.slice_length if plan.slice_length else 0.0
    written = sum(len(text) for text in files.values())
    intervals = plan.until / interval_of(
        plan.until,
        plan.slice_length,
        analysed=[value for value in (plan.warm_up, plan.interval) if value],
    )
    measured = LANE_ROW * lanes * intervals if seconds else 0.0
    disk = written + ROW * rows + measured + ACTOR * len(plan.actors) + STATE * slices * most
    memory = MEMORY_BASE + MEMORY_RUNNING * most + MEMORY_PLANNED * len(plan.actors)
    if slices:
        memory += COMPLETER_BASE + COMPLETER_PLANNED * len(plan.actors)
    return Forecast(int(disk), int(memory), most)


def refuse_without_room(expected: Forecast, folder: Path) -> None:
    """Refuse a run that the disk cannot hold.

    Raises
    ------
    ResourceError
        With what is needed, what is free, and what to do.
    """
    there = next(path for path in (folder, *folder.parents) if path.exists())
    free = shutil.disk_usage(there).free
    if free < expected.disk:
        raise ResourceError(
            f"{folder}: the run needs about {size(expected.disk)} of disk, {size(free)} are free; "
            f"record less (--trajectories every=10s, or none) or free some"
        )


def size(count: float) -> str:
    """``"1.3 GB"``."""
    return f"{count / 1e9:,.1f} GB" if count >= 1e9 else f"{max(1, round(count / 1e6)):,} MB"
