"""The side of the command that was typed: hand it over, pass on signals, end as it ends.

Imports are few here, as they are all that such a command waits for.
"""

from __future__ import annotations

import atexit
import json
import os
import signal
import socket
import struct
import sys
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NoReturn

from odscen.base.errors import InputError
from odscen.base.shell_variables import OF_THE_SHELL
from odscen.cli.resident.surroundings import BEGINNING, address_of, describe_surroundings

if TYPE_CHECKING:
    from collections.abc import Sequence

VARIABLE = "ODSCEN_RESIDENT"
SERVER = "odscen.cli.resident.server"
_LONGEST = 1440.0
"""Minutes that a process may stay without a command."""
_LONG_LIVED = ("serve", "assist", "cosim", "demo")
"""Commands whose imports do not matter, and that may outlive the one who typed them."""
_PATIENCE = 0.5
"""Wall seconds in which the process that stays answers, or the command is carried out here."""
PASSED_ON = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGCONT)
AGREED = b"!"
"""What is said to a process that offers to carry a command out; it does nothing before."""
_MOST = 16
"""Processes of one user that may stay, each for other surroundings."""
PEER = struct.Struct("3i")
"""Process, user and group at the other end of a socket."""
SIZE = struct.Struct("!I")
"""Bytes of a request."""


def carry_out_there(given: Sequence[str]) -> None:
    """Have a command carried out by the process that stays, and end with its exit code.

    Returns if there is none, or if it cannot have this command: it is to be carried out here then,
    and leaves such a process behind.

    Raises
    ------
    InputError
        If the variable is not a number of minutes.
    """
    minutes = _read_minutes(os.environ[VARIABLE])
    if not minutes or not sys.platform.startswith("linux") or set(given[:1]) & {*_LONG_LIVED}:
        return
    try:
        surroundings = describe_surroundings()
        with _connect_to_staying(surroundings) as connection:
            code = _hand_over(connection, surroundings)
    except OSError:
        code = None
    if code is not None:
        os._exit(code)  # nothing was imported or opened that would have to be cleaned up
    atexit.register(_leave_process, surroundings, dict(os.environ), minutes)


def _read_minutes(text: str) -> float:
    try:
        minutes = float(text or 0)
    except ValueError:
        minutes = -1.0
    if not 0.0 <= minutes <= _LONGEST:
        raise InputError(
            f"must be a number of minutes from 0 to {_LONGEST:g}, and is {text!r}",
            element=VARIABLE,
        )
    return minutes


def _connect_to_staying(surroundings: bytes) -> socket.socket:
    """Connect to the process that stays.

    Raises
    ------
    OSError
        If there is none, or it is another user's.
    """
    connection = socket.socket(socket.AF_UNIX)
    try:
        connection.settimeout(_PATIENCE)
        connection.connect(address_of(surroundings))
        peer = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, PEER.size)
        if PEER.unpack(peer)[1] != os.getuid():
            raise PermissionError("another user's")
    except OSError:
        connection.close()
        raise
    return connection


def _hand_over(connection: socket.socket, surroundings: bytes) -> int | None:
    """Hand the command over; its exit code, or ``None`` if it was not taken."""
    # A command heeds SIGTERM also where it was started with that ignored, as by some services.
    ignored = [
        int(one)
        for one in PASSED_ON
        if one != signal.SIGTERM and signal.getsignal(one) is signal.SIG_IGN
    ]
    request = {
        "surroundings": surroundings.decode("utf-8", "surrogateescape"),
        "argv": sys.argv,
        "path": sys.path[0],
        "main": _describe_main(),
        "shell": {name: os.environ[name] for name in OF_THE_SHELL & {*os.environ}},
        "absent": sorted(OF_THE_SHELL - {*os.environ}),
        "ignored": ignored,
    }
    data = json.dumps(request).encode()
    connection.sendall(SIZE.pack(len(data)) + data)
    answer = _read_answer(connection)
    if "pid" not in answer:
        return None
    # From here on it is carried out there, and before it was not: who offers too late has no leave.
    # Streams go along now: in a request that nothing has read they would stay open.
    folder = os.open(".", os.O_PATH | os.O_DIRECTORY)
    lifeline, _held = os.pipe()  # which is closed when this process is gone, however it ends
    connection.settimeout(None)
    socket.send_fds(connection, [AGREED], [0, 1, 2, folder, lifeline])
    os.close(folder)
    os.close(lifeline)
    if not _read_answer(connection):
        return None
    passed_on = _pass_on_signals(answer["pid"], ignored)
    try:
        code = _read_answer(connection).get("exit")
    except OSError:
        code = None
    return _end_by_signal(passed_on) if code is None else int(code)


def _end_by_signal(passed_on: Sequence[int]) -> NoReturn:
    """End as the process did that carried the command out: killed by what was passed on, if any."""
    number = next((one for one in reversed(passed_on) if one != signal.SIGCONT), signal.SIGKILL)
    if number != signal.SIGKILL:
        signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)
    os._exit(128 + number)


def _describe_main() -> dict[str, str | None]:
    """What says how this command was called: by its script, or as ``python -m odscen``."""
    main = sys.modules["__main__"]
    spec = getattr(main, "__spec__", None)
    return {
        "file": getattr(main, "__file__", None),
        "package": getattr(main, "__package__", None),
        "name": None if spec is None else spec.name,
    }


def _read_answer(connection: socket.socket) -> dict[str, Any]:
    """A line of JSON; empty if the other end is gone."""
    data = b""
    while not data.endswith(b"\n"):
        more = connection.recv(1)
        if not more:
            return {}
        data += more
    answer: dict[str, Any] = json.loads(data)
    return answer


def _pass_on_signals(pid: int, ignored: Sequence[int]) -> list[int]:
    """Let the process that carries the command out have the signals that this one gets.

    Returns
    -------
    list of int
        Those that it has had, which grows.
    """
    passed_on: list[int] = []

    def pass_on(number: int, _: object) -> None:
        passed_on.append(number)
        with suppress(ProcessLookupError):
            os.kill(pid, number)

    def pause(number: int, _: object) -> None:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGSTOP)
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)  # and here until SIGCONT comes
        signal.signal(number, pause)

    for number in PASSED_ON:
        if number not in ignored:
            signal.signal(number, pass_on)
    if signal.getsignal(signal.SIGTSTP) is not signal.SIG_IGN:
        signal.signal(signal.SIGTSTP, pause)
    return passed_on


def _leave_process(surroundings: bytes, environment: dict[str, str], minutes: float) -> None:
    """Start the process that stays, with what this command has imported."""
    import subprocess

    if _count_staying() >= _MOST:
        return
    about = {
        "surroundings": surroundings.decode("utf-8", "surrogateescape"),
        "minutes": minutes,
        "modules": sorted(sys.modules),
        "command": sys.argv[1:2],
    }
    with suppress(OSError):
        process = subprocess.Popen(
            [sys.executable, *subprocess._args_from_interpreter_flags(), "-P", "-m", SERVER],  # type: ignore[attr-defined]
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            env=environment,
            cwd="/",
        )
        assert process.stdin is not None
        with process.stdin as told:
            told.write(json.dumps(about).encode())
        process.returncode = 0  # it is not waited for


def _count_staying() -> int:
    """Processes of this user that stay, by their sockets."""
    with suppress(OSError), open("/proc/net/unix", "rb") as file:  # noqa: PTH123
        beginning = f"@{BEGINNING}{os.getuid()}-".encode()
        return len({row.split()[-1] for row in file if row.split()[-1].startswith(beginning)})
    return 0
