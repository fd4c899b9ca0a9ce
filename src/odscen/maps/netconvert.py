"""netconvert in a process of its own, with limits on time and memory and its own words kept."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.atomic_folders import scratch_folder
from odscen.base.errors import MissingDependencyError, ToolError
from odscen.convert.imported.netconvert_recipe import (
    TYPES_FILE,
    lane_types,
    recipe,
    with_lane_limits,
)
from odscen.convert.model.conversion_report import ElementOutcome, ReportEntry

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

LEAST_SECONDS = 2.0
SECONDS_PER_MEGABYTE = 8.0
MOST_SECONDS = 60.0
"""Computing time for one map. Towns of 3 MB take 0.4 s; a small file that takes longer than two
seconds is one that netconvert will not finish. Later steps of the recipe get half."""

MEMORY = 768 << 20
MEMORY_PER_MEGABYTE = 64 << 20
"""Bytes of data; towns of 3 MB take less than 0.2 GB of it."""

_PATIENCE = 10.0
"""Seconds of wall time for each of CPU time: a busy machine is no fault of the map."""

_HEADER = re.compile(rb"<!-- generated on .*?-->\s*", re.DOTALL)
"""netconvert's comment with date and command line; the same input must give the same bytes."""

_DATE = re.compile(rb'(?<=\\s)date="[^"]*"')

_NOISE = ("SUMO_HOME is not set", "pj_obj_create", "proj_create", "Success.", "Quitting (on error)")
_MESSAGES_KEPT = 200


class NetconvertLimits(NamedTuple):
    """Seconds of computing time, and bytes of data."""

    seconds: float
    memory: int


class NetconvertOutput(NamedTuple):
    """The network, and netconvert's warnings one by one."""

    net_xml: bytes
    messages: tuple[str, ...]


def convert_map(xodr: bytes, *, lefthand: bool) -> tuple[bytes, tuple[ReportEntry, ...]]:
    """Make a SUMO network of an OpenDRIVE map, by the first step of the recipe that works.

    Returns
    -------
    The ``.net.xml``, and entries of the import report: what was changed for netconvert, what the
    recipe had to give up, and netconvert's warnings.

    Raises
    ------
    ToolError
        If netconvert takes the map by no step; with its own words on the last.
    MissingDependencyError
        If SUMO is not installed.
    """
    prepared, entries = with_lane_limits(xodr)
    files = {TYPES_FILE: lane_types().encode(), "map.xodr": prepared}
    megabytes = len(prepared) / 1e6
    seconds = min(MOST_SECONDS, LEAST_SECONDS + SECONDS_PER_MEGABYTE * megabytes)
    limits = NetconvertLimits(seconds, MEMORY + int(MEMORY_PER_MEGABYTE * megabytes))
    found = list(entries)
    failure: ToolError | None = None
    for step in recipe(lefthand=lefthand):
        if failure is not None:
            limits = NetconvertLimits(max(0.5 * seconds, 1.0), limits.memory)
            reason = f"{step.gives_up}, because {_first_lines(failure)}"
            found.append(ReportEntry(ElementOutcome.LOST, "netconvert", reason))
        try:
            done = run_netconvert(
                ["--opendrive-files=map.xodr", *step.options], files=files, limits=limits
            )
        except ToolError as error:
            failure = error
            continue
        found += [ReportEntry(ElementOutcome.GUESSED, "netconvert", s) for s in done.messages]
        return done.net_xml, tuple(found)
    assert failure is not None
    raise failure


def opendrive_of_network(net_xml: bytes) -> tuple[bytes, tuple[ReportEntry, ...]]:
    """Make OpenDRIVE of a SUMO network, in the coordinates of the network.

    Returns
    -------
    The ``.xodr``, and netconvert's warnings as entries of the import report.

    Raises
    ------
    ToolError
        If netconvert refuses the network; with its own words.
    MissingDependencyError
        If SUMO is not installed.
    """
    megabytes = len(net_xml) / 1e6
    seconds = min(10.0 * MOST_SECONDS, LEAST_SECONDS + SECONDS_PER_MEGABYTE * megabytes)
    limits = NetconvertLimits(seconds, MEMORY + int(MEMORY_PER_MEGABYTE * megabytes))
    done = run_netconvert(
        ["--sumo-net-file=given.net.xml"],
        files={"given.net.xml": net_xml},
        limits=limits,
        output="--opendrive-output",
    )
    xodr = _DATE.sub(b'date=""', done.net_xml, count=1)
    entries = (ReportEntry(ElementOutcome.GUESSED, "netconvert", line) for line in done.messages)
    return xodr, tuple(entries)


