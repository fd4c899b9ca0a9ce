"""Files of trips, counts and detectors from any program, put into a scenario, with a report."""

from __future__ import annotations

import json
import re
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal

from odscen.app.demand.map_stations import MapPlace, StationFinder
from odscen.app.maps import map_of
from odscen.base.checksums import digest
from odscen.base.errors import InputError, in_file
from odscen.base.given_files import as_path, read_given
from odscen.base.shown import some_of
from odscen.base.text_files import write_text
from odscen.formats.office.free_table import iterate_titles
from odscen.formats.office.read_traffic import DEFAULT, read_traffic
from odscen.lanegraph.query import node_id
from odscen.scenario import edits
from odscen.scenario.edits.demand_edits import put_parts

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from odscen.app.maps import LoadedMap
    from odscen.base.given_files import GivenPath
    from odscen.formats.office.free_table import GivenTable
    from odscen.formats.office.traffic_file import (
        LeftOut,
        ReadingOptions,
        StationPlace,
        TrafficFile,
        VolumeRow,
    )
    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario

COLUMNS_FILE = "table-columns.json"
"""In the workspace: columns that were said of tables, by the digest of their titles."""

_JUMP = 4.0
"""How many times both neighbours a count has to be, or they it, to be called a jump."""
_LEAST_JUMP = 30.0
"""Vehicles by which a jump differs at least."""
_ZEROS = 3
"""Slices without a vehicle, between some with, from which on a station seems to have been out."""
_ALIKE = 6
"""Equal counts in a row, above 0, from which on a station seems to have been stuck."""
_NAME = re.compile(r"[^A-Za-z0-9_.-]+")


@dataclass(slots=True)
class TrafficReport:
    """What has become of a file.

    Attributes
    ----------
    what
        What it is, in words.
    rows, taken
        Rows with values it has, and those that are in the scenario.
    left_out
        Places in the file and reasons.
    placed
        Where stations and zones were found: place on the map, by their name in the file.
    unplaced
        Reasons, by name.
    notes
        What was assumed.
    doubts
        Values that do not look like traffic.
    next
        What to do then.
    columns
        Columns that were taken, by what they have.
    """

    what: str
    rows: int = 0
    taken: int = 0
    left_out: list[tuple[str, str]] = field(default_factory=list)
    placed: dict[str, str] = field(default_factory=dict)
    unplaced: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)
    next: str = ""
    columns: dict[str, str] = field(default_factory=dict)

    @property
    def words(self) -> str:
        """One sentence."""
        return f"this is {self.what}: {self.taken:,} of {self.rows:,} rows taken"

    def to_dict(self) -> dict[str, Any]:
        """Form for JSON."""
        return {
            "what": self.what,
            "rows": self.rows,
            "taken": self.taken,
            "columns": self.columns,
            "left_out": [{"where": where, "reason": reason} for where, reason in self.left_out],
            "placed": self.placed,
            "unplaced": self.unplaced,
            "notes": self.notes,
            "doubts": self.doubts,
            "next": self.next,
        }


def import_traffic(
    workspace: Workspace,
    scenario: Scenario,
    file: GivenPath,
    *,
    stations: GivenPath | None = None,
    options: ReadingOptions = DEFAULT,
    name: str | None = None,
    use: Literal["generate", "compare"] = "generate",
    **fields: Any,
) -> tuple[Scenario, TrafficReport]:
    """Read a file of trips, counts or detectors, whatever program has written it.

    Columns that are said of a table are kept in the workspace, for others with the same titles.

    Parameters
    ----------
    stations
        Another file that says where the stations of this one are.
    options
        What the user says of tables.
    name
        Of the part of the demand; a name of its kind if not given.
    use
        Whether traffic is made that reproduces counts, or other traffic is held against them.
    fields
        Further fields of the part, such as ``mix`` and ``profile``.

    Raises
    ------
    InputError
        If nothing of it can be used; says what the file is, and what to do.
    """
    loaded = map_of(workspace, scenario)
    kept = _KeptColumns(workspace.root / COLUMNS_FILE)
    places: Mapping[str, StationPlace] = {}
    if stations is not None:
        with in_file(str(stations)):
            places = read_traffic(read_given(as_path(stations))).stations
            if not places:
                raise InputError("this file says of no station where it is")
    with in_file(str(file)):
        read = read_traffic(read_given(as_path(file)), options=options, known_columns=kept.of)
        changed, report = put_traffic(
            loaded, scenario, read, places=places, name=name, use=use, **fields
        )
    if options.columns:
        kept.remember(options.columns)
    return changed, report


