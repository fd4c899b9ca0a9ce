"""Positions of a file as points on the ground, and as nodes of the lane graph."""

from __future__ import annotations

import math
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, cast

import numpy as np

from odscen.base.errors import OdscenError
from odscen.formats.openscenario_import.import_report import RefusedError
from odscen.formats.openscenario_import.places.map_points import MapPoint
from odscen.formats.openscenario_import.traced_numbers import TracedNumber
from odscen.lanegraph.graphs import Relation
from odscen.lanegraph.query import is_walk_node_id, node_id, node_index, walk_node_index

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from lxml.etree import _Element

    from odscen.base.arrays import Int32Array, IntArray
    from odscen.formats.openscenario_import.import_report import ImportReport
    from odscen.formats.openscenario_import.places.map_points import MovingFrame
    from odscen.lanegraph.graphs import MapGraph

_EXACT = 1e-5
"""Metres and radians that the rounding of a file makes."""


_IN_ROUTE: Final = ("FromLaneCoordinates", "FromRoadCoordinates", "FromCurrentEntity")
_STRAIGHT: Final = 1e-4
"""Radians between the headings of a lane that counts as straight."""


@dataclass(frozen=True, slots=True)
class PositionReader:
    """Reads positions.

    Attributes
    ----------
    road_point
        x, y and heading of a point with growing s at s and t of a road; ``None`` if there is none.
    lane_t
        t of the middle of a lane of any type at s; ``None`` if there is none.
    side
        1 where y and what lies left are positive, -1 in the left-handed frame of CARLA.
    starts
        Where the reference points of entities are at first, as far as read.
    varied
        Whether points on straight lanes stay formulas of parameters, for a sweep.
    moving
        Names of entities that are not where they start once the story runs.
    on_trajectory
        Point of a ``TrajectoryPosition``.
    """

    report: ImportReport
    graph: MapGraph
    road_point: Callable[[str, float, float], tuple[float, float, float] | None]
    lane_t: Callable[[str, int, float], float | None]
    side: float = 1.0
    starts: dict[str, MapPoint] = field(default_factory=dict)
    varied: bool = False
    moving: set[str] = field(default_factory=set)
    on_trajectory: Callable[[PositionReader, _Element], MapPoint] | None = None
    _modes: dict[str, bool] = field(default_factory=dict)
    _frames: list[MovingFrame] = field(default_factory=list)

    @contextmanager
    def exactly(self, frame: MovingFrame | None = None) -> Iterator[None]:
        """Refuse places relative to entities that have moved by then, or have them of a frame."""
        self._modes["exact"] = True
        if frame is not None and self._modes.get("story"):
            self._frames.append(frame)
        try:
            yield
        finally:
            self._modes["exact"] = False
            self._frames.clear()

    def itself(self, element: _Element) -> MapPoint:
        """Where the entity is that begins a trajectory which does not say so.

        Raises
        ------
        RefusedError
            If that is not asked in the story.
        """
        if not self._frames:
            raise RefusedError(element, "a first segment without PositionStart")
        return self._frames[-1].itself()

    def begin_story(self) -> None:
        """From now on entities that move are no longer where they start."""
        self._modes["story"] = True

    def point(self, position: _Element) -> MapPoint:
        """Point of a ``Position`` or what stands for one.

        Raises
        ------
        RefusedError
            If it cannot be found on the map.
        """
        kind = self.report.only(position)
        read = {
            "WorldPosition": self._read_world_position,
            "LanePosition": self._read_lane_position,
            "RoadPosition": self._read_road_position,
            "RelativeLanePosition": self._relative_lane,
            "RelativeRoadPosition": self._relative_road,
            "RelativeWorldPosition": self._relative_world,
            "RelativeObjectPosition": self._relative_object,
            "RoutePosition": self._read_route_position,
            "TrajectoryPosition": self._read_trajectory_position,
        }.get(str(kind.tag))
        if read is None:
            raise RefusedError(kind, f"a place given as {kind.tag}")
        frame = self._frames[-1] if self._frames else None
        if frame is not None:
            if kind.get("entityRef") in self.moving:
                found = frame.point(kind)
                return self._turn_to_orientation(found, kind)
            frame.fixed = True
        found = read(kind)
        self.report.positions[position] = (round(float(found.x), 2), round(float(found.y), 2))
        return self._turn_to_orientation(found, kind)

    def _turn_to_orientation(self, found: MapPoint, kind: _Element) -> MapPoint:
        turn = self.report.child(kind, "Orientation")
        if turn is None:
            return found
        angle = float(self.side * self.report.number(turn, "h", 0.0))
        absolute = turn.get("type", "absolute") == "absolute"
        return found._replace(hdg=angle if absolute else found.hdg + angle)

    def node_near(self, point: MapPoint) -> int:
        """Lane node nearest to a point, of lanes that lead about its way if there are such."""
        lanes = self.graph.lanes
        away = np.hypot(lanes.x - point.x, lanes.y - point.y)
        against = np.cos(lanes.hdg - point.hdg) < 0.0
        return int(np.argmin(away + 4.0 * against))

    def of_node(self, name: str) -> MapPoint | None:
        """Point of a node of the lanes or of the pedestrian graph by its name, if there is one."""
        walks = is_walk_node_id(name)
        try:
            index = walk_node_index(self.graph, name) if walks else node_index(self.graph, name)
        except OdscenError:
            return None
        these = self.graph.walks if walks else self.graph.lanes
        node = None if walks else index
        x, y, hdg = (float(column[index]) for column in (these.x, these.y, these.hdg))
        return MapPoint(x, y, hdg, node)

    def name_at(self, point: MapPoint) -> str | None:
        """Name of the lane node at exactly a point with its heading, if there is one."""
        node = self.node_near(point)
        lanes = self.graph.lanes
        here = MapPoint(float(lanes.x[node]), float(lanes.y[node]), float(lanes.hdg[node]))
        same = here.away(point) < _EXACT and abs(here.hdg - point.hdg) < _EXACT
        return str(node_id(self.graph, node)) if same else None

    def beside_lane(self, point: MapPoint) -> float:
        """Metres that a point is to the left of the lane nearest to it."""
        return self.left_of(self.node_near(point), point)

    def left_of(self, node: int, point: MapPoint) -> float:
        """Metres that a point is to the left of the lane of a node."""
        lanes = self.graph.lanes
        dx, dy = point.x - float(lanes.x[node]), point.y - float(lanes.y[node])
        hdg = float(lanes.hdg[node])
        return dy * math.cos(hdg) - dx * math.sin(hdg)

    def along(self, node: int, metres: float) -> int:
        """Node so many metres on along the lanes, straight on at forks; back if negative."""
        return self._node_and_rest(node, metres)[0]

    def point_along(self, node: int, metres: float, left: float = 0.0) -> MapPoint:
        """Point so many metres on along the lanes as of :meth:`along`, and to the left of them."""
        there, rest = self._node_and_rest(node, metres)
        lanes = self.graph.lanes
        at = MapPoint(float(lanes.x[there]), float(lanes.y[there]), float(lanes.hdg[there]), there)
        return at.moved(rest, left)

    def ahead_of(self, node: int, point: MapPoint) -> float:
        """Metres that a point is ahead of a node along its lane."""
        lanes = self.graph.lanes
        dx, dy = point.x - float(lanes.x[node]), point.y - float(lanes.y[node])
        hdg = float(lanes.hdg[node])
        return dx * math.cos(hdg) + dy * math.sin(hdg)

    def straight_on(self, node: int, metres: float) -> tuple[int, list[int]]:
        """Node as of :meth:`along`, and a node on each lane that is taken at a fork."""
        forks: list[int] = []
        return self._node_and_rest(node, metres, forks)[0], forks

    def nodes_on(self, node: int, metres: float) -> list[int]:
        """Nodes that are passed by :meth:`along`, from the first one on."""
        passed: list[int] = [node]
        self._node_and_rest(node, metres, passed=passed)
        return passed

    def _node_and_rest(
        self,
        node: int,
        metres: float,
        forks: list[int] | None = None,
        passed: list[int] | None = None,
    ) -> tuple[int, float]:
        """Node nearest to so many metres on along the lanes, and the metres from there."""
        lanes = self.graph.lanes
        ends = (lanes.source, lanes.target) if metres >= 0 else (lanes.target, lanes.source)
        left, seen = abs(metres), {node}
        while left > 0:
            edges = np.flatnonzero((ends[0] == node) & (lanes.relation == Relation.SUCCESSOR))
            if edges.size == 0:
                break
            edge = self._find_straightest(node, edges, ends[1])
            following = int(ends[1][edge])
            if following in seen or left < 0.5 * float(lanes.length[edge]):
                break
            left -= float(lanes.length[edge])
            node = following
            seen.add(node)
            if passed is not None:
                passed.append(node)
            if forks is not None and edges.size > 1:
                forks.append(node)
        return node, left if metres >= 0 else -left

    def _find_straightest(self, node: int, edges: IntArray, others: Int32Array) -> int:
        """Edge of several whose lane, such as one in a junction, turns least from its begin on."""
        lanes = self.graph.lanes
        if edges.size == 1:
            return int(edges[0])
        first = lanes.lanes.first_node
        rows = lanes.lane[others[edges]]
        ends = np.stack([first[rows], first[rows + 1] - 1])
        near = np.hypot(lanes.x[ends] - lanes.x[node], lanes.y[ends] - lanes.y[node])
        far = ends[np.argmax(near, axis=0), np.arange(edges.size)]
        return int(edges[int(np.argmax(np.cos(lanes.hdg[far] - lanes.hdg[node])))])

    def beside(self, node: int, by: int) -> int | None:
        """Node abreast whose lane id differs by so many, 0 left out; ``None`` if there is none."""
        lanes = self.graph.lanes
        key = lanes.lanes.keys[int(lanes.lane[node])]
        wanted = key.lane + by
        if (key.lane < 0) != (wanted < 0) or wanted == 0:
            wanted += 1 if by > 0 else -1
        return self._find_node(key.road, wanted, float(lanes.s[node]), section=key.section)

    def of_entity(self, element: _Element) -> MapPoint:
        """Where the entity is that an element names.

        Raises
        ------
        RefusedError
            If it has no place yet.
        """
        name = self.report.word(element, "entityRef")
        if name not in self.starts:
            raise RefusedError(element, f"a place relative to {name!r}, which has none yet")
        if self._modes.get("story") and name in self.moving:
            if self._modes.get("exact"):
                raise RefusedError(
                    element,
                    f"a place relative to {name!r}, which moves: it is known in the run only",
                )
            words = f"counted from where {name!r} starts, not from where it is by then"
            self.report.mark(element, "approximated", words)
        return self.starts[name]

    def _find_node(
        self, road: str, lane: int, s: float, *, section: int | None = None
    ) -> int | None:
        lanes = self.graph.lanes
        first = lanes.lanes.first_node
        found: list[int] = []
        for row, key in enumerate(lanes.lanes.keys):
            if key.road == road and key.lane == lane and section in (None, key.section):
                found += range(int(first[row]), int(first[row + 1]))
        if not found:
            return None
        return int(found[int(np.argmin(np.abs(lanes.s[found] - s)))])

    def _point_at_node(self, node: int, s: float | None = None, offset: float = 0.0) -> MapPoint:
        lanes = self.graph.lanes
        forward = bool(lanes.lanes.forward[int(lanes.lane[node])])
        ahead = 0.0 if s is None else self._traced_metres(node, s) - float(lanes.s[node])
        offset = self._traced_metres(node, offset)
        point = MapPoint(float(lanes.x[node]), float(lanes.y[node]), float(lanes.hdg[node]), node)
        return point.moved(ahead, offset) if forward else point.moved(-ahead, -offset)

    def _traced_metres(self, node: int, metres: float) -> float:
        """Metres along or across the lane of a node: a formula only if the lane is straight."""
        lanes = self.graph.lanes
        row = int(lanes.lane[node])
        nodes = slice(int(lanes.lanes.first_node[row]), int(lanes.lanes.first_node[row + 1]))
        straight = bool(np.ptp(np.unwrap(lanes.hdg[nodes])) < _STRAIGHT)
        return metres if self.varied and straight else float(metres)

    def _read_world_position(self, kind: _Element) -> MapPoint:
        x, y = self.report.number(kind, "x"), self.side * self.report.number(kind, "y")
        if kind.get("h") is not None:
            return MapPoint(x, y, self.side * self.report.number(kind, "h"))
        lanes = self.graph.lanes
        near = int(np.argmin(np.hypot(lanes.x - x, lanes.y - y)))
        return MapPoint(x, y, float(lanes.hdg[near]))

    def _read_lane_position(self, kind: _Element) -> MapPoint:
        road, s = self.report.word(kind, "roadId"), self.report.number(kind, "s")
        lane = self.report.number(kind, "laneId")
        offset = self.side * self.report.number(kind, "offset", 0.0)
        node = self._find_node(road, int(lane), s)
        walk = self._place_on_walk(road, int(lane), s) if node is None else None
        if walk is not None:
            return walk.moved(0.0, offset if lane < 0 else -offset)
        if node is None:
            return self._place_on_any_lane(kind, road, int(lane), s, offset)
        return self._point_at_node(node, s, offset)

    def _place_on_any_lane(
        self, kind: _Element, road: str, lane: int, s: float, offset: float
    ) -> MapPoint:
        """Middle of a lane that is neither to drive nor to walk on, such as a shoulder."""
        t = self.lane_t(road, lane, float(s))
        found = None if t is None else self.road_point(road, float(s), t + float(offset))
        if found is None:
            raise RefusedError(kind, f"road {road!r} has no lane {lane}")
        point = MapPoint(*found)
        return point if lane <= 0 else point._replace(hdg=point.hdg + math.pi)

    def _place_on_walk(self, road: str, lane: int, s: float) -> MapPoint | None:
        """Centre of a lane for walking; right lanes lead with growing s, left ones against it."""
        walks = self.graph.walks
        rows = [
            row
            for row, key in enumerate(walks.lane_keys)
            if key.road == road and key.lane == lane and not walks.roadside[row]
        ]
        nodes = np.flatnonzero(np.isin(walks.lane, rows))
        if nodes.size == 0:
            return None
        node = int(nodes[int(np.argmin(np.abs(walks.s[nodes] - s)))])
        hdg = float(walks.hdg[node])
        at = MapPoint(float(walks.x[node]), float(walks.y[node]), hdg)
        at = at.moved(s - float(walks.s[node]))
        return at if lane < 0 else at._replace(hdg=hdg + math.pi)

    def _place_on_road(self, kind: _Element, road: str, s: float, t: float) -> MapPoint:
        found = self.road_point(road, s, t)
        if found is None:
            raise RefusedError(kind, f"the map has no road {road!r}")
        point = MapPoint(*found)
        return point if t <= 0 else point._replace(hdg=point.hdg + math.pi)

    def _read_road_position(self, kind: _Element) -> MapPoint:
        s, t = self.report.number(kind, "s"), self.report.number(kind, "t", 0.0)
        return self._place_on_road(kind, self.report.word(kind, "roadId"), s, t)

    def _base_node(self, kind: _Element) -> int:
        base = self.of_entity(kind)
        return self.node_near(base) if base.node is None else base.node

    def _relative_lane(self, kind: _Element) -> MapPoint:
        node, by = self._base_node(kind), int(self.report.number(kind, "dLane"))
        metres = self.report.number(kind, "dsLane", self.report.number(kind, "ds", 0.0))
        beside = node if by == 0 else self.beside(node, by)
        if beside is None:
            raise RefusedError(kind, f"there is no driving lane {by:+d} beside the entity")
        lanes = self.graph.lanes
        forward = bool(lanes.lanes.forward[int(lanes.lane[beside])])
        offset = self.report.number(kind, "offset", 0.0)
        ahead = self.ahead_of(node, self.of_entity(kind)) + (metres if forward else -metres)
        left = offset if forward else -offset
        if not isinstance(self._traced_metres(beside, metres), TracedNumber):
            return self.point_along(beside, float(ahead), float(left))
        here = self._point_at_node(beside, None, offset)
        return here.moved(ahead)._replace(node=self.along(beside, float(ahead)))

    def _relative_road(self, kind: _Element) -> MapPoint:
        node, base = self._base_node(kind), self.of_entity(kind)
        lanes = self.graph.lanes
        metres, left = (self.report.number(kind, name, 0.0) for name in ("ds", "dt"))
        side = 1.0 if bool(lanes.lanes.forward[int(lanes.lane[node])]) else -1.0
        ahead, off = self.ahead_of(node, base), self.left_of(node, base)
        return self.point_along(node, ahead + side * metres, off + side * left)._replace(node=None)

    def _relative_world(self, kind: _Element) -> MapPoint:
        base = self.of_entity(kind)
        dx, dy = (self.report.number(kind, name, 0.0) for name in ("dx", "dy"))
        return MapPoint(base.x + dx, base.y + self.side * dy, base.hdg)

    def _relative_object(self, kind: _Element) -> MapPoint:
        dx, dy = (self.report.number(kind, name, 0.0) for name in ("dx", "dy"))
        return self.of_entity(kind)._replace(node=None).moved(dx, self.side * dy)

    def _read_trajectory_position(self, kind: _Element) -> MapPoint:
        if self.on_trajectory is None:
            raise RefusedError(kind, "a place on a trajectory")
        return self.on_trajectory(self, kind)

    def _read_route_position(self, kind: _Element) -> MapPoint:
        inside = next(kind.iter(*_IN_ROUTE), None)
        places = kind.findall(".//Waypoint/Position")
        if inside is not None and inside.tag == "FromCurrentEntity":
            self.report.mark(inside, "approximated", "where that entity starts")
            return self.of_entity(inside)
        if inside is None or not places:
            raise RefusedError(kind, "a place on a route without the route, or without a place")
        for element in kind.iter("*"):
            self.report.mark(element, "approximated", "taken along the lane of the first waypoint")
        base = self.point(places[0])
        node = self.node_near(base) if base.node is None else base.node
        metres = self.ahead_of(node, base) + self.report.number(inside, "pathS")
        there = self.point_along(node, metres)
        if there.node is None:
            raise AssertionError(there)
        lanes = self.graph.lanes
        key = lanes.lanes.keys[int(lanes.lane[there.node])]
        if inside.tag == "FromLaneCoordinates":
            return self._place_in_lane(inside, there)
        t = self.side * self.report.number(inside, "t", 0.0)
        ahead = self.ahead_of(there.node, there)
        forward = bool(lanes.lanes.forward[int(lanes.lane[there.node])])
        s = float(lanes.s[there.node]) + (ahead if forward else -ahead)
        found = self._place_on_road(kind, key.road, s, t)
        against = math.cos(found.hdg - there.hdg) < 0.0  # who follows the route looks along it
        return found._replace(hdg=found.hdg + math.pi) if against else found

    def _place_in_lane(self, inside: _Element, at: MapPoint) -> MapPoint:
        """Where a point lies on the lane of a road whose id an element gives, and its offset."""
        node, lanes = at.node or 0, self.graph.lanes
        key = lanes.lanes.keys[int(lanes.lane[node])]
        lane = int(self.report.number(inside, "laneId", key.lane))
        other = self._find_node(key.road, lane, float(lanes.s[node]), section=key.section)
        if other is None:
            raise RefusedError(inside, f"road {key.road!r} has no driving lane {lane}")
        offset = self.side * self.report.number(inside, "laneOffset", 0.0)
        forward = bool(lanes.lanes.forward[int(lanes.lane[other])])
        same = math.cos(float(lanes.hdg[other]) - at.hdg) > 0.0
        here = self._point_at_node(other, None, offset)
        return here.moved(self.ahead_of(node, at) * (1.0 if same else -1.0)) if forward else here


@dataclass(frozen=True, slots=True, init=False)
class NoMapPositions(PositionReader):
    """Reads positions of a file without a map: each is refused.

    Who has no place asks for no lanes, so that there are none.
    """

    why: str = ""

    def __init__(self, report: ImportReport, *, side: float, why: str) -> None:
        graph = cast("MapGraph", None)
        PositionReader.__init__(self, report, graph, lambda *_: None, lambda *_: None, side)
        object.__setattr__(self, "why", why)

    def point(self, position: _Element) -> MapPoint:
        """Refuse a position.

        Raises
        ------
        RefusedError
            Always.
        """
        raise RefusedError(self.report.only(position), self.why)
