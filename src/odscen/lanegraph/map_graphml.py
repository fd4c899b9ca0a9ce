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
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

import numpy as np

from odscen.base.errors import GraphFormatError
from odscen.lanegraph.columns import NODE_COLUMNS, WALK_NODE_COLUMNS, Array
from odscen.lanegraph.graphs import MapGraph, Relation, Segments, WalkKind
from odscen.lanegraph.map_graphml_reader import FORMAT, SEGMENT_PREFIX, VERSION, from_graphml
from odscen.lanegraph.query import node_ids, walk_node_ids

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

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


_KEYS = {"graph": GRAPH_KEYS, "node": NODE_KEYS, "edge": EDGE_KEYS}

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
        raise GraphFormatError("two nodes would have the same id", file=graph.map_name)
    segments, lanes, walks = map(_escape_texts, (segment_names, lane_names, walk_names))
    parts = [
        _write_head(graph),
        *_segment_nodes(graph.segments, segments),
        *_lane_nodes(graph, lanes),
        *_walk_nodes(graph, walks),
        *_lane_edges(graph, lanes),
        *_walk_edges(graph, walks),
        *_segment_edges(graph, segments),
        "</graph>\n</graphml>\n",
    ]
    return "".join(parts).encode()


def _data_key(kind: str, name: str) -> str:
    """Id of a data key: short, because it is written a million times."""
    return f"{kind[0]}{list(_KEYS[kind]).index(name)}"


def _write_head(graph: MapGraph) -> str:
    keys = [
        f'<key id="{_data_key(kind, name)}" for="{kind}" attr.name="{name}" attr.type="{type_}"/>\n'
        for kind, names in _KEYS.items()
        for name, type_ in names.items()
    ]
    values = (
        FORMAT,
        str(VERSION),
        escape(graph.map_name),
        escape(graph.map_sha256),
        _format_number(graph.lanes.spacing),
        _format_number(graph.walks.spacing),
    )
    data = [
        f'<data key="{_data_key("graph", name)}">{value}</data>\n'
        for name, value in zip(GRAPH_KEYS, values, strict=True)
    ]
    return (
        "<?xml version='1.0' encoding='UTF-8'?>\n"
        '<graphml xmlns="http://graphml.graphdrawing.org/xmlns">\n'
        f'{"".join(keys)}<graph edgedefault="directed">\n{"".join(data)}'
    )


def _segment_nodes(segments: Segments, names: Sequence[str]) -> Iterable[str]:
    parts = [[(part.road, part.s_from, part.s_to) for part in of] for of in segments.parts]
    columns = {
        "segment_kind": segments.kinds,
        "length": _format_numbers(segments.lengths),
        "parts": [escape(json.dumps(of)) for of in parts],
    }
    return _write_nodes("segment", names, columns)


def _lane_nodes(graph: MapGraph, names: Sequence[str]) -> Iterable[str]:
    lanes, table = graph.lanes, graph.lanes.lanes
    lane_names = [*_escape_texts(list(map(str, table.keys))), ""]  # -1 is no lane
    of_lane = lanes.lane.tolist()
    columns = {
        **{name: _format_numbers(getattr(lanes, name)) for name in NODE_COLUMNS},
        "lane_type": _pick_rows(_escape_texts(table.types), of_lane),
        "junction": _pick_rows(_escape_texts([name or "" for name in table.junctions]), of_lane),
        "lane_length": _pick_rows(_format_numbers(table.lengths), of_lane),
        "forward": _pick_rows(_format_booleans(table.forward), of_lane),
        "left_lane": _pick_rows(lane_names, lanes.left_lane.tolist()),
        "right_lane": _pick_rows(lane_names, lanes.right_lane.tolist()),
        "segment": _pick_rows(_escape_texts(graph.segments.ids), lanes.segment.tolist()),
    }
    return _write_nodes("vehicle", names, columns)


