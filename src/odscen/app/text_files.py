"""Writing a text file whole or not at all."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from odscen.errors import WorkspaceError

if TYPE_CHECKING:
    from pathlib import Path


def write_text(path: Path, text: str) -> Path:
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
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(f".{path.name}.{os.getpid()}.part")
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as error:
        msg = f"{path}: {error.strerror or error}"
        raise WorkspaceError(msg) from error
    return path
