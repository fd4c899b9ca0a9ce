"""From plan, events and trips to the outcome of each actor.

Everything here is a pure function of plan, events and trips; wall-clock figures are added by the
runner to ``summary.json`` only, so that all other files of a run are the same bytes for the same
seed.
"""

from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.stored_files import typed_rows
from odscen.records.outcomes import ActorStatus
from odscen.records.row_text import VERSION, row_text, rows_from_json, text_with_rows
from odscen.records.run_events import Event, EventKind

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from odscen.records.run_plan import Plan, PlannedActor

ACTORS_FORMAT = "odscen-actors"


class Trip(NamedTuple):
    """What SUMO has measured on the trip of an actor: seconds, and how many halts.

    ``time_loss`` is ``None`` for a person who has not arrived, ``stops`` for every person.
    """

    time_loss: float | None
    waiting_time: float | None
    stops: int | None


@dataclass(frozen=True, slots=True)
class ActorOutcome:
    """What was planned for an actor and what became of it; seconds, metres, m/s.

    Attributes
    ----------
    inserted
        When it appeared on the road; ``None`` if it never did.
    depart_delay
        Seconds it waited beyond its planned departure.
    insertion_error
        Metres between the centre of its body and its planned place when it appeared.
    travel_time
        From appearing to arriving.
    delay
        Of an actor that arrived: its ``time_loss``.
    mean_speed
        Route length over travel time.
    problem
        Why the SUMO network had no route for it, if so; it is then ``waiting``.
    time_loss
        Seconds lost by driving, or walking, below the speed that it wished for; also while it was
        getting up to that speed.
    waiting_time
        Seconds that it was stopped, below 0.1 m/s.
    stops
        How many times a vehicle came to a halt.
    """

    id: str
    category: str
    model: str | None
    ego: bool
    flow: str | None
    spawn: str
    goal: str | None
    status: ActorStatus
    depart: float
    inserted: float | None
    depart_delay: float | None
    insertion_error: float | None
    arrived: float | None
    travel_time: float | None
    free_flow_time: float | None
    delay: float | None
    route_length: float | None
    mean_speed: float | None
    teleports: int
    collisions: int
    emergency_stops: int
    problem: str | None = None
    time_loss: float | None = None
    waiting_time: float | None = None
    stops: int | None = None


_COLUMNS = tuple(field.name for field in fields(ActorOutcome))


@dataclass(slots=True)
class _ActorHistory:
    """What has been heard of an actor so far."""

    departure: Event | None = None
    arrival: Event | None = None
    stranded: bool = False
    teleports: int = 0
    collisions: int = 0
    emergency_stops: int = 0

    def hear(self, event: Event) -> None:
        match event.kind:
            case EventKind.DEPARTED:
                self.departure = event
            case EventKind.ARRIVED:
                self.arrival = event
            case EventKind.TELEPORT_START:
                self.teleports += 1
            case EventKind.COLLISION:
                self.collisions += 1
            case EventKind.EMERGENCY_STOP:
                self.emergency_stops += 1
            case EventKind.STRANDED:
                self.stranded = True


_NO_TRIPS: Mapping[str, Trip] = MappingProxyType({})
_NO_TRIP = Trip(None, None, None)


