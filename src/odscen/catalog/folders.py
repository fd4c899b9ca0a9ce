"""Folders that appear whole or not at all."""

from __future__ import annotations

import shutil
import tempfile
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator


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
        if final.exists():
            discard(final)
        folder.rename(final)
    finally:
        with suppress(OSError):
            shutil.rmtree(folder)


def discard(folder: Path) -> None:
    """Take a folder out of sight in one step, then delete it."""
    grave = Path(tempfile.mkdtemp(prefix=".removed-", dir=folder.parent))
    folder.rename(grave / folder.name)
    shutil.rmtree(grave)
