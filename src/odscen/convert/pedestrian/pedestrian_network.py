"""The pedestrian network: the pedestrian graph in SUMO's terms.

Each path along the graph becomes an edge for persons only, every crosswalk a crossing, and where
they meet is a walking area. SUMO lets persons cross a junction only on walking areas and crossings
of that same junction; so a walking area at a crosswalk belongs to the junction whose traffic the
crosswalk stops, all others are small junctions of their own.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import shapely

from odscen.base.ids import SumoEdgeId
from odscen.convert.model.access import PEDESTRIAN, WALKING_SPEED
from odscen.convert.model.lane_alignment import LaneAlignment, Line, evaluate
from odscen.convert.model.net import (
    CROSSING,
    LEAST_LENGTH,
    NORMAL,
    WALKING_AREA,
    NetEdge,
    NetJunction,
    NetLane,
    NetLink,
)
from odscen.convert.model.net_ids import crossing_id, lane_id, walking_area_id
from odscen.convert.model.right_of_way import Walkway
from odscen.convert.pedestrian.walk_topology import Walks, walk_topology
from odscen.lanegraph.pedestrian_graph import ROADSIDE_WIDTH

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.base.arrays import FloatArray
    from odscen.convert.model.connections import NodeKey
    from odscen.convert.model.lane_alignment import Stretch
    from odscen.convert.pedestrian.crosswalks import PlacedCrosswalk
    from odscen.convert.pedestrian.walk_topology import Chain
    from odscen.lanegraph.graphs import PedestrianGraph
    from odscen.opendrive.lanes import RoadTable


class WalkLane(NamedTuple):
    """A pedestrian edge and what it lies on."""

    edge: NetEdge
    line: Line
    alignment: LaneAlignment


class PlacedCrossing(NamedTuple):
    """A crossing of a junction and the walking area at which it starts."""

    edge: NetEdge
    walkway: Walkway
    start: SumoEdgeId
    link: NetLink


@dataclass(frozen=True, slots=True)
class WalkNet:
    """All that persons walk on.

    ``crossings`` are those of each junction, in the order in which the junction counts them;
    ``junctions`` those that exist for persons only.
    """

    lanes: tuple[WalkLane, ...]
    areas: tuple[NetEdge, ...]
    crossings: dict[str, tuple[PlacedCrossing, ...]]
    links: tuple[NetLink, ...]
    walk_links: tuple[tuple[SumoEdgeId, SumoEdgeId], ...]
    junctions: tuple[NetJunction, ...]


TRIM = 0.6
"""Metres that an edge keeps off the middle of a walking area."""

_RING = "ring"
"""Of keys of nodes: where a ring is divided and nothing else meets it."""

TRIM_WITHIN = 0.1
"""The same where a ring is only divided: nobody turns there, and its metres are the map's.

