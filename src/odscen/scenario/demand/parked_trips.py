"""Which trips begin and end in which parking areas.

Drawn for each trip by the seed and its id, so that other trips change nothing, but for one thing:
where no place is left for a car to begin from, it begins elsewhere.

Places are dealt out to cars that begin and cars that end in the area, in proportion to the shares
of both: a place that is promised to a trip must not be taken by another when it is due.
"""

from __future__ import annotations

from bisect import bisect_right, insort
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.scenario.document.named_random import stream

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.base.arrays import BoolArray, Int32Array
    from odscen.lanegraph.graphs import LaneGraph
    from odscen.lanegraph.parking_areas import ParkingArea
    from odscen.lanegraph.shortest_paths import Router
    from odscen.scenario.document.parking_document import TripParking
    from odscen.scenario.document.scenario_document import Scenario

LEAST_STAY = 1.0
"""Seconds: SUMO needs a step to park in."""


class Parked(NamedTuple):
    """An area of the map, and seconds that a car stays in it."""

    area: ParkingArea
    stay: float


class ParkableTrip(NamedTuple):
    """A trip by car that may park.

    Attributes
    ----------
    start, goal
        Nodes of the lane graph.
    depart
        Seconds.
    begins, ends
        Whether it may begin, and end, in a parking place.
    near_start, near_goal
        Whether that has to be near its start, and its goal.
    """

    id: str
    start: int
    goal: int
    depart: float
    begins: bool
    ends: bool
    near_start: bool
    near_goal: bool


class ParkedTrip(NamedTuple):
    """Where a trip begins and ends parked; ``missed`` counts ends for which there was no place."""

    begin: Parked | None = None
    end: Parked | None = None
    missed: int = 0


class ParkingChoice:
    """Chooses areas for the trips of a scenario.

    Parameters
    ----------
    areas
        Those that the simulator has.
    lanes
        The lane graph.
    router
        Paths inside the region that the simulator has.
    """

    def __init__(
        self, scenario: Scenario, areas: Iterable[ParkingArea], lanes: LaneGraph, router: Router
    ) -> None:
        self._scenario = scenario
        self._lanes = lanes
        self._how = scenario.demand.parking
        self._router = router
        self.areas = tuple(area for area in areas if router.mask[area.node])
        self._nodes = np.array([area.node for area in self.areas], dtype=np.int32)
        places = np.array([len(area.places) for area in self.areas], dtype=np.int32)
        self._first = _places_to_begin(places, self._how)
        self._last = places - self._first if self._how.end else 0 * places
        self._left: list[list[float]] = [[] for _ in self.areas]

    def choose(self, trips: Sequence[ParkableTrip]) -> dict[str, ParkedTrip]:
        """Choose for all trips, in the order of their departure; those that park, by id."""
        if not self.areas or not trips:
            return {}
        starts, goals = (
            np.array([getattr(trip, key) for trip in trips], dtype=np.int32)
            for key in ("start", "goal")
        )
        onto, from_starts = self._router.reach(starts, self._nodes)
        rows, table = self._router.reach(self._nodes, np.unique(goals))
        to_goals = table[rows]
        columns = np.searchsorted(np.unique(goals), goals)
        rows, table = self._router.reach(self._nodes, self._nodes)
        between = table[rows]
        found: dict[str, ParkedTrip] = {}
        for at in sorted(range(len(trips)), key=lambda at: (trips[at].depart, trips[at].id)):
            one = self._one(trips[at], from_starts[onto[at]], to_goals[:, columns[at]], between)
            if one != ParkedTrip():
                found[trips[at].id] = one
        return found

    def _one(
        self, trip: ParkableTrip, reached: BoolArray, leads: BoolArray, between: BoolArray
    ) -> ParkedTrip:
        rng = stream(self._scenario.seed, "parking", trip.id)
        uniform = rng.random(4).tolist()
        stays = [max(round(self._how.stay.draw(rng), 1), LEAST_STAY) for _ in range(2)]
        first = last = None
        missed = 0
        if trip.begins and uniform[0] < self._how.begin:
            near = self._near(trip.start) if trip.near_start else True
            free = np.array([self._has_room(k, trip.depart - stays[0]) for k in range(len(leads))])
            first = self._drawn(leads & near & free, uniform[1], self._first)
            missed += first is None
            if first is not None:
                insort(self._left[first], trip.depart)
        if trip.ends and uniform[2] < self._how.end:
            good = reached.copy() if first is None else between[first].copy()
            good &= self._near(trip.goal) if trip.near_goal else True
            if first is not None:
                good[first] = False
            last = self._drawn(good, uniform[3], self._last)
            missed += last is None
        return ParkedTrip(
            None if first is None else Parked(self.areas[first], stays[0]),
            None if last is None else Parked(self.areas[last], stays[1]),
            missed,
        )

    def _has_room(self, row: int, since: float) -> bool:
        """Whether a place is free from ``since`` on of cars that leave later than that."""
        there = self._left[row]
        return len(there) - bisect_right(there, since) < int(self._first[row])

    def _near(self, node: int) -> BoolArray:
        lanes = self._lanes
        away = np.hypot(lanes.x[self._nodes] - lanes.x[node], lanes.y[self._nodes] - lanes.y[node])
        near: BoolArray = np.less_equal(away, self._how.within)
        return near

    @staticmethod
    def _drawn(good: BoolArray, uniform: float, places: Int32Array) -> int | None:
        """Draw one of the areas, by the number of their places."""
        sums = np.cumsum(np.where(good, places, 0))
        if sums[-1] <= 0:
            return None
        return int(np.searchsorted(sums, uniform * sums[-1], side="right"))


def _places_to_begin(places: Int32Array, how: TripParking) -> Int32Array:
    """Places of each area that cars may begin in; one at least is left to those that end."""
    if how.begin <= 0.0:
        return 0 * places
    share = how.begin / (how.begin + how.end)
    own = np.ceil(places * share).astype(np.int32)
    return np.minimum(own, places - 1) if how.end > 0.0 else places
