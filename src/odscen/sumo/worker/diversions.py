"""What measures of the scenario do during a run: who finds a turn closed takes another route.

When a closure begins every driver knows of it: those on the road whose route leads over what is
closed take the quickest other one in free flow, and so do those who depart later. Who has none, as
the goal is closed, ends the trip or waits before it if the measure says so; all others are
stranded, and taken out. SUMO's rerouters close the lanes, in plain ``sumo`` too; but they know no
closed turns, and end trips to a closed goal anywhere.
"""

from __future__ import annotations

from bisect import bisect_left
from itertools import pairwise
from typing import TYPE_CHECKING

from odscen.records.run_events import Event, EventKind
from odscen.sumo.worker.detours import Detours

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from odscen.records.run_plan import ClosedPeriod, Plan
    from odscen.sumo.worker.detours import Pairs
    from odscen.sumo.worker.simulation.observed import RouteAhead
    from odscen.sumo.worker.simulation.session import Session


class Diversions:
    """Follows the measures of one simulation, step by step; nothing is kept between slices."""

    def __init__(self, plan: Plan) -> None:
        self._measures = plan.measures
        self._closed = plan.closed
        self._offset = plan.net_offset
        self._last = plan.until
        moments = {period.begin for period in plan.closed} | {period.end for period in plan.closed}
        moments |= {measure.begin for measure in plan.measures} | {
            measure.end for measure in plan.measures
        }
        self._moments = sorted(moments)
        vehicles = sorted((actor.depart, actor.id) for actor in plan.actors if not actor.person)
        self._departs = [depart for depart, _ in vehicles]
        self._names = [name for _, name in vehicles]
        self._informed = frozenset(actor.id for actor in plan.actors if actor.informed)
        self._pairs: Mapping[str, Pairs] = {}
        self._periods: Mapping[str, ClosedPeriod] = {}
        self._detours: Detours | None = None
        self._inside: set[str] = set()
        self._cut_off: set[str] = set()
        self._begun = False

    @property
    def detours(self) -> Detours | None:
        """Finds routes, if any measure closes something."""
        return self._detours

    @property
    def closed_pairs(self) -> dict[str, Pairs]:
        """By class of vehicles: edges between which they may not drive now."""
        return dict(self._pairs)

    def before_step(self, session: Session, begin: float, length: float) -> list[Event]:
        """Act before the step from ``begin`` that lasts ``length`` (s); what happened."""
        index = bisect_left(self._moments, begin)
        changed = index < len(self._moments) and self._moments[index] < begin + length
        events = self._begun_and_ended(begin, begin + length) if changed else []
        if self._closed and self._detours is None:  # as long as no lane is closed
            self._detours = Detours(session.lanes.links())
        if changed or not self._begun:
            self._update_closed(begin + length)
        events += self._strand_departed(session, begin)
        if self._pairs:
            # Right after a state is loaded as well: who was inside a junction was not led around.
            everyone = changed or not self._begun
            concerned = session.vehicles() if everyone else ()
            waiting = session.waiting_vehicles() if everyone else ()
            # SUMO inserts in the first step that begins after the departure.
            departing = self._departing_between(begin - length, begin + length)
            # SUMO's rerouting knows no closed turns, and may have led those over one.
            looking = self._informed.intersection(session.vehicles()) if self._informed else ()
            events += self._divert_vehicles(
                session, {*concerned, *waiting, *departing, *looking, *self._inside}, begin
            )
        self._begun = True
        return events

    def last_events(self, now: float) -> list[Event]:
        """Ends of the measures that last to the end of the run."""
        return [
            Event(now, EventKind.MEASURE_END, measure.id, detail=measure.words)
            for measure in self._measures
            if measure.begin < now <= measure.end
            and (measure.end > now or measure.end >= self._last)
        ]

    def _begun_and_ended(self, begin: float, end: float) -> list[Event]:
        events = []
        for measure in self._measures:
            if begin <= measure.end < end and measure.end < self._last:
                events.append(
                    Event(measure.end, EventKind.MEASURE_END, measure.id, detail=measure.words)
                )
            if begin <= measure.begin < end:
                events.append(
                    Event(measure.begin, EventKind.MEASURE_BEGIN, measure.id, detail=measure.words)
                )
        return sorted(events, key=lambda event: event.time)

    def _update_closed(self, end: float) -> None:
        """Know what is closed in the step that ends at ``end``."""
        active = [period for period in self._closed if period.begin < end and period.end >= end]
        self._pairs = {period.vclass: frozenset(period.pairs) for period in active}
        self._periods = {period.vclass: period for period in active}
        self._inside = set()

    def _departing_between(self, begin: float, end: float) -> list[str]:
        return self._names[bisect_left(self._departs, begin) : bisect_left(self._departs, end)]

    def _divert_vehicles(
        self, session: Session, vehicles: Iterable[str], time: float
    ) -> list[Event]:
        events = []
        for name in sorted(vehicles):
            self._inside.discard(name)
            vclass = session.vehicle_class(name)
            closed = self._pairs.get(vclass)
            if closed is None or self._detours is None:
                continue
            ahead = session.route_ahead(name)
            last = _last_open(ahead.edges, closed)
            if last == len(ahead.edges):
                continue
            if ahead.inside:
                self._inside.add(name)
                continue
            goals = (*session.stop_edges(name), ahead.edges[-1])
            route = self._detours.by_stops(ahead.edges[0], goals, vclass, closed)
            if route is not None and session.set_route(name, ahead.start + route):
                continue
            if self._stop_before_goal(session, name, vclass, ahead, closed):
                continue
            if session.has_departed(name):
                events.append(self._strand_vehicle(session, name, time))
            else:  # SUMO does not bear that a vehicle is taken out before it has departed
                session.set_route(name, ahead.start + ahead.edges[:last])
                self._cut_off.add(name)
        return events

    def _stop_before_goal(
        self, session: Session, name: str, vclass: str, ahead: RouteAhead, closed: Pairs
    ) -> bool:
        """Let a trip to a closed goal end, or wait, on the last open edge; whether it does."""
        period, goal = self._periods[vclass], ahead.edges[-1]
        until = dict(period.waits).get(goal)
        if self._detours is None or (until is None and goal not in period.ends):
            return False
        stops = session.stop_edges(name)
        for last in range(len(ahead.edges) - 2, -1, -1):
            edge = ahead.edges[last]
            goals = (*(stop for stop in stops if stop != edge), edge)
            route = self._detours.by_stops(ahead.edges[0], goals, vclass, closed)
            if route is None:
                continue
            if until is None:
                return session.set_route(name, ahead.start + route)
            whole = ahead.start + route + ahead.edges[last + 1 :]
            return session.set_route(name, whole) and session.park_until(name, edge, until)
        return False

    def _strand_departed(self, session: Session, time: float) -> list[Event]:
        """Take out those who found no route when they were to depart, and have departed now."""
        departed = [name for name in sorted(self._cut_off) if session.has_departed(name)]
        self._cut_off.difference_update(departed)
        return [self._strand_vehicle(session, name, time) for name in departed]

    def _strand_vehicle(self, session: Session, name: str, time: float) -> Event:
        front = session.vehicle_front(name)
        session.take_out(name)
        if front is None:
            return Event(time, EventKind.STRANDED, name)
        dx, dy = self._offset
        return Event(time, EventKind.STRANDED, name, x=front.x - dx, y=front.y - dy)


def _last_open(edges: tuple[str, ...], closed: Pairs) -> int:
    """How many edges of a route come before the first closed turn; all if none is closed."""
    pairs = enumerate(pairwise(edges), start=1)
    return next((number for number, pair in pairs if pair in closed), len(edges))
