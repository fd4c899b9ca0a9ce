"""Tables with any titles: which column has what is guessed from them, or said by the user.

Counts in rows (a station and a time in each), with a column for each slice of time, or with a
column for each station; matrices in rows or square. From CSV with any separator, and from Excel.
"""

from __future__ import annotations

import csv
import io
import re
import unicodedata
from collections import Counter, defaultdict
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

from odscen.base.errors import InputError
from odscen.base.shown import shown, some_of
from odscen.formats.office.time_stamps import Stamp, StampReader, Unit
from odscen.formats.office.traffic_file import (
    DAY,
    LeftOut,
    ReadingOptions,
    StationPlace,
    TrafficFile,
    TripRow,
    VolumeRow,
    has_decimal_commas,
    is_missing,
    parse_number,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

MOST_CELLS = 20_000_000
HOUR = 3600.0

_ROLES: Final[dict[str, str]] = {
    "station": r"place|stations?|detectors?|dets?|sensors?|sites?|loops?|locations?|devices?|zst"
    r"|(?:zahl|mess|zaehl)stellen?|messquerschnitt|mq|querschnitt|stelle|edges?|links?|segments?"
    r"|kanten?|strecken?|roads?|streets?|strassen?|str|counter|induktionsschleife|name|id|tkzst|detid"
    r"|(?:station|detector|det|sensor|site|loop|location|device|edge|lane|link|segment|counter"
    r"|zahlstelle|zahlstellen|messstelle)(?:id|name|nr|no|number|nummer|code)",
    "time": r"time|times?tamp|begin|start|starttime|begintime|timebegin|timestart|from|fromtime"
    r"|von|vonzeit|zeit|zeitpunkt|uhrzeit|zeitstempel|datetime|datumzeit|datumuhrzeit|zeitvon"
    r"|interval|intervall|intervalbegin|intervalstart|hour|hourofday|stunde|heure|hora|t|minute"
    r"|period|zeitraum|ts",
    "end": r"end|endtime|timeend|totime|to|until|stop|bis|biszeit|zeitbis|ende|intervalend",
    "date": r"date|datum|day|tag|jour|fecha",
    "count": r"counts?|volumes?|vol|flows?|q|qkfz|kfz|vehicles?|veh|anzahl|menge|number|n|total"
    r"|gesamt|summe?|nvehcontrib|values?|wert|verkehrsstarke|belastung|traffic|entered|debit"
    r"|intensity|intensidad|fahrzeuge|kfzgesamt|allvehicles|qgesamt",
    "lon": r"lon|lng|long|longitude|geograflange|lange|geolon",
    "lat": r"lat|latitude|breite|geolat",
    "x": r"x|xcoord|xkoord|easting|east|ost|rechtswert",
    "y": r"y|ycoord|ykoord|northing|north|nord|hochwert",
    "bearing": r"bearing|heading|direction|dir|richtung|fahrtrichtung",
    "number": r"lane|lane(no|nr|number|num|index)|spur(nr)?|fahrstreifen(nr)?|fs(nr)?|kanal",
    "edge": r"edges?|edgeid|sumoedge|kante",
    "lane": r"laneid|sumolane",
    "pos": r"pos|position",
    "origin": r"o|origin|originzone|from|fromzone|fromnode|von|vonbezirk|vonzone|quelle"
    r"|quellbezirk|start|source|orig|fromtaz",
    "destination": r"d|destination|destinationzone|to|tozone|tonode|nach|nachbezirk|nachzone|ziel"
    r"|zielbezirk|dest|sink|target|totaz",
    "trips": r"trips?|fahrten|count|counts?|volume|demand|value|number|anzahl|menge|wert|veh"
    r"|vehicles|flow|matrix|total|od|belastung",
}
_CLASSES: Final[dict[str, str]] = {
    "car": r"q?(?:pkw|cars?|lv|light|lightvehicles?|passengercars?|personenkraftwagen|mc?iv)",
    "truck": r"q?(?:lkw|trucks?|hv|heavy|heavyvehicles?|hgv|lz|lastzug|lkwa|sv|schwerverkehr)",
    "van": r"q?(?:vans?|lfw|lieferwagen|lgv|transporter)",
    "bus": r"q?(?:bus|busse|buses|coaches)",
    "motorcycle": r"q?(?:krad|motorrad|motorrader|motorcycles?|mc|mopeds?)",
    "bicycle": r"q?(?:rad|rader|fahrrad|fahrrader|bikes?|bicycles?|cycles?|cyclists?|radfahrer)",
}
_CORNERS = ("", "from", "o/d", "from/to", "o\\d", "von/nach", "von\\nach", "origin", "zone", "od")
_COMPASS = {
    "n": 0.0, "ne": 45.0, "no": 45.0, "e": 90.0, "o": 90.0, "se": 135.0, "so": 135.0, "s": 180.0,
    "sw": 225.0, "w": 270.0, "nw": 315.0, "nb": 0.0, "eb": 90.0, "sb": 180.0, "wb": 270.0,
    "north": 0.0, "east": 90.0, "south": 180.0, "west": 270.0, "northbound": 0.0,
    "eastbound": 90.0, "southbound": 180.0, "westbound": 270.0, "nord": 0.0, "ost": 90.0,
    "sud": 180.0, "sued": 180.0,
}  # fmt: skip


ONLY_STATION = "station"
"""Name of the station of a table that has one and does not name it."""
_NO_COUNTS = frozenset(("v", "speed", "avg", "occ", "occupancy", "mean", "geschwindigkeit", "kmh"))
"""Words of titles of columns that count nothing."""


def _is_title_of(role: str, title: str) -> bool:
    return re.fullmatch(_ROLES[role], normalised(title)) is not None


def _has_word_of(role: str, title: str) -> bool:
    """Whether a word of a title is one of a role: ``q_kfz_det`` has a count."""
    words = [normalised(word) for word in re.split(r"[^A-Za-z0-9À-ÿ]+", title)]
    if role in ("count", "trips") and _NO_COUNTS.intersection(words):
        return False
    if len(words) < 2 or role in ("x", "y", "edge", "lane", "pos", "lon", "lat", "number", "end"):
        return False
    return any(len(word) > 1 and re.fullmatch(_ROLES[role], word) for word in words)


@dataclass(frozen=True, slots=True)
class GivenTable:
    """Titles and rows of a table; ``lines`` are the rows' lines in the file."""

    titles: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]
    kind: str
    separator: str = ""


