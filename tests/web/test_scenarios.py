from __future__ import annotations

import inspect
import threading
from pathlib import Path
from string import Formatter
from typing import get_args

import numpy as np
import pytest
from pydantic import TypeAdapter
from starlette.testclient import TestClient

from odscen.app.maps import load_map
from odscen.app.scenarios import SUFFIX, check_scenario
from odscen.base.categories import DEFAULT_BODY, Category
from odscen.lanegraph.query import node_id, node_index
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.document.document_parts import Part
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.measures_document import Measure
from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.document.scenario_document import Actor, Flow, Matrix, Scenario
from odscen.scenario.edits.edit_messages import EDIT_MESSAGES, EditBase
from odscen.scenario.edits.edit_registry import EDIT_ENTRIES
from odscen.scenario.forms.any_form import read_any
from odscen.scenario.placing.region import Region, name_of, place_of
from odscen.scenario.placing.spawn_room import late_for_changes
from odscen.web.application import create_app
from odscen.web.wire.document_changes import changes_between
from tests import own_generator
from tests.web.conftest import CROSSING
from tests.web.json_patch import patched

RULE = {
    "id": "halt",
    "actor": "white",
    "when": {"time": {"after": 4}, "delay": 1},
    "then": [{"brake": {"by": 4, "hold": 2}}],
}
GROUPS = [
    *({"id": f"V{n}", "movements": [f"r{n}"]} for n in range(1, 5)),
    *({"id": f"P{n}", "movements": [f"walk r{n}"]} for n in range(1, 5)),
]
STAGES = [
    {"id": "1", "protected": ["P2", "P4"], "permissive": ["V1", "V3"], "green": 20},
    {"id": "2", "protected": ["P1", "P3"], "permissive": ["V2", "V4"], "green": 15},
]
ALL = (
    ("grow_roi", {"segment": "j10001"}),
    ("grow_roi", {"segment": "r1"}),
    ("extend_roi", {"segments": ["r2", "r3"]}),
    ("add_actor", {"category": "car", "spawn": "SPAWN0", "speed": 12.5, "style": "sporty"}),
    ("add_actor", {"category": "truck", "spawn": "SPAWN1", "id": "big", "depart": 3}),
    ("add_actor", {"category": "pedestrian", "spawn": "WALK0"}),
    ("move_actor", {"actor": "car-1", "spawn": "SPAWN2"}),
    ("set_goal", {"actor": "car-1", "goal": "GOAL2"}),
    ("set_goal", {"actor": "car-1", "goal": None}),
    ("change_actor", {"actor": "car-1", "lateral_offset": 0.2, "speed": None}),
    ("change_actor", {"actor": "big", "category": "bus"}),
    ("copy_actors", {"copies": {"SPAWN3": "car-1", "SPAWN4": "big"}}),
    ("set_ego", {"actor": "car-1"}),
    ("add_flow", {"spawn": "SPAWN5", "per_hour": 300, "mix": {"car": 2, "bus": 1}}),
    ("change_flow", {"flow": "flow-1", "end": 900}),
    ("set_environment", {"preset": "HardRainNoon"}),
    ("set_environment", {"parameters": {"wetness": 20}, "affects_driving": False}),
    ("set_drivers", {"saturation_flow": 1900, "gap_acceptance": 0.5}),
    ("set_signal_control", {"control": "actuated"}),
    ("set_timing", {"junction": "10001", "offset": 5}),
    ("set_green", {"junction": "10001", "stage": "1", "green": 18}),
    ("set_offset", {"junction": "10001", "offset": 7}),
    ("clear_timing", {"junction": "10001"}),
    ("set_timing", {"junction": "10001", "groups": GROUPS, "stages": STAGES}),
    ("set_stage", {"junction": "10001", "stage": "2", "on_call": True}),
    ("set_turn", {"junction": "10001", "approach": "r1", "treatment": "both"}),
    ("set_group", {"junction": "10001", "group": "V2L", "movements": ["r2 left"], "min_green": 9}),
    ("remove_group", {"junction": "10001", "group": "V2L", "into": "V2"}),
    ("add_stage", {"junction": "10001", "stage": "5", "protected": ["P1"], "green": 8}),
    ("remove_stage", {"junction": "10001", "stage": "5"}),
    ("set_intergreen", {"junction": "10001", "ending": "V2", "beginning": "V1", "seconds": 12}),
    ("set_detector", {"junction": "10001", "detector": "D1", "at": "r1", "stages": ["1"]}),
    ("remove_detector", {"junction": "10001", "detector": "D1"}),
    ("set_plan", {"junction": "10001", "plan": "A", "times": ["06:00"]}),
    ("remove_plan", {"junction": "10001", "plan": "A"}),
    ("clear_timing", {"junction": "10001"}),
    ("set_simulation", {"duration": 120}),
    ("set_seed", {"seed": 9}),
    ("rename", {"name": "My crossing", "description": "Two\nlines"}),
    ("shrink_roi", {"segment": "r3", "with_actors": True}),
    ("remove_flow", {"flow": "flow-1"}),
    ("remove_actors", {"actors": ["car-1", "big"]}),
    ("fill_roi", {"share": 0.3, "seed": 4}),
    ("set_clock", {"clock": 25_200}),
    ("set_routes", {"by": "travel_time", "informed": 0.2}),
    ("set_parking", {"end": 0.2, "stay": 600}),
    ("set_zone", {"zone": "west", "segments": ["r1"]}),
    ("set_zone", {"zone": "east", "segments": ["r2"]}),
    ("set_profile", {"profile": "morning", "shares": [1, 3, 2]}),
    ("set_matrix", {"matrix": "am", "trips": [["west", "east", 40]], "profile": "morning"}),
    ("set_counts", {"counts": "survey", "rows": [["r1>j10001", 0, 900, 12]]}),
    ("set_background", {"background": "some", "per_km": 2}),
    ("set_input", {"inflow": "in", "segment": "r1", "direction": "forward", "per_hour": 300}),
    ("remove_demand", {"part": "survey"}),
    ("set_stop", {"stop": "market", "node": "SPAWN3", "length": 12}),
    ("set_line", {"line": "7", "start": "SPAWN2", "stops": [{"stop": "market"}], "headway": 60}),
    ("remove_transit", {"part": "7"}),
    ("set_measure", {"measure": {"id": "shut", "kind": "closure", "places": ["r1>r2"]}}),
    ("remove_measure", {"measure": "shut"}),
    ("add_actor", {"category": "van", "spawn": "SPAWN0", "id": "white"}),
    ("set_study", {"warm_up": 60, "detectors": [{"id": "here", "nodes": ["SPAWN0"]}]}),
    ("set_criteria", {"criteria": ["collided == 0", "mean_delay <= 40 s"]}),
    ("set_parameter", {"parameter": "v", "value": 8, "unit": "m/s", "min": 5, "max": 12}),
    ("set_formula", {"place": "actors/white/speed", "formula": "$v + 1"}),
    ("set_parameter", {"parameter": "v", "value": 9}),
    ("remove_parameter", {"parameter": "v"}),
    ("set_rule", {"rule": RULE}),
    ("remove_rule", {"rule": "halt"}),
)
PARTS = {"set_measure": TypeAdapter(Measure), "set_rule": TypeAdapter(StoryRule)}


