"""The process that stays: it has imported what commands need, and forks one for each.

``python -m odscen.cli.resident.server``, started by a command that says what
it has imported. One forked process always waits for the next command, and has the process that
forks simulations ready
if the last command ran one. What further commands import is imported here, too.
"""

from __future__ import annotations

import atexit
import gc
import importlib
import io
import json
import os
import select
import selectors
import signal
import socket
import struct
import sys
import threading
import traceback
from contextlib import suppress
from fcntl import F_GETFL, F_SETFL, F_SETOWN, fcntl
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import TYPE_CHECKING, Any

from odscen.cli.resident.client import AGREED, PASSED_ON, PEER, SIZE
from odscen.cli.resident.surroundings import address_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

_DESCRIPTORS = 5
_F_SETSIG = 10
"""Of Linux' ``fcntl``, which Python does not name."""
_SIMULATING = frozenset(
    ("run", "resume", "test", "sweep", "search", "study", "dataset", "calibrate")
)
_PATIENCE = 10.0
"""Wall seconds in which a request must be there; who sends one does nothing else meanwhile."""
_MOST_BYTES = 1 << 20
_INTERRUPTED = 130
_NOT_WRITTEN = 120
"""Exit code where what is left to be written cannot be, as Python's own."""


def main() -> None:
    """Import, listen, and fork until no command has come for long."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    about = json.load(sys.stdin)
    surroundings = about["surroundings"].encode("utf-8", "surrogateescape")
    with socket.socket(socket.AF_UNIX) as listening:
        try:
            listening.bind(address_of(surroundings))
        except OSError:  # another one was faster
            return
        gc.disable()  # what is imported stays
        _import_modules(about["modules"])
        gc.collect()
        gc.freeze()
        gc.enable()
        listening.listen()
        _Waiting(listening, surroundings, about["minutes"] * 60.0).fork_commands(about["command"])


class _Waiting:
    """One forked process that waits for the next command, and what those before it say."""

    def __init__(self, listening: socket.socket, surroundings: bytes, idle: float) -> None:
        self._listening = listening
        self._surroundings = surroundings
        self._idle = idle
        self._times = _note_times()
        self._heard, self._said = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._pid = 0

    def fork_commands(self, command: Sequence[str]) -> None:
        """Have a process wait, and another one once it has a command; end if none comes."""
        ended, wake = socket.socketpair()
        for one in (ended, wake):
            one.setblocking(False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.set_wakeup_fd(wake.fileno(), warn_on_full_buffer=False)
        self._fork_waiting(command)
        with selectors.DefaultSelector() as selector:
            selector.register(self._heard, selectors.EVENT_READ)
            selector.register(ended, selectors.EVENT_READ)
            while True:
                ready = [key.fileobj for key, _ in selector.select()]
                if self._heard in ready:
                    message = json.loads(self._heard.recv(_MOST_BYTES))
                    if message["stale"]:
                        break
                    self._import_reported(message["modules"])
                    if message["command"] is not None:
                        self._fork_waiting(message["command"])
                if ended in ready:
                    ended.recv(_MOST_BYTES)
                    if _reap_children(self._pid):  # it was killed
                        break

    def _import_reported(self, modules: Sequence[str]) -> None:
        if modules:
            _import_modules(modules)
            self._times = {**_note_times(), **self._times}

    def _fork_waiting(self, command: Sequence[str]) -> None:
        self._pid = os.fork()
        if not self._pid:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            self._heard.close()
            code = _NOT_WRITTEN
            try:
                code = self._serve_command(command)
            except BaseException:
                traceback.print_exc()
            finally:
                os._exit(code)

    def _serve_command(self, command: Sequence[str]) -> int:
        """Wait for a command and carry it out."""
        if set(command) & _SIMULATING:
            from odscen.sumo.runner.forked_worker import get_ready

            get_ready(idle=self._idle)
        accepted = self._accept_command()
        if accepted is None:
            self._tell_staying(stale=True)
            return 0
        connection, request, descriptors = accepted
        self._listening.close()
        with connection:
            self._tell_staying(command=request["argv"][1:2])
            known = {*sys.modules}
            lifeline = _take_place(request, descriptors)
            connection.settimeout(None)
            _send_answer(connection, taken=1)
            code = _carry_out()
            fcntl(lifeline, F_SETFL, 0)
            _close_streams()
            _send_answer(connection, exit=code)
        self._tell_staying(modules=sorted({*sys.modules} - known))
        return code

    def _accept_command(self) -> tuple[socket.socket, dict[str, Any], list[int]] | None:
        """Wait for a command that can be carried out here and is still wanted.

        Returns
        -------
        tuple of socket, dict and list of int, or None
            The connection, the request and its descriptors. ``None`` after a long time without
            any, after a change of sources, and when the process that stays is gone.
        """
        events = select.poll()
        events.register(self._listening, select.POLLIN)
        events.register(self._said, 0)  # its other end is closed with that process
        while ready := dict(events.poll(self._idle * 1000.0)):
            if self._said.fileno() in ready:
                break
            connection, _ = self._listening.accept()
            descriptors: list[int] = []
            try:
                connection.settimeout(_PATIENCE)
                request = self._read_own_request(connection)
                if _have_changed(self._times):
                    connection.close()
                    break
                _send_answer(connection, pid=os.getpid())
                # Who has waited too long has carried it out already, or is about to.
                agreed, descriptors, *_ = socket.recv_fds(connection, len(AGREED), _DESCRIPTORS)
                if agreed == AGREED and len(descriptors) == _DESCRIPTORS:
                    return connection, request, descriptors
            except (OSError, ValueError, LookupError, TypeError, AttributeError, struct.error):
                pass  # another user's, another program's, or torn
            connection.close()
            for descriptor in descriptors:
                os.close(descriptor)
        return None

    def _read_own_request(self, connection: socket.socket) -> dict[str, Any]:
        peer = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, PEER.size)
        if PEER.unpack(peer)[1] != os.getuid():
            raise PermissionError("another user's")
        request = _read_request(connection)
        if request["surroundings"].encode("utf-8", "surrogateescape") != self._surroundings:
            raise ValueError("it cannot be carried out here")
        return request

    def _tell_staying(
        self,
        *,
        command: Sequence[str] | None = None,
        stale: bool = False,
        modules: Sequence[str] = (),
    ) -> None:
        message = {"command": command, "stale": stale, "modules": [*modules]}
        with suppress(OSError):  # it has ended
            self._said.send(json.dumps(message).encode())


def _send_answer(connection: socket.socket, **words: int) -> None:
    with suppress(OSError):  # who asked is gone
        connection.sendall(json.dumps(words).encode() + b"\n")


def _read_request(connection: socket.socket) -> dict[str, Any]:
    (size,) = SIZE.unpack(_read_bytes(connection, SIZE.size))
    request: dict[str, Any] = json.loads(_read_bytes(connection, size))
    return request


def _read_bytes(connection: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        more = connection.recv(min(size - len(data), _MOST_BYTES))
        if not more:
            raise ConnectionError("the request is torn")
        data += more
    return data


def _take_place(request: dict[str, Any], descriptors: Sequence[int]) -> int:
    """Take the place of the process of the command: streams, folder, arguments, signals.

    Returns
    -------
    int
        Descriptor of a pipe that is closed when that process is gone, with which this one gets
        SIGTERM.
    """
    os.setsid()
    *streams, folder, lifeline = descriptors
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    os.fchdir(folder)
    os.close(folder)
    _open_streams()
    for name in set(os.environ) & set(request["absent"]):
        del os.environ[name]
    os.environ.update(request["shell"])
    sys.argv[:] = request["argv"]
    sys.path.insert(0, request["path"])
    _set_main(**request["main"])
    for number in PASSED_ON:  # the command that left this process may have ignored some
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in request["ignored"]:
        signal.signal(number, signal.SIG_IGN)
    fcntl(lifeline, F_SETOWN, os.getpid())
    fcntl(lifeline, _F_SETSIG, signal.SIGTERM)
    fcntl(lifeline, F_SETFL, fcntl(lifeline, F_GETFL) | os.O_ASYNC)
    if select.select([lifeline], [], [], 0)[0]:
        raise ConnectionError("the process of the command is gone")
    return lifeline


def _set_main(*, file: str | None, package: str | None, name: str | None) -> None:
    """Put a module in the place of the main one that shows how the command was called.

    Usage messages and processes that are started look there.
    """
    main = ModuleType("__main__")
    main.__file__ = file
    main.__package__ = package
    main.__spec__ = None if name is None else ModuleSpec(name, None)
    sys.modules["__main__"] = main


def _open_streams() -> None:
    """Make Python's streams anew, as at its start, for what the descriptors are now."""
    at_once = bool(os.environ.get("PYTHONUNBUFFERED"))
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        before = getattr(sys, f"__{name}__")
        raw = io.FileIO(number, "w" if number else "r", closefd=False)
        raw.name = f"<{name}>"
        stream = io.TextIOWrapper(
            _with_buffer(raw, written=number > 0, at_once=at_once),
            encoding=before.encoding,
            errors=before.errors,
            line_buffering=number == 2 or (number == 1 and raw.isatty()),
            newline="\n",
            write_through=bool(number) and at_once,
        )
        stream.mode = "w" if number else "r"  # type: ignore[misc]
        setattr(sys, name, stream)
        setattr(sys, f"__{name}__", stream)


