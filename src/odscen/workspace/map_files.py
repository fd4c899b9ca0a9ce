"""Reading a user's map file: regular files of a sensible size only."""

from __future__ import annotations

import stat
from typing import TYPE_CHECKING

from odscen.base.errors import InputError
from odscen.base.shown import printable
from odscen.opendrive.parse_rules import MAX_BYTES

if TYPE_CHECKING:
    from pathlib import Path


def read_map_file(source: Path) -> bytes:
    """Content of an OpenDRIVE file.

    Raises
    ------
    InputError
        If it is no regular file (a pipe or device might never end), is larger than
        :data:`~odscen.opendrive.parse_rules.MAX_BYTES`, or cannot be read.
    """
    try:
        found = source.stat()
        if not stat.S_ISREG(found.st_mode):
            what = "a folder" if stat.S_ISDIR(found.st_mode) else "a pipe, device or socket"
            msg = f"this is {what}, not a regular file"
            raise InputError(msg, file=printable(str(source)))
        if found.st_size > MAX_BYTES:
            msg = f"the file has {found.st_size} bytes; the limit is {MAX_BYTES}"
            raise InputError(msg, file=printable(str(source)))
        return source.read_bytes()
    except (OSError, ValueError) as error:  # a name with a NUL is a ValueError
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(reason, file=printable(str(source))) from error
