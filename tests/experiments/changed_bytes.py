"""Bytes of stored files that are changed one after the other, for tests of who notices."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator
    from pathlib import Path


def stored_files(folder: Path, *, leave: Collection[str] = ()) -> list[str]:
    """Files of a folder and below by their path in it, but those left out by name or folder."""
    names = (path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    return sorted(
        name for name in names if name not in leave and name.partition("/")[0] not in leave
    )


@contextmanager
def changed_byte(file: Path, *, share: float, bit: int = 0x01) -> Iterator[None]:
    """Change a bit of the byte at a share of a file's length, 0 is the first; then put it back."""
    content = file.read_bytes()
    place = min(int(share * len(content)), len(content) - 1)
    changed = bytearray(content)
    changed[place] ^= bit
    file.unlink()  # the network of a run is a link to the map's
    file.write_bytes(changed)
    try:
        yield
    finally:
        file.write_bytes(content)
