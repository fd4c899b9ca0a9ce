"""A map as realization needs it: its graphs, its SUMO network, and where the two meet."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from odscen.base.ids import LaneKey, Roadside
from odscen.lanegraph.graphs import Relation
from odscen.lanegraph.parking_areas import NO_PARKING
from odscen.sumo.realize.road_net import Link, RoadNet, RoadNetLane
from odscen.sumo.realize.route_planner import NodePositions

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.arrays import BoolArray, FloatArray, Int32Array
    from odscen.convert.lane_table.table import LaneTable, SumoLight
    from odscen.convert.model.conversion_settings import ConverterName
    from odscen.lanegraph.graphs import LaneGraph, MapGraph
    from odscen.lanegraph.parking_areas import MapParking
    from odscen.scenario.document.signals_document import Control

NORMAL = "normal"
INTERNAL = "internal"

NETWORK_CONTROLS: dict[ConverterName, Control | None] = {
    "odscen": "extended",
    "netconvert": "fixed",
    "file": None,
}
"""How a network runs its lights, by who has written it; ``None`` if that is not known."""

SHORT = 1.0
"""Lanes up to this length (m) may be missing in SUMO: routes lead over them all the same."""

NOTHING = 1e-3
"""Metres that stand for no ground at all."""


@dataclass(frozen=True, eq=False)
class SumoMap:
    """Made once per map by :meth:`of`; many scenarios are realized on it.

    Attributes
    ----------
    lane_places, walk_places
        Where the nodes of the lane graph and of the pedestrian graph are on the network.
    net_offset
        Added to OpenDRIVE x and y to give SUMO's, metres.
    elevation
        Whether the network has heights.
    lights
        Traffic lights of the network.
    lane_names
        OpenDRIVE lanes (``12.0.-1``) at the stop lines of lights, and where one comes out behind
        them, by SUMO lane.
    parking
        Where cars can park.
    control
        How the network itself runs its lights; ``None`` if that is not known, as of one from
        outside.
    """

    graph: MapGraph
    net: RoadNet
    lane_places: NodePositions
    walk_places: NodePositions
    net_offset: tuple[float, float]
    elevation: bool = False
    lights: tuple[SumoLight, ...] = ()
    lane_names: Mapping[str, str] = field(default_factory=dict)
    parking: MapParking = NO_PARKING
    control: Control | None = "extended"

    @cached_property
    def drivable(self) -> BoolArray:
        """Lane-graph nodes that a route in SUMO can lead over, shape ``(N,)``.

        Those of lanes that exist in SUMO, somewhere along them at least.
        """
        lanes = self.graph.lanes
        known = np.zeros(len(lanes.lanes.keys), dtype=np.bool_)
        known[lanes.lane[self.lane_places.lane >= 0]] = True
        known |= lanes.lanes.lengths <= SHORT
        return known[lanes.lane]

    @cached_property
    def edge_nodes(self) -> dict[str, Int32Array]:
        """Nodes of the lane graph on the lanes of each SUMO edge, junctions left out."""
        places = self.lane_places
        order = np.argsort(places.lane, kind="stable")
        rows, starts = np.unique(places.lane[order], return_index=True)
        groups: dict[str, list[Int32Array]] = {}
        for row, nodes in zip(rows.tolist(), np.split(order, starts[1:]), strict=True):
            if row < 0:
                continue
            lane = self.net.lanes[places.lanes[row]]
            if not lane.internal:
                groups.setdefault(lane.edge, []).append(nodes.astype(np.int32))
        return {edge: np.sort(np.concatenate(parts)) for edge, parts in groups.items()}

    @cached_property
    def edge_ends(self) -> dict[str, tuple[int, int]]:
        """First and last node on each SUMO edge outside junctions."""
        pos = self.lane_places.pos
        return {
            edge: (int(nodes[np.argmin(pos[nodes])]), int(nodes[np.argmax(pos[nodes])]))
            for edge, nodes in self.edge_nodes.items()
        }

    @classmethod
    def of(
        cls,
        graph: MapGraph,
        table: LaneTable,
        *,
        parking: MapParking = NO_PARKING,
        converter: ConverterName = "odscen",
    ) -> SumoMap:
        """Bring graph and lane table together; ``converter`` has written the network."""
        lanes, walks = graph.lanes, graph.walks
        net = _road_net(table)
        walk_keys = [
            Roadside(*key) if beside else key
            for key, beside in zip(walks.lane_keys, walks.roadside, strict=True)
        ]
        places = _node_positions(table, lanes.lanes.keys, lanes.lane, lanes.s, lanes.x, lanes.y)
        return cls(
            graph=graph,
            net=net,
            lane_places=with_gaps(places, lanes, net),
            walk_places=_fill_scales(
                _node_positions(table, walk_keys, walks.lane, walks.s, walks.x, walks.y)
            ),
            net_offset=table.net_offset,
            elevation=table.elevation,
            lights=table.lights,
            lane_names=_lane_names(table),
            parking=parking,
            control=NETWORK_CONTROLS[converter],
        )


def _node_positions(
    table: LaneTable,
    keys: Sequence[LaneKey | Roadside],
    lane: Int32Array,
    s: FloatArray,
    x: FloatArray,
    y: FloatArray,
) -> NodePositions:
    places = table.sumo_places(keys, lane, s)
    scale = pos_per_metre(places.lane, places.pos, x, y, lanes=len(table.lanes))
    return NodePositions(tuple(table.lanes), places.lane, places.pos, places.deviation, scale)


def pos_per_metre(
    lane: Int32Array, pos: FloatArray, x: FloatArray, y: FloatArray, *, lanes: int
) -> FloatArray:
    """How many metres of position one metre of ground is, per SUMO lane; shape ``(lanes,)``.

    All lanes of a SUMO edge have one length, that of their middle; in a curve the outer ones are
    longer on the ground, the inner ones shorter. Measured between neighbouring nodes on the same
    SUMO lane; NaN where there are none.

    Parameters
    ----------
    lane, pos, x, y
        Shape ``(N,)``: nodes in the order of the graph, those of one lane together.
    """
    same = (lane[1:] == lane[:-1]) & (lane[1:] >= 0)
    row = lane[1:][same]
    ground = np.hypot(np.diff(x), np.diff(y))[same]
    moved = np.abs(np.diff(pos))[same]
    totals = np.bincount(row, weights=ground, minlength=lanes)
    moves = np.bincount(row, weights=moved, minlength=lanes)
    return np.where(totals > 0, moves / np.where(totals > 0, totals, 1.0), np.nan)


def with_gaps(places: NodePositions, graph: LaneGraph, net: RoadNet) -> NodePositions:
    """Places with the scale of short internal lanes, on which no two nodes lie.

    SUMO's length of such a lane may be twice what it measures on the ground, or 0.1 m where there
    is nothing at all. The ground is what is left of the path between the nodes before and behind
    it; where one node lies on it, the path from its start to that node.
    """
    scale = places.scale.copy()
    row_of = {name: row for row, name in enumerate(places.lanes)}
    before, after = places.lane[graph.source], places.lane[graph.target]
    crosses = (graph.relation == Relation.SUCCESSOR) & (before != after)
    crosses &= (before >= 0) & (after >= 0)
    for edge in np.flatnonzero(crosses).tolist():
        start, end = int(graph.source[edge]), int(graph.target[edge])
        one, other = (net.lanes[places.lanes[places.lane[node]]] for node in (start, end))
        if one.internal:
            continue
        ground = float(graph.length[edge])
        ground -= (one.length - float(places.pos[start])) / _or_one(scale[row_of[one.id]])
        if other.internal:
            inside: tuple[RoadNetLane, ...] = (other,)
            length = float(places.pos[end])
        else:
            inside = (net.passage(one.id, other.edge) or ())[:-1]
            length = sum(lane.length for lane in inside)
            ground -= float(places.pos[end]) / _or_one(scale[row_of[other.id]])
        rows = [row_of[lane.id] for lane in inside]
        if rows and np.all(np.isnan(scale[rows])):
            scale[rows] = max(length, NOTHING) / max(ground, NOTHING)
    return _fill_scales(replace(places, scale=scale))


def _fill_scales(places: NodePositions) -> NodePositions:
    return replace(places, scale=np.where(np.isnan(places.scale), 1.0, places.scale))


def _or_one(scale: float) -> float:
    return 1.0 if np.isnan(scale) else float(scale)


def _lane_names(table: LaneTable) -> dict[str, str]:
    links = [link for light in table.lights for link in light.links if link.turn]
    places = [(link.target, 0.0) for link in links]
    places += [(link.source, table.lanes[link.source].length) for link in links]
    found = {lane: table.to_xodr(lane, pos) for lane, pos in places}
    return {
        lane: str(place.lane)
        for lane, place in found.items()
        if place is not None and isinstance(place.lane, LaneKey)
    }


def _road_net(table: LaneTable) -> RoadNet:
    lanes: dict[str, RoadNetLane] = {
        lane.id: RoadNetLane(
            lane.id,
            lane.edge,
            lane.index,
            lane.length,
            internal=table.edges[lane.edge].function == INTERNAL,
            speed=lane.speed,
            width=lane.width,
            allowed=lane.allowed,
        )
        for lane in table.lane_list
    }
    links = tuple(Link(link.from_lane, link.to_lane, link.via or None) for link in table.links)
    ends: dict[str, tuple[str, str]] = {
        edge.id: (edge.from_junction, edge.to_junction) for edge in table.edges.values()
    }
    return RoadNet(lanes, links, _walk_links(table), lefthand=table.lefthand, ends=ends)


def _walk_links(table: LaneTable) -> frozenset[tuple[str, str]]:
    """Pairs of normal edges between which one can walk, over crossings and walking areas.

    A SUMO walk names normal edges only; what lies between them at a junction SUMO finds itself.
    """
    normal = {edge.id for edge in table.edges.values() if edge.function == NORMAL}
    walk_links: set[tuple[str, str]] = set()
    for start in sorted(normal & table.walk_neighbours.keys()):
        todo, seen = [start], {start}
        while todo:
            for other in table.walk_neighbours.get(todo.pop(), ()):
                if other in seen:
                    continue
                seen.add(other)
                if other in normal:
                    walk_links.add((start, other))
                else:
                    todo.append(other)
    return frozenset(walk_links)
