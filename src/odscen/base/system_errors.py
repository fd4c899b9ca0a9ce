"""What the operating system refuses, in words, and what to do."""

from __future__ import annotations

import errno
from contextlib import contextmanager
from typing import TYPE_CHECKING

from odscen.base.errors import ResourceError, WorkspaceError

if TYPE_CHECKING:
    from collections.abc import Iterator

_FULL = "the disk is full; free some room"
_READ_ONLY = "nothing may be written here; make it writable, or name another folder"
_HANDLES = "too many files are open; end other programs, or allow more (ulimit -n)"
ADVICE = {
    errno.ENOSPC: _FULL,
    errno.EDQUOT: "the user's share of the disk is used up; free some room",
    errno.EFBIG: "a file has become longer than is allowed here (ulimit -f)",
    errno.EROFS: _READ_ONLY,
    errno.EACCES: _READ_ONLY,
    errno.EPERM: _READ_ONLY,
    errno.EMFILE: _HANDLES,
    errno.ENFILE: _HANDLES,
    errno.ENOMEM: "the memory is used up; end other programs, or run less at a time",
    errno.EIO: "the disk cannot be read or written; look at the system's log, and keep a copy",
}
"""What is wrong and what to do, by number of the error."""
NO_MEMORY = ADVICE[errno.ENOMEM]


def system_words(error: OSError) -> str:
    """What is wrong, what to do, and with which file."""
    words = ADVICE.get(error.errno or 0) or error.strerror or str(error)
    return f"{words} ({error.filename})" if error.filename else words


def system_error(place: str, error: OSError, *, advice: str = "") -> WorkspaceError:
    """An error of the system as one of ours: exit code 3 where the machine lacks something.

    Parameters
    ----------
    place
        Where it has happened, for example ``run folder runs/two``.
    advice
        What to do then, beside what the kind of error says.
    """
    kind = ResourceError if error.errno in ADVICE else WorkspaceError
    then = f"; {advice}" if advice else ""
    return kind(f"{place}: {system_words(error)}{then}")


@contextmanager
def disk_errors(place: str, *, advice: str = "") -> Iterator[None]:
    """Turn errors of the system into ours; parameters as of :func:`system_error`.

    Raises
    ------
    ResourceError
        If the machine lacks something.
    WorkspaceError
        For other errors of the system.
    """
    try:
        yield
    except OSError as error:
        raise system_error(place, error, advice=advice) from error
    except MemoryError as error:
        raise ResourceError(f"{place}: {NO_MEMORY}") from error
