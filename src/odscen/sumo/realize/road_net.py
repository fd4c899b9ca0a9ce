"""The SUMO network as routes see it: lanes, who may use them, and what follows what.

Made once per map from the data that the lane table keeps of the network, so that ``net.net.xml`` is
not parsed again. Ids are only ever looked up.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Sequence

PEDESTRIAN = "pedestrian"


@dataclass(frozen=True, slots=True)
class RoadNetLane:
    """One SUMO lane; metres and m/s. ``allowed`` are vehicle classes, ``None`` for all."""

    id: str
    edge: str
    index: int
    length: float
    internal: bool = False
    speed: float = 13.89
    width: float = 3.2
    allowed: frozenset[str] | None = None

    def allows(self, vclass: str) -> bool:
        """Whether a road user of this vehicle class may use the lane."""
        return self.allowed is None or vclass in self.allowed


@dataclass(frozen=True, slots=True)
class Link:
    """A connection from a lane to a lane of the next edge, through ``via`` (an internal lane)."""

    source: str
    target: str
    via: str | None = None


@dataclass(frozen=True)
class RoadNet:
    """Lanes and links of a network.

    Attributes
    ----------
    lanes
        By id.
    links
        From normal to normal lanes with their first internal lane, and from internal lanes onwards.
    walk_links
        Pairs of edges between which one can walk, either way.
    lefthand
        Whether traffic keeps left; lane 0 is then the leftmost, and SUMO mirrors vehicles'
        positions.
    ends
        Junctions that each edge comes from and goes to.
    """

    lanes: dict[str, RoadNetLane]
    links: tuple[Link, ...]
    walk_links: frozenset[tuple[str, str]] = frozenset()
    lefthand: bool = False
    ends: dict[str, tuple[str, str]] = field(default_factory=dict)
    _paths: dict[tuple[str, str, str], tuple[str, ...] | None] = field(default_factory=dict)

    @cached_property
    def edge_lanes(self) -> dict[str, tuple[RoadNetLane, ...]]:
        """Lanes of each edge, by index."""
        road_net_lanes: dict[str, list[RoadNetLane]] = {}
        for lane in self.lanes.values():
            road_net_lanes.setdefault(lane.edge, []).append(lane)
        return {
            edge: tuple(sorted(lanes, key=lambda lane: lane.index))
            for edge, lanes in road_net_lanes.items()
        }

    @cached_property
    def links_from(self) -> dict[str, tuple[Link, ...]]:
        """Links that leave each lane."""
        links_by_lane: dict[str, list[Link]] = {}
        for link in self.links:
            links_by_lane.setdefault(link.source, []).append(link)
        return {lane: tuple(links) for lane, links in links_by_lane.items()}

    @cached_property
    def links_to(self) -> dict[str, tuple[Link, ...]]:
        """Links that lead onto each lane, from internal lanes where there are such."""
        links_by_lane: dict[str, list[Link]] = {}
        for link in self.links:
            links_by_lane.setdefault(link.via or link.target, []).append(link)
        return {lane: tuple(links) for lane, links in links_by_lane.items()}

    def followers(self, edge: str, vclass: str) -> tuple[str, ...]:
        """Edges that one can drive to from ``edge``, sorted."""
        key = edge, vclass
        if key not in self._known_followers:
            self._known_followers[key] = tuple(sorted(set(self._find_followers(edge, vclass))))
        return self._known_followers[key]

    @cached_property
    def _known_followers(self) -> dict[tuple[str, str], tuple[str, ...]]:
        return {}

    def _find_followers(self, edge: str, vclass: str) -> Iterable[str]:
        for lane in self.edge_lanes.get(edge, ()):
            if not lane.allows(vclass):
                continue
            for link in self.links_from.get(lane.id, ()):
                target = self.lanes[link.target]
                if target.allows(vclass) and not target.internal:
                    yield target.edge

    def walk_neighbours(self, edge: str) -> tuple[str, ...]:
        """Edges that one can walk to from ``edge`` without using a third, sorted."""
        return self._walk_neighbours.get(edge, ())

    @cached_property
    def _walk_neighbours(self) -> dict[str, tuple[str, ...]]:
        neighbours: dict[str, set[str]] = {}
        for one, other in self.walk_links:
            neighbours.setdefault(one, set()).add(other)
            neighbours.setdefault(other, set()).add(one)
        return {edge: tuple(sorted(others)) for edge, others in neighbours.items()}

    def walked_lane(self, edge: str) -> RoadNetLane | None:
        """Return the one lane of an edge on which SUMO's pedestrians walk: the outermost."""
        lanes = self.edge_lanes.get(edge, ())
        return next((lane for lane in lanes if lane.allows(PEDESTRIAN)), None)

    def pos_lat(self, left: float) -> float:
        """SUMO's lateral position of a vehicle ``left`` metres left of the middle of its lane.

        Persons are not mirrored.
        """
        return -left if self.lefthand else left

    def left_of(self, lane: RoadNetLane, other: RoadNetLane) -> float:
        """Metres that the centre of ``lane`` lies left of that of ``other``, on the same edge."""
        low, high = sorted((lane.index, other.index))
        lanes = self.edge_lanes[lane.edge][low : high + 1]
        apart = sum(lane.width for lane in lanes) - (lanes[0].width + lanes[-1].width) / 2.0
        inwards = 1.0 if lane.index >= other.index else -1.0
        return -inwards * apart if self.lefthand else inwards * apart

    def edge_length(self, edge: str) -> float:
        """Length of an edge's lanes, metres."""
        return self.edge_lanes[edge][0].length

    def path_length(self, edges: Iterable[str]) -> float:
        """Sum of the lengths of edges, metres."""
        return sum(self.edge_length(edge) for edge in edges)

    def next_edges(self, edge: str, vclass: str) -> tuple[str, ...]:
        """Edges after ``edge``: for driving, or for walking if the class is pedestrian."""
        if vclass == PEDESTRIAN:
            return self.walk_neighbours(edge)
        return self.followers(edge, vclass)

    def path(self, source: str, target: str, vclass: str) -> tuple[str, ...] | None:
        """Edges of the shortest path from ``source`` to ``target``, both included, if there is one.

        Dijkstra's algorithm over the lengths of edges; ties go to the smaller id.
        """
        key = source, target, vclass
        if key not in self._paths:
            self._paths[key] = self._find_path(source, target, vclass)
        return self._paths[key]

    def _find_path(self, source: str, target: str, vclass: str) -> tuple[str, ...] | None:
        queue: list[tuple[float, str, str]] = [(0.0, source, "")]
        before: dict[str, str] = {}
        while queue:
            length, edge, previous = heapq.heappop(queue)
            if edge in before:
                continue
            before[edge] = previous
            if edge == target:
                break
            for follower in self.next_edges(edge, vclass):
                if follower not in before:
                    step = length + self.edge_length(follower)
                    heapq.heappush(queue, (step, follower, edge))
        if target not in before:
            return None
        path = [target]
        while path[-1] != source:
            path.append(before[path[-1]])
        return tuple(reversed(path))

    def passage(self, lane: str, next_edge: str) -> tuple[RoadNetLane, ...] | None:
        """Return the lanes after ``lane`` on the path to ``next_edge``, that edge's lane last.

        Internal lanes come first, in order; ``None`` if ``lane`` has no link to that edge.
        """
        for link in self.links_from.get(lane, ()):
            if self.lanes[link.target].edge == next_edge:
                via = link.via
                return (self.lanes[via], *self.leaving(via)) if via else (self.lanes[link.target],)
        return None

    def room_to_stop(
        self, lane: str, pos: float, edges: Sequence[str], signalled: Container[str] = ()
    ) -> float:
        """Metres within which SUMO wants a vehicle that departs to be able to stop.

        That is to the first junction at which it may have to give way, or where road only follows
        road before that, to the end of the last lane but one: SUMO looks no further.

        Parameters
        ----------
        lane, pos
            Where the vehicle is; metres along the lane.
        edges
            Normal edges of its route, that of the lane first.
        signalled
            Edges that end at a traffic light.

        Returns
        -------
        Infinite if there is no such junction before the end of the route.
        """
        room = before = self.lanes[lane].length - pos
        for here, there in pairwise(edges):
            if here in signalled or not self._is_joint(here):
                return before
            before, room = room, room + self.edge_length(there)
        return math.inf

    def _is_joint(self, edge: str) -> bool:
        """Whether no two edges at the end of an edge lead to the same one, and none to several."""
        junction = self.ends.get(edge, ("", ""))[1]
        targets = [
            self._targets_of_edges.get(other, frozenset())
            for other in self._edges_into_junctions.get(junction, ())
        ]
        return all(len(target) <= 1 for target in targets) and len(
            frozenset().union(*targets)
        ) == sum(map(len, targets))

    @cached_property
    def _edges_into_junctions(self) -> dict[str, tuple[str, ...]]:
        """Edges that lead to each junction."""
        edges_by_junction: dict[str, list[str]] = {}
        for edge, (_, junction) in self.ends.items():
            edges_by_junction.setdefault(junction, []).append(edge)
        return {junction: tuple(edges) for junction, edges in edges_by_junction.items()}

    @cached_property
    def _targets_of_edges(self) -> dict[str, frozenset[str]]:
        """Normal edges that each edge has links to."""
        found: dict[str, set[str]] = {}
        for link in self.links:
            if not self.lanes[link.target].internal:
                found.setdefault(self.lanes[link.source].edge, set()).add(
                    self.lanes[link.target].edge
                )
        return {edge: frozenset(targets) for edge, targets in found.items()}

    def leaving(self, internal: str) -> tuple[RoadNetLane, ...]:
        """Return the lanes after an internal lane, up to the normal lane that it leads to.

        Empty for a lane that leads nowhere, and for a normal lane.
        """
        passed: list[RoadNetLane] = []
        lane = self.lanes[internal]
        while lane.internal:
            onwards = self.links_from.get(lane.id, ())
            following = self.lanes[onwards[0].via or onwards[0].target] if onwards else None
            if following is None or following in passed:
                return ()
            lane = following
            passed.append(lane)
        return tuple(passed)