class _KeptColumns:
    """Columns that were said of tables before."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._key = ""

    def of(self, table: GivenTable) -> Mapping[str, str]:
        """Columns that were said of a table with the same titles."""
        self._key = digest("\n".join(iterate_titles(table)).encode())
        columns: Mapping[str, str] = self._read_all_mappings().get(self._key, {})
        return columns

    def remember(self, columns: Mapping[str, str]) -> None:
        """Keep the columns of the table that was read last."""
        if self._key:
            known = {**self._read_all_mappings(), self._key: dict(columns)}
            write_text(self._file, json.dumps(known, indent=1, sort_keys=True) + "\n")

    def _read_all_mappings(self) -> dict[str, dict[str, str]]:
        if not self._file.is_file():
            return {}
        try:
            known = json.loads(self._file.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return known if isinstance(known, dict) else {}


def put_traffic(
    loaded: LoadedMap,
    scenario: Scenario,
    read: TrafficFile,
    *,
    places: Mapping[str, StationPlace] | None = None,
    name: str | None = None,
    use: Literal["generate", "compare"] = "generate",
    **fields: Any,
) -> tuple[Scenario, TrafficReport]:
    """Put what was read into a scenario; parameters as of :func:`import_traffic`.

    Raises
    ------
    InputError
        If nothing of it can be used.
    """
    report = TrafficReport(read.what, rows=read.rows, columns=dict(read.columns))
    report.left_out = [(left.source, left.reason) for left in _sum_up_left_out(read.left_out)]
    report.notes = list(read.notes)
    finder = StationFinder(loaded)
    known = {**(places or {}), **read.stations}
    scenario = _start_at_first(scenario, read, report)
    if read.zones:
        scenario = _put_zones(loaded, scenario, read, finder, report)
    if read.trips:
        scenario = _put_trips(loaded, scenario, read, finder, report, name=name, **fields)
    if read.volumes:
        volumes = _VolumeWriter(finder, scenario, read, known, report)
        scenario = volumes.put(loaded, name=name, use=use, **fields)
    elif read.stations and not read.turns:
        scenario = _put_detectors(loaded, scenario, read, finder, report)
    if read.turns:
        scenario = _put_turns(loaded, scenario, read, finder, report, name=name, use=use, **fields)
    return scenario, report


def _sum_up_left_out(left: Iterable[LeftOut]) -> list[LeftOut]:
    """Rows left out; of many for want of a value only the first."""
    listed = list(left)
    empty = [row for row in listed if row.reason.endswith(": no value")]
    if len(empty) <= 5:
        return listed
    others = [row for row in listed if not row.reason.endswith(": no value")]
    more = empty[0]._replace(reason=f"{empty[0].reason}; and {len(empty) - 1} more without a value")
    return [more, *others]


def _start_at_first(scenario: Scenario, read: TrafficFile, report: TrafficReport) -> Scenario:
    """Let a run without a time of day and other demand start with the first count of the day."""
    begins = [row.begin for row in read.volumes]
    if not read.of_day or not begins or scenario.demand.clock or scenario.demand.parts:
        return scenario
    first = min(begins)
    if not 0 < first < 86_400:
        return scenario
    report.notes.append(
        f"the run now starts at {_format_clock(first)}, when the first count begins"
    )
    return edits.set_clock(scenario, clock=first)


def _format_clock(seconds: float) -> str:
    minutes = round(seconds) // 60
    return f"{minutes // 60:02d}:{minutes % 60:02d}"


def _part_id(name: str) -> str:
    """A name as ids of the document may be."""
    return _NAME.sub("-", name).strip("-._")[:64] or "part"


# ---------------------------------------------------------------------------- zones and trips


def _put_zones(
    loaded: LoadedMap,
    scenario: Scenario,
    read: TrafficFile,
    finder: StationFinder,
    report: TrafficReport,
) -> Scenario:
    parts: dict[str, dict[str, Any]] = {}
    for zone, edges in read.zones.items():
        own = [edge for edge in edges if finder.is_segment(edge)]
        segments = tuple(dict.fromkeys([*own, *finder.segments_of_edges(edges)]))
        if not segments:
            report.unplaced[zone] = "none of its edges is on the map"
            continue
        parts[_part_id(zone)] = {"segments": segments}
        report.placed[zone] = some_of(segments, between=", ")
    if not parts:
        raise InputError(
            f"this is {read.what}, but none of its edges is on the map: bring the network in that "
            "they are of (odscen maps network MAP --from FILE.net.xml)"
        )
    report.taken += len(parts)
    report.next = "import a matrix of these zones: odscen demand import SCENARIO FILE"
    return put_parts(scenario, loaded.sumo.graph, "zones", parts)


def _put_trips(
    loaded: LoadedMap,
    scenario: Scenario,
    read: TrafficFile,
    finder: StationFinder,
    report: TrafficReport,
    *,
    name: str | None,
    **fields: Any,
) -> Scenario:
    zones = {zone.id for zone in scenario.demand.zones}
    labels = dict.fromkeys(label for row in read.trips for label in (row.origin, row.destination))
    for label in labels:
        candidates = (label, _part_id(label), read.names.get(label, label))
        found = next(
            (
                candidate
                for candidate in candidates
                if candidate in zones or finder.is_segment(candidate)
            ),
            None,
        )
        if found is None:
            try:
                found = finder.of_name(label).place.split(">")[0]
            except InputError:
                report.unplaced[label] = "no zone of the scenario and no road of the map"
                continue
        report.placed[label] = found
    if not report.placed:
        raise InputError(
            f"this is {read.what}, but none of them is a zone of the scenario or a road of the "
            f"map: {some_of(list(labels), between=', ')}; first import where they are "
            "(columns zone and segment, or SUMO's taz file): odscen demand import SCENARIO ZONES"
        )
    clock, slices = scenario.demand.clock, defaultdict(list)
    for row in read.trips:
        ends = report.placed.get(row.origin), report.placed.get(row.destination)
        if ends[0] is None or ends[1] is None:
            missing = row.origin if ends[0] is None else row.destination
            report.left_out.append(
                (f"row {row.line} of the file", f"zone {missing} is not on the map")
            )
            continue
        slices[row.begin, row.end].append((ends[0], ends[1], row.trips))
    parts: dict[str, dict[str, Any]] = {}
    for number, ((begin, end), trips) in enumerate(sorted(slices.items(), key=str), start=1):
        own = (name or "trips") + ("" if len(slices) == 1 else f"-{number}")
        window = _window_of_matrix(begin, end, clock if read.of_day else 0.0)
        if window is None:
            reason = f"{len(trips)} rows are of a time before the run starts"
            report.left_out.append(
                (f"{_format_clock(begin or 0)} to {_format_clock(end or 0)}", reason)
            )
            continue
        first, last, share = window
        if share < 1.0:
            report.notes.append(
                f"of the trips from {_format_clock(begin or 0)} to {_format_clock(end or 0)} "
                f"the {share:.0%} after the start of the run were taken"
            )
        added: dict[tuple[str, str], float] = defaultdict(float)
        for origin, destination, count in trips:
            added[origin, destination] += count * share
        parts[own] = {
            "trips": tuple((a, b, round(count, 6)) for (a, b), count in added.items()),
            **({} if first is None else {"begin": first, "end": last}),
            **{key: value for key, value in fields.items() if value is not None},
        }
        report.taken += len(trips)
    if not parts:
        raise InputError(f"this is {read.what}, but no row of it can be used: see its zones")
    inside = sum(row.trips for row in read.trips if row.origin == row.destination)
    if inside:
        report.notes.append(f"{inside:g} trips are within one zone")
    report.next = "run it, or find routes by travel time: odscen demand routes SCENARIO"
    return put_parts(scenario, loaded.sumo.graph, "matrices", parts)


def _window_of_matrix(
    begin: float | None, end: float | None, clock: float
) -> tuple[float | None, float | None, float] | None:
    """Window of a matrix in seconds of the run, and the share of it that is after the start."""
    if begin is None or end is None:
        return None, None, 1.0
    first, last = begin - clock, end - clock
    if last <= 0:
        return None
    share = (last - max(first, 0.0)) / (last - first)
    return max(first, 0.0), last, share


# ---------------------------------------------------------------------------- counts


class _VolumeWriter:
    """Puts counts into a scenario: places them, adds lanes, and looks for what cannot be."""

    def __init__(
        self,
        finder: StationFinder,
        scenario: Scenario,
        read: TrafficFile,
        known: Mapping[str, StationPlace],
        report: TrafficReport,
    ) -> None:
        self._finder = finder
        self._scenario = scenario
        self._read = read
        self._report = report
        self._places: dict[str, MapPlace] = {}
        for station in dict.fromkeys(row.station for row in read.volumes):
            try:
                self._places[station] = finder.locate(station, known.get(station))
            except InputError as error:
                report.unplaced[station] = str(error)
        for station, found in self._places.items():
            report.placed[station] = found.place
            if found.note:
                report.notes.append(f"{station}: {found.note}")

    def put(
        self,
        loaded: LoadedMap,
        *,
        name: str | None,
        use: Literal["generate", "compare"],
        **fields: Any,
    ) -> Scenario:
        """Add the counts."""
        read, report, scenario = self._read, self._report, self._scenario
        if not self._places:
            stations = list(report.unplaced)
            raise InputError(
                f"this is {read.what}, but none of its stations was found on the map: "
                f"{some_of(stations, between=', ')}: {report.unplaced[stations[0]]} "
                "(--stations FILE: a table, or SUMO's definitions of detectors)"
            )
        clock = scenario.demand.clock if read.of_day else 0.0
        rows: dict[tuple[str, float, float], dict[str, VolumeRow]] = defaultdict(dict)
        early = 0
        for row in read.volumes:
            found = self._places.get(row.station)
            if found is None:
                continue
            begin, end = row.begin - clock, row.end - clock
            if begin < 0:
                early += 1
                continue
            slot = rows[found.place, begin, end]
            if row.station in slot:
                reason = f"{row.station}: counted before, in line {slot[row.station].line}"
                report.left_out.append((f"row {row.line} of the file", reason))
                continue
            slot[row.station] = row
        if early:
            report.left_out.append(
                (
                    f"{early} rows",
                    f"they are of times before {_format_clock(clock)}, the start of the run",
                )
            )
        counts: list[tuple[str, float, float, float]] = []
        shared: dict[tuple[str, ...], str] = {}
        for (place, begin, end), slot in sorted(rows.items()):
            used = self._stations_of_place(place, list(slot), shared)
            counts.append((place, begin, end, sum(slot[station].vehicles for station in used)))
            report.taken += len(used)
        report.notes += dict.fromkeys(shared.values())
        if not counts:
            raise InputError(f"this is {read.what}, but none of its rows is after the run starts")
        self._refuse_overlaps(counts)
        if report.unplaced:
            gone = sum(row.station in report.unplaced for row in read.volumes)
            report.left_out.append((f"{gone} rows", "their stations are not on the map"))
        self._judge_counts(counts)
        part = name or (
            "counts" if not scenario.demand.counts else f"counts-{_next_number(scenario)}"
        )
        mix = {key: value for key, value in fields.items() if key == "mix"}
        report.next = (
            "run it: the traffic reproduces the counts"
            if use == "generate"
            else "run it: the result compares the traffic with the counts"
        ) + "; odscen demand fit SCENARIO says which can be met"
        return edits.set_counts(
            scenario, loaded.sumo.graph, counts=part, rows=tuple(counts), use=use, **mix
        )

    def _stations_of_place(
        self, place: str, stations: list[str], notes: dict[tuple[str, ...], str]
    ) -> list[str]:
        """Stations that make up the count of a place: one for each lane, or the first."""
        report, key = self._report, tuple(stations)
        lanes: dict[str, list[str]] = defaultdict(list)
        for station in stations:
            lanes[self._places[station].lane].append(station)
        if "" in lanes and len(stations) > 1:
            notes[key] = f"{place}: {stations[0]} was taken, not {', '.join(stations[1:])}"
            return stations[:1]
        used = [own[0] for lane, own in sorted(lanes.items())]
        edges = {self._places[station].edge for station in used}
        if len(edges) > 1:
            # Detectors one behind the other along a road: those of the edge with most lanes.
            best = max(
                sorted(edges), key=lambda edge: sum(self._places[s].edge == edge for s in used)
            )
            used = [station for station in used if self._places[station].edge == best]
        if len(used) < len(stations):
            others = ", ".join(station for station in stations if station not in used)
            notes[key] = f"{place}: counted by {', '.join(used)}; not added: {others}"
        elif len(used) > 1:
            notes[key] = f"{place}: the lanes {', '.join(used)} were added up"
        place_of = self._places[used[0]]
        if place_of.lane:
            total = self._finder.lanes_of_edge(place_of.edge)
            if len(used) < total:
                doubt = f"{place}: {len(used)} of {total} lanes have a detector"
                if doubt not in report.doubts:
                    report.doubts.append(doubt)
        return used

    def _refuse_overlaps(self, counts: list[tuple[str, float, float, float]]) -> None:
        lengths = Counter(round(end - begin, 3) for _, begin, end, _ in counts)
        usual = lengths.most_common(1)[0][0]
        odd = [row for row in counts if round(row[2] - row[1], 3) != usual]
        for row in odd:
            counts.remove(row)
            self._report.taken -= 1
            reason = f"{row[0]}: its slice has {row[2] - row[1]:g} s, most have {usual:g}"
            self._report.left_out.append(
                (_format_clock(row[1] + self._scenario.demand.clock), reason)
            )

    def _judge_counts(self, counts: Iterable[tuple[str, float, float, float]]) -> None:
        """Look for jumps, zeros, equal values, gaps, and more than a road carries."""
        doubts, clock = self._report.doubts, self._scenario.demand.clock
        by_place: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
        for place, begin, end, number in counts:
            by_place[place].append((begin, end, number))
        found = {place.place: place for place in self._places.values()}
        for place, slices in by_place.items():
            slices.sort()
            numbers = [number for _, _, number in slices]
            capacity = self._finder.capacity_of(found[place])
            for begin, end, number in slices:
                if number * 3600.0 / (end - begin) > capacity:
                    doubts.append(
                        f"{place} at {_format_clock(begin + clock)}: "
                        f"{number * 3600 / (end - begin):,.0f} vehicles an hour, "
                        f"where {capacity:,.0f} can pass"
                    )
            for index in range(1, len(slices) - 1):
                before, here, after = numbers[index - 1 : index + 2]
                low, high = min(before, after), max(before, after)
                up = here > _JUMP * high and here - high >= _LEAST_JUMP
                down = _JUMP * here < low and low - here >= _LEAST_JUMP
                if up or down:
                    doubts.append(
                        f"{place} at {_format_clock(slices[index][0] + clock)}: "
                        f"{here:g} vehicles between {before:g} and {after:g}"
                    )
            doubts += _doubt_equal_values(place, numbers)
            gaps = [
                after[0] - before[1] for before, after in pairwise(slices) if after[0] > before[1]
            ]
            if gaps:
                doubts.append(f"{place}: {len(gaps)} gaps, {sum(gaps) / 60:g} min in all")


def _doubt_equal_values(place: str, numbers: list[float]) -> list[str]:
    """Doubts about equal values in a row."""
    found = []
    begin = 0
    for index in range(1, len(numbers) + 1):
        if index < len(numbers) and numbers[index] == numbers[begin]:
            continue
        length, value = index - begin, numbers[begin]
        inside = begin > 0 and index < len(numbers)
        if value == 0 and length >= _ZEROS and inside:
            found.append(f"{place}: {length} slices without a vehicle between others with")
        elif value > 0 and length >= _ALIKE:
            found.append(f"{place}: {length} slices with {value:g} vehicles each")
        begin = index
    if numbers and not any(numbers):
        found.append(f"{place}: no vehicle at any time")
    return found


def _next_number(scenario: Scenario) -> int:
    taken = {part.id for part in scenario.demand.counts}
    return next(n for n in range(2, len(taken) + 3) if f"counts-{n}" not in taken)


# ---------------------------------------------------------------------------- turns, detectors


def _put_turns(
    loaded: LoadedMap,
    scenario: Scenario,
    read: TrafficFile,
    finder: StationFinder,
    report: TrafficReport,
    *,
    name: str | None,
    use: Literal["generate", "compare"],
    **fields: Any,
) -> Scenario:
    counted = {
        (place, begin, end): number
        for part in scenario.demand.counts
        for place, begin, end, number in part.rows
    }
    sums: dict[tuple[str, float, float], float] = defaultdict(float)
    for row in read.turns:
        if row.share:
            sums[row.origin, row.begin, row.end] += row.value
    rows: dict[tuple[str, float, float], float] = defaultdict(float)
    for row in read.turns:
        try:
            place = finder.turn(row.origin, row.destination)
        except InputError as error:
            report.left_out.append((f"row {row.line} of the file", str(error)))
            continue
        report.placed[f"{row.origin} to {row.destination}"] = place
        if not row.share:
            rows[place, row.begin, row.end] += row.value
            report.taken += 1
            continue
        approach = ">".join(place.split(">")[:2])
        share = row.value / (sums[row.origin, row.begin, row.end] or 1.0)
        own = {
            (begin, end): number
            for (where, begin, end), number in counted.items()
            if where in (approach, place.split(">")[0]) and begin >= row.begin and end <= row.end
        }
        if not own:
            reason = f"a share of {share:.0%} of {approach}, which no count of the scenario has"
            report.left_out.append((f"row {row.line} of the file", reason))
            continue
        report.taken += 1
        for (begin, end), number in own.items():
            rows[place, begin, end] += number * share
    if not rows:
        shares = all(row.share for row in read.turns)
        raise InputError(
            f"this is {read.what}, but none can be used: {report.left_out[-1][1]}"
            + ("; import counts of the approaches first" if shares else "")
        )
    mix = {key: value for key, value in fields.items() if key == "mix"}
    report.next = "odscen demand fit SCENARIO says which counts and turns contradict each other"
    values = tuple((*key, round(value, 6)) for key, value in sorted(rows.items()))
    return edits.set_counts(
        scenario, loaded.sumo.graph, counts=name or "turns", rows=values, use=use, **mix
    )


def _put_detectors(
    loaded: LoadedMap,
    scenario: Scenario,
    read: TrafficFile,
    finder: StationFinder,
    report: TrafficReport,
) -> Scenario:
    """Make detectors of the study of definitions that come without counts."""
    graph = loaded.sumo.graph
    kept = {detector.id: detector.model_dump() for detector in scenario.study.detectors}
    for station, place in read.stations.items():
        try:
            found = finder.locate(station, place)
        except InputError as error:
            report.unplaced[station] = str(error)
            continue
        if found.node < 0:
            report.unplaced[station] = "a place of segments has no line across the road"
            continue
        own = _part_id(station)
        kept[own] = {"id": own, "nodes": (str(node_id(graph, found.node)),)}
        report.placed[station] = found.place
        report.taken += 1
    if not report.taken:
        first = next(iter(report.unplaced.values()))
        raise InputError(
            f"this is {read.what}, but none was found on the map: {first} (bring the network in "
            "that they are of: odscen maps network MAP --from FILE.net.xml)"
        )
    report.next = (
        "run it: each detector has its figures; counts of them are imported with --stations FILE"
    )
    return edits.set_study(scenario, graph, detectors=list(kept.values()))
