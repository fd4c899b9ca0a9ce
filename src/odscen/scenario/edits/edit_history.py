"""Where a document is in its edits: what undo and redo lead to, and a version that only grows."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace

MOST_UNDONE = 200
"""Edits that can be undone."""


@dataclass(frozen=True, slots=True)
class HistoryEntry:
    """A document after an edit.

    Attributes
    ----------
    label
        The edit in words.
    file
        Name of the document among all of the history; those of later edits sort behind.
    """

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
        Of the document as it is now, hexadecimal; by it a file that was changed is told.
    entries
        Oldest first; the one at ``position`` is the document now.
    """

    version: int
    sha256: str
    entries: tuple[HistoryEntry, ...]
    position: int

    @property
    def current(self) -> HistoryEntry:
        """The document now."""
        return self.entries[self.position]

    @property
    def label(self) -> str:
        """The edit that has led here."""
        return self.current.label

    @property
    def undo(self) -> str | None:
        """The edit that undo would take back."""
        return self.label if self.position > 0 else None

    @property
    def redo(self) -> str | None:
        """The edit that redo would make again."""
        after = self.position + 1
        return self.entries[after].label if after < len(self.entries) else None

    def add(self, text: str, *, label: str) -> History:
        """Add a document; those that could be made again are forgotten, and the oldest ones."""
        version = self.version + 1
        kept = self.entries[: self.position + 1][-MOST_UNDONE:]
        entries = (*kept, HistoryEntry(label, f"{version:08d}.json.z"))
        return History(version, document_sha256(text), entries, len(entries) - 1)

    def move(self, step: int, text: str) -> History:
        """Go one edit back (-1) or forth (+1), to the document ``text``."""
        return replace(
            self,
            version=self.version + 1,
            sha256=document_sha256(text),
            position=self.position + step,
        )


NO_HISTORY = History(0, "", (), -1)
"""Of a document that is not there yet."""


def open_history(known: History | None, text: str) -> History:
    """Continue the history that is known of a document, or begin one.

    A document that another program has changed becomes an entry of its own.
    """
    if known is None:
        return NO_HISTORY.add(text, label="Open")
    if known.sha256 != document_sha256(text):
        return known.add(text, label="Change by another program")
    return known


def document_sha256(text: str) -> str:
    """Hash by which a document is told from others, hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()
