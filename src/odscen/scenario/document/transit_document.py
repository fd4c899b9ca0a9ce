"""Public transport in the scenario document: stops, and lines that serve them by a timetable.

Words are those of GTFS and Transmodel: a line has trips, which serve stops; a trip stays at a stop
for its dwell time, and no shorter than to its scheduled departure.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Self

from pydantic import Field, model_validator

from odscen.base.categories import Category
from odscen.scenario.document.distributions import Constant, WrittenDistribution
from odscen.scenario.document.document_parts import Identifier, Label, Part, Seconds

USUAL_DWELL = Constant(value=20.0)


class TransitStop(Part):
    """A place where vehicles of lines stop; ``node`` is in the middle of its ``length`` (metres).

    In a ``bay`` they stand beside the lane and hold up no other vehicle.
    """

    id: Identifier
    name: Annotated[str, Field(max_length=200)] = ""
    node: Label
    length: Annotated[float, Field(ge=5, le=200)] = 15.0
    bay: bool = False


class ServedStop(Part):
    """A stop on a line.

    ``after`` is the scheduled departure there, seconds after the departure of the trip; without it
    the vehicle goes on after its dwell time. ``dwell`` ``None`` is that of the line.
    """

    stop: Identifier
    after: Seconds | None = None
    dwell: WrittenDistribution | None = None


class TransitLine(Part):
    """A line: trips from the node ``start`` by its stops to the node ``goal``.

    Trips depart every ``headway`` seconds from ``begin`` until before ``end`` (``None``: the end of
    the run), or at the times ``departures``. Dwell times (s) are drawn for each trip and stop.
    """

    id: Identifier
    start: Label
    goal: Label | None = None
    stops: Annotated[tuple[ServedStop, ...], Field(min_length=1, max_length=500)]
    headway: Annotated[float, Field(ge=10, le=86_400)] | None = None
    begin: Seconds = 0.0
    end: Seconds | None = None
    departures: Annotated[tuple[Seconds, ...], Field(max_length=10_000)] = ()
    dwell: WrittenDistribution = USUAL_DWELL
    category: Category = Category.BUS
    model: Label | None = None

    @model_validator(mode="after")
    def _one_timetable(self) -> Self:
        if (self.headway is None) == (not self.departures):
            raise ValueError(
                f"give one of headway and departures, not {'both' if self.headway else 'none'}"
            )
        given = [one.after for one in self.stops if one.after is not None]
        if any(later <= earlier for earlier, later in pairwise(given)):
            raise ValueError("scheduled departures (after) must grow from stop to stop")
        if list(self.departures) != sorted(set(self.departures)):
            raise ValueError("departures must grow, each given once")
        return self


class Transit(Part):
    """Stops and lines of a scenario."""

    stops: tuple[TransitStop, ...] = ()
    lines: tuple[TransitLine, ...] = ()