def _with_buffer(raw: io.FileIO, *, written: bool, at_once: bool) -> Any:
    """A stream of bytes as Python makes it at its start."""
    if not written:
        return io.BufferedReader(raw)
    return raw if at_once else io.BufferedWriter(raw)


def _carry_out() -> int:
    """Carry out the command of ``sys.argv`` to its end; its exit code."""
    from odscen.cli import carry_out

    code: object = 0
    try:
        carry_out()
    except SystemExit as stop:
        code = stop.code
    except KeyboardInterrupt:
        code = _INTERRUPTED
    except BaseException:
        traceback.print_exc()
        code = 1
    if code is not None and not isinstance(code, int):
        sys.stderr.write(f"{code}\n")
        code = 1
    # As Python does at its end, and multiprocessing in what it forks.
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    try:
        sys.stdout.flush()
    except (OSError, ValueError) as error:
        code = _NOT_WRITTEN
        with suppress(OSError):
            sys.stderr.write(f"Exception ignored in: {sys.stdout!r}\n")
            sys.stderr.write("".join(traceback.format_exception_only(error)))
    try:
        sys.stderr.flush()
    except (OSError, ValueError):
        code = _NOT_WRITTEN
    return (code or 0) & 0xFF


def _close_streams() -> None:
    """Leave the caller's streams: who reads them must see their end with that of the command."""
    nothing = os.open(os.devnull, os.O_RDWR)
    for number in range(3):
        os.dup2(nothing, number)


def _reap_children(waiting: int) -> bool:
    """Forget processes that have ended; whether the one that waits is among them."""
    with suppress(ChildProcessError):
        while pid := os.waitpid(-1, os.WNOHANG)[0]:
            if pid == waiting:
                return True
    return False


def _import_modules(names: Iterable[str]) -> None:
    """Import what is there to import; what cannot be is left to the command that needs it."""
    for name in names:
        if name not in sys.modules and name != "__main__":
            with suppress(Exception):
                importlib.import_module(name)


def _note_times() -> dict[str, int]:
    """When the file of each module and each folder of packages was last changed."""
    files = [getattr(module, "__file__", None) for module in list(sys.modules.values())]
    return {file: _time_of(file) for file in [*files, *sys.path] if isinstance(file, str)}


def _have_changed(times: dict[str, int]) -> bool:
    return any(_time_of(file) != time for file, time in times.items())


def _time_of(file: str) -> int:
    try:
        return os.stat(file).st_mtime_ns  # noqa: PTH116 - there are some thousand of them
    except OSError:
        return 0


if __name__ == "__main__":
    main()
