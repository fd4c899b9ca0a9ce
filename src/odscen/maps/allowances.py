"""What a child process may use: memory, time and output that follow from what it is given."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import NamedTuple

from odscen.base.errors import InputError, LimitError
from odscen.maps.importers.file_kinds import is_packed

MEMORY_VARIABLE = "ODSCEN_BUILD_MEMORY"
MINUTES_VARIABLE = "ODSCEN_BUILD_MINUTES"

MAP_MEMORY = 1_200_000_000
MAP_MEMORY_PER_BYTE = 32
NODE_MEMORY_PER_BYTE = 32
MOST_MEMORY = 1_450_000_000
"""Bytes of memory for a map, for each byte of it, for each byte at a spacing of 2 m, and at most.
A town of 3.4 MB needs 245 MB; what is known of a map by its size is the least that it needs: a file
of 10 kB with 200 km of motorway needs 1.2 GB."""
NETWORK_MEMORY_PER_BYTE = 96
"""Bytes beyond the most, for each byte of a network that is brought in: it says all of its lanes,
as a small ``.xodr`` need not, so that a large one is a whole town. One of 22.9 MB
needs 2 of 3.6 GB."""
LEAST_MEMORY = 0.25
"""Gigabytes below which the libraries fail on their own, in words of their own."""
MAP_SECONDS = 60.0
MAP_SECONDS_PER_MEGABYTE = 10.0
"""Computing time for a map, and for each megabyte at 2 m; the town needs 2.4 s of 94 s."""
PACKING = 10
"""Bytes of XML for each byte of a packed file or of PBF; Helsinki's 0.6 MB of PBF are 7 MB."""
DOCUMENT_MEMORY = 384 << 20
DOCUMENT_MEMORY_PER_BYTE = 12
"""Bytes of memory for a document, and for each byte of it."""
DOCUMENT_SECONDS = 10.0
DOCUMENT_SECONDS_PER_MEGABYTE = 1.0
LARGE_MEMORY_PER_BYTE = 36
LARGE_SECONDS_PER_MEGABYTE = 4.0
"""The same for a scenario that is checked, shown and written, too; 30 MB with 200,000 actors and as
many problems need 1.1 of 1.5 GB and 18 of 130 s."""
IMPORT_MEMORY = 900_000_000
IMPORT_MEMORY_PER_BYTE = 60
IMPORT_SECONDS = 30.0
IMPORT_SECONDS_PER_MEGABYTE = 30.0
"""The same for a file of OpenSCENARIO, with the map that it plays on."""
RECORDING_MEMORY = 1_200_000_000
RECORDING_MEMORY_PER_BYTE = 12
RECORDING_MEMORY_BEYOND = 1
RECORDING_IN_PARTS = 100_000_000
RECORDING_SECONDS = 60.0
RECORDING_SECONDS_PER_MEGABYTE = 5.0
"""The same for recorded traffic that is read, placed on a map and searched for scenes. Beyond so
many bytes it is read in parts: 1.9 GB with 27 million states need 1.2 of 4.2 GB."""
PICTURE_MEMORY = 1_200_000_000
PICTURE_SECONDS = 120.0
"""The same for a TIFF of any size that pictures under maps may have: one of 100 million pixels
needs 0.9 GB and 30 s."""
TRIAL_MEMORY = 8_000_000_000
TRIAL_SECONDS = 7200.0
_FILE_SHARE = 4
"""A file that is written may have this part of the memory."""
_PATIENCE = 6.0
"""Seconds of wall time for each of computing time: a busy machine is no fault of the map."""
_USUAL_SPACING = 2.0
_MOST = 10_000.0


class Allowance(NamedTuple):
    """What one job may use.

    Attributes
    ----------
    memory
        Bytes of data.
    seconds
        Of computing time.
    raise_it
        Whether the user can allow more.
    """

    memory: int
    seconds: float
    raise_it: bool = False

    @property
    def output(self) -> int:
        """Bytes of each file that is written."""
        return self.memory // _FILE_SHARE

    @property
    def times_usual(self) -> float:
        """How many times the memory is that of the largest map, if the user has not allowed more.

        A map may have so many times the lanes, too.
        """
        return max(1.0, self.memory / MOST_MEMORY)

    @property
    def wall_seconds(self) -> float:
        """Wall seconds."""
        return _PATIENCE * self.seconds

    def passed(self, what: str, limit: str) -> LimitError:
        """The error for work that has passed a limit.

        Parameters
        ----------
        what
            The work, such as "building the map".
        limit
            ``memory``, ``time``, ``wall`` or ``output``.
        """
        problem = {
            "memory": f"{what} needs more than {_format_gigabytes(self.memory)} GB of memory",
            "time": f"{what} needs more than {self.seconds:.3g} s of computing time",
            "wall": f"{what} did not end within {self.wall_seconds:.3g} s",
            "output": f"{what} makes a file of more than {_format_gigabytes(self.output)} GB",
        }[limit]
        if not self.raise_it:
            return LimitError(f"{problem}; that is the limit for a file of its size")
        if limit in ("memory", "output"):
            more = _format_gigabytes(2 * self.memory)
            hint = f"--build-memory {more} (GB), or {MEMORY_VARIABLE}={more}"
        else:
            more = f"{2 * self.seconds / 60.0:.2g}"
            hint = f"--build-minutes {more}, or {MINUTES_VARIABLE}={more}"
        return LimitError(f"{problem}, the limit for a map of its size; to allow more: {hint}")


