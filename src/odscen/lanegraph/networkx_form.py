"""A map graph as networkx graphs, for interchange; odscen itself works on the arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from odscen.lanegraph.columns import NODE_COLUMNS, WALK_NODE_COLUMNS
from odscen.lanegraph.graphs import CHANGE_LEFT, CHANGE_RIGHT, MapGraph, Relation, WalkKind
from odscen.lanegraph.query import node_ids, walk_node_ids

if TYPE_CHECKING:
    import networkx as nx


def to_networkx(graph: MapGraph) -> tuple[nx.MultiDiGraph, nx.Graph]:
    """Make networkx graphs of the lane graph and the pedestrian graph, nodes named by their ids.

    Attributes have the names of :class:`~odscen.lanegraph.graphs.LaneGraph` and
    :class:`~odscen.lanegraph.graphs.PedestrianGraph`; relations, kinds and segments are words.
    Edges of the lane graph have their relation as key. ``graph["segments"]`` of both is the
    adjacency of the segments as a :class:`networkx.Graph`.
    """
    import networkx as nx

    segments = nx.Graph()
    for name, kind, length in zip(
        graph.segments.ids, graph.segments.kinds, graph.segments.lengths.tolist(), strict=True
    ):
        segments.add_node(name, kind=kind, length=length)
    ids = graph.segments.ids
    segments.add_edges_from((ids[i], ids[j]) for i, j in graph.segments.adjacency.tolist())
    about = {"map_name": graph.map_name, "map_sha256": graph.map_sha256, "segments": segments}
    return _lane_network(graph, about), _walk_network(graph, about)


def _lane_network(graph: MapGraph, about: dict[str, Any]) -> nx.MultiDiGraph:
    import networkx as nx

    lanes, table = graph.lanes, graph.lanes.lanes
    result = nx.MultiDiGraph(**about, spacing=lanes.spacing)
    names = node_ids(graph)
    columns = [getattr(lanes, name).tolist() for name in NODE_COLUMNS]
    rows = zip(names, lanes.lane.tolist(), lanes.segment.tolist(), *columns, strict=True)
    for name, lane, segment, *values in rows:
        attributes = dict(zip(NODE_COLUMNS, values, strict=True))
        change = attributes.pop("lane_change")
        result.add_node(
            name,
            kind="vehicle",
            **attributes,
            change_left=bool(change & CHANGE_LEFT),
            change_right=bool(change & CHANGE_RIGHT),
            lane_type=table.types[lane],
            junction=table.junctions[lane] or "",
            segment=graph.segments.ids[segment],
        )
    words = [Relation(code).name.lower() for code in Relation]
    edges = (lanes.source, lanes.target, lanes.relation, lanes.length)
    for source, target, relation, length in zip(*(c.tolist() for c in edges), strict=True):
        word = words[relation]
        result.add_edge(names[source], names[target], key=word, relation=word, length=length)
    return result


def _walk_network(graph: MapGraph, about: dict[str, Any]) -> nx.Graph:
    import networkx as nx

    walks = graph.walks
    result = nx.Graph(**about, spacing=walks.spacing)
    names = walk_node_ids(graph)
    columns = [getattr(walks, name).tolist() for name in WALK_NODE_COLUMNS]
    rows = zip(names, walks.lane.tolist(), walks.segment.tolist(), *columns, strict=True)
    for name, lane, segment, *values in rows:
        result.add_node(
            name,
            kind="pedestrian",
            **dict(zip(WALK_NODE_COLUMNS, values, strict=True)),
            roadside=bool(walks.roadside[lane]),
            segment=graph.segments.ids[segment],
        )
    words = [WalkKind(code).name.lower() for code in WalkKind]
    edges = (walks.source, walks.target, walks.kind, walks.length)
    rows = zip(*(column.tolist() for column in edges), walks.crosswalk, strict=True)
    for source, target, kind, length, crosswalk in rows:
        word = words[kind]
        result.add_edge(names[source], names[target], kind=word, length=length, crosswalk=crosswalk)
    return result
