"""Processes of simulations that need no start of their own: ``python -m ...worker.fork_server``.

A short run takes less than the imports of its process. This process has done them, and nothing
else: for each run it forks one that is as fresh as if it had been started, with SUMO never used in
it before. So a run still has a process of its own, and what SUMO does still depends on nothing that
ran before. (libsumo can load one simulation after the other, but not with the same result: who
yields inside a junction depends on the order of addresses in memory.)

Stdin is a Unix socket. Each message on it is a JSON object ``{"plan": FILE, "cwd": FOLDER,
"raw": BOOL}`` with descriptors: one to say ``pid N`` on, and later ``exit N``; stdout; stderr; then
those to hold open. With ``raw`` tables may be left to be made.
The process ends when the socket is closed, or when it has had nothing to do for a minute, or as
many seconds as its argument says.
"""

from __future__ import annotations

import gc
import json
import os
import selectors
import signal
import socket
import sys
import traceback
from contextlib import suppress
from pathlib import Path
from typing import Any, NoReturn, Self

from odscen.sumo.worker import simulate
from odscen.sumo.worker.warm_imports import import_all, import_for

IDLE = 60.0
"""Wall seconds without a run after which the process ends, for it holds 100 MB."""
MOST_DESCRIPTORS = 8
_MOST_BYTES = 1 << 16


def main() -> None:
    """Import what simulations need, then fork one for each message."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    gc.disable()  # what is imported stays
    import_all()
    gc.collect()
    gc.freeze()  # forked processes need not go through it, nor copy it
    gc.enable()
    idle = float(sys.argv[1]) if sys.argv[1:] else IDLE
    with socket.socket(fileno=0) as control, _Children(idle) as children:
        while children.wait(control):
            data, descriptors, *_ = socket.recv_fds(control, _MOST_BYTES, MOST_DESCRIPTORS)
            if not data:
                return
            children.start(json.loads(data), descriptors, control)


class _Children:
    """The forked processes, and what to say of their ends."""

    def __init__(self, idle: float) -> None:
        self._idle = idle
        self._said_to: dict[int, int] = {}
        self._ended, self._wake = os.pipe()
        os.set_blocking(self._ended, False)
        os.set_blocking(self._wake, False)

    def __enter__(self) -> Self:
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.set_wakeup_fd(self._wake, warn_on_full_buffer=False)
        return self

    def __exit__(self, *_: object) -> None:
        signal.set_wakeup_fd(-1)

    def wait(self, control: socket.socket) -> bool:
        """Wait for a message, and say who ends meanwhile; false after a long time with nothing."""
        with selectors.DefaultSelector() as selector:
            selector.register(control, selectors.EVENT_READ)
            selector.register(self._ended, selectors.EVENT_READ)
            while True:
                ready = [key.fileobj for key, _ in selector.select(self._idle)]
                if self._ended in ready:
                    with suppress(BlockingIOError):
                        os.read(self._ended, _MOST_BYTES)
                self._reap_children()
                if control in ready:
                    return True
                if not ready and not self._said_to:
                    return False

    def _reap_children(self) -> None:
        while self._said_to:
            pid, status = os.waitpid(-1, os.WNOHANG)
            if not pid:
                return
            said_to = self._said_to.pop(pid)
            with suppress(OSError):  # who asked has gone
                os.write(said_to, f"exit {os.waitstatus_to_exitcode(status)}\n".encode())
            os.close(said_to)

    def start(
        self, request: dict[str, Any], descriptors: list[int], control: socket.socket
    ) -> None:
        """Fork a process that runs a plan."""
        said_to, stdout, stderr, *kept = descriptors
        import_for(Path(request["cwd"] or "", request["plan"]).parent)  # once for all that follow
        pid = os.fork()
        if not pid:
            for other in (*self._said_to.values(), self._ended, self._wake):
                os.close(other)
            signal.set_wakeup_fd(-1)
            control.detach()  # it is stdin, which is replaced
            _work_as_simulation(request, said_to, stdout, stderr, kept)
        self._said_to[pid] = said_to
        for descriptor in descriptors[1:]:
            os.close(descriptor)


def _work_as_simulation(
    request: dict[str, Any], said_to: int, stdout: int, stderr: int, kept: list[int]
) -> NoReturn:
    """Become the process of a simulation."""
    code = 1
    try:
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        os.setsid()
        for target, source in ((0, os.open(os.devnull, os.O_RDONLY)), (1, stdout), (2, stderr)):
            os.dup2(source, target)
            os.close(source)
        for descriptor in kept:  # what completes slices holds them open, too
            os.set_inheritable(descriptor, True)
        if request["cwd"] is not None:
            os.chdir(request["cwd"])
        os.write(said_to, f"pid {os.getpid()}\n".encode())
        os.close(said_to)
        code = simulate.run_plan(Path(request["plan"]), raw=request["raw"])
    except BaseException:
        traceback.print_exc()
    finally:
        with suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    main()
