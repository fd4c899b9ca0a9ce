"""Demand from CSV files: zones, matrices, counts and day profiles, read once, at import.

The first line names the columns; further columns are an error, so that a misspelt one does not pass
unnoticed. Times are seconds after the start of the run, or times of day such as ``7:15``.
"""

from __future__ import annotations

import csv
import io
import re
from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

from odscen.base.errors import InputError
from odscen.base.shown import printable, shown
from odscen.scenario.demand.day_profiles import DAY

if TYPE_CHECKING:
    import _csv
    from collections.abc import Iterable, Iterator, Sequence

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
"""As identifiers of the document."""
MOST_ROWS = 500_000
"""Lines of a table: all of them are in memory at a time."""
_TIME_OF_DAY = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2}))?")

MatrixTrip = tuple[str, str, float]
"""Origin, destination, number."""
TimeSlice = tuple[float, float]
"""Begin and end, seconds."""
CountRow = tuple[str, float, float, float]
"""Place, begin, end, number."""

COLUMNS = {
    "od": ("from", "to", "trips"),
    "counts": ("place", "begin", "end", "count"),
    "profile": ("share",),
    "zones": ("segment",),
    "inputs": ("segment",),
}
"""Columns that the values of a row come from, by the kind of table."""

_Row = TypeVar("_Row")


class InputRow(NamedTuple):
    """A line of a table of vehicle inputs; times in seconds after the start of the run."""

    segment: str
    direction: str | None
    begin: float
    interval: float
    volumes: tuple[float, ...]
    line: int


class _WideTable(NamedTuple):
    """Lines of a table with a column for each slice of time, and those columns."""

    lines: Iterator[_TableLine]
    slices: list[tuple[str, TimeSlice]]


class ProfileTable(NamedTuple):
    """Shares of equal slices of the time from ``begin`` to ``end``, seconds after midnight.

    Both are ``None`` where the slices are of the whole day.
    """

    shares: tuple[float, ...]
    begin: float | None
    end: float | None


class Rows(NamedTuple, Generic[_Row]):
    """Rows of a table, and the line of the file that each is on, so that errors can name it."""

    values: tuple[_Row, ...]
    lines: tuple[int, ...]


def read_matrix(text: str, *, clock: float = 0.0) -> dict[TimeSlice | None, Rows[MatrixTrip]]:
    """Read an origin-destination matrix: columns ``from``, ``to``, ``trips``.

    Columns ``begin`` and ``end`` may say when; the trips are then those of each slice. Or a square
    table: origins in the first column, whose title is empty, ``from`` or ``from/to``, destinations
    as titles of the others; empty cells are no trips.

    Returns
    -------
    Rows by their slice; ``None`` where the table has no times.

    Raises
    ------
    InputError
        With the line and the value that cannot be used.
    """
    if square := _read_square_matrix(text):
        return {None: _split_rows(square)}
    found: dict[TimeSlice | None, list[tuple[MatrixTrip, int]]] = {}
    for line in _read_lines(text, COLUMNS["od"], ("begin", "end")):
        slice_ = line.slice(clock) if line.has("begin") else None
        trip = line["from"], line["to"], line.number("trips")
        found.setdefault(slice_, []).append((trip, line.line))
    return {slice_: _split_rows(pairs) for slice_, pairs in found.items()}


def read_counts(text: str, *, clock: float = 0.0) -> Rows[CountRow]:
    """Read counts: columns ``place``, ``begin``, ``end``, ``count``.

    Or a wide table, as counters write it: a column ``place``, then one for each slice of time, with
    its begin as title.

    Raises
    ------
    InputError
        With the line and the value that cannot be used.
    """
    if wide := _read_wide_table(text, ("place",), clock):
        return _split_rows(
            ((line["place"].replace(" ", ""), *slice_, line.number(column)), line.line)
            for line in wide.lines
            for column, slice_ in wide.slices
        )
    return _split_rows(
        ((line["place"].replace(" ", ""), *line.slice(clock), line.number("count")), line.line)
        for line in _read_lines(text, COLUMNS["counts"])
    )


def read_target_lines(text: str) -> Iterator[_TableLine]:
    """Yield the lines of a table of targets, see :mod:`odscen.scenario.demand.targets`.

    Raises
    ------
    InputError
        With the line and the value that cannot be used.
    """
    return _read_lines(text, ("kind", "place", "begin", "end", "value"), ("use",))


