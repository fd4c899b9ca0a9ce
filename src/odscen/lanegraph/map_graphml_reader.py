"""Reads what :mod:`odscen.lanegraph.map_graphml` writes, also after networkx rewrote it."""

from __future__ import annotations

import io
import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NoReturn

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
from odscen.lanegraph.query import WALK_PREFIX, split_node_id

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from odscen.base.arrays import Int32Array

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
