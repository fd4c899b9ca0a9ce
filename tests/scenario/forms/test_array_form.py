from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.base.categories import Category
from odscen.base.errors import InputError, ScenarioError
from odscen.base.given_arrays import Array, npz_bytes
from odscen.lanegraph.graph_npz import from_npz_bytes, to_npz_bytes
from odscen.lanegraph.query import node_ids, walk_node_ids
from odscen.maps.store import Workspace
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.scenario_document import Actor, Flow, MapReference, Scenario
from odscen.scenario.forms.any_form import read_any
from odscen.scenario.forms.array_form import to_arrays
from odscen.scenario.forms.array_reading import from_arrays
from tests.graphs import SHA256, fork
from tests.scenario.strategies import scenarios

GRAPH = fork()
HERE = MapReference(name="toy", sha256=SHA256)
NODES = [*node_ids(GRAPH), *walk_node_ids(GRAPH)]


@st.composite
def on_the_map(draw: st.DrawFn) -> Scenario:
    """A scenario of which some names are places of the map, of whichever graph, and some not."""
    scenario = draw(scenarios)
    place = st.sampled_from(NODES)

    def placed(one: Actor | Flow) -> Actor | Flow:
        fields = {"spawn": draw(place), "goal": draw(st.none() | place)}
        if isinstance(one, Actor) and draw(st.booleans()):
            fields["via"] = tuple(draw(st.lists(place, max_size=3)))
        return one.model_copy(update=fields) if draw(st.booleans()) else one

    return scenario.model_copy(
        update={
            "actors": tuple(placed(one) for one in scenario.actors),
            "flows": tuple(placed(one) for one in scenario.flows),
            "roi": (*scenario.roi, *draw(st.lists(st.sampled_from(GRAPH.segments.ids)))),
        }
    )


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(on_the_map())
def test_any_document_comes_back_from_its_arrays_byte_for_byte(scenario: Scenario) -> None:
    arrays = to_arrays(scenario, GRAPH)
    assert from_arrays(arrays) == scenario
    data = npz_bytes(arrays)
    assert dumps(read_any(data)) == dumps(scenario)
    assert npz_bytes(to_arrays(read_any(data), GRAPH)) == data


SUITES = sorted((Path(__file__).parents[3] / "suites" / "scenarios").glob("*.json"))


@pytest.mark.parametrize("file", SUITES, ids=lambda file: file.name.partition(".")[0])
def test_every_scenario_of_the_shipped_suite_comes_back_byte_for_byte(file: Path) -> None:
    """Whatever its map: names that the toy graph does not have travel in the document."""
    scenario = loads(file.read_bytes())
    elsewhere = replace(
        GRAPH,
        map_sha256=scenario.map.sha256,
        lanes=replace(GRAPH.lanes, spacing=scenario.map.spacing),
    )
    assert dumps(from_arrays(to_arrays(scenario, elsewhere))) == dumps(scenario)


def test_formulas_rules_and_all_else_without_a_column_travel_in_the_document() -> None:
    data = json.loads(dumps(example()))
    data |= {
        "parameters": {"v": {"value": 9.5, "unit": "m/s"}},
        "rules": [{"id": "go", "actor": "car-1", "when": {"speed": {"above": 3}},
                   "then": [{"stop": {}}]}],
        "simulation": {"duration": 60, "step_length": 0.1, "pedestrians": "nonInteracting"},
        "criteria": ["arrived >= 1"],
    }  # fmt: skip
    data["actors"][0]["speed"] = "$v"
    scenario = loads(json.dumps(data))
    arrays = to_arrays(scenario, GRAPH)
    assert arrays["actor_speed"][0] == 9.5
    assert from_arrays(arrays) == scenario
    assert '"speed": "$v"' in dumps(from_arrays(arrays))
    faster = from_arrays({**arrays, "actor_speed": arrays["actor_speed"] + 1})
    assert '"speed": 10.5' in dumps(faster)  # set since, and no formula any more
    assert faster.formulas == {}


