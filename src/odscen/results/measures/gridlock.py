"""Where traffic got stuck, from the events of a run: jams, vehicles moved on, vehicles kept out.

Pure; the reasons were found while the simulation went (:mod:`odscen.sumo.worker.jams`).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal

from odscen.results.records.run_records import EventKind, rounded

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.results.measures.summary import ActorOutcome
    from odscen.results.records.run_records import Event, Plan, PlannedActor

TroubleKind = Literal["jam", "moved_on", "kept_out"]

LISTED = 200
"""Rows in ``summary.json`` at most; the counts are of all."""

NO_ROOM_TO_START = "no room where they start"
UNKNOWN = "the reason does not show"


@dataclass(frozen=True, slots=True)
class Trouble:
    """A place where traffic got stuck.

    Attributes
    ----------
    kind
        ``jam``: somebody stood for minutes; ``moved_on``: SUMO took a vehicle out and put it back
        further on (a teleport); ``kept_out``: planned but never on the road.
    time
        Seconds: since when.
    until
        Seconds: until when; ``None`` for a jam that did not dissolve, and for those kept out.
    actor
        Who was first in it.
    count
        How many stood in the jam when it was found, or were kept out at this place.
    x, y
        Metres, OpenDRIVE frame; ``None`` if unknown.
    lane
        SUMO lane, ``None`` if unknown.
    place
        Lane-graph node where those kept out were to start, else ``None``.
    reason
        In words, as far as it shows.
    """

    kind: TroubleKind
    time: float
    until: float | None
    actor: str
    count: int
    x: float | None
    y: float | None
    lane: str | None
    place: str | None
    reason: str


def find_trouble(
    plan: Plan, outcomes: Sequence[ActorOutcome], events: Iterable[Event], *, end: float
) -> tuple[Trouble, ...]:
    """Every place where traffic got stuck.

    Jams that did not dissolve come first, then other jams by how long they lasted, then places
    where vehicles were kept out by their number, then vehicles moved on.

    Parameters
    ----------
    end
        When the run ended, seconds; who was to depart later has not been kept out.
    """
    found = [*_on_the_road(events), *_kept_out(plan, outcomes, end)]
    return tuple(sorted(found, key=_order))


def _order(one: Trouble) -> tuple[int, float, float]:
    if one.kind == "jam":
        return (0, one.time, 0.0) if one.until is None else (1, one.time - one.until, one.time)
    return (2, -one.count, one.time) if one.kind == "kept_out" else (3, one.time, 0.0)


def trouble_summary(found: Sequence[Trouble]) -> dict[str, Any]:
    """Counts of all, and the first :data:`LISTED`, for ``summary.json``."""
    kinds = Counter(one.kind for one in found)
    kept_out = sum(one.count for one in found if one.kind == "kept_out")
    return {
        "jams": kinds["jam"],
        "jams_at_the_end": sum(one.kind == "jam" and one.until is None for one in found),
        "moved_on": kinds["moved_on"],
        "kept_out": kept_out,
        "places": [rounded(asdict(one)) for one in found[:LISTED]],
    }


def _on_the_road(events: Iterable[Event]) -> list[Trouble]:
    open_jams: dict[str, Event] = {}
    found = []
    for event in events:
        if event.kind is EventKind.JAM_BEGIN:
            open_jams[str(event.lane)] = event
        elif event.kind is EventKind.JAM_END:
            begin = open_jams.pop(str(event.lane), None)
            if begin is not None:
                since = begin.time - (begin.waited or 0.0)
                found.append(_jam(begin, since + (event.waited or 0.0)))
        elif event.kind is EventKind.TELEPORT_START:
            found.append(_moved_on(event))
    return [*found, *(_jam(begin, None) for begin in open_jams.values())]


def _jam(begin: Event, until: float | None) -> Trouble:
    return Trouble(
        kind="jam",
        time=begin.time - (begin.waited or 0.0),
        until=until,
        actor=begin.actor,
        count=begin.queue or 1,
        x=begin.x,
        y=begin.y,
        lane=begin.lane,
        place=None,
        reason=begin.detail or UNKNOWN,
    )


def _moved_on(event: Event) -> Trouble:
    return Trouble(
        kind="moved_on",
        time=event.time - (event.waited or 0.0),
        until=event.time,
        actor=event.actor,
        count=1,
        x=event.x,
        y=event.y,
        lane=event.lane,
        place=None,
        reason=event.detail or UNKNOWN,
    )


def _kept_out(plan: Plan, outcomes: Sequence[ActorOutcome], end: float) -> list[Trouble]:
    groups: dict[tuple[str, str], list[PlannedActor]] = {}
    for actor, outcome in zip(plan.actors, outcomes, strict=True):
        if outcome.status == "waiting" and actor.depart < end:
            reason = actor.problem or NO_ROOM_TO_START
            groups.setdefault((actor.spawn, reason), []).append(actor)
    return [
        Trouble(
            kind="kept_out",
            time=first.depart,
            until=None,
            actor=first.id,
            count=len(actors),
            x=first.x,
            y=first.y,
            lane=None,
            place=spawn,
            reason=reason,
        )
        for (spawn, reason), actors in groups.items()
        for first in [min(actors, key=lambda actor: (actor.depart, actor.id))]
    ]
