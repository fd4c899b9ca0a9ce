"""What of an experiment has ended: a journal of rows, or the run folders where all are kept.

A journal is added to as runs end, and moved to parts.

Each row carries the beginning of its own SHA-256, so that a byte that has changed shows.

A row is there whole or not at all: the last line of a journal whose process was killed may be torn,
and is left out. A run that stands in a part and in the journal, as its process was killed between
the two, counts once.
"""

from __future__ import annotations

import os
import re
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final, Self

import orjson

from odscen.base.checksums import SUMS_FILE, digest
from odscen.base.errors import InputError
from odscen.base.text_files import write_file
from odscen.base.to_disk import to_disk

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path
    from types import TracebackType
    from typing import BinaryIO

JOURNAL_FILE: Final = "journal.jsonl"
PARTS_FOLDER: Final = "rows"
PART_ROWS: Final = 20_000
"""Rows after which the journal is moved to a part."""
_EVERY: Final = 1.0
"""Wall seconds after which rows are brought to the disk at the latest."""

_SUM: Final = re.compile(rb',"sum":"([0-9a-f]{16})"\}')
_WHOLE: Final = re.compile(rb',"sum":"[0-9a-f]{16}".')

Rows = dict[str, dict[str, Any]]


def read_rows(folder: Path) -> Rows:
    """Every run that has ended, by name, in the order in which they ended.

    Raises
    ------
    InputError
        If a file is not as it was written.
    """
    rows: Rows = {}
    sealed = (folder / SUMS_FILE).is_file()  # earlier versions wrote rows without checksums
    for part in sorted((folder / PARTS_FOLDER).glob("part-*.jsonl")):
        _take_rows(rows, part.read_bytes(), part, sealed=sealed)
    journal = folder / JOURNAL_FILE
    with suppress(FileNotFoundError):
        content = journal.read_bytes()
        whole = content.rfind(b"\n") + 1
        # One that was torn by a kill ends before its checksum does.
        torn = content if sealed and _WHOLE.search(content, whole) else content[:whole]
        _take_rows(rows, torn, journal, sealed=sealed)
    return rows


def row_line(name: str, row: Mapping[str, Any]) -> bytes:
    """Line of a row with its checksum as the last field."""
    text = orjson.dumps({"run": name, **row})
    return text[:-1] + b',"sum":"' + digest(text).encode()[:16] + b'"}\n'


def _take_rows(rows: Rows, content: bytes, file: Path, *, sealed: bool) -> None:
    lines = content.removesuffix(b"\n").split(b"\n") if content else []
    for number, line in enumerate(lines, start=1):
        try:
            if sealed:
                match = _SUM.fullmatch(line, max(len(line) - 26, 0))
                text = line[: len(line) - 26] + b"}"
                if match is None or match[1] != digest(text).encode()[:16]:
                    raise ValueError("it is not as it was written")
                line = text  # noqa: PLW2901
            row = orjson.loads(line)
            row.pop("sum", None)
            rows.setdefault(row.pop("run"), row)
        except (ValueError, KeyError, AttributeError, TypeError) as error:
            raise InputError(
                f"line {number} is no row of a study: {error}", file=str(file)
            ) from error


class KeptRuns:
    """Run folders that all stay, as of a sweep: they say by themselves which runs have ended."""

    def __init__(self, ended: Iterable[str] = ()) -> None:
        self._ended = set(ended)

    def __contains__(self, name: object) -> bool:
        return name in self._ended

    def __len__(self) -> int:
        return len(self._ended)

    def add(self, name: str, row: Mapping[str, Any]) -> bool:
        """Take a run as ended; its folder is there."""
        del row
        self._ended.add(name)
        return True


class StudyJournal:
    """The rows of a study, open for more; hold the lock of the study.

    Attributes
    ----------
    rows
        All of them by the name of the run.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.rows = read_rows(folder)
        self._file: BinaryIO | None = None
        self._lines = 0
        self._synced = 0.0

    def __enter__(self) -> Self:
        path = self._folder / JOURNAL_FILE
        path.touch()
        content = path.read_bytes()
        whole = content.rfind(b"\n") + 1
        self._lines = content.count(b"\n")
        self._file = path.open("r+b")
        self._file.truncate(whole)
        self._file.seek(whole)
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        _error: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        if self._file is not None:
            self._sync_to_disk()
            self._file.close()

    def __contains__(self, name: object) -> bool:
        return name in self.rows

    def __len__(self) -> int:
        return len(self.rows)

    def add(self, name: str, row: Mapping[str, Any]) -> bool:
        """Write down a run that has ended; ``False`` if it was there, which changes nothing."""
        if name in self.rows or self._file is None:
            return False
        self.rows[name] = dict(row)
        self._file.write(row_line(name, row))
        self._file.flush()  # a killed process loses nothing; a power cut at most a second
        self._lines += 1
        if self._lines >= PART_ROWS:
            self._move_journal()
        elif time.monotonic() - self._synced > _EVERY:
            self._sync_to_disk()
        return True

    def forget(self, names: Iterable[str]) -> None:
        """Take rows out, so that their runs are run again; before anything is added."""
        gone = set(names)
        if not gone or self._file is None:
            return
        self.rows = {name: row for name, row in self.rows.items() if name not in gone}
        parts = sorted((self._folder / PARTS_FOLDER).glob("part-*.jsonl"))
        self._write_part(b"".join(row_line(name, row) for name, row in self.rows.items()))
        for part in parts:  # after the new one, which has their rows
            part.unlink()
        self._empty_journal()

    def _move_journal(self) -> None:
        self._sync_to_disk()
        self._write_part((self._folder / JOURNAL_FILE).read_bytes())
        self._empty_journal()

    def _write_part(self, content: bytes) -> None:
        folder = self._folder / PARTS_FOLDER
        numbers = [int(path.stem.rpartition("-")[2]) for path in folder.glob("part-*.jsonl")]
        write_file(folder / f"part-{max(numbers, default=0) + 1:06d}.jsonl", content)

    def _empty_journal(self) -> None:
        if self._file is not None:
            self._file.seek(0)
            self._file.truncate()
            self._lines = 0
            self._sync_to_disk()

    def _sync_to_disk(self) -> None:
        if self._file is not None:
            self._file.flush()
            os.fsync(self._file.fileno())
            self._synced = time.monotonic()
            to_disk(self._folder)
