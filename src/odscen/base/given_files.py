"""Files that users name: paths as they write them, and content of a sensible size only."""

from __future__ import annotations

import os
import stat
import zipfile
import zlib
from pathlib import Path
from typing import TypeAlias

from typing_extensions import TypeIs

from odscen.base.errors import InputError
from odscen.base.shown import printable

GivenPath: TypeAlias = str | os.PathLike[str]
"""A path as people write it."""

MOST = 256_000_000
"""Bytes; a scenario of 200,000 actors has a fifth of it."""

UNREADABLE_ARCHIVE = (
    zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, OSError, RuntimeError,
    ValueError,
)  # fmt: skip
"""What ``zipfile`` raises for a damaged archive: a negative place in it is a ``ValueError``."""


def as_path(given: GivenPath) -> Path:
    """Path of what the public functions are given; ``~`` is the home folder.

    Raises
    ------
    InputError
        If it is neither text nor a path.
    """
    try:
        return Path(given).expanduser()
    except TypeError as error:
        raise InputError(f"a path is text or a pathlib.Path, not {given!r}") from error
    except RuntimeError as error:  # there is no such user
        raise InputError(str(error), file=printable(str(given))) from error


def is_path(given: object) -> TypeIs[GivenPath]:
    """Whether something is a path, rather than what would be read from it."""
    return isinstance(given, str | os.PathLike)


def read_given(file: Path, *, most: int = MOST) -> bytes:
    """Content of a file.

    Raises
    ------
    InputError
        If it is no regular file (a pipe or device might never end), has more than ``most`` bytes,
        or cannot be read.
    """
    try:
        status = file.stat()
        if not stat.S_ISREG(status.st_mode):
            what = "a folder" if stat.S_ISDIR(status.st_mode) else "a pipe, device or socket"
            raise InputError(f"this is {what}, not a regular file", file=printable(str(file)))
        if status.st_size > most:
            raise InputError(
                f"the file has {status.st_size} bytes; the limit is {most}",
                file=printable(str(file)),
            )
        return file.read_bytes()
    except (OSError, ValueError) as error:  # a name with a NUL is a ValueError
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(reason, file=printable(str(file))) from error


def read_given_text(file: Path) -> str:
    """Content of a text file in UTF-8.

    Raises
    ------
    InputError
        As :func:`read_given`, and if it is no such text.
    """
    try:
        return read_given(file).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(
            f"not text in UTF-8: byte {error.start} is {error.object[error.start]:#04x}",
            file=printable(str(file)),
        ) from error
