"""Names of maps, scenarios, sweeps and studies, which become names of folders and files."""

from __future__ import annotations

import re
from pathlib import PurePath
from typing import TYPE_CHECKING

from odscen.base.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

_PACKED = (".gz", ".bz2", ".pbf")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")


def check_name(name: str, *, what: str = "map") -> str:
    """Return ``name`` if it can name a folder everywhere, else raise :class:`InputError`."""
    if not _NAME.fullmatch(name):
        raise InputError(
            f"{what} name {name!r} cannot be used: letters, digits, '_', '-' and '.', "
            "starting with a letter or digit, at most 64"
        )
    return name


def is_name(name: str) -> bool:
    """Whether :func:`check_name` takes it."""
    return _NAME.fullmatch(name) is not None


def name_from_file(path: Path) -> str:
    """Map name for a file: its stem, with everything unusual replaced by ``_``.

    Of a packed file it is the stem of what is packed: ``town`` for ``town.osm.bz2``.
    """
    stem = path.stem
    if path.suffix.lower() in _PACKED and PurePath(stem).suffix.lower() == ".osm":
        stem = PurePath(stem).stem
    return plain_name(stem) or "map"


def plain_name(text: str) -> str:
    """Text as it can name a folder everywhere, perhaps empty: the unusual replaced by ``_``."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", text).strip("._-")[:64]
