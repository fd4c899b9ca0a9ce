"""Matrices as PTV VISUM writes them, in the formats V and O, and SUMO's ``od`` files, which are O.

Format V has the numbers of the zones once, then all cells row by row; format O a row for each pair.
Times are ``hours.minutes``, so ``7.30`` is half past seven; comments begin with ``*``. Sources:
VISUM's manual, "Matrix files"; ``ODMatrix::readV`` and ``readO`` of SUMO.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import InputError
from odscen.base.shown import shown
from odscen.formats.office.traffic_file import LeftOut, TrafficFile, TripRow, parse_number

if TYPE_CHECKING:
    from collections.abc import Iterator

_HEAD = re.compile(r"\$([A-Z])([A-Z]*)(?:;(.*))?", re.IGNORECASE)
_CLOCK = re.compile(r"(\d{1,2})(?:[.:](\d{1,2}))?(?:[.:](\d{1,2}))?")
MOST_ZONES = 5_000
"""Zones of a matrix: a square of them is in memory."""
MOST_TRIPS = 1e7
"""Trips of a cell."""


class _Line(NamedTuple):
    number: int
    text: str


def is_visum(text: str) -> bool:
    """Whether a text begins as VISUM's matrices do."""
    return text.lstrip("\ufeff \t\r\n").startswith("$")


def read_visum_matrix(text: str) -> TrafficFile:
    """Read a matrix.

    Raises
    ------
    InputError
        If it is of another format, or not complete; names the line.
    """
    lines = _content_lines(text)
    head = next(lines, None)
    match = None if head is None else _HEAD.fullmatch(head.text.strip())
    if head is None or match is None:
        raise InputError(
            "the first line of a VISUM matrix is $V, $O or $OR, with ;D and decimals behind it",
            element="line 1",
        )
    form, letters = match[1].upper(), match[2].upper()
    if form == "B" or letters.startswith("B"):
        raise InputError(
            f"this is a VISUM matrix in the binary format {shown(head.text.strip())}; save it in "
            "VISUM in format V or O (text)",
            element=f"line {head.number}",
        )
    if form not in "VO":
        raise InputError(
            f"{shown(head.text.strip())} is a table of VISUM, but no matrix in format V or O",
            element=f"line {head.number}",
        )
    comma = bool(re.search(r"^\s*\d+,\d+\s", text, re.MULTILINE)) and not re.search(
        r"^\s*\d+\s+\d+\s+\d*\.\d+\s*$", text, re.MULTILINE
    )
    mode = ""
    if "M" in letters:
        mode = _require_line(lines, "the transport system").text.strip()
    window = _require_line(lines, "the times from and to")
    words = window.text.split()
    if len(words) < 2:
        raise InputError(
            f"{shown(window.text.strip())} are not the times from and to, such as 7.00 8.00",
            element=f"line {window.number}",
        )
    begin, end = (_clock_seconds(word, window.number) for word in words[:2])
    if end <= begin:
        raise InputError(
            f"the matrix is from {words[0]} to {words[1]}: it ends before it begins",
            element=f"line {window.number}",
        )
    factor_line = _require_line(lines, "the factor")
    factor = _read_number(factor_line.text.strip(), factor_line.number, comma=comma)
    if factor <= 0:
        raise InputError(f"the factor is {factor:g}", element=f"line {factor_line.number}")
    if form == "V":
        rows, zones, left = _read_square(lines, comma=comma)
    else:
        rows, zones, left = _read_pairs(lines, comma=comma)
    names = _read_names(text)
    trips = tuple(
        TripRow(row.origin, row.destination, row.trips * factor, begin, end, row.line)
        for row in rows
    )
    notes = (
        [] if factor == 1.0 else [f"all numbers were multiplied by the file's factor {factor:g}"]
    )
    if mode:
        notes.append(f"the transport system of the matrix is {shown(mode)}; its trips are of cars")
    kind = f"{form}{letters}"
    return TrafficFile(
        what=f"a VISUM matrix in format {kind} with {len(zones)} zones",
        of_day=True,
        rows=len(rows) + len(left),
        trips=tuple(row for row in trips if row.trips > 0),
        names=names,
        left_out=tuple(left),
        notes=tuple(notes),
    )


