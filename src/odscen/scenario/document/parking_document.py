"""Parking in the demand of the scenario document: which trips begin and end in parking places."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from odscen.scenario.document.distributions import Constant, WrittenDistribution
from odscen.scenario.document.document_parts import Part

USUAL_STAY = Constant(value=3600.0)

ParkingShare = Annotated[float, Field(ge=0, le=1)]


class TripParking(Part):
    """Shares of the cars of matrices, inputs and background that park.

    ``begin`` is the share that begin in a parking place (inputs begin at the boundary), ``end``
    the share that end in one. ``stay`` is how long a place is taken, seconds: before a trip that
    begins there, and after one that has ended there. Between zones, places are at most ``within``
    metres from where the trip would begin or end; elsewhere anywhere in the region.
    """

    begin: ParkingShare = 0.0
    end: ParkingShare = 0.0
    stay: WrittenDistribution = USUAL_STAY
    within: Annotated[float, Field(ge=10, le=10_000)] = 300.0

    @property
    def used(self) -> bool:
        """Whether any trip parks."""
        return self.begin > 0.0 or self.end > 0.0
