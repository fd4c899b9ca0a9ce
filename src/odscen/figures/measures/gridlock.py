"""Incidents of traffic, from the events of a run: jams, teleports, vehicles not inserted.

Pure; the reasons were found while the simulation went (:mod:`odscen.sumo.worker.jams`).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from odscen.records.outcomes import ActorStatus, IncidentKind, StopReason, stop_reason
from odscen.records.row_text import rounded
from odscen.records.run_events import EventKind

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.figures.measures.summary import ActorOutcome
    from odscen.records.run_events import Event
    from odscen.records.run_plan import Plan, PlannedActor

LISTED = 200
"""Rows in ``summary.json`` at most; the counts are of all."""


@dataclass(frozen=True, slots=True)
class Incident:
    """Vehicles gridlocked, teleported or not inserted at a place.

    Attributes
    ----------
    time
        Seconds: since when.
    until
        Seconds: until when; ``None`` for an unresolved queue, and if not inserted.
    actor
        Who was first in it.
    count
        How many were stopped in the jam when it was found, or were not inserted at this place.
    x, y
        Metres, OpenDRIVE frame; ``None`` if unknown.
    lane
        SUMO lane, ``None`` if unknown.
    place
        Lane-graph node where those not inserted were to depart, else ``None``.
    reason
        As far as it shows; of an actor without a route in words of its own.
    """

    kind: IncidentKind
    time: float
    until: float | None
    actor: str
    count: int
    x: float | None
    y: float | None
    lane: str | None
    place: str | None
    reason: StopReason | str


def find_incidents(
    plan: Plan, outcomes: Sequence[ActorOutcome], events: Iterable[Event], *, end: float
) -> tuple[Incident, ...]:
    """All incidents of a run.

    Jams that did not dissolve come first, then other jams by how long they lasted, then places
    where vehicles were not inserted by their number, then teleports.

    Parameters
    ----------
    end
        When the run ended, seconds; who was to depart later is not missed.
    """
    found = [*_find_incidents_on_road(events), *_find_insertion_failures(plan, outcomes, end)]
    return tuple(sorted(found, key=_incident_order))


def _incident_order(incident: Incident) -> tuple[int, float, float]:
    if incident.kind is IncidentKind.JAM:
        return (
            (0, incident.time, 0.0)
            if incident.until is None
            else (1, incident.time - incident.until, incident.time)
        )
    not_inserted = incident.kind is IncidentKind.NOT_INSERTED
    return (2, -incident.count, incident.time) if not_inserted else (3, incident.time, 0.0)


def incident_summary(found: Sequence[Incident]) -> dict[str, Any]:
    """Counts of all, and the first :data:`LISTED`, for ``summary.json``."""
    kinds = Counter(incident.kind for incident in found)
    not_inserted = sum(
        incident.count for incident in found if incident.kind is IncidentKind.NOT_INSERTED
    )
    return {
        "jams": kinds[IncidentKind.JAM],
        "jams_at_the_end": sum(
            incident.kind is IncidentKind.JAM and incident.until is None for incident in found
        ),
        "moved_on": kinds[IncidentKind.TELEPORTED],
        "kept_out": not_inserted,
        "places": [rounded(asdict(incident)) for incident in found[:LISTED]],
    }


def _find_incidents_on_road(events: Iterable[Event]) -> list[Incident]:
    open_jams: dict[str, Event] = {}
    found = []
    for event in events:
        if event.kind is EventKind.JAM_BEGIN:
            open_jams[str(event.lane)] = event
        elif event.kind is EventKind.JAM_END:
            begin = open_jams.pop(str(event.lane), None)
            if begin is not None:
                since = begin.time - (begin.waited or 0.0)
                found.append(_jam_incident(begin, since + (event.waited or 0.0)))
        elif event.kind is EventKind.TELEPORT_START:
            found.append(_teleport_incident(event))
    return [*found, *(_jam_incident(begin, None) for begin in open_jams.values())]


def _jam_incident(begin: Event, until: float | None) -> Incident:
    return Incident(
        kind=IncidentKind.JAM,
        time=begin.time - (begin.waited or 0.0),
        until=until,
        actor=begin.actor,
        count=begin.queue or 1,
        x=begin.x,
        y=begin.y,
        lane=begin.lane,
        place=None,
        reason=stop_reason(begin.detail),
    )


def _teleport_incident(event: Event) -> Incident:
    return Incident(
        kind=IncidentKind.TELEPORTED,
        time=event.time - (event.waited or 0.0),
        until=event.time,
        actor=event.actor,
        count=1,
        x=event.x,
        y=event.y,
        lane=event.lane,
        place=None,
        reason=stop_reason(event.detail),
    )


def _find_insertion_failures(
    plan: Plan, outcomes: Sequence[ActorOutcome], end: float
) -> list[Incident]:
    groups: dict[tuple[str, str], list[PlannedActor]] = {}
    for actor, outcome in zip(plan.actors, outcomes, strict=True):
        if outcome.status is ActorStatus.WAITING and actor.depart < end:
            reason = actor.problem or StopReason.NO_ROOM_TO_START
            groups.setdefault((actor.spawn, reason), []).append(actor)
    return [
        Incident(
            kind=IncidentKind.NOT_INSERTED,
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
