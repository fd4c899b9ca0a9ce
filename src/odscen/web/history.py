"""The edits of one scenario, kept on disk: what undo goes back to, and a version that only grows.

A folder holds one packed document per edit and an index; an edit writes one small file and the
index, whatever the length of the history. A document that was changed by another program is found
by its hash and becomes an entry of its own.
"""

from __future__ import annotations

import hashlib
import json
import shutil
import zlib
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from odscen.app.text_files import write_text
from odscen.scenario.files import loads

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document import Scenario

DEPTH = 200
"""Edits that can be undone."""
INDEX = "index.json"


@dataclass(frozen=True, slots=True)
class Entry:
    """A document after an edit; ``file`` in the history's folder holds it."""

    label: str
    file: str


@dataclass(frozen=True, slots=True)
class History:
    """Where a scenario is in its edits.

    Attributes
    ----------
    version
        Grows with every change, undo and redo included.
    sha256
        Of the scenario's file, hexadecimal.
    entries
        Oldest first; the one at ``position`` is the document now.
    """

    version: int
    sha256: str
    entries: tuple[Entry, ...]
    position: int

    @property
    def label(self) -> str:
        """The edit that has led here."""
        return self.entries[self.position].label

    @property
    def undo(self) -> str | None:
        """The edit that undo would take back."""
        return self.entries[self.position].label if self.position > 0 else None

    @property
    def redo(self) -> str | None:
        """The edit that redo would make again."""
        after = self.position + 1
        return self.entries[after].label if after < len(self.entries) else None


def first(text: str, folder: Path, *, label: str) -> History:
    """Begin the history of a document."""
    shutil.rmtree(folder, ignore_errors=True)
    return grown(History(0, "", (), -1), text, folder, label=label)


def grown(history: History, text: str, folder: Path, *, label: str) -> History:
    """Add a document; those that could be made again are forgotten. Written before it returns."""
    version = history.version + 1
    entry = Entry(label, f"{version:08d}.json.z")
    kept = history.entries[: history.position + 1][-DEPTH:]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / entry.file).write_bytes(zlib.compress(text.encode(), 1))
    for old in set(history.entries) - set(kept):
        with suppress(OSError):
            (folder / old.file).unlink()
    entries = (*kept, entry)
    return _written(History(version, digest(text), entries, len(entries) - 1), folder)


def moved(history: History, step: int, folder: Path) -> tuple[History, str]:
    """Go one edit back (-1) or forth (+1); the new history and the document there."""
    position = history.position + step
    packed = (folder / history.entries[position].file).read_bytes()
    text = zlib.decompress(packed).decode()
    new = History(history.version + 1, digest(text), history.entries, position)
    return _written(new, folder), text


def read(folder: Path) -> History | None:
    """History in a folder; ``None`` if there is none that can be read."""
    try:
        data = json.loads((folder / INDEX).read_text(encoding="utf-8"))
        entries = tuple(Entry(**entry) for entry in data["entries"])
        history = History(int(data["version"]), str(data["sha256"]), entries, data["position"])
        return history if 0 <= history.position < len(entries) else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def digest(text: str) -> str:
    """Hash by which a changed file is found."""
    return hashlib.sha256(text.encode()).hexdigest()


def document(text: str, *, file: str) -> Scenario:
    """Read a document of a workspace.

    Raises
    ------
    ScenarioError
        If it is none.
    """
    return loads(text, file=file)


def _written(history: History, folder: Path) -> History:
    write_text(folder / INDEX, json.dumps(asdict(history)))
    return history
