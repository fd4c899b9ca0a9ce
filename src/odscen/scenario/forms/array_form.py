"""The array form of a scenario: numbers in columns, the rest as JSON, and the map's graphs (R65).

A row of ``actor_...`` is an actor, a row of ``flow_...`` a flow. ``document`` has what has no
column, with the actors and flows that rows were written of: ``actor_row`` says which. Rows may be
changed, removed and added. Array form and document convert into each other without loss; names,
units and types of all arrays are in ``docs/learning-formats.md``.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from odscen.base.categories import Category
from odscen.lanegraph.graph_npz import graph_arrays
from odscen.scenario.checks.scenario_checks import map_problems
from odscen.scenario.document.drivers_document import DRIVING_STYLES
from odscen.scenario.document.json_form import OPTIONAL, without_defaults
from odscen.scenario.document.problems import refuse_errors
from odscen.scenario.placing.region import NodePlace, name_of, on_foot, place_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from odscen.base.given_arrays import Array
    from odscen.lanegraph.graphs import MapGraph
    from odscen.scenario.document.scenario_document import Actor, Environment, Flow, Scenario

FORMAT = "odscen-scenario-arrays"
VERSION = 1
NO_NODE = -1
"""In place of a node: of a start one that ``document`` names, of a goal an open one, too."""
OTHER_STYLE = 255
"""In place of a style: a driver set, which ``document`` names."""
CATEGORIES = tuple(Category)
WHOLE = "i"
REAL = "f"
TRUTH = "b"
ACTOR_COLUMNS = {
    "speed": REAL, "lateral_offset": REAL, "depart": REAL, "initial_speed": REAL,
    "ego": TRUTH, "crosses_anywhere": TRUTH, "ignores_red": TRUTH,
}  # fmt: skip
"""Fields of an actor that are numbers; NaN is ``None``."""
FLOW_COLUMNS = {"per_hour": REAL, "begin": REAL, "end": REAL, "speed": REAL, "initial_speed": REAL}
"""Fields of a flow that are numbers."""
RUN_NUMBERS = ("duration", "step_length")
"""Fields of the simulation that are arrays of their own."""
_KINDS: dict[str, type] = {WHOLE: np.int64, REAL: np.float64, TRUTH: np.bool_}


def to_arrays(scenario: Scenario, graph: MapGraph) -> dict[str, Array]:
    """Write a scenario as arrays, with the graphs of its map.

    Raises
    ------
    ScenarioError
        If it was made on another map.
    """
    refuse_errors([*map_problems(scenario, graph)])
    about = {"format": FORMAT, "version": VERSION, "scenario": scenario.name}
    document = _remaining_document(scenario)
    return {
        "about": np.array(json.dumps(about, ensure_ascii=False)),
        "seed": np.array(scenario.seed, dtype=np.int64),
        **{name: np.array(getattr(scenario.simulation, name)) for name in RUN_NUMBERS},
        **_environment_arrays(scenario.environment),
        **_region_arrays(scenario, graph, document),
        **_actor_arrays(scenario.actors, graph, document),
        **_flow_arrays(scenario.flows, graph, document),
        "document": np.frombuffer(
            json.dumps(document, ensure_ascii=False).encode(), dtype=np.uint8
        ),
        **graph_arrays(graph),
    }


def _remaining_document(scenario: Scenario) -> dict[str, Any]:
    """What has no column, as JSON data; actors, flows and region come with their columns."""
    held = ("name", "description", "map", "simulation")
    data = scenario.model_dump(mode="json", include={*held})
    data["simulation"] = scenario.simulation.model_dump(
        mode="json", exclude_defaults=True, exclude={*RUN_NUMBERS}
    )
    data |= {name: without_defaults(scenario, name) for name in OPTIONAL}
    return {name: value for name, value in data.items() if value or name in held}


def _environment_arrays(environment: Environment) -> dict[str, Array]:
    return {
        "environment_preset": np.array(environment.preset),
        "environment_affects_driving": np.array(environment.affects_driving),
        "environment_parameter": texts(environment.parameters),
        "environment_value": np.array([*environment.parameters.values()], dtype=np.float64),
    }


def _region_arrays(
    scenario: Scenario, graph: MapGraph, document: dict[str, Any]
) -> dict[str, Array]:
    rows: dict[str, int] = {name: row for row, name in enumerate(graph.segments.ids)}
    found = np.array([rows.get(name, -1) for name in scenario.roi], dtype=np.int64)
    if np.any(found < 0):
        document["roi"] = [*scenario.roi]
    return {"roi": found}


def _actor_arrays(
    actors: Sequence[Actor], graph: MapGraph, document: dict[str, Any]
) -> dict[str, Array]:
    walks = [on_foot(actor.category) for actor in actors]
    node = _node_indices([actor.spawn for actor in actors], walks, graph)
    goal = _node_indices([actor.goal for actor in actors], walks, graph)
    via = _via_indices(actors, walks, graph)
    style = [DRIVING_STYLES.index(actor.style) if actor.style in DRIVING_STYLES else OTHER_STYLE
             for actor in actors]  # fmt: skip
    document["actors"] = [
        _remaining_fields(
            actor,
            {"id", "category", *ACTOR_COLUMNS}
            | _fields_with_index(spawn=node[row], goal=goal[row])
            | ({"via"} if np.all(via[row, : len(actor.via)] >= 0) else set())
            | ({"style"} if style[row] != OTHER_STYLE else set()),
        )
        for row, actor in enumerate(actors)
    ]
    return {
        "actor_id": texts(actor.id for actor in actors),
        "actor_row": np.arange(len(actors)),
        "actor_category": np.array(
            [CATEGORIES.index(actor.category) for actor in actors], dtype=np.uint8
        ),
        "actor_node": node,
        "actor_goal": goal,
        "actor_via": via,
        "actor_style": np.array(style, dtype=np.uint8),
        **_column_arrays("actor", ACTOR_COLUMNS, actors),
    }


def _flow_arrays(
    flows: Sequence[Flow], graph: MapGraph, document: dict[str, Any]
) -> dict[str, Array]:
    places = [place_of(graph, flow.spawn) for flow in flows]
    walks = [place is not None and place.walk for place in places]
    node = _node_indices([flow.spawn for flow in flows], walks, graph)
    goal = _node_indices([flow.goal for flow in flows], walks, graph)
    document["flows"] = [
        _remaining_fields(
            flow, {"id", "mix", *FLOW_COLUMNS} | _fields_with_index(spawn=node[row], goal=goal[row])
        )
        | _mix_order(flow)
        for row, flow in enumerate(flows)
    ]
    mixes = [[flow.mix.get(category, 0.0) for category in CATEGORIES] for flow in flows]
    return {
        "flow_id": texts(flow.id for flow in flows),
        "flow_row": np.arange(len(flows)),
        "flow_on_foot": np.array(walks, dtype=np.bool_),
        "flow_node": node,
        "flow_goal": goal,
        "flow_mix": np.array(mixes, dtype=np.float64).reshape(-1, len(CATEGORIES)),
        **_column_arrays("flow", FLOW_COLUMNS, flows),
    }


def _mix_order(flow: Flow) -> dict[str, Any]:
    """Categories of a mix that is not written in their usual order."""
    order = [*flow.mix]
    return {} if order == sorted(order, key=CATEGORIES.index) else {"mix": [*map(str, order)]}


def _column_arrays(
    table: str, columns: dict[str, str], ones: Sequence[Actor] | Sequence[Flow]
) -> dict[str, Array]:
    found: dict[str, Array] = {}
    for name, kind in columns.items():
        values = [getattr(placed, name) for placed in ones]
        given = [np.nan if value is None else value for value in values]
        found[f"{table}_{name}"] = np.array(given, dtype=_KINDS[kind])
    return found


def _node_indices(names: Sequence[str | None], walks: Sequence[bool], graph: MapGraph) -> Array:
    """Index of each node on the graph of its road user; :data:`NO_NODE` if it is not there."""
    found = np.full(len(names), NO_NODE, dtype=np.int64)
    for row, (name, walk) in enumerate(zip(names, walks, strict=True)):
        place = None if name is None else place_of(graph, name)
        if place is not None and place.walk == walk and name_of(graph, place) == name:
            found[row] = place.node
    return found


def _via_indices(actors: Sequence[Actor], walks: Sequence[bool], graph: MapGraph) -> Array:
    """Shape ``(A, V)``, filled up with :data:`NO_NODE`; a row with an unknown node has none."""
    found = np.full((len(actors), max((len(actor.via) for actor in actors), default=0)), NO_NODE)
    for row, user in enumerate(actors):
        nodes = _node_indices(user.via, [walks[row]] * len(user.via), graph)
        if np.all(nodes >= 0):
            found[row, : len(nodes)] = nodes
    return found


def _fields_with_index(**nodes: int) -> set[str]:
    """Fields whose node has an index."""
    return {name for name, node in nodes.items() if node >= 0}


def _remaining_fields(actor: Actor | Flow, columns: set[str]) -> dict[str, Any]:
    return actor.model_dump(mode="json", exclude_defaults=True, exclude=columns)


def texts(values: Iterable[str]) -> Array:
    """Texts as an array, of which an empty one has a type as well."""
    listed = [*values]
    return np.array(listed, dtype=np.str_) if listed else np.empty(0, dtype="<U1")


def node_name(graph: MapGraph, node: int, *, walk: bool) -> str:
    """Id of a node of the lane graph or, with ``walk``, of the pedestrian graph."""
    return name_of(graph, NodePlace(walk, node))
