"""A road user as realization sees it: one vehicle or person with everything decided."""

from __future__ import annotations

from dataclasses import dataclass

from odscen.base.categories import Category
from odscen.scenario.document.scenario_document import Actor

_DEFAULT_DESIGN = Actor(id="any", category=Category.CAR, spawn="any")
"""Its optional fields have the document's defaults; the others mean nothing."""


@dataclass(frozen=True, slots=True)
class RoadUser:
    """One vehicle or person with everything decided; ``spawn`` and ``goal`` are node indices.

    They count on the pedestrian graph for pedestrians and on the lane graph for vehicles.
    ``flow`` is the flow or the part of the demand that it belongs to. ``trip`` is set for members
    of the demand: many share a goal, so their paths are found from there.

    ``entering`` is set for those who drive in at the boundary of the region, at speed.

    ``design`` is the actor as the document has it, for what is not decided here but acted on as it
    is: model, style and the like. Members of flows and demand have the defaults.
    """

    id: str
    category: Category
    spawn: int
    goal: int
    depart: float
    speed: float | None = None
    flow: str | None = None
    trip: bool = False
    entering: bool = False
    design: Actor = _DEFAULT_DESIGN

    @property
    def person(self) -> bool:
        """Whether it moves on the pedestrian graph."""
        return self.category is Category.PEDESTRIAN
