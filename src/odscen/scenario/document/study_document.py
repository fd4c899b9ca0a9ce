"""What is measured in a run besides what always is: times that are analysed, and stations.

Times are seconds after the start of the run. Stations lie on nodes of the lane graph: a line across
a road is a list of nodes, one for each lane.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from odscen.scenario.document.document_parts import Identifier, Label, Part

WholeSeconds = Annotated[float, Field(ge=0, le=1e9, multiple_of=1)]
Line = Annotated[tuple[Label, ...], Field(min_length=1, max_length=100)]
"""Nodes of the lane graph, one for each lane that is crossed."""


class Detector(Part):
    """Counts vehicles, their speed, and the share of the time in which one is on it."""

    id: Identifier
    nodes: Line

    @property
    def lines(self) -> tuple[tuple[str, Line], ...]:
        """Its lines, with the names of their fields."""
        return (("nodes", self.nodes),)


class TravelTimeSection(Part):
    """Measures the time from one line to another, of the vehicles that cross both."""

    id: Identifier
    begin: Line
    end: Line

    @property
    def lines(self) -> tuple[tuple[str, Line], ...]:
        """Its lines, with the names of their fields."""
        return (("begin", self.begin), ("end", self.end))


class Cordon(Part):
    """Counts the vehicles that enter and leave an area, at all the lines around it."""

    id: Identifier
    entries: Line
    exits: Line

    @property
    def lines(self) -> tuple[tuple[str, Line], ...]:
        """Its lines, with the names of their fields."""
        return (("entries", self.entries), ("exits", self.exits))


class Study(Part):
    """What of a run is analysed, and where it is measured besides.

    ``warm_up`` are seconds from the start that all figures leave out. ``interval`` is what figures
    over time are given for, 900 s for those of an hour by quarters; ``None`` leaves it to odscen.
    """

    warm_up: WholeSeconds = 0.0
    interval: Annotated[float, Field(ge=1, le=86_400, multiple_of=1)] | None = None
    detectors: tuple[Detector, ...] = ()
    sections: tuple[TravelTimeSection, ...] = ()
    cordons: tuple[Cordon, ...] = ()

    @property
    def stations(self) -> tuple[tuple[str, Detector | TravelTimeSection | Cordon], ...]:
        """All stations, with their places in the document."""
        return tuple(
            (f"study.{kind}[{index}]", station)
            for kind in ("detectors", "sections", "cordons")
            for index, station in enumerate(getattr(self, kind))
        )