def normalised(title: str) -> str:
    """A title without units, accents, signs and capitals: ``"Zähl-Stelle (Nr)"`` is zahlstelle."""
    text = re.sub(r"\[.*?\]|\(.*?\)|/\s*(?:h|15min|min|hour|std)\b", "", title.lower())
    text = text.replace("ß", "ss")
    text = unicodedata.normalize("NFKD", text)
    return re.sub(r"[^a-z0-9]", "", text)


def table_of_text(text: str) -> GivenTable:
    """Divide a CSV text into cells; separator, and lines before the titles, are found out.

    Raises
    ------
    InputError
        If there is no line of titles with a row below it.
    """
    sample = [line for line in text.splitlines()[:200] if line.strip()][:60]
    if not sample:
        raise InputError("the file is empty")

    def evenness(separator: str) -> tuple[int, int]:
        try:
            widths = Counter(len(row) for row in csv.reader(sample, delimiter=separator))
        except csv.Error:  # a cell without end: the reader below says in which line
            return 0, 0
        width, rows = max(widths.items(), key=lambda found: (found[1] * (found[0] > 1), found[0]))
        return (rows if width > 1 else 0), width

    separator = max(";\t,|", key=evenness)
    if evenness(separator)[1] < 2:
        separator = ","
    reader = csv.reader(io.StringIO(text), delimiter=separator, skipinitialspace=True)
    rows: list[tuple[str, ...]] = []
    lines: list[int] = []
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                rows.append(tuple(cell.strip() for cell in cells))
                lines.append(reader.line_num)
            if len(rows) * max(len(cells), 1) > MOST_CELLS:
                raise InputError(f"the table has more than {MOST_CELLS} cells; divide it")
    except csv.Error as error:
        raise InputError(
            f"this is no table that can be read: {error}", element=f"line {reader.line_num}"
        ) from error
    name = {";": "semicolon", "\t": "tab", ",": "comma", "|": "bar"}[separator]
    return _with_titles(rows, lines, f"CSV ({name})", separator)


