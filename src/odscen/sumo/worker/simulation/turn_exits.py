"""Changes of lanes that wait until a vehicle has left its turn.

SUMO begins a change as soon as the front is on the road behind a junction. Where the lane that it
changes to has nothing beside the path of the turn, it then takes the rear to be at the begin of
that road: the heading of a body that is half in the turn leaps by as much as it still has to turn,
up to 70 degrees within a step. Here such a change waits for the rear, a second or so.

A step costs little: how far the next such turn of a route is says when a vehicle can be there at
the earliest, and nobody asks for it before.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from contextlib import suppress
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from odscen.sumo.worker.simulation.foreign_traffic import is_foreign
from odscen.sumo.worker.simulation.planned_looks import PlannedLooks, seconds_to

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from odscen.sumo.worker.simulation.road_lanes import RoadLanes

_WAITING, _OWN_LANES = 256, 1621
"""``setLaneChangeMode``: no change begins, as the session has it by another number; SUMO's own."""
_LEAP = math.radians(8.0)
"""Angle by which the heading may leap."""
_BODY = 4.5
"""Metres of a car, over which that angle is measured."""
_SHORTEST = 8.0
"""Metres of a road behind a turn: on shorter ones there is no time to wait."""
_SHARE = 0.6
"""Of a road behind a turn, on which one waits at most."""
_LOOK_AGAIN = 60.0
"""Seconds after which a vehicle is looked at again in any case, as it may have another route."""
_MOST_KEPT = 2_000
"""Routes that are kept in mind."""


class _Route(NamedTuple):
    """Metres from the begin of a route to the end of each edge, at least, and its turns.

    These by the places of the edges before them, and for each the edge behind it.
    """

    metres: list[float]
    places: list[int]
    onto: list[str]


