"""Folders that appear whole or not at all."""

from __future__ import annotations

import shutil
import tempfile
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.base.errors import WorkspaceError

if TYPE_CHECKING:
    from collections.abc import Iterator

_ATTEMPTS = 20


@contextmanager
def new_folder(final: Path) -> Iterator[Path]:
    """Yield an empty folder that is renamed to ``final`` when the block succeeds.

    It lies beside ``final``, so that the rename is one step; whatever ``final`` held is replaced.
    If the block raises, nothing is left of the new folder and ``final`` is untouched.
    """
    final.parent.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix=".building-", dir=final.parent))
    folder.chmod(0o755)  # mkdtemp makes it private, which a finished map or run need not be
    try:
        yield folder
        _put(folder, final)
    finally:
        with suppress(OSError):
            shutil.rmtree(folder)


def discard(folder: Path) -> None:
    """Take a folder out of sight in one step, then delete it."""
    grave = Path(tempfile.mkdtemp(prefix=".removed-", dir=folder.parent))
    try:
        folder.rename(grave / folder.name)
    finally:
        shutil.rmtree(grave)


def _put(folder: Path, final: Path) -> None:
    """Rename ``folder`` to ``final``; the last of several processes that do so at a time wins."""
    for _ in range(_ATTEMPTS):
        with suppress(FileNotFoundError):
            discard(final)
        try:
            folder.rename(final)
        except OSError:
            if not final.exists():  # not that another process was faster
                raise
        else:
            return
    msg = f"{final} is written by other processes all the time"
    raise WorkspaceError(msg)
