"""Lanes of the network as the running SUMO has them: of which edge, who may use them, where to."""

from __future__ import annotations

from collections import defaultdict
from functools import cached_property
from typing import TYPE_CHECKING, Any

from odscen.sumo.worker.detours import LaneLink

if TYPE_CHECKING:
    from collections.abc import Iterator

_CLASSES = ("passenger", "delivery", "truck", "bus", "motorcycle", "bicycle")
"""SUMO's classes of our categories of vehicles."""


class RoadLanes:
    """What never changes in a run, asked once."""

    def __init__(self, sumo: Any) -> None:
        self._sumo = sumo

    @cached_property
    def of_edge(self) -> dict[str, list[str]]:
        """Lanes of each edge, as SUMO lists them."""
        edge_of, lanes = self._sumo.lane.getEdgeID, defaultdict(list)
        for name in self._sumo.lane.getIDList():
            lanes[edge_of(name)].append(name)
        return dict(lanes)

    def in_order(self, edge: str) -> list[str]:
        """Lanes of an edge from the outermost on; SUMO numbers them so."""
        return sorted(self.of_edge[edge], key=lambda lane: (len(lane), lane))

    @cached_property
    def internal(self) -> frozenset[str]:
        """Lanes for vehicles inside junctions: those that connections lead over."""
        return frozenset(link[4] for links in self.links_of.values() for link in links if link[4])

    @cached_property
    def links_of(self) -> dict[str, tuple[Any, ...]]:
        """Connections from each lane, as SUMO gives them; with their states at the begin."""
        lane = self._sumo.lane
        return {name: lane.getLinks(name) for name in lane.getIDList()}

    def admits(self, lane: str, kind: str) -> bool:
        """Whether vehicles of a class of SUMO's may use a lane."""
        allowed = self._sumo.lane.getAllowed(lane)
        return not allowed or kind in allowed

    def ahead(self, vehicle: str, lane: str) -> Iterator[str]:
        """Lanes that a vehicle on a lane comes to on its route, those inside junctions too."""
        of, edge_of = self._sumo.vehicle, self._sumo.lane.getEdgeID
        edges: Iterator[str] | None = None
        while True:
            links = self.links_of[lane]
            if lane not in self.internal:
                if edges is None:
                    edges = iter(of.getRoute(vehicle)[max(0, of.getRouteIndex(vehicle)) + 1 :])
                onto = next(edges, None)
                links = tuple(link for link in links if edge_of(link[0]) == onto)
            if not links:
                return
            lane = links[0][4] or links[0][0]
            yield lane

    def onwards(self, lane: str, kind: str) -> list[tuple[str, str]]:
        """Lanes that a lane leads to and vehicles of a class may enter now, with their edges."""
        own = self._sumo.lane
        return [
            (link[0], own.getEdgeID(link[0]))
            for link in own.getLinks(lane)
            if all(self._admits_now(part, kind) for part in (link[4], link[0]) if part)
        ]

    def _admits_now(self, lane: str, kind: str) -> bool:
        # SUMO lists none as allowed where all are, and where none is.
        allowed = self._sumo.lane.getAllowed(lane)
        return kind in allowed if allowed else kind not in self._sumo.lane.getDisallowed(lane)

    def lengths(self) -> dict[str, dict[str, float]]:
        """Lanes that vehicles may use, by edge, and their lengths in metres; junctions as well."""
        lane = self._sumo.lane
        on_foot = ("pedestrian",)
        lengths = {
            edge: {
                name: lane.getLength(name)
                for name in lanes
                if tuple(lane.getAllowed(name)) != on_foot
            }
            for edge, lanes in self.of_edge.items()
        }
        return {edge: own for edge, own in lengths.items() if own}

    def links(self) -> list[LaneLink]:
        """Return ways from edge to edge for vehicles, with the time that they take in free flow."""
        lane, everyone = self._sumo.lane, frozenset(_CLASSES)
        allowed = {
            name: frozenset(lane.getAllowed(name)) or everyone - {*lane.getDisallowed(name)}
            for name in lane.getIDList()
        }
        links = []
        for edge, own in self.of_edge.items():
            for name in own:
                if name in self.internal:
                    continue
                for link in lane.getLinks(name):
                    passed = [part for part in (link[4], link[0]) if part]
                    who = allowed[name].intersection(*(allowed[part] for part in passed))
                    time = sum(lane.getLength(part) / lane.getMaxSpeed(part) for part in passed)
                    links.append(LaneLink(edge, lane.getEdgeID(link[0]), time, who))
        return links
