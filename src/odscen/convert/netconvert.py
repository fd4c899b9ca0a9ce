"""netconvert as a subprocess, with limits on time and memory and its own words kept.

The only place of :mod:`odscen.convert` that touches the disk or starts a process.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import signal
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from odscen.errors import InputError, MissingDependencyError, NetconvertError, WorkspaceError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

_HEADER = re.compile(rb"<!-- generated on .*?-->\s*", re.DOTALL)
"""netconvert's comment with date and command line; the same input must give the same bytes."""

_NOISE = ("SUMO_HOME is not set", "proj_create:", "Success.", "Quitting (on error).")

_MESSAGES_KEPT = 200


class NetconvertResult(NamedTuple):
    """What netconvert wrote: the network, and its warnings one by one."""

    net_xml: bytes
    messages: tuple[str, ...]


def netconvert_path() -> Path:
    """Find netconvert: in the ``eclipse-sumo`` package, else on the PATH.

    Raises
    ------
    MissingDependencyError
        If it is nowhere.
    """
    name = "netconvert.exe" if os.name == "nt" else "netconvert"
    home = sumo_home()
    if home is not None and (home / "bin" / name).is_file():
        return home / "bin" / name
    found = shutil.which("netconvert")
    if found is None:
        msg = "netconvert is not installed: pip install 'eclipse-sumo>=1.28,<1.29'"
        raise MissingDependencyError(msg)
    return Path(found)


def sumo_home() -> Path | None:
    """``SUMO_HOME`` of the ``eclipse-sumo`` package, or ``None`` without it."""
    try:
        import sumo  # type: ignore[import-untyped]
    except ImportError:
        return None
    return Path(str(sumo.SUMO_HOME))


def read_map(path: Path) -> bytes:
    """Read an OpenDRIVE file.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(error.strerror or str(error), file=str(path)) from error


def stage(folder: Path, files: Mapping[str, bytes]) -> Path:
    """Write netconvert's input files into an existing folder and return the folder.

    Raises
    ------
    WorkspaceError
        If that fails.
    """
    try:
        for name, content in files.items():
            (folder / name).write_bytes(content)
    except OSError as error:
        msg = f"{folder}: {error.strerror or error}"
        raise WorkspaceError(msg) from error
    return folder


def run_netconvert(
    xodr: Path, options: Sequence[str], *, time_limit: float, memory_limit: int
) -> NetconvertResult:
    """Convert one OpenDRIVE file in its own folder.

    Parameters
    ----------
    xodr
        The file; the network is written beside it. netconvert splits names at commas, so its name
        must not have one.
    options
        Further options; file names in them are relative to the folder.
    time_limit
        Seconds of computing time, and ten times as many by the clock (a busy machine is no fault of
        the map).
    memory_limit
        Bytes of data; netconvert itself takes some 0.2 GB of them before it has read anything.

    Raises
    ------
    NetconvertError
        If it refuses, crashes, or passes a limit; ends with what netconvert said.
    MissingDependencyError
        If netconvert is not installed.
    """
    output = xodr.with_suffix(".net.xml")
    output.unlink(missing_ok=True)
    command = [
        str(netconvert_path()),
        *("--opendrive-files", xodr.name),
        *("--output-file", output.name),
        *options,
    ]
    with subprocess.Popen(
        command,
        cwd=xodr.parent,
        env=_environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    ) as process:
        _limit(process.pid, time_limit, memory_limit)
        try:
            said, _ = process.communicate(timeout=10.0 * time_limit)
        except subprocess.TimeoutExpired as error:
            process.kill()
            said, _ = process.communicate()
            msg = f"netconvert did not finish within {10.0 * time_limit:g} s"
            raise NetconvertError(msg, output="\n".join(_messages(said))) from error
    messages = _messages(said)
    if process.returncode != 0 or not output.is_file():
        problem = _problem(process.returncode, messages, time_limit, memory_limit)
        raise NetconvertError(problem, output="\n".join(messages))
    return NetconvertResult(_HEADER.sub(b"", output.read_bytes(), count=1), messages)


def _environment() -> dict[str, str]:
    """Environment of netconvert.

    One thread, because the algebra library that comes with it sets aside memory for as many threads
    as the machine has cores, which would make the limit depend on the machine.
    """
    home = sumo_home()
    own = {"OMP_NUM_THREADS": "1", **({"SUMO_HOME": str(home)} if home else {})}
    return {**os.environ, **own}


def _limit(pid: int, time_limit: float, memory_limit: int) -> None:
    """Limit a running child; only Linux can, elsewhere the clock must do."""
    try:
        from resource import RLIMIT_CORE, RLIMIT_CPU, RLIMIT_DATA, prlimit
    except ImportError:
        return
    seconds = max(1, round(time_limit))
    # A child that has already ended needs no limit.
    with contextlib.suppress(ProcessLookupError):
        prlimit(pid, RLIMIT_DATA, (memory_limit, memory_limit))
        prlimit(pid, RLIMIT_CPU, (seconds, seconds + 1))
        prlimit(pid, RLIMIT_CORE, (0, 0))


def _messages(said: bytes) -> tuple[str, ...]:
    lines = (line.strip() for line in said.decode("utf-8", "replace").splitlines())
    kept = [line for line in lines if line and not any(noise in line for noise in _NOISE)]
    return tuple(kept[:_MESSAGES_KEPT])


def _problem(code: int, messages: Sequence[str], time_limit: float, memory_limit: int) -> str:
    if code == -getattr(signal, "SIGXCPU", 24):
        return f"netconvert needed more than {time_limit:g} s of computing time"
    if any("bad_alloc" in line or "memory" in line.lower() for line in messages):
        return f"netconvert needed more than {memory_limit >> 20} MiB of memory"
    if code < 0:
        return f"netconvert crashed ({signal.Signals(-code).name})"
    return f"netconvert refused the map (exit code {code})"
