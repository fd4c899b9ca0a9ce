"""GTFS feeds: the stops and trips of a day, from the tables of a feed (https://gtfs.org/schedule)."""

from __future__ import annotations

import csv
import io
import math
import re
from typing import TYPE_CHECKING, NamedTuple

from odscen.base.errors import InputError
from odscen.base.shown import shown

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping
    from datetime import date

NEEDED = ("stops.txt", "routes.txt", "trips.txt", "stop_times.txt")
CALENDARS = ("calendar.txt", "calendar_dates.txt")

_DAYS = ("monday", "tuesday", "wednesday", "thursday", "friday", "saturday", "sunday")
_TIME = re.compile(r"\s*(\d{1,3}):([0-5]\d):([0-5]\d)\s*")
_ADDED, _REMOVED = "1", "2"


class FeedStop(NamedTuple):
    """A stop of a feed; degrees of WGS 84."""

    id: str
    name: str
    lat: float
    lon: float


class FeedVisit(NamedTuple):
    """A stop of a trip, and seconds after midnight at which it is left; ``None`` if not given."""

    stop: str
    departure: float | None


class FeedTrip(NamedTuple):
    """A trip by bus: the name of its route, and its stops in order."""

    id: str
    route: str
    visits: tuple[FeedVisit, ...]


class Feed(NamedTuple):
    """Bus trips of a day.

    Attributes
    ----------
    other_modes
        Trips of that day by other than buses, which are left out.
    """

    stops: dict[str, FeedStop]
    trips: tuple[FeedTrip, ...]
    other_modes: int


def read_feed(tables: Mapping[str, str], *, day: date | None = None) -> Feed:
    """Read the trips of a day.

    Parameters
    ----------
    tables
        Texts by file name: those of :data:`NEEDED`, and of :data:`CALENDARS` where there are any.
    day
        Which; may be left out where the feed has no calendar.

    Raises
    ------
    InputError
        With the file, line and value that cannot be used.
    """
    for name in NEEDED:
        if name not in tables:
            raise InputError(f"the feed has no {name}")
    services = _services_on_day(tables, day)
    routes = {
        row["route_id"]: row for row in _read_rows(tables, "routes.txt", "route_id", "route_type")
    }
    trips: dict[str, str] = {}
    other = 0
    for row in _read_rows(tables, "trips.txt", "route_id", "service_id", "trip_id"):
        if services is None or row["service_id"] in services:
            route = routes.get(row["route_id"])
            if route is None:
                raise row.refusal("route_id", "is not in routes.txt")
            if _is_bus_route(route):
                trips[row["trip_id"]] = _route_name(route)
            else:
                other += 1
    visits = _read_visits(tables, trips)
    return Feed(
        stops=_read_stops(tables),
        trips=tuple(
            FeedTrip(trip, trips[trip], visits[trip]) for trip in trips if visits.get(trip)
        ),
        other_modes=other,
    )


class _FeedRow(dict[str, str]):
    """A line of a table, which can say where it is."""

    def __init__(self, file: str, line: int, cells: Mapping[str, str]) -> None:
        super().__init__(cells)
        self._file, self._line = file, line

    def refusal(self, column: str, why: str) -> InputError:
        place = f"line {self._line}, column {column}"
        return InputError(f"{shown(self[column])} {why}", file=self._file, element=place)

    def number(self, column: str) -> float:
        text = self[column]
        try:
            value = float(text) if "_" not in text else math.nan  # Python's own 1_000
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.refusal(column, "is not a number")
        return value

    def degrees(self, column: str, most: float) -> float:
        """Degrees from ``-most`` to ``most``."""
        value = self.number(column)
        if abs(value) > most:
            raise self.refusal(column, f"is not between -{most:g} and {most:g} degrees")
        return value


def _read_rows(tables: Mapping[str, str], file: str, *needed: str) -> Iterator[_FeedRow]:
    reader = csv.reader(io.StringIO(tables[file].removeprefix("\ufeff")))
    try:
        columns = [name.strip() for name in next(reader, [])]
        missing = [name for name in needed if name not in columns]
        if missing:
            raise InputError(f"there is no column {missing[0]}", file=file, element="line 1")
        for cells in reader:
            if cells:
                values = dict.fromkeys(columns, "") | dict(zip(columns, cells, strict=False))
                yield _FeedRow(file, reader.line_num, values)
    except csv.Error as error:
        raise InputError(
            f"this is no table that can be read: {error}",
            file=file,
            element=f"line {reader.line_num}",
        ) from error


def _services_on_day(tables: Mapping[str, str], day: date | None) -> set[str] | None:
    """Services that run on a day; ``None`` without a calendar."""
    given = [name for name in CALENDARS if name in tables]
    if not given:
        return None
    if day is None:
        raise InputError("the feed has a calendar; name a day")
    stamp, weekday = day.strftime("%Y%m%d"), _DAYS[day.weekday()]
    running: set[str] = set()
    if "calendar.txt" in tables:
        for row in _read_rows(
            tables, "calendar.txt", "service_id", *_DAYS, "start_date", "end_date"
        ):
            if row[weekday] == "1" and row["start_date"] <= stamp <= row["end_date"]:
                running.add(row["service_id"])
    if "calendar_dates.txt" in tables:
        for row in _read_rows(tables, "calendar_dates.txt", "service_id", "date", "exception_type"):
            if row["date"] == stamp and row["exception_type"] == _ADDED:
                running.add(row["service_id"])
            elif row["date"] == stamp and row["exception_type"] == _REMOVED:
                running.discard(row["service_id"])
    return running


def _is_bus_route(route: _FeedRow) -> bool:
    """Whether a route is one of buses or trolleybuses, extended types included."""
    kind = int(route.number("route_type"))
    return kind in (3, 11) or 700 <= kind < 717 or kind == 800


def _route_name(route: _FeedRow) -> str:
    return route.get("route_short_name", "").strip() or route["route_id"]


def _read_stops(tables: Mapping[str, str]) -> dict[str, FeedStop]:
    return {
        row["stop_id"]: FeedStop(
            row["stop_id"],
            row.get("stop_name", "").strip(),
            row.degrees("stop_lat", 90.0),
            row.degrees("stop_lon", 180.0),
        )
        for row in _read_rows(tables, "stops.txt", "stop_id", "stop_lat", "stop_lon")
        if row["stop_lat"].strip() and row["stop_lon"].strip()
    }


def _read_visits(
    tables: Mapping[str, str], trips: Collection[str]
) -> dict[str, tuple[FeedVisit, ...]]:
    found: dict[str, list[tuple[float, FeedVisit]]] = {}
    columns = ("trip_id", "stop_id", "stop_sequence", "departure_time")
    for row in _read_rows(tables, "stop_times.txt", *columns):
        if row["trip_id"] in trips:
            visit = FeedVisit(row["stop_id"], _read_seconds(row))
            found.setdefault(row["trip_id"], []).append((row.number("stop_sequence"), visit))
    return {
        trip: tuple(visit for _, visit in sorted(visits, key=lambda pair: pair[0]))
        for trip, visits in found.items()
    }


def _read_seconds(row: _FeedRow) -> float | None:
    text = row["departure_time"] or row.get("arrival_time", "")
    if not text.strip():
        return None
    match = _TIME.fullmatch(text)
    if match is None:
        raise row.refusal("departure_time", "is not a time such as 07:15:00")
    hours, minutes, seconds = map(int, match.groups())
    return 3600.0 * hours + 60.0 * minutes + seconds
