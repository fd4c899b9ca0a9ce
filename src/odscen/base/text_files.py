"""Writing a file whole or not at all."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from odscen.base.system_errors import disk_errors
from odscen.base.to_disk import replace_by

if TYPE_CHECKING:
    from pathlib import Path


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
