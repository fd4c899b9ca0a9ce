"""Drivers who did not get to the lane that their route needs take another route.

Where a lane is closed or ends, or a queue stands beside, a driver may stop at the end of a lane
from which the route does not continue. SUMO lets it wait for a gap until it is teleported, and all
behind it with it. A real driver goes on with the lane and finds another route: so does one here
that has been stopped for :data:`PATIENCE` seconds with nothing before it. Who has no other route
goes on waiting.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from odscen.records.outcomes import StopReason
from odscen.records.run_events import Event, EventKind

if TYPE_CHECKING:
    from collections.abc import Collection

    from odscen.sumo.worker.detours import Detours, Pairs
    from odscen.sumo.worker.simulation.session import Session

PATIENCE = 60.0
"""Seconds of being stopped after which a driver gives up the lane that the route needs.

As long as a cycle of the lights that odscen makes, so that who only waits for green gets it first.
"""

PERIOD = 5.0
"""Simulated seconds between two looks."""


class MissedLanes:
    """Gives other routes, to no driver twice within :data:`PATIENCE`; slices of a run forget them.

    Parameters
    ----------
    net_offset
        What the network's frame is shifted by against OpenDRIVE's.
    only
        Who may get another route; ``None``: everyone.
    """

    def __init__(self, net_offset: tuple[float, float], only: frozenset[str] | None = None) -> None:
        self._offset = net_offset
        self._only = only
        self._changed: dict[str, float] = {}

    def due(self, begin: float, length: float) -> bool:
        """Whether to look before the step from ``begin`` that lasts ``length`` (s)."""
        return begin % PERIOD < length and begin >= PATIENCE

    def before_step(
        self,
        session: Session,
        time: float,
        detours: Detours,
        closed: dict[str, Pairs],
        moved: Collection[str] = (),
    ) -> list[Event]:
        """Give another route to all who wait in vain for a lane; what happened.

        Parameters
        ----------
        closed
            Pairs of edges between which no vehicle of a class may drive now.
        moved
            Who is driven by something else, and stays as it is.
        """
        events = []
        for stopped in session.stopped.longer_than(PATIENCE):
            name = stopped.vehicle
            if name in moved or (self._only is not None and name not in self._only):
                continue
            if time - self._changed.get(name, -PATIENCE) < PATIENCE:
                continue
            view = session.stopped.ahead(name)
            if view is None or view.onwards or view.beside is None:
                continue
            route = _find_route(session, name, stopped.lane, detours, closed)
            front = session.vehicle_front(name)
            if route is None or not session.set_route(name, route):
                continue
            self._changed[name] = time
            dx, dy = self._offset
            events.append(
                Event(
                    time,
                    EventKind.ROUTE_CHANGED,
                    name,
                    x=None if front is None else front.x - dx,
                    y=None if front is None else front.y - dy,
                    lane=stopped.lane,
                    detail=StopReason.WRONG_LANE,
                    waited=stopped.waited,
                )
            )
        return events


def _find_route(
    session: Session, name: str, lane: str, detours: Detours, closed: dict[str, Pairs]
) -> tuple[str, ...] | None:
    """Quickest route that a lane leads onto, by all stops; ``None`` if none leads to the goal.

    Where the vehicle's own lane leads nowhere, that of the nearest lane from which one does.
    """
    vclass = session.vehicle_class(name)
    ahead = session.route_ahead(name)
    shut = closed.get(vclass, frozenset())
    if len(ahead.edges) < 2 or ahead.inside:
        return None
    onwards = {edge for _, edge in session.lanes.onwards(lane, vclass)}
    if ahead.edges[1] in onwards and session.stopped.is_at_red(name):
        return None
    here, goals = ahead.edges[0], (*session.stop_edges(name), ahead.edges[-1])
    lanes = session.lanes.in_order(here)
    own = lanes.index(lane)
    for start in sorted(lanes, key=lambda other: (abs(lanes.index(other) - own), other)):
        routes = []
        for part in _parts_from(session, start, vclass, goals[0]):
            steps = (here, *part)
            rest = detours.by_stops(part[-1], goals, vclass, shut)
            if rest is not None and shut.isdisjoint(pairwise(steps)):
                routes.append((*steps, *rest[1:]))
        others = [route for route in routes if route[1:3] != ahead.edges[1:3]]
        if others:
            return min(others, key=lambda route: (detours.seconds(route, vclass), route))
    return None


def _parts_from(session: Session, lane: str, vclass: str, goal: str) -> list[tuple[str, ...]]:
    """Two edges that a lane leads over, or one if that is the goal.

    Two, as SUMO looks further than one for the lane that it wants.
    """
    parts: set[tuple[str, ...]] = set()
    for after, edge in session.lanes.onwards(lane, vclass):
        if edge == goal:
            parts.add((edge,))
            continue
        parts.update((edge, second) for _, second in session.lanes.onwards(after, vclass))
    return sorted(parts)