@pytest.fixture
def new(client: TestClient) -> str:
    answer = client.post("/api/scenarios", json={"map": CROSSING, "name": "mine"})
    assert answer.status_code == 201
    return "mine"


@pytest.fixture
def places(workspace: Workspace) -> dict[str, str]:
    """Node names for the placeholders above: spawns far apart, a goal, and a walk."""
    loaded = load_map(workspace.map(CROSSING))
    graph = loaded.sumo.graph
    region = Region.of(graph, ["j10001", "r1", "r2", "r3"])
    inside = [
        i
        for i in range(0, len(graph.lanes.x), 8)
        if region.lanes[i] and region.router.goal_candidates(i).size
    ]
    names = {}
    for number, node in enumerate(inside[:8]):
        place = place_of(graph, _node(graph, node))
        assert place is not None
        names[f"SPAWN{number}"] = name_of(graph, place)
        names[f"GOAL{number}"] = _node(graph, int(region.candidates(place)[0]))
    walk = next(i for i in range(len(graph.walks.x)) if region.walks[i])
    return {**names, "WALK0": name_of(graph, type(place)(True, walk))}


def _node(graph, i: int) -> str:
    from odscen.lanegraph.query import node_id

    return node_id(graph, i)


def _filled(value, places):
    if isinstance(value, str):
        return places.get(value, value)
    if isinstance(value, dict):
        return {_filled(k, places): _filled(v, places) for k, v in value.items()}
    return [_filled(one, places) for one in value] if isinstance(value, list) else value