def test_the_graphs_of_the_map_come_back_from_the_same_arrays() -> None:
    data = npz_bytes(to_arrays(example(), GRAPH))
    assert to_npz_bytes(from_npz_bytes(data)) == to_npz_bytes(GRAPH)


def test_columns_have_the_numbers_of_the_document() -> None:
    arrays = to_arrays(example(), GRAPH)
    assert arrays["actor_node"].tolist() == [NODES.index("1.0.-1.1"), 0]
    assert walk_node_ids(GRAPH)[0] == example().actors[1].spawn
    assert arrays["actor_category"].tolist() == [0, 6]
    assert arrays["actor_speed"].tolist() == pytest.approx([12.5, np.nan], nan_ok=True)
    assert arrays["actor_goal"].tolist() == [NODES.index("2.0.-1.3"), -1]
    assert arrays["actor_ego"].tolist() == [True, False]
    assert arrays["flow_mix"].tolist() == [[3, 0, 1, 0, 0, 0, 0]]
    assert arrays["flow_per_hour"].tolist() == [300]
    assert arrays["roi"].tolist() == [GRAPH.segments.ids.index(one) for one in example().roi]
    assert (arrays["seed"], arrays["duration"], arrays["step_length"]) == (7, 600, 0.5)
    remains = json.loads(arrays["document"].tobytes())
    assert remains["actors"] == [{"model": "vehicle.audi.tt"}, {}]
    assert remains["flows"] == [{"profile": "weekday", "mix": ["truck", "car"]}]


def example() -> Scenario:
    return Scenario(
        name="one",
        map=HERE,
        seed=7,
        roi=("r1", "j9", "r2"),
        actors=(
            Actor(
                id="car-1", category=Category.CAR, spawn="1.0.-1.1", goal="2.0.-1.3", speed=12.5,
                model="vehicle.audi.tt", ego=True,
            ),
            Actor(id="anna", category=Category.PEDESTRIAN, spawn=walk_node_ids(GRAPH)[0]),
        ),
        flows=(
            Flow(
                id="in", spawn="1.0.-1.0", per_hour=300, profile="weekday",
                mix={Category.TRUCK: 1.0, Category.CAR: 3.0},
            ),
        ),
    )  # fmt: skip


# ---------------------------------------------------------------------------- changed by learners
def test_a_speed_that_is_changed_changes_that_line_only() -> None:
    arrays = to_arrays(example(), GRAPH)
    arrays["actor_speed"][0] = 8.25
    before, after = (dumps(one).splitlines() for one in (example(), from_arrays(arrays)))
    differing = [one for one in zip(before, after, strict=True) if one[0] != one[1]]
    assert [line.count('"speed": 8.25') for _, line in differing] == [1]


def of_actors(arrays: dict[str, Array]) -> list[str]:
    return [name for name in arrays if name.startswith("actor_")]


def test_rows_are_removed_and_the_others_keep_what_has_no_column() -> None:
    arrays = to_arrays(example(), GRAPH)
    kept = arrays | {name: arrays[name][::-1][:1] for name in of_actors(arrays)}
    assert from_arrays(kept).actors == example().actors[1:]
    none = arrays | {name: arrays[name][:0] for name in of_actors(arrays)}
    assert from_arrays(none).actors == ()


def test_a_row_that_is_added_is_an_actor_with_a_free_id_and_the_checks_accept_it(
    tmp_path: Path,
) -> None:
    arrays = to_arrays(example(), GRAPH)
    more = arrays | {name: arrays[name][[0, 1, 0]] for name in of_actors(arrays)}
    more["actor_id"][2], more["actor_row"][2], more["actor_ego"][2] = "", -1, False
    more["actor_node"][2] = NODES.index("1.0.-1.5")
    changed = from_arrays(more)
    assert changed.actors[:2] == example().actors
    new = changed.actors[2]
    assert (new.id, new.spawn, new.goal, new.model) == ("car-2", "1.0.-1.5", "2.0.-1.3", None)
    assets = Workspace.open(tmp_path).assets()
    found = check(changed, GRAPH, assets)
    assert [one.message for one in found if one.severity == "error"] == []


