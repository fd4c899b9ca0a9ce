"""Teleports: recordings that put an actor somewhere, or nothing if it stays where it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Container

    from lxml.etree import _Element

    from odscen.interchange.openscenario_import.import_report import ImportReport
    from odscen.interchange.openscenario_import.read_positions import MapPoint

Made = dict[str, Any]
JUMP: Final = 0.1
"""Seconds that a teleport takes."""


def put_there(centre: MapPoint, speed: float) -> Made:
    """Recording that puts the centre of an actor at a place, with its heading there."""
    after = centre.moved(JUMP * speed)
    rows = [
        [time, round(float(at.x), 4), round(float(at.y), 4), round(float(at.hdg), 6)]
        for time, at in ((0.0, centre), (JUMP, after))
    ]
    return {"replay": {"rows": rows}}


def stays(report: ImportReport, kind: _Element, names: Container[str]) -> bool:
    """Whether a teleport leads to where the actor is, as of one that is lifted or lies down.

    ``names`` are those of the actor.
    """
    place = kind.find("Position/RelativeObjectPosition")
    if place is None or place.get("entityRef") not in names:
        return False
    if any(report.number(place, name, 0.0) for name in ("dx", "dy")):
        return False
    for one in kind.iter("*"):
        report.mark(one, "approximated", "it stays where it is: odscen has no height or tilt")
    return True
