"""What an edit has changed, told in place of the whole document."""

from __future__ import annotations

from typing import Any

import pytest
from starlette.testclient import TestClient

from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import loads
from odscen.scenario.document.scenario_document import Scenario
from odscen.web.application import create_app
from odscen.web.wire.document_changes import changes_between
from tests.web.json_patch import patched


@pytest.fixture
def scenario(workspace: Workspace, sampled: str) -> Scenario:
    text = (workspace.scenarios / f"{sampled}.scenario.json").read_text(encoding="utf-8")
    return loads(text)


def told(before: Scenario, after: Scenario) -> list[dict[str, Any]]:
    """The changes, which have to make the one document of the other."""
    changes = [one.model_dump(mode="json") for one in changes_between(before, after)]
    assert patched(before.model_dump(mode="json"), changes) == after.model_dump(mode="json")
    return changes


def test_a_field_of_one_road_user_is_one_change(scenario: Scenario) -> None:
    first = scenario.actors[0].model_copy(update={"depart": 7.5})
    after = scenario.model_copy(update={"actors": (first, *scenario.actors[1:])})
    assert told(scenario, after) == [
        {"op": "replace", "path": "/actors/0/depart", "value": 7.5},
    ]


def test_a_document_that_was_read_anew_differs_where_it_does(scenario: Scenario) -> None:
    other = Scenario.model_validate_json(scenario.model_dump_json())
    assert told(scenario, other) == []
    assert told(scenario, other.model_copy(update={"seed": scenario.seed + 1})) == [
        {"op": "replace", "path": "/seed", "value": scenario.seed + 1}
    ]


def test_road_users_that_go_and_come_are_told_one_by_one(scenario: Scenario) -> None:
    actors = scenario.actors
    new = actors[0].model_copy(update={"id": "new"})
    changed = actors[3].model_copy(update={"ego": not actors[3].ego})
    kept = (actors[0], actors[2], changed, new, *actors[4:-1])
    changes = told(scenario, scenario.model_copy(update={"actors": kept}))
    assert [(one["op"], one["path"]) for one in changes] == [
        ("remove", f"/actors/{len(actors) - 1}"),
        ("remove", "/actors/1"),
        ("replace", "/actors/2/ego"),
        ("add", "/actors/3"),
    ]


@pytest.mark.parametrize("order", [slice(None, None, -1), slice(0, 1)])
def test_a_list_in_another_order_or_with_few_left_is_sent_whole(
    scenario: Scenario, order: slice
) -> None:
    after = scenario.model_copy(update={"actors": scenario.actors[order]})
    assert [one["path"] for one in told(scenario, after)] == ["/actors"]


def test_names_with_slashes_and_tildes_are_escaped_and_keep_their_order(
    scenario: Scenario,
) -> None:
    def with_(*names: str) -> Scenario:
        weather = scenario.environment.model_copy(
            update={"parameters": {name: float(row) for row, name in enumerate(names)}}
        )
        return scenario.model_copy(update={"environment": weather})

    one = with_("a/b", "c~d")
    changes = told(one, with_("a/b", "c~d", "e~/f"))
    assert [change["path"] for change in changes] == ["/environment/parameters/e~0~1f"]
    assert [change["path"] for change in told(one, with_("c~d", "a/b"))] == [
        "/environment/parameters"
    ]


def test_edit_undo_and_redo_answer_with_changes_where_asked(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    path = f"/api/scenarios/{sampled}"
    state = client.get(path).json()
    actor = state["document"]["actors"][1]["id"]
    wish = {
        "version": state["version"],
        "edits": [{"kind": "remove_actors", "actors": [actor]}, {"kind": "set_seed", "seed": 99}],
    }
    answer = client.post(f"{path}/edits?changes=true", json=wish).json()
    assert answer.keys() == {"name", "before", "version", "changes", "label", "undo", "redo"}
    assert (answer["before"], answer["version"]) == (state["version"], state["version"] + 1)
    assert len(client.get(path).content) > 5 * len(str(answer))
    after = client.get(path).json()
    assert patched(state["document"], answer["changes"]) == after["document"]
    assert answer["undo"] == after["undo"]
    with TestClient(create_app(workspace), base_url="http://localhost") as again:
        now, document = answer["version"], after["document"]
        for step, wanted in (("undo", state), ("redo", after)):
            moved = again.post(f"{path}/{step}?changes=true", json={"version": now}).json()
            assert (moved["before"], moved["version"]) == (now, now + 1)
            document = patched(document, moved["changes"])
            assert document == wanted["document"]
            now += 1
        stale = again.post(f"{path}/undo?changes=true", json={"version": now - 1})
        assert (stale.status_code, stale.json()["error"]["current"]) == (409, now)


def test_problems_are_asked_for_apart_and_say_of_which_version_they_are(
    client: TestClient, sampled: str
) -> None:
    path = f"/api/scenarios/{sampled}"
    state = client.get(path).json()
    actor = state["document"]["actors"][0]["id"]
    edit = {"kind": "change_actor", "actor": actor, "model": "no.such.model"}
    wish = {"version": state["version"], "edits": [edit]}
    changed = client.post(f"{path}/edits?changes=true", json=wish).json()
    found = client.get(f"{path}/problems").json()
    assert found["version"] == changed["version"]
    assert [one["where"] for one in found["problems"]] == ["actors[0].model"]
    assert found["problems"] == client.get(path).json()["problems"]