def post_edit(client: TestClient, name: str, version: int, kind: str, /, **arguments: object):
    body = {"version": version, "edits": [{"kind": kind, **arguments}]}
    return client.post(f"/api/scenarios/{name}/edits", json=body)


def test_every_edit_function_is_an_edit_message_and_tried_below() -> None:
    public = set(edits.__all__)
    kinds = set(EDIT_ENTRIES)
    assert kinds == public - {"new_scenario", "eligible_segments", "removable_segments"}
    assert {kind for kind, _ in ALL} == kinds
    assert {
        get_args(message.model_fields["kind"].annotation)[0] for message in EDIT_MESSAGES.values()
    } == kinds


@pytest.mark.parametrize("message", EDIT_MESSAGES.values(), ids=lambda message: message.__name__)
def test_the_words_of_an_edit_need_only_what_it_always_has(message: type[EditBase]) -> None:
    (kind,) = get_args(message.model_fields["kind"].annotation)
    label = Formatter().parse(EDIT_ENTRIES[kind].label)
    named = {name.partition(".")[0] for _, name, _, _ in label if name}
    required = {name for name, field in message.model_fields.items() if field.is_required()}
    assert named <= required


@pytest.mark.parametrize(
    ("kind", "part"),
    [("change_actor", Actor), ("add_actor", Actor), ("change_flow", Flow), ("set_matrix", Matrix)],
)
def test_an_edit_of_a_part_takes_every_field_that_the_part_has(kind: str, part: type[Part]) -> None:
    message = EDIT_MESSAGES[kind]
    assert part.model_fields.keys() <= message.model_fields.keys()


