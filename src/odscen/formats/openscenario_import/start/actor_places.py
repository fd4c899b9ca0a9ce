"""Where actors start: nodes of the lane graph, and how far beside them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from odscen.base.categories import DEFAULT_BODY, Category
from odscen.formats.openscenario_import.import_report import RefusedError
from odscen.formats.openscenario_import.places.map_points import MapPoint
from odscen.formats.openscenario_import.story.read_motions import put_there
from odscen.formats.openscenario_import.traced_numbers import TracedNumber
from odscen.lanegraph.query import node_id, walk_node_id
from odscen.lanegraph.shortest_paths import Router

if TYPE_CHECKING:
    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.places.read_positions import PositionReader
    from odscen.formats.openscenario_import.world.read_entities import ReadEntity

_BESIDE: Final = 10.0
"""Metres that an actor can be beside its lane."""
_FAR: Final = 100_000.0
"""Metres after which a way straight on counts as long enough."""


Made = dict[str, Any]
_ALONG: Final = math.cos(math.radians(5.0))
"""Of the angle to its lane at which a vehicle starts along it."""


class ActorPlaces:
    """Finds them, and marks entities that start elsewhere than the file says."""

    def __init__(self, report: ImportReport, positions: PositionReader) -> None:
        self._report = report
        self._positions = positions
        self._bodies: list[tuple[MapPoint, Category]] = []

    def leave_room(self, entity: ReadEntity, made: dict[str, Any], taken: set[str]) -> None:
        """Let an actor start behind one whose node or ground it would have."""
        graph, steps = self._positions.graph, 0
        there = self._positions.of_node(made["spawn"])
        if entity.category is Category.PEDESTRIAN or there is None:
            return
        left, node = float(made.get("lateral_offset", 0.0)), there.node
        while node is not None and (
            str(node_id(graph, node)) in taken or self._overlaps_earlier(entity, node, left)
        ):
            steps += 1
            back = self._positions.along(node, -math.ceil(entity.length + 1.0))
            node = None if back == node else back
        if node is None:
            return
        self._bodies.append((self._centre_at(node, left), entity.category))
        if steps == 0:
            return
        made["spawn"] = str(node_id(graph, node))
        metres = steps * math.ceil(entity.length + 1.0)
        words = f"about {metres} m behind, as another one starts there"
        self._report.mark(entity.element, "approximated", words)

    def _centre_at(self, node: int, left: float) -> MapPoint:
        lanes = self._positions.graph.lanes
        at = MapPoint(float(lanes.x[node]), float(lanes.y[node]), float(lanes.hdg[node]))
        return at.moved(0.0, left)

    def _overlaps_earlier(self, entity: ReadEntity, node: int, left: float) -> bool:
        """Whether the body of an actor at a node would have ground of one that starts before."""
        own, size = self._centre_at(node, left), DEFAULT_BODY[entity.category]
        for other, category in self._bodies:
            body = DEFAULT_BODY[category]
            dx, dy = own.x - other.x, own.y - other.y
            along = abs(dx * math.cos(other.hdg) + dy * math.sin(other.hdg))
            across = abs(dy * math.cos(other.hdg) - dx * math.sin(other.hdg))
            if along < (size.length + body.length) / 2 and across < (size.width + body.width) / 2:
                return True
        return False

    def reached(self, entity: ReadEntity, made: Made, goal: str) -> str:
        """The goal of the file, or that straight on if it cannot be reached from where it starts.

        A vehicle that stands across its lane starts along it.
        """
        spawn, there = (self._positions.of_node(node) for node in (made["spawn"], goal))
        if spawn is None or there is None or spawn.node is None or there.node is None:
            return goal
        if bool(Router(self._positions.graph).reachable(spawn.node)[there.node]):
            return goal
        words = "straight on: the goal of the file cannot be reached from its lane"
        self._report.mark(entity.element, "approximated", words)
        return str(made["goal"])

    def walker(self, centre: MapPoint) -> dict[str, Any]:
        """Node of the pedestrian graph nearest to a point."""
        walks = self._positions.graph.walks
        node = int(((walks.x - centre.x) ** 2 + (walks.y - centre.y) ** 2).argmin())
        return {"spawn": str(walk_node_id(self._positions.graph, node))}

    def aside(self, entity: ReadEntity, centre: MapPoint) -> float:
        """Metres to the left of the nearest lane that leads its way, 0 on a lane.

        Raises
        ------
        RefusedError
            If it is farther from all lanes than an actor can be beside its own.
        """
        positions, lanes = self._positions, self._positions.graph.lanes
        left = float(positions.beside_lane(centre))
        if abs(left) <= float(lanes.width[positions.node_near(centre)]) / 2:
            return 0.0
        if entity.obstacle or abs(left) > _BESIDE:
            raise RefusedError(entity.element, f"it starts {abs(left):.1f} m beside any lane")
        words = f"on the lane {abs(left):.1f} m beside at first, and there 0.1 s later"
        self._report.mark(entity.element, "approximated", words)
        return left

    def at_first(self, centre: MapPoint, left: float, then: list[Made], made: Made) -> list[Made]:
        """What a vehicle does from the start on, with what puts it where the file has it.

        SUMO turns vehicles along their lanes, and puts them on one; ``left`` is how far from that
        the vehicle is, metres.
        """
        lanes = self._positions.graph.lanes
        hdg, speed = float(lanes.hdg[self._positions.node_near(centre)]), made["initial_speed"]
        then = sorted(then, key=lambda action: "path" in action)  # as fast as the speed is by then
        across = bool(left) or math.cos(centre.hdg - hdg) < _ALONG
        if "path" in then[-1] and across:
            made["lateral_offset"] = 0.0
            then = [put_there(centre, speed), *then]
        elif left:
            made["lateral_offset"] = 0.0
            then = [{"offset": {"to": round(left, 3), "over": 0.1}}, *then]
        if isinstance(centre.x, TracedNumber) or isinstance(centre.y, TracedNumber):
            then = [{"appear": {"at": [centre.x, centre.y, hdg], "speed": speed}}, *then]
        return then

    def vehicle(self, entity: ReadEntity, centre: MapPoint) -> dict[str, Any]:
        """Node nearest to the centre of the body, and the offset from it to the left."""
        graph, lanes = self._positions.graph, self._positions.graph.lanes
        node = self._positions.node_near(centre)
        dx, dy = centre.x - float(lanes.x[node]), centre.y - float(lanes.y[node])
        hdg = float(lanes.hdg[node])
        along = dx * math.cos(hdg) + dy * math.sin(hdg)
        left = dy * math.cos(hdg) - dx * math.sin(hdg)
        report = self._report
        if abs(along) > 0.01 and not isinstance(along, TracedNumber):
            words = f"it starts {abs(along):.2f} m along its lane from there, on a node"
            report.mark(entity.element, "approximated", words)
        goal = self._positions.along(node, _FAR)
        return {
            "spawn": str(node_id(graph, node)),
            "goal": str(node_id(graph, goal)),
            "lateral_offset": round(left, 3),
        }