def test_what_can_be_written_but_not_driven_is_refused_by_the_checks_with_a_reason(
    tmp_path: Path,
) -> None:
    arrays = to_arrays(example(), GRAPH)
    arrays["actor_node"][0] = arrays["flow_node"][0]
    arrays["actor_ego"][:] = True
    found = check(from_arrays(arrays), GRAPH, Workspace.open(tmp_path).assets())
    errors = {one.code for one in found if one.severity == "error"}
    assert errors == {"ego_not_vehicle", "node_taken", "several_egos"}


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("actor_node", [99_999, 0], "array actor_node: row 0: there is no node 99999"),
        ("actor_node", [0.5, 0.0], "array actor_node: it is .* float64, not a column of whole"),
        ("actor_goal", [0], "array actor_goal: it has 1 rows; its table has 2"),
        ("actor_category", [0, 9], "array actor_category: row 1: 9 is not 0 to 6"),
        ("actor_style", [0, 7], "array actor_style: row 1: 7 is not 0 to 2 or 255"),
        ("actor_row", [0, 5], "array actor_row: row 1: 5 is not 0 to 1 or -1"),
        ("actor_speed", [700.0, 1.0], "array actor_speed, row 0: .* 100, not 700"),
        ("actor_speed", [np.inf, 1.0], "array actor_speed, row 0: .*finite"),
        ("actor_ego", [1, 0], "array actor_ego: it is .* int64, not a column of true or false"),
        ("actor_via", [[1], [99_999]], "array actor_via: row 1: there is no node 99999"),
        ("flow_mix", [[1.0]], "array flow_mix: it is .*, not 1 rows of 7 numbers"),
        ("flow_mix", [[-1.0] * 7], "flows.0..mix.car: .*greater than 0, not -1"),
        ("flow_per_hour", [np.nan], "per_hour.*Field required"),
        ("roi", [0, 77], "array roi: row 1: there is no segment 77"),
        ("seed", [1, 2], "array seed: it is .*, not one value"),
        ("duration", np.array(np.nan), "simulation.duration"),
        ("environment_value", [1.0], "array environment_value: it has 1 rows"),
        ("document", np.frombuffer(b"{", dtype=np.uint8), "array document: it is not JSON"),
        ("document", np.frombuffer(b"[]", dtype=np.uint8), "array document: .*not a JSON object"),
        ("about", np.array("{}"), "array about: it does not say which arrays these are"),
        ("map", np.array(["toy", "1" * 64]), "array map: .*the document of another map"),
        ("lane_first_node", np.array([0, 1], dtype=np.int32), "first_node of lanes"),
    ],
)
def test_arrays_that_cannot_be_are_refused_by_name_and_value(
    name: str, value: Array | list[object], said: str
) -> None:
    arrays = to_arrays(example(), GRAPH) | {name: np.asarray(value)}
    with pytest.raises(InputError, match=said) as refused:
        read_any(npz_bytes(arrays), file="mine.npz")
    assert str(refused.value).startswith("mine.npz: ")


@pytest.mark.parametrize("name", sorted(to_arrays(example(), GRAPH)))
def test_an_array_that_is_missing_is_named(name: str) -> None:
    arrays = to_arrays(example(), GRAPH)
    del arrays[name]
    with pytest.raises(InputError, match="missing") as refused:
        from_arrays(arrays)
    assert name in str(refused.value)


def test_a_scenario_of_another_map_is_not_written() -> None:
    other = example().model_copy(update={"map": MapReference(name="toy", sha256="1" * 64)})
    with pytest.raises(ScenarioError, match="made on map 'toy'"):
        to_arrays(other, GRAPH)