@pytest.mark.slow
def test_edits_over_the_wire_give_the_same_documents_as_in_python(
    client: TestClient, workspace: Workspace, new: str, places: dict[str, str]
) -> None:
    loaded = load_map(workspace.map(CROSSING))
    graph = loaded.sumo.graph
    ours = edits.new_scenario(graph, name="mine")
    state = client.get(f"/api/scenarios/{new}").json()
    for kind, template in ALL:
        arguments = _filled(template, places)
        answer = post_edit(client, new, state["version"], kind, **arguments)
        assert answer.status_code == 200, (kind, answer.text)
        known = {"graph": graph, "lights": loaded.lights, "usable": loaded.usable}
        if part := PARTS.get(kind):  # a part of the document, not its data
            name = kind.removeprefix("set_")
            arguments = {name: part.validate_python(arguments[name])}
        function = getattr(edits, kind)
        wanted = inspect.signature(function).parameters
        before = ours
        ours = function(ours, **{k: v for k, v in known.items() if k in wanted}, **arguments)
        told = [one.model_dump(mode="json") for one in changes_between(before, ours)]
        assert patched(state["document"], told) == answer.json()["document"], kind
        assert answer.json()["version"] == state["version"] + 1
        state = answer.json()
        file = workspace.scenarios / "mine.scenario.json"
        assert file.read_text(encoding="utf-8") == dumps(ours), kind
        assert Scenario.model_validate(state["document"]) == ours
        checked = check_scenario(workspace, ours)
        assert [p["code"] for p in state["problems"]] == [p.code for p in checked]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "arguments"),
    [
        ("grow_roi", {"segment": "r99"}),
        ("grow_roi", {}),
        ("grow_roi", {"segment": "r1", "graph": {}}),
        ("add_actor", {"category": "car", "spawn": "1.0.-1.0"}),
        ("add_actor", {"category": "tank", "spawn": "1.0.-1.0"}),
        ("add_actor", {"category": "car", "spawn": "1.0.-1.0", "wings": 2}),
        ("remove_actors", {"actors": "car-1"}),
        ("copy_actors", {"copies": ["car-1"]}),
        ("set_environment", {"parameters": {"fog": "x"}}),
        ("fill_roi", {"share": 0.3}),  # the region is empty
        ("eligible_segments", {}),
        ("_with", {"name": "x"}),
        ("__class__", {}),
    ],
)
def test_what_an_edit_refuses_changes_nothing(
    client: TestClient, new: str, kind: str, arguments: dict[str, object]
) -> None:
    before = client.get(f"/api/scenarios/{new}").json()
    answer = post_edit(client, new, before["version"], kind, **arguments)
    assert answer.status_code in (404, 422), answer.text
    assert answer.json()["error"]["message"]
    assert client.get(f"/api/scenarios/{new}").json() == before


@pytest.mark.slow
def test_a_region_is_filled_by_an_installed_generator_and_its_options(
    client: TestClient, sampled: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "site").mkdir()
    own_generator.install(tmp_path / "site", monkeypatch)
    offered = {one["name"]: one for one in client.get("/api/generators").json()}
    assert [*offered] == ["reference", "gone", "spread"]
    assert offered["spread"]["options"][0] == {
        "name": "apart", "kind": "integer", "title": "Nodes between two cars", "meaning": "",
        "usual": 12, "low": 4, "high": 400, "choices": [],
    }  # fmt: skip
    version, found = 1, {}
    spread = ({"apart": 60, "category": "truck"}, {"apart": 12})
    for generator, options in (("reference", {}), *(("spread", one) for one in spread)):
        answer = post_edit(
            client, sampled, version, "fill_roi", share=0.3, seed=4, generator=generator,
            options=options,
        )  # fmt: skip
        assert answer.status_code == 200, answer.text
        version = answer.json()["version"]
        actors = answer.json()["document"]["actors"]
        found[generator, options.get("apart")] = actors
        assert [one for one in answer.json()["problems"] if one["severity"] == "error"] == []
    assert len(found["reference", None]) > 5
    assert {one["category"] for one in found["spread", 60]} == {"truck"}
    assert len(found["spread", 12]) > 2 * len(found["spread", 60])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("generator", "options", "status", "said"),
    [
        ("os:system", {}, 404, "no generator named 'os:system'"),
        ("odscen.learning.reference.reference_generator:ReferenceGenerator", {}, 404, "no gene"),
        ("/tmp/mine.py:Mine", {}, 404, "no generator named"),
        ("reference", {"size": 3}, 422, "reference: it has no option 'size'"),
        (None, {"size": 3}, 422, "no generator here"),
        ("reference", {"size": [3]}, 422, ""),
    ],
)
def test_the_page_names_no_module_and_no_option_that_there_is_not(
    client: TestClient,
    sampled: str,
    generator: str | None,
    options: dict[str, object],
    status: int,
    said: str,
) -> None:
    before = client.get(f"/api/scenarios/{sampled}").json()
    answer = post_edit(
        client, sampled, 1, "fill_roi", share=0.3, generator=generator, options=options
    )
    assert answer.status_code == status, answer.text
    assert said in answer.json()["error"]["message"]
    assert client.get(f"/api/scenarios/{sampled}").json() == before


