"""Results of a small run, made here of what its process has left.

To a process that has just been forked Python is new: whatever it touches is copied first, and the
first table costs as much as the simulation. So it simulates, and says what happened.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.records.run_plan import Plan
from odscen.runs.layout import PLAN_FILE
from odscen.sumo.outputs.output_tables import make_results
from odscen.sumo.worker.recorder import Recorder

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.sumo.worker.protocol import Left


def left_results(folder: Path, left: Left) -> None:
    """Make what the process would have made: tables, ``events.json`` and ``actors.json``.

    The plan is read as the process reads it, with the digits that the folder has of it.

    Raises
    ------
    SimulationError
        If SUMO has not written its files to their end.
    """
    plan = Plan.from_json((folder / PLAN_FILE).read_text(encoding="utf-8"))
    recorder = Recorder(plan)
    recorder.take_over(left.recorded)
    make_results(folder, plan, recorder.events, left.lengths)
