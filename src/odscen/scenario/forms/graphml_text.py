"""networkx multigraphs as GraphML text, typed and deterministic, entities and network off.

networkx's own writer takes the types of numpy apart and its reader resolves entities; this pair is
for graphs whose attributes are texts, numbers and truth values, which is what the graph form has.
Files that networkx wrote are read too. Reference: http://graphml.graphdrawing.org/specification.html
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Any

from odscen.base.errors import InputError, LimitError, ScenarioError
from odscen.base.xml_reading import read_xml
from odscen.base.xml_text import escape, quoteattr

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    import networkx as nx
    from lxml import etree

_NAMESPACE = "{http://graphml.graphdrawing.org/xmlns}"
_TYPES = {bool: "boolean", int: "long", float: "double", str: "string"}
_READERS: dict[str, Callable[[str], Any]] = {
    "boolean": lambda text: {"true": True, "1": True, "false": False, "0": False}[text.lower()],
    "int": int,
    "long": int,
    "float": float,
    "double": float,
    "string": str,
}


def write_graphml(graph: nx.MultiDiGraph) -> str:
    """Write a directed multigraph; nodes, edges and attributes keep their order.

    An attribute that is ``None`` is left out. Where values of an attribute are of several types,
    all are written as the widest.
    """
    edges = list(graph.edges(data=True))
    keys = {
        "graph": _types([graph.graph]),
        "node": _types(data for _, data in graph.nodes(data=True)),
        "edge": _types(data for _, _, data in edges),
    }
    head = (
        f'<key id="{kind[0]}_{escape(name)}" for="{kind}" attr.name={quoteattr(name)} '
        f'attr.type="{type_}"/>'
        for kind, types in keys.items()
        for name, type_ in types.items()
    )
    nodes = (
        f"<node id={_quoted(node)}>{_data('n', data)}</node>"
        for node, data in graph.nodes(data=True)
    )
    lines = (
        f"<edge source={_quoted(source)} target={_quoted(target)}>{_data('e', data)}</edge>"
        for source, target, data in edges
    )
    return "\n".join(
        chain(
            ["<?xml version='1.0' encoding='UTF-8'?>"],
            ['<graphml xmlns="http://graphml.graphdrawing.org/xmlns">'],
            head,
            ['<graph edgedefault="directed">' + _data("g", graph.graph)],
            nodes,
            lines,
            ["</graph>", "</graphml>", ""],
        )
    )


def read_graphml(text: str) -> nx.MultiDiGraph:
    """Read a directed multigraph; edges have their ``relation``, if any, as key.

    Raises
    ------
    ScenarioError
        If the text is not GraphML of a directed graph, or a value is not of its key's type.
    """
    import networkx as nx

    root = _parse(text)
    keys = {
        key.get("id", ""): (key.get("attr.name", ""), key.get("attr.type", "string"))
        for key in root.iter(_NAMESPACE + "key")
    }
    element = root.find(_NAMESPACE + "graph")
    if element is None or element.get("edgedefault") != "directed":
        raise ScenarioError("not a GraphML file with a directed graph")
    graph = nx.MultiDiGraph(**_values(element, keys, "graph"))
    for node in element.iterchildren(_NAMESPACE + "node"):
        name = node.get("id", "")
        graph.add_node(name, **_values(node, keys, f"node {name}"))
    for edge in element.iterchildren(_NAMESPACE + "edge"):
        source, target = edge.get("source", ""), edge.get("target", "")
        where = f"edge {source} -> {target}"
        if source not in graph or target not in graph:
            raise ScenarioError("one of its nodes is not in the graph", element=where)
        values = _values(edge, keys, where)
        graph.add_edge(source, target, key=values.get("relation"), **values)
    return graph


def _parse(text: str) -> etree._Element:
    try:
        root = read_xml(text)
    except LimitError:
        raise
    except InputError as error:
        raise ScenarioError(f"not GraphML: {error.problem}") from error
    if root.getroottree().docinfo.internalDTD is not None:
        raise ScenarioError("not GraphML: a document type declaration is not accepted")
    return root


def _types(attributes: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """GraphML type of each attribute; the widest of boolean, long, double, string."""
    order = list(_TYPES.values())
    found: dict[str, str] = {}
    for data in attributes:
        for name, value in data.items():
            if value is not None:
                type_ = _TYPES[type(value)]
                if order.index(type_) >= order.index(found.get(name, "boolean")):
                    found[name] = type_
    return found


def _data(prefix: str, data: Mapping[str, Any]) -> str:
    return "".join(
        f'<data key="{prefix}_{escape(name)}">{_text(value)}</data>'
        for name, value in data.items()
        if value is not None
    )


def _text(value: str | float | bool) -> str:
    if isinstance(value, str):
        return escape(value, {"\r": "&#13;"})
    if isinstance(value, bool):
        return "true" if value else "false"
    words = {"inf": "INF", "-inf": "-INF", "nan": "NaN"}
    return words.get(repr(value), repr(value))


def _quoted(name: object) -> str:
    return quoteattr(str(name))


def _values(
    element: etree._Element, keys: Mapping[str, tuple[str, str]], where: str
) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for data in element.iterchildren(_NAMESPACE + "data"):
        name, type_ = keys.get(data.get("key", ""), ("", ""))
        if not name:
            continue
        text = data.text or ""
        try:
            values[name] = _READERS[type_](text)
        except (KeyError, ValueError) as error:
            raise ScenarioError(
                f"{name} is not a {type_ or 'value'}: {text[:60]!r}", element=where
            ) from error
    return values