Not where a sidewalk goes round the corner of a junction: the striping model of SUMO loses a part of
a step in so small a walking area. In the shipped town that is 1.5 s of delay for each person.
"""


def triple(place: FloatArray) -> tuple[float, float, float]:
    """x, y, z as plain numbers, from shape ``(3,)``."""
    x, y, z = (float(value) for value in place)
    return x, y, z


def line_across(shape: FloatArray, which: int, width: float) -> FloatArray:
    """Line across the start (0) or the end (-1) of a shape, shape ``(2, 3)``."""
    step = shape[1] - shape[0] if which == 0 else shape[-1] - shape[-2]
    length = max(float(np.hypot(step[0], step[1])), 1e-9)
    normal = np.array([-step[1], step[0], 0.0]) / length * (width / 2.0)
    result: FloatArray = np.stack([shape[which] - normal, shape[which] + normal])
    return result


def area_outline(legs: Sequence[FloatArray]) -> FloatArray:
    """Outline of a walking area, shape ``(N, 3)``: hull of the ends of walks that meet in it."""
    points = np.concatenate(list(legs))
    z = float(points[:, 2].mean())
    hull = shapely.MultiPoint(points[:, :2]).convex_hull
    if hull.geom_type != "Polygon" or hull.area < 0.05:
        hull = hull.buffer(TRIM, quad_segs=1)
    outline = np.array(hull.exterior.coords)[:-1]
    return np.column_stack((outline, np.full(len(outline), z)))


def thirds(alignment: LaneAlignment) -> list[LaneAlignment]:
    """Divide an alignment into three parts of about the same extent."""
    third = sum(stretch.extent for stretch in alignment) / 3.0
    head, rest = divided(alignment, third)
    return [head, *divided(rest, third)]


def divided(alignment: LaneAlignment, extent: float) -> tuple[LaneAlignment, LaneAlignment]:
    """Divide an alignment after ``extent`` metres of s.

    Raises
    ------
    ValueError
        If it has no stretch.
    """
    for index, stretch in enumerate(alignment):
        if extent < stretch.extent or index == len(alignment) - 1:
            share = min(max(extent / stretch.extent, 0.1), 0.9)
            middle = stretch.start + share * (stretch.end - stretch.start)
            head, tail = stretch._replace(end=middle), stretch._replace(start=middle)
            return (*alignment[:index], head), (tail, *alignment[index + 1 :])
        extent -= stretch.extent
    raise ValueError("nothing to divide")


def trimmed(alignment: LaneAlignment, *, start: float, end: float) -> LaneAlignment:
    """Take metres off the ends, at most a quarter of the last stretch."""
    result = list(alignment)
    if start:
        old = result[0]
        result[0] = old._replace(start=old.start + cut(old, start))
    if end:
        old = result[-1]
        result[-1] = old._replace(end=old.end - cut(old, end))
    return tuple(result)


def cut(stretch: Stretch, trim: float) -> float:
    """By how much a stretch is shortened at a walking area: metres of s along its direction."""
    return min(trim, stretch.extent / 4.0) * (1.0 if stretch.end > stretch.start else -1.0)


@dataclass(slots=True, eq=False)
class _WalkingArea:
    """A node where walks meet; ``junction`` is empty until one is known."""

    junction: str = ""
    legs: list[tuple[FloatArray, float]] = field(default_factory=list)  # cross lines: (2, 3)
    edges: list[tuple[SumoEdgeId, bool]] = field(default_factory=list)  # and whether they end here
    crossings: int = 0
    edge: SumoEdgeId | None = None


def build_walks(
    graph: PedestrianGraph,
    table: RoadTable,
    crosswalks: Sequence[PlacedCrosswalk],
    junctions: Sequence[str],
) -> WalkNet:
    """Make the pedestrian network.

    Parameters
    ----------
    graph
        The pedestrian graph of the map.
    crosswalks
        All crosswalks of the map.
    junctions
        The junction of each crosswalk.
    """
    return _WalkNetBuilder(graph, table, crosswalks, junctions).build()


class _WalkNetBuilder:
    def __init__(
        self,
        graph: PedestrianGraph,
        table: RoadTable,
        crosswalks: Sequence[PlacedCrosswalk],
        junctions: Sequence[str],
    ) -> None:
        self._graph = graph
        self._table = table
        self._crosswalks = crosswalks
        self._junctions = junctions
        self._walks = Walks(graph, table)
        self._topology = walk_topology(graph, self._walks, crosswalks, junctions)
        self._ends = self._topology.ends
        self._nodes = {
            key: _WalkingArea(junction, crossings=self._topology.crossings[key])
            for key, junction in self._topology.junctions.items()
        }
        self._lanes: list[WalkLane] = []
        self._number = 0
        self._own: list[NetJunction] = []

    def build(self) -> WalkNet:
        self._lay_chains(self._topology.chains)
        crossings = self._place_crossings()
        areas, links, pairs = self._build_areas(crossings)
        return WalkNet(
            tuple(self._lanes),
            tuple(areas),
            {junction: tuple(own) for junction, own in crossings.items()},
            tuple(links),
            tuple(sorted(pairs)),
            tuple(self._own),
        )

    def _lay_chains(self, chains: Sequence[Chain]) -> None:
        """Make an edge of each chain, of three parts if both ends are at one junction.

        Of two parts where something else leads from the one end to the other already: SUMO knows
        one way from edge to edge, and a person who goes on from the one to the other at this end
        would be at that end at once.
        """
        alignments: list[LaneAlignment] = []
        ends: list[tuple[NodeKey, NodeKey]] = []
        joined = {
            frozenset(id(self._walking_area_at(self._ends[number, which])) for which in (0, 1))
            for number in range(len(self._crosswalks))
        }
        for chain in chains:
            spans = [
                (arc.start, arc.end) if along else (arc.end, arc.start) for arc, along in chain
            ]
            alignment = tuple(
                self._walks.stretch(arc.walk, *span)
                for (arc, _), span in zip(chain, spans, strict=True)
            )
            first = chain[0][0].first if chain[0][1] else chain[0][0].last
            last = chain[-1][0].last if chain[-1][1] else chain[-1][0].first
            alignment = tuple(s for s in alignment if s.extent > 1e-3)
            if sum(s.extent for s in alignment) < LEAST_LENGTH:
                continue
            one, other = self._walking_area_at(first), self._walking_area_at(last)
            if one is other or (one.junction and one.junction == other.junction):
                # Of two parts both would join the same junctions, and SUMO could not tell
                # whether a walk from one to the other goes over the middle or round the ends.
                kind = _RING if one is other else "part"
                keys = [(kind, len(alignments)), (kind, len(alignments) + 1)]
                alignments += thirds(alignment)
                ends += [(first, keys[0]), (keys[0], keys[1]), (keys[1], last)]
            elif (both := frozenset((id(one), id(other)))) in joined:
                key = (_RING, len(alignments))
                alignments += divided(alignment, sum(s.extent for s in alignment) / 2.0)
                ends += [(first, key), (key, last)]
            else:
                joined.add(both)
                alignments.append(alignment)
                ends.append((first, last))
        meetings = Counter(key for pair in ends for key in pair)

        def trim(key: NodeKey) -> float:
            if key[0] == _RING:
                return TRIM_WITHIN
            return TRIM if meetings[key] + self._walking_area_at(key).crossings > 1 else 0.0

        cut_back = [
            trimmed(alignment, start=trim(pair[0]), end=trim(pair[1]))
            for alignment, pair in zip(alignments, ends, strict=True)
        ]
        lines = evaluate(cut_back, self._table)
        for line, alignment, pair in zip(lines, cut_back, ends, strict=True):
            self._add_edge(line, alignment, pair)

    def _walking_area_at(self, key: NodeKey) -> _WalkingArea:
        return self._nodes.setdefault(key, _WalkingArea())

    def _add_edge(
        self, line: Line, alignment: LaneAlignment, ends: tuple[NodeKey, NodeKey]
    ) -> None:
        roadside = alignment[0].at == 1.0
        name = f"w{self._number}"
        self._number += 1
        edge, lane = SumoEdgeId(name), lane_id(name)
        width = ROADSIDE_WIDTH if roadside else max(line.widths[1], 0.5)
        junctions: list[str] = []
        for key, which in ((ends[0], 0), (ends[1], -1)):
            node = self._walking_area_at(key)
            if not node.junction:
                node.junction = f"walk{len(self._own)}"
                ends_at = line_across(line.shape, which, width)
                self._own.append(
                    NetJunction(node.junction, "dead_end", triple(line.shape[which]), ends_at)
                )
            junctions.append(node.junction)
            node.legs.append((line_across(line.shape, which, width), width))
            node.edges.append((edge, which == -1))
        walk = NetLane(
            lane,
            0,
            round(max(line.length, LEAST_LENGTH), 4),
            WALKING_SPEED,
            round(width, 2),
            PEDESTRIAN,
            line.shape,
            type="roadside" if roadside else "sidewalk",
            xodr=tuple(dict.fromkeys(self._name_walk(stretch.row) for stretch in alignment)),
        )
        net_edge = NetEdge(edge, NORMAL, (walk,), junctions[0], junctions[1], priority=0)
        self._lanes.append(WalkLane(net_edge, line, alignment))

    def _name_walk(self, row: int) -> str:
        key = self._table.lane_keys[row]
        return f"{key.road}_{key.lane}"

    def _place_crossings(self) -> dict[str, list[PlacedCrossing]]:
        """Crossings by junction; walking areas get their names here, in the order of need."""
        counts: Counter[str] = Counter()

        def area(key: NodeKey) -> SumoEdgeId:
            node = self._nodes[key]
            if node.edge is None:
                node.edge = walking_area_id(node.junction, counts[node.junction])
                counts[node.junction] += 1
            return node.edge

        crossings: dict[str, list[PlacedCrossing]] = {}
        order = sorted(
            range(len(self._crosswalks)),
            key=lambda n: (self._junctions[n], str(self._ends[n, 0]), n),
        )
        for number in order:
            placed, junction = self._crosswalks[number], self._junctions[number]
            start, end = area(self._ends[number, 0]), area(self._ends[number, 1])
            own = crossings.setdefault(junction, [])
            edge = crossing_id(junction, len(own))
            crosswalk = placed.crosswalk
            axis = np.column_stack((crosswalk.axis, np.full(2, crosswalk.z)))
            length = float(np.linalg.norm(axis[1] - axis[0]))
            width = max(crosswalk.width, 0.5)
            lane = NetLane(
                lane_id(edge),
                0,
                round(max(length, LEAST_LENGTH), 4),
                WALKING_SPEED,
                round(width, 2),
                PEDESTRIAN,
                axis,
                xodr=(f"{crosswalk.road}:{crosswalk.object_id}",),
            )
            for which in (0, 1):
                across = line_across(axis, 0 if which == 0 else -1, width)
                self._nodes[self._ends[number, which]].legs.append((across, width))
            link = NetLink(edge, end)
            crossing = NetEdge(edge, CROSSING, (lane,))
            walkway = Walkway(axis, width)
            own.append(PlacedCrossing(crossing, walkway, start, link))
        for key, node in self._nodes.items():
            if len(node.edges) > 1:
                area(key)
        return crossings

    def _build_areas(
        self, crossings: dict[str, list[PlacedCrossing]]
    ) -> tuple[list[NetEdge], list[NetLink], set[tuple[SumoEdgeId, SumoEdgeId]]]:
        areas: list[NetEdge] = []
        links: list[NetLink] = []
        pairs: set[tuple[SumoEdgeId, SumoEdgeId]] = set()

        def pair(one: SumoEdgeId, other: SumoEdgeId) -> None:
            pairs.add((one, other) if one < other else (other, one))

        for node in self._nodes.values():
            if node.edge is None:
                continue
            outline = area_outline([leg for leg, _ in node.legs])
            size = float(np.ptp(outline[:, :2], axis=0).max())
            lane = NetLane(
                lane_id(node.edge),
                0,
                round(max(size, 0.5), 4),
                WALKING_SPEED,
                round(min(width for _, width in node.legs), 2),
                PEDESTRIAN,
                outline,
            )
            areas.append(NetEdge(node.edge, WALKING_AREA, (lane,)))
            for edge, ends_here in node.edges:
                links.append(NetLink(edge, node.edge) if ends_here else NetLink(node.edge, edge))
                pair(node.edge, edge)
        for own in crossings.values():
            for crossing in own:
                pair(crossing.start, crossing.edge.id)
                pair(crossing.edge.id, crossing.link.target)
        return areas, links, pairs