class TurnExits:
    """Has vehicles that turn into a road of several lanes wait before they change lanes there.

    Parameters
    ----------
    sumo, errors
        libsumo, and what it raises.
    lanes
        Those of the network.
    native
        Gives the function of libsumo behind one of Python, by domain and name.
    """

    def __init__(
        self,
        sumo: Any,
        errors: tuple[type[Exception], ...],
        lanes: RoadLanes,
        native: Callable[[str, str], Any],
    ) -> None:
        self._sumo, self._errors, self._lanes = sumo, errors, lanes
        self._lane_of, self._position_of, self._speed_of = (
            native("vehicle", f"get{what}") for what in ("LaneID", "LanePosition", "Speed")
        )
        self._route_of, self._route_name_of, self._index_of = (
            native("vehicle", f"getRoute{what}") for what in ("", "ID", "Index")
        )
        self._looks = PlannedLooks(sumo, native)
        self._waits: dict[str, str] = {}
        self._routes: dict[str, _Route] = {}
        self._leaps: dict[tuple[str, str], bool] = {}

    def before_step(
        self, *, only: frozenset[str] | None = None, moved: Collection[str] = ()
    ) -> None:
        """Have those wait who may turn in the step to come, and no longer those who have turned.

        Parameters
        ----------
        only
            Who is looked at; ``None``: everyone.
        moved
            Who is driven by something else.
        """
        names = self._looks.next_step()
        new = [n for n in names if not is_foreign(n) and (only is None or n in only)]
        for name in (*new, *self._looks.take_due()):
            try:
                self._look_at(name, is_moved=name in moved)
            except self._errors:  # it has arrived
                self._waits.pop(name, None)

    def forget(self) -> None:
        """Let all change lanes again, before the state is saved."""
        for name in sorted(self._waits):
            with suppress(*self._errors):
                self._release_vehicle(name)
        self._looks.plan_all_now()

    def _release_vehicle(self, name: str) -> None:
        vehicle = self._sumo.vehicle
        del self._waits[name]
        if vehicle.getLaneChangeMode(name) == _WAITING:  # a rule may have said otherwise
            vehicle.setLaneChangeMode(name, _OWN_LANES)

    def _look_at(self, name: str, *, is_moved: bool) -> None:
        """Have a vehicle wait or not, and say when it may be otherwise, at the earliest."""
        lane, vehicle = self._lane_of(name), self._sumo.vehicle
        if not lane:  # it is being teleported
            self._looks.plan(name, 1.0)
            return
        position, gains = self._position_of(name), vehicle.getAccel(name)
        if name in self._waits:
            if lane in self._lanes.internal:
                self._looks.plan(name, 0.0)
                return
            room = _SHARE * self._sumo.lane.getLength(lane)
            rest = min(vehicle.getLength(name), room) - position
            if rest > 0.0 and self._sumo.lane.getEdgeID(lane) == self._waits[name]:
                self._looks.plan(name, seconds_to(rest, self._speed_of(name), gains))
                return
            self._release_vehicle(name)
        route, index = self._route_named(name), self._index_of(name)
        number = bisect_left(route.places, index)
        if number == len(route.places):
            self._looks.plan(name, _LOOK_AGAIN)
            return
        place, speed = route.places[number], self._speed_of(name)
        if lane in self._lanes.internal:
            if place > index:
                self._looks.plan(name, 0.0)
                return
            rest = 0.0
        else:
            rest = route.metres[place] - (route.metres[index - 1] if index > 0 else 0.0) - position
        soon = (speed + gains * self._looks.step_length) * self._looks.step_length
        if rest > soon + gains * self._looks.step_length**2:
            self._looks.plan(name, min(_LOOK_AGAIN, seconds_to(rest - soon, speed, gains)))
            return
        onto = route.onto[number]
        # Who is on a lane that does not lead there has to change before the turn.
        if not is_moved and (lane in self._lanes.internal or self._leads_onto(lane, onto)):
            vehicle.setLaneChangeMode(name, _WAITING)
            self._waits[name] = onto
        self._looks.plan(name, 0.0)

    def _leads_onto(self, lane: str, onto: str) -> bool:
        edge_of = self._sumo.lane.getEdgeID
        return any(edge_of(link[0]) == onto for link in self._lanes.links_of[lane])

    def _route_named(self, name: str) -> _Route:
        """The route of a vehicle, with the turns on it."""
        route_name = self._route_name_of(name)
        known = self._routes.get(route_name)
        if known is not None:
            return known
        if len(self._routes) >= _MOST_KEPT:
            self._routes.clear()
        edges = self._route_of(name)
        known = _Route([], [], [])
        metres = 0.0
        for edge in edges:
            metres += min(map(self._sumo.lane.getLength, self._lanes.of_edge[edge]))
            known.metres.append(metres)
        for place, pair in enumerate(pairwise(edges)):
            leaps = self._leaps.get(pair)
            if leaps is None:
                leaps = self._leaps[pair] = self._would_leap(*pair)
            if leaps:
                known.places.append(place)
                known.onto.append(pair[1])
        self._routes[route_name] = known
        return known

    def _would_leap(self, edge: str, onto: str) -> bool:
        """Whether the heading of a body that changes lanes behind a turn would leap."""
        lane = self._sumo.lane
        behind = [
            name
            for name in self._lanes.of_edge[onto]
            if tuple(lane.getAllowed(name)) != ("pedestrian",)
        ]
        if len(behind) < 2 or lane.getLength(behind[0]) < _SHORTEST:
            return False
        for source in self._lanes.of_edge[edge]:
            for link in self._lanes.links_of[source]:
                if link[4] and lane.getEdgeID(link[0]) == onto:
                    paths = [link[4]]
                    while inner := next(
                        (more[4] for more in self._lanes.links_of[paths[-1]] if more[4]), ""
                    ):
                        paths.append(inner)
                    last = [point[:2] for path in paths for point in lane.getShape(path)]
                    if _bend_at_end(last, lane.getShape(link[0])) > _LEAP:
                        return True
        return False


def _bend_at_end(path: Sequence[tuple[float, ...]], onto: Sequence[tuple[float, ...]]) -> float:
    """Angle between the last metres of a path and the first step of the lane behind it."""
    metres, begin = 0.0, path[0]
    for after, before in pairwise(reversed(path)):
        step = math.dist(after, before)
        if metres + step >= _BODY:
            share = (_BODY - metres) / step
            begin = tuple(a + share * (b - a) for a, b in zip(after, before, strict=True))
            break
        metres += step
    chord = math.atan2(path[-1][1] - begin[1], path[-1][0] - begin[0])
    ahead = math.atan2(onto[1][1] - onto[0][1], onto[1][0] - onto[0][0])
    return abs(math.remainder(ahead - chord, math.tau))
