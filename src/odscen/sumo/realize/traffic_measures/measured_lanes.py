"""SUMO lanes of the places that measures name, and which of them a closure closes."""

from __future__ import annotations

from collections import defaultdict
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.errors import ScenarioError
from odscen.scenario.checks.measure_checks import PlaceNames, UnknownPlace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from odscen.base.arrays import BoolArray
    from odscen.scenario.checks.measure_checks import MeasurePlace
    from odscen.sumo.realize.road_net import Link, RoadNetLane
    from odscen.sumo.realize.sumo_map import SumoMap

MOTOR = "passenger"
"""Lanes that this class may use are those of a road; SUMO's walks are closed to it."""


class MeasuredLanes:
    """Finds SUMO lanes on one map."""

    def __init__(self, sumo_map: SumoMap) -> None:
        self.net = sumo_map.net
        self.places = PlaceNames(sumo_map.graph)
        self._map = sumo_map

    def find(self, name: str) -> MeasurePlace:
        """Nodes of a place.

        Raises
        ------
        ScenarioError
            If the map has no such place.
        """
        place = self.places.find(name)
        if isinstance(place, UnknownPlace):
            raise ScenarioError(place.message, element=name)
        return place

    def lanes(self, name: str) -> tuple[str, ...]:
        """SUMO lanes of a segment or lane, or those inside the junction of a turn; sorted."""
        return self._lanes_of_nodes(self.find(name).nodes)

    def closed_by(self, names: Iterable[str]) -> tuple[str, ...]:
        """SUMO lanes that have to be closed so that no vehicle enters these places; sorted.

        Where a whole carriageway is meant, those that lead onto it inside junctions: who is on it
        drives out. Where other lanes of it stay open, the lanes themselves: drivers leave them.
        """
        closed: set[str] = set()
        inside: set[str] = set()
        for name in names:
            place = self.find(name)
            if place.turn:
                closed |= self._lanes_of_turn(place)
            else:
                inside.update(self._lanes_of_nodes(place.nodes))
        whole = self._whole_edges(inside)
        closed |= {
            name
            for name in inside
            if self.net.lanes[name].edge not in whole and not self.net.lanes[name].internal
        }
        closed |= self._entry_lanes(inside, whole)
        return tuple(sorted(closed))

    def predecessors(self, lanes: Iterable[str]) -> tuple[str, ...]:
        """Normal edges from which one gets onto these lanes, and their own; sorted."""
        wanted = set(lanes)
        own = {self.net.lanes[name].edge for name in wanted if not self.net.lanes[name].internal}
        before = {
            self.net.lanes[link.source].edge
            for link in self._normal_links
            if link.via in wanted or self.net.lanes[link.target].edge in own
        }
        return tuple(sorted(own | before))

    def broken_links(self, closed: frozenset[str], vclass: str) -> tuple[tuple[str, str], ...]:
        """Pairs of edges between which a class finds no lane any more; sorted."""
        if not closed:
            return ()
        touched: set[tuple[str, str]] = set()
        still: set[tuple[str, str]] = set()
        for link in self._normal_links:
            lanes = [self.net.lanes[name] for name in (link.source, link.via, link.target) if name]
            if not all(lane.allows(vclass) for lane in lanes):
                continue
            pair = lanes[0].edge, lanes[-1].edge
            shut = any(lane.id in closed for lane in lanes)
            (touched if shut else still).add(pair)
        return tuple(sorted(touched - still))

    def line(self, nodes: BoolArray) -> tuple[tuple[float, ...], ...]:
        """Centre lines of the lanes of these nodes, x and y in turn; a node every 10 m or so."""
        lanes = self._map.graph.lanes
        stride = max(1, round(10.0 / lanes.spacing))
        lines = []
        rows = np.flatnonzero(nodes)
        cuts = np.flatnonzero((np.diff(lanes.lane[rows]) != 0) | (np.diff(rows) != 1)) + 1
        for part in np.split(rows, cuts):
            if len(part):
                kept = np.unique(np.append(part[::stride], part[-1]))
                xy = np.stack([lanes.x[kept], lanes.y[kept]], axis=1).round(2)
                lines.append(tuple(xy.ravel().tolist()))
        return tuple(lines)

    def _lanes_of_nodes(self, nodes: BoolArray) -> tuple[str, ...]:
        """SUMO lanes of which more than half of the nodes are among these."""
        rows = self._map.lane_places.lane
        count = len(self._map.lane_places.lanes)
        every = np.bincount(rows[rows >= 0], minlength=count)
        own = np.bincount(rows[nodes & (rows >= 0)], minlength=count)
        found = np.flatnonzero((own > 0) & (2 * own > every)).tolist()
        return tuple(sorted(self._map.lane_places.lanes[row] for row in found))

    def _lanes_of_turn(self, place: MeasurePlace) -> set[str]:
        source, target = (
            set(self._lanes_of_nodes(place.source)),
            set(self._lanes_of_nodes(place.target)),
        )
        inside = set(self._lanes_of_nodes(place.nodes))
        has_nodes = self._with_nodes
        return {
            link.via or link.target
            for link in self._normal_links
            if link.source in source and link.target in target
            if link.via is None or link.via in inside or link.via not in has_nodes
        }

    def _whole_edges(self, inside: set[str]) -> set[str]:
        """Edges all of whose lanes for motor traffic are among these."""
        edges = {self.net.lanes[name].edge for name in inside}
        return {
            edge
            for edge in edges
            if all(
                edge_lane.id in inside
                for edge_lane in self.net.edge_lanes[edge]
                if edge_lane.allows(MOTOR)
            )
        }

    def _entry_lanes(self, inside: set[str], whole: set[str]) -> set[str]:
        """Lanes inside junctions that lead from elsewhere onto whole edges, or are meant."""
        entries = set()
        for link in self._normal_links:
            source, target = self.net.lanes[link.source], self.net.lanes[link.target]
            entering = target.edge in whole and source.edge not in whole
            if link.via is not None and (entering or link.via in inside):
                entries.add(link.via)
        return entries

    @cached_property
    def _normal_links(self) -> tuple[Link, ...]:
        """Links from normal lanes to normal lanes."""
        return tuple(
            link
            for link in self.net.links
            if not self._road_lane(link.source).internal
            and not self._road_lane(link.target).internal
        )

    @cached_property
    def _with_nodes(self) -> frozenset[str]:
        """SUMO lanes on which some node lies."""
        rows = self._map.lane_places.lane
        return frozenset(
            self._map.lane_places.lanes[int(row)] for row in np.unique(rows[rows >= 0])
        )

    def _road_lane(self, name: str) -> RoadNetLane:
        return self.net.lanes[name]


def periods(spans: Iterable[tuple[float, float]], until: float) -> Iterator[tuple[float, float]]:
    """Cut a run at every begin and end of these spans: begin and end of each period, seconds."""
    cuts = {0.0, until}
    for begin, end in spans:
        cuts |= {min(begin, until), min(end, until)}
    ordered = sorted(cuts)
    yield from pairwise(ordered)


def by_lane(
    values: Iterable[tuple[str, float, float, float]],
) -> dict[str, list[tuple[float, float, float]]]:
    """Group rows of lane, begin, end and value by lane."""
    parts_by_lane: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
    for lane, begin, end, value in values:
        parts_by_lane[lane].append((begin, end, value))
    return dict(parts_by_lane)
