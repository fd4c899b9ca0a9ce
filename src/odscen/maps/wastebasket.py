"""The wastebasket: maps, scenarios and runs that were removed, kept for 30 days.

It lies beside what it was filled from (``maps/.trash``, ``scenarios/.trash``, ``runs/.trash``), so
that removing and restoring are one rename each, also where a folder is a link to another disk. An
item is a folder that says in its name what kind it is of and when it was removed; no other file
has to be read, or can be damaged.
"""

from __future__ import annotations

import re
import secrets
import shutil
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Literal

from odscen.base.atomic_folders import discard
from odscen.base.errors import ConflictError, NotFoundError
from odscen.base.folder_locks import locked
from odscen.base.system_errors import disk_errors
from odscen.maps.background import BACKGROUNDS
from odscen.maps.folder_names import check_name

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from odscen.maps.store import Workspace

RemovedKind = Literal["map", "scenario", "run"]
KEPT = timedelta(days=30)
"""How long an item can be restored."""
FOLDER = ".trash"
SCENARIO_SUFFIX = ".scenario.json"
"""Ending of scenario files."""
HISTORY = ".history"
"""Folder beside scenarios with what undo goes back to, and inside a removed scenario."""
_COMPANIONS: dict[str, str] = {"scenario": HISTORY, "map": BACKGROUNDS}
"""What goes along with what is removed."""

_ID = re.compile(r"(map|scenario|run)-(\d{8}-\d{6})-[0-9a-f]{8}")
_STAMP = "%Y%m%d-%H%M%S"
_UNFINISHED = timedelta(hours=1)
"""Age from which an item without content is what a killed process has left."""


@dataclass(frozen=True, slots=True)
class RemovedItem:
    """Something in the wastebasket.

    Attributes
    ----------
    id
        To restore it by.
    kind
        Of what it was.
    name
        That it had, and is restored with.
    removed
        When, UTC.
    folder
        Its folder.
    """

    id: str
    kind: RemovedKind
    name: str
    removed: datetime
    folder: Path

    @property
    def until(self) -> datetime:
        """When it is deleted for good, UTC."""
        return self.removed + KEPT

    @property
    def content(self) -> Path:
        """The map's or run's folder, or the scenario's file."""
        return self.folder / (self.name + (SCENARIO_SUFFIX if self.kind == "scenario" else ""))

    def size(self) -> int:
        """Bytes that it takes on the disk."""
        sizes = []
        for path in self.folder.rglob("*"):
            with suppress(OSError):
                sizes.append(path.lstat().st_size)
        return sum(sizes)