def test_a_stale_version_is_refused_and_told_the_newest(client: TestClient, new: str) -> None:
    first = post_edit(client, new, 1, "set_seed", seed=3)
    assert first.json()["version"] == 2
    for answer in (
        post_edit(client, new, 1, "set_seed", seed=4),
        client.post(f"/api/scenarios/{new}/undo", json={"version": 1}),
    ):
        assert answer.status_code == 409
        assert answer.json()["error"]["current"] == 2
    assert client.get(f"/api/scenarios/{new}").json()["document"]["seed"] == 3


@pytest.mark.slow
def test_edits_in_one_request_are_all_made_or_none_and_one_step(
    client: TestClient, new: str
) -> None:
    grow = [{"kind": "grow_roi", "segment": segment} for segment in ("r1", "j10001")]
    far = {"kind": "grow_roi", "segment": "r99"}
    address = f"/api/scenarios/{new}/edits"
    refused = client.post(address, json={"version": 1, "edits": [*grow, far]})
    assert refused.status_code == 404
    assert client.get(f"/api/scenarios/{new}").json()["document"]["roi"] == []
    assert client.post(address, json={"version": 1, "edits": []}).status_code == 422
    state = client.post(address, json={"version": 1, "edits": grow}).json()
    assert (state["version"], state["undo"]) == (2, "Add segment r1 and 1 more")
    assert state["document"]["roi"] == ["r1", "j10001"]
    state = client.post(f"/api/scenarios/{new}/undo", json={"version": 2}).json()
    assert (state["document"]["roi"], state["undo"]) == ([], None)
    named = client.post(address, json={"version": 3, "edits": grow, "label": "Add all"}).json()
    assert named["undo"] == "Add all"


def test_a_copy_is_a_scenario_of_its_own(client: TestClient, new: str) -> None:
    grown = post_edit(client, new, 1, "grow_roi", segment="r1").json()
    copy = client.post(f"/api/scenarios/{new}/copy", json={})
    assert copy.status_code == 201
    assert copy.json()["name"] != new
    assert copy.json()["document"] == grown["document"] | {"name": copy.json()["name"]}
    assert copy.json()["undo"] is None
    post_edit(client, copy.json()["name"], 1, "grow_roi", segment="j10001")
    assert client.get(f"/api/scenarios/{new}").json()["document"]["roi"] == ["r1"]
    taken = client.post(f"/api/scenarios/{new}/copy", json={"name": new})
    assert taken.status_code == 409
    assert client.post(f"/api/scenarios/{new}/copy", json={"name": "../x"}).status_code == 422
    assert client.post("/api/scenarios/nobody/copy", json={}).status_code == 404


