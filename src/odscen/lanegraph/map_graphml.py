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

import io
import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NoReturn
from xml.sax.saxutils import escape

import numpy as np

from odscen.base.errors import GraphFormatError
from odscen.base.ids import JunctionId, LaneKey, RoadId, SegmentId
from odscen.lanegraph.columns import NODE_COLUMNS, WALK_NODE_COLUMNS, Array, check_map_graph
from odscen.lanegraph.graphs import (
    LaneGraph,
    Lanes,
    MapGraph,
    PedestrianGraph,
    Relation,
    SegmentPart,
    Segments,
    WalkKind,
)
from odscen.lanegraph.query import WALK_PREFIX, node_ids, split_node_id, walk_node_ids

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from odscen.base.arrays import Int32Array


# ------------------------------ reads what odscen.lanegraph.map_graphml writes, also after networkx
NAMESPACE = "{http://graphml.graphdrawing.org/xmlns}"
FORMAT = "odscen-map-graph"
VERSION = 1
SEGMENT_PREFIX = "segment."

Attributes = dict[str, str]


@dataclass
class _GraphmlDocument:
    """What the file says, before it is understood; each node and edge a dict of texts."""

    about: Attributes = field(default_factory=dict)
    nodes: dict[str, list[Attributes]] = field(
        default_factory=lambda: {"segment": [], "vehicle": [], "pedestrian": []}
    )
    edges: list[Attributes] = field(default_factory=list)


def from_graphml(data: bytes, *, file: str | None = None) -> MapGraph:
    """Inverse of :func:`~odscen.lanegraph.map_graphml.to_graphml`.

    Raises
    ------
    GraphFormatError
        If the bytes are not such a document.
    """
    from lxml import etree

    try:
        return check_map_graph(_map_graph(_parse_document(data)))
    except GraphFormatError as error:
        error.file = error.file or file
        raise
    except etree.XMLSyntaxError as err:
        raise GraphFormatError(f"it is not XML: {err.msg}", file=file) from err


def _parse_document(data: bytes) -> _GraphmlDocument:
    from lxml import etree

    document = _GraphmlDocument()
    names: dict[str, str] = {}
    tags = [NAMESPACE + tag for tag in ("key", "node", "edge", "graph")]
    source = io.BytesIO(data)
    for _, element in etree.iterparse(
        source, events=("end",), tag=tags, resolve_entities=False, no_network=True, load_dtd=False
    ):
        tag = element.tag[len(NAMESPACE) :]
        if tag == "key":
            names[element.get("id", "")] = element.get("attr.name", "")
            continue
        values = {
            names.get(child.get("key", ""), ""): child.text or ""
            for child in element.iterchildren(NAMESPACE + "data")
        }
        if tag == "graph":
            document.about = values
            continue
        _take_element(document, tag, element, values)
        element.clear()
        parent = element.getparent()
        while parent is not None and parent[0] is not element and parent[0].tag in tags[1:3]:
            del parent[0]
    return document


def _take_element(document: _GraphmlDocument, tag: str, element: Any, values: Attributes) -> None:
    if tag == "edge":
        values["source"] = element.get("source", "")
        values["target"] = element.get("target", "")
        document.edges.append(values)
        return
    values["id"] = element.get("id", "")
    kind = values.get("kind", "")
    if kind not in document.nodes:
        _refuse_place(f"node {values['id']}", f"its kind is {kind!r}")
    document.nodes[kind].append(values)


def _map_graph(document: _GraphmlDocument) -> MapGraph:
    about = document.about
    if about.get("format") != FORMAT:
        raise GraphFormatError("it is not an odscen map graph")
    if about.get("version") != str(VERSION):
        raise GraphFormatError(f"version is {about.get('version')}; this odscen reads {VERSION}")
    index = {
        node["id"]: (kind, row)
        for kind, nodes in document.nodes.items()
        for row, node in enumerate(nodes)
    }
    edges = _EdgeRows(document.edges, index)
    segment_rows = {
        node["id"].removeprefix(SEGMENT_PREFIX): row
        for row, node in enumerate(document.nodes["segment"])
    }
    return MapGraph(
        map_name=_read_text(about, "map_name", "graph"),
        map_sha256=_read_text(about, "map_sha256", "graph"),
        segments=_read_segments(document.nodes["segment"], edges),
        lanes=_lane_graph(document, segment_rows, edges),
        walks=_read_walks(document, segment_rows, edges),
    )


