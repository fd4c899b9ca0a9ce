"""The graphs as arrays.

A :class:`MapGraph` bundles the three graphs of one map: lane graph, segments, pedestrian graph. All
arrays are indexed by dense integers; the string ids of :mod:`odscen.base.ids` are derived from them
and stable (requirement R24).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from odscen.base.arrays import BoolArray, FloatArray, Int32Array
    from odscen.base.ids import JunctionId, LaneKey, RoadId, SegmentId

ByteArray = NDArray[np.uint8]


class Relation(IntEnum):
    """What an edge of the lane graph means; predecessor is successor read backwards."""

    SUCCESSOR = 0
    LEFT = 1
    RIGHT = 2


RELATION_COLORS = {
    Relation.SUCCESSOR: "#000000",
    Relation.LEFT: "#FF4261",
    Relation.RIGHT: "#00E279",
}
"""Colour of each relation in every drawing (requirement R22)."""
VEHICLE_NODE_COLOR = "#24A3F2"
PEDESTRIAN_NODE_COLOR = "#FFD800"

CHANGE_LEFT = 1
"""Bit of :attr:`LaneGraph.lane_change`: road marks permit a change to the left here."""
CHANGE_RIGHT = 2
"""Bit of :attr:`LaneGraph.lane_change`: road marks permit a change to the right here."""


@dataclass(frozen=True, slots=True, eq=False)
class Lanes:
    """The drivable lanes that have nodes, one row per lane of a lane section.

    Sorted by road (file order), section, lane id ascending. Arrays have shape ``(L,)`` unless said
    otherwise.

    Attributes
    ----------
    keys
        One :class:`~odscen.base.ids.LaneKey` per row.
    types
        Lane type as in the file.
    junctions
        Junction of the lane's road, or ``None``.
    lengths
        Length of the lane's centre line in metres.
    forward
        Whether traffic runs with increasing s (right-hand traffic: lanes with negative id).
    first_node
        Shape ``(L + 1,)``: the nodes of lane ``i`` are ``first_node[i]`` up to
        ``first_node[i + 1]``, in driving direction.
    """

    keys: tuple[LaneKey, ...]
    types: tuple[str, ...]
    junctions: tuple[JunctionId | None, ...]
    lengths: FloatArray
    forward: BoolArray
    first_node: Int32Array


@dataclass(frozen=True, slots=True, eq=False)
class LaneGraph:
    """Directed graph of spawn points every ``spacing`` metres along drivable lanes.

    Node arrays have shape ``(N,)``, edge arrays shape ``(E,)``; edges are sorted by (source,
    relation, target). Positions are lane centres in the OpenDRIVE frame.

    Attributes
    ----------
    spacing
        Metres between neighbouring nodes of a lane, before rounding per lane.
    lanes
        The lanes that the nodes lie on.
    lane
        Row of ``lanes`` for each node.
    s
        Road coordinate of the node, metres.
    offset
        Distance from the start of the lane in driving direction along its centre line, metres.
    x, y, z
        Position, metres.
    hdg, pitch
        Driving direction: radians counter-clockwise from +x; slope, positive uphill.
    curvature
        Of the lane centre in driving direction, 1/m, positive to the left.
    width
        Lane width, metres.
    speed_limit
        m/s; NaN where the map gives none.
    left_lane, right_lane
        Row of the adjacent lane of the same driving direction, seen in driving direction, or -1.
    lane_change
        Bits :data:`CHANGE_LEFT`, :data:`CHANGE_RIGHT`: the road mark permits the change here.
    segment
        Row of :class:`Segments`.
    source, target
        Nodes of each edge.
    relation
        :class:`Relation` of each edge. Left and right edges exist only where ``lane_change``
        permits, and lead about one spacing ahead (requirement R21).
    length
        Length of each edge, metres, along the lanes for successors, straight for left and right.
    """

    spacing: float
    lanes: Lanes
    lane: Int32Array
    s: FloatArray
    offset: FloatArray
    x: FloatArray
    y: FloatArray
    z: FloatArray
    hdg: FloatArray
    pitch: FloatArray
    curvature: FloatArray
    width: FloatArray
    speed_limit: FloatArray
    left_lane: Int32Array
    right_lane: Int32Array
    lane_change: ByteArray
    segment: Int32Array
    source: Int32Array
    target: Int32Array
    relation: ByteArray
    length: FloatArray


@dataclass(frozen=True, slots=True)
class SegmentPart:
    """A stretch of one road that belongs to a segment; s from ``s_from`` to ``s_to``, metres."""

    road: RoadId
    s_from: float
    s_to: float


@dataclass(frozen=True, slots=True, eq=False)
class Segments:
    """Parts of the map that a region of interest is made of (requirements R25 to R27).

    Attributes
    ----------
    ids
        ``j<junction>`` for a junction, ``r<road>`` or ``r<road>-<k>`` for the k-th part of the
        chain of roads that starts with that road.
    kinds
        ``junction`` or ``road``.
    parts
        The stretches of roads in each segment.
    lengths
        Length along the reference line (road segments) or sum of connecting roads, metres.
    adjacency
        Shape ``(A, 2)``: pairs ``i < j`` of neighbouring segments, sorted.
    """

    ids: tuple[SegmentId, ...]
    kinds: tuple[Literal["road", "junction"], ...]
    parts: tuple[tuple[SegmentPart, ...], ...]
    lengths: FloatArray
    adjacency: Int32Array


class WalkKind(IntEnum):
    """What a pedestrian edge runs along."""

    SIDEWALK = 0
    ROADSIDE = 1
    CROSSWALK = 2
    JOINT = 3
    """Between walks that meet: ends of lane sections, roads and corners of junctions."""


@dataclass(frozen=True, slots=True, eq=False)
class PedestrianGraph:
    """Undirected graph of walkers' places (requirement R32).

    Node arrays have shape ``(P,)``, edge arrays shape ``(Q,)``; each edge is stored once with
    ``source < target``, sorted.

    Attributes
    ----------
    lane_keys
        The walkable lanes; a roadside walk has the key of the lane it runs beside.
    roadside
        Shape of ``lane_keys``: whether the walk is beside the lane, not on it.
    lane
        Row of ``lane_keys`` for each node.
    s, x, y, z, hdg
        Place and direction of growing s; metres and radians.
    width
        Width to walk on, metres.
    segment
        Row of :class:`Segments`.
    source, target, kind, length
        The edges; ``kind`` is a :class:`WalkKind`, ``length`` in metres.
    crosswalk
        Per edge: id of the crosswalk object as ``road:object``, or an empty string.
    """

    spacing: float
    lane_keys: tuple[LaneKey, ...]
    roadside: BoolArray
    first_node: Int32Array
    lane: Int32Array
    s: FloatArray
    x: FloatArray
    y: FloatArray
    z: FloatArray
    hdg: FloatArray
    width: FloatArray
    segment: Int32Array
    source: Int32Array
    target: Int32Array
    kind: ByteArray
    length: FloatArray
    crosswalk: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class MapGraph:
    """Everything that scenarios are made on: the three graphs of one map.

    Attributes
    ----------
    map_name, map_sha256
        The map's name in the catalogue and the SHA-256 of its .xodr, hexadecimal.
    """

    map_name: str
    map_sha256: str
    lanes: LaneGraph
    segments: Segments
    walks: PedestrianGraph
