"""The whole error tree.

    OdscenError                     everything raised on purpose; has an exit_code
    |-- InputError (2)              what the user gave cannot be used; names file, place and value
    |   |-- OpenDriveError          an .xodr file, with the element path and the value at fault
    |   |-- GraphFormatError        a GraphML or npz file that is not one of ours
    |   |-- ScenarioError           a scenario document or its graph form; carries all problems
    |   |-- NotFoundError           a name that is not in the catalogue, with close names
    |   |-- NoMapError              a scenario of others without its map; has a report of the rest
    |   |-- ConflictError           it is taken, in use, or has changed meanwhile
    |   |-- DamagedError            stored files are not as they were written; names each
    |   `-- LimitError (3)          it needs more memory, time or disk than it may have
    |-- WorkspaceError (2)          a workspace that cannot be read or written
    |   `-- ResourceError (3)       the machine has no more of something; says what to do
    |-- MissingDependencyError (2)  something that is not installed, and how to get it
    `-- ToolError (3)               a program or library that we call failed, in its own words
        |-- SimulationError         SUMO: refused to start, died, or stopped early
        `-- CarlaError              a CARLA server that is not there, does not fit, or went away
            `-- CarlaReleaseError   it is another release

Messages read ``place: what is wrong``; a place is a file, then the path of the element in it.
"""

from __future__ import annotations

import difflib
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from odscen.base.shown import shown

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

_LONGEST_NAME, _MOST_NAMES = 200, 5000
"""Beyond these no close names are looked for: each of those known is held against the name."""


class ReportedRow(Protocol):
    """A row of a report, which can be had as a dictionary."""

    def _asdict(self) -> dict[str, Any]: ...


class OdscenError(Exception):
    """Base of every error that odscen raises on purpose."""

    exit_code = 1


class InputError(OdscenError):
    """Something the user gave cannot be used.

    Parameters
    ----------
    problem
        What is wrong, with the value.
    file
        Name of the file, if there is one.
    element
        Path of the element inside the file, for example ``road 7 > laneSection 0 > lane -1``.
    """

    exit_code = 2

    def __init__(
        self, problem: str, *, file: str | None = None, element: str | None = None
    ) -> None:
        self.problem = problem
        self.file = file
        self.element = element
        super().__init__(problem)

    def __str__(self) -> str:
        return ": ".join(part for part in (self.file, self.element, self.problem) if part)


class OpenDriveError(InputError):
    """An OpenDRIVE file is malformed or uses something that is not supported."""


class GraphFormatError(InputError):
    """A graph file (GraphML, npz) cannot be read as one of ours."""


class ScenarioError(InputError):
    """A scenario document or its graph form is not usable; ``problems`` lists every reason."""

    def __init__(
        self,
        problem: str,
        *,
        problems: Sequence[str] = (),
        file: str | None = None,
        element: str | None = None,
    ) -> None:
        self.problems = tuple(problems)
        super().__init__(problem, file=file, element=element)

    def __str__(self) -> str:
        return "\n".join([super().__str__(), *(f"  - {problem}" for problem in self.problems)])


class NotFoundError(InputError):
    """A name is not known; the message offers close ones.

    Parameters
    ----------
    what
        The kind of thing, for example ``"map"``.
    name
        The name that was asked for.
    known
        All names there are.
    """

    def __init__(self, what: str, name: str, known: Sequence[str]) -> None:
        self.what = what
        self.name = name
        near = known if len(name) <= _LONGEST_NAME and len(known) <= _MOST_NAMES else ()
        close = difflib.get_close_matches(name, near, n=3, cutoff=0.5)
        if close:
            hint = f"; did you mean {', '.join(close)}?"
        elif known:
            listed = ", ".join(sorted(known)[:8])
            hint = f"; known are {listed}{', ...' if len(known) > 8 else ''}"
        else:
            hint = f"; there is no {what} yet"
        super().__init__(f"no {what} named {shown(name)}{hint}")


class NoMapError(InputError):
    """The map of a scenario of others is not there, or it names none.

    Parameters
    ----------
    lists
        Rows of the report of the import by their verdict: what could be read, and what not.
    """

    def __init__(
        self, problem: str, *, lists: Mapping[str, Sequence[ReportedRow]], file: str | None = None
    ) -> None:
        self.lists = lists
        super().__init__(problem, file=file)


class ConflictError(InputError):
    """What was asked for does not fit what is there now; ``current`` is its newest version."""

    def __init__(self, problem: str, *, current: int | None = None) -> None:
        self.current = current
        super().__init__(problem)


class DamagedFile(NamedTuple):
    """A stored file that is not as it was written.

    Attributes
    ----------
    file
        Its name, relative to the folder that has its checksum.
    expected, found
        SHA-256, hexadecimal; ``found`` may say in words that it is missing or cannot be read.
    """

    file: str
    expected: str
    found: str

    def __str__(self) -> str:
        expected, found = _shorten_digest(self.expected), _shorten_digest(self.found)
        return f"{self.file}: expected {expected}, found {found}"


class DamagedError(InputError):
    """Stored files are not as they were written; nothing has been computed from them.

    Parameters
    ----------
    folder
        That has the files.
    files
        Each of them.
    advice
        What to do.
    """

    def __init__(self, folder: str, files: Sequence[DamagedFile], *, advice: str = "") -> None:
        self.files = tuple(files)
        self.advice = advice
        many = f"{len(files)} files are" if len(files) > 1 else "a file is"
        listed = "".join(f"\n  - {file}" for file in files)
        more = f"; {advice}" if advice else ""
        super().__init__(f"{many} not as written{more}{listed}", file=folder)


class LimitError(InputError):
    """What was given needs more memory, time or disk than it may have."""

    exit_code = 3


class WorkspaceError(OdscenError):
    """The workspace cannot be read or written."""

    exit_code = 2


class ResourceError(WorkspaceError):
    """The machine has no more room, memory or open files, or lets nothing be written."""

    exit_code = 3


class MissingDependencyError(OdscenError):
    """A package or program is not installed; the message says how to get it."""

    exit_code = 2


class ToolError(OdscenError):
    """A program or library that we call failed; ``output`` is what it said."""

    exit_code = 3

    def __init__(self, problem: str, *, output: str = "") -> None:
        self.output = output
        super().__init__(f"{problem}\n{output.strip()}" if output.strip() else problem)


class SimulationError(ToolError):
    """SUMO refused to start, died, or stopped early."""


class CarlaError(ToolError):
    """A CARLA server is not there, does not fit, or went away; the message says what to do."""


class CarlaReleaseError(CarlaError):
    """A CARLA server of another release than the client that is installed."""


def _shorten_digest(digest: str) -> str:
    return f"sha256 {digest[:12]}..." if len(digest) == 64 else digest


@contextmanager
def in_file(file: str) -> Iterator[None]:
    """Add the file's name to any :class:`InputError` that passes through without one."""
    try:
        yield
    except InputError as error:
        if error.file is None:
            error.file = file
        raise
