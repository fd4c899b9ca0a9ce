"""Pedestrians who cross anywhere: where each leaves its walk to a crosswalk and walks across.

A road is crossed from one of its sidewalks straight to the other: between two lanes of one
cross-section of an OpenDRIVE road there is nothing but lanes of that road.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from odscen.lanegraph.graphs import WalkKind
from odscen.lanegraph.query import walk_node_id
from odscen.scenario.document.rules_document import StoryRule

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, Int32Array
    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.placing.region import Region
    from odscen.sumo.realize.sumo_map import SumoMap

WIDEST = 30.0
"""Metres from sidewalk to sidewalk, at most."""
DETOUR = 10.0
"""Metres that a crossing has to save where the walk uses no crosswalk."""
_NO_LONGER = 1.0
"""Metres that make no difference."""
_ABEAM = 1.0
"""Metres along the sidewalk within which a crossing begins."""
_BESIDE = 2.0
"""Metres that a pedestrian may be beside its sidewalk."""
_MOST = 20
"""Roads that one walk crosses."""


class WalkAcross(NamedTuple):
    """A walk that leaves the sidewalks: ``path`` from spawn to goal, and where it is straight.

    Each of ``crossings`` leads from a node to one on the other side, which follows it in the path.
    """

    path: Int32Array
    crossings: tuple[tuple[int, int], ...]

    def rules(self, graph: MapGraph, actor: str, taken: set[str]) -> list[StoryRule]:
        """Rules by which an actor walks so; ``taken`` are ids of others, and of these then."""
        rules: list[StoryRule] = []
        for start, end in self.crossings:
            name = f"{actor[:48]}.crosses{len(rules) + 1 if rules else ''}"
            while name in taken:
                name += "_"
            taken.add(name)
            width, place = float(graph.walks.width[start]), walk_node_id(graph, start)
            when = (
                _condition_at_place(place, width)
                if rules or start != self.path[0]
                else {"appeared": {}}
            )
            if rules:
                when = {"all": [{"rule": {"id": rules[-1].id}}, when]}
            then = [{"walk": {"to": walk_node_id(graph, end)}}]
            data = {"id": name, "actor": actor, "when": when, "then": then}
            rules.append(StoryRule.model_validate(data))
        return rules


def _condition_at_place(place: str, width: float) -> dict[str, Any]:
    near = {"reaches": {"place": place, "within": width / 2.0 + _BESIDE}}
    abeam = {"place": place, "along": "longitudinal", "below": _ABEAM, "free": False}
    return {"all": [near, {"distance": abeam}]}


class RoadsAcross:
    """The roads of a region that can be crossed, asked for one walk after the other.

    Parameters
    ----------
    usable
        Pedestrian nodes on which SUMO's pedestrians walk, shape ``(P,)``.
    """

    def __init__(self, sumo_map: SumoMap, region: Region, usable: BoolArray) -> None:
        self._graph = sumo_map.graph
        self._router = region.walk_router
        self._edges = [sumo_map.net.lanes[name].edge for name in sumo_map.walk_places.lanes]
        self._edge_row = sumo_map.walk_places.lane
        self._opposite = self._nodes_across(usable & region.walks)
        walks = self._graph.walks
        on = walks.kind == WalkKind.CROSSWALK
        pairs = np.stack([walks.source[on], walks.target[on]], axis=1)
        self._crosswalks = {frozenset(pair) for pair in pairs.tolist()}

    def cross(self, path: Int32Array, *, after: int | None = None) -> WalkAcross:
        """Leave a walk where a straight crossing is no longer, as often as there is one.

        Parameters
        ----------
        path
            Pedestrian nodes from spawn to goal.
        after
            Node of the path up to which it has to be kept.
        """
        kept = 0 if after is None else int(np.flatnonzero(path == after)[-1])
        before: list[int] = path[:kept].tolist()
        crossings: list[tuple[int, int]] = []
        rest = path[kept:]
        while len(crossings) < _MOST and (found := self._first_crossing(rest)) is not None:
            place, end = found
            crossings.append((int(rest[place]), end))
            before += rest[: place + 1].tolist()
            rest = self._router.path(end, int(path[-1]))
        return WalkAcross(np.array([*before, *rest.tolist()], dtype=np.int32), tuple(crossings))

    def _first_crossing(self, path: Int32Array) -> tuple[int, int] | None:
        """Place in a path from which it crosses a road first, and the node on the other side.

        That with the shortest walk in all, and of those that are as good the first.
        """
        walks = self._graph.walks
        ends = self._opposite[path]
        if not (ends >= 0).any():
            return None
        here = np.hypot(np.diff(walks.x[path]), np.diff(walks.y[path]))
        along = np.concatenate([[0.0], np.cumsum(here)])
        across = np.hypot(walks.x[ends] - walks.x[path], walks.y[ends] - walks.y[path])
        onward = self._router.distances(int(path[-1]))[ends]
        total = np.where(ends >= 0, along + across + onward, np.inf)
        marked = any(frozenset(pair) in self._crosswalks for pair in pairwise(path.tolist()))
        most = along[-1] + (_NO_LONGER if marked else -DETOUR)
        fits = total <= min(float(total.min()) + _NO_LONGER, most)
        if not fits.any():
            return None
        place = int(np.argmax(fits))
        return place, int(ends[place])

    def _nodes_across(self, usable: BoolArray) -> Int32Array:
        """Node on the other side of the road of each node, or -1; shape ``(P,)``."""
        walks = self._graph.walks
        roads = np.array([kind == "road" for kind in self._graph.segments.kinds], dtype=np.bool_)
        fits = usable & ~walks.roadside[walks.lane] & roads[walks.segment]
        sides: dict[tuple[str, int], dict[bool, list[int]]] = {}
        for row, key in enumerate(walks.lane_keys):
            nodes = range(int(walks.first_node[row]), int(walks.first_node[row + 1]))
            both = sides.setdefault((key.road, key.section), {True: [], False: []})
            both[key.lane > 0] += [node for node in nodes if fits[node]]
        found = np.full(len(walks.x), -1, dtype=np.int32)
        for both in sides.values():
            for left in (True, False):
                self._match_sides(np.array(both[left], int), np.array(both[not left], int), found)
        return found

    def _match_sides(self, own: Int32Array, others: Int32Array, found: Int32Array) -> None:
        if not len(own) or not len(others):
            return
        walks = self._graph.walks
        order = np.argsort(walks.s[others], kind="stable")
        s = walks.s[others][order]
        after = np.clip(np.searchsorted(s, walks.s[own]), 0, len(s) - 1)
        before = np.maximum(after - 1, 0)
        nearer = np.abs(s[before] - walks.s[own]) < np.abs(s[after] - walks.s[own])
        ends = others[order][np.where(nearer, before, after)]
        wide = np.hypot(walks.x[ends] - walks.x[own], walks.y[ends] - walks.y[own])
        fits = (np.abs(walks.s[ends] - walks.s[own]) <= walks.spacing) & (wide <= WIDEST)
        names = np.array(self._edges)
        fits &= names[self._edge_row[ends]] != names[self._edge_row[own]]
        found[own[fits]] = ends[fits]
