from typing import Any

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.base.categories import Category
from odscen.base.errors import ScenarioError
from odscen.lanegraph.query import node_ids, walk_node_ids
from odscen.scenario import edits
from odscen.scenario.document.scenario_document import Actor, Flow, MapReference, Scenario
from odscen.scenario.forms.any_form import read_any
from odscen.scenario.forms.graph_form import from_graph, from_graphml, to_graph, to_graphml
from tests.graphs import SHA256, fork
from tests.scenario.strategies import actors, drivers, environments, flows, labels, names, signals

GRAPH = fork()
WHOLE = ("r1", "j9", "r2", "r3")
NODES = [*node_ids(GRAPH), *walk_node_ids(GRAPH)]


@st.composite
def placed(draw: st.DrawFn) -> Scenario:
    """A scenario on distinct spawn nodes with distinct ids; not necessarily one that runs."""
    people = draw(st.lists(actors, max_size=5, unique_by=lambda actor: actor.id))
    moving = draw(st.lists(flows, max_size=3, unique_by=lambda flow: flow.id))
    moving = [flow for flow in moving if flow.id not in {one.id for one in people}]
    count = len(people) + len(moving)
    spawns = draw(st.lists(st.sampled_from(NODES), min_size=count, max_size=count, unique=True))
    goals = draw(st.lists(st.none() | st.sampled_from(NODES), min_size=count, max_size=count))
    ones: list[Any] = [
        one.model_copy(update={"spawn": spawn, "goal": goal})
        for one, spawn, goal in zip([*people, *moving], spawns, goals, strict=True)
    ]
    return Scenario(
        name=draw(labels),
        description=draw(names),
        map=MapReference(name="toy", sha256=SHA256),
        seed=draw(st.integers(0, 2**31 - 1)),
        roi=WHOLE,
        environment=draw(environments),
        actors=tuple(one for one in ones if isinstance(one, Actor)),
        flows=tuple(one for one in ones if isinstance(one, Flow)),
        drivers=draw(drivers),
        signals=draw(signals),
    )


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(placed())
def test_document_graph_and_graphml_convert_without_loss(scenario: Scenario) -> None:
    assert from_graph(to_graph(scenario, GRAPH)) == scenario
    text = to_graphml(scenario, GRAPH)
    assert from_graphml(text) == scenario
    assert read_any(text.encode()) == scenario


def example() -> Scenario:
    one = edits.new_scenario(GRAPH, name="test", roi=("r1", "j9"), description="a\nb <&> \"'")
    one = edits.add_actor(one, GRAPH, category="car", spawn="1.0.-1.20", speed=12.5)
    one = edits.add_actor(one, GRAPH, category="bus", spawn="1.0.-1.3", goal="90.0.-1.9")
    one = edits.add_actor(one, GRAPH, category="pedestrian", spawn="ped.1.0.-2.3")
    return edits.add_flow(one, GRAPH, spawn="1.0.1.0", per_hour=90)


def test_the_graph_is_the_induced_subgraph_with_actors_on_their_nodes() -> None:
    graph = to_graph(example(), GRAPH)
    kinds = nx.get_node_attributes(graph, "kind")
    assert sum(kind == "vehicle" for kind in kinds.values()) == 50 + 50 + 10 + 9
    assert sum(kind == "pedestrian" for kind in kinds.values()) == 50
    assert graph.nodes["1.0.-1.20"]["actor_category"] == "car"
    assert graph.nodes["1.0.-1.20"]["actor_speed"] == 12.5
    assert graph.nodes["1.0.1.0"]["flow_per_hour"] == 90.0
    goals = [(u, v) for u, v, r in graph.edges(data="relation") if r == "goal"]
    assert goals == [("1.0.-1.3", "90.0.-1.9")]
    assert graph.has_edge("ped.1.0.-2.1", "ped.1.0.-2.0")
    assert graph.graph["map_sha256"] == SHA256


def test_graphml_is_read_by_networkx_and_read_back_after_it_rewrote_it(tmp_path: Any) -> None:
    path = tmp_path / "x.graphml"
    path.write_text(to_graphml(example(), GRAPH), encoding="utf-8")
    graph = nx.read_graphml(path, force_multigraph=True)
    assert graph.nodes["1.0.-1.20"]["actor_speed"] == 12.5
    nx.write_graphml(graph, path)
    assert read_any(path.read_text(encoding="utf-8")) == example()


def test_a_graph_that_a_program_filled_needs_neither_ids_nor_orders() -> None:
    graph = to_graph(edits.new_scenario(GRAPH, name="empty", roi=("r1",)), GRAPH)
    graph.nodes["1.0.-1.9"]["actor_category"] = "van"
    graph.nodes["1.0.-1.3"]["actor_category"] = "car"
    graph.add_edge("1.0.-1.3", "1.0.-1.49", relation="goal")
    filled = from_graph(graph)
    assert [(a.id, a.category, a.spawn, a.goal) for a in filled.actors] == [
        ("actor-1", Category.CAR, "1.0.-1.3", "1.0.-1.49"),
        ("actor-2", Category.VAN, "1.0.-1.9", None),
    ]


def test_what_the_graph_cannot_carry_is_refused() -> None:
    car = Actor(id="a", category=Category.CAR, spawn="1.0.-1.3")
    base = example().model_copy(update={"flows": ()})
    two = base.model_copy(update={"actors": (car, car.model_copy(update={"id": "b"}))})
    with pytest.raises(ScenarioError, match="same node"):
        to_graph(two, GRAPH)
    outside = base.model_copy(update={"actors": (car.model_copy(update={"goal": "2.0.-1.0"}),)})
    with pytest.raises(ScenarioError, match="not inside the region"):
        to_graph(outside, GRAPH)
    other = base.model_copy(update={"map": MapReference(name="toy", sha256="1" * 64)})
    with pytest.raises(ScenarioError, match="sha256"):
        to_graph(other, GRAPH)


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        (">car</data>", ">ship</data>", "category"),
        (">12.5</data>", ">fast</data>", "actor_speed is not a double"),
        ("odscen-scenario", "other", "format"),
        ("</graphml>", "", "not GraphML"),
        ('<edge source="1.0.-1.0"', '<edge source="nowhere"', "not in the graph"),
        ("<graphml", '<!DOCTYPE x [<!ENTITY a "b">]><graphml', "document type"),
        ('edgedefault="directed"', 'edgedefault="undirected"', "directed graph"),
    ],
)
def test_broken_graphml_is_refused_with_the_reason(old: str, new: str, reason: str) -> None:
    text = to_graphml(example(), GRAPH)
    assert old in text
    with pytest.raises(ScenarioError) as caught:
        from_graphml(text.replace(old, new), file="x.graphml")
    assert reason in str(caught.value)
    assert str(caught.value).startswith("x.graphml")


def test_signals_that_are_all_the_maps_leave_no_attribute() -> None:
    assert "signals" not in to_graph(example(), GRAPH).graph
    timed = edits.set_signal_control(example(), control="actuated")
    assert to_graph(timed, GRAPH).graph["signals"] == '{"control": "actuated"}'


def test_the_same_scenario_gives_the_same_text() -> None:
    assert to_graphml(example(), GRAPH) == to_graphml(example(), GRAPH)


def test_the_size_of_a_body_is_kept() -> None:
    one = Actor.model_validate(
        {"id": "a", "category": "car", "spawn": NODES[0], "size": {"length": 1.0, "width": 1.0}}
    )
    scenario = example().model_copy(update={"actors": (one,), "flows": ()})
    assert from_graphml(to_graphml(scenario, GRAPH)).actors == (one,)
