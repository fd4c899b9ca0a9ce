"""Time stamps as offices write them: dates and times in several orders, with or without a zone."""

from __future__ import annotations

import re
from datetime import UTC, date, datetime, timedelta
from typing import TYPE_CHECKING, Literal, NamedTuple
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from odscen.base.errors import InputError
from odscen.base.shown import shown
from odscen.formats.office.traffic_file import DAY, is_missing

if TYPE_CHECKING:
    from collections.abc import Iterable

Unit = Literal["s", "min", "h"]
"""Of bare numbers."""
SECONDS: dict[Unit, float] = {"s": 1.0, "min": 60.0, "h": 3600.0}

_TIME = r"(\d{1,2})[:.](\d{2})(?:[:.](\d{2})(?:[.,]\d+)?)?\s*([AaPp]\.?[Mm]\.?)?"
_ONLY_TIME = re.compile(rf"{_TIME}(?:\s*(?:Uhr|h))?")
_RANGE = re.compile(
    r"(\d{1,2}(?:[:.]\d{2}(?:[:.]\d{2})?)?)\s*(?:-|–|—|bis|to)\s*(\d{1,2}(?:[:.]\d{2}(?:[:.]\d{2})?)?)"
    r"(?:\s*(?:Uhr|h))?"
)
_HALF_RANGE = re.compile(
    r"(\d{1,2}(?::\d{2})?)\s*([AaPp][Mm])?\s*(?:-|–|to)\s*(\d{1,2}(?::\d{2})?)\s*([AaPp][Mm])"
)
_COMPACT = re.compile(r"(\d{2}|\d{4})(\d{2})(\d{2})")
_YEAR_FIRST = re.compile(rf"(\d{{4}})[-/.](\d{{1,2}})[-/.](\d{{1,2}})(?:[T,\s]+{_TIME})?(.*)")
_YEAR_LAST = re.compile(
    rf"(\d{{1,2}})([-/.])(\d{{1,2}})[-/.](\d{{4}}|\d{{2}})(?:[T,\s]+{_TIME})?(.*)"
)
_OFFSET = re.compile(r"\s*(Z|UTC|[+-]\d{2}:?\d{2})?")
_EPOCH = 1e8
"""Bare numbers from here on are seconds, or milliseconds, since 1970."""


class Stamp(NamedTuple):
    """A point or slice of time: its day, if it has one, and seconds.

    ``second`` counts from midnight if ``of_day``, else from the start of the run; ``end`` is set
    where the text is a range.
    """

    day: date | None
    second: float
    end: float | None
    of_day: bool


