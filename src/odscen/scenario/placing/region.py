"""A region of interest on its map graph: what is inside, what names mean, what can be used."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple, TypeVar, cast

import numpy as np

from odscen.base.categories import DEFAULT_BODY, Category
from odscen.base.errors import NotFoundError
from odscen.base.ids import NodeId, SegmentId
from odscen.lanegraph.query import (
    induced,
    is_connected,
    is_walk_node_id,
    node_id,
    node_index,
    walk_node_id,
    walk_node_index,
)
from odscen.lanegraph.shortest_paths import Router, WalkRouter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from odscen.base.arrays import BoolArray, Int32Array
    from odscen.base.categories import Body
    from odscen.lanegraph.graphs import LaneGraph, MapGraph, PedestrianGraph


_Found = TypeVar("_Found")


@dataclass(frozen=True, slots=True)
class Usable:
    """What a simulator can use of a map; ``None`` stands for everything.

    Attributes
    ----------
    spawnable
        Shape ``(N,)``: lane-graph nodes on which a vehicle can be placed exactly.
    drivable
        Shape ``(N,)``: lane-graph nodes that a path can lead over.
    walkable
        Shape ``(P,)``: pedestrian nodes on which a walker can be placed, and arrive.
    in_junction
        Shape ``(N,)``: lane-graph nodes inside the simulator's junctions, on the way to a crosswalk
        before them for example. ``None``: those of the map's junctions.
    bodies
        Size of each category.
    barred
        For categories that may not use all that is spawnable, the nodes that they may not, shape
        ``(N,)``: a truck on a lane that denies trucks.
    """

    spawnable: BoolArray | None = None
    drivable: BoolArray | None = None
    walkable: BoolArray | None = None
    in_junction: BoolArray | None = None
    bodies: Mapping[Category, Body] = field(default_factory=lambda: DEFAULT_BODY)
    barred: Mapping[Category, BoolArray] = field(default_factory=dict)


class NodePlace(NamedTuple):
    """A node by its index; ``walk`` says whether it is one of the pedestrian graph."""

    walk: bool
    node: int


_MOST = 200_000
"""Pairs of places that a region remembers; then it begins anew."""


class _PathsInside:
    """What is known of the ways inside a set of segments, in whatever order they are named."""

    def __init__(
        self,
        graph: MapGraph,
        segments: frozenset[SegmentId],
        lanes: BoolArray,
        walks: BoolArray,
    ) -> None:
        self.graph, self.segments, self.lanes, self.walks = graph, segments, lanes, walks
        self.leads: dict[tuple[NodePlace, NodePlace], bool] = {}
        self.candidates: dict[tuple[NodePlace, NodePlace], bool] = {}
        self.places: dict[str, NodePlace | None] = {}
        self.remembered: dict[str, object] = {}
        self._over: tuple[BoolArray, Router] | None = None

    @cached_property
    def is_whole(self) -> bool:
        return len(self.segments) < 2 or is_connected(self.graph.segments, sorted(self.segments))

    @cached_property
    def router(self) -> Router:
        return Router(self.graph, self.lanes)

    @cached_property
    def walk_router(self) -> WalkRouter:
        return WalkRouter(self.graph, self.walks)

    def over(self, mask: BoolArray) -> Router:
        known = self._over  # other threads may ask for theirs
        if known is None or known[0] is not mask:
            known = self._over = (mask, Router(self.graph, self.lanes & mask))
        return known[1]


@dataclass(frozen=True)
class Region:
    """The segments of a scenario that the map has, and their nodes.

    Attributes
    ----------
    graph
        The whole map.
    segments
        Ids of the segments inside; unknown ones have been left out.
    lanes, walks
        Masks over the nodes of the lane graph and of the pedestrian graph.
    """

    graph: MapGraph
    segments: tuple[SegmentId, ...]
    lanes: BoolArray
    walks: BoolArray
    _ways: _PathsInside = field(repr=False, compare=False)

    @classmethod
    def of(cls, graph: MapGraph, segments: Iterable[str]) -> Region:
        """The region of these segments; names that the map does not have are left out."""
        return _shared_region(graph, tuple(segments))

    @property
    def router(self) -> Router:
        """Paths on the lane graph inside the region."""
        return self._ways.router

    @property
    def walk_router(self) -> WalkRouter:
        """Paths on the pedestrian graph inside the region."""
        return self._ways.walk_router

    def remembered(self, name: str, find: Callable[[], _Found]) -> _Found:
        """What other modules find of a region, by a name of theirs; found at the first call."""
        known = self._ways.remembered
        if name not in known:
            known[name] = find()
        return cast("_Found", known[name])

    def router_over(self, mask: BoolArray) -> Router:
        """Paths inside the region over the nodes of a mask, shape ``(N,)``; the last is kept."""
        return self._ways.over(mask)

    @property
    def is_whole(self) -> bool:
        """Whether its segments, if there are any, are in one piece."""
        return self._ways.is_whole

    def place(self, node: str) -> NodePlace | None:
        """Where a node id leads on the map, inside the region or not; ``None`` if nowhere."""
        known = self._ways.places
        if node not in known:
            if len(known) > _MOST:
                known.clear()
            known[node] = place_of(self.graph, node)
        return known[node]

    def holds(self, place: NodePlace) -> bool:
        """Whether a place is inside the region."""
        return bool((self.walks if place.walk else self.lanes)[place.node])

    def nodes_of(self, place: NodePlace) -> LaneGraph | PedestrianGraph:
        """Return the graph that a place is on."""
        return self.graph.walks if place.walk else self.graph.lanes

    def router_of(self, place: NodePlace) -> Router | WalkRouter:
        """Return the paths on the graph that a place is on."""
        return self.walk_router if place.walk else self.router

    def candidates(self, spawn: NodePlace) -> Int32Array:
        """Goal candidates of a spawn (R38), as indices of nodes of the same graph."""
        return self.router_of(spawn).goal_candidates(spawn.node)

    def is_candidate(self, spawn: NodePlace, goal: NodePlace) -> bool:
        """Whether a goal that a path leads to is among the candidates of a spawn."""
        known = self._ways.candidates.get((spawn, goal))
        if known is None:
            known = self.router_of(spawn).is_candidate(spawn.node, goal.node)
            self._ways.candidates[spawn, goal] = known
        return known

    def leads(self, spawn: NodePlace, goal: NodePlace) -> bool:
        """Whether a path inside the region leads from ``spawn`` on to ``goal``."""
        if spawn.walk != goal.walk or spawn == goal or not self.holds(goal):
            return False
        leads = self._ways.leads
        known = leads.get((spawn, goal))
        if known is None:
            if len(leads) > _MOST:
                leads.clear()
            known = bool(self.router_of(spawn).reachable(spawn.node)[goal.node])
            leads[spawn, goal] = known
        return known

    def path_over(self, nodes: Sequence[int], *, walk: bool) -> Int32Array:
        """Nodes of the path from node to node, each leg the shortest; empty if there is none."""
        router = self.walk_router if walk else self.router
        found = [router.path(here, there) for here, there in pairwise(nodes)]
        if not all(len(array) for array in found):
            return np.empty(0, dtype=np.int32)
        return np.concatenate([found[0], *(array[1:] for array in found[1:])])

    def look_up(self, pairs: Iterable[tuple[str, str | None]]) -> None:
        """Find what :meth:`leads` and :meth:`is_candidate` say of many spawns and goals at once."""
        places = {(self.place(spawn), self.place(goal)) for spawn, goal in pairs if goal}
        if len(self._ways.leads) > _MOST:
            self._ways.leads.clear()
        for router, walk in ((self.router, False), (self.walk_router, True)):
            asked = [
                (spawn, goal)
                for spawn, goal in places
                if spawn and goal and spawn.walk == goal.walk == walk
                if (spawn, goal) not in self._ways.leads
                if self.holds(spawn) and self.holds(goal)
            ]
            if asked:
                nodes = np.array([(spawn.node, goal.node) for spawn, goal in asked])
                found = router.leads(nodes[:, 0], nodes[:, 1]).tolist()
                self._ways.leads.update(zip(asked, found, strict=True))
                led = [
                    pair
                    for pair, leads in zip(asked, found, strict=True)
                    if leads and pair not in self._ways.candidates
                ]
                spawns, goals = ([pair[side].node for pair in led] for side in (0, 1))
                are = router.are_candidates(spawns, goals)
                self._ways.candidates.update(zip(led, are, strict=True))

    def segment_of(self, place: NodePlace) -> SegmentId:
        """Return the segment that a place lies in."""
        return self.graph.segments.ids[int(self.nodes_of(place).segment[place.node])]


@lru_cache(maxsize=4)
def _shared_region(graph: MapGraph, segments: tuple[str, ...]) -> Region:
    """One region for all scenarios of a batch that have it, with what is known of its paths."""
    known = set(graph.segments.ids)
    inside = tuple(SegmentId(name) for name in dict.fromkeys(segments) if name in known)
    ways = _ways(graph, frozenset(inside))
    return Region(graph, inside, ways.lanes, ways.walks, ways)


@lru_cache(maxsize=16)
def _ways(graph: MapGraph, segments: frozenset[SegmentId]) -> _PathsInside:
    """One for all regions of a batch with these segments."""
    roi = induced(graph, sorted(segments))
    return _PathsInside(graph, segments, roi.nodes, roi.walk_nodes)


def place_of(graph: MapGraph, node: str) -> NodePlace | None:
    """Where a node id leads; ``None`` if the map has no such node."""
    walk = is_walk_node_id(node)
    try:
        row = (walk_node_index if walk else node_index)(graph, node)
    except NotFoundError:
        return None
    return NodePlace(walk, row)


def turns_round(path: Int32Array) -> int | None:
    """Node at which a path goes back the way it came; ``None`` if there is none."""
    turns = np.flatnonzero(path[2:] == path[:-2])
    return int(path[turns[0] + 1]) if len(turns) else None


def on_foot(category: Category) -> bool:
    """Whether a category belongs on the pedestrian graph."""
    return category is Category.PEDESTRIAN


def name_of(graph: MapGraph, place: NodePlace) -> NodeId:
    """Id of a node; the inverse of :func:`place_of`."""
    return (walk_node_id if place.walk else node_id)(graph, place.node)