def read_inputs(text: str, *, clock: float = 0.0) -> tuple[InputRow, ...]:
    """Read vehicle inputs: ``segment``, perhaps ``direction``, then a column for each time slice.

    The title of such a column is the begin of its slice; slices are equally long.

    Raises
    ------
    InputError
        With the line and the value that cannot be used.
    """
    names = ("segment", "direction")
    wide = _read_wide_table(text, names, clock) or _read_wide_table(text, names[:1], clock)
    if wide is None:
        raise InputError(
            "the columns needed are segment [, direction] and the begins of slices of time",
            element="line 1",
        )
    begin, end = wide.slices[0][1]
    return tuple(
        InputRow(
            line["segment"],
            line["direction"].lower() if line.has("direction") else None,
            begin,
            end - begin,
            tuple(line.number(column) for column, _ in wide.slices),
            line.line,
        )
        for line in wide.lines
    )


def read_profile(text: str) -> ProfileTable:
    """Read a day profile: column ``share``, one line for each of equal slices of time.

    A column ``time`` may name the begin of each; they are then evenly spaced, and of the time from
    the first to one slice after the last. Without it they are of the whole day.

    Raises
    ------
    InputError
        With the line and the value that cannot be used.
    """
    lines = list(_read_lines(text, COLUMNS["profile"], ("time",)))
    shares = tuple(line.number("share") for line in lines)
    if not lines[0].has("time"):
        return ProfileTable(shares, None, None)
    begins = [line.time("time", 0.0) for line in lines]
    if len(lines) == 1:
        problem = "one slice has no length that its time would give; a whole day has no times"
        raise InputError(problem, element=lines[0].where)
    length = begins[1] - begins[0]
    if length <= 0:
        problem = f"time {lines[1]['time']!r} is not after {lines[0]['time']!r}"
        raise InputError(problem, element=lines[1].where)
    for index, line in enumerate(lines):
        if abs(begins[index] - begins[0] - index * length) > 1.0:
            raise InputError(
                f"time {line['time']!r} is not that of slice {index + 1} of {len(lines)} equal "
                f"slices of {length / 60.0:g} min from {lines[0]['time']} on",
                element=line.where,
            )
    end = begins[0] + len(lines) * length
    if end > DAY + 1.0:
        problem = f"{len(lines)} slices of {length / 60.0:g} min end after midnight"
        raise InputError(problem, element=lines[-1].where)
    if begins[0] == 0.0 and abs(end - DAY) <= 1.0:
        return ProfileTable(shares, None, None)
    return ProfileTable(shares, begins[0], end)


def read_zones(text: str) -> dict[str, Rows[str]]:
    """Read zones: columns ``zone`` and ``segment``, one line for each segment of a zone.

    Raises
    ------
    InputError
        With the line and the value that cannot be used.
    """
    found: dict[str, list[tuple[str, int]]] = {}
    for line in _read_lines(text, ("zone", *COLUMNS["zones"])):
        found.setdefault(line.name("zone"), []).append((line["segment"], line.line))
    return {zone: _split_rows(pairs) for zone, pairs in found.items()}


def _split_rows(pairs: Iterable[tuple[_Row, int]]) -> Rows[_Row]:
    values, lines = zip(*pairs, strict=True)
    return Rows(values, lines)


def _read_square_matrix(text: str) -> list[tuple[MatrixTrip, int]]:
    """Rows of a square origin-destination table with their lines; empty if it is none."""
    columns, lines = _read_csv_table(text, exact=True)
    if not columns:
        return []
    corner, *ends = columns
    if corner.lower() not in ("", "from", "from/to", "o/d") or {"to", "trips"} & set(ends):
        return []
    rows = [
        ((line[corner], end, line.number(end)), line.line)
        for line in lines
        for end in ends
        if line.filled(end)
    ]
    return [row for row in rows if row[0][2] > 0]


def _read_wide_table(text: str, names: Sequence[str], clock: float) -> _WideTable | None:
    """Read a table with these columns, and times as titles of all others; ``None`` if it is not."""
    columns, lines = _read_csv_table(text)
    titles = columns[len(names) :]
    if tuple(columns[: len(names)]) != tuple(names) or len(titles) < 2:
        return None
    head = _TableLine(1, dict(zip(titles, titles, strict=True)))
    if not all(_TIME_OF_DAY.fullmatch(title) or title.isdecimal() for title in titles):
        return None
    begins = [head.time(title, clock) for title in titles]
    length = begins[1] - begins[0]
    for title, begin, expected in zip(
        titles, begins, (begins[0] + k * length for k in range(len(begins))), strict=True
    ):
        if length <= 0 or begin != expected or begin < 0:
            raise InputError(
                f"the slice that begins at {title} is not as long as the first, or too early",
                element="line 1",
            )
    slices = [(t, (begin, begin + length)) for t, begin in zip(titles, begins, strict=True)]
    return _WideTable(lines, slices)


