"""Which parts of walks follow each other, and where crosswalks divide them."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.cluster.hierarchy import DisjointSet

from odscen.convert.model.connections import NodeKey, first_members, join_groups
from odscen.convert.model.lane_alignment import Stretch, evaluate
from odscen.lanegraph.graphs import WalkKind
from odscen.lanegraph.pedestrian_graph import ROADSIDE_OFFSET

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


class Arc(NamedTuple):
    """A part of a walk between two nodes; ``walk`` is a row of the graph's lane keys."""

    walk: int
    start: float
    end: float
    first: NodeKey
    last: NodeKey


Chain = list[tuple[Arc, bool]]
"""Arcs that simply follow each other; the flag says gone along from start to end."""


class _CrosswalkEnd(NamedTuple):
    """A crosswalk's end on a walk."""

    s: float
    crosswalk: int
    which: int


class WalkTopology(NamedTuple):
    """Chains of walks between nodes, and the nodes where crosswalks begin.

    Attributes
    ----------
    chains
        All parts of walks, joined where nothing else meets them.
    junctions
        Junction of each node where crosswalks begin, in the order in which they were found.
    crossings
        How many crosswalks begin at each of these.
    ends
        Node of each end, 0 or 1, of each crosswalk.
    """

    chains: list[Chain]
    junctions: dict[NodeKey, str]
    crossings: Counter[NodeKey]
    ends: dict[tuple[int, int], NodeKey]


def walk_topology(
    graph: PedestrianGraph,
    walks: Walks,
    crosswalks: Sequence[PlacedCrosswalk],
    junctions: Sequence[str],
) -> WalkTopology:
    """Divide the walks of a graph at crosswalks and join what is left.

    Parameters
    ----------
    graph
        The pedestrian graph of the map.
    walks
        Its walks.
    crosswalks
        All crosswalks of the map.
    junctions
        The junction of each crosswalk.
    """
    return _Divider(graph, walks, crosswalks, junctions).divide()


class Walks:
    """The walks of a pedestrian graph, by the rows of its lane keys.

    Parameters
    ----------
    graph
        The pedestrian graph of a map.
    table
        Its lanes.
    """

    def __init__(self, graph: PedestrianGraph, table: RoadTable) -> None:
        self._graph = graph
        self._table = table
        self._rows = [table.lane_index[key] for key in graph.lane_keys]

    def __len__(self) -> int:
        """How many there are."""
        return len(self._rows)

    def bounds(self, walk: int) -> tuple[float, float]:
        """First and last s of a walk, metres."""
        row = self._rows[walk]
        return float(self._table.lane_s0[row]), float(self._table.lane_s1[row])

    def stretch(self, walk: int, start: float, end: float) -> Stretch:
        """A part of a walk, from s to s, which may go down."""
        if self._graph.roadside[walk]:
            return Stretch(self._rows[walk], start, end, 1.0, ROADSIDE_OFFSET)
        return Stretch(self._rows[walk], start, end)

    def end_places(self) -> FloatArray:
        """Places of both ends of all walks, shape ``(W, 2, 3)``."""
        whole = [(self.stretch(walk, *self.bounds(walk)),) for walk in range(len(self))]
        lines = evaluate(whole, self._table)
        return np.array([(line.shape[0], line.shape[-1]) for line in lines])