class _EdgeRows:
    """The edges by what they relate, as rows of node numbers, sorted as the model wants them."""

    def __init__(self, edges: list[Attributes], index: dict[str, tuple[str, int]]) -> None:
        self._index = index
        self._of: dict[str, list[tuple[int, int, int, Attributes]]] = {}
        codes = {
            **{relation.name.lower(): ("vehicle", int(relation)) for relation in Relation},
            **{kind.name.lower(): ("pedestrian", int(kind)) for kind in WalkKind},
            "adjacent": ("segment", 0),
        }
        for edge in edges:
            place = f"edge {edge['source']} -> {edge['target']}"
            kind, code = codes.get(edge.get("relation", ""), ("", 0))
            if not kind:
                _refuse_place(place, f"its relation is {edge.get('relation', '')!r}")
            source, target = (
                self._end_row(edge["source"], kind),
                self._end_row(edge["target"], kind),
            )
            self._of.setdefault(kind, []).append((source, target, code, edge))

    def _end_row(self, name: str, kind: str) -> int:
        actual, row = self._index.get(name, ("", 0))
        if actual != kind:
            _refuse_place(
                f"node {name}", f"an edge needs it as {kind}; it is {actual or 'not there'}"
            )
        return row

    def directed(self, kind: str) -> tuple[Int32Array, Int32Array, Array, list[Attributes]]:
        """Source, target, code and attributes, sorted by (source, code, target)."""
        rows = sorted(self._of.get(kind, []), key=lambda row: (row[0], row[2], row[1]))
        return _transpose_rows(rows)

    def undirected(self, kind: str) -> tuple[Int32Array, Int32Array, Array, list[Attributes]]:
        """Return the same with source < target, sorted by (source, target)."""
        rows = [(min(i, j), max(i, j), code, edge) for i, j, code, edge in self._of.get(kind, [])]
        rows.sort(key=lambda row: row[:3])
        return _transpose_rows(rows)


def _transpose_rows(
    rows: list[tuple[int, int, int, Attributes]],
) -> tuple[Int32Array, Int32Array, Array, list[Attributes]]:
    return (
        np.array([row[0] for row in rows], dtype=np.int32),
        np.array([row[1] for row in rows], dtype=np.int32),
        np.array([row[2] for row in rows], dtype=np.uint8),
        [row[3] for row in rows],
    )


def _read_segments(nodes: list[Attributes], edges: _EdgeRows) -> Segments:
    source, target, _, _ = edges.undirected("segment")
    kinds: Any = tuple(_read_text(node, "segment_kind", node["id"]) for node in nodes)
    return Segments(
        ids=tuple(SegmentId(node["id"].removeprefix(SEGMENT_PREFIX)) for node in nodes),
        kinds=kinds,
        parts=tuple(_read_parts(node) for node in nodes),
        lengths=_read_column(nodes, "length", np.float64),
        adjacency=np.stack([source, target], axis=1),
    )


def _read_parts(node: Attributes) -> tuple[SegmentPart, ...]:
    text = _read_text(node, "parts", node["id"])
    try:
        return tuple(
            SegmentPart(RoadId(str(road)), float(s_from), float(s_to))
            for road, s_from, s_to in json.loads(text)
        )
    except (ValueError, TypeError, RecursionError):
        _refuse_place(f"node {node['id']}", f"its parts are {text[:60]!r}")


def _lane_graph(
    document: _GraphmlDocument, segment_rows: dict[str, int], edges: _EdgeRows
) -> LaneGraph:
    nodes = document.nodes["vehicle"]
    keys, first_node = _lanes_of(nodes, "")
    heads = [nodes[row] for row in first_node[:-1].tolist()]
    lane_rows = {"": -1, **{str(key): row for row, key in enumerate(keys)}}
    source, target, relation, of_edges = edges.directed("vehicle")
    return LaneGraph(
        spacing=_read_spacing(document.about, "spacing"),
        lanes=Lanes(
            keys=keys,
            types=tuple(_read_text(node, "lane_type", node["id"]) for node in heads),
            junctions=tuple(JunctionId(node.get("junction", "")) or None for node in heads),
            lengths=_read_column(heads, "lane_length", np.float64),
            forward=_read_column(heads, "forward", np.bool_),
            first_node=first_node,
        ),
        lane=np.repeat(np.arange(len(keys), dtype=np.int32), np.diff(first_node)),
        left_lane=_read_rows(nodes, "left_lane", lane_rows),
        right_lane=_read_rows(nodes, "right_lane", lane_rows),
        segment=_read_rows(nodes, "segment", segment_rows),
        source=source,
        target=target,
        relation=relation,
        length=_read_column(of_edges, "length", np.float64),
        **{name: _read_column(nodes, name, kind) for name, kind in NODE_COLUMNS.items()},
    )


