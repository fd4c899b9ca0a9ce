"""A road user as realization sees it: one vehicle or person with everything decided."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from odscen.base.categories import Category
from odscen.scenario.demand.trips import FIRST
from odscen.scenario.document.scenario_document import Actor

_DEFAULT_DESIGN = Actor(id="any", category=Category.CAR, spawn="any")
"""Its optional fields have the document's defaults; the others mean nothing."""


class StopVisit(NamedTuple):
    """A stop of a vehicle of a line: ``node`` of the lane graph, seconds it stays at least.

    ``scheduled`` is when it departs there at the earliest, seconds; ``None`` without a timetable.
    """

    stop: str
    node: int
    dwell: float
    scheduled: float | None


class ParkingStay(NamedTuple):
    """A parking area and seconds that a place there is taken."""

    area: str
    seconds: float


@dataclass(frozen=True, slots=True)
class RoadUser:
    """One vehicle or person with everything decided; ``spawn`` and ``goal`` are node indices.

    They count on the pedestrian graph for pedestrians and on the lane graph for vehicles.
    ``flow`` is the flow or the part of the demand that it belongs to. ``trip`` is set for members
    of the demand: many share a goal, so their paths are found from there.

    ``initial_speed`` is what a vehicle is to depart with, m/s; ``None`` is from rest.

    ``entering`` is set for those who drive in at the boundary of the region, at speed.

    ``via`` are nodes that its route leads through, in their order.

    ``visits`` are the stops of a vehicle of a line, in their order.

    ``begins`` and ``ends`` are where a trip begins and ends parked; ``depart`` is then when it
    leaves its place.

    ``design`` is the actor as the document has it, for what is not decided here but acted on as it
    is: model, style and the like. Members of flows and demand have the defaults.
    """

    id: str
    category: Category
    spawn: int
    goal: int
    depart: float
    speed: float | None = None
    initial_speed: float | None = None
    flow: str | None = None
    trip: bool = False
    entering: bool = False
    via: tuple[int, ...] = ()
    visits: tuple[StopVisit, ...] = ()
    begins: ParkingStay | None = None
    ends: ParkingStay | None = None
    design: Actor = _DEFAULT_DESIGN

    @property
    def places(self) -> tuple[int, ...]:
        """Nodes that it goes to one after the other, the goal last."""
        return (*self.via, *(visit.node for visit in self.visits), self.goal)

    @property
    def person(self) -> bool:
        """Whether it moves on the pedestrian graph."""
        return self.category is Category.PEDESTRIAN


def appears_at(user: RoadUser) -> float:
    """When a vehicle is inserted, s: one that begins parked is in its place before it departs."""
    if user.begins is None:
        return user.depart
    return round(max(user.depart - user.begins.seconds, FIRST), 2)
