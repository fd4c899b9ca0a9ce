"""Where traffic is gridlocked, found while the simulation goes, with the reason as far as it shows.

A lane is jammed while a vehicle on it has been stopped for :data:`JAMMED` seconds, which is longer
than a red light. The first vehicle in it is asked what it has ahead; if that is another stopped
vehicle, that one is asked, and so on to the head of the queue, whose reason is that of all. Asking
begins earlier, at :data:`WATCHED` seconds: a vehicle that cannot move at green will be looked at at
red, too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Self

from odscen.records.outcomes import StopReason, stop_reason
from odscen.records.run_events import Event, EventKind

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.sumo.worker.simulation.observed import StoppedVehicle, ViewAhead
    from odscen.sumo.worker.simulation.session import Session
    from odscen.sumo.worker.simulation.stopped_vehicles import StoppedVehicles

PERIOD = 15.0
"""Simulated seconds between two looks."""
WATCHED = 45.0
"""Seconds of being stopped from which the reason is looked for."""
JAMMED = 180.0
"""Seconds of being stopped that make a jam."""

_HOPS = 200
"""Vehicles that a reason is followed through."""

RELEASE = 60.0
"""Seconds without a stopped vehicle after which a jam is over; moving up does not end it."""


class LastStop(NamedTuple):
    """Of a vehicle, at the last look: where (OpenDRIVE frame), since when, and why it stopped."""

    lane: str
    x: float | None
    y: float | None
    since: float
    reason: StopReason | str

    @classmethod
    def from_row(cls, row: Sequence[Any]) -> Self:
        """One from its JSON."""
        lane, x, y, since, reason = row
        return cls(lane, x, y, since, stop_reason(reason))


class JamWatch:
    """Finds jams and says why somebody was stop.

    Attributes
    ----------
    due
        When to look next, simulated seconds.
    stops
        Where and why vehicles were stopped at the last look, by their ids; a new one at each.
    """

    def __init__(self, net_offset: tuple[float, float]) -> None:
        self.due = 0.0
        self._offset = net_offset
        self._since: dict[str, float] = {}
        self._seen: dict[str, float] = {}
        self.stops: dict[str, LastStop] = {}

    def state(self) -> dict[str, Any]:
        """What has to be remembered from one slice of a run to the next, for JSON."""
        return {
            "next": self.due,
            "since": dict(self._since),
            "seen": dict(self._seen),
            "stuck": dict(self.stops),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Inverse of :meth:`state`."""
        self.due = state["next"]
        self._since = dict(state["since"])
        self._seen = dict(state["seen"])
        self.stops = {name: LastStop.from_row(row) for name, row in state["stuck"].items()}

    def look(self, session: Session, time: float) -> list[Event]:
        """Jams that have begun or ended since the last look."""
        self.due = time + PERIOD
        queues: dict[str, list[StoppedVehicle]] = {}
        for vehicle in session.stopped.longer_than(WATCHED):
            queues.setdefault(vehicle.lane, []).append(vehicle)
        jammed = {lane for lane, queue in queues.items() if max(q.waited for q in queue) >= JAMMED}
        self._seen.update((lane, time) for lane in self._since.keys() & queues.keys())
        over = [lane for lane, seen in self._seen.items() if time - seen >= RELEASE]
        events = [self._end_jam(time, lane) for lane in sorted(over)]
        before, self.stops = self.stops, {}
        known: dict[str, ViewAhead | None] = {}
        for lane, queue in sorted(queues.items()):
            first = max(queue, key=lambda vehicle: (vehicle.pos, vehicle.vehicle))
            reason: StopReason | str
            reason, head = explain(session.stopped, first.vehicle, known)
            if reason in (StopReason.RED, StopReason.UNKNOWN) and first.vehicle in before:
                reason = before[first.vehicle].reason
            for vehicle in queue:
                self.stops[vehicle.vehicle] = self._last_stop(session, vehicle, time, reason)
            if lane in jammed and lane not in self._since:
                self._since[lane] = time - first.waited
                self._seen[lane] = time
                events.append(self._begin_jam(time, first, len(queue), head))
        return events

    def road_is_empty(self, time: float) -> list[Event]:
        """Jams that are over because the road is empty."""
        return [self._end_jam(time, lane) for lane in sorted(self._since)]

    def _last_stop(
        self,
        session: Session,
        stopped_vehicle: StoppedVehicle,
        time: float,
        reason: StopReason | str,
    ) -> LastStop:
        front = session.vehicle_front(stopped_vehicle.vehicle)
        dx, dy = self._offset
        x = None if front is None else front.x - dx
        y = None if front is None else front.y - dy
        return LastStop(stopped_vehicle.lane, x, y, time - stopped_vehicle.waited, reason)

    def _begin_jam(self, time: float, first: StoppedVehicle, queue: int, head: str) -> Event:
        stop = self.stops[first.vehicle]
        return Event(
            time,
            EventKind.JAM_BEGIN,
            first.vehicle,
            x=stop.x,
            y=stop.y,
            lane=stop.lane,
            partner=None if head == first.vehicle else head,
            detail=stop.reason,
            waited=first.waited,
            queue=queue,
        )

    def _end_jam(self, time: float, lane: str) -> Event:
        lasted = self._seen.pop(lane) - self._since.pop(lane)
        return Event(time, EventKind.JAM_END, "", lane=lane, waited=lasted)


def explain(
    stopped: StoppedVehicles, vehicle: str, known: dict[str, ViewAhead | None] | None = None
) -> tuple[StopReason, str]:
    """Why a vehicle is stopped, and the vehicle at the head of its queue.

    Parameters
    ----------
    known
        What vehicles have ahead in this step; what is asked is added. Where much is stopped, most
        queues lead to the same few heads, and to ask SUMO takes longer than all else here.
    """
    known = {} if known is None else known
    head, seen = vehicle, {vehicle}
    ahead = _vehicle_ahead(stopped, vehicle, known)
    while ahead is not None and _own_reason(ahead) is None and ahead.leader:
        if ahead.leader in seen or len(seen) >= _HOPS:
            return StopReason.CIRCLE if ahead.leader in seen else StopReason.NO_ROOM, head
        head = ahead.leader
        seen.add(head)
        ahead = _vehicle_ahead(stopped, head, known)
    if ahead is None:
        return StopReason.UNKNOWN, head
    return _own_reason(ahead) or StopReason.UNKNOWN, head


def _vehicle_ahead(
    stopped: StoppedVehicles, vehicle: str, known: dict[str, ViewAhead | None]
) -> ViewAhead | None:
    if vehicle not in known:
        known[vehicle] = stopped.ahead(vehicle)
    return known[vehicle]


def _own_reason(ahead: ViewAhead) -> StopReason | None:
    """Return the reason that is not just the vehicle ahead."""
    if not ahead.onwards:
        return StopReason.WRONG_LANE if ahead.beside else StopReason.NO_CONNECTION
    if ahead.leader is not None:
        return None
    if ahead.light in ("r", "u"):
        return StopReason.RED
    if ahead.people:
        return StopReason.PEOPLE
    if not ahead.open:
        return StopReason.GIVES_WAY
    return None