def _content_lines(text: str) -> Iterator[_Line]:
    """Yield lines with something in them that are no comments; names of zones end the matrix."""
    head = True
    for number, line in enumerate(text.splitlines(), start=1):
        stripped = line.strip().lstrip("\ufeff")
        if not stripped or stripped.startswith("*"):
            continue
        if stripped.startswith("$") and not head:
            return
        head = False
        yield _Line(number, stripped)


def _require_line(lines: Iterator[_Line], what: str) -> _Line:
    line = next(lines, None)
    if line is None:
        raise InputError(f"the VISUM matrix ends where {what} should be")
    return line


def _clock_seconds(word: str, line: int) -> float:
    match = _CLOCK.fullmatch(word)
    hours, minutes, seconds = (int(part or 0) for part in match.groups()) if match else (0, 99, 0)
    if minutes > 59 or seconds > 59 or hours > 48:
        raise InputError(
            f"{shown(word)} is no time, which VISUM writes as hours.minutes", element=f"line {line}"
        )
    return hours * 3600.0 + minutes * 60.0 + seconds


def _read_number(word: str, line: int, *, comma: bool) -> float:
    try:
        return parse_number(word, decimal_comma=comma or "," in word)
    except InputError as error:
        raise InputError(str(error), element=f"line {line}") from None


def _read_square(
    lines: Iterator[_Line], *, comma: bool
) -> tuple[list[TripRow], list[str], list[LeftOut]]:
    count_line = _require_line(lines, "the number of zones")
    if not count_line.text.isdecimal() or not 0 < int(count_line.text) <= MOST_ZONES:
        raise InputError(
            f"{shown(count_line.text)} is no number of zones from 1 to {MOST_ZONES}",
            element=f"line {count_line.number}",
        )
    size = int(count_line.text)
    zones: list[str] = []
    while len(zones) < size:
        zones += _require_line(lines, f"the numbers of {size} zones").text.split()
    if len(zones) > size:
        raise InputError(f"{len(zones)} numbers of zones are given, {size} were announced")
    twice = next((zone for n, zone in enumerate(zones) if zone in zones[:n]), None)
    if twice is not None:
        raise InputError(f"zone {shown(twice)} is there twice")
    words = ((line.number, word) for line in lines for word in line.text.split())
    rows: list[TripRow] = []
    left: list[LeftOut] = []
    for index in range(size * size):
        found = next(words, None)
        if found is None:
            raise InputError(f"the VISUM matrix has {index} cells; {size} zones need {size * size}")
        line, word = found
        value = _read_number(word, line, comma=comma)
        origin, destination = zones[index // size], zones[index % size]
        if not 0 <= value <= MOST_TRIPS:
            left.append(
                LeftOut(f"row {line} of the file", f"{origin} to {destination}: {value:g} trips")
            )
        elif value > 0:
            rows.append(TripRow(origin, destination, value, None, None, line))
    rest = next(words, None)
    if rest is not None:
        raise InputError(
            f"the VISUM matrix has more than the {size * size} cells of {size} zones",
            element=f"line {rest[0]}",
        )
    return rows, zones, left


def _read_pairs(
    lines: Iterator[_Line], *, comma: bool
) -> tuple[list[TripRow], list[str], list[LeftOut]]:
    rows: list[TripRow] = []
    left: list[LeftOut] = []
    zones: dict[str, None] = {}
    for line in lines:
        words = re.split(r"[\s;]+", line.text.strip())
        if len(words) != 3:
            raise InputError(
                f"{shown(line.text)} is no row of origin, destination and trips",
                element=f"line {line.number}",
            )
        origin, destination, word = words
        zones |= dict.fromkeys((origin, destination))
        value = _read_number(word, line.number, comma=comma)
        if not 0 <= value <= MOST_TRIPS:
            reason = f"{origin} to {destination}: {value:g} trips"
            left.append(LeftOut(f"row {line.number} of the file", reason))
        else:
            rows.append(TripRow(origin, destination, value, None, None, line.number))
    if not zones:
        raise InputError("the VISUM matrix has no rows of origin, destination and trips")
    return rows, list(zones), left


def _read_names(text: str) -> dict[str, str]:
    """Names of zones, which newer versions of VISUM append after ``$NAMES``."""
    found: dict[str, str] = {}
    inside = False
    for line in text.splitlines():
        stripped = line.strip()
        if stripped.startswith("$"):
            inside = stripped.upper().startswith("$NAMES")
        elif inside and (match := re.fullmatch(r'(\S+)\s+"(.*)"', stripped)):
            found[match[1]] = match[2]
    return found
