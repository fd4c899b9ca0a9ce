"""Work in the background that a page asks after."""

from __future__ import annotations

import itertools
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

from odscen.base.errors import NotFoundError, OdscenError
from odscen.web.error_answers import error_info
from odscen.web.messages import ErrorInfo, JobInfo

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.workspace.store import ProgressCallback

_KEPT = 200
"""Finished jobs that are remembered."""


class Jobs:
    """One job at a time, in the order in which they came."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="job")
        self._lock = threading.Lock()
        self._numbers = itertools.count(1)
        self._jobs: dict[str, JobInfo] = {}

    def start(self, work: Callable[[ProgressCallback], str]) -> str:
        """Take on work that tells its progress and returns the name of what it made."""
        name = f"job-{next(self._numbers)}"
        self._set(JobInfo(id=name, state="queued", step="waiting", share=0.0))
        self._pool.submit(self._run, name, work)
        return name

    def info(self, name: str) -> JobInfo:
        """How far a job is.

        Raises
        ------
        NotFoundError
            If there is no such job, or it was long ago.
        """
        with self._lock:
            if name not in self._jobs:
                what = "job"
                raise NotFoundError(what, name, [])
            return self._jobs[name]

    def close(self) -> None:
        """Drop what has not begun."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _run(self, name: str, work: Callable[[ProgressCallback], str]) -> None:
        def progress(step: str, share: float) -> None:
            self._set(JobInfo(id=name, state="running", step=step, share=min(1.0, share)))

        progress("starting", 0.0)
        try:
            result = work(progress)
        except OdscenError as error:
            self._fail(name, error_info(error))
        except Exception as error:
            self._fail(name, ErrorInfo(kind=type(error).__name__, message=str(error)))
            raise
        else:
            self._set(JobInfo(id=name, state="done", step="done", share=1.0, result=result))

    def _fail(self, name: str, error: ErrorInfo) -> None:
        share = self.info(name).share
        self._set(JobInfo(id=name, state="failed", step="failed", share=share, error=error))

    def _set(self, info: JobInfo) -> None:
        with self._lock:
            self._jobs[info.id] = info
            if len(self._jobs) > _KEPT:
                ended = [key for key, one in self._jobs.items() if one.state in ("done", "failed")]
                for key in ended[: len(self._jobs) - _KEPT]:
                    del self._jobs[key]
