"""What happened to whom, collected while the simulation steps.

Only counts are read per step, and, where they are not 0, id lists and poses of those who have just
departed: the cost does not grow with the number of vehicles running. Four times a minute all are
looked at for jams. Trajectories are SUMO's own business (FCD output).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from odscen.frames import body_centre
from odscen.results.records import Event, EventKind, Plan
from odscen.sumo.jams import JamWatch
from odscen.sumo.observed import NOTHING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from odscen.sumo.observed import Collision, Front, StepLists
    from odscen.sumo.session import Session


class Recorder:
    """Turns the session's lists into events, step by step.

    Attributes
    ----------
    events
        Events since the last :meth:`drain`, in order of time.
    drained
        How many events were drained before.
    departed, arrived
        How many vehicles and persons so far.
    """

    def __init__(self, plan: Plan) -> None:
        self.events: list[Event] = []
        self.drained = 0
        self.departed = 0
        self.arrived = 0
        self._planned = {actor.id: actor for actor in plan.actors}
        self._offset = plan.net_offset
        self._departures: dict[str, float] = {}
        self._touching: set[tuple[str, str]] = set()
        self._stopping: set[str] = set()
        self._jams = JamWatch(plan.net_offset)

    def since(self, number: int) -> list[Event]:
        """Events but the first ``number`` ones, as far as they have not been drained."""
        return self.events[max(0, number - self.drained) :]

    @property
    def count(self) -> int:
        """How many events there have been."""
        return self.drained + len(self.events)

    def drain(self) -> list[Event]:
        """Hand out the events and forget them: a long run keeps them on disk."""
        events, self.events = self.events, []
        self.drained += len(events)
        return events

    def state(self) -> dict[str, Any]:
        """What has to be remembered from one slice of a run to the next, for JSON."""
        return {
            "drained": self.drained,
            "departed": self.departed,
            "arrived": self.arrived,
            "departures": dict(self._departures),
            "touching": sorted(self._touching),
            "stopping": sorted(self._stopping),
            "jams": self._jams.state(),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Inverse of :meth:`state`."""
        self.events = []
        self.drained = state["drained"]
        self.departed, self.arrived = state["departed"], state["arrived"]
        self._departures = dict(state["departures"])
        self._touching = {(one, other) for one, other in state["touching"]}
        self._stopping = set(state["stopping"])
        self._jams.restore(state["jams"])

    def nobody_left(self, time: float) -> None:
        """Say that the run ends because the road is empty: every jam is over."""
        self.events += self._jams.nobody_left(time)

    def lose(self, time: float, names: Iterable[str]) -> None:
        """Say that SUMO did not bring these back with a saved state."""
        self.events += [Event(time, EventKind.LOST, name) for name in sorted(names)]

    def record(self, session: Session, time: float) -> None:
        """Record the step that began at ``time`` and has just been made."""
        happened = session.happened()
        if happened is not None or self._touching or self._stopping:
            self._record_events(session, time, happened or NOTHING)
        elif self._jams.due <= time:  # a quiet step, as most are: all that costs is saved there
            self.events += self._jams.look(session, time)

    def _record_events(self, session: Session, time: float, lists: StepLists) -> None:
        for vehicle in lists.departed:
            self._depart(time, vehicle, session.vehicle_front(vehicle))
        for person in lists.departed_persons:
            self._depart(time, person, session.person_front(person))
        for vehicle in lists.teleports_started:
            self._teleport(time, vehicle)
        for vehicle in lists.teleports_ended:
            front = session.vehicle_front(vehicle)
            self._place(time, EventKind.TELEPORT_END, vehicle, front)
        if lists.emergency_stops or self._stopping:
            self._stops(time, lists.emergency_stops, session)
        if lists.collisions or self._touching:
            self._collisions(time, lists.collisions)
        if self._jams.due <= time:
            self.events += self._jams.look(session, time)
        for name in lists.arrived:
            self._arrive(time, name)
        for name in lists.arrived_persons:
            self._arrive(time, name)

    def _depart(self, time: float, name: str, front: Front | None) -> None:
        if name in self._departures:  # back on the road after a teleport is no second departure
            return
        self._departures[name] = time
        self.departed += 1
        if front is None:
            self.events.append(Event(time, EventKind.DEPARTED, name))
            return
        planned = self._planned.get(name)
        length = planned.length if planned else 0.0
        x, y = body_centre(
            front.x, front.y, front.angle_deg, length=length, net_offset=self._offset
        )
        error = math.hypot(x - planned.x, y - planned.y) if planned else None
        self.events.append(Event(time, EventKind.DEPARTED, name, x=x, y=y, error=error))

    def _arrive(self, time: float, name: str) -> None:
        self.arrived += 1
        departed = self._departures.pop(name, None)
        spent = None if departed is None else time - departed
        self.events.append(Event(time, EventKind.ARRIVED, name, travel_time=spent))

    def _teleport(self, time: float, vehicle: str) -> None:
        """Tell where and why it stood until now, as it has no place any more."""
        stuck = self._jams.stuck(vehicle)
        if stuck is None:
            self.events.append(Event(time, EventKind.TELEPORT_START, vehicle))
            return
        self.events.append(
            Event(
                time,
                EventKind.TELEPORT_START,
                vehicle,
                x=stuck.x,
                y=stuck.y,
                lane=stuck.lane,
                detail=stuck.reason,
                waited=time - stuck.since,
            )
        )

    def _place(self, time: float, kind: EventKind, name: str, front: Front | None) -> None:
        if front is None:
            self.events.append(Event(time, kind, name))
            return
        dx, dy = self._offset
        self.events.append(Event(time, kind, name, x=front.x - dx, y=front.y - dy))

    def _stops(self, time: float, stopping: Sequence[str], session: Session) -> None:
        """Report the first step only of each emergency stop."""
        for vehicle in stopping:
            if vehicle not in self._stopping:
                front = session.vehicle_front(vehicle)
                self._place(time, EventKind.EMERGENCY_STOP, vehicle, front)
        self._stopping = set(stopping)

    def _collisions(self, time: float, collisions: Sequence[Collision]) -> None:
        """Report a pair once, when it begins to touch."""
        touching = {(c.collider, c.victim) for c in collisions}
        for collision in collisions:
            if (collision.collider, collision.victim) in self._touching:
                continue
            self.events.append(
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
