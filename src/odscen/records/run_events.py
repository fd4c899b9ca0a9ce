"""What happened in a run, event by event, and its file."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Any, NamedTuple

import orjson

from odscen.base.stored_files import typed_rows
from odscen.records.row_text import (
    VERSION,
    field_defaults,
    rounded,
    row_text,
    rows_from_json,
    text_with_rows,
    without_defaults,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

EVENTS_FORMAT = "odscen-events"


class EventKind(StrEnum):
    """What can happen to an actor.

    A jam is reported of its first vehicle. ``lost``: it did not come back with a saved state.
    ``stranded``: a measure had closed every route to its goal, and it was taken out.
    ``route_changed``: it did not get to the lane that its route needed, and took another one.
    Measures begin and end; their id stands for that of an actor.
    What a rule does is reported of its actor, at the instant, which may lie inside a step;
    ``rule_acted`` is what no motion follows from, such as lights. ``story_ended``: no rule is under
    way and none can fire any more; ``story`` stands for the actor.
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
    ROUTE_CHANGED = "route_changed"
    MEASURE_BEGIN = "measure_begin"
    MEASURE_END = "measure_end"
    RULE_STARTED = "rule_started"
    RULE_ACTED = "rule_acted"
    RULE_ENDED = "rule_ended"
    RULE_FAILED = "rule_failed"
    RULE_OVERRIDDEN = "rule_overridden"
    STORY_ENDED = "story_ended"


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
        vehicle was gridlocked (teleports, jams) or took another route; what a measure does; why a
        rule could not do what it says.
    waited
        Seconds that the first vehicle in a jam, or one that was teleported or took another route,
        was stopped there.
    queue
        How many vehicles are stopped in a jam.
    rule
        The rule that has started, ended, failed, or given way to another.
    values
        Rules: what the conditions were about, by their place in ``when``. Collisions found by
        odscen: ``impact_speed``, m/s, and ``overlap``, the share of the width of who hits.
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


_DEFAULTS = field_defaults(Event)


def event_row(event: Event) -> dict[str, Any]:
    """One event as written in ``events.json``: without what has its default value."""
    return rounded(without_defaults(event, _DEFAULTS))


def event_line(event: Event) -> str:
    """One event as written in ``events.json``, without indentation and comma."""
    return row_text(without_defaults(event, _DEFAULTS))


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
