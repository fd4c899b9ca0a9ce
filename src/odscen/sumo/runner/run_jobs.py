"""Runs: from a prepared scenario to a finished run folder, one process per run.

A run folder appears whole or not at all: it is made beside its final place and renamed when the run
has ended, well or badly. A failed run is a folder too, with status ``failed``, the reason and the
log; nothing that goes wrong inside SUMO raises here.
"""

from __future__ import annotations

import threading
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from odscen.base.atomic_folders import clear_leftovers, new_folder
from odscen.base.errors import InputError
from odscen.base.system_errors import disk_errors
from odscen.figures.measures.summary import summary_to_json
from odscen.runs import layout
from odscen.runs.finished_run import Run
from odscen.runs.found_files import found_files
from odscen.runs.run_sums import seal_run
from odscen.sumo.runner.forecast import refuse_without_room
from odscen.sumo.runner.forked_worker import expect_runs, is_one_of_many, is_ready
from odscen.sumo.runner.interruptible import Interruptible
from odscen.sumo.runner.left_results import left_results
from odscen.sumo.runner.long_runs import refuse_interrupted, run_lock, run_long
from odscen.sumo.runner.run_folder import (
    PreparedRun,
    drop_torn_records,
    make_summary,
    write_run_folder,
    write_sumo_files,
)
from odscen.sumo.runner.worker_process import run_worker

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from concurrent.futures import Future
    from pathlib import Path

    from odscen.sumo.runner.run_folder import Finish
    from odscen.sumo.runner.worker_process import Companion, Ended
    from odscen.sumo.worker.protocol import OnProgress, Progress

__all__ = ["PreparedRun", "RunJob", "run_many", "run_prepared", "write_sumo_files"]


def run_prepared(
    prepared: PreparedRun,
    out: Path,
    *,
    progress: OnProgress | None = None,
    finish: Finish | None = None,
    live: Companion | None = None,
    tell: Callable[[str], None] | None = None,
    simulate: Callable[[Path], Ended] | None = None,
    figures: bool = True,
) -> Run:
    """Run in a new folder ``out``; whatever was there is replaced.

    A run in slices is there while it goes on, see :mod:`odscen.sumo.runner.long_runs`.

    Parameters
    ----------
    progress
        Called in this thread, a few times a second.
    finish
        Called with the folder and the summary when a run has completed, before the folder appears:
        the place to add a report.
    live
        Makes it a run that can be watched and steered, or that goes in step with another.
    tell
        Called with what the user should know before a long run.
    simulate
        Runs what is in a folder and writes the results there, instead of SUMO's worker.
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
    with disk_errors(f"run folder {out}"), run_lock(out) as lock:
        refuse_interrupted(out)
        clear_leftovers(out.parent)
        if prepared.expected is not None:
            refuse_without_room(prepared.expected, out)
        if prepared.plan.slice_length is not None:
            if tell is not None and prepared.expected is not None:
                tell(f"{out.name}: {prepared.expected}")
            return run_long(prepared, out, lock, progress=progress, finish=finish, live=live)
        with new_folder(out) as folder:
            write_run_folder(prepared, folder)
            if simulate is None:
                limit = prepared.settings.time_limit
                forked = (is_one_of_many() or is_ready()) and live is None
                ended = run_worker(
                    folder,
                    progress=progress,
                    time_limit=limit,
                    live=live,
                    keep=(lock,),
                    forked=forked,
                    results=partial(left_results, folder) if forked else None,
                )
            else:
                ended = simulate(folder)
            if ended.done is None:
                drop_torn_records(folder)
            summary = make_summary(prepared, folder, ended, figures=figures or finish is not None)
            if finish is not None and ended.done is not None:
                finish(folder, summary)
                summary["files"] = found_files(folder)
            (folder / layout.SUMMARY_FILE).write_text(summary_to_json(summary), encoding="utf-8")
            seal_run(folder, hidden=True)
        return Run(out, summary)


_LISTEN = 0.2
"""Wall seconds after which a wait looks for Ctrl-C."""


_GRACE = 2.0
"""Wall seconds in which a run that is prepared may come to where it is stopped in good order."""


class _StoppedError(Exception):
    """Another run of the same call has failed to start, or the user has interrupted."""


@dataclass(frozen=True, slots=True)
class RunJob:
    """One run of several: ``prepare`` is called when its turn comes; ``out`` is its folder.

    ``finish`` and ``figures`` as in :func:`run_prepared`.
    """

    name: str
    prepare: Callable[[], PreparedRun]
    out: Path
    finish: Finish | None = None
    figures: bool = True


def run_many(
    jobs: Sequence[RunJob],
    *,
    processes: int = 1,
    progress: Callable[[RunJob, Progress], None] | None = None,
    done: Callable[[RunJob, Run], None] | None = None,
    refused: Callable[[RunJob, InputError], None] | None = None,
    tell: Callable[[str], None] | None = None,
) -> tuple[Run, ...]:
    """Run several scenarios, ``processes`` at a time; results in the order of ``jobs``.

    ``progress``, ``done`` and ``refused`` are called from the threads that wait for the processes,
    ``done`` in the order in which runs end. An error in preparing a run ends all of it, as
    scenarios are checked before they are run; with ``refused`` that is told it, the others go on
    and the result leaves it out.
    """
    stopping, preparing = threading.Event(), Interruptible()
    expect_runs(len(jobs))

    def one(job: RunJob) -> Run | None:
        try:
            return carried_out(job)
        except InputError as error:
            if refused is None:
                raise
            refused(job, error)
            return None

    def carried_out(job: RunJob) -> Run:
        def follow(message: Progress) -> None:
            if stopping.is_set():  # ends this worker process too
                raise _StoppedError
            if progress is not None:
                progress(job, message)

        with preparing.computing():
            prepared = job.prepare()
        result = run_prepared(
            prepared,
            job.out,
            progress=follow,
            finish=job.finish,
            tell=tell,
            figures=job.figures,
        )
        if done is not None:
            done(job, result)
        return result

    with ThreadPoolExecutor(max_workers=max(1, processes)) as pool:
        futures: list[Future[Run | None]] = []
        try:
            futures.extend(pool.submit(one, job) for job in jobs)
            _wait(futures)
            ended = (future.result() for future in futures)
            return tuple(run for run in ended if run is not None)
        except BaseException:
            stopping.set()
            pool.shutdown(wait=False, cancel_futures=True)
            _leave(futures, preparing)
            raise


def _leave(futures: Sequence[Future[Run | None]], preparing: Interruptible) -> None:
    """Let runs that have to stop come to where they do; break off preparing what is large."""
    try:
        wait(futures, timeout=_GRACE)
    finally:
        preparing.break_off()


def _wait(futures: Sequence[Future[Run | None]]) -> None:
    """Wait until all have ended, or raise what the first of them raises.

    Polars has system calls go on after Ctrl-C (https://github.com/pola-rs/polars/issues/21739): a
    wait without a timeout would hear of it when it is over.
    """
    running = set(futures)
    while running:
        ended, running = wait(running, timeout=_LISTEN, return_when=FIRST_EXCEPTION)
        for future in ended:
            future.result()
