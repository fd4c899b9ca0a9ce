"""The columns of a map graph, and what must hold for them; shared by the file formats.

Each table names the arrays of one part of :class:`~odscen.lanegraph.graphs.MapGraph` with their
type, so that readers and writers are loops and not lists of names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from odscen.base.errors import GraphFormatError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from odscen.base.arrays import FloatArray, Int32Array
    from odscen.lanegraph.graphs import MapGraph

Array = NDArray[Any]

LANE_COLUMNS: Mapping[str, type] = {"lengths": np.float64, "forward": np.bool_}
NODE_COLUMNS: Mapping[str, type] = {
    "s": np.float64,
    "offset": np.float64,
    "x": np.float64,
    "y": np.float64,
    "z": np.float64,
    "hdg": np.float64,
    "pitch": np.float64,
    "curvature": np.float64,
    "width": np.float64,
    "speed_limit": np.float64,
    "lane_change": np.uint8,
}
EDGE_COLUMNS: Mapping[str, type] = {
    "source": np.int32,
    "target": np.int32,
    "relation": np.uint8,
    "length": np.float64,
}
WALK_NODE_COLUMNS: Mapping[str, type] = {
    "s": np.float64,
    "x": np.float64,
    "y": np.float64,
    "z": np.float64,
    "hdg": np.float64,
    "width": np.float64,
}
WALK_EDGE_COLUMNS: Mapping[str, type] = {
    "source": np.int32,
    "target": np.int32,
    "kind": np.uint8,
    "length": np.float64,
}


def check_map_graph(graph: MapGraph) -> MapGraph:
    """``graph`` itself, if its arrays fit together.

    Raises
    ------
    GraphFormatError
        If a length, an index or a value is out of range.
    """
    segments, lanes, walks = graph.segments, graph.lanes, graph.walks
    count = len(segments.ids)
    _same_length("segments", count, segments.kinds, segments.parts, segments.lengths)
    _check_range("segment adjacency", segments.adjacency, 0, count)
    if segments.adjacency.ndim != 2 or segments.adjacency.shape[1:] != (2,):
        _refuse_column("segment adjacency", f"shape is {segments.adjacency.shape}, not (A, 2)")
    if not set(segments.kinds) <= {"road", "junction"}:
        _refuse_column("segments", "a kind is neither road nor junction")
    if not (np.isfinite(lanes.spacing) and lanes.spacing > 0):
        _refuse_column("spacing", f"{lanes.spacing} is not a positive number")
    _check_lanes(graph, count)
    _check_walks(graph, count)
    for what, source, target, nodes in (
        ("edge", lanes.source, lanes.target, len(lanes.x)),
        ("pedestrian edge", walks.source, walks.target, len(walks.x)),
    ):
        _check_range(f"{what} source", source, 0, nodes)
        _check_range(f"{what} target", target, 0, nodes)
    return graph


def _check_lanes(graph: MapGraph, segments: int) -> None:
    lanes = graph.lanes
    table = lanes.lanes
    rows = len(table.keys)
    _same_length("lanes", rows, table.types, table.junctions, table.lengths, table.forward)
    nodes = _check_first_node("lanes", table.first_node, rows)
    columns = [getattr(lanes, name) for name in NODE_COLUMNS]
    _same_length("nodes", nodes, lanes.lane, lanes.left_lane, lanes.right_lane, *columns)
    _same_length("nodes", nodes, lanes.segment)
    if not np.array_equal(lanes.lane, np.repeat(np.arange(rows), np.diff(table.first_node))):
        _refuse_column("nodes", "they are not in the order of their lanes")
    _check_range("left_lane", lanes.left_lane, -1, rows)
    _check_range("right_lane", lanes.right_lane, -1, rows)
    _check_range("segment of a node", lanes.segment, 0, segments)
    _check_range("lane_change", lanes.lane_change, 0, 4)
    _same_length("edges", len(lanes.source), *(getattr(lanes, name) for name in EDGE_COLUMNS))
    _check_range("relation", lanes.relation, 0, 3)


def _check_walks(graph: MapGraph, segments: int) -> None:
    walks = graph.walks
    rows = len(walks.lane_keys)
    _same_length("walks", rows, walks.roadside)
    nodes = _check_first_node("walks", walks.first_node, rows)
    columns = [getattr(walks, name) for name in WALK_NODE_COLUMNS]
    _same_length("pedestrian nodes", nodes, walks.lane, walks.segment, *columns)
    if not np.array_equal(walks.lane, np.repeat(np.arange(rows), np.diff(walks.first_node))):
        _refuse_column("pedestrian nodes", "they are not in the order of their walks")
    _check_range("segment of a pedestrian node", walks.segment, 0, segments)
    columns = [getattr(walks, name) for name in WALK_EDGE_COLUMNS]
    _same_length("pedestrian edges", len(walks.source), walks.crosswalk, *columns)
    _check_range("kind", walks.kind, 0, 4)


def _check_first_node(what: str, first_node: Int32Array, rows: int) -> int:
    _same_length(f"first_node of {what}", rows + 1, first_node)
    if first_node[0] != 0 or np.any(np.diff(first_node) < 0):
        _refuse_column(f"first_node of {what}", "does not grow from 0")
    return int(first_node[-1])


def _same_length(what: str, count: int, *columns: Any) -> None:
    lengths = sorted({len(column) for column in columns} | {count})
    if len(lengths) != 1:
        _refuse_column(what, f"columns have different lengths: {', '.join(map(str, lengths))}")


def _check_range(what: str, values: Int32Array | FloatArray | Array, low: int, end: int) -> None:
    if len(values) and not (values.min() >= low and values.max() < end):
        _refuse_column(what, f"{values.min()} to {values.max()} is not within {low} to {end - 1}")


def _refuse_column(what: str, problem: str) -> None:
    raise GraphFormatError(problem, element=what)
