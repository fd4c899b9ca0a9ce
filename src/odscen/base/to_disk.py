"""Files and folders brought to the disk, so that a rename promises what it says.

Without this, a power cut after a rename can leave a file of the right name and no content.
"""

from __future__ import annotations

import os
from pathlib import Path


def to_disk(path: Path) -> None:
    """Wait until a file, or what a folder lists, is on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def all_to_disk(folder: Path) -> None:
    """Wait until everything in a folder and below is on the disk: files, then their folders."""
    for place, _, files in os.walk(folder, topdown=False):
        for name in files:
            to_disk(Path(place) / name)
        to_disk(Path(place))


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
