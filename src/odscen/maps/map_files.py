"""Reading a user's map file: regular files of a sensible size only."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.base.given_files import read_given
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
    return read_given(source, most=MAX_BYTES)