class StampReader:
    """Reads the stamps of one column, which are all written in one way.

    Parameters
    ----------
    cells
        All of them: they say whether days or months come first.
    unit
        Of bare numbers.
    time_zone
        Where the stations are, for stamps with an offset.
    compact
        Whether bare numbers of six or eight digits are days, ``230501``.
    hours_from_1
        Whether hours are counted from 1, so that 1 is the one from midnight on.

    Raises
    ------
    InputError
        If there is no such time zone.
    """

    def __init__(
        self,
        cells: Iterable[str],
        *,
        unit: Unit = "s",
        time_zone: str | None = None,
        compact: bool = False,
        hours_from_1: bool = False,
    ) -> None:
        self._unit: Unit = unit
        self._compact = compact
        self._first_hour = 1 if hours_from_1 else 0
        self.had_offset = False
        try:
            self._zone = None if time_zone is None else ZoneInfo(time_zone)
        except (ZoneInfoNotFoundError, ValueError, OSError) as error:
            raise InputError(
                f"there is no time zone {shown(time_zone)}; one is Europe/Berlin"
            ) from error
        firsts, seconds, slashes = 0, 0, 0
        for cell in cells:
            match = _YEAR_LAST.fullmatch(cell.strip())
            if match is not None:
                firsts = max(firsts, int(match[1]))
                seconds = max(seconds, int(match[3]))
                slashes += match[2] == "/"
        self.months_first = seconds > 12 or (slashes > 0 and firsts <= 12)
        self.ambiguous = slashes > 0 and firsts <= 12 and seconds <= 12

    def read(self, cell: str) -> Stamp:
        """Read a stamp.

        Raises
        ------
        InputError
            If it is none.
        """
        text = cell.strip()
        if is_missing(text):
            raise InputError("the time is missing")
        if match := _YEAR_FIRST.fullmatch(text):
            year, month, day = int(match[1]), int(match[2]), int(match[3])
            return self._read_dated(text, (year, month, day), match.groups()[3:7], match[8])
        if match := _YEAR_LAST.fullmatch(text):
            year = int(match[4]) + (2000 if len(match[4]) == 2 else 0)
            day, month = int(match[1]), int(match[3])
            if self.months_first and match[2] == "/":
                day, month = month, day
            return self._read_dated(text, (year, month, day), match.groups()[4:8], match[9])
        if match := _ONLY_TIME.fullmatch(text):
            return Stamp(None, _count_seconds(match.groups()[:4], text), None, of_day=True)
        if self._compact and (match := _COMPACT.fullmatch(text)):
            year = int(match[1]) + (2000 if len(match[1]) == 2 else 0)
            return self._read_dated(text, (year, int(match[2]), int(match[3])), (None,) * 4, None)
        if match := _HALF_RANGE.fullmatch(text):
            end = self.read(f"{_with_minutes(match[3])} {match[4]}").second
            begin = self.read(f"{_with_minutes(match[1])} {match[2] or match[4]}").second
            if begin > end > 0 and match[2] is None:  # 11:00-12:00 PM
                begin -= DAY / 2
            return Stamp(None, begin, end if end > begin else end + DAY, of_day=True)
        if match := _RANGE.fullmatch(text):
            begin, end = (self.read(_with_minutes(part)).second for part in match.groups())
            return Stamp(None, begin, end if end > begin else end + DAY, of_day=True)
        try:
            number = float(text.replace(",", "."))
        except ValueError:
            number = -1.0
        if not 0.0 <= number < 1e14:
            raise InputError(f"{shown(cell)} is no time")
        if number >= _EPOCH:
            seconds = number / (1000.0 if number >= 1e11 else 1.0)
            return self._convert_to_zone(
                datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=seconds)
            )
        of_day = self._unit == "h"
        number -= self._first_hour if of_day else 0
        return Stamp(None, number * SECONDS[self._unit], None, of_day=of_day)

    def _read_dated(
        self, text: str, ymd: tuple[int, int, int], time: tuple[str | None, ...], rest: str | None
    ) -> Stamp:
        offset = _OFFSET.fullmatch(rest or "")
        if offset is None:
            raise InputError(f"{shown(text)} is no time: what is {shown(rest)}?")
        second = _count_seconds(time, text) if time[0] is not None else 0.0
        try:
            day = date(*ymd)
        except ValueError as error:
            raise InputError(f"{shown(text)} is no day: {error}") from None
        if offset[1] is None:
            return Stamp(day, second, None, of_day=True)
        word = "+00:00" if offset[1] in ("Z", "UTC") else offset[1]
        sign = -1 if word[0] == "-" else 1
        away = sign * timedelta(hours=int(word[1:3]), minutes=int(word[-2:]))
        moment = datetime(*ymd, tzinfo=UTC) + timedelta(seconds=second) - away
        if self._zone is None:
            self.had_offset = True
            return Stamp(day, second, None, of_day=True)
        return self._convert_to_zone(moment)

    def _convert_to_zone(self, moment: datetime) -> Stamp:
        self.had_offset = self.had_offset or self._zone is None
        local = moment if self._zone is None else moment.astimezone(self._zone)
        second = local.hour * 3600.0 + local.minute * 60.0 + local.second
        return Stamp(local.date(), second, None, of_day=True)


def _with_minutes(text: str) -> str:
    return text if re.search(r"[:.]", text) else f"{text}:00"


def _count_seconds(parts: tuple[str | None, ...], text: str) -> float:
    hour, minute, second = (int(part or 0) for part in parts[:3])
    half = (parts[3] or "").lower().replace(".", "")
    if half:
        if not 1 <= hour <= 12:
            raise InputError(f"{shown(text)} is no time: hours before am and pm are 1 to 12")
        hour = hour % 12 + (12 if half == "pm" else 0)
    if hour > 24 or minute > 59 or second > 59 or (hour == 24 and (minute or second)):
        raise InputError(f"{shown(text)} is no time of day")
    return hour * 3600.0 + minute * 60.0 + second
