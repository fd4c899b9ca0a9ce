"""Damaged maps and assets of a workspace: built anew from the .xodr, or set aside.

Part of :mod:`odscen.app.doctor`.
"""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from itertools import chain, count
from typing import TYPE_CHECKING, Any, Literal

from odscen.base.checksums import SUMS_FILE, check_files, file_digest, sums_of, write_sums
from odscen.base.errors import DamagedError, InputError, OdscenError
from odscen.maps.map_entry import INFO_FILE, XODR_FILE, read_entry
from odscen.simulators.assets import BLUEPRINTS_FILE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from odscen.base.errors import DamagedFile
    from odscen.maps.map_entry import MapEntry
    from odscen.maps.store import Workspace

SET_ASIDE = "damaged"
"""Folder of a workspace, or beside a run, with what could not be rebuilt."""

NO_SUMS = "it has no checksums, as of earlier versions"

Action = Literal["found", "rebuilt", "sealed", "set aside"]


@dataclass(frozen=True, slots=True)
class RepairStep:
    """One finding, and what was done about it.

    Attributes
    ----------
    what
        ``map``, ``run``, ``recording``, ``background`` or ``assets``.
    name
        Of it.
    action
        ``found`` (nothing was to be repaired), ``rebuilt``, ``sealed`` (it had no checksums, and
        has now) or ``set aside``.
    words
        Which files, and what was done.
    place
        Where it was set aside.
    """

    what: str
    name: str
    action: Action
    words: str
    place: str | None = None

    @property
    def harm(self) -> bool:
        """Whether something is damaged, or lost."""
        return self.action == "set aside" or (self.action == "found" and self.words != NO_SUMS)

    def to_dict(self) -> dict[str, Any]:
        """As data."""
        return asdict(self)


def see_to_assets(workspace: Workspace, *, repair: bool) -> Iterator[RepairStep]:
    """Yield a step if the catalogue of models is damaged; the models that ship stand in for it."""
    try:
        workspace.assets()
    except OdscenError as error:
        step = RepairStep("assets", BLUEPRINTS_FILE, "found", str(error))
        if repair:
            place = set_aside(workspace.assets_folder / BLUEPRINTS_FILE, workspace.root)
            words = f"{error}; the models that ship are used"
            step = replace(step, action="set aside", words=words, place=str(place))
        yield step


def see_to_folder(
    workspace: Workspace, what: str, folder: Path, *, repair: bool
) -> Iterator[RepairStep]:
    """Yield a step if a folder is damaged that nothing can make anew: it is set aside."""
    try:
        check_files(folder)
    except DamagedError as error:
        step = RepairStep(what, folder.name, "found", listed(error.files))
        if repair:
            place = set_aside(folder, workspace.root)
            step = replace(step, action="set aside", place=str(place))
        yield step


def see_to_map(workspace: Workspace, name: str, *, repair: bool) -> Iterator[RepairStep]:
    """Yield a step if a map is damaged, or has no checksums."""
    folder = workspace.root / "maps" / name
    words = _map_damage(folder)
    if words is None:
        if not (folder / SUMS_FILE).is_file():
            if repair:
                write_sums(folder, sums_of(folder))
            done: Action = "sealed" if repair else "found"
            yield RepairStep("map", name, done, NO_SUMS)
        return
    step = RepairStep("map", name, "found", words)
    if repair:
        step = _rebuild_map(workspace, folder, step)
    yield step


def _map_damage(folder: Path) -> str | None:
    try:
        damaged: Sequence[DamagedFile] = read_entry(folder).damaged()
    except DamagedError as error:
        damaged = error.files
    return listed(damaged) if damaged else None


def _rebuild_map(workspace: Workspace, folder: Path, step: RepairStep) -> RepairStep:
    """Build a map anew from its .xodr, if that is as it was written."""
    try:
        entry, usual = _built_anew(workspace, folder)
    except OdscenError as error:
        place = set_aside(folder, workspace.root)
        return replace(step, action="set aside", words=f"{step.words}; {error}", place=str(place))
    how = "; with the usual settings, as its own are lost" if usual else ""
    words = f"{step.words}; built from {entry.path(entry.source_key).name}{how}"
    return replace(step, action="rebuilt", words=words)


def _built_anew(workspace: Workspace, folder: Path) -> tuple[MapEntry, bool]:
    """Build a map anew; also whether with the usual settings, for want of its own."""
    xodr, digests = folder / XODR_FILE, _find_source_digests(folder)

    def is_intact(file: Path) -> bool:
        return file.is_file() and file_digest(file) in digests

    try:
        entry = read_entry(folder)
    except DamagedError:
        entry = None
    if entry is not None and entry.converter == "file" and is_intact(xodr):
        raise InputError("its network was brought in: add the map, then the network again")
    # A map of another format is imported again, if its original file is as it was written.
    if entry is not None and "import" in entry.info and is_intact(entry.path("original")):
        rebuilt = workspace.add_map_content(
            entry.path("original").read_bytes(),
            file=str(entry.info["source"]),
            name=folder.name,
            settings=entry.conversion,
            importing=entry.importing,
        )
        return rebuilt, False
    if not is_intact(xodr):
        raise InputError(f"its {XODR_FILE} is not as it was written, either")
    if entry is None:
        return workspace.add_map(xodr, name=folder.name), True
    return workspace.add_map(xodr, name=folder.name, settings=entry.conversion), False


def _find_source_digests(folder: Path) -> set[str]:
    """SHA-256 of the files that a map is built from, wherever its folder says it.

    A damaged list or ``map.json`` may be asked, too: no damage makes it name the file's own.
    """
    digests = set()
    for name in (SUMS_FILE, INFO_FILE):
        with suppress(OSError):
            text = (folder / name).read_text(encoding="utf-8", errors="replace")
            digests |= set(re.findall(r"\b[0-9a-f]{64}\b", text))
    return digests


def set_aside(path: Path, root: Path) -> Path:
    """Move something damaged into :data:`SET_ASIDE` of ``root``, under a name that is free."""
    place = root / SET_ASIDE
    if path.parent != root:
        place /= path.parent.name
    place.mkdir(parents=True, exist_ok=True)
    names = chain([path.name], (f"{path.name}-{number}" for number in count(2)))
    target = next(place / name for name in names if not (place / name).exists())
    path.rename(target)
    return target


def listed(damaged: Sequence[DamagedFile]) -> str:
    """Damaged files in a line."""
    return "; ".join(map(str, damaged))
