"""A prepared run of SUMO, from its files to its finished folder: one process for each run.

Nothing that goes wrong inside SUMO raises here.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from odscen.records.run_plan import Plan
from odscen.runs.layout import PLAN_FILE
from odscen.runs.new_run import SimulationOutcome, claimed_folder, run_in_new_folder
from odscen.runs.reporter import SILENT
from odscen.sumo.outputs.output_tables import make_results
from odscen.sumo.runner.forecast import refuse_without_room
from odscen.sumo.runner.forked_worker import is_one_of_many, is_ready
from odscen.sumo.runner.long_runs import run_long
from odscen.sumo.runner.run_folder import drop_torn_records
from odscen.sumo.runner.worker_process import run_worker
from odscen.sumo.worker.recorder import Recorder

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.runs.finished_run import Run
    from odscen.runs.new_run import Finish
    from odscen.runs.reporter import Reporter
    from odscen.sumo.runner.run_folder import SumoPreparedRun
    from odscen.sumo.runner.worker_process import Companion
    from odscen.sumo.worker.protocol import Left


def run_prepared(
    prepared: SumoPreparedRun,
    out: Path,
    *,
    reporter: Reporter = SILENT,
    finish: Finish | None = None,
    live: Companion | None = None,
    figures: bool = True,
) -> Run:
    """Run in a new folder ``out``; whatever was there is replaced.

    A run in slices is there while it goes on, see :mod:`odscen.sumo.runner.long_runs`.

    Parameters
    ----------
    finish
        Called with the folder and the summary when a run has completed, before the folder appears:
        the place to add a report.
    live
        Makes it a run that can be watched and steered, or that goes in step with another.
    figures
        Whether they are computed at once, as they are for ``finish`` and where something is
        expected of the run; otherwise when they are asked for. A run in slices has them at once.

    Raises
    ------
    WorkspaceError
        If the folder cannot be written, or the disk cannot hold the run.
    ConflictError
        If a run that has not ended is in ``out``, or another process works there.
    """
    with claimed_folder(out) as lock:
        if prepared.expected is not None:
            refuse_without_room(prepared.expected, out)
        if prepared.plan.slice_length is not None:
            return run_long(prepared, out, lock, reporter=reporter, finish=finish, live=live)
        return run_in_new_folder(
            prepared,
            out,
            lambda folder: simulate(prepared, folder, reporter=reporter, live=live, keep=(lock,)),
            finish=finish,
            figures=figures,
        )


def simulate(
    prepared: SumoPreparedRun,
    folder: Path,
    *,
    reporter: Reporter = SILENT,
    live: Companion | None = None,
    keep: tuple[int, ...] = (),
) -> SimulationOutcome:
    """Simulate what is in a folder, in one piece and in a process of its own.

    Parameters
    ----------
    keep
        File descriptors that the process inherits.
    """
    reporter.started()
    forked = (is_one_of_many() or is_ready()) and live is None
    outcome = run_worker(
        folder,
        progress=reporter.advanced,
        called_off=lambda: reporter.cancelled,
        time_limit=prepared.settings.time_limit,
        live=live,
        keep=keep,
        forked=forked,
        results=partial(left_results, folder) if forked else None,
    )
    if outcome.sim_seconds is None:
        drop_torn_records(folder)
    return outcome


# --------------------------------------------------------------------------- results of a small run
# To a process that has just been forked Python is new: whatever it touches is copied first, and the
# first table costs as much as the simulation. So it simulates, and says what happened; the tables
# are made here.
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