@dataclass(frozen=True, slots=True)
class BuildLimits:
    """What the user allows for building a map, in place of what follows from its size.

    Attributes
    ----------
    memory
        Gigabytes (10^9 bytes); ``None`` is what ``$ODSCEN_BUILD_MEMORY`` says, else by size.
    minutes
        Of computing time; ``None`` is what ``$ODSCEN_BUILD_MINUTES`` says, else by size.

    Raises
    ------
    InputError
        If a value is no number above zero, or less memory than the libraries need.
    """

    memory: float | None = None
    minutes: float | None = None

    def __post_init__(self) -> None:
        for what, value in (("memory", self.memory), ("minutes", self.minutes)):
            if value is not None and not 0.0 < value <= _MOST:
                raise InputError(
                    f"--build-{what} must be above 0 and at most {_MOST:g}, not {value:g}"
                )
        if self.memory is not None and self.memory < LEAST_MEMORY:
            raise InputError(_too_little("--build-memory", self.memory))

    def for_map(self, size: int, *, spacing: float, network: int = 0) -> Allowance:
        """What a map may use.

        Parameters
        ----------
        size
            Bytes of the ``.xodr``.
        spacing
            Metres between nodes.
        network
            Bytes of a network that is brought in for it.

        Raises
        ------
        InputError
            If a variable of the environment is no number above zero.
        """
        dense = max(1.0, _USUAL_SPACING / spacing)
        per_byte = MAP_MEMORY_PER_BYTE + NODE_MEMORY_PER_BYTE * dense
        size += network
        most = MOST_MEMORY + NETWORK_MEMORY_PER_BYTE * network
        memory = self.memory or _read_environment(MEMORY_VARIABLE)
        minutes = self.minutes or _read_environment(MINUTES_VARIABLE)
        return Allowance(
            int(memory * 1e9 if memory else min(most, MAP_MEMORY + per_byte * size)),
            minutes * 60.0
            if minutes
            else MAP_SECONDS + MAP_SECONDS_PER_MEGABYTE * dense * size / 1e6,
            raise_it=True,
        )


BY_SIZE = BuildLimits()
"""Limits that follow from the size of a map."""


def unpacked_size(content: bytes) -> int:
    """Bytes of a map's file as XML, about: what it allows does not depend on how it is packed."""
    packed = is_packed(content) or b"OSMHeader" in content[:64]
    return len(content) * (PACKING if packed else 1)


def for_document(size: int) -> Allowance:
    """What reading a document of so many bytes may use."""
    return Allowance(
        min(MOST_MEMORY, DOCUMENT_MEMORY + DOCUMENT_MEMORY_PER_BYTE * size),
        DOCUMENT_SECONDS + DOCUMENT_SECONDS_PER_MEGABYTE * size / 1e6,
    )


def for_import(size: int) -> Allowance:
    """What reading an OpenSCENARIO file and its catalogs, of so many bytes, may use."""
    return Allowance(
        min(MOST_MEMORY, IMPORT_MEMORY + IMPORT_MEMORY_PER_BYTE * size),
        IMPORT_SECONDS + IMPORT_SECONDS_PER_MEGABYTE * size / 1e6,
    )


def for_recording(size: int) -> Allowance:
    """What reading recorded traffic of so many bytes, and placing it on a map, may use."""
    in_parts = max(0, size - RECORDING_IN_PARTS)
    at_once = RECORDING_MEMORY_PER_BYTE * (size - in_parts)
    return Allowance(
        RECORDING_MEMORY + at_once + RECORDING_MEMORY_BEYOND * in_parts,
        RECORDING_SECONDS + RECORDING_SECONDS_PER_MEGABYTE * size / 1e6,
    )


def for_picture() -> Allowance:
    """What unpacking a picture may use: a few kB may be one of the largest size."""
    return Allowance(PICTURE_MEMORY, PICTURE_SECONDS)


def for_large_document(size: int) -> Allowance:
    """What working on a scenario of so many bytes may use: to read, edit, check and write it."""
    return Allowance(
        DOCUMENT_MEMORY + LARGE_MEMORY_PER_BYTE * size,
        DOCUMENT_SECONDS + LARGE_SECONDS_PER_MEGABYTE * size / 1e6,
    )


def for_trial_runs() -> Allowance:
    """What a demand that is tried by runs may use: as much as runs that a user starts himself."""
    return Allowance(TRIAL_MEMORY, TRIAL_SECONDS)


def _read_environment(name: str) -> float | None:
    text = os.environ.get(name)
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if name == MEMORY_VARIABLE and 0.0 < value < LEAST_MEMORY:
        raise InputError(_too_little(name, value))
    if not 0.0 < value <= _MOST:
        raise InputError(f"{name}={text!r} must be a number above 0 and at most {_MOST:g}")
    return value


def _too_little(name: str, value: float) -> str:
    least = f"{name} must be at least {LEAST_MEMORY:g} (GB), not {value:g}"
    return f"{least}: the libraries need most of that before they read anything"


def _format_gigabytes(count: int) -> str:
    return f"{count / 1e9:.2f}" if count < 9.95e9 else f"{count / 1e9:.0f}"
