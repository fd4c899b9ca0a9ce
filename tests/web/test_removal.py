from __future__ import annotations

from pathlib import Path

import pytest
from starlette.testclient import TestClient

from odscen.maps.store import Workspace
from tests.web.conftest import CROSSING, finished, wait_for


def test_what_is_removed_can_be_undone_with_its_history(client: TestClient, sampled: str) -> None:
    version = client.get(f"/api/scenarios/{sampled}").json()["version"]
    edit = {"version": version, "edits": [{"kind": "set_seed", "seed": 77}]}
    after = client.post(f"/api/scenarios/{sampled}/edits", json=edit).json()
    removed = client.delete(f"/api/scenarios/{sampled}").json()
    assert (removed["kind"], removed["name"]) == ("scenario", sampled)
    assert removed["until"] - removed["removed"] == 30 * 86_400
    assert client.get("/api/scenarios").json() == []
    (row,) = client.get("/api/trash").json()
    assert row["size"] > 100
    assert {**removed, "size": row["size"]} == row
    assert client.post(f"/api/trash/{removed['id']}/restore").json() == removed
    assert client.get(f"/api/scenarios/{sampled}").json() == after
    assert client.post(f"/api/scenarios/{sampled}/undo", json={"version": after["version"]})
    assert client.post(f"/api/trash/{removed['id']}/restore").status_code == 404


@pytest.mark.slow
def test_a_map_under_a_live_run_is_removed_with_the_facts_and_the_run_ends_well(
    client: TestClient, sampled: str
) -> None:
    wish = {"scenario": sampled, "paused": True, "until": 20}
    run = client.post("/api/runs", json=wish).json()["run"]
    wait_for(lambda: client.get(f"/api/runs/{run}").json()["state"] == "paused")
    facts = client.get(f"/api/maps/{CROSSING}/removal").json()
    assert facts == {"kind": "map", "name": CROSSING, "scenarios": 1, "runs": 1, "live": 1}
    assert client.get(f"/api/scenarios/{sampled}/removal").json()["live"] == 1
    assert client.get(f"/api/runs/{run}/removal").json()["live"] == 1
    assert client.delete(f"/api/runs/{run}").status_code == 409
    removed = client.delete(f"/api/maps/{CROSSING}").json()
    assert client.get(f"/api/scenarios/{sampled}").json()["problems"][0]["code"] == "map_missing"
    client.post(f"/api/runs/{run}/control", json={"action": "speed", "speed": None})
    client.post(f"/api/runs/{run}/control", json={"action": "resume"})
    assert finished(client, run)["state"] == "completed"
    assert "<svg" in client.get(f"/api/runs/{run}/report.html").text
    assert client.get(f"/api/scenarios/{sampled}/removal").json()["live"] == 0
    client.post(f"/api/trash/{removed['id']}/restore")
    assert client.get(f"/api/scenarios/{sampled}").json()["problems"] == []


def test_what_is_deleted_from_the_wastebasket_is_gone(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    removed = client.delete(f"/api/scenarios/{sampled}").json()["id"]
    assert client.delete(f"/api/trash/{removed}").status_code == 200
    assert client.get("/api/trash").json() == []
    assert client.delete(f"/api/trash/{removed}").status_code == 404
    left = [path for path in workspace.scenarios.rglob("*") if path.is_file()]
    assert left == []


def test_a_name_that_is_taken_again_is_not_overwritten(client: TestClient, sampled: str) -> None:
    removed = client.delete(f"/api/scenarios/{sampled}").json()["id"]
    client.post("/api/scenarios", json={"map": CROSSING, "name": sampled})
    answer = client.post(f"/api/trash/{removed}/restore")
    assert answer.status_code == 409
    assert "another scenario named" in answer.json()["error"]["message"]


def test_ids_of_the_wastebasket_never_become_paths(
    client: TestClient, workspace: Workspace
) -> None:
    before = sorted(Path(workspace.root).rglob("*"))
    for item in ("..", "%2e%2e%2fmaps", "a%00b", "map-20260101-000000-00000000", "x" * 5000):
        assert client.post(f"/api/trash/{item}/restore").status_code in (404, 405)
        assert client.delete(f"/api/trash/{item}").status_code in (404, 405)
    assert sorted(Path(workspace.root).rglob("*")) == before
