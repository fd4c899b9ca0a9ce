"""A region of interest on its map graph: what is inside, and what the names in a document mean."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.categories import Category
from odscen.base.errors import NotFoundError
from odscen.base.ids import NodeId, SegmentId
from odscen.lanegraph.query import (
    induced,
    is_walk_node_id,
    node_id,
    node_index,
    walk_node_id,
    walk_node_index,
)
from odscen.lanegraph.shortest_paths import Router, WalkRouter

if TYPE_CHECKING:
    from collections.abc import Iterable

    from odscen.base.arrays import BoolArray, Int32Array
    from odscen.lanegraph.graphs import LaneGraph, MapGraph, PedestrianGraph


class NodePlace(NamedTuple):
    """A node by its index; ``walk`` says whether it is one of the pedestrian graph."""

    walk: bool
    node: int


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

    @classmethod
    def of(cls, graph: MapGraph, segments: Iterable[str]) -> Region:
        """Make the region of these segments; names that the map does not have are left out."""
        known = set(graph.segments.ids)
        inside = tuple(SegmentId(name) for name in dict.fromkeys(segments) if name in known)
        roi = induced(graph, inside)
        return cls(graph, inside, roi.nodes, roi.walk_nodes)

    @cached_property
    def router(self) -> Router:
        """Paths on the lane graph inside the region."""
        return Router(self.graph, self.lanes)

    @cached_property
    def walk_router(self) -> WalkRouter:
        """Paths on the pedestrian graph inside the region."""
        return WalkRouter(self.graph, self.walks)

    def place(self, node: str) -> NodePlace | None:
        """Where a node id leads on the map, inside the region or not; ``None`` if nowhere."""
        return place_of(self.graph, node)

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
        known = self._candidates.get((spawn, goal))
        if known is None:
            known = self.router_of(spawn).is_candidate(spawn.node, goal.node)
            self._candidates[spawn, goal] = known
        return known

    def leads(self, spawn: NodePlace, goal: NodePlace) -> bool:
        """Whether a path inside the region leads from ``spawn`` on to ``goal``."""
        if spawn.walk != goal.walk or spawn == goal or not self.holds(goal):
            return False
        known = self._leads.get((spawn, goal))
        if known is None:
            known = bool(self.router_of(spawn).reachable(spawn.node)[goal.node])
        return known

    def look_up(self, pairs: Iterable[tuple[str, str | None]]) -> None:
        """Find the paths between many spawns and goals at once, for :meth:`leads` to remember."""
        places = {(self.place(spawn), self.place(goal)) for spawn, goal in pairs if goal}
        for router, walk in ((self.router, False), (self.walk_router, True)):
            asked = [
                (spawn, goal)
                for spawn, goal in places - self._leads.keys()
                if spawn and goal and spawn.walk == goal.walk == walk
                if self.holds(spawn) and self.holds(goal)
            ]
            if asked:
                nodes = np.array([(spawn.node, goal.node) for spawn, goal in asked])
                found = router.leads(nodes[:, 0], nodes[:, 1]).tolist()
                self._leads.update(zip(asked, found, strict=True))

    @cached_property
    def _leads(self) -> dict[tuple[NodePlace, NodePlace], bool]:
        return {}

    @cached_property
    def _candidates(self) -> dict[tuple[NodePlace, NodePlace], bool]:
        return {}

    def segment_of(self, place: NodePlace) -> SegmentId:
        """Return the segment that a place lies in."""
        return self.graph.segments.ids[int(self.nodes_of(place).segment[place.node])]


def place_of(graph: MapGraph, node: str) -> NodePlace | None:
    """Where a node id leads; ``None`` if the map has no such node."""
    walk = is_walk_node_id(node)
    try:
        row = (walk_node_index if walk else node_index)(graph, node)
    except NotFoundError:
        return None
    return NodePlace(walk, row)


def on_foot(category: Category) -> bool:
    """Whether a category belongs on the pedestrian graph."""
    return category is Category.PEDESTRIAN


def name_of(graph: MapGraph, place: NodePlace) -> NodeId:
    """Id of a node; the inverse of :func:`place_of`."""
    return (walk_node_id if place.walk else node_id)(graph, place.node)