def table_of_sheet(content: bytes) -> GivenTable:
    """Read the first sheet of an Excel file that has values.

    Raises
    ------
    InputError
        If it cannot be read, or has none.
    """
    from python_calamine import CalamineError, CalamineWorkbook

    try:
        book = CalamineWorkbook.from_filelike(io.BytesIO(content))
        for name in book.sheet_names:
            cells = book.get_sheet_by_name(name).to_python(skip_empty_area=False)
            rows = [tuple(_cell_text(cell) for cell in row) for row in cells]
            filled = [number for number, row in enumerate(rows) if any(row)]
            if len(filled) > 1:
                given = [rows[number] for number in filled]
                lines = [number + 1 for number in filled]
                return _with_titles(given, lines, f"Excel, sheet {shown(name)}", "")
    except (CalamineError, ValueError, OSError) as error:
        raise InputError(f"this is no Excel file that can be read: {error}") from error
    raise InputError("no sheet of the Excel file has a row below its titles")


def _cell_text(cell: object) -> str:
    if isinstance(cell, float) and cell.is_integer():
        return str(int(cell))
    if isinstance(cell, bool):
        return str(int(cell))
    text = "" if cell is None else str(cell)
    return text.strip()


def _with_titles(
    rows: Sequence[tuple[str, ...]], lines: Sequence[int], kind: str, separator: str
) -> GivenTable:
    """Find the titles: the first line as wide as most, with few numbers."""
    if not rows:
        raise InputError("the table is empty")

    def width(row: Sequence[str]) -> int:
        return max((n for n, cell in enumerate(row, start=1) if cell), default=0)

    usual = Counter(width(row) for row in rows[-200:]).most_common(1)[0][0]
    head = next((n for n, row in enumerate(rows) if width(row) >= max(usual - 1, 2)), None)
    if head is None:
        raise InputError(
            f"this is no table: its lines have one value each, the first {shown(rows[0][0])}"
        )
    titles = rows[head]
    count = max(len(titles), usual)
    if len(rows) <= head + 1:
        raise InputError("there are no lines below the titles", element=f"line {lines[head]}")
    body = [(*row, *[""] * (count - len(row)))[: max(count, len(row))] for row in rows[head + 1 :]]
    titles = (*titles, *[""] * (count - len(titles)))
    return GivenTable(titles, tuple(body), tuple(lines[head + 1 :]), kind, separator)


