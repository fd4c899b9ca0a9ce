"""A map graph as GraphML, without loss both ways, from and to the arrays directly.

One directed graph holds everything, so that :func:`networkx.read_graphml` and its kin read it all:

========== ===================== ===============================================================
``kind``   id                    what
========== ===================== ===============================================================
vehicle    ``road.section.l.k``  node of the lane graph
pedestrian ``ped.…``             node of the pedestrian graph
segment    ``segment.<id>``      segment; ``parts`` is JSON: ``[[road, s_from, s_to], ...]``
========== ===================== ===============================================================

Edges carry ``relation``: successor, left, right (directed); sidewalk, roadside, crosswalk, joint
(pedestrians) and adjacent (segments) are undirected and stored once, from the smaller index to the
larger. Numbers are written so that the same number is read back.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

import numpy as np

from odscen.errors import GraphFormatError
from odscen.lanegraph.columns import NODE_COLUMNS, WALK_NODE_COLUMNS, Array
from odscen.lanegraph.graphml_reader import FORMAT, SEGMENT_PREFIX, VERSION, from_graphml
from odscen.lanegraph.model import MapGraph, Relation, Segments, WalkKind
from odscen.lanegraph.query import node_ids, walk_node_ids

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

__all__ = ["from_graphml", "to_graphml"]

GRAPH_KEYS = {
    "format": "string",
    "version": "int",
    "map_name": "string",
    "map_sha256": "string",
    "spacing": "double",
    "walk_spacing": "double",
}
EDGE_KEYS = {"relation": "string", "length": "double", "crosswalk": "string"}
NODE_KEYS = {
    "kind": "string",
    **dict.fromkeys(NODE_COLUMNS, "double"),
    "lane_change": "int",
    "lane_type": "string",
    "junction": "string",
    "lane_length": "double",
    "forward": "boolean",
    "left_lane": "string",
    "right_lane": "string",
    "segment": "string",
    "roadside": "boolean",
    "segment_kind": "string",
    "length": "double",
    "parts": "string",
}


_ENTITIES = {'"': "&quot;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
_SPECIAL = ("&", "<", ">", *_ENTITIES)


def to_graphml(graph: MapGraph) -> bytes:
    """Write the graph as GraphML in UTF-8; the same graph gives the same bytes.

    Raises
    ------
    GraphFormatError
        If two nodes would get the same id (a road named like ``ped.1``).
    """
    segment_names = [SEGMENT_PREFIX + name for name in graph.segments.ids]
    lane_names: list[str] = [*node_ids(graph)]
    walk_names: list[str] = [*walk_node_ids(graph)]
    names = [*segment_names, *lane_names, *walk_names]
    if len(set(names)) != len(names):
        problem = "two nodes would have the same id"
        raise GraphFormatError(problem, file=graph.map_name)
    segments, lanes, walks = map(_escaped, (segment_names, lane_names, walk_names))
    parts = [
        _head(graph),
        *_segment_nodes(graph.segments, segments),
        *_lane_nodes(graph, lanes),
        *_walk_nodes(graph, walks),
        *_lane_edges(graph, lanes),
        *_walk_edges(graph, walks),
        *(
            f'<edge source="{segments[i]}" target="{segments[j]}">'
            f'<data key="e_relation">adjacent</data></edge>\n'
            for i, j in graph.segments.adjacency.tolist()
        ),
        "</graph>\n</graphml>\n",
    ]
    return "".join(parts).encode()


def _head(graph: MapGraph) -> str:
    keys = [
        f'<key id="{kind[0]}_{name}" for="{kind}" attr.name="{name}" attr.type="{type_}"/>\n'
        for kind, names in (("graph", GRAPH_KEYS), ("node", NODE_KEYS), ("edge", EDGE_KEYS))
        for name, type_ in names.items()
    ]
    values = (
        FORMAT,
        str(VERSION),
        escape(graph.map_name),
        escape(graph.map_sha256),
        _number(graph.lanes.spacing),
        _number(graph.walks.spacing),
    )
    data = [
        f'<data key="g_{name}">{value}</data>\n'
        for name, value in zip(GRAPH_KEYS, values, strict=True)
    ]
    return (
        "<?xml version='1.0' encoding='UTF-8'?>\n"
        '<graphml xmlns="http://graphml.graphdrawing.org/xmlns">\n'
        f'{"".join(keys)}<graph edgedefault="directed">\n{"".join(data)}'
    )


def _segment_nodes(segments: Segments, names: Sequence[str]) -> Iterable[str]:
    template = _node_template("segment", ["segment_kind", "length", "parts"])
    for name, kind, length, parts in zip(
        names, segments.kinds, segments.lengths.tolist(), segments.parts, strict=True
    ):
        text = json.dumps([list(part) for part in _plain(parts)])
        yield template % (name, kind, _number(length), escape(text))


def _plain(parts: Iterable[Any]) -> list[tuple[str, float, float]]:
    return [(part.road, part.s_from, part.s_to) for part in parts]


def _lane_nodes(graph: MapGraph, names: Sequence[str]) -> Iterable[str]:
    lanes, table = graph.lanes, graph.lanes.lanes
    lane_names = [*_escaped(list(map(str, table.keys))), ""]  # -1 is no lane
    attributes = [*NODE_COLUMNS, "lane_type", "junction", "lane_length", "forward"]
    template = _node_template("vehicle", [*attributes, "left_lane", "right_lane", "segment"])
    of_lane = lanes.lane.tolist()
    columns = [
        names,
        *(_numbers(getattr(lanes, name)) for name in NODE_COLUMNS),
        _pick(_escaped(table.types), of_lane),
        _pick(_escaped([name or "" for name in table.junctions]), of_lane),
        _pick(_numbers(table.lengths), of_lane),
        _pick(["true" if forward else "false" for forward in table.forward], of_lane),
        _pick(lane_names, lanes.left_lane.tolist()),
        _pick(lane_names, lanes.right_lane.tolist()),
        _pick(_escaped(graph.segments.ids), lanes.segment.tolist()),
    ]
    return map(template.__mod__, zip(*columns, strict=True))


def _walk_nodes(graph: MapGraph, names: Sequence[str]) -> Iterable[str]:
    walks = graph.walks
    template = _node_template("pedestrian", [*WALK_NODE_COLUMNS, "roadside", "segment"])
    columns = [
        names,
        *(_numbers(getattr(walks, name)) for name in WALK_NODE_COLUMNS),
        _pick(["true" if beside else "false" for beside in walks.roadside], walks.lane.tolist()),
        _pick(_escaped(graph.segments.ids), walks.segment.tolist()),
    ]
    return map(template.__mod__, zip(*columns, strict=True))


def _lane_edges(graph: MapGraph, names: Sequence[str]) -> Iterable[str]:
    lanes = graph.lanes
    words = [relation.name.lower() for relation in Relation]
    template = _edge_template(["relation", "length"])
    columns = [
        _pick(names, lanes.source.tolist()),
        _pick(names, lanes.target.tolist()),
        _pick(words, lanes.relation.tolist()),
        _numbers(lanes.length),
    ]
    return map(template.__mod__, zip(*columns, strict=True))


def _walk_edges(graph: MapGraph, names: Sequence[str]) -> Iterable[str]:
    walks = graph.walks
    words = [kind.name.lower() for kind in WalkKind]
    template = _edge_template(["relation", "length", "crosswalk"])
    columns = [
        _pick(names, walks.source.tolist()),
        _pick(names, walks.target.tolist()),
        _pick(words, walks.kind.tolist()),
        _numbers(walks.length),
        _escaped(walks.crosswalk),
    ]
    return map(template.__mod__, zip(*columns, strict=True))


def _node_template(kind: str, attributes: Sequence[str]) -> str:
    data = "".join(f'<data key="n_{name}">%s</data>' for name in attributes)
    return f'<node id="%s"><data key="n_kind">{kind}</data>{data}</node>\n'


def _edge_template(attributes: Sequence[str]) -> str:
    data = "".join(f'<data key="e_{name}">%s</data>' for name in attributes)
    return f'<edge source="%s" target="%s">{data}</edge>\n'


def _pick(values: Sequence[str], rows: Sequence[int]) -> list[str]:
    return [values[row] for row in rows]


def _escaped(values: Sequence[str]) -> list[str]:
    text = "".join(values)
    if any(character in text for character in _SPECIAL):
        return [escape(value, _ENTITIES) for value in values]
    return list(values)


def _number(value: float) -> str:
    return _numbers(np.array([value]))[0]


def _numbers(values: Array) -> list[str]:
    """Shortest text that reads back as the same number, in the words of XML Schema."""
    texts = list(map(repr, values.tolist()))
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        words = {"inf": "INF", "-inf": "-INF", "nan": "NaN"}
        return [words.get(text, text) for text in texts]
    return texts
