"""Templates of the server: listed, and placed as scenarios."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.scenario.templates.template_registry import TEMPLATES
from tests.web.conftest import CROSSING

if TYPE_CHECKING:
    from starlette.testclient import TestClient


def test_templates_are_listed_with_their_numbers(client: TestClient) -> None:
    listed = client.get("/api/templates").json()
    assert [one["name"] for one in listed] == list(TEMPLATES)
    assert {one["name"] for one in listed[0]["numbers"]} == {
        one.name for one in TEMPLATES["cut-in"].parameters
    }
    titles = [one["title"] for one in listed[0]["numbers"]]
    assert titles[1:4] == ["Cut-in vehicle speed", "Time to collision", "Lane-change duration"]


def test_a_template_becomes_a_scenario_that_can_be_edited(client: TestClient) -> None:
    wish = {"map": CROSSING, "template": "mid-block", "values": {"ego_speed": 8.0}}
    made = client.post("/api/scenarios", json=wish)
    assert made.status_code == 201, made.text
    state = made.json()
    assert state["name"].startswith(f"mid-block-{CROSSING}")
    assert state["problems"] == []
    assert [rule["id"] for rule in state["document"]["rules"]] == ["wait", "cross"]
    edit = {"kind": "set_seed", "seed": 5}
    path = f"/api/scenarios/{state['name']}"
    changed = client.post(f"{path}/edits", json={"version": state["version"], "edits": [edit]})
    assert changed.json()["document"]["rules"] == state["document"]["rules"]


def test_a_template_without_room_is_refused_with_the_reasons(client: TestClient) -> None:
    wish = {"map": CROSSING, "template": "cut-in"}
    refused = client.post("/api/scenarios", json=wish)
    assert refused.status_code == 422, refused.text
    assert "has no room for a cut-in: of " in refused.json()["error"]["message"]
    assert client.get("/api/scenarios").json() == []
    wish = {"map": CROSSING, "template": "nothing"}
    assert client.post("/api/scenarios", json=wish).status_code == 404


def test_maps_say_whether_they_have_room_for_a_template_before_a_scenario_is_made(
    client: TestClient,
) -> None:
    def reason(template: str, **values: float) -> str:
        asked = {"map": CROSSING, "values": values}
        answer = client.post(f"/api/templates/{template}/room", json=asked)
        assert answer.status_code == 200, answer.text
        return str(answer.json()["reason"])

    assert reason("mid-block") == ""
    assert "has no room for a cut-in: of " in reason("cut-in")
    assert reason("cut-in", ego_speed=8.0, speed=4.0) == ""
    assert client.get("/api/scenarios").json() == []
    assert client.post("/api/templates/no/room", json={"map": CROSSING}).status_code == 404
    assert client.post("/api/templates/cut-in/room", json={"map": "none"}).status_code == 404
    refused = client.post("/api/templates/cut-in/room", json={"map": CROSSING, "values": {"a": 1}})
    assert refused.status_code == 422
