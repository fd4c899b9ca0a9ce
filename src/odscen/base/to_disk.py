"""Files and folders brought to the disk, so that a rename promises what it says.

Without this, a power cut after a rename can leave a file of the right name and no content.
"""

from __future__ import annotations

import ctypes
import os
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

_SYNC_FILE_RANGE_WRITE = 2
"""Flag of ``sync_file_range``."""


def to_disk(path: Path | str) -> None:
    """Wait until a file, or what a folder lists, is on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def all_to_disk(folder: Path) -> None:
    """Wait until everything in a folder and below is on the disk: files, then their folders.

    All of it is on its way before the first is waited for. Of a new file a journal has to be
    written, too, and one file after the other would have one written for each.
    """
    places = list(os.walk(folder, topdown=False))
    files = [f"{place}/{name}" for place, _, names in places for name in names]
    for file in files:
        _begin_to_disk(file)
    for path in (*files, *(place for place, _, _ in places)):
        to_disk(path)


def _begin_to_disk(file: str) -> None:
    """Have a file written, without waiting, where the system can be asked to."""
    begin = _write_out()
    if begin is None:
        return
    descriptor = os.open(file, os.O_RDONLY)
    try:
        begin(descriptor, 0, 0, _SYNC_FILE_RANGE_WRITE)  # what fails here, fails when waited for
    finally:
        os.close(descriptor)


@cache
def _write_out() -> Callable[..., int] | None:
    """``sync_file_range(descriptor, offset, length, flags)`` of Linux, which Python lacks."""
    sync_file_range: Callable[..., int] | None = getattr(ctypes.CDLL(None), "sync_file_range", None)
    if sync_file_range is not None:
        sync_file_range.argtypes = [ctypes.c_int, ctypes.c_int64, ctypes.c_int64, ctypes.c_uint]  # type: ignore[attr-defined]
    return sync_file_range


def write_whole(path: Path, text: str) -> None:
    """Replace a small file in one step, brought to the disk."""
    replace_by(path, path.with_name(f".{path.name}.part"), text)


def replace_by(path: Path, part: Path, content: str | bytes) -> None:
    """Replace a small file by another one beside it, written first; nothing is left of that."""
    try:
        part.write_bytes(content.encode() if isinstance(content, str) else content)
        to_disk(part)
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise
    to_disk(path.parent)
