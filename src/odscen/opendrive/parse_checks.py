"""Checks across elements: geometry that fits together, references that lead somewhere."""

from __future__ import annotations

from odscen.ids import JunctionId, RoadId
from odscen.opendrive.model import Controller, Junction, Road
from odscen.opendrive.parse_rules import Notes


def check_geometry(roads: dict[RoadId, Road], notes: Notes) -> None:
    """Refuse geometry that does not fit together; note what is within the tolerances."""


def check_references(
    roads: dict[RoadId, Road],
    junctions: dict[JunctionId, Junction],
    controllers: dict[str, Controller],
    notes: Notes,
) -> tuple[dict[RoadId, Road], dict[JunctionId, Junction]]:
    """Leave out and note references that lead nowhere."""
    return roads, junctions
