"""From the road model to the graphs of a map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from odscen.base.errors import InputError, OpenDriveError
from odscen.base.shown import shown_id
from odscen.lanegraph.centrelines import MOST_LANES
from odscen.lanegraph.graphs import LaneGraph, Lanes, MapGraph
from odscen.lanegraph.lane_density import check_density
from odscen.lanegraph.lane_edges import connect
from odscen.lanegraph.lane_nodes import NodeTable, place_nodes
from odscen.lanegraph.pedestrian_graph import build_pedestrians
from odscen.lanegraph.query import WALK_PREFIX, is_walk_node_id
from odscen.lanegraph.segments import SegmentMap, build_segments
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import crosswalks
from odscen.opendrive.topology import lane_successors, side_links

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from odscen.base.arrays import IntArray
    from odscen.base.ids import LaneKey
    from odscen.opendrive.road_model import OpenDrive

MIN_SPACING, MAX_SPACING = 0.1, 100.0
"""Metres; the range of spacings that make sense for placing vehicles."""


def build_map_graph(
    odr: OpenDrive,
    *,
    name: str,
    sha256: str,
    spacing: float = 2.0,
    table: RoadTable | None = None,
    most_lanes: float = MOST_LANES,
) -> MapGraph:
    """Make lane graph, segments and pedestrian graph of a map (requirements R20 to R27, R32).

    Parameters
    ----------
    odr
        The road model.
    name, sha256
        What the map is called, and the hash of its .xodr.
    spacing
        Metres between nodes of a lane or walk, before rounding per lane.
    table
        The road model as arrays, if it has been made already.
    most_lanes
        Metres that all drivable lanes, or all walks, may have together.

    Raises
    ------
    InputError
        If ``spacing`` is out of range.
    OpenDriveError
        If the lanes together are longer, need too many nodes, or lie on each other, or a road has
        an id with which its nodes would be those of walks.
    """
    if not MIN_SPACING <= spacing <= MAX_SPACING:
        raise InputError(f"spacing {spacing} m is not within {MIN_SPACING} to {MAX_SPACING} m")
    for road in odr.roads:
        if is_walk_node_id(road):
            raise OpenDriveError(
                f"nodes of walks begin with {WALK_PREFIX!r}, so no id of a road may; rename it",
                element=f"road {shown_id(road)}",
            )
    table = RoadTable.of(odr) if table is None else table
    successors = lane_successors(odr)
    nodes = place_nodes(table, spacing, most=most_lanes)
    check_density(table, nodes.lines.rows[nodes.lane], np.stack([nodes.x, nodes.y, nodes.z]))
    segments = build_segments(odr)
    row = {road: index for index, road in enumerate(odr.roads)}
    road_rows = np.array([row[road] for road in table.road_ids], dtype=np.int64)
    return MapGraph(
        map_name=name,
        map_sha256=sha256,
        lanes=_lane_graph(odr, table, nodes, segments, road_rows, successors),
        segments=segments.segments,
        walks=build_pedestrians(
            odr,
            table,
            spacing=spacing,
            most=most_lanes,
            vehicles=nodes,
            segments=segments,
            road_rows=road_rows,
            successors=successors,
            crosswalks=crosswalks(odr, table),
        ),
    )


def _lane_graph(
    odr: OpenDrive,
    table: RoadTable,
    nodes: NodeTable,
    segments: SegmentMap,
    road_rows: IntArray,
    successors: Mapping[LaneKey, Sequence[LaneKey]],
) -> LaneGraph:
    keys = [table.lane_keys[row] for row in nodes.lines.rows.tolist()]
    edges = connect(nodes, keys, successors, side_links(odr))
    used = np.flatnonzero(np.diff(nodes.first))
    number = np.full(len(keys) + 1, -1, dtype=np.int64)  # the last answers for lane -1
    number[used] = np.arange(len(used))
    rows = nodes.lines.rows
    road = road_rows[table.lane_road[rows]][nodes.lane]
    return LaneGraph(
        spacing=nodes.spacing,
        lanes=Lanes(
            keys=tuple(keys[lane] for lane in used.tolist()),
            types=tuple(table.lane_type[row] for row in rows[used].tolist()),
            junctions=tuple(odr.roads[keys[lane].road].junction for lane in used.tolist()),
            lengths=nodes.lines.lengths[used],
            forward=nodes.lines.forward[used],
            first_node=np.append(nodes.first[used], nodes.first[-1]).astype(np.int32),
        ),
        lane=number[nodes.lane].astype(np.int32),
        s=nodes.s,
        offset=nodes.offset,
        x=nodes.x,
        y=nodes.y,
        z=nodes.z,
        hdg=nodes.hdg,
        pitch=nodes.pitch,
        curvature=nodes.curvature,
        width=nodes.width,
        speed_limit=table.speed_limit(rows[nodes.lane], nodes.s),
        left_lane=number[nodes.left].astype(np.int32),
        right_lane=number[nodes.right].astype(np.int32),
        lane_change=nodes.lane_change,
        segment=segments.at(road, nodes.s).astype(np.int32),
        source=edges.source.astype(np.int32),
        target=edges.target.astype(np.int32),
        relation=edges.relation,
        length=edges.length,
    )
