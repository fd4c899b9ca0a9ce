"""Work in the background that a page asks after, and can cancel."""

from __future__ import annotations

import itertools
import os
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import ConflictError, NotFoundError, OdscenError
from odscen.web.error_answers import error_info
from odscen.web.messages import DayMade, ErrorInfo, JobInfo

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.maps.store import ProgressCallback

_KEPT = 200
"""Finished jobs that are remembered."""
_LIVE = ("queued", "running")


class _CancelledJob(Exception):  # noqa: N818 - no error, and never seen outside
    pass


class JobResult(NamedTuple):
    """What a job has made: the name of it, and what there is to say of a day of traffic."""

    name: str
    day: DayMade | None = None


class Jobs:
    """Several jobs at a time, as many as the machine has cores, and two at least.

    What costs time and memory is done in processes of its own; the threads here wait for them.
    """

    def __init__(self) -> None:
        workers = max(2, os.cpu_count() or 1)
        self._pool = ThreadPoolExecutor(max_workers=workers, thread_name_prefix="job")
        self._lock = threading.Lock()
        self._numbers = itertools.count(1)
        self._jobs: dict[str, JobInfo] = {}
        self._subjects: dict[str, str] = {}
        self._cancelled: set[str] = set()

    def start(
        self, work: Callable[[ProgressCallback], JobResult], *, subject: str, join: bool = False
    ) -> str:
        """Take on work that tells its progress and returns what it made.

        Parameters
        ----------
        work
            Has to tell its progress first of all, and now and then: that is where it is cancelled.
        subject
            What it changes, in words: one job at a time does.
        join
            Whether a job about the same that is not done is waited for in its place.

        Raises
        ------
        ConflictError
            If another job about the same is not done.
        """
        with self._lock:
            other = self._subjects.get(subject)
            if other is not None and join:
                return other
            if other is not None:
                raise ConflictError(
                    f"{subject} is being worked on (job {other}); wait for its end, or cancel it"
                )
            name = f"job-{next(self._numbers)}"
            self._subjects[subject] = name
            self._jobs[name] = JobInfo(id=name, state="queued", step="waiting", share=0.0)
        self._pool.submit(self._run_job, name, work, subject)
        return name

    def info(self, name: str) -> JobInfo:
        """How far a job is.

        Raises
        ------
        NotFoundError
            If there is no such job, or it was long ago.
        """
        with self._lock:
            return self._require_job(name)

    def cancel(self, name: str) -> JobInfo:
        """Cancel a job; it is over within a second.

        Raises
        ------
        NotFoundError
            If there is no such job, or it was long ago.
        ConflictError
            If it is over.
        """
        with self._lock:
            job = self._require_job(name)
            if job.state not in _LIVE:
                raise ConflictError(f"{name} is {job.state}; it cannot be cancelled any more")
            self._cancelled.add(name)
            return job

    def close(self) -> None:
        """Cancel all that is not done, and wait until nothing is left of it."""
        with self._lock:
            self._cancelled |= {name for name, job in self._jobs.items() if job.state in _LIVE}
        self._pool.shutdown(wait=True)

    def _require_job(self, name: str) -> JobInfo:
        if name not in self._jobs:
            raise NotFoundError("job", name, [])
        return self._jobs[name]

    def _run_job(
        self, name: str, work: Callable[[ProgressCallback], JobResult], subject: str
    ) -> None:
        def progress(step: str, share: float) -> None:
            with self._lock:
                if name in self._cancelled:
                    raise _CancelledJob
            self._set_info(JobInfo(id=name, state="running", step=step, share=min(1.0, share)))

        ended = JobInfo(id=name, state="failed", step="failed", share=0.0)
        try:
            result = work(progress)
            ended = JobInfo(
                id=name, state="done", step="done", share=1.0, result=result.name, day=result.day
            )
        except _CancelledJob:
            ended = ended.model_copy(update={"state": "cancelled", "step": "cancelled"})
        except OdscenError as error:
            ended = ended.model_copy(update={"error": error_info(error)})
        except Exception as error:
            info = ErrorInfo(kind=type(error).__name__, message=str(error))
            ended = ended.model_copy(update={"error": info})
            raise
        finally:
            with self._lock:
                del self._subjects[subject]
                self._cancelled.discard(name)
            share = ended.share or self.info(name).share
            self._set_info(ended.model_copy(update={"share": share}))

    def _set_info(self, info: JobInfo) -> None:
        with self._lock:
            self._jobs[info.id] = info
            if len(self._jobs) > _KEPT:
                ended = [key for key, job in self._jobs.items() if job.state not in _LIVE]
                for key in ended[: len(self._jobs) - _KEPT]:
                    del self._jobs[key]
