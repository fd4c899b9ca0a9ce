"""The process that works on one thing at a time, within limits.

It is started by :mod:`odscen.maps.child_process`.

A line of JSON on stdin is a job: its name, its limits, and what it is about. What comes of it goes
to stdout: lines with its progress, and a last one with its result or the reason why there is none.
Files are read from and written to the folders that the job names. When stdin ends, so has whoever
asked: the process removes those folders and ends at once.
"""

from __future__ import annotations

import errno
import json
import os
import queue
import shutil
import signal
import sys
import tempfile
import threading
import traceback
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from odscen.base.error_data import error_to_data
from odscen.base.errors import LimitError, OdscenError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    Say = Callable[[Mapping[str, Any]], None]

_RESOURCES_LIMITED = ("RLIMIT_DATA", "RLIMIT_CPU", "RLIMIT_FSIZE")
_TRIES = 3


class _Jobs:
    """What is asked for on stdin; the end of it ends the process."""

    def __init__(self) -> None:
        self._asked: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
        self._folders: tuple[str, ...] = ()
        threading.Thread(target=self._listen_for_end, daemon=True).start()

    def next(self) -> dict[str, Any]:
        """Wait for a job."""
        return self._asked.get()

    def finished(self) -> None:
        """Forget the folders of the job: they are no longer this process's."""
        self._folders = ()

    def _listen_for_end(self) -> None:
        for line in sys.stdin.buffer:
            job = json.loads(line)
            self._folders = tuple(job["folders"])
            self._asked.put(job)
        for folder in self._folders:
            _remove_folder(Path(folder))
        os.killpg(0, signal.SIGKILL)  # with whatever the job has started


def _remove_folder(folder: Path) -> None:
    """Remove a folder that the other thread may still write into: under its name it finds none."""
    gone = folder.with_name(f"{folder.name}-ended")
    with suppress(OSError):
        folder.rename(gone)
        for _ in range(_TRIES):
            shutil.rmtree(gone, ignore_errors=True)


def main() -> None:
    """Work until stdin ends."""
    # What libraries print on stdout must not come between the messages.
    channel = os.fdopen(os.dup(1), "w", encoding="ascii")
    os.dup2(2, 1)

    def say(message: Mapping[str, Any]) -> None:
        channel.write(json.dumps(message) + "\n")
        channel.flush()

    jobs = _Jobs()
    from odscen.maps.child_jobs import JOBS

    while True:
        job = jobs.next()
        answer = _answer_job(JOBS.get(job["name"]) or _find_job(job["name"]), job, say)
        jobs.finished()
        say({**answer, "peak": _peak_memory()})


def _find_job(name: str) -> Callable[..., Mapping[str, Any]]:
    """A job that is not in the list of this room, as ``module:function``."""
    module, function = name.split(":")
    work: Callable[..., Mapping[str, Any]] = getattr(import_module(module), function)
    return work


def _answer_job(
    work: Callable[..., Mapping[str, Any]], job: Mapping[str, Any], say: Say
) -> dict[str, Any]:
    """Do the work within its limits; what there is to say of its end."""

    def progress(what: str, share: float) -> None:
        say({"progress": [what, share]})

    # Below are also the temporary files of programs that the work starts.
    tempfile.tempdir = job["folders"][0]
    try:
        try:
            _limit_process(job["memory"], job["seconds"], job["output"])
            return {"done": dict(work(progress=progress, **job["arguments"]))}
        finally:
            _lift_limits()  # to tell what has happened needs some memory too
    except (MemoryError, LimitError):
        return {"limit": "memory"}
    except OdscenError as error:
        return {"error": error_to_data(error)}
    except OSError as error:
        if error.errno == errno.EFBIG:
            return {"limit": "output"}
        if error.errno == errno.ENOMEM:
            return {"limit": "memory"}
        return {"os_error": [error.errno, error.strerror or str(error), error.filename]}
    except Exception as error:
        if "bad_alloc" in str(error):  # a library in C++
            return {"limit": "memory"}
        lines = traceback.format_exception_only(error)
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(place.filename).name}, line {place.lineno}"
        return {"fault": f"{lines[-1].strip()} ({where})"}


def _limit_process(memory: int, seconds: float, output: int) -> None:
    """Limit what this process may use from now on; a limit that it has already may be lower.

    Only the soft limits: programs that the work starts have limits of their own.
    """
    import resource

    usage = resource.getrusage(resource.RUSAGE_SELF)
    spent = usage.ru_utime + usage.ru_stime
    wishes = (memory, int(spent + seconds) + 1, output)
    for name, wish in zip(_RESOURCES_LIMITED, wishes, strict=True):
        _set_soft(getattr(resource, name), wish)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _lift_limits() -> None:
    import resource

    for name in _RESOURCES_LIMITED:
        _set_soft(getattr(resource, name), resource.RLIM_INFINITY)


def _set_soft(which: int, wish: int) -> None:
    import resource

    hard = resource.getrlimit(which)[1]
    if hard != resource.RLIM_INFINITY:
        wish = hard if wish == resource.RLIM_INFINITY else min(wish, hard)
    with suppress(OSError, ValueError):  # systems that do not limit this
        resource.setrlimit(which, (wish, hard))


def _peak_memory() -> int:
    """Bytes of memory that this process has had at most."""
    with suppress(OSError, ValueError, IndexError):
        # What the system says of usage has on Linux what the parent had when it started this.
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
        return int(status.split("VmHWM:")[1].split()[0]) * 1024
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # macOS: bytes


if __name__ == "__main__":
    main()
