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
