"""Maps of baselines, kept beside them, so that a later run can say what has changed on the map."""

from __future__ import annotations

import gzip
import zlib
from typing import TYPE_CHECKING

from odscen.base.errors import OdscenError
from odscen.base.text_files import write_file
from odscen.changes.map_differences import map_differences
from odscen.opendrive.parse import parse
from odscen.opendrive.parse_rules import MAX_BYTES

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.changes.map_change import MapChange
    from odscen.maps.map_entry import MapEntry
    from odscen.opendrive.road_model import OpenDrive

FOLDER = "maps"
_NAMED = 2


def keep_map(baselines: Path, entry: MapEntry, digest: str) -> None:
    """Keep the OpenDRIVE text of a map, compressed; a map that is kept already is left alone."""
    file = _file(baselines, digest)
    if not file.is_file():
        write_file(file, gzip.compress(entry.read("xodr"), mtime=0))


def changes_since(baselines: Path, digest: str, entry: MapEntry) -> tuple[MapChange, ...] | None:
    """What has changed on a map since the baseline; ``None`` where its map is not kept.

    Parameters
    ----------
    baselines
        Folder of the baseline.
    digest
        ``map`` of the baseline's fingerprint.
    entry
        The map of now.
    """
    before = _kept(_file(baselines, digest), digest)
    if before is None:
        return None
    return map_differences(before, parse(entry.read("xodr"), file=entry.path("xodr").name))


def change_words(changes: tuple[MapChange, ...]) -> str:
    """The first differences in words, and how many more there are."""
    if not changes:
        return "the map is written otherwise, but means the same"
    said = "; ".join(one.words for one in changes[:_NAMED])
    more = len(changes) - _NAMED
    return f"the map: {said}" + (f"; and {more} more" if more > 0 else "")


def _file(baselines: Path, digest: str) -> Path:
    return baselines / FOLDER / f"{digest}.xodr.gz"


def _kept(file: Path, digest: str) -> OpenDrive | None:
    """A map that was kept; one that is damaged or missing tells nothing, and fails nothing."""
    try:
        with gzip.open(file) as stream:
            text = stream.read(MAX_BYTES)
        return parse(text, file=file.name) if digest else None
    except (OSError, EOFError, zlib.error, OdscenError):
        return None
