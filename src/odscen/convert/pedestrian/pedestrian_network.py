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
from scipy.cluster.hierarchy import DisjointSet

from odscen.base.ids import SumoEdgeId
from odscen.convert.model.access import PEDESTRIAN, WALKING_SPEED
from odscen.convert.model.connections import NodeKey, first_members, join_groups
from odscen.convert.model.lane_alignment import LaneAlignment, Line, Stretch, evaluate
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
from odscen.convert.model.walk_net import PlacedCrossing, WalkLane, WalkNet
from odscen.convert.pedestrian.walk_geometry import (
    area_outline,
    line_across,
    thirds,
    trimmed,
    triple,
)
from odscen.lanegraph.graphs import WalkKind
from odscen.lanegraph.pedestrian_graph import ROADSIDE_OFFSET, ROADSIDE_WIDTH

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.arrays import FloatArray
    from odscen.convert.pedestrian.crosswalks import PlacedCrosswalk
    from odscen.lanegraph.graphs import PedestrianGraph
    from odscen.opendrive.lanes import RoadTable


APART = 1.0
"""Metres between places of one walk where crosswalks begin, unless they are the same place."""

TOGETHER = 2.5
"""Metres between the ends of crosswalks of one junction that share a walking area."""


@dataclass(slots=True, eq=False)
class _WalkingArea:
    """A node where walks meet; ``junction`` is empty until one is known."""

    junction: str = ""
    legs: list[tuple[FloatArray, float]] = field(default_factory=list)  # cross lines: (2, 3)
    edges: list[tuple[SumoEdgeId, bool]] = field(default_factory=list)  # and whether they end here
    crossings: int = 0
    edge: SumoEdgeId | None = None


class _Arc(NamedTuple):
    """A part of a walk between two nodes; ``walk`` is a row of the graph's lane keys."""

    walk: int
    start: float
    end: float
    first: NodeKey
    last: NodeKey


