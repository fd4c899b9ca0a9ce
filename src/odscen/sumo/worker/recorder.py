"""What happened to whom, collected while the simulation steps.

Only counts are read per step, and, where they are not 0, id lists and poses of those who have just
departed: the cost does not grow with the number of vehicles running. Four times a minute all are
looked at for jams. Trajectories are SUMO's own business (FCD output).
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.base.frames import body_centre
from odscen.records.run_events import Event, EventKind
from odscen.sumo.worker.jams import JamWatch, LastStop
from odscen.sumo.worker.simulation.observed import Collision, Front, StepLists

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.records.run_plan import Plan, PlannedActor
    from odscen.sumo.worker.simulation.session import Session


_NO_STOPS: dict[str, LastStop] = {}


class _EventfulStep(NamedTuple):
    """A step in which something happened, or after which a look for jams found something.

    ``number`` counts all steps. ``stops`` are those of the look before, ``jams`` what was found
    after the step.
    """

    number: int
    time: float
    lists: StepLists | None
    stops: Mapping[str, LastStop]
    jams: Sequence[Event] = ()


class _ParkedTrips:
    """Trips that begin when a car leaves its parking place, and end when it takes one.

    Attributes
    ----------
    left
        Those who have left the place that they began in.
    parked
        Those who have taken the place that they end in, and are still there.
    """

    def __init__(self, plan: Plan) -> None:
        self._begin = {actor.id for actor in plan.actors if actor.begins_in}
        self._end = {actor.id for actor in plan.actors if actor.ends_in}
        self.left: set[str] = set()
        self.parked: set[str] = set()

    def still_parked(self, name: str) -> bool:
        """Whether one that SUMO has inserted is in the place that its trip is to begin in."""
        return name in self._begin and name not in self.left

    def leaves(self, name: str) -> bool:
        """Whether the trip of one that leaves its place begins with that."""
        if not self.still_parked(name):
            return False
        self.left.add(name)
        return True

    def ends(self, name: str) -> bool:
        """Whether the trip of one that takes a place ends with that."""
        if name in self._end:
            self.parked.add(name)
            return True
        return False

    def has_ended(self, name: str) -> bool:
        """Whether the trip of one that SUMO takes out has ended before."""
        there = name in self.parked
        self.parked.discard(name)
        return there


class Recorder:
    """Turns the session's lists into events.

    Steps in which something happened are put by and gone through together when they are asked for:
    after a step of SUMO nothing of Python is in the processor's caches, and one event alone costs
    several times as much as one of many. Another process may go through them, see
    :meth:`hand_over`.

    Attributes
    ----------
    drained
        How many events were drained before.
    jumps
        Steps after which somebody was elsewhere, or had another speed, than it drove: there was a
        teleport or a collision.
    """

    def __init__(self, plan: Plan) -> None:
        self.drained = 0
        self.jumps = 0
        self._events: list[Event] = []
        self._departed = 0
        self._arrived = 0
        self._plan = plan
        self._offset = plan.net_offset
        self._departures: dict[str, float] = {}
        self._touching: set[tuple[str, str]] = set()
        self._stopping: set[str] = set()
        self._jams = JamWatch(plan.net_offset)
        self._number = self._settled = 0
        self._put_by: list[_EventfulStep] = []

    @cached_property
    def _planned_by_id(self) -> dict[str, PlannedActor]:
        return {actor.id: actor for actor in self._plan.actors}

    @cached_property
    def _parked_trips(self) -> _ParkedTrips:
        return _ParkedTrips(self._plan)

    @property
    def events(self) -> list[Event]:
        """Events since the last :meth:`drain`, in order of time."""
        self._settle_steps()
        return self._events

    @property
    def departed(self) -> int:
        """How many vehicles and persons have departed so far."""
        self._settle_steps()
        return self._departed

    @property
    def arrived(self) -> int:
        """How many vehicles and persons have arrived so far."""
        self._settle_steps()
        return self._arrived

    def since(self, number: int) -> list[Event]:
        """Events but the first ``number`` ones, as far as they have not been drained."""
        return self.events[max(0, number - self.drained) :]

    @property
    def count(self) -> int:
        """How many events there have been."""
        return self.drained + len(self.events)

    def drain(self) -> list[Event]:
        """Hand out the events and forget them: a long run keeps them on disk."""
        events, self._events = self.events, []
        self.drained += len(events)
        return events

    def state(self) -> dict[str, Any]:
        """What has to be remembered from one slice of a run to the next, for JSON."""
        self._settle_steps()
        return self._saved_state()

    def _saved_state(self) -> dict[str, Any]:
        return {
            "drained": self.drained,
            "departed": self._departed,
            "arrived": self._arrived,
            "departures": dict(self._departures),
            "touching": sorted(self._touching),
            "stopping": sorted(self._stopping),
            "jams": self._jams.state(),
            "left": sorted(self._parked_trips.left),
            "parked": sorted(self._parked_trips.parked),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Inverse of :meth:`state`."""
        self._events, self._put_by = [], []
        self.drained = state["drained"]
        self._departed, self._arrived = state["departed"], state["arrived"]
        self._departures = dict(state["departures"])
        self._touching = {(one, other) for one, other in state["touching"]}
        self._stopping = set(state["stopping"])
        self._jams.restore(state["jams"])
        self._parked_trips.left, self._parked_trips.parked = (
            set(state["left"]),
            set(state["parked"]),
        )

    def hand_over(self) -> dict[str, Any]:
        """What another process needs to go on as this one would, for JSON; nothing is gone through.

        Events have to be as they were made: those that were drained are not among them.
        """
        return {
            "events": self._events,
            "state": self._saved_state(),
            "numbers": (self._number, self._settled),
            "put_by": self._put_by,
        }

    def take_over(self, left: Mapping[str, Any]) -> None:
        """Inverse of :meth:`hand_over`."""
        self.restore(left["state"])
        self._events = list(map(_read_event, left["events"]))
        self._number, self._settled = left["numbers"]
        self._put_by = [_eventful_step(*row) for row in left["put_by"]]

    def road_is_empty(self, time: float) -> None:
        """Say that the run ends because the road is empty: every jam is over."""
        self._look_found(time, self._jams.road_is_empty(time))

    def add(self, events: Sequence[Event]) -> None:
        """Add what measures did in the last step; who is stranded is not under way any more."""
        if not events:
            return
        self.events.extend(events)
        for event in events:
            if event.kind is EventKind.STRANDED:
                self._departures.pop(event.actor, None)

    def arrive(self, time: float, name: str) -> None:
        """Record an arrival that SUMO does not report: at the goal that a rule has given."""
        self._settle_steps()
        self._record_arrival(time, name)

    def lose(self, time: float, names: Iterable[str]) -> None:
        """Say that SUMO did not bring these back with a saved state."""
        self.events.extend(Event(time, EventKind.LOST, name) for name in sorted(names))

    def record(self, session: Session, time: float) -> None:
        """Record the step that began at ``time`` and has just been made."""
        self._number += 1
        lists = session.happened()
        if lists is not None:
            stops = self._jams.stops if lists.teleports_started else _NO_STOPS
            self._put_by.append(_EventfulStep(self._number, time, lists, stops))
            if lists.teleports_started or lists.teleports_ended or lists.collisions:
                self.jumps += 1
        if time >= self._jams.due:
            self._look_found(time, self._jams.look(session, time))

    def _look_found(self, time: float, jams: Sequence[Event]) -> None:
        if jams:
            self._put_by.append(_EventfulStep(self._number, time, None, _NO_STOPS, jams))

    def _settle_steps(self) -> None:
        """Go through the steps that were put by."""
        steps, self._put_by = self._put_by, []
        for number, time, lists, stops, jams in steps:
            if lists is not None:
                self._quiet_before(number)
                self._record_step(time, lists, stops)
                self._settled = number
            self._events.extend(jams)
        self._quiet_before(self._number + 1)

    def _quiet_before(self, number: int) -> None:
        """If nothing happened in the step before this one, no vehicles touched or braked hard."""
        if self._settled < number - 1:
            self._touching, self._stopping = set(), set()

    def _record_step(self, time: float, lists: StepLists, stops: Mapping[str, LastStop]) -> None:
        fronts = lists.fronts
        self._departures_of(time, lists)
        for vehicle in lists.teleports_started:
            self._record_teleport(time, vehicle, stops.get(vehicle))
        for vehicle in lists.teleports_ended:
            self._record_place(time, EventKind.TELEPORT_END, vehicle, fronts[vehicle])
        self._record_emergency_stops(time, lists.emergency_stops, fronts)
        self._record_collisions(time, lists.collisions)
        self._arrivals_of(time, lists)

    def _departures_of(self, time: float, lists: StepLists) -> None:
        fronts = lists.fronts
        for name in (*lists.departed, *lists.departed_persons):
            if not self._parked_trips.still_parked(name):
                self._record_departure(time, name, fronts[name])
        for name in lists.unparked:
            if self._parked_trips.leaves(name):
                self._record_departure(time, name, fronts[name])

    def _arrivals_of(self, time: float, lists: StepLists) -> None:
        for name in lists.parked:
            if name in self._departures and self._parked_trips.ends(name):
                self._record_arrival(time, name)
        for name in (*lists.arrived, *lists.arrived_persons):
            if not self._parked_trips.has_ended(name):
                self._record_arrival(time, name)

    def _record_departure(self, time: float, name: str, front: Front | None) -> None:
        if name in self._departures:  # back on the road after a teleport is no second departure
            return
        self._departures[name] = time
        self._departed += 1
        if front is None:
            self._events.append(Event(time, EventKind.DEPARTED, name))
            return
        planned = self._planned_by_id.get(name)
        length = planned.length if planned else 0.0
        x, y = body_centre(
            front.x, front.y, front.angle_deg, length=length, net_offset=self._offset
        )
        placed = planned is not None and planned.begins_in is None and not planned.from_file
        error = math.hypot(x - planned.x, y - planned.y) if planned and placed else None
        self._events.append(Event(time, EventKind.DEPARTED, name, x=x, y=y, error=error))

    def _record_arrival(self, time: float, name: str) -> None:
        self._arrived += 1
        departed = self._departures.pop(name, None)
        spent = None if departed is None else time - departed
        self._events.append(Event(time, EventKind.ARRIVED, name, travel_time=spent))

    def _record_teleport(self, time: float, vehicle: str, stop: LastStop | None) -> None:
        """Report where and why it was stopped until now, as it has no place any more."""
        if stop is None:
            self._events.append(Event(time, EventKind.TELEPORT_START, vehicle))
            return
        self._events.append(
            Event(
                time,
                EventKind.TELEPORT_START,
                vehicle,
                x=stop.x,
                y=stop.y,
                lane=stop.lane,
                detail=stop.reason,
                waited=time - stop.since,
            )
        )

    def _record_place(self, time: float, kind: EventKind, name: str, front: Front | None) -> None:
        if front is None:
            self._events.append(Event(time, kind, name))
            return
        dx, dy = self._offset
        self._events.append(Event(time, kind, name, x=front.x - dx, y=front.y - dy))

    def _record_emergency_stops(
        self, time: float, stopping: Sequence[str], fronts: Mapping[str, Front | None]
    ) -> None:
        """Report the first step only of each emergency stop."""
        for vehicle in stopping:
            if vehicle not in self._stopping:
                self._record_place(time, EventKind.EMERGENCY_STOP, vehicle, fronts[vehicle])
        self._stopping = set(stopping)

    def _record_collisions(self, time: float, collisions: Sequence[Collision]) -> None:
        """Report a pair once, when it begins to touch."""
        touching = {(c.collider, c.victim) for c in collisions}
        for collision in collisions:
            if (collision.collider, collision.victim) in self._touching:
                continue
            self._events.append(
                Event(
                    time,
                    EventKind.COLLISION,
                    collision.collider,
                    lane=collision.lane,
                    partner=collision.victim,
                    detail=collision.type,
                )
            )
        self._touching = touching


def _read_event(row: Sequence[Any]) -> Event:
    """Event from its JSON."""
    time, kind, *values = row
    return Event(time, EventKind(kind), *values)


def _eventful_step(
    number: int,
    time: float,
    lists: Sequence[Any] | None,
    stops: Mapping[str, Sequence[Any]],
    jams: Sequence[Sequence[Any]],
) -> _EventfulStep:
    """Step from its JSON."""
    known = {name: LastStop.from_row(row) for name, row in stops.items()}
    found = None if lists is None else StepLists.from_row(lists)
    return _EventfulStep(number, time, found, known, tuple(map(_read_event, jams)))
