"""``--record-protocol``: a server's address, replaced by that of a proxy that writes all down."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING

from odscen.base.errors import MissingDependencyError, WorkspaceError
from odscen.carla.server.client import Address, await_port

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_END_SECONDS = 10.0


@contextmanager
def recorded_protocol(address: Address, file: Path) -> Iterator[Address]:
    """Record what is said with a server; yields the address by which it is to be reached meanwhile.

    Parameters
    ----------
    file
        Transcript; compressed if its name ends in ``.gz``. One that is there is replaced.

    Raises
    ------
    MissingDependencyError
        If the package ``msgpack`` is not installed.
    CarlaError
        If there is no server.
    WorkspaceError
        If the file cannot be written.
    """
    if find_spec("msgpack") is None:
        raise MissingDependencyError(
            "the package msgpack is not installed: pip install 'odscen[carla]'"
        )
    await_port(address)
    process = subprocess.Popen(
        [sys.executable, "-m", "odscen.carla.server.recording_proxy"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,  # Ctrl-C is for us, and what is then said is recorded too
    )
    try:
        options = {"host": address.host, "port": address.port, "file": str(file.absolute())}
        port = _read_started_port(process, options, file)
        yield Address("127.0.0.1", port, address.timeout, origin=address)
    finally:
        try:
            process.communicate(timeout=_END_SECONDS)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def _read_started_port(
    process: subprocess.Popen[str], options: dict[str, object], file: Path
) -> int:
    if process.stdin is None or process.stdout is None:  # both were asked for
        raise WorkspaceError(f"{file}: nothing can be recorded")
    process.stdin.write(json.dumps(options) + "\n")
    process.stdin.flush()
    answer = json.loads(process.stdout.readline() or "{}")
    if "port" not in answer:
        why = answer.get("error", "the recording process has ended")
        raise WorkspaceError(f"{file}: the protocol cannot be recorded: {why}")
    return int(answer["port"])
