"""Writing a file whole or not at all."""

from __future__ import annotations

import os
import re
import time
from contextlib import suppress
from typing import TYPE_CHECKING

from odscen.base.system_errors import disk_errors
from odscen.base.to_disk import replace_by

if TYPE_CHECKING:
    from pathlib import Path


_PART = re.compile(r"\..+\.(\d+)\.part")
_IN_THE_MAKING = 2.0
"""Seconds after its last byte in which a file may still be another machine's on a shared disk."""


def write_text(path: Path, text: str) -> Path:
    """Write a text file, UTF-8, as :func:`write_file` does."""
    return write_file(path, text)


def write_file(path: Path, content: str | bytes) -> Path:
    """Write a file whole or not at all; its folder is made if need be.

    Returns
    -------
    Path
        ``path``.

    Raises
    ------
    WorkspaceError
        If it cannot be written.
    """
    with disk_errors(str(path)):
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_by(path, path.with_name(f".{path.name}.{os.getpid()}.part"), content)
    return path


def clear_parts(folder: Path) -> None:
    """Remove what processes that were killed have left of files, in all of a folder."""
    for part in folder.rglob(".*.part"):
        match = _PART.fullmatch(part.name)
        with suppress(OSError):
            if (
                match is not None
                and time.time() - part.stat().st_mtime > _IN_THE_MAKING
                and not _process_exists(int(match[1]))
            ):
                part.unlink()


def _process_exists(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:  # somebody else's
        pass
    return True
