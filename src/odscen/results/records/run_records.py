"""What a run is planned to do and what happened: the values that pass between rooms.

A :class:`Plan` is written beside the SUMO files, so that a run can be judged, and repeated, from
its folder alone. Poses are body centres in the OpenDRIVE frame; metres, radians, seconds, m/s.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, fields
from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import orjson

from odscen.base.stored_files import stored_document, typed_rows
from odscen.results.records.planned_stations import PlannedStation

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

_Row = TypeVar("_Row")

PLAN_FORMAT = "odscen-plan"
EVENTS_FORMAT = "odscen-events"
ACTORS_FORMAT = "odscen-actors"
VERSION = 1

_encode = json.JSONEncoder(ensure_ascii=False, allow_nan=False).encode
"""What ``json.dumps`` makes anew at each call; a long run has a row for every event."""


@dataclass(frozen=True, slots=True)
class PlannedActor:
    """One road user that the run is to insert; those of flows are listed one by one.

    Attributes
    ----------
    id
        Id in SUMO: the actor's id, or ``<flow>.<k>``.
    x, y, z, hdg
        Body centre at departure, lateral offset included, OpenDRIVE frame.
    speed
        Desired speed, ``None`` for the limit.
    speed_factor
        Drawn for this actor; multiplies the speed limit (vehicles) or the walking speed.
    route_length
        Metres from the spawn node to the goal along the lane graph.
    free_flow_time
        Seconds of the route at the desired speed without other traffic; ``None`` if unknown.
    flow
        Id of the flow it belongs to, if any.
    problem
        Why it is not in the SUMO files, if it is not.
    informed
        Whether it looks for quicker routes on the way.
    begins_in, ends_in
        Parking areas of its trip: ``depart`` is when it is to leave its place, and it has arrived
        when it takes one.
    appears
        Whether a rule lets it appear; until then it is not due, and ``depart`` is the run's end.
    """

    id: str
    category: str
    spawn: str
    goal: str | None
    depart: float
    length: float
    width: float
    x: float
    y: float
    z: float
    hdg: float
    speed: float | None = None
    speed_factor: float = 1.0
    route_length: float | None = None
    free_flow_time: float | None = None
    model: str | None = None
    flow: str | None = None
    ego: bool = False
    problem: str | None = None
    informed: bool = False
    begins_in: str | None = None
    ends_in: str | None = None
    appears: bool = False

    @property
    def person(self) -> bool:
        """Whether SUMO runs it as a person."""
        return self.category == "pedestrian"


@dataclass(frozen=True, slots=True)
class PlannedMeasure:
    """A measure of the scenario as reports tell it; ``end`` is at most the end of the run.

    ``lines`` are the centre lines of its lanes, x and y in turn, or one place.
    """

    id: str
    kind: str
    words: str
    begin: float
    end: float
    lines: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True, slots=True)
class PlannedParking:
    """A parking area: its segment, how many places it has, and where its middle is, metres."""

    id: str
    segment: str
    places: int
    x: float
    y: float


def begin_area(area: str) -> str:
    """Id by which SUMO knows the places of a parking area that trips begin in."""
    return f"{area}.begin"


@dataclass(frozen=True, slots=True)
class ClosedPeriod:
    """From ``begin`` to ``end`` (s) vehicles of ``vclass`` cannot pass between these edges."""

    begin: float
    end: float
    vclass: str
    pairs: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Plan:
    """What a run is to do.

    Attributes
    ----------
    until, step_length
        Seconds.
    net_offset
        What is added to OpenDRIVE x and y to give SUMO's.
    elevation
        Whether the network has heights.
    slice_length
        Seconds after which the state is saved and the run goes on from what was saved; ``None``
        for a run in one piece.
    trajectories
        Whether they are recorded.
    measures
        Of the scenario, by begin.
    closed
        What they close, by begin: who would pass there must find another route.
    warm_up, interval
        What of the run is analysed, s.
    clock
        Time of day at its start, s after midnight; 0 if the scenario has none.
    stations
        Of its study.
    parking
        Areas, where trips park.
    criteria
        Of the scenario: what must come out for the run to pass.
    """

    scenario: str
    seed: int
    until: float
    step_length: float
    net_offset: tuple[float, float]
    actors: tuple[PlannedActor, ...]
    elevation: bool = False
    slice_length: float | None = None
    trajectories: bool = True
    measures: tuple[PlannedMeasure, ...] = ()
    closed: tuple[ClosedPeriod, ...] = ()
    warm_up: float = 0.0
    interval: float | None = None
    clock: float = 0.0
    stations: tuple[PlannedStation, ...] = ()
    parking: tuple[PlannedParking, ...] = ()
    criteria: tuple[str, ...] = ()

    def to_json(self) -> str:
        """One actor per line; the same plan gives the same text."""
        head: dict[str, Any] = {
            "format": PLAN_FORMAT,
            "version": VERSION,
            "scenario": self.scenario,
            "seed": self.seed,
            "until": self.until,
            "step_length": self.step_length,
            "net_offset": list(self.net_offset),
            "elevation": self.elevation,
            "slice_length": self.slice_length,
            "trajectories": self.trajectories,
        }
        if self.measures:
            head["measures"] = [asdict(one) for one in self.measures]
            head["closed"] = [asdict(one) for one in self.closed]
        said: dict[str, Any] = {
            "warm_up": self.warm_up,
            "interval": self.interval,
            "clock": self.clock,
        }
        said["stations"] = [asdict(one) for one in self.stations]
        said["parking"] = [asdict(one) for one in self.parking]
        said["criteria"] = list(self.criteria)
        head |= {name: value for name, value in said.items() if value}
        return json_with_rows(head, "actors", [_without_defaults(actor) for actor in self.actors])

    @classmethod
    def from_json(cls, text: str) -> Plan:
        """Inverse of :meth:`to_json`.

        Raises
        ------
        InputError
            If it is not a plan of this version.
        """
        with stored_document(
            text, form=PLAN_FORMAT, version=VERSION, what="a plan of a run"
        ) as data:
            x, y = data["net_offset"]
            data["net_offset"] = (float(x), float(y))
            data["actors"] = tuple(map(_PLANNED_ACTOR, data["actors"]))
            data["measures"] = _nested(_PLANNED_MEASURE, data.get("measures", ()), "lines")
            data["closed"] = _nested(_CLOSED_PERIOD, data.get("closed", ()), "pairs")
            data["stations"] = tuple(map(PlannedStation.from_dict, data.get("stations", ())))
            data["parking"] = tuple(map(_PLANNED_PARKING, data.get("parking", ())))
            data["criteria"] = tuple(data.get("criteria", ()))
            return _PLAN({key: data[key] for key in data.keys() - {"format", "version"}})


def _nested(
    make: Callable[[Mapping[str, Any]], _Row], rows: Iterable[Mapping[str, Any]], name: str
) -> tuple[_Row, ...]:
    """Make rows of which one field has tuples of tuples."""
    return tuple(make({**row, name: tuple(map(tuple, row[name]))}) for row in rows)


_PLANNED_ACTOR = typed_rows(PlannedActor)
_PLANNED_MEASURE = typed_rows(PlannedMeasure)
_PLANNED_PARKING = typed_rows(PlannedParking)
_CLOSED_PERIOD = typed_rows(ClosedPeriod)
_PLAN = typed_rows(Plan)


class EventKind(StrEnum):
    """What can happen to an actor.

    A jam is reported of its first vehicle. ``lost``: it did not come back with a saved state.
    ``stranded``: a measure had closed every route to its goal, and it was taken out. Measures begin
    and end; their id stands for that of an actor.
    What a rule does is reported of its actor, at the instant, which may lie inside a step;
    ``rule_acted`` is what no motion follows from, such as lights.
    """

    DEPARTED = "departed"
    ARRIVED = "arrived"
    TELEPORT_START = "teleport_start"
    TELEPORT_END = "teleport_end"
    COLLISION = "collision"
    EMERGENCY_STOP = "emergency_stop"
    JAM_BEGIN = "jam_begin"
    JAM_END = "jam_end"
    LOST = "lost"
    STRANDED = "stranded"
    MEASURE_BEGIN = "measure_begin"
    MEASURE_END = "measure_end"
    RULE_STARTED = "rule_started"
    RULE_ACTED = "rule_acted"
    RULE_ENDED = "rule_ended"
    RULE_FAILED = "rule_failed"
    RULE_OVERRIDDEN = "rule_overridden"


class Event(NamedTuple):
    """Something that happened to ``actor``; a tuple, as a long run makes very many.

    Attributes
    ----------
    x, y
        Body centre (departures, rules), middle of where bodies overlap (collisions found by
        odscen), front (everything else), OpenDRIVE frame; ``None`` if unknown.
    lane
        SUMO lane, where SUMO names one.
    partner
        The other one in a collision.
    error
        Departures: metres between the body's centre and its planned place.
    travel_time
        Arrivals: seconds since departure.
    detail
        SUMO's word for the kind of collision, or ``bodies`` where odscen has found it; why a
        vehicle was gridlocked (teleports, jams); what a measure does; why a rule could not do what
        it says.
    waited
        Seconds that the first vehicle in a jam, or a teleported one, was stopped there.
    queue
        How many vehicles are stopped in a jam.
    rule
        The rule that has started, ended, failed, or given way to another.
    values
        Rules: what the conditions were about, by their place in ``when``. Collisions found by
        odscen: ``impact_speed``, m/s.
    """

    time: float
    kind: EventKind
    actor: str
    x: float | None = None
    y: float | None = None
    lane: str | None = None
    partner: str | None = None
    error: float | None = None
    travel_time: float | None = None
    detail: str | None = None
    waited: float | None = None
    queue: int | None = None
    rule: str | None = None
    values: dict[str, float] | None = None


def event_row(event: Event) -> dict[str, Any]:
    """One event as written in ``events.json``: without what has its default value."""
    return rounded(_without_defaults(event))


def event_line(event: Event) -> str:
    """One event as written in ``events.json``, without indentation and comma."""
    return row_text(_without_defaults(event))


def event_from_line(line: str) -> Event:
    """Inverse of :func:`event_line`."""
    data = orjson.loads(line)
    data["kind"] = EventKind(data["kind"])
    return Event(**data)


def events_to_json(events: Iterable[Event]) -> str:
    """``events.json``: one event per line, in order of time."""
    return "".join(events_text(event_line(event) for event in events))


def events_text(lines: Iterable[str]) -> Iterator[str]:
    """``events.json`` piece by piece, from what :func:`event_line` gives."""
    return text_with_rows({"format": EVENTS_FORMAT, "version": VERSION}, "events", lines)


def events_from_json(text: str) -> tuple[Event, ...]:
    """Inverse of :func:`events_to_json`.

    Raises
    ------
    InputError
        If it is not a list of events of this version.
    """
    return rows_from_json(text, "events", EVENTS_FORMAT, typed_rows(Event))


def json_with_rows(head: Mapping[str, Any], key: str, rows: Iterable[Mapping[str, Any]]) -> str:
    """JSON text of ``{**head, key: rows}`` with one row per line, which people can read and diff.

    Numbers are rounded to 1e-6: far below what is physical, and free of rounding noise.
    """
    return "".join(text_with_rows(head, key, map(row_text, rows)))


def rows_from_json(
    text: str, key: str, form: str, make: Callable[[Mapping[str, Any]], _Row]
) -> tuple[_Row, ...]:
    """Inverse of :func:`json_with_rows`.

    Parameters
    ----------
    key
        What the rows are.
    form
        The format that the text must name, with our version.
    make
        Makes of a row what it stands for.

    Raises
    ------
    InputError
        If the text has another format or version, or rows that ``make`` cannot take.
    """
    with stored_document(text, form=form, version=VERSION, what=f"a list of {key}") as data:
        return tuple(map(make, data[key]))


def text_with_rows(head: Mapping[str, Any], key: str, rows: Iterable[str]) -> Iterator[str]:
    """Text of :func:`json_with_rows` piece by piece, from what :func:`row_text` gives."""
    yield "{\n"
    for name, value in head.items():
        yield f"  {json.dumps(name)}: {json.dumps(value)},\n"
    yield f"  {json.dumps(key)}: ["
    before = "\n    "
    for row in rows:
        yield before + row
        before = ",\n    "
    yield "]\n}\n" if before == "\n    " else "\n  ]\n}\n"


def row_text(row: Mapping[str, Any]) -> str:
    """One row as written in such a text."""
    return _encode(rounded(row))


def rounded(row: Mapping[str, Any]) -> dict[str, Any]:
    """Round the floats of a row to 1e-6."""
    return {
        name: rounded(value)
        if isinstance(value, dict)
        else round(value, 6)
        if isinstance(value, float)
        else value
        for name, value in row.items()
    }


def _without_defaults(value: PlannedActor | Event) -> dict[str, Any]:
    return {
        name: item
        for name, default in _DEFAULTS[type(value)]
        if (item := getattr(value, name)) != default
    }


_DEFAULTS: dict[type, tuple[tuple[str, Any], ...]] = {
    PlannedActor: tuple((field.name, field.default) for field in fields(PlannedActor)),
    Event: tuple((name, Event._field_defaults.get(name, ...)) for name in Event._fields),
}
"""Names and defaults of the fields; asked for every row of a long run."""
