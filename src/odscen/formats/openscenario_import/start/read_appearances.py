"""Entities that no teleport places at first: added, put on the road later, or on a trajectory."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from odscen.formats.openscenario_import.import_report import RefusedError
from odscen.formats.openscenario_import.places.read_trajectories import read_trajectory

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from lxml.etree import _Element

    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.places.map_points import MapPoint
    from odscen.formats.openscenario_import.places.read_positions import PositionReader


@dataclass(slots=True)
class AppearanceReader:
    """Finds places for entities that have none after the teleports of ``Init``.

    Attributes
    ----------
    late
        Names of entities that appear in the story only.
    departing
        Names of those of them that only depart later, in a file that odscen wrote.
    deleted
        Names of entities that are deleted before the story begins.
    """

    report: ImportReport
    positions: PositionReader
    late: set[str] = field(default_factory=set)
    departing: set[str] = field(default_factory=set)
    deleted: set[str] = field(default_factory=set)

    def read(self, board: _Element, names: Iterable[str]) -> None:
        """Fill in the starts of the entities of these names, as far as the file has some."""
        for about in board.iterfind("Init/Actions/GlobalAction/EntityAction"):
            self._at_first(about)
        for name in names:
            if name in self.positions.starts:
                continue
            for place in self._possible_places(board, name):
                self._put_entity(name, place)
                break

    def _at_first(self, about: _Element) -> None:
        name = about.get("entityRef", "")
        parent = about.getparent()
        for element in (about, *(() if parent is None else (parent,)), *about):
            self.report.mark(element, "taken")
        if about.find("DeleteEntityAction") is not None:
            self.deleted.add(name)
            return
        position = about.find("AddEntityAction/Position")
        if position is not None:
            self.report.mark(position, "taken")
            self._put_entity(name, lambda: self.positions.point(position))

    def _possible_places(self, board: _Element, name: str) -> Iterator[Callable[[], MapPoint]]:
        """Where an entity begins: on a trajectory at first, or where the story puts it first."""
        for private in board.iterfind("Init/Actions/Private"):
            for kind in private.iter("FollowTrajectoryAction"):
                if private.get("entityRef") == name:
                    yield lambda kind=kind: self._begin_of_trajectory(kind)  # type: ignore[misc]
        for kind in board.iterfind("Story//Position"):
            if self._entity_put_at(kind) == name:
                self.late.add(name)
                group = next(kind.iterancestors("ManeuverGroup"), None)
                if group is not None and group.get("name") == f"{name} departs":
                    self.departing.add(name)
                yield lambda kind=kind: self.positions.point(kind)  # type: ignore[misc]

    def _begin_of_trajectory(self, kind: _Element) -> MapPoint:
        self.report.mark(kind, "approximated", "the actor starts on it")
        first, second, *_ = (
            point.at for point in read_trajectory(self.report, self.positions, kind)
        )
        return first._replace(hdg=math.atan2(second.y - first.y, second.x - first.x))

    @staticmethod
    def _entity_put_at(position: _Element) -> str | None:
        """Name of the entity that an action of the story puts at a position."""
        action = position.getparent()
        if action is None:
            return None
        if action.tag == "AddEntityAction":
            about = action.getparent()
            return None if about is None else about.get("entityRef")
        group = next(position.iterancestors("ManeuverGroup"), None)
        if action.tag != "TeleportAction" or group is None:
            return None
        actors = [element.get("entityRef") for element in group.iterfind("Actors/EntityRef")]
        return actors[0] if len(actors) == 1 else None

    def _put_entity(self, name: str, place: Callable[[], MapPoint]) -> None:
        try:
            self.positions.starts[name] = place()
        except RefusedError as error:
            self.late.discard(name)
            self.report.mark(error.element, "refused", error.reason)
