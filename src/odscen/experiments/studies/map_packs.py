"""Maps that travel: a map as it was built and the assets, packed, and named by their content.

A worker on another machine unpacks each once, as a workspace of one map in a folder of its own.
"""

from __future__ import annotations

import io
import os
import tarfile
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from odscen.base.atomic_folders import new_folder
from odscen.base.checksums import digest
from odscen.base.folder_locks import locked
from odscen.experiments.studies.study_work import member, unpacked
from odscen.maps.store import Workspace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.maps.map_entry import MapEntry

CACHE_VARIABLE: Final = "ODSCEN_CACHE"
_PATIENCE: Final = 120.0
_LEVEL: Final = 6


@dataclass(frozen=True, slots=True)
class MapPack:
    """A map and the assets as one file.

    Attributes
    ----------
    sha256
        Of the files in it, hexadecimal.
    content
        Compressed.
    """

    sha256: str
    content: bytes


def pack_map(workspace: Workspace, entry: MapEntry) -> MapPack:
    """Pack a map with the assets of its workspace; equal files give an equal pack."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for name, path in _files(workspace, entry):
            content = path.read_bytes()
            archive.addfile(member(name, len(content)), io.BytesIO(content))
    whole = buffer.getvalue()
    return MapPack(digest(whole), zlib.compress(whole, _LEVEL))


def _files(workspace: Workspace, entry: MapEntry) -> Iterator[tuple[str, Path]]:
    for root, prefix in ((entry.folder, f"maps/{entry.name}"), (workspace.assets_folder, "assets")):
        for path in sorted(root.rglob("*")) if root.is_dir() else ():
            if path.is_file():
                yield f"{prefix}/{path.relative_to(root).as_posix()}", path


def cache_folder() -> Path:
    """Where packs are unpacked: ``$ODSCEN_CACHE``, else the user's cache folder."""
    given = os.environ.get(CACHE_VARIABLE)
    if given:
        return Path(given)
    from platformdirs import user_cache_path

    return user_cache_path("odscen", appauthor=False)


def unpack_map(pack: MapPack) -> Workspace:
    """The workspace of a pack, unpacked if it is not there yet.

    Raises
    ------
    WorkspaceError
        If it cannot be written.
    """
    folder = cache_folder() / "packs" / pack.sha256
    if not folder.is_dir():
        with locked(folder, what=f"map pack {pack.sha256[:12]}", patience=_PATIENCE):
            if not folder.is_dir():
                with new_folder(folder) as part:
                    unpacked(zlib.decompress(pack.content), part)
    return Workspace(folder)