def _walk_nodes(graph: MapGraph, names: Sequence[str]) -> Iterable[str]:
    walks = graph.walks
    columns = {
        **{name: _format_numbers(getattr(walks, name)) for name in WALK_NODE_COLUMNS},
        "roadside": _pick_rows(_format_booleans(walks.roadside), walks.lane.tolist()),
        "segment": _pick_rows(_escape_texts(graph.segments.ids), walks.segment.tolist()),
    }
    return _write_nodes("pedestrian", names, columns)


def _lane_edges(graph: MapGraph, names: Sequence[str]) -> Iterable[str]:
    lanes = graph.lanes
    words = [relation.name.lower() for relation in Relation]
    columns = {
        "relation": _pick_rows(words, lanes.relation.tolist()),
        "length": _format_numbers(lanes.length),
    }
    sources, targets = lanes.source.tolist(), lanes.target.tolist()
    return _write_edges(_pick_rows(names, sources), _pick_rows(names, targets), columns)


def _walk_edges(graph: MapGraph, names: Sequence[str]) -> Iterable[str]:
    walks = graph.walks
    words = [kind.name.lower() for kind in WalkKind]
    columns = {
        "relation": _pick_rows(words, walks.kind.tolist()),
        "length": _format_numbers(walks.length),
        "crosswalk": _escape_texts(walks.crosswalk),
    }
    sources, targets = walks.source.tolist(), walks.target.tolist()
    return _write_edges(_pick_rows(names, sources), _pick_rows(names, targets), columns)


def _segment_edges(graph: MapGraph, names: Sequence[str]) -> Iterable[str]:
    pairs = graph.segments.adjacency
    columns = {"relation": ["adjacent"] * len(pairs)}
    sources, targets = pairs[:, 0].tolist(), pairs[:, 1].tolist()
    return _write_edges(_pick_rows(names, sources), _pick_rows(names, targets), columns)


def _write_nodes(
    kind: str, names: Sequence[str], columns: Mapping[str, Sequence[str]]
) -> Iterable[str]:
    about = f'"><data key="{_data_key("node", "kind")}">{kind}</data>'
    return _finish_elements([[f'<node id="{name}{about}' for name in names]], "node", columns)


def _write_edges(
    sources: Sequence[str], targets: Sequence[str], columns: Mapping[str, Sequence[str]]
) -> Iterable[str]:
    ends = [
        f'<edge source="{source}" target="{target}">'
        for source, target in zip(sources, targets, strict=True)
    ]
    return _finish_elements([ends], "edge", columns)


def _finish_elements(
    heads: list[list[str]], kind: str, columns: Mapping[str, Sequence[str]]
) -> Iterable[str]:
    """Finish nodes or edges; an empty text is left out, readers take it for granted."""
    parts: list[list[str]] = heads
    for name, values in columns.items():
        start = f'<data key="{_data_key(kind, name)}">'
        parts.append([f"{start}{value}</data>" if value else "" for value in values])
    parts.append([f"</{kind}>\n"] * len(heads[0]))
    return map("".join, zip(*parts, strict=True))


def _pick_rows(values: Sequence[str], rows: Sequence[int]) -> list[str]:
    return [values[row] for row in rows]


def _escape_texts(values: Sequence[str]) -> list[str]:
    text = "".join(values)
    if any(character in text for character in _SPECIAL):
        return [escape(value, _ENTITIES) for value in values]
    return list(values)


def _format_booleans(values: Array) -> list[str]:
    return ["true" if value else "false" for value in values.tolist()]


def _format_number(value: float) -> str:
    return _format_numbers(np.array([value]))[0]


def _format_numbers(values: Array) -> list[str]:
    """Shortest text that reads back as the same number, in the words of XML Schema."""
    texts = list(map(repr, values.tolist()))
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        words = {"inf": "INF", "-inf": "-INF", "nan": "NaN"}
        return [words.get(text, text) for text in texts]
    return texts