def run_netconvert(
    options: Sequence[str],
    *,
    files: Mapping[str, bytes],
    limits: NetconvertLimits,
    output: str = "--output-file",
) -> NetconvertOutput:
    """Run netconvert in a folder of its own.

    Parameters
    ----------
    options
        All but ``output``; names of files in them are those of ``files``.
    files
        What it reads; names without commas, at which netconvert divides.
    output
        Option of what is to be made.

    Raises
    ------
    ToolError
        If it refuses, crashes, or passes a limit; with what it said.
    MissingDependencyError
        If SUMO is not installed.
    """
    program, environment = _find_program()
    with scratch_folder() as folder:
        for file, content in files.items():
            (folder / file).write_bytes(content)
        made = folder / "made.xml"
        with subprocess.Popen(
            [program, *options, f"{output}={made.name}"],
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        ) as process:
            _limit_child(process.pid, limits)
            child_output = _wait_for_output(process, limits.seconds)
        messages = _clean_messages(child_output)
        if process.returncode != 0 or not made.is_file():
            problem = _describe_problem(process.returncode, messages, limits)
            raise ToolError(problem, output="\n".join(messages))
        return NetconvertOutput(_HEADER.sub(b"", made.read_bytes(), count=1), messages)


def _wait_for_output(process: subprocess.Popen[bytes], seconds: float) -> bytes:
    try:
        output, _ = process.communicate(timeout=_PATIENCE * seconds)
    except subprocess.TimeoutExpired as error:
        process.kill()
        output, _ = process.communicate()
        raise ToolError(
            f"netconvert did not finish within {_PATIENCE * seconds:g} s",
            output="\n".join(_clean_messages(output)),
        ) from error
    return output


def _find_program() -> tuple[Path, dict[str, str]]:
    """Find netconvert of the ``eclipse-sumo`` package, and make its environment.

    One thread, because the algebra library that comes with it sets aside memory for as many threads
    as the machine has cores, which would make the limit depend on the machine.
    """
    try:
        import sumo
    except ImportError as error:
        raise MissingDependencyError(
            "netconvert is not installed: pip install 'eclipse-sumo>=1.28,<1.29'"
        ) from error
    home = Path(str(sumo.SUMO_HOME))
    program = home / "bin" / ("netconvert.exe" if os.name == "nt" else "netconvert")
    if not program.is_file():
        raise MissingDependencyError(
            f"netconvert is not in {program.parent}; install eclipse-sumo again"
        )
    return program, {**os.environ, "SUMO_HOME": str(home), "OMP_NUM_THREADS": "1"}


def _limit_child(pid: int, limits: NetconvertLimits) -> None:
    """Limit a running child; only Linux can, elsewhere the clock must do."""
    try:
        from resource import RLIMIT_CORE, RLIMIT_CPU, RLIMIT_DATA, prlimit
    except ImportError:
        return
    seconds = max(1, round(limits.seconds))
    # A child that has already ended needs no limit.
    with contextlib.suppress(ProcessLookupError):
        prlimit(pid, RLIMIT_DATA, (limits.memory, limits.memory))
        prlimit(pid, RLIMIT_CPU, (seconds, seconds + 1))
        prlimit(pid, RLIMIT_CORE, (0, 0))


def _clean_messages(output: bytes) -> tuple[str, ...]:
    lines = (line.strip() for line in output.decode("utf-8", "replace").splitlines())
    kept = [line for line in lines if line and not any(noise in line for noise in _NOISE)]
    return tuple(dict.fromkeys(kept[:_MESSAGES_KEPT]))


def _describe_problem(code: int, messages: Sequence[str], limits: NetconvertLimits) -> str:
    if code == -getattr(signal, "SIGXCPU", 24):
        return f"netconvert needed more than {limits.seconds:g} s of computing time"
    if any("bad_alloc" in line or "memory" in line.lower() for line in messages):
        return f"netconvert needed more than {limits.memory >> 20} MiB of memory"
    if code < 0:
        return f"netconvert crashed ({signal.Signals(-code).name})"
    return f"netconvert refused the map (exit code {code})"


def _first_lines(error: ToolError) -> str:
    lines = [line for line in str(error).splitlines() if line.strip()]
    return "; ".join(lines[:2])
