"""The graph form of a scenario: the induced subgraph with the actors written on it (R31, R43).

A directed multigraph of networkx whose nodes are those of the region of interest, on lanes and on
walks (``kind`` vehicle or pedestrian). A spawn node carries its actor or flow: fields of the
document with the prefix ``actor_`` or ``flow_``, and with ``order`` their place in the document. An
edge with ``relation`` ``goal`` leads from the spawn to the goal. What remains of the document is in
the attributes of the graph. Paths on foot are undirected in the map and stored as two edges.

Graph form and document convert into each other without loss. A graph that a program has filled in
may leave out ids and orders: they are then given in the order of the nodes.

networkx's own writer takes the types of numpy apart and its reader resolves entities; this pair is
for graphs whose attributes are texts, numbers and truth values, which is what the graph form has.
Files that networkx wrote are read too. Reference: http://graphml.graphdrawing.org/specification.html
"""

from __future__ import annotations

import json
import math
from itertools import chain, count
from typing import TYPE_CHECKING, Any, TypeVar
from xml.sax.saxutils import escape, quoteattr

from odscen.base.errors import InputError, LimitError, ScenarioError
from odscen.base.xml_reading import read_xml
from odscen.lanegraph.graph_files import to_networkx
from odscen.scenario.checks.scenario_checks import (
    duplicate_ids,
    map_problems,
    roi_problems,
    shared_nodes,
)
from odscen.scenario.document.json_form import OPTIONAL, without_defaults
from odscen.scenario.document.problems import refuse_errors, validated
from odscen.scenario.document.scenario_document import (
    FORMAT,
    VERSION,
    Actor,
    Flow,
    MapReference,
    Scenario,
)
from odscen.scenario.placing.region import Region

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    import networkx as nx
    from lxml import etree

    from odscen.lanegraph.graphs import MapGraph


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
        "graph": _attribute_types([graph.graph]),
        "node": _attribute_types(data for _, data in graph.nodes(data=True)),
        "edge": _attribute_types(data for _, _, data in edges),
    }
    head = (
        f'<key id="{kind[0]}_{escape(name)}" for="{kind}" attr.name={quoteattr(name)} '
        f'attr.type="{type_}"/>'
        for kind, types in keys.items()
        for name, type_ in types.items()
    )
    nodes = (
        f"<node id={_quote_name(node)}>{_write_data('n', data)}</node>"
        for node, data in graph.nodes(data=True)
    )
    lines = (
        f"<edge source={_quote_name(source)} target={_quote_name(target)}>"
        f"{_write_data('e', data)}</edge>"
        for source, target, data in edges
    )
    return "\n".join(
        chain(
            ["<?xml version='1.0' encoding='UTF-8'?>"],
            ['<graphml xmlns="http://graphml.graphdrawing.org/xmlns">'],
            head,
            ['<graph edgedefault="directed">' + _write_data("g", graph.graph)],
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

    root = _parse_xml(text)
    keys = {
        key.get("id", ""): (key.get("attr.name", ""), key.get("attr.type", "string"))
        for key in root.iter(_NAMESPACE + "key")
    }
    element = root.find(_NAMESPACE + "graph")
    if element is None or element.get("edgedefault") != "directed":
        raise ScenarioError("not a GraphML file with a directed graph")
    graph = nx.MultiDiGraph(**_read_values(element, keys, "graph"))
    for node in element.iterchildren(_NAMESPACE + "node"):
        name = node.get("id", "")
        graph.add_node(name, **_read_values(node, keys, f"node {name}"))
    for edge in element.iterchildren(_NAMESPACE + "edge"):
        source, target = edge.get("source", ""), edge.get("target", "")
        where = f"edge {source} -> {target}"
        if source not in graph or target not in graph:
            raise ScenarioError("one of its nodes is not in the graph", element=where)
        values = _read_values(edge, keys, where)
        graph.add_edge(source, target, key=values.get("relation"), **values)
    return graph


def _parse_xml(text: str) -> etree._Element:
    try:
        root = read_xml(text)
    except LimitError:
        raise
    except InputError as error:
        raise ScenarioError(f"not GraphML: {error.problem}") from error
    if root.getroottree().docinfo.internalDTD is not None:
        raise ScenarioError("not GraphML: a document type declaration is not accepted")
    return root


def _attribute_types(attributes: Iterable[Mapping[str, Any]]) -> dict[str, str]:
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


def _write_data(prefix: str, data: Mapping[str, Any]) -> str:
    return "".join(
        f'<data key="{prefix}_{escape(name)}">{_format_value(value)}</data>'
        for name, value in data.items()
        if value is not None
    )


def _format_value(value: str | float | bool) -> str:
    if isinstance(value, str):
        return escape(value, {"\r": "&#13;"})
    if isinstance(value, bool):
        return "true" if value else "false"
    words = {"inf": "INF", "-inf": "-INF", "nan": "NaN"}
    return words.get(repr(value), repr(value))


def _quote_name(name: object) -> str:
    return quoteattr(str(name))


def _read_values(
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


_One = TypeVar("_One", bound=Actor | Flow)

GOAL = "goal"
"""Relation, and key, of the edge from a spawn to its goal."""

_JSON = (
    "variant", "roi", "environment", "drivers", "demand", "transit", "signals", "measures",
    "simulation", "study", "rules", "criteria", "sumo", "parameters", "formulas",
)  # fmt: skip
"""Graph attributes that hold JSON."""


def to_graph(scenario: Scenario, graph: MapGraph) -> nx.MultiDiGraph:
    """Write a scenario on the induced subgraph of its region.

    Raises
    ------
    ScenarioError
        If the graph cannot carry it: two actors on a node, an actor or goal outside the region, an
        id used twice, or another map.
    """
    problems = [*map_problems(scenario, graph), *shared_nodes(scenario), *duplicate_ids(scenario)]
    refuse_errors([*problems, *(roi_problems(scenario, graph) if scenario.roi else ())])
    region = Region.of(graph, scenario.roi)
    result = _induced_graph(graph, region)
    result.graph.update(_graph_attributes(scenario))
    for order, actor in enumerate(scenario.actors):
        _write_on_nodes(result, "actor", order, actor)
    for order, flow in enumerate(scenario.flows):
        _write_on_nodes(result, "flow", order, flow)
    return result


def from_graph(graph: nx.MultiDiGraph) -> Scenario:
    """Read a scenario from its graph form.

    Raises
    ------
    ScenarioError
        If attributes are missing or their values not possible; names the node.
    """
    about = dict(graph.graph)
    if about.get("format") != FORMAT:
        raise ScenarioError(
            f"not a scenario graph: format is {about.get('format')!r}, expected {FORMAT!r}"
        )
    fields: dict[str, Any] = {
        name: about[name] for name in ("version", "name", "description", "seed") if name in about
    }
    fields["map"] = {
        name: about[f"map_{name}"] for name in MapReference.model_fields if f"map_{name}" in about
    }
    for name in _JSON:
        if name in about:
            fields[name] = _read_json(name, about[name])
    fields["actors"] = tuple(_read_from_nodes(graph, "actor", Actor))
    fields["flows"] = tuple(_read_from_nodes(graph, "flow", Flow))
    return validated(Scenario, fields)


def to_graphml(scenario: Scenario, graph: MapGraph) -> str:
    """Write the graph form as GraphML; the same scenario gives the same text."""
    return write_graphml(to_graph(scenario, graph))


def from_graphml(text: str, *, file: str | None = None) -> Scenario:
    """Read a scenario from the GraphML of its graph form.

    Raises
    ------
    ScenarioError
        If the text is not GraphML, not of a scenario, or has values that are not possible.
    """
    try:
        return from_graph(read_graphml(text))
    except ScenarioError as error:
        error.file = error.file or file
        raise


def _graph_attributes(scenario: Scenario) -> dict[str, Any]:
    data = scenario.model_dump(mode="json")
    for name in OPTIONAL:
        data[name] = without_defaults(scenario, name)
    held = [name for name in _JSON if name not in OPTIONAL or data[name]]
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": scenario.name,
        "description": scenario.description,
        "seed": scenario.seed,
        "map_name": scenario.map.name,
        "map_sha256": scenario.map.sha256,
        "map_spacing": scenario.map.spacing,
        **{name: json.dumps(data[name], ensure_ascii=False) for name in held},
    }


def _induced_graph(graph: MapGraph, region: Region) -> nx.MultiDiGraph:
    """Lane nodes and walk nodes of the region in one directed graph, walks in both directions."""
    import networkx as nx

    lanes, walks = to_networkx(graph)
    inside = set(region.segments)
    result = nx.MultiDiGraph()
    for part in (lanes, walks):
        result.add_nodes_from(
            (node, data) for node, data in part.nodes(data=True) if data["segment"] in inside
        )
    for source, target, relation, data in lanes.edges(keys=True, data=True):
        if source in result and target in result:
            result.add_edge(source, target, key=relation, **data)
    for source, target, data in walks.edges(data=True):
        if source in result and target in result:
            about = {"relation": data["kind"], "length": data["length"]}
            about["crosswalk"] = data["crosswalk"]
            result.add_edge(source, target, key="walk", **about)
            result.add_edge(target, source, key="walk", **about)
    return result


def _write_on_nodes(graph: nx.MultiDiGraph, prefix: str, order: int, actor: Actor | Flow) -> None:
    for what, node in (("spawn", actor.spawn), ("goal", actor.goal)):
        if node is not None and node not in graph:
            raise ScenarioError(
                f"{actor.id!r} has its {what} on {node!r}, which is not inside the region",
                element=f"{prefix}s[{order}].{what}",
            )
    data = actor.model_dump(mode="json", exclude={"spawn", "goal"}, exclude_none=True)
    attributes = {
        f"{prefix}_{name}": json.dumps(value) if isinstance(value, dict | list) else value
        for name, value in data.items()
        if value != []
    }
    graph.nodes[actor.spawn].update({f"{prefix}_order": order, **attributes})
    if actor.goal is not None:
        graph.add_edge(actor.spawn, actor.goal, key=GOAL, relation=GOAL)


def _read_from_nodes(graph: nx.MultiDiGraph, prefix: str, model: type[_One]) -> Iterator[_One]:
    """Actors or flows in their order; those without one follow in the order of the nodes."""
    found: list[tuple[float, str, dict[str, Any]]] = []
    for node, data in graph.nodes(data=True):
        names = [name for name in model.model_fields if data.get(f"{prefix}_{name}") is not None]
        if names:
            fields = {name: data[f"{prefix}_{name}"] for name in names}
            order = data.get(f"{prefix}_order")
            found.append((math.inf if order is None else float(order), node, fields))
    found.sort(key=lambda entry: entry[0])
    taken = {fields.get("id") for _, _, fields in found}
    free = (name for k in count(1) if (name := f"{prefix}-{k}") not in taken)
    for _, node, fields in found:
        fields["spawn"], fields["goal"] = str(node), _goal_of_node(graph, node)
        if "id" not in fields:
            fields["id"] = next(free)
        for name in {"mix", "via", "size"} & fields.keys():
            fields[name] = _read_json(name, fields[name])
        yield _validate_fields(model, fields)


def _goal_of_node(graph: nx.MultiDiGraph, node: str) -> str | None:
    edges = graph.out_edges(node, data="relation")
    goals = [str(target) for _, target, relation in edges if relation == GOAL]
    if len(goals) > 1:
        raise ScenarioError(
            f"edges lead to {len(goals)} goals; there can be one", element=f"node {node}"
        )
    return goals[0] if goals else None


def _validate_fields(model: type[_One], fields: dict[str, Any]) -> _One:
    try:
        return validated(model, fields)
    except ScenarioError as error:
        error.element = f"node {fields['spawn']}"
        raise


def _read_json(name: str, text: object) -> Any:
    try:
        return json.loads(str(text))
    except (ValueError, RecursionError) as error:
        raise ScenarioError(f"attribute {name} is not JSON: {error}") from error