class _CrosswalkEnd(NamedTuple):
    """A crosswalk's end on a walk."""

    s: float
    crosswalk: int
    which: int


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
        self._rows = [table.lane_index[key] for key in graph.lane_keys]
        self._nodes: dict[NodeKey, _WalkingArea] = {}
        self._ends: dict[tuple[int, int], NodeKey] = {}  # node of each end of each crosswalk
        self._lanes: list[WalkLane] = []
        self._number = 0
        self._own: list[NetJunction] = []

    def build(self) -> WalkNet:
        clusters = self._clusters()
        arcs = self._arcs(clusters)
        chains = self._chains(arcs)
        self._free_ends()
        self._lay(chains)
        crossings = self._crossings()
        areas, links, pairs = self._areas(crossings)
        return WalkNet(
            tuple(self._lanes),
            tuple(areas),
            {junction: tuple(own) for junction, own in crossings.items()},
            tuple(links),
            tuple(sorted(pairs)),
            tuple(self._own),
        )

    # Topology

    def _clusters(self) -> dict[NodeKey, NodeKey]:
        """Ends ``(walk, 0 or 1)`` of walks, each with the first of those the graph joins it to."""
        graph = self._graph
        groups: DisjointSet[NodeKey] = DisjointSet()
        for walk in range(len(graph.lane_keys)):
            groups.add((walk, 0))
            groups.add((walk, 1))
        joints = np.flatnonzero(graph.kind == WalkKind.JOINT)
        if len(joints):
            places = self._end_places()
            for edge in joints.tolist():
                one, other = int(graph.source[edge]), int(graph.target[edge])
                ends = self._end_of(one, other, places), self._end_of(other, one, places)
                join_groups(groups, *ends)
        return first_members(groups)

    def _end_places(self) -> FloatArray:
        """Places of both ends of all walks, shape ``(W, 2, 3)``."""
        lines = evaluate([(self._stretch(w, *self._bounds(w)),) for w in range(len(self._rows))],
                         self._table)  # fmt: skip
        return np.array([(line.shape[0], line.shape[-1]) for line in lines])

    def _end_of(self, node: int, other: int, places: FloatArray) -> tuple[int, int]:
        graph = self._graph
        walk = int(graph.lane[node])
        first, last = int(graph.first_node[walk]), int(graph.first_node[walk + 1]) - 1
        if first < last:
            return (walk, 0) if node == first else (walk, 1)
        # A walk of one node: the end on the side of the other walk.
        there = places[int(graph.lane[other])]
        gaps = [float(np.linalg.norm(there - place, axis=1).min()) for place in places[walk]]
        return (walk, int(gaps[1] < gaps[0]))

    def _bounds(self, walk: int) -> tuple[float, float]:
        row = self._rows[walk]
        return float(self._table.lane_s0[row]), float(self._table.lane_s1[row])

    def _stretch(self, walk: int, start: float, end: float) -> Stretch:
        if self._graph.roadside[walk]:
            return Stretch(self._rows[walk], start, end, 1.0, ROADSIDE_OFFSET)
        return Stretch(self._rows[walk], start, end)

    def _crosswalk_ends(self) -> dict[int, list[_CrosswalkEnd]]:
        """Where crosswalks begin on each walk, by s."""
        graph = self._graph
        index = {
            f"{placed.crosswalk.road}:{placed.crosswalk.object_id}": number
            for number, placed in enumerate(self._crosswalks)
        }
        found: dict[int, list[_CrosswalkEnd]] = {}
        for edge in np.flatnonzero(graph.kind == WalkKind.CROSSWALK).tolist():
            number = index[graph.crosswalk[edge]]
            axis = self._crosswalks[number].crosswalk.axis
            nodes = [int(graph.source[edge]), int(graph.target[edge])]
            places = np.array([(graph.x[node], graph.y[node]) for node in nodes])
            straight = np.linalg.norm(places - axis, axis=1).sum()
            swapped = np.linalg.norm(places[::-1] - axis, axis=1).sum()
            for which, node in enumerate(nodes if straight <= swapped else nodes[::-1]):
                end = _CrosswalkEnd(float(graph.s[node]), number, which)
                found.setdefault(int(graph.lane[node]), []).append(end)
        return {walk: sorted(ends) for walk, ends in found.items()}

    def _arcs(self, clusters: Mapping[NodeKey, NodeKey]) -> list[_Arc]:
        """Divide the walks at the ends of crosswalks."""
        ends = self._crosswalk_ends()
        arcs: list[_Arc] = []
        for walk in range(len(self._rows)):
            low, high = self._bounds(walk)
            before: tuple[float, NodeKey] = (low, clusters[walk, 0])
            last: NodeKey = clusters[walk, 1]
            for end in ends.get(walk, ()):
                junction = self._junctions[end.crosswalk]
                node = self._nodes.get(before[1])
                near = end.s - before[0]
                if near < TOGETHER and node is not None and node.junction == junction:
                    self._attach(end, before[1], junction)
                    continue
                if near < APART and self._takes(before[1], junction):
                    self._attach(end, before[1], junction)
                    continue
                if high - end.s < APART and self._takes(last, junction):
                    self._attach(end, last, junction)
                    continue
                place = max(end.s, before[0] + min(APART, 0.3 * (high - before[0])))
                key = ("crosswalk", end.crosswalk, end.which)
                self._attach(end, key, junction)
                arcs.append(_Arc(walk, before[0], place, before[1], key))
                before = (place, key)
            arcs.append(_Arc(walk, before[0], high, before[1], last))
        return arcs

    def _takes(self, key: NodeKey, junction: str) -> bool:
        node = self._nodes.get(key)
        return node is None or node.junction in ("", junction)

    def _attach(self, end: _CrosswalkEnd, key: NodeKey, junction: str) -> None:
        node = self._nodes.setdefault(key, _WalkingArea())
        node.junction = junction
        node.crossings += 1
        self._ends[end.crosswalk, end.which] = key

    def _chains(self, arcs: Sequence[_Arc]) -> list[list[tuple[_Arc, bool]]]:
        """Join arcs that simply follow each other; the flag says gone along from start to end."""
        degree = Counter(key for arc in arcs for key in (arc.first, arc.last))
        meeting: dict[object, list[int]] = {}
        for number, arc in enumerate(arcs):
            meeting.setdefault(arc.first, []).append(number)
            meeting.setdefault(arc.last, []).append(number)
        passed = {key for key, count in degree.items() if count == 2 and key not in self._nodes}
        used: set[int] = set()
        chains: list[list[tuple[_Arc, bool]]] = []

        def follow(number: int, key: NodeKey) -> list[tuple[_Arc, bool]]:
            chain: list[tuple[_Arc, bool]] = []
            while number not in used:
                used.add(number)
                arc = arcs[number]
                along = arc.first == key
                chain.append((arc, along))
                key = arc.last if along else arc.first
                if key not in passed:
                    break
                number = next((n for n in meeting[key] if n not in used), number)
            return chain

        for number, arc in enumerate(arcs):
            start = next((key for key in (arc.first, arc.last) if key not in passed), None)
            if number not in used and start is not None:
                chains.append(follow(number, start))
        for number, arc in enumerate(arcs):  # what is left is closed
            if number not in used:
                passed.discard(arc.first)
                chains.append(follow(number, arc.first))
        return chains

    def _free_ends(self) -> None:
        """Give crosswalk ends without a walk a node of their own; ends side by side share one."""
        free: dict[str, list[tuple[NodeKey, FloatArray]]] = {}
        for number, placed in enumerate(self._crosswalks):
            junction = self._junctions[number]
            for which in (0, 1):
                if (number, which) in self._ends:
                    continue
                place = placed.crosswalk.axis[which]
                known = free.setdefault(junction, [])
                key = next(
                    (k for k, p in known if float(np.linalg.norm(p - place)) < TOGETHER),
                    ("crosswalk", number, which),
                )
                known.append((key, place))
                self._attach(_CrosswalkEnd(0.0, number, which), key, junction)

    # Geometry

    def _lay(self, chains: Sequence[list[tuple[_Arc, bool]]]) -> None:
        """Make an edge of each chain, of three parts if both ends are at one junction."""
        alignments: list[LaneAlignment] = []
        ends: list[tuple[NodeKey, NodeKey]] = []
        for chain in chains:
            alignment = tuple(
                self._stretch(arc.walk, *((arc.start, arc.end) if along else (arc.end, arc.start)))
                for arc, along in chain
            )
            first = chain[0][0].first if chain[0][1] else chain[0][0].last
            last = chain[-1][0].last if chain[-1][1] else chain[-1][0].first
            alignment = tuple(s for s in alignment if s.extent > 1e-3)
            if sum(s.extent for s in alignment) < LEAST_LENGTH:
                continue
            one, other = self._node(first), self._node(last)
            if one is other or (one.junction and one.junction == other.junction):
                # Of two parts both would join the same junctions, and SUMO could not tell
                # whether a walk from one to the other goes over the middle or round the ends.
                keys = [("part", len(alignments)), ("part", len(alignments) + 1)]
                alignments += thirds(alignment)
                ends += [(first, keys[0]), (keys[0], keys[1]), (keys[1], last)]
            else:
                alignments.append(alignment)
                ends.append((first, last))
        meetings = Counter(key for pair in ends for key in pair)

        def meets(key: NodeKey) -> bool:
            return meetings[key] + self._node(key).crossings > 1

        cut_back = [
            trimmed(alignment, start=meets(pair[0]), end=meets(pair[1]))
            for alignment, pair in zip(alignments, ends, strict=True)
        ]
        lines = evaluate(cut_back, self._table)
        for line, alignment, pair in zip(lines, cut_back, ends, strict=True):
            self._edge(line, alignment, pair)

    def _node(self, key: NodeKey) -> _WalkingArea:
        return self._nodes.setdefault(key, _WalkingArea())

    def _edge(self, line: Line, alignment: LaneAlignment, ends: tuple[NodeKey, NodeKey]) -> None:
        roadside = alignment[0].at == 1.0
        name = f"w{self._number}"
        self._number += 1
        edge, lane = SumoEdgeId(name), lane_id(name)
        width = ROADSIDE_WIDTH if roadside else max(line.widths[1], 0.5)
        junctions: list[str] = []
        for key, which in ((ends[0], 0), (ends[1], -1)):
            node = self._node(key)
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
            xodr=tuple(dict.fromkeys(self._name(stretch.row) for stretch in alignment)),
        )
        net_edge = NetEdge(edge, NORMAL, (walk,), junctions[0], junctions[1], priority=0)
        self._lanes.append(WalkLane(net_edge, line, alignment))

    def _name(self, row: int) -> str:
        key = self._table.lane_keys[row]
        return f"{key.road}_{key.lane}"

    def _crossings(self) -> dict[str, list[PlacedCrossing]]:
        """Crossings by junction; walking areas get their names here, in the order of need."""
        counts: Counter[str] = Counter()

        def area(key: NodeKey) -> SumoEdgeId:
            node = self._nodes[key]
            if node.edge is None:
                node.edge = walking_area_id(node.junction, counts[node.junction])
                counts[node.junction] += 1
            return node.edge

        found: dict[str, list[PlacedCrossing]] = {}
        order = sorted(
            range(len(self._crosswalks)),
            key=lambda n: (self._junctions[n], str(self._ends[n, 0]), n),
        )
        for number in order:
            placed, junction = self._crosswalks[number], self._junctions[number]
            start, end = area(self._ends[number, 0]), area(self._ends[number, 1])
            own = found.setdefault(junction, [])
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
        return found

    def _areas(
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