class FreeTable:
    """A table, with what its columns have."""

    def __init__(self, table: GivenTable, options: ReadingOptions) -> None:
        self._table = table
        self._options = options
        self._left: list[LeftOut] = []
        self._notes: list[str] = []
        self.columns: dict[str, str] = {}
        self._index: dict[str, int] = {}
        lower = {title.lower(): n for n, title in reversed([*enumerate(table.titles)])}
        for role, title in options.columns.items():
            if role not in _ROLES:
                raise InputError(
                    f"no column is a {shown(role)}; columns are {', '.join(sorted(_ROLES))}"
                )
            if title.lower() not in lower:
                listed = ", ".join(shown(name) for name in table.titles)
                raise InputError(f"no column has the title {shown(title)}; there are {listed}")
            self._put_column(role, lower[title.lower()])
        cells = (cell for row in table.rows[:2000] for cell in row)
        self._comma = table.separator != "," and has_decimal_commas(cells)

    def _put_column(self, role: str, column: int) -> None:
        self._index[role] = column
        self.columns[role] = self._table.titles[column]

    def _guess_columns(self, *roles: str) -> None:
        """Give roles that have no column the first whose title, or a word of it, is one of theirs.

        Titles that are one of a role as a whole go first.
        """
        for fits in (_is_title_of, _has_word_of):
            for role in roles:
                taken = set(self._index.values())
                for column, title in enumerate(self._table.titles):
                    if role not in self._index and column not in taken and fits(role, title):
                        self._put_column(role, column)

    def read(self) -> TrafficFile:
        """Read what it is.

        Raises
        ------
        InputError
            If its columns are not enough for any kind; says which were found.
        """
        square = self._square_zones()
        if square:
            return self._read_square(square)
        titles = [normalised(title) for title in self._table.titles]
        zones = self._zone_columns(titles)
        if zones is not None:
            return self._read_zones(*zones)
        pairs = [
            any(
                _is_title_of(role, title) or _has_word_of(role, title)
                for title in self._table.titles
            )
            for role in ("origin", "destination", "trips")
        ]
        timed = any(re.fullmatch(_ROLES["station"], title) for title in titles)
        given = {"origin", "destination"} <= self._index.keys()
        if given or (all(pairs) and not timed and "station" not in self._index):
            self._guess_columns("origin", "destination", "trips", "time", "end")
            if {"origin", "destination", "trips"} <= self._index.keys():
                return self._read_pairs()
        slices = self._time_columns()
        if len(slices) >= 2 and len(slices) >= len(titles) - 8:
            self._guess_columns(
                "station", "date", "bearing", "lon", "lat", "x", "y", "edge", "lane", "pos"
            )
            return self._read_wide(slices)
        self._guess_columns("lon", "lat", "edge", "lane", "pos", "number", "date", "time", "end")
        self._guess_columns("count", "station")
        self._guess_columns("bearing", "x", "y")
        return self._read_long()

    # ------------------------------------------------------------------ matrices

    def _zone_columns(self, titles: Sequence[str]) -> tuple[int, int] | None:
        """Columns of a zone and of its segments or edges, in a table of two columns."""
        zone = r"zones?|bezirke?|taz|districts?|verkehrsbezirk|(zone|taz|bezirk)(id|nr|name)"
        place = r"segments?|edges?|links?|kanten?|roads?|edgeid|segmentid"
        first = next((n for n, title in enumerate(titles) if re.fullmatch(zone, title)), None)
        second = next((n for n, title in enumerate(titles) if re.fullmatch(place, title)), None)
        if first is None or second is None or len([title for title in titles if title]) > 2:
            return None
        return first, second

    def _read_zones(self, zone: int, place: int) -> TrafficFile:
        found: dict[str, list[str]] = {}
        for row, line in zip(self._table.rows, self._table.lines, strict=True):
            if row[zone] and row[place]:
                found.setdefault(row[zone], []).extend(row[place].split())
            else:
                self._leave_out(line, "no zone or no place")
        return TrafficFile(
            what=f"a table of {len(found)} zones ({self._table.kind})",
            rows=len(self._table.rows),
            zones={name: tuple(dict.fromkeys(places)) for name, places in found.items()},
            left_out=tuple(self._left),
        )

    def _square_zones(self) -> list[str]:
        """Destinations of a square matrix; none if it is not one."""
        titles = self._table.titles
        if titles[0].strip().lower() not in _CORNERS or self._options.columns:
            return []
        labels = {row[0] for row in self._table.rows}
        ends = [title for title in titles[1:] if title]
        shared = labels & set(ends)
        enough = len(ends) > 1 and len(shared) >= 0.5 * len(ends)
        return list(titles[1:]) if enough else []

    def _read_square(self, ends: Sequence[str]) -> TrafficFile:
        trips: list[TripRow] = []
        total = 0
        for row, line in zip(self._table.rows, self._table.lines, strict=True):
            sums = normalised(row[0]) in ("sum", "summe", "total", "gesamt")
            for end, cell in zip(ends, row[1:], strict=False):
                if sums or not end or normalised(end) in ("sum", "summe", "total", "gesamt"):
                    continue
                total += 1
                value = self._read_value(cell, line, f"{row[0]} to {end}")
                if value:
                    trips.append(TripRow(row[0], end, value, None, None, line))
        zones = {row.origin for row in trips} | {row.destination for row in trips}
        return self._make_file(
            f"a square matrix with {len(zones)} zones", total, trips=tuple(trips)
        )

    def _read_pairs(self) -> TrafficFile:
        stamps = self._stamp_reader("time") if "time" in self._index else None
        trips: list[TripRow] = []
        of_day = False
        zones: dict[str, None] = {}
        for row, line in zip(self._table.rows, self._table.lines, strict=True):
            origin, destination = row[self._index["origin"]], row[self._index["destination"]]
            if not origin or not destination:
                self._leave_out(line, "no origin or destination")
                continue
            zones |= dict.fromkeys((origin, destination))
            value = self._read_value(row[self._index["trips"]], line, f"{origin} to {destination}")
            begin = end = None
            if stamps is not None and "end" in self._index:
                first = stamps.read(row[self._index["time"]])
                last = stamps.read(row[self._index["end"]])
                begin, end, of_day = first.second, last.second, of_day or first.of_day
            if value:
                trips.append(TripRow(origin, destination, value, begin, end, line))
        what = f"a matrix in rows with {len(zones)} zones"
        return self._make_file(what, len(self._table.rows), trips=tuple(trips), of_day=of_day)

    # ------------------------------------------------------------------ counts

    def _time_columns(self) -> list[int]:
        """Columns whose titles are slices of time."""
        reader = StampReader(self._table.titles)
        columns = []
        for column, title in enumerate(self._table.titles):
            if re.fullmatch(r"\d{1,2}[:.]\d{2}.*|\d{1,2}\s*(?:-|–|bis|to)\s*\d{1,2}.*", title):
                try:
                    reader.read(title)
                except InputError:
                    continue
                columns.append(column)
        return columns

    def _read_wide(self, slices: Sequence[int]) -> TrafficFile:
        if "station" not in self._index:
            first = next((n for n in range(len(self._table.titles)) if n not in slices), None)
            if first is None:
                raise InputError("no column says which station a row is of")
            self._put_column("station", first)
        reader = StampReader(self._table.titles)
        stamps = {column: reader.read(self._table.titles[column]) for column in slices}
        begins = sorted({stamp.second for stamp in stamps.values()})
        length = self._options.interval or min(
            (after - before for before, after in pairwise(begins)), default=HOUR
        )
        rows: list[VolumeRow] = []
        stations: dict[str, StationPlace] = {}
        chosen = self._chosen_date()
        for row, line in zip(self._table.rows, self._table.lines, strict=True):
            station = row[self._index["station"]]
            if not station:
                self._leave_out(line, "no station")
                continue
            if chosen is not None and row[self._index["date"]] != chosen:
                continue
            stations.setdefault(station, self._station_place(row, line))
            for column in slices:
                stamp = stamps[column]
                cell = row[column]
                value = self._read_value(cell, line, f"{station} at {self._table.titles[column]}")
                if value is not None:
                    end = stamp.end or stamp.second + length
                    rows.append(VolumeRow(station, stamp.second, end, value, line))
        self.columns["time"] = f"{self._table.titles[slices[0]]} ... ({len(slices)} columns)"
        what = f"counts of {len(stations)} stations with a column for each of {len(slices)} slices"
        total = len(self._table.rows) * len(slices)
        return self._make_file(
            what, total, volumes=tuple(rows), stations=_stations_with_place(stations), of_day=True
        )

    def _chosen_date(self) -> str | None:
        """Text of the day that is taken of a table with a day in each row."""
        if "date" not in self._index:
            return None
        days = Counter(row[self._index["date"]] for row in self._table.rows)
        asked = self._options.date
        if asked is not None:
            reader = StampReader(days, compact=True)
            for text in days:
                day = reader.read(text).day
                if text == asked or (day is not None and day.isoformat() == asked):
                    return text
            raise InputError(f"the table has no rows of {shown(asked)}")
        chosen = max(days, key=lambda text: days[text])
        if len(days) > 1:
            self._notes.append(
                f"the table has {len(days)} days: {chosen} was taken (--date chooses another)"
            )
        return chosen

    def _read_long(self) -> TrafficFile:
        table = self._table
        classes = self._class_columns()
        counted = "count" in self._index or bool(classes)
        if not counted and "time" in self._index and "station" not in self._index:
            return self._read_station_columns()
        if "station" not in self._index:
            for role in ("edge", "lane"):
                if role in self._index:
                    self._put_column("station", self._index[role])
                    break
        placed = {"edge", "lane"} & self._index.keys() or {"lon", "lat"} <= self._index.keys()
        placed = placed or {"x", "y"} <= self._index.keys()
        if "station" in self._index and placed and "count" not in self._index and not classes:
            return self._read_places()
        if counted and "time" in self._index and "station" not in self._index:
            self._notes.append(
                f"no column names a station: all rows are of one, called {ONLY_STATION!r}; say "
                "where it is in a table of stations"
            )
        only = counted and "time" in self._index
        needed = ("time",) if only else ("station", "time")
        missing = [role for role in needed if role not in self._index]
        if "count" not in self._index and not classes:
            missing.append("count")
        if missing:
            listed = ", ".join(shown(title) for title in table.titles)
            known = ", ".join(f"{role} {shown(title)}" for role, title in self.columns.items())
            raise InputError(
                f"this is a table ({table.kind}), but no column was recognised as "
                f"{' and '.join(missing)}; its titles are {listed:.400}"
                + (f"; recognised were {known}" if known else "")
                + f"; say which they are: --columns {','.join(f'{m}=TITLE' for m in missing)}"
            )
        return self._read_rows(classes)

    def _class_columns(self) -> dict[int, str]:
        """Columns of single kinds of vehicles, where none has all of them."""
        categories: dict[int, str] = {}
        for column, title in enumerate(self._table.titles):
            if column not in self._index.values():
                for category, pattern in _CLASSES.items():
                    if re.fullmatch(pattern, normalised(title)):
                        categories[column] = category
        return categories

    def _read_rows(self, classes: Mapping[int, str]) -> TrafficFile:
        table = self._table
        columns = [self._index["count"]] if "count" in self._index else list(classes)
        if "count" not in self._index:
            self.columns["count"] = " + ".join(table.titles[column] for column in columns)
        elif classes:
            listed = ", ".join(shown(table.titles[column]) for column in classes)
            self._notes.append(f"{listed} were not used: {shown(self.columns['count'])} has all")
        rate = any(
            re.search(r"/\s*(?:h|std)\b|\bper hour\b|pro stunde|hourly", table.titles[c].lower())
            for c in columns
        )
        stamps = self._stamp_reader("time")
        end_reader = self._stamp_reader("end") if "end" in self._index else stamps
        dates = self._stamp_reader("date") if "date" in self._index else None
        read: list[tuple[str, Stamp, float | None, float, int]] = []
        stations: dict[str, StationPlace] = {}
        for row, line in zip(table.rows, table.lines, strict=True):
            station = row[self._index["station"]] if "station" in self._index else ONLY_STATION
            if not station:
                self._leave_out(line, "no station")
                continue
            try:
                stamp = stamps.read(row[self._index["time"]])
                end = stamp.end
                if "end" in self._index:
                    last = end_reader.read(row[self._index["end"]])
                    end = last.second if last.second > stamp.second else last.second + DAY
                if dates is not None and stamp.day is None:
                    stamp = stamp._replace(day=dates.read(row[self._index["date"]]).day)
            except InputError as error:
                self._leave_out(line, str(error))
                continue
            stations.setdefault(station, self._station_place(row, line))
            values = [self._read_value(row[column], line, station) for column in columns]
            known = [value for value in values if value is not None]
            if known:
                read.append((station, stamp, end, sum(known), line))
        if not read:
            raise InputError(
                f"no row of the table can be used: {self._left[0].source}: {self._left[0].reason}"
                if self._left
                else "the table has no rows"
            )
        if stamps.ambiguous:
            order = "month/day" if stamps.months_first else "day/month"
            self._notes.append(f"dates such as 3/4 were read as {order}")
        if stamps.had_offset:
            self._notes.append(
                "stamps have an offset to UTC; their own times of day were taken "
                "(--time-zone Europe/Berlin converts them)"
            )
        kept = (
            self._add_lanes(self._choose_day(read))
            if "number" in self._index
            else (self._choose_day(read))
        )
        length = self._slice_length([(name, stamp.second) for name, stamp, *_ in kept])
        volumes = []
        for station, stamp, end, value, line in kept:
            until = stamp.second + length if end is None else end
            number = value * (until - stamp.second) / HOUR if rate else value
            volumes.append(VolumeRow(station, stamp.second, until, number, line))
        if rate:
            self._notes.append("vehicles per hour were turned into vehicles of the slice")
        what = f"counts of {len({row.station for row in volumes})} stations in rows"
        return self._make_file(
            what,
            len(table.rows),
            volumes=tuple(volumes),
            stations=_stations_with_place(stations),
            of_day=any(stamp.of_day for _, stamp, *_ in kept),
        )

    def _add_lanes(
        self, read: Sequence[tuple[str, Stamp, float | None, float, int]]
    ) -> list[tuple[str, Stamp, float | None, float, int]]:
        """Rows of the lanes of a station at one time as one row."""
        sums: dict[tuple[str, Stamp, float | None], tuple[float, int]] = {}
        for station, stamp, end, value, line in read:
            before, first = sums.get((station, stamp, end), (0.0, line))
            sums[station, stamp, end] = before + value, first
        if len(sums) < len(read):
            self._notes.append("rows of the lanes of a station were added up")
        return [(*key, value, line) for key, (value, line) in sums.items()]

    def _read_station_columns(self) -> TrafficFile:
        """A time in each row, and a column for each station."""
        table = self._table
        stamps = self._stamp_reader("time")
        others = [n for n in range(len(table.titles)) if n not in self._index.values()]
        columns = [n for n in others if table.titles[n]]
        numeric = [n for n in columns if self._is_numeric(n)]
        if not numeric:
            listed = ", ".join(shown(title) for title in table.titles)
            raise InputError(f"no column of the table has counts; its titles are {listed:.400}")
        read: list[tuple[str, Stamp, float | None, float, int]] = []
        for row, line in zip(table.rows, table.lines, strict=True):
            try:
                stamp = stamps.read(row[self._index["time"]])
            except InputError as error:
                self._leave_out(line, str(error))
                continue
            for column in numeric:
                value = self._read_value(row[column], line, table.titles[column])
                if value is not None:
                    read.append((table.titles[column], stamp, stamp.end, value, line))
        kept = self._choose_day(read)
        length = self._slice_length([(name, stamp.second) for name, stamp, *_ in kept])
        volumes = tuple(
            VolumeRow(
                name, stamp.second, stamp.second + length if end is None else end, value, line
            )
            for name, stamp, end, value, line in kept
        )
        self.columns["count"] = f"{table.titles[numeric[0]]} ... ({len(numeric)} columns)"
        return self._make_file(
            f"counts with a column for each of {len(numeric)} stations",
            len(table.rows) * len(numeric),
            volumes=volumes,
            of_day=any(stamp.of_day for _, stamp, *_ in kept),
        )

    def _read_places(self) -> TrafficFile:
        stations: dict[str, StationPlace] = {}
        for row, line in zip(self._table.rows, self._table.lines, strict=True):
            name = row[self._index["station"]]
            place = self._station_place(row, line)
            if not name:
                self._leave_out(line, "no station")
            elif not _stations_with_place({name: place}):
                self._leave_out(line, f"{name}: no place")
            else:
                stations[name] = place
        what = f"a table of {len(stations)} places of stations"
        return self._make_file(what, len(self._table.rows), stations=stations)

    # ------------------------------------------------------------------ cells

    def _is_numeric(self, column: int) -> bool:
        cells = [row[column] for row in self._table.rows[:50] if not is_missing(row[column])]
        try:
            return bool(cells) and all(self._parse_number(cell) >= 0 for cell in cells)
        except InputError:
            return False

    def _parse_number(self, cell: str) -> float:
        return parse_number(cell, decimal_comma=self._comma)

    def _read_value(self, cell: str, line: int, what: str) -> float | None:
        if is_missing(cell):
            self._leave_out(line, f"{what}: no value")
            return None
        try:
            value = self._parse_number(cell)
        except InputError as error:
            self._leave_out(line, f"{what}: {error}")
            return None
        if not 0.0 <= value <= 1e7:
            self._leave_out(line, f"{what}: {value:g} vehicles")
            return None
        return value

    def _leave_out(self, line: int, reason: str) -> None:
        self._left.append(LeftOut(f"row {line} of the file", reason))

    def _stamp_reader(self, role: str) -> StampReader:
        column = self._index[role]
        title = self._table.titles[column]
        name = normalised(title)
        unit: Unit = "s"
        if re.search(r"\bmin|minute", title.lower()):
            unit = "min"
        elif name in ("hour", "hourofday", "stunde", "heure", "hora") or "[h]" in title.lower():
            unit = "h"
        elif name == "time" and any(t in ("qPKW", "qLKW") for t in self._table.titles):
            unit = "min"
            self._notes.append("times are minutes, as in the detector files of SUMO's tools")
        cells = [row[column] for row in self._table.rows]
        hours = {int(cell) for cell in cells if cell.isdecimal() and len(cell) <= 2}
        counted_from_1 = unit == "h" and 24 in hours and 0 not in hours
        if counted_from_1:
            self._notes.append("hours are counted from 1 to 24: the first begins at midnight")
        return StampReader(
            cells,
            unit=unit,
            time_zone=self._options.time_zone,
            compact=role == "date",
            hours_from_1=counted_from_1,
        )

    def _choose_day(
        self, read: Sequence[tuple[str, Stamp, float | None, float, int]]
    ) -> list[tuple[str, Stamp, float | None, float, int]]:
        """Rows of the day that is asked for, or of the one with most of them."""
        days = Counter(stamp.day for _, stamp, *_ in read if stamp.day is not None)
        if not days:
            return list(read)
        names = sorted(day.isoformat() for day in days)
        if self._options.date is not None:
            if self._options.date not in names:
                raise InputError(
                    f"the table has no rows of {shown(self._options.date)}; its days are "
                    f"{some_of(names, between=', ')}"
                )
            chosen = self._options.date
        else:
            most = max(days.values())
            chosen = min(day.isoformat() for day, rows in days.items() if rows == most)
        kept = [row for row in read if row[1].day is None or row[1].day.isoformat() == chosen]
        if len(days) > 1:
            self._notes.append(
                f"the table has {len(days)} days, {names[0]} to {names[-1]}: {chosen} was taken "
                f"(--date chooses another); {len(read) - len(kept)} rows of others were left out"
            )
        return kept

    def _slice_length(self, begins: Sequence[tuple[str, float]]) -> float:
        """Seconds of a row: what is asked for, or what lies between two of a station."""
        if self._options.interval is not None:
            return self._options.interval
        if "end" in self._index:
            return HOUR  # rows have their own
        by_station: dict[str, set[float]] = defaultdict(set)
        for station, begin in begins:
            by_station[station].add(begin)
        steps = [
            after - before
            for found in by_station.values()
            for before, after in pairwise(sorted(found))
        ]
        if not steps:
            self._notes.append(
                "each station has one time only: rows were taken as counts of an hour "
                "(--interval says how long they are)"
            )
            return HOUR
        often = Counter(round(step, 3) for step in steps)
        return float(min(step for step, number in often.items() if number == max(often.values())))

    def _station_place(self, row: Sequence[str], line: int) -> StationPlace:
        def number(role: str) -> float | None:
            if role not in self._index or is_missing(row[self._index[role]]):
                return None
            cell = row[self._index[role]]
            try:
                return parse_number(cell, decimal_comma="," in cell and "." not in cell)
            except InputError as error:
                self._leave_out(line, f"{role}: {error}")
                return None

        def word(role: str) -> str | None:
            return row[self._index[role]] or None if role in self._index else None

        bearing = None
        text = word("bearing")
        if text is not None:
            key = "".join(c for c in unicodedata.normalize("NFKD", text.lower()) if c.isalpha())
            bearing = _COMPASS.get(key)
            if bearing is None and re.fullmatch(r"\d+(\.\d+)?", text) and float(text) > 8:
                bearing = float(text) % 360.0
        point = None
        degrees = {"lon", "lat"} <= self._index.keys()
        x, y = (number("lon"), number("lat")) if degrees else (number("x"), number("y"))
        if degrees and not (-180 <= (x or 0) <= 180 and -90 <= (y or 0) <= 90):
            self._leave_out(line, f"longitude {x}, latitude {y}: no such place")
        elif x is not None and y is not None:
            point = (x, y)
        return StationPlace(word("edge"), word("lane"), number("pos"), point, degrees, bearing)

    def _make_file(
        self,
        what: str,
        rows: int,
        *,
        trips: tuple[TripRow, ...] = (),
        volumes: tuple[VolumeRow, ...] = (),
        stations: dict[str, StationPlace] | None = None,
        of_day: bool = False,
    ) -> TrafficFile:
        comma = ", decimal commas" if self._comma else ""
        return TrafficFile(
            what=f"{what} ({self._table.kind}{comma})",
            of_day=of_day,
            rows=rows,
            trips=trips,
            volumes=volumes,
            stations=stations or {},
            left_out=tuple(self._left),
            notes=tuple(self._notes),
            columns=dict(self.columns),
        )


def _stations_with_place(stations: Mapping[str, StationPlace]) -> dict[str, StationPlace]:
    """Stations of which the table says where they are."""
    return {
        name: place
        for name, place in stations.items()
        if place.point is not None or place.edge is not None or place.lane is not None
    }


def iterate_titles(table: GivenTable) -> Iterator[str]:
    """Titles of a table, as a mapping of columns that is kept is found by."""
    yield from (title.strip().lower() for title in table.titles)
