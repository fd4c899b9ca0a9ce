"""The pedestrian graph: places to walk along roads, and the paths between them (requirement R32).

Walks are the walkable lanes of the map and, where a road with drivable lanes has none on a side,
a roadside walk beside the outermost lane of that side. Roadside walks are not made along motorways
and not inside junctions. Walks that meet are joined at their ends; carriageways are crossed on
crosswalks only.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from odscen.lanegraph.centrelines import CentreLines, node_offsets
from odscen.lanegraph.graphs import PedestrianGraph, WalkKind
from odscen.lanegraph.lane_density import check_density, check_ends
from odscen.lanegraph.lane_nodes import wrapped
from odscen.opendrive.road_model import DRIVABLE_TYPES, WALKABLE_TYPES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.arrays import BoolArray, FloatArray, IntArray
    from odscen.base.ids import LaneKey
    from odscen.lanegraph.lane_nodes import NodeTable
    from odscen.lanegraph.segments import SegmentMap
    from odscen.opendrive.lanes import RoadTable
    from odscen.opendrive.objects import Crosswalk
    from odscen.opendrive.road_model import OpenDrive

MIN_WALK_WIDTH = 0.5
"""Metres; where a walkable lane is narrower it has no nodes."""

ROADSIDE_OFFSET = 0.5
"""Metres from the outer border of the outermost lane to a roadside walk."""

ROADSIDE_WIDTH = 1.0
"""Metres of width that a roadside walk is taken to have."""

JOINT_DISTANCE = 3.0
"""Metres; ends of walks that are this near to each other are joined."""

CROSSWALK_REACH = 7.0
"""Metres; an end of a crosswalk is joined to the nearest walk node within this distance."""

LEVEL_HEIGHT = 2.5
"""Metres; places further apart in height are on different levels of the road network."""

PAVED_TYPES = DRIVABLE_TYPES | {
    "bidirectional",
    "biking",
    "parking",
    "shoulder",
    "stop",
}
"""Lane types that a roadside walk runs outside of; borders and verges may be 50 m wide."""


class _Walks(NamedTuple):
    """The walks: rows of the road table, and which of them are beside their lane."""

    rows: IntArray
    roadside: BoolArray


class _WalkNodes(NamedTuple):
    """Nodes of the walks, and the places of the walks' two ends, shape ``(W, 2, 3)``."""

    first: IntArray
    lane: IntArray
    s: FloatArray
    offset: FloatArray
    place: FloatArray
    hdg: FloatArray
    width: FloatArray
    ends: FloatArray


class _Edge(NamedTuple):
    source: int
    target: int
    kind: WalkKind
    length: float
    crosswalk: str = ""