class Outcomes:
    """Outcomes of the actors of a plan, from reports that come bit by bit."""

    def __init__(self, plan: Plan) -> None:
        self._actors = {actor.id: actor for actor in plan.actors}
        self._histories: defaultdict[str, _ActorHistory] = defaultdict(_ActorHistory)
        self._trips: dict[str, Trip] = {}
        self._rows: dict[str, str] = {}

    def hear(self, events: Iterable[Event], trips: Mapping[str, Trip] = _NO_TRIPS) -> None:
        """Take in what has happened, in order of time, and what was measured, by id."""
        histories = self._histories
        for event in events:
            histories[event.actor].hear(event)
            if event.kind is EventKind.COLLISION and event.partner not in (None, event.actor):
                histories[str(event.partner)].hear(event)
        self._trips.update(trips)

    def settle(self) -> None:
        """Write down who has arrived: nothing more happens to them, and :meth:`rows` is quicker.

        Not yet those whose trip has not come: of a car that ends in a parking place SUMO writes it
        when that leaves the place, perhaps slices later.
        """
        for name, history in self._histories.items():
            settled = history.arrival is not None and name in self._trips
            if settled and name in self._actors and name not in self._rows:
                self._rows[name] = outcome_row(self._outcome_of(name))

    def outcomes(self) -> tuple[ActorOutcome, ...]:
        """One outcome per planned actor, in the plan's order."""
        return tuple(map(self._outcome_of, self._actors))

    def rows(self) -> Iterator[str]:
        """The same as rows of ``actors.json``."""
        for name in self._actors:
            yield self._rows.get(name) or outcome_row(self._outcome_of(name))

    def _outcome_of(self, name: str) -> ActorOutcome:
        history = self._histories.get(name) or _ActorHistory()
        return _make_outcome(self._actors[name], history, self._trips.get(name, _NO_TRIP))


def actor_outcomes(
    plan: Plan, events: Iterable[Event], trips: Mapping[str, Trip] = _NO_TRIPS
) -> tuple[ActorOutcome, ...]:
    """One outcome per planned actor, in the plan's order.

    Parameters
    ----------
    trips
        By id; an actor without one has no delay, waiting time and stops.
    """
    found = Outcomes(plan)
    found.hear(events, trips)
    return found.outcomes()


def _status_of(history: _ActorHistory) -> ActorStatus:
    if history.arrival:
        return ActorStatus.ARRIVED
    if history.stranded:
        return ActorStatus.STRANDED
    return ActorStatus.RUNNING if history.departure else ActorStatus.WAITING


def _make_outcome(actor: PlannedActor, history: _ActorHistory, trip: Trip) -> ActorOutcome:
    departure, arrival = history.departure, history.arrival
    status = _status_of(history)
    inserted = departure.time if departure else None
    # Who appears by a rule is due when it does, and not before.
    depart = inserted if actor.appears and inserted is not None else actor.depart
    travel_time = arrival.travel_time if arrival else None
    mean_speed = None
    if travel_time and actor.route_length is not None:
        mean_speed = actor.route_length / travel_time
    return ActorOutcome(
        id=actor.id,
        category=actor.category,
        model=actor.model,
        ego=actor.ego,
        flow=actor.flow,
        spawn=actor.spawn,
        goal=actor.goal,
        status=status,
        depart=depart,
        inserted=inserted,
        depart_delay=None if inserted is None else inserted - depart,
        insertion_error=departure.error if departure else None,
        arrived=arrival.time if arrival else None,
        travel_time=travel_time,
        free_flow_time=actor.free_flow_time,
        delay=trip.time_loss if arrival else None,
        route_length=actor.route_length,
        mean_speed=mean_speed,
        teleports=history.teleports,
        collisions=history.collisions,
        emergency_stops=history.emergency_stops,
        problem=actor.problem,
        time_loss=trip.time_loss,
        waiting_time=trip.waiting_time,
        stops=trip.stops,
    )


def actors_to_json(outcomes: Iterable[ActorOutcome]) -> str:
    """``actors.json``: one actor per line."""
    return "".join(actors_text(map(outcome_row, outcomes)))


def actors_text(rows: Iterable[str]) -> Iterator[str]:
    """``actors.json`` piece by piece, from what :func:`outcome_row` gives."""
    return text_with_rows({"format": ACTORS_FORMAT, "version": VERSION}, "actors", rows)


def outcome_row(outcome: ActorOutcome) -> str:
    """One actor as written in ``actors.json``, without indentation and comma."""
    return row_text({name: getattr(outcome, name) for name in _COLUMNS})


def actors_from_json(text: str) -> tuple[ActorOutcome, ...]:
    """Inverse of :func:`actors_to_json`.

    Raises
    ------
    InputError
        If it is not a list of actors of this version.
    """
    return rows_from_json(text, "actors", ACTORS_FORMAT, typed_rows(ActorOutcome))


def summary_to_json(summary: Mapping[str, Any]) -> str:
    """``summary.json``; NaN and infinity are refused."""
    return json.dumps(summary, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