class Wastebasket:
    """What was removed from a workspace."""

    def __init__(self, workspace: Workspace) -> None:
        self._folders: dict[RemovedKind, Path] = {
            "map": workspace.root / "maps",
            "scenario": workspace.scenarios,
            "run": workspace.runs,
        }

    def put(self, kind: RemovedKind, name: str) -> RemovedItem:
        """Remove something; what is too old in the wastebasket is deleted at this opportunity.

        Raises
        ------
        NotFoundError
            If there is no such thing.
        ConflictError
            If another process builds it, or runs it.
        WorkspaceError
            If it cannot be moved.
        """
        place = self._place_of(kind, name)
        if not place.exists():
            raise NotFoundError(kind, name, [])
        removed = datetime.now(UTC).replace(microsecond=0)
        own = f"{kind}-{removed:{_STAMP}}-{secrets.token_hex(4)}"
        item = RemovedItem(own, kind, name, removed, self._folders[kind] / FOLDER / own)
        held = nullcontext() if kind == "scenario" else locked(place, what=f"{kind} {name!r}")
        with held, disk_errors(f"{kind} {name!r}"):
            item.folder.mkdir(parents=True)
            place.rename(item.content)
            if kind in _COMPANIONS:
                _move_folder(self._find_companion(kind, name), item.folder / _COMPANIONS[kind])
        self.sweep()
        return item

    def items(self) -> list[RemovedItem]:
        """Everything in the wastebasket, removed last first."""
        kept_items = [
            item for folder in self._list_folders() if (item := _read_item(folder)) is not None
        ]
        return sorted(kept_items, key=lambda item: (item.removed, item.id), reverse=True)

    def item(self, id_: str) -> RemovedItem:
        """One item by its id, or by its name where only one of that name is here.

        Raises
        ------
        NotFoundError
            If there is none.
        ConflictError
            If several have that name.
        """
        items = self.items()
        matching = [item for item in items if item.id == id_] or [
            item for item in items if item.name == id_
        ]
        if not matching:
            raise NotFoundError(
                "item of the wastebasket",
                id_,
                [name for item in items for name in (item.id, item.name)],
            )
        if len(matching) > 1:
            ids = ", ".join(item.id for item in matching)
            raise ConflictError(
                f"several items of the wastebasket are named {id_!r}; say which: {ids}"
            )
        return matching[0]

    def restore(self, id_: str) -> RemovedItem:
        """Put an item back where it was.

        Raises
        ------
        NotFoundError
            If there is none.
        ConflictError
            If something of that name has come into its place.
        WorkspaceError
            If it cannot be moved.
        """
        item = self.item(id_)
        place = self._place_of(item.kind, item.name)
        if place.exists():
            raise ConflictError(
                f"there is another {item.kind} named {item.name!r} now; "
                "rename or remove that one, then restore this one"
            )
        with disk_errors(f"{item.kind} {item.name!r}"):
            if item.kind in _COMPANIONS:
                companion = self._find_companion(item.kind, item.name)
                with suppress(FileNotFoundError):  # of a namesake that is gone
                    discard(companion)
                _move_folder(item.folder / _COMPANIONS[item.kind], companion)
            item.content.rename(place)
            shutil.rmtree(item.folder)
        return item

    def delete(self, id_: str) -> RemovedItem:
        """Delete an item for good; errors as of :meth:`restore`."""
        item = self.item(id_)
        with disk_errors(f"{item.kind} {item.name!r}"):
            discard(item.folder)
        return item

    def sweep(self, now: datetime | None = None) -> None:
        """Delete what is here for longer than 30 days at ``now`` (UTC), and leftovers."""
        now = now or datetime.now(UTC)
        for folder in self._list_folders():
            item, removed = _read_item(folder), _time_of_removal(folder)
            if now - removed > (KEPT if item is not None else _UNFINISHED):
                with suppress(OSError):  # another process was faster, or the next time
                    shutil.rmtree(folder)

    def _list_folders(self) -> Iterator[Path]:
        for kind, parent in self._folders.items():
            with suppress(OSError):
                for folder in sorted((parent / FOLDER).iterdir()):
                    match = _ID.fullmatch(folder.name)
                    if match is not None and match[1] == kind:
                        yield folder

    def _place_of(self, kind: RemovedKind, name: str) -> Path:
        ending = SCENARIO_SUFFIX if kind == "scenario" else ""
        return self._folders[kind] / (check_name(name, what=kind) + ending)

    def _find_companion(self, kind: RemovedKind, name: str) -> Path:
        return self._folders[kind] / _COMPANIONS[kind] / name


def _read_item(folder: Path) -> RemovedItem | None:
    """The item in a folder; ``None`` if its content never came, or has left."""
    match = _ID.fullmatch(folder.name)
    if match is None:
        return None
    kind: RemovedKind = match[1]  # type: ignore[assignment] # the pattern has the same words
    ending = SCENARIO_SUFFIX if kind == "scenario" else ""
    with suppress(OSError):
        for path in folder.iterdir():
            if path.name not in _COMPANIONS.values() and path.name.endswith(ending):
                name = path.name.removesuffix(ending)
                return RemovedItem(folder.name, kind, name, _time_of_removal(folder), folder)
    return None


def _time_of_removal(folder: Path) -> datetime:
    match = _ID.fullmatch(folder.name)
    try:
        return datetime.strptime(match[2] if match else "", _STAMP).replace(tzinfo=UTC)
    except ValueError:  # digits that are no date: not of ours, and as old as can be
        return datetime.min.replace(tzinfo=UTC)


def _move_folder(source: Path, target: Path) -> None:
    """Move a folder, if it is there."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with suppress(FileNotFoundError):
        source.rename(target)
