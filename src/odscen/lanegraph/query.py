"""Ids of nodes, and what belongs to a set of segments.

The graphs are arrays over dense integers; this module is the only place that turns those into the
string ids of :mod:`odscen.base.ids` and back (R24), and that knows which sets of segments are
regions of interest (requirements R29 and R31).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from odscen.base.errors import InputError, NotFoundError
from odscen.base.ids import LaneKey, NodeId, RoadId, SegmentId

if TYPE_CHECKING:
    from collections.abc import Iterable

    import networkx as nx

    from odscen.base.arrays import BoolArray, Int32Array
    from odscen.lanegraph.graphs import MapGraph, Segments

WALK_PREFIX = "ped."


@dataclass(frozen=True, slots=True, eq=False)
class Roi:
    """What a region of interest takes from the three graphs (induced subgraph, requirement R31).

    Attributes
    ----------
    segments
        The members, in the map's order.
    rows
        Their rows of :class:`~odscen.lanegraph.graphs.Segments`, ascending.
    nodes, edges
        Shapes ``(N,)`` and ``(E,)``: lane-graph nodes inside, and edges with both ends inside.
    walk_nodes, walk_edges
        Shapes ``(P,)`` and ``(Q,)``: the same of the pedestrian graph.
    """

    segments: tuple[SegmentId, ...]
    rows: Int32Array
    nodes: BoolArray
    edges: BoolArray
    walk_nodes: BoolArray
    walk_edges: BoolArray


def node_id(graph: MapGraph, i: int) -> NodeId:
    """Id ``road.section.lane.k`` of lane-graph node ``i``; k counts in driving direction."""
    lanes = graph.lanes.lanes
    row = int(graph.lanes.lane[i])
    return NodeId(f"{lanes.keys[row]}.{i - int(lanes.first_node[row])}")


def node_ids(graph: MapGraph) -> list[NodeId]:
    """Ids of all lane-graph nodes, in their order."""
    return _make_node_ids(graph.lanes.lanes.keys, graph.lanes.lanes.first_node, "")


def node_index(graph: MapGraph, name: str) -> int:
    """Index of the lane-graph node ``name``.

    Raises
    ------
    NotFoundError
        If the map has no such node.
    """
    lanes = graph.lanes.lanes
    return _index_on_lane(name, name, lanes.keys, lanes.first_node)


class NearestNode(NamedTuple):
    """The lane-graph node nearest to a place.

    Attributes
    ----------
    id
        As spawns and goals name it.
    x, y, z
        Where it is, metres in the OpenDRIVE frame.
    hdg
        Driving direction there, rad counter-clockwise from x.
    distance
        From the place, metres in the plane.
    """

    id: NodeId
    x: float
    y: float
    z: float
    hdg: float
    distance: float


HEADING_TOLERANCE = math.pi / 4
"""A lane whose direction differs by more is another one: it crosses, or is the opposite one."""


def nearest_node(graph: MapGraph, x: float, y: float, hdg: float | None = None) -> NearestNode:
    """Find the lane-graph node nearest to a place; of those as near the first.

    Parameters
    ----------
    x, y
        Metres in the OpenDRIVE frame.
    hdg
        Direction of driving, rad counter-clockwise from x: only nodes within 45 degrees of it.

    Raises
    ------
    InputError
        If a number is not finite, or the map has no lane in that direction.
    """
    lanes = graph.lanes
    if not all(map(math.isfinite, (x, y, 0.0 if hdg is None else hdg))):
        raise InputError(f"a place is of finite numbers, not ({x}, {y}, {hdg})")
    squares = (lanes.x - x) ** 2 + (lanes.y - y) ** 2
    if hdg is not None:
        turn = np.abs(np.remainder(lanes.hdg - hdg + np.pi, 2.0 * np.pi) - np.pi)
        squares = np.where(turn <= HEADING_TOLERANCE, squares, np.inf)
    if not np.isfinite(squares).any():
        raise InputError(f"map {graph.map_name!r} has no lane in the direction of {hdg:g} rad")
    row = int(np.argmin(squares))
    at = (float(lanes.x[row]), float(lanes.y[row]), float(lanes.z[row]), float(lanes.hdg[row]))
    return NearestNode(node_id(graph, row), *at, math.sqrt(float(squares[row])))


def walk_node_id(graph: MapGraph, i: int) -> NodeId:
    """Id ``ped.road.section.lane.k`` of pedestrian node ``i``; k counts with growing s."""
    walks = graph.walks
    row = int(walks.lane[i])
    return NodeId(f"{WALK_PREFIX}{walks.lane_keys[row]}.{i - int(walks.first_node[row])}")


def walk_node_ids(graph: MapGraph) -> list[NodeId]:
    """Ids of all pedestrian nodes, in their order."""
    return _make_node_ids(graph.walks.lane_keys, graph.walks.first_node, WALK_PREFIX)


def walk_node_index(graph: MapGraph, name: str) -> int:
    """Index of the pedestrian node ``name``.

    Raises
    ------
    NotFoundError
        If the map has no such node.
    """
    if not name.startswith(WALK_PREFIX):
        raise NotFoundError("pedestrian node", name, [])
    bare = name.removeprefix(WALK_PREFIX)
    return _index_on_lane(name, bare, graph.walks.lane_keys, graph.walks.first_node)


def is_walk_node_id(name: str) -> bool:
    """Whether ``name`` is written like the id of a pedestrian node."""
    return name.startswith(WALK_PREFIX)


def segment_of_node(graph: MapGraph, name: str) -> SegmentId:
    """Segment that a node of the lane graph or of the pedestrian graph lies in.

    Raises
    ------
    NotFoundError
        If the map has no such node.
    """
    if is_walk_node_id(name):
        row = graph.walks.segment[walk_node_index(graph, name)]
    else:
        row = graph.lanes.segment[node_index(graph, name)]
    return graph.segments.ids[int(row)]


def segment_rows(segments: Segments, ids: Iterable[str]) -> Int32Array:
    """Rows of the segments ``ids``, ascending and without repetitions.

    Raises
    ------
    NotFoundError
        If the map has no such segment.
    """
    known = _segment_index(segments)
    rows: set[int] = set()
    for name in ids:
        row = known.get(name)
        if row is None:
            raise NotFoundError("segment", name, segments.ids)
        rows.add(row)
    return np.array(sorted(rows), dtype=np.int32)


def induced(graph: MapGraph, segments: Iterable[str]) -> Roi:
    """Nodes and edges of the region made of ``segments``.

    Raises
    ------
    NotFoundError
        If the map has no such segment.
    """
    rows = segment_rows(graph.segments, segments)
    inside = np.zeros(len(graph.segments.ids), dtype=np.bool_)
    inside[rows] = True
    nodes = inside[graph.lanes.segment]
    walks = inside[graph.walks.segment]
    return Roi(
        segments=tuple(graph.segments.ids[row] for row in rows),
        rows=rows,
        nodes=nodes,
        edges=nodes[graph.lanes.source] & nodes[graph.lanes.target],
        walk_nodes=walks,
        walk_edges=walks[graph.walks.source] & walks[graph.walks.target],
    )


def neighbours(segments: Segments, ids: Iterable[str]) -> tuple[SegmentId, ...]:
    """Segments beside any of ``ids`` that are not among them: what may be added (R29).

    Raises
    ------
    NotFoundError
        If the map has no such segment.
    """
    inside = np.zeros(len(segments.ids), dtype=np.bool_)
    inside[segment_rows(segments, ids)] = True
    one, other = segments.adjacency[:, 0], segments.adjacency[:, 1]
    beside = np.union1d(one[inside[other] & ~inside[one]], other[inside[one] & ~inside[other]])
    return tuple(segments.ids[row] for row in beside)


def is_connected(segments: Segments, ids: Iterable[str]) -> bool:
    """Whether one can go from each of ``ids`` to each other through members only (R29).

    The empty set counts as not connected: it is no region.

    Raises
    ------
    NotFoundError
        If the map has no such segment.
    """
    # Without networkx, which takes longer to import than a short run: every run asks this.
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    rows = segment_rows(segments, ids)
    place = np.full(len(segments.ids), -1)
    place[rows] = np.arange(len(rows))
    pairs = place[segments.adjacency]
    pairs = pairs[(pairs >= 0).all(axis=1)]
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(rows),) * 2)
    return len(rows) > 0 and connected_components(graph, directed=False)[0] == 1


def largest_part(segments: Segments) -> tuple[SegmentId, ...]:
    """Segments of the largest connected part of a map, in the order of the map."""
    parts = _connected_parts(segments)
    largest: set[int] = max(parts, key=lambda part: (len(part), -min(part)), default=set())
    return tuple(segments.ids[row] for row in sorted(largest))


def parts_with(segments: Segments, ids: Iterable[str]) -> tuple[SegmentId, ...]:
    """Segments of the connected parts of a map that have any of ``ids``; largest part without.

    Raises
    ------
    NotFoundError
        If the map has no such segment.
    """
    wanted = set(segment_rows(segments, ids).tolist())
    wanted_parts = [part for part in _connected_parts(segments) if part & wanted]
    if not wanted_parts:
        return largest_part(segments)
    return tuple(segments.ids[row] for row in sorted(set().union(*wanted_parts)))


def _connected_parts(segments: Segments) -> list[set[int]]:
    import networkx as nx

    return list(nx.connected_components(_induced_adjacency(segments, segments.ids)))


def removable(segments: Segments, ids: Iterable[str]) -> tuple[SegmentId, ...]:
    """Members without which the others are connected, or none are left (R29).

    Raises
    ------
    NotFoundError
        If the map has no such segment.
    """
    import networkx as nx

    graph = _induced_adjacency(segments, ids)
    pieces = nx.number_connected_components(graph)
    if pieces <= 1:
        kept = set(nx.articulation_points(graph))
        found = [row for row in graph if row not in kept]
    else:  # a single segment apart from one piece is what makes it two
        found = [row for row in graph if pieces == 2 and graph.degree(row) == 0]
    return tuple(segments.ids[row] for row in sorted(found))


def _induced_adjacency(segments: Segments, ids: Iterable[str]) -> nx.Graph[int]:
    """Segments ``ids`` as rows, and which of them lie beside each other."""
    import networkx as nx

    inside = np.zeros(len(segments.ids), dtype=np.bool_)
    inside[segment_rows(segments, ids)] = True
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(np.flatnonzero(inside).tolist())
    graph.add_edges_from(segments.adjacency[inside[segments.adjacency].all(axis=1)].tolist())
    return graph


def _make_node_ids(keys: tuple[LaneKey, ...], first_node: Int32Array, prefix: str) -> list[NodeId]:
    return [
        NodeId(f"{prefix}{key.road}.{key.section}.{key.lane}.{k}")
        for key, count in zip(keys, np.diff(first_node).tolist(), strict=True)
        for k in range(count)
    ]


def split_node_id(name: str) -> tuple[LaneKey, int]:
    """Lane and k of a lane node id; the road's id may itself contain dots.

    Raises
    ------
    ValueError
        If ``name`` is not written like one.
    """
    road, section, lane, k = name.rsplit(".", 3)
    key = LaneKey(RoadId(road), int(section), int(lane))
    if f"{key}.{int(k)}" != name:  # int() takes "+1", "01" and " 1"
        raise ValueError(name)
    return key, int(k)


def _index_on_lane(name: str, bare: str, keys: tuple[LaneKey, ...], first_node: Int32Array) -> int:
    what = "pedestrian node" if is_walk_node_id(name) else "node"
    try:
        key, k = split_node_id(bare)
    except ValueError:
        raise NotFoundError(what, name, []) from None
    row = _lane_rows(_Keys(keys)).get(key)
    if row is None:
        prefix = name[: len(name) - len(bare)]
        known = [f"{prefix}{other}.{k}" for other in keys if other.road == key.road]
        raise NotFoundError(what, name, known)
    first, end = int(first_node[row]), int(first_node[row + 1])
    if not 0 <= k < end - first:
        prefix = name[: len(name) - len(bare)]
        raise NotFoundError(what, name, [f"{prefix}{key}.{end - first - 1}"])
    return first + k


class _Keys:
    """A tuple of keys that hashes by identity, so that the cache need not hash 10,000 of them."""

    __slots__ = ("keys",)

    def __init__(self, keys: tuple[LaneKey, ...]) -> None:
        self.keys = keys

    def __hash__(self) -> int:
        return id(self.keys)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Keys) and self.keys is other.keys


@lru_cache(maxsize=8)
def _lane_rows(keys: _Keys) -> dict[LaneKey, int]:
    return {key: row for row, key in enumerate(keys.keys)}


@lru_cache(maxsize=8)
def _segment_index(segments: Segments) -> dict[str, int]:
    return {name: row for row, name in enumerate(segments.ids)}
