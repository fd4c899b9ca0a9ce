"""A road user as realization sees it: one vehicle or person with everything decided."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from odscen.base.categories import Category

if TYPE_CHECKING:
    from odscen.scenario.document.scenario_document import DrivingStyle


@dataclass(frozen=True, slots=True)
class RoadUser:
    """One vehicle or person with everything decided; ``spawn`` and ``goal`` are node indices.

    They count on the pedestrian graph for pedestrians and on the lane graph for everybody else.
    ``flow`` is the flow or the part of the demand that it belongs to. ``trip`` is set for members
    of the demand: many share a goal, so their ways are found from there.
    """

    id: str
    category: Category
    spawn: int
    goal: int
    depart: float
    model: str | None = None
    speed: float | None = None
    lateral_offset: float = 0.0
    style: DrivingStyle = "normal"
    flow: str | None = None
    ego: bool = False
    ignores_red: bool = False
    trip: bool = False

    @property
    def person(self) -> bool:
        """Whether it moves on the pedestrian graph."""
        return self.category is Category.PEDESTRIAN
