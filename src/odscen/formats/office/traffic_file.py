"""What a file of trips, counts or detectors has, whichever program has written it.

Places are as the file calls them, times as it counts them: both are related to a map and a scenario
in :mod:`odscen.app.demand.traffic_files`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import InputError
from odscen.base.shown import shown

if TYPE_CHECKING:
    from collections.abc import Iterable

DAY = 86_400.0

_MISSING = frozenset(
    ("", "-", "--", "---", "nan", "na", "n/a", "#n/a", "null", "none", "nil", "?", "x", "k.a.")
)
"""What stands in tables for a value that was not measured, in small letters."""

_THOUSANDS_POINT = re.compile(r"[+-]?\d{1,3}(?:\.\d{3})+(?:,\d+)?")
_THOUSANDS_COMMA = re.compile(r"[+-]?\d{1,3}(?:,\d{3})+(?:\.\d+)?")
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")


class TripRow(NamedTuple):
    """Trips between two zones; times in seconds, ``None`` where the file has none."""

    origin: str
    destination: str
    trips: float
    begin: float | None
    end: float | None
    line: int


class VolumeRow(NamedTuple):
    """Vehicles that passed a station from ``begin`` to ``end``, seconds."""

    station: str
    begin: float
    end: float
    vehicles: float
    line: int


class TurnRow(NamedTuple):
    """Vehicles from one SUMO edge into another; with ``share`` a share of those who come."""

    origin: str
    destination: str
    value: float
    begin: float
    end: float
    share: bool
    line: int


@dataclass(frozen=True, slots=True)
class StationPlace:
    """Where a station is, in whatever way its file says it.

    Attributes
    ----------
    edge, lane
        SUMO's ids.
    pos
        Metres along the lane; from its end if negative.
    point
        x and y in metres of the map, or longitude and latitude in degrees.
    degrees
        Whether ``point`` is longitude and latitude.
    bearing
        Direction of travel, degrees clockwise from north.
    """

    edge: str | None = None
    lane: str | None = None
    pos: float | None = None
    point: tuple[float, float] | None = None
    degrees: bool = False
    bearing: float | None = None


class LeftOut(NamedTuple):
    """A row that was not taken; ``source`` is its line or element."""

    source: str
    reason: str


@dataclass(frozen=True, slots=True)
class TrafficFile:
    """A file that was read.

    Attributes
    ----------
    what
        What it is, in words: "a VISUM matrix in format V with 12 zones".
    of_day
        Whether its times are times of day; seconds after the start of the run otherwise.
    rows
        How many rows with values it has, those that were left out included.
    zones
        SUMO edges of each zone, where the file says them.
    names
        Names of zones by their numbers.
    columns
        Which column was taken for what, of tables with free titles.
    """

    what: str
    of_day: bool = False
    rows: int = 0
    trips: tuple[TripRow, ...] = ()
    volumes: tuple[VolumeRow, ...] = ()
    turns: tuple[TurnRow, ...] = ()
    zones: dict[str, tuple[str, ...]] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    stations: dict[str, StationPlace] = field(default_factory=dict)
    left_out: tuple[LeftOut, ...] = ()
    notes: tuple[str, ...] = ()
    columns: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class ReadingOptions:
    """What the user says of a table, where its titles and values leave it open.

    Attributes
    ----------
    columns
        Title of the column, by what it has: ``station``, ``time``, ``count`` and others.
    interval
        Seconds that a row counts, where the table has no end of it.
    date
        The day that is taken, of several (``2026-03-02``).
    time_zone
        Where the stations are, for stamps with an offset (``Europe/Berlin``).
    """

    columns: dict[str, str] = field(default_factory=dict)
    interval: float | None = None
    date: str | None = None
    time_zone: str | None = None


def decoded(content: bytes) -> str:
    """Text of a file, by its byte order mark, as UTF-8, or as Windows-1252.

    Raises
    ------
    InputError
        If it is no text.
    """
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        text = content.decode("utf-16", "replace")
    else:
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = content.decode("cp1252", "replace")
    if "\x00" in text:
        raise InputError("this is no text: it has bytes of value 0")
    return text


def is_missing(cell: str) -> bool:
    """Whether a cell says that there is no value."""
    return cell.strip().lower() in _MISSING


def has_decimal_commas(cells: Iterable[str]) -> bool:
    """Whether numbers of a table have decimal commas, as German programs write them."""
    commas = points = 0
    for cell in cells:
        text = cell.strip()
        if not _THOUSANDS_COMMA.fullmatch(text):
            commas += re.fullmatch(r"[+-]?(\d+|\d{1,3}(\.\d{3})+),\d+", text) is not None
        if not _THOUSANDS_POINT.fullmatch(text):
            points += re.fullmatch(r"[+-]?(\d+|\d{1,3}(,\d{3})+)\.\d+", text) is not None
    return commas > points


def parse_number(cell: str, *, decimal_comma: bool) -> float:
    """Value of a cell, with or without separators of thousands.

    Raises
    ------
    InputError
        If it is none.
    """
    text = cell.strip().replace("\u00a0", "").replace("\u202f", "").replace("'", "")
    text = re.sub(r"(?<=\d) (?=\d{3})", "", text)
    if decimal_comma:
        if _THOUSANDS_POINT.fullmatch(text) or "," in text:
            text = text.replace(".", "")
        text = text.replace(",", ".")
    elif _THOUSANDS_COMMA.fullmatch(text):
        text = text.replace(",", "")
    if not _NUMBER.fullmatch(text):
        raise InputError(f"{shown(cell)} is no number")
    return float(text)