def _read_walks(
    document: _GraphmlDocument, segment_rows: dict[str, int], edges: _EdgeRows
) -> PedestrianGraph:
    nodes = document.nodes["pedestrian"]
    keys, first_node = _lanes_of(nodes, WALK_PREFIX)
    heads = [nodes[row] for row in first_node[:-1].tolist()]
    source, target, kind, of_edges = edges.undirected("pedestrian")
    return PedestrianGraph(
        spacing=_read_spacing(document.about, "walk_spacing"),
        lane_keys=keys,
        roadside=_read_column(heads, "roadside", np.bool_),
        first_node=first_node,
        lane=np.repeat(np.arange(len(keys), dtype=np.int32), np.diff(first_node)),
        segment=_read_rows(nodes, "segment", segment_rows),
        source=source,
        target=target,
        kind=kind,
        length=_read_column(of_edges, "length", np.float64),
        crosswalk=tuple(edge.get("crosswalk", "") for edge in of_edges),
        **{name: _read_column(nodes, name, type_) for name, type_ in WALK_NODE_COLUMNS.items()},
    )


def _lanes_of(nodes: Sequence[Attributes], prefix: str) -> tuple[tuple[LaneKey, ...], Int32Array]:
    """Find the lanes of the nodes, and the first node of each; nodes must be in order."""
    keys: list[LaneKey] = []
    first: list[int] = []
    for row, node in enumerate(nodes):
        name = node["id"]
        try:
            key, k = split_node_id(name.removeprefix(prefix))
        except ValueError:
            _refuse_place(f"node {name}", f"its id is not {prefix}road.section.lane.k")
        if k == 0:
            keys.append(key)
            first.append(row)
        elif not keys or key != keys[-1] or k != row - first[-1]:
            _refuse_place(f"node {name}", "it does not follow the node before it on its lane")
    if len(set(keys)) != len(keys):
        _refuse_place("nodes", "a lane occurs twice")
    return tuple(keys), np.array([*first, len(nodes)], dtype=np.int32)


_PARSERS: dict[type, Callable[[str], Any]] = {
    np.float64: float,
    np.uint8: int,
    np.bool_: lambda text: {"true": True, "false": False}[text.lower()],
}


def _read_column(rows: Sequence[Attributes], name: str, kind: type) -> Any:
    try:
        texts = [row[name] for row in rows]
    except KeyError:
        _refuse_place("data", f"{name!r} is missing at some nodes or edges")
    try:
        return np.array(list(map(_PARSERS[kind], texts)), dtype=kind)
    except (ValueError, KeyError, OverflowError) as err:
        _refuse_place("data", f"{name!r} has a value of the wrong type: {err}")


def _read_rows(nodes: Sequence[Attributes], name: str, known: dict[str, int]) -> Int32Array:
    try:
        return np.array([known[node.get(name, "")] for node in nodes], dtype=np.int32)
    except KeyError as err:
        _refuse_place("data", f"{name!r} names {err.args[0]!r}, which is not there")


def _read_spacing(about: Attributes, name: str) -> float:
    try:
        return float(_read_text(about, name, "graph"))
    except ValueError:
        _refuse_place("graph", f"{name} is {about[name]!r}")


def _read_text(values: Attributes, name: str, place: str) -> str:
    if name not in values:
        _refuse_place(place, f"{name!r} is missing")
    return values[name]


def _refuse_place(place: str, problem: str) -> NoReturn:
    raise GraphFormatError(problem, element=place)


# --------------------------- A map graph as GraphML, without loss both ways, from and to the arrays
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
