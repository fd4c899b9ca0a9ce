"""Points on the ground, and those of a trajectory that count from an entity which moves."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

from odscen.formats.openscenario_import.import_report import RefusedError

if TYPE_CHECKING:
    from collections.abc import Container

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport

_HERE: Final = ("dx", "dy", "ds", "dt", "dsLane", "dLane", "offset")
"""Attributes that are 0 where the entity is itself."""


class MapPoint(NamedTuple):
    """A point on the ground: metres in the OpenDRIVE frame, radians counter-clockwise from x.

    ``node`` is the node of the lane that the file names, if it names one.
    """

    x: float
    y: float
    hdg: float
    node: int | None = None

    def moved(self, ahead: float, left: float = 0.0) -> MapPoint:
        """Return the point so many metres ahead and to the left."""
        cos, sin = math.cos(self.hdg), math.sin(self.hdg)
        x, y = self.x + ahead * cos - left * sin, self.y + ahead * sin + left * cos
        return self._replace(x=x, y=y)

    def away(self, other: MapPoint) -> float:
        """Metres to another point."""
        return math.hypot(self.x - other.x, self.y - other.y)


class MovingFrame:
    """Reads such places as metres ahead of and left of the entity's reference point.

    Parameters
    ----------
    origin
        The reference point, headed along.
    own
        Name of the entity that follows the trajectory.
    """

    def __init__(self, report: ImportReport, origin: MapPoint, side: float, own: str) -> None:
        self._report, self._origin, self._side, self._own = report, origin, side, own
        self._names: set[str] = set()
        self.fixed = False
        """Whether a place of it counts from no entity."""

    def point(self, kind: _Element) -> MapPoint:
        """Point of a position relative to an entity.

        Raises
        ------
        RefusedError
            If it depends on where the entity is on the road by then.
        """
        name = self._report.word(kind, "entityRef")
        if kind.tag != "RelativeObjectPosition":
            if any(self._report.number(kind, key, 0.0) for key in _HERE):
                raise RefusedError(
                    kind, f"a place relative to {name!r}, which moves: it is known in the run only"
                )
            if kind.tag != "RelativeWorldPosition":
                self._report.mark(kind, "approximated", "headed as the entity, not as the road")
        turn = kind.find("Orientation")
        if turn is not None and turn.get("type", "absolute") == "absolute":
            raise RefusedError(turn, f"a direction of the map at {name!r}, which moves")
        self._names.add(name)
        dx, dy = (self._report.number(kind, key, 0.0) for key in ("dx", "dy"))
        return self._origin.moved(dx, self._side * dy)

    def itself(self) -> MapPoint:
        """Where the entity is that follows the trajectory."""
        self._names.add(self._own)
        return self._origin

    def base(self, kind: _Element, known: Container[str]) -> str | None:
        """Entity from which all places count; ``None`` if they are places of the map.

        Raises
        ------
        RefusedError
            If some count from it and others do not.
        """
        if not self._names:
            return None
        if self.fixed or len(self._names) > 1:
            names = " and ".join(repr(name) for name in sorted(self._names))
            where = " and to the map" if self.fixed else ""
            raise RefusedError(kind, f"places relative to {names}{where}, which move apart")
        (name,) = self._names
        if name not in known:
            raise RefusedError(kind, f"entity {name!r} is not among the actors")
        return name
