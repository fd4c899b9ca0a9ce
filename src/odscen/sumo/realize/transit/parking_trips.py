"""Trips of the demand that begin and end in parking places."""

from __future__ import annotations

from dataclasses import replace
from itertools import accumulate
from typing import TYPE_CHECKING

from odscen.base.categories import Category
from odscen.scenario.demand.trips import FIRST, ParkableTrip, ParkingChoice
from odscen.sumo.realize.road_user import ParkingStay, appears_at
from odscen.sumo.realize.transit.parking_places import parking_positions

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.scenario.demand.trips import Parked
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.scenario.placing.region import Region
    from odscen.sumo.realize.road_user import RoadUser
    from odscen.sumo.realize.sumo_map import SumoMap


class ParkingOfTrips:
    """Lets trips of a scenario park, as its demand says."""

    def __init__(self, scenario: Scenario, sumo_map: SumoMap, region: Region) -> None:
        demand = scenario.demand
        areas = [
            parking_position.area
            for parking_position in parking_positions(sumo_map, region.lanes).values()
        ]
        lanes = region.graph.lanes
        router = region.router_over(sumo_map.drivable)
        self._choice = ParkingChoice(scenario, areas, lanes, router)
        self._unreached = sumo_map.parking.unreached
        inside = [area for area in sumo_map.parking.areas if region.lanes[area.node]]
        self._unplaced = len(inside) - len(areas)
        self._zoned = {matrix.id for matrix in demand.matrices}
        self._begin = self._zoned | {part.id for part in demand.background}
        self._end = self._begin | {part.id for part in demand.inputs}
        self._led = self._zoned | {part.id for part in demand.inputs if part.to}

    def applied(self, users: Sequence[RoadUser]) -> tuple[list[RoadUser], list[str]]:
        """Trips with their starts and goals in parking areas, and in words what is left out."""
        chosen = self._choice.choose(
            [self._parkable_trip(user) for user in users if self._may_park(user)]
        )
        missed = sum(trip.missed for trip in chosen.values())
        parked = [
            _with_parking(user, chosen[user.id].begin, chosen[user.id].end)
            if user.id in chosen
            else user
            for user in users
        ]
        return parked, list(self._describe_missed(missed))

    def _describe_missed(self, missed: int) -> list[str]:
        left_out = {
            f"{missed} ends of trips are on the road: no free parking place within reach": missed,
            f"{self._unreached} parking places left out: no lane for cars beside them, or of an "
            "unusual size": self._unreached,
            f"{self._unplaced} parking areas left out: the SUMO network has no lane for cars there":
            self._unplaced,
        }  # fmt: skip
        return [f"parking: {words}" for words, count in left_out.items() if count]

    def _may_park(self, user: RoadUser) -> bool:
        return user.category is Category.CAR and user.flow in self._end and user.depart >= FIRST

    def _parkable_trip(self, user: RoadUser) -> ParkableTrip:
        return ParkableTrip(
            id=user.id,
            start=user.spawn,
            goal=user.goal,
            depart=user.depart,
            begins=user.flow in self._begin,
            ends=True,
            near_start=user.flow in self._zoned,
            near_goal=user.flow in self._led,
        )


def places_to_begin(users: Sequence[RoadUser]) -> dict[str, int]:
    """Most cars that are in each area at a time because their trips begin there."""
    changes: dict[str, list[tuple[float, int]]] = {}
    for user in users:
        if user.begins is not None:
            steps = changes.setdefault(user.begins.area, [])
            steps += [(appears_at(user), 1), (user.depart, -1)]
    # Who comes when another leaves needs a place of its own: it may leave a little later.
    return {
        area: max(
            accumulate(step for _, step in sorted(steps, key=lambda step: (step[0], -step[1])))
        )
        for area, steps in sorted(changes.items())
    }


def _with_parking(user: RoadUser, begin: Parked | None, end: Parked | None) -> RoadUser:
    if begin is not None:
        stay = ParkingStay(begin.area.id, begin.stay)
        user = replace(user, spawn=begin.area.node, begins=stay)
    if end is not None:
        user = replace(user, goal=end.area.node, ends=ParkingStay(end.area.id, end.stay))
    return user
