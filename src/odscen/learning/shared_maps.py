"""Arrays of runs whose map lies in a file of its own, which several runs share."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from odscen.base.checksums import digest
from odscen.base.errors import InputError
from odscen.base.given_arrays import MOST_UNPACKED, arrays_from_npz
from odscen.base.given_files import read_given

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from odscen.base.given_arrays import Array

LIGHT_VERSION: Final = 2
"""Of arrays of a run that name their map in place of having it."""
_MAP_FORMAT: Final = ("odscen-map-arrays", 1)
_FILE: Final = re.compile(r"maps/[^./\\\x00][^/\\\x00]*\.npz")
_DIGEST: Final = re.compile(r"[0-9a-f]{64}")
_OF_MAPS: Final = ("node", "walk", "lane", "line", "road_edge", "crosswalk")


class NamedMap(NamedTuple):
    """The map that a run names: a file relative to the folder of the run, and its SHA-256."""

    file: str
    sha256: str


def about_of(arrays: Mapping[str, Array], name: str = "about") -> dict[str, Any] | None:
    """What arrays say of themselves, if they do."""
    try:
        about = json.loads(str(arrays[name]))
        return dict(about)
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


def named_map(arrays: Mapping[str, Array], *, file: str) -> NamedMap | None:
    """The map that arrays of a run name; ``None`` if they have it.

    Raises
    ------
    InputError
        If they name something else than a file in a folder ``maps``.
    """
    about = about_of(arrays) or {}
    if about.get("version") != LIGHT_VERSION:
        return None
    named, sha256 = about.get("map_file"), about.get("map_file_sha256")
    if not isinstance(named, str) or not _FILE.fullmatch(named):
        raise InputError(
            f"map_file is {named!r}, not a file in maps/", file=file, element="array about"
        )
    if not isinstance(sha256, str) or not _DIGEST.fullmatch(sha256):
        raise InputError(
            f"map_file_sha256 is {sha256!r}, not a SHA-256", file=file, element="array about"
        )
    return NamedMap(named, sha256)


def read_shared_map(folder: Path, named: NamedMap, *, run: str) -> dict[str, Array]:
    """Read the arrays of a map.

    Parameters
    ----------
    folder
        That the name is relative to.
    run
        File of the run that names it, for messages.

    Raises
    ------
    InputError
        If it is not there, not the one that the run was written with, or malformed.
    """
    path = folder / named.file
    if not path.is_file():
        raise InputError(f"its map {named.file} is not there; it belongs to {folder}", file=run)
    content = read_given(path, most=MOST_UNPACKED)
    return shared_map_arrays(content, named, file=str(path), run=run)


def shared_map_arrays(content: bytes, named: NamedMap, *, file: str, run: str) -> dict[str, Array]:
    """Arrays of the content of a file of a map.

    Raises
    ------
    InputError
        If it is not the one that the run was written with, or malformed.
    """
    if digest(content) != named.sha256:
        raise InputError(
            f"its map {named.file} is not the one that it was written with: the SHA-256 is "
            f"{digest(content)}, not {named.sha256}",
            file=run,
        )
    arrays = arrays_from_npz(content, file=file)
    about = about_of(arrays, "map_about") or {}
    if (about.get("format"), about.get("version")) != _MAP_FORMAT:
        raise InputError("these are no arrays of a map", file=file)
    return {
        name: values
        for name, values in arrays.items()
        if any(name == kind or name.startswith(f"{kind}_") for kind in _OF_MAPS)
    }