class _Divider:
    def __init__(
        self,
        graph: PedestrianGraph,
        walks: Walks,
        crosswalks: Sequence[PlacedCrosswalk],
        junctions: Sequence[str],
    ) -> None:
        self._graph = graph
        self._walks = walks
        self._crosswalks = crosswalks
        self._junctions = junctions
        self._at: dict[NodeKey, str] = {}
        self._crossings: Counter[NodeKey] = Counter()
        self._ends: dict[tuple[int, int], NodeKey] = {}

    def divide(self) -> WalkTopology:
        arcs = self._divide_walks(self._cluster_ends())
        chains = self._join_chains(arcs)
        self._free_ends()
        return WalkTopology(chains, self._at, self._crossings, self._ends)

    def _cluster_ends(self) -> dict[NodeKey, NodeKey]:
        """Ends ``(walk, 0 or 1)`` of walks, each with the first of those the graph joins it to."""
        graph = self._graph
        groups: DisjointSet[NodeKey] = DisjointSet()
        for walk in range(len(graph.lane_keys)):
            groups.add((walk, 0))
            groups.add((walk, 1))
        joints = np.flatnonzero(graph.kind == WalkKind.JOINT)
        if len(joints):
            places = self._walks.end_places()
            for edge in joints.tolist():
                one, other = int(graph.source[edge]), int(graph.target[edge])
                ends = self._end_of(one, other, places), self._end_of(other, one, places)
                join_groups(groups, *ends)
        return first_members(groups)

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

    def _crosswalk_ends(self) -> dict[int, list[_CrosswalkEnd]]:
        """Where crosswalks begin on each walk, by s."""
        graph = self._graph
        index = {
            f"{placed.crosswalk.road}:{placed.crosswalk.object_id}": number
            for number, placed in enumerate(self._crosswalks)
        }
        crosswalk_ends: dict[int, list[_CrosswalkEnd]] = {}
        for edge in np.flatnonzero(graph.kind == WalkKind.CROSSWALK).tolist():
            number = index[graph.crosswalk[edge]]
            axis = self._crosswalks[number].crosswalk.axis
            nodes = [int(graph.source[edge]), int(graph.target[edge])]
            places = np.array([(graph.x[node], graph.y[node]) for node in nodes])
            straight = np.linalg.norm(places - axis, axis=1).sum()
            swapped = np.linalg.norm(places[::-1] - axis, axis=1).sum()
            for which, node in enumerate(nodes if straight <= swapped else nodes[::-1]):
                end = _CrosswalkEnd(float(graph.s[node]), number, which)
                crosswalk_ends.setdefault(int(graph.lane[node]), []).append(end)
        return {walk: sorted(ends) for walk, ends in crosswalk_ends.items()}

    def _divide_walks(self, clusters: Mapping[NodeKey, NodeKey]) -> list[Arc]:
        """Divide the walks at the ends of crosswalks."""
        ends = self._crosswalk_ends()
        arcs: list[Arc] = []
        for walk in range(len(self._walks)):
            low, high = self._walks.bounds(walk)
            before: tuple[float, NodeKey] = (low, clusters[walk, 0])
            last: NodeKey = clusters[walk, 1]
            for end in ends.get(walk, ()):
                junction = self._junctions[end.crosswalk]
                near = end.s - before[0]
                if near < TOGETHER and self._at.get(before[1]) == junction:
                    self._attach_crosswalk(end, before[1], junction)
                    continue
                if near < APART and self._takes_junction(before[1], junction):
                    self._attach_crosswalk(end, before[1], junction)
                    continue
                if high - end.s < APART and self._takes_junction(last, junction):
                    self._attach_crosswalk(end, last, junction)
                    continue
                place = max(end.s, before[0] + min(APART, 0.3 * (high - before[0])))
                key = ("crosswalk", end.crosswalk, end.which)
                self._attach_crosswalk(end, key, junction)
                arcs.append(Arc(walk, before[0], place, before[1], key))
                before = (place, key)
            arcs.append(Arc(walk, before[0], high, before[1], last))
        return arcs

    def _takes_junction(self, key: NodeKey, junction: str) -> bool:
        return self._at.get(key, "") in ("", junction)

    def _attach_crosswalk(self, end: _CrosswalkEnd, key: NodeKey, junction: str) -> None:
        self._at[key] = junction
        self._crossings[key] += 1
        self._ends[end.crosswalk, end.which] = key

    def _join_chains(self, arcs: Sequence[Arc]) -> list[Chain]:
        """Join arcs that simply follow each other; the flag says gone along from start to end."""
        degree = Counter(key for arc in arcs for key in (arc.first, arc.last))
        meeting: dict[object, list[int]] = {}
        for number, arc in enumerate(arcs):
            meeting.setdefault(arc.first, []).append(number)
            meeting.setdefault(arc.last, []).append(number)
        passed = {key for key, count in degree.items() if count == 2 and key not in self._at}
        used: set[int] = set()
        chains: list[Chain] = []

        def follow(number: int, key: NodeKey) -> Chain:
            chain: Chain = []
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
                self._attach_crosswalk(_CrosswalkEnd(0.0, number, which), key, junction)