class _TableLine:
    def __init__(self, number: int, cells: dict[str, str]) -> None:
        self.line = number
        self.where = f"line {number}"
        self._cells = cells

    def has(self, column: str) -> bool:
        return column in self._cells

    def filled(self, column: str) -> bool:
        return bool(self._cells[column])

    def __getitem__(self, column: str) -> str:
        value = self._cells[column]
        if not value:
            raise InputError(f"column {column!r} is empty", element=self.where)
        return value

    def name(self, column: str) -> str:
        if not _NAME.fullmatch(self[column]):
            raise InputError(
                f"{column} must be at most 64 letters from a to z, digits, '-', '_' and '.', not "
                f"{shown(self[column])}",
                element=self.where,
            )
        return self[column]

    def number(self, column: str) -> float:
        try:
            value = float(self[column])
        except ValueError:
            value = -1.0
        if not 0.0 <= value <= 1e7:
            raise InputError(
                f"{column} must be a number from 0 on, not {shown(self[column])}",
                element=self.where,
            )
        return value

    def time(self, column: str, clock: float) -> float:
        match = _TIME_OF_DAY.fullmatch(self[column])
        if not match:
            return self.number(column)
        hours, minutes, seconds = (int(part or 0) for part in match.groups())
        return hours * 3600.0 + minutes * 60.0 + seconds - clock

    def slice(self, clock: float) -> TimeSlice:
        begin, end = self.time("begin", clock), self.time("end", clock)
        if begin < 0 or end <= begin:
            raise InputError(
                f"the slice from {self['begin']} to {self['end']} is not after the start of the "
                "run, or ends before it begins",
                element=self.where,
            )
        return begin, end


def _csv_rows(reader: _csv.Reader) -> Iterator[list[str]]:
    """Cells of each line; what the csv module refuses is an error with its line."""
    try:
        yield from reader
    except csv.Error as error:
        raise InputError(
            f"this is no table that can be read: {error}", element=f"line {reader.line_num}"
        ) from error


def _read_lines(
    text: str, needed: Sequence[str], optional: Sequence[str] = ()
) -> Iterator[_TableLine]:
    """Yield the lines of a table with these columns."""
    columns, rows = _read_csv_table(text)
    missing = [name for name in needed if name not in columns]
    unknown = [name for name in columns if name not in (*needed, *optional)]
    given = [name for name in optional if name in columns]
    if missing or unknown or (given and len(given) != len(optional)):
        listed = ", ".join(needed) + "".join(f" [, {name}]" for name in optional)
        names = printable(", ".join(columns)) or "missing"
        raise InputError(f"the columns are {names:.200}; needed are {listed}", element="line 1")
    yield from rows


def _read_csv_table(text: str, *, exact: bool = False) -> tuple[list[str], Iterator[_TableLine]]:
    """Columns and lines of a CSV file; comma, semicolon or tab, as its first line shows.

    Names of columns are in small letters, unless they are to be ``exact``.
    """
    text = text.removeprefix("\ufeff")
    head = text.split("\n", 1)[0]
    delimiter = max(",;\t", key=head.count)
    reader = csv.reader(io.StringIO(text), delimiter=delimiter)
    rows = _csv_rows(reader)
    columns = [name.strip() if exact else name.strip().lower() for name in next(rows, [])]
    return columns, _table_lines(reader, rows, columns)


def _table_lines(
    reader: _csv.Reader, rows: Iterator[list[str]], columns: Sequence[str]
) -> Iterator[_TableLine]:
    found = False
    for cells in rows:
        if not any(cell.strip() for cell in cells):
            continue
        if reader.line_num > MOST_ROWS + 1:
            raise InputError(
                f"there are more than {MOST_ROWS} lines below the first; make the table smaller",
                element=f"line {reader.line_num}",
            )
        if len(cells) != len(columns):
            raise InputError(
                f"{len(cells)} values for {len(columns)} columns", element=f"line {reader.line_num}"
            )
        found = True
        values = (cell.strip() for cell in cells)
        yield _TableLine(reader.line_num, dict(zip(columns, values, strict=True)))
    if not found:
        raise InputError("there are no lines below the first")
