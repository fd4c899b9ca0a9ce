"""Where measures are on the lane graph: the nodes of a segment, of a lane, or of a turn."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.lanegraph.graphs import Relation
from odscen.scenario.demand.zones import PLACE_SEPARATOR, place_segments

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, Int32Array
    from odscen.lanegraph.graphs import MapGraph


class MeasurePlace(NamedTuple):
    """Nodes that a name stands for; of a turn those inside the junction.

    Attributes
    ----------
    nodes
        Mask over the nodes of the lane graph, shape ``(N,)``.
    turn
        Whether it is a turn; ``source`` and ``target`` are then masks of the segments before and
        behind, else empty.
    """

    nodes: BoolArray
    turn: bool
    source: BoolArray
    target: BoolArray


class UnknownPlace(NamedTuple):
    """Why a name stands for nothing, and the segments that it names all the same."""

    code: str
    message: str
    segments: tuple[str, ...] = ()


class PlaceNames:
    """Finds places on one map."""

    def __init__(self, graph: MapGraph) -> None:
        self._graph = graph
        self._segments = {str(name): row for row, name in enumerate(graph.segments.ids)}
        self._lanes = {str(key): row for row, key in enumerate(graph.lanes.lanes.keys)}
        follows = graph.lanes.relation == Relation.SUCCESSOR
        self._source: Int32Array = graph.lanes.source[follows]
        self._target: Int32Array = graph.lanes.target[follows]

    def find(self, name: str) -> MeasurePlace | UnknownPlace:
        """Find the nodes of a segment, lane or turn."""
        if PLACE_SEPARATOR in name:
            return self._turn(name)
        lanes = self._graph.lanes
        none = np.zeros(len(lanes.x), dtype=np.bool_)
        if name in self._segments:
            return MeasurePlace(lanes.segment == self._segments[name], False, none, none)
        if name in self._lanes:
            return MeasurePlace(lanes.lane == self._lanes[name], False, none, none)
        message = f"{name!r} is neither a segment nor a lane of the map, nor a turn like r1>r2"
        return UnknownPlace("unknown_place", message)

    def lane_nodes(self, name: str) -> Int32Array | None:
        """Nodes of a lane in the order of the graph; ``None`` if the map has no such lane."""
        if name not in self._lanes:
            return None
        found: Int32Array = np.flatnonzero(self._graph.lanes.lane == self._lanes[name]).astype(
            np.int32
        )
        return found

    def _turn(self, name: str) -> MeasurePlace | UnknownPlace:
        segments = place_segments(name)
        unknown = tuple(one for one in segments if one not in self._segments)
        if unknown:
            message = f"place {name!r} has segment {unknown[0]!r}, which the map does not have"
            return UnknownPlace("unknown_segment", message, unknown)
        own = self._graph.lanes.segment
        masks = [own == self._segments[one] for one in segments]
        junctions = [self._graph.segments.kinds[self._segments[one]] for one in segments]
        if junctions[0] == "junction" or junctions[-1] == "junction":
            message = f"turn {name!r} has to begin and end with a road"
            return UnknownPlace("place_broken", message, segments)
        inside = self._inside(masks)
        if inside is None:
            message = f"place {name!r}: no lane leads from {segments[0]!r} into {segments[-1]!r}"
            return UnknownPlace("place_broken", message, segments)
        return MeasurePlace(inside, True, masks[0], masks[-1])

    def _inside(self, masks: list[BoolArray]) -> BoolArray | None:
        """Nodes between the first segment and the last; ``None`` if nothing leads there."""
        kinds = np.array([kind == "junction" for kind in self._graph.segments.kinds])
        junction: BoolArray = kinds[self._graph.lanes.segment]
        between = junction if len(masks) == 2 else np.logical_or.reduce(masks[1:-1])
        ahead = self._spread(masks[0], between, self._source, self._target)
        behind = self._spread(masks[-1], between, self._target, self._source)
        found: BoolArray = ahead & behind
        direct = bool((masks[0][self._source] & masks[-1][self._target]).any())
        passed = all(bool(found[mask].any()) for mask in masks[1:-1])
        return found if passed and (found.any() or direct) else None

    def _spread(
        self, start: BoolArray, inside: BoolArray, source: Int32Array, target: Int32Array
    ) -> BoolArray:
        """Nodes of ``inside`` that are reached from ``start`` without leaving it."""
        reached = np.zeros(len(start), dtype=np.bool_)
        reached[target[start[source] & inside[target]]] = True
        while True:
            more = reached[source] & inside[target] & ~reached[target]
            if not more.any():
                return reached
            reached[target[more]] = True