def build_pedestrians(
    odr: OpenDrive,
    table: RoadTable,
    *,
    spacing: float,
    most: float,
    vehicles: NodeTable,
    segments: SegmentMap,
    road_rows: IntArray,
    successors: Mapping[LaneKey, Sequence[LaneKey]],
    crosswalks: Sequence[Crosswalk],
) -> PedestrianGraph:
    """Make the pedestrian graph of a map.

    Parameters
    ----------
    odr, table
        The road model and its arrays.
    spacing
        Metres between nodes of a walk, before rounding per walk.
    most
        Metres that the walks may have together.
    vehicles
        Nodes of the lane graph; joints keep off their lanes.
    segments
        The segments.
    road_rows
        Row of ``segments`` for each road of the table.
    successors
        Lanes that follow each lane in driving direction.
    crosswalks
        The map's crosswalks.

    Raises
    ------
    OpenDriveError
        If the walks are too long together, or too many lie on each other.
    """
    walks = _choose_walks(odr, table)
    nodes = _place_nodes(table, walks, spacing, most)
    check_density(table, walks.rows[nodes.lane], nodes.place.T)
    used = np.flatnonzero(np.diff(nodes.first))
    number = np.cumsum(np.diff(nodes.first) > 0) - 1
    keys = tuple(table.lane_keys[row] for row in walks.rows[used].tolist())
    edges = _unique_edges(
        [
            *_edges_along(walks, nodes),
            *_linked_joints(table, walks, nodes, successors),
            *_find_near_joints(table, walks, nodes, vehicles),
            *_crosswalk_edges(nodes, crosswalks),
        ]
    )
    road = road_rows[table.lane_road[walks.rows]][nodes.lane]
    return PedestrianGraph(
        spacing=spacing,
        lane_keys=keys,
        roadside=walks.roadside[used],
        first_node=np.concatenate([nodes.first[used], nodes.first[-1:]]).astype(np.int32),
        lane=number[nodes.lane].astype(np.int32),
        s=nodes.s,
        x=nodes.place[:, 0].copy(),
        y=nodes.place[:, 1].copy(),
        z=nodes.place[:, 2].copy(),
        hdg=wrapped(nodes.hdg),
        width=nodes.width,
        segment=segments.at(road, nodes.s).astype(np.int32),
        source=np.array([edge.source for edge in edges], dtype=np.int32),
        target=np.array([edge.target for edge in edges], dtype=np.int32),
        kind=np.array([edge.kind for edge in edges], dtype=np.uint8),
        length=np.array([edge.length for edge in edges], dtype=np.float64),
        crosswalk=tuple(edge.crosswalk for edge in edges),
    )


def _choose_walks(odr: OpenDrive, table: RoadTable) -> _Walks:
    """Choose the walks, in the order of the table."""
    walkable = np.array([kind in WALKABLE_TYPES for kind in table.lane_type], dtype=np.bool_)
    drivable = np.array([kind in DRIVABLE_TYPES for kind in table.lane_type], dtype=np.bool_)
    paved = np.array([kind in PAVED_TYPES for kind in table.lane_type], dtype=np.bool_)
    if not len(walkable):
        return _Walks(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.bool_))
    section_start = np.ones(len(walkable), dtype=np.bool_)
    section_start[1:] = (np.diff(table.lane_road) != 0) | (np.diff(table.lane_section) != 0)
    section = np.cumsum(section_start) - 1
    side = 2 * section + (table.lane_id > 0)
    has_walk = np.zeros(2 * len(side), dtype=np.bool_)
    has_walk[side[walkable]] = True
    has_traffic = np.zeros(len(side), dtype=np.bool_)
    has_traffic[section[drivable]] = True
    candidate = paved & has_traffic[section] & ~has_walk[side] & _roadside_allowed(odr, table)
    outermost = np.zeros(2 * len(side), dtype=np.int64)
    np.maximum.at(outermost, side[candidate], np.abs(table.lane_id[candidate]))
    roadside = candidate & (np.abs(table.lane_id) == outermost[side])
    rows = np.flatnonzero(walkable | roadside).astype(np.int64)
    return _Walks(rows, roadside[rows])


def _roadside_allowed(odr: OpenDrive, table: RoadTable) -> BoolArray:
    """Whether each lane's road takes roadside walks at the middle of the lane's section."""
    roads = [odr.roads[road] for road in table.road_ids]
    allowed = np.array([road.junction is None for road in roads], dtype=np.bool_)[table.lane_road]
    motorways = {
        row for row, road in enumerate(roads) if any(kind.type == "motorway" for kind in road.types)
    }
    for lane in np.flatnonzero(allowed & np.isin(table.lane_road, list(motorways))).tolist():
        middle = (table.lane_s0[lane] + table.lane_s1[lane]) / 2
        types = [kind for kind in roads[table.lane_road[lane]].types if kind.s <= middle]
        allowed[lane] = not types or types[-1].type != "motorway"
    return allowed