def test_of_two_tabs_that_edit_at_once_exactly_one_wins(client: TestClient, new: str) -> None:
    codes: list[int] = []

    def edit(seed: int) -> None:
        codes.append(post_edit(client, new, 1, "set_seed", seed=seed).status_code)

    threads = [threading.Thread(target=edit, args=(seed,)) for seed in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(codes) == [200] + [409] * 7


@pytest.mark.slow
def test_undo_and_redo_are_named_and_survive_a_restart(
    client: TestClient, workspace: Workspace, new: str
) -> None:
    state = client.get(f"/api/scenarios/{new}").json()
    assert (state["undo"], state["redo"]) == (None, None)
    for segment in ("r1", "j10001"):
        state = post_edit(client, new, state["version"], "grow_roi", segment=segment).json()
    assert state["undo"] == "Add segment j10001"
    state = client.post(f"/api/scenarios/{new}/undo", json={"version": state["version"]}).json()
    assert state["document"]["roi"] == ["r1"]
    assert (state["undo"], state["redo"]) == ("Add segment r1", "Add segment j10001")
    with TestClient(create_app(workspace), base_url="http://localhost") as again:
        reopened = again.get(f"/api/scenarios/{new}").json()
        assert reopened == state
        redone = again.post(f"/api/scenarios/{new}/redo", json={"version": state["version"]})
        assert redone.json()["document"]["roi"] == ["r1", "j10001"]
        nothing = again.post(
            f"/api/scenarios/{new}/redo", json={"version": redone.json()["version"]}
        )
        assert nothing.status_code == 409
        branched = post_edit(again, new, redone.json()["version"], "set_seed", seed=1).json()
        assert branched["redo"] is None


def test_a_file_that_another_program_changed_is_a_new_version_that_can_be_undone(
    client: TestClient, workspace: Workspace, new: str
) -> None:
    file = workspace.scenarios / "mine.scenario.json"
    scenario = edits.set_seed(loads(file.read_text()), seed=77)
    file.write_text(dumps(scenario))
    state = client.get(f"/api/scenarios/{new}").json()
    assert (state["version"], state["document"]["seed"]) == (2, 77)
    assert post_edit(client, new, 1, "set_seed", seed=4).status_code == 409
    back = client.post(f"/api/scenarios/{new}/undo", json={"version": 2}).json()
    assert back["document"]["seed"] == 0


@pytest.mark.slow
def test_scenarios_are_listed_renamed_downloaded_uploaded_and_removed(
    client: TestClient, sampled: str
) -> None:
    (row,) = client.get("/api/scenarios").json()
    assert (row["name"], row["map"]) == (sampled, CROSSING)
    assert row["actors"] > 5
    assert client.put(f"/api/scenarios/{sampled}/name", json={"name": "kept"}).status_code == 200
    assert client.get(f"/api/scenarios/{sampled}").status_code == 404
    document = client.get("/api/scenarios/kept").json()["document"]
    for form in ("json", "graphml"):
        content = client.get(f"/api/scenarios/kept/download?form={form}").content
        assert read_any(content).model_dump(mode="json") == document
        back = client.post("/api/scenarios/upload", files={"file": (f"up.{form}", content)})
        assert back.json()["document"] == document
    names = [row["name"] for row in client.get("/api/scenarios").json()]
    assert sorted(names) == ["kept", "up-1", "up-2"]
    taken = client.put("/api/scenarios/up-1/name", json={"name": "kept"})
    assert taken.status_code == 409
    assert client.delete("/api/scenarios/kept").json()["name"] == "kept"
    assert client.delete("/api/scenarios/kept").status_code == 404


@pytest.mark.usefixtures("new")
def test_a_broken_file_is_listed_as_such_and_harms_no_other(
    client: TestClient, workspace: Workspace
) -> None:
    (workspace.scenarios / "bad.scenario.json").write_text("{}")
    (workspace.scenarios / "not a name.scenario.json").write_text("{}")
    rows = {row["name"]: row for row in client.get("/api/scenarios").json()}
    assert set(rows) == {"mine", "bad"}
    assert rows["bad"]["error"]
    assert client.get("/api/scenarios/bad").status_code == 422


def test_a_scenario_whose_map_is_gone_can_still_be_looked_at(client: TestClient, new: str) -> None:
    client.delete(f"/api/maps/{CROSSING}")
    state = client.get(f"/api/scenarios/{new}").json()
    assert [problem["code"] for problem in state["problems"]] == ["map_missing"]
    assert client.get(f"/api/scenarios/{new}/roi").status_code == 404


@pytest.mark.slow
def test_a_way_is_shown_as_it_is_driven_without_a_lane_change_at_its_very_start(
    client: TestClient, workspace: Workspace
) -> None:
    (town,) = (path for path in shipped_maps() if path.stem == "town_5x5")
    graph = load_map(workspace.add_map(town)).sumo.graph
    scenario = edits.new_scenario(graph, name="town", roi=graph.segments.ids)
    workspace.scenarios.mkdir(exist_ok=True)
    (workspace.scenarios / f"town{SUFFIX}").write_text(dumps(scenario))
    router = Region.of(graph, scenario.roi).router
    late = np.flatnonzero(late_for_changes(graph.lanes, DEFAULT_BODY[Category.CAR]))
    found = 0
    for spawn in late[::5].tolist():
        for goal in router.goal_candidates(spawn)[:20].tolist():
            shortest = router.path(spawn, goal)
            if graph.lanes.lane[shortest[3]] == graph.lanes.lane[spawn]:
                continue
            query = {"spawn": node_id(graph, spawn), "goal": node_id(graph, goal)}
            way = client.get("/api/scenarios/town/path", params=query).json()["nodes"]
            start = [graph.lanes.lane[node_index(graph, node)] for node in way[:4]]
            assert set(start) == {graph.lanes.lane[spawn]}
            found += 1
    assert found > 0


def test_goals_ways_and_neighbours_are_those_of_the_graph(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    scenario = loads((workspace.scenarios / f"{sampled}{SUFFIX}").read_text())
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    region = Region.of(graph, scenario.roi)
    for category in ("car", "pedestrian"):
        actor = next(a for a in scenario.actors if a.category == category)
        place = place_of(graph, actor.spawn)
        assert place is not None
        query = {"spawn": actor.spawn}
        goals = client.get(f"/api/scenarios/{sampled}/goals", params=query).json()["goals"]
        assert [place_of(graph, goal).node for goal in goals] == region.candidates(place).tolist()
        query["goal"] = goals[0]
        way = client.get(f"/api/scenarios/{sampled}/path", params=query).json()
        assert (way["nodes"][0], way["nodes"][-1]) == (actor.spawn, goals[0])
        assert len(way["points"]) == len(way["nodes"])
    answer = client.get(f"/api/scenarios/{sampled}/goals", params={"spawn": "7.0.-1.0"})
    assert answer.status_code == 404
    roi = client.get(f"/api/scenarios/{sampled}/roi").json()
    assert roi["inside"] == list(scenario.roi)
    assert roi["candidates"] == list(edits.eligible_segments(scenario, graph))


@pytest.mark.slow
def test_the_plan_has_each_actor_at_its_start_when_it_departs_and_at_its_goal_at_the_end(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    state = client.get(f"/api/scenarios/{sampled}").json()
    first = state["document"]["actors"][0]
    wish = {"kind": "change_actor", "actor": first["id"], "depart": 7.5, "speed": 8.0}
    asked = {"version": state["version"], "edits": [wish]}
    assert client.post(f"/api/scenarios/{sampled}/edits", json=asked).status_code == 200
    found = client.get(f"/api/scenarios/{sampled}/plan").json()
    scenario = loads((workspace.scenarios / f"{sampled}{SUFFIX}").read_text())
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    names = [user["id"] for user in found["users"]]
    assert sorted(names) == sorted(actor.id for actor in scenario.actors)
    assert (found["left_out"], found["not_planned"]) == ([], 0)
    for actor in scenario.actors:
        row = names.index(actor.id)
        begin, end = found["first"][row], found["first"][row + 1] - 1
        start = place_of(graph, actor.spawn)
        assert start is not None
        nodes = graph.walks if start.walk else graph.lanes
        away = np.hypot(
            nodes.x[start.node] - found["x"][begin], nodes.y[start.node] - found["y"][begin]
        )
        assert found["time"][begin] == pytest.approx(actor.depart, abs=0.01)
        assert away == pytest.approx(abs(actor.lateral_offset), abs=0.02)
        assert found["time"][end] > actor.depart
    row = names.index(first["id"])
    rows = slice(found["first"][row], found["first"][row + 1])
    x, y, times = (np.array(found[name][rows]) for name in ("x", "y", "time"))
    # Once it has its 8 m/s it covers 16 m in 2 s, whatever way it goes.
    late = np.array([times[-1] - 3.0, times[-1] - 1.0])
    gone = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    assert np.diff(np.interp(late, times, gone))[0] == pytest.approx(16.0, abs=0.2)
