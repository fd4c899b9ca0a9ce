"""Where stations, edges and turns of other programs are on a map, as count stations of odscen."""

from __future__ import annotations

import math
from collections import deque
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.app.demand.transit_feeds import projection
from odscen.base.errors import InputError
from odscen.base.shown import shown, some_of
from odscen.lanegraph.graphs import Relation
from odscen.opendrive.parse import parse
from odscen.scenario.demand.zones import PLACE_SEPARATOR, place_segments

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from odscen.app.maps import LoadedMap
    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.formats.office.traffic_file import StationPlace

NEAR = 40.0
"""Metres from a lane within which a station of these coordinates is on it."""
_SECTOR = math.radians(60.0)
"""How far a lane may point away from the bearing of its station."""
_MOST_STEPS = 20_000
"""Nodes that are looked at for the way from one edge into another."""


class MapPlace(NamedTuple):
    """A count station on the map: segments, and the node of the lane graph; ``note`` is a doubt."""

    place: str
    node: int
    edge: str = ""
    lane: str = ""
    note: str = ""


class StationFinder:
    """Finds stations on a map by coordinates, SUMO's ids, segments and names of roads."""

    def __init__(self, loaded: LoadedMap) -> None:
        self._loaded = loaded
        self._graph = loaded.sumo.graph
        self._lanes = self._graph.lanes
        self._rows = {str(name): row for row, name in enumerate(self._graph.segments.ids)}

    def locate(self, station: str, place: StationPlace | None) -> MapPlace:
        """Find a station.

        Raises
        ------
        InputError
            With the reason why it is nowhere on the map.
        """
        if place is not None and place.lane is not None:
            return self.of_lane(place.lane, place.pos)
        if place is not None and place.edge is not None:
            return self.of_edge(place.edge, place.pos)
        if place is not None and place.point is not None:
            return self._place_point(place.point, degrees=place.degrees, bearing=place.bearing)
        return self.of_name(station)

    def of_name(self, name: str) -> MapPlace:
        """Find a place by segments, an edge or lane of SUMO, or the name of a road."""
        bare = name.replace(" ", "")
        segments = place_segments(bare)
        if all(segment in self._rows for segment in segments):
            return MapPlace(bare, -1)
        if name in self._loaded.sumo.edge_nodes:
            return self.of_edge(name)
        if name in self._loaded.sumo.net.lanes:
            return self.of_lane(name)
        roads = self._roads_by_name.get(name.casefold(), ())
        if len(roads) == 1:
            node = self._middle_of_segment(roads[0])
            found = self._place_by_direction(node)
            return found._replace(note=f"found by the name of the road, in segment {roads[0]}")
        if roads:
            raise InputError(
                f"{len(roads)} segments have roads of this name: {some_of(roads, between=', ')}; "
                "say which one in a table of stations"
            )
        raise InputError(
            "no segment, SUMO edge or road of the map is called that; give a table of stations "
            "with station, lon and lat (or x and y, or edge)"
        )

    def of_edge(self, edge: str, pos: float | None = None) -> MapPlace:
        """Find a SUMO edge, at its end or at metres along it."""
        nodes = self._loaded.sumo.edge_nodes.get(edge)
        if nodes is None:
            known = edge in self._loaded.sumo.net.edge_lanes
            raise InputError(
                f"no lane of the map lies under edge {shown(edge)}"
                if known
                else f"the map's SUMO network has no edge {shown(edge)}"
            )
        return self._place_by_direction(self._node_at(nodes, pos))._replace(edge=edge)

    def of_lane(self, lane: str, pos: float | None = None) -> MapPlace:
        """Find a place on a SUMO lane."""
        known = self._loaded.sumo.net.lanes.get(lane)
        if known is None:
            raise InputError(f"the map's SUMO network has no lane {shown(lane)}")
        rows = np.flatnonzero(self._lanes_of_nodes == self._lane_rows[lane]).astype(np.int32)
        if not len(rows):
            return self.of_edge(known.edge, pos)._replace(lane=lane)
        if pos is not None and pos < 0:
            pos += known.length
        return self._place_by_direction(self._node_at(rows, pos))._replace(
            edge=known.edge, lane=lane
        )

    def lanes_of_edge(self, edge: str) -> int:
        """How many lanes for vehicles an edge has."""
        lanes = self._loaded.sumo.net.edge_lanes[edge]
        return sum(any(lane.allows(c) for c in ("passenger", "bus", "truck")) for lane in lanes)

    def turn(self, origin: str, destination: str) -> str:
        """Place of those who go from one SUMO edge into another.

        Raises
        ------
        InputError
            If an edge is not on the map, or no lane leads from one to the other.
        """
        start = self._loaded.sumo.edge_nodes.get(origin)
        end = self._loaded.sumo.edge_nodes.get(destination)
        for edge, nodes in ((origin, start), (destination, end)):
            if nodes is None:
                raise InputError(f"the map has nothing under SUMO edge {shown(edge)}")
        assert start is not None
        assert end is not None
        goal = set(end.tolist())
        before: dict[int, int] = dict.fromkeys(self._last_nodes(start), -1)
        queue = deque(before)
        while queue and len(before) < _MOST_STEPS:
            node = queue.popleft()
            if node in goal:
                return self._segments_of_path(node, before)
            for other in self._find_successors(node):
                if other not in before:
                    before[other] = node
                    queue.append(other)
        raise InputError(f"no lane leads from edge {shown(origin)} into {shown(destination)}")

    def segments_of_edges(self, edges: Sequence[str]) -> tuple[str, ...]:
        """Segments of the roads that SUMO edges lie on."""
        found: dict[str, None] = {}
        for edge in edges:
            nodes = self._loaded.sumo.edge_nodes.get(edge)
            for row in () if nodes is None else self._lanes.segment[nodes].tolist():
                found[str(self._graph.segments.ids[row])] = None
        return tuple(found)

    def is_segment(self, name: str) -> bool:
        """Whether the map has a segment of this id."""
        return name in self._rows

    def capacity_of(self, place: MapPlace) -> float:
        """Most vehicles an hour that can pass there: 2,400 on each lane of that direction."""
        if place.node < 0:
            return math.inf
        same = self._same_direction(place.node)
        keys = {int(lane) for lane in self._lanes.lane[same].tolist()}
        return 2400.0 * max(len(keys), 1)

    # ------------------------------------------------------------------ nodes

    @cached_property
    def _lane_rows(self) -> dict[str, int]:
        return {lane: row for row, lane in enumerate(self._loaded.sumo.lane_places.lanes)}

    @cached_property
    def _lanes_of_nodes(self) -> Int32Array:
        return self._loaded.sumo.lane_places.lane

    @cached_property
    def _roads_by_name(self) -> dict[str, tuple[str, ...]]:
        """Segments of roads by the roads' names, in small letters."""
        odr = parse(self._loaded.entry.read("xodr"))
        segments = self._graph.segments
        found: dict[str, dict[str, None]] = {}
        for segment, kind, parts in zip(segments.ids, segments.kinds, segments.parts, strict=True):
            for part in parts:
                name = odr.roads[part.road].name
                if name and kind == "road":
                    found.setdefault(name.casefold(), {})[str(segment)] = None
        return {name: tuple(ids) for name, ids in found.items()}

    def _middle_of_segment(self, segment: str) -> int:
        nodes = np.flatnonzero(self._lanes.segment == self._rows[segment])
        if not len(nodes):
            raise InputError(f"segment {segment} has no lane for vehicles")
        return int(nodes[len(nodes) // 2])

    def _node_at(self, nodes: Int32Array, pos: float | None) -> int:
        places = self._loaded.sumo.lane_places
        along = places.pos[nodes]
        if pos is None:
            return int(nodes[int(np.argmax(along))])
        wanted = pos if pos >= 0 else float(along.max()) + pos
        return int(nodes[int(np.argmin(np.abs(along - wanted)))])

    def _place_point(
        self, point: tuple[float, float], *, degrees: bool, bearing: float | None
    ) -> MapPlace:
        x, y = point
        if degrees:
            lon, lat = (np.array([value]) for value in point)
            east, north = self._project_station(lon, lat)
            x, y = float(east[0]), float(north[0])
        away = np.hypot(self._lanes.x - x, self._lanes.y - y)
        near = away <= NEAR
        if bearing is not None:
            wanted = math.pi / 2 - math.radians(bearing)
            turned = np.abs((self._lanes.hdg - wanted + math.pi) % (2 * math.pi) - math.pi)
            near &= turned <= _SECTOR
        # Inside a junction there are turns, and stations are on the roads that lead to it.
        roads = np.array([kind == "road" for kind in self._graph.segments.kinds])
        near &= roads[self._lanes.segment]
        if not near.any():
            closest = int(np.argmin(away)) if len(away) else -1
            distance = f"{away[closest]:.0f} m away" if closest >= 0 else "not there"
            there = "" if bearing is None else f" in direction {bearing:.0f} degrees"
            raise InputError(
                f"no road within {NEAR:g} m{there} of x {x:.1f} m, y {y:.1f} m; the nearest lane "
                f"is {distance}"
            )
        node = int(np.flatnonzero(near)[int(np.argmin(away[near]))])
        place = self._place_by_direction(node)
        if bearing is None and PLACE_SEPARATOR in place.place:
            place = place._replace(note="no direction given: that of the nearest lane was taken")
        return place

    @cached_property
    def _project_station(self) -> Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
        entry = self._loaded.entry
        return projection(parse(entry.read("xodr"), file=entry.path("xodr").name).header)

    @cached_property
    def _edges_ahead(self) -> tuple[Int32Array, Int32Array]:
        """Targets of successor edges, sorted by source, and where those of each node begin."""
        graph = self._lanes
        follows = graph.relation == Relation.SUCCESSOR
        source, target = graph.source[follows], graph.target[follows]
        order = np.argsort(source, kind="stable")
        starts = np.searchsorted(source[order], np.arange(len(graph.x) + 1))
        return target[order].astype(np.int32), starts.astype(np.int32)

    @cached_property
    def _edges_behind(self) -> tuple[Int32Array, Int32Array]:
        graph = self._lanes
        follows = graph.relation == Relation.SUCCESSOR
        source, target = graph.source[follows], graph.target[follows]
        order = np.argsort(target, kind="stable")
        starts = np.searchsorted(target[order], np.arange(len(graph.x) + 1))
        return source[order].astype(np.int32), starts.astype(np.int32)

    def _find_successors(self, node: int) -> list[int]:
        targets, starts = self._edges_ahead
        return [int(other) for other in targets[starts[node] : starts[node + 1]]]

    def _last_nodes(self, nodes: Int32Array) -> list[int]:
        """Nodes of an edge behind which another edge comes."""
        own = set(nodes.tolist())
        ends = [n for n in sorted(own) if any(m not in own for m in self._find_successors(n))]
        return ends or sorted(own)

    def _segments_of_path(self, node: int, before: dict[int, int]) -> str:
        names: list[str] = []
        while node >= 0:
            name = str(self._graph.segments.ids[int(self._lanes.segment[node])])
            if not names or names[-1] != name:
                names.append(name)
            node = before[node]
        return PLACE_SEPARATOR.join(reversed(names))

    def _same_direction(self, node: int) -> Int32Array:
        """Nodes of the segment of a node whose lanes point where its lane does."""
        lanes = self._lanes
        own = np.flatnonzero(lanes.segment == lanes.segment[node])
        x, y = float(lanes.x[node]), float(lanes.y[node])
        near = own[np.hypot(lanes.x[own] - x, lanes.y[own] - y) <= NEAR]
        turned = np.abs((lanes.hdg[near] - lanes.hdg[node] + math.pi) % (2 * math.pi) - math.pi)
        same: Int32Array = near[turned <= math.pi / 2].astype(np.int32)
        return same

    def _place_by_direction(self, node: int) -> MapPlace:
        """Place of those who pass a node in the direction of its lane.

        The segment alone where all of its lanes lead one way; with the one behind or before it
        where it has both directions.
        """
        lanes = self._lanes
        segment = int(lanes.segment[node])
        name = str(self._graph.segments.ids[segment])
        own = np.flatnonzero(lanes.segment == segment)
        rows = np.unique(lanes.lane[own])
        forward = {bool(lanes.lanes.forward[row]) for row in rows.tolist()}
        if len(forward) == 1:
            return MapPlace(name, node)
        for table, behind in ((self._edges_ahead, True), (self._edges_behind, False)):
            others = self._find_neighbours(node, table)
            if len(others) == 1:
                pair = (name, others[0]) if behind else (others[0], name)
                return MapPlace(PLACE_SEPARATOR.join(pair), node)
        return MapPlace(name, node, note="both directions of the segment are counted there")

    def _find_neighbours(self, node: int, table: tuple[Int32Array, Int32Array]) -> list[str]:
        """Segments that come behind, or before, those lanes of a segment that a node is on."""
        lanes = self._lanes
        row = int(lanes.lane[node])
        ahead = bool(lanes.lanes.forward[row])
        segment = int(lanes.segment[node])
        found: set[str] = set()
        own = np.flatnonzero(lanes.segment == segment)
        alike = own[lanes.lanes.forward[lanes.lane[own]] == ahead]
        others, starts = table
        for start in alike.tolist():
            for other in others[starts[start] : starts[start + 1]].tolist():
                if int(lanes.segment[other]) != segment:
                    found.add(str(self._graph.segments.ids[int(lanes.segment[other])]))
        return sorted(found)