def _place_nodes(table: RoadTable, walks: _Walks, spacing: float, most: float) -> _WalkNodes:
    rows, roadside = walks
    across = np.where(roadside, 1.0, 0.5)
    growing = np.ones(len(rows), dtype=np.bool_)
    lines = CentreLines.of(table, rows, forward=growing, at=across, most=most)
    planned, lane, offset = node_offsets(lines.lengths, spacing, most=most)
    s = lines.s_at(lane, offset)
    place, hdg, width = _points_on_walks(table, walks, lane, s)
    wide = width >= MIN_WALK_WIDTH
    ends = np.arange(len(rows))
    begin, _, _ = _points_on_walks(table, walks, ends, lines.s0)
    end, _, _ = _points_on_walks(table, walks, ends, lines.s1)
    return _WalkNodes(
        first=np.concatenate([[0], np.cumsum(wide)])[planned].astype(np.int64),
        lane=lane[wide],
        s=s[wide],
        offset=offset[wide],
        place=place[wide],
        hdg=hdg[wide],
        width=width[wide],
        ends=np.stack([begin, end], axis=1),
    )


def _points_on_walks(
    table: RoadTable, walks: _Walks, lane: IntArray, s: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Places ``(K, 3)``, headings and widths ``(K,)`` on the walks at road coordinates s."""
    row, beside = walks.rows[lane], walks.roadside[lane]
    points = table.lane_points(row, s, at=np.where(beside, 1.0, 0.5))
    outward = np.where(beside, ROADSIDE_OFFSET, 0.0) * np.sign(table.lane_id[row])
    x = points.x - outward * np.sin(points.hdg)
    y = points.y + outward * np.cos(points.hdg)
    width = np.where(beside, ROADSIDE_WIDTH, points.width)
    return np.stack([x, y, points.z], axis=1), points.hdg, width


def _edges_along(walks: _Walks, nodes: _WalkNodes) -> list[_Edge]:
    source = np.flatnonzero(nodes.lane[:-1] == nodes.lane[1:])
    length = nodes.offset[source + 1] - nodes.offset[source]
    kinds = (WalkKind.SIDEWALK, WalkKind.ROADSIDE)
    beside = walks.roadside[nodes.lane[source]].tolist()
    return [
        _Edge(node, node + 1, kinds[side], gap)
        for node, side, gap in zip(source.tolist(), beside, length.tolist(), strict=True)
    ]


def _linked_joints(
    table: RoadTable,
    walks: _Walks,
    nodes: _WalkNodes,
    successors: Mapping[LaneKey, Sequence[LaneKey]],
) -> list[_Edge]:
    """Joints between walkable lanes that the map links; links are given in driving direction."""
    number = {
        table.lane_keys[row]: walk
        for walk, (row, beside) in enumerate(zip(walks.rows, walks.roadside, strict=True))
        if not beside
    }
    forward = table.lane_forward[walks.rows]
    pairs = [
        (2 * walk + int(forward[walk]), 2 * number[after] + int(not forward[number[after]]))
        for key, walk in number.items()
        for after in successors.get(key, ())
        if after in number
    ]
    return _make_joints(nodes, pairs)


def _find_near_joints(
    table: RoadTable, walks: _Walks, nodes: _WalkNodes, vehicles: NodeTable
) -> list[_Edge]:
    """Joints between ends of different walks within reach of each other, not across a lane."""
    ends = nodes.ends.reshape(-1, 3)
    some = np.flatnonzero(np.repeat(np.diff(nodes.first) > 0, 2))  # ends of walks with nodes
    if not len(some):
        return []
    check_ends(table, walks.rows[some // 2], ends[some], reach=JOINT_DISTANCE)
    pairs = some[cKDTree(ends[some]).query_pairs(JOINT_DISTANCE, output_type="ndarray")]
    pairs = pairs[pairs[:, 0] // 2 != pairs[:, 1] // 2]
    middle = (ends[pairs[:, 0]] + ends[pairs[:, 1]]) / 2
    apart = pairs[~_lie_on_lane(middle, vehicles)]
    return _make_joints(nodes, [(one, other) for one, other in apart.tolist()])


def _lie_on_lane(places: FloatArray, vehicles: NodeTable) -> BoolArray:
    """Whether each place, shape ``(K, 3)``, lies on a drivable lane."""
    if not len(places) or not len(vehicles.x):
        return np.zeros(len(places), dtype=np.bool_)
    lanes = cKDTree(np.stack([vehicles.x, vehicles.y, vehicles.z], axis=1))
    reach = float(np.hypot(vehicles.width.max() / 2, vehicles.spacing))
    result = np.zeros(len(places), dtype=np.bool_)
    for index, near in enumerate(lanes.query_ball_point(places, reach, return_sorted=True)):
        dx = places[index, 0] - vehicles.x[near]
        dy = places[index, 1] - vehicles.y[near]
        hdg = vehicles.hdg[near]
        ahead = dx * np.cos(hdg) + dy * np.sin(hdg)
        aside = dy * np.cos(hdg) - dx * np.sin(hdg)
        inside = (np.abs(ahead) <= vehicles.spacing / 2) & (
            np.abs(aside) < vehicles.width[near] / 2 - MARGIN
        )
        result[index] = bool(inside.any())
    return result


MARGIN = 0.2
"""Metres that a joint may reach into a drivable lane."""


def _make_joints(nodes: _WalkNodes, pairs: Sequence[tuple[int, int]]) -> list[_Edge]:
    """Edges between ends of walks; end ``2 w`` is the start of walk w, ``2 w + 1`` its end."""
    edges: list[_Edge] = []
    for pair in pairs:
        walk, at_end = np.array(pair) // 2, np.array(pair) % 2 == 1
        begin, end = nodes.first[walk], nodes.first[walk + 1]
        if np.any(begin == end):
            continue
        source, target = sorted(np.where(at_end, end - 1, begin).tolist())
        if source != target:
            gap = float(np.linalg.norm(nodes.place[source] - nodes.place[target]))
            edges.append(_Edge(source, target, WalkKind.JOINT, gap))
    return edges


def _crosswalk_edges(nodes: _WalkNodes, crosswalks: Sequence[Crosswalk]) -> list[_Edge]:
    """Make an edge for each crosswalk that has a walk within reach at both of its ends."""
    edges: list[_Edge] = []
    if not len(nodes.place):
        return edges
    tree = cKDTree(nodes.place[:, :2])
    for crosswalk in crosswalks:
        found = [
            _nearest_on_level(tree, nodes, axis_end, crosswalk.z) for axis_end in crosswalk.axis
        ]
        ends = sorted(node for node in found if node is not None)
        if len(ends) < 2 or nodes.lane[ends[0]] == nodes.lane[ends[1]]:
            continue  # a walk is missing, or both ends found the one on the same side
        source, target = ends
        gap = float(np.linalg.norm(nodes.place[source] - nodes.place[target]))
        name = f"{crosswalk.road}:{crosswalk.object_id}"
        edges.append(_Edge(source, target, WalkKind.CROSSWALK, gap, name))
    return edges


def _nearest_on_level(tree: cKDTree, nodes: _WalkNodes, place: FloatArray, z: float) -> int | None:
    """Nearest node on the level of ``place``, shape ``(2,)``, or ``None``."""
    near = np.array(sorted(tree.query_ball_point(place, CROSSWALK_REACH)), dtype=np.int64)
    near = near[np.abs(nodes.place[near, 2] - z) <= LEVEL_HEIGHT]
    if not len(near):
        return None
    distance = np.linalg.norm(nodes.place[near, :2] - place, axis=1)
    return int(near[np.argmin(distance)])


def _unique_edges(edges: Sequence[_Edge]) -> list[_Edge]:
    """Sort the edges; of several between the same nodes the first kind found stays."""
    best: dict[tuple[int, int], _Edge] = {}
    for edge in edges:
        best.setdefault((edge.source, edge.target), edge)
    return [best[pair] for pair in sorted(best)]
