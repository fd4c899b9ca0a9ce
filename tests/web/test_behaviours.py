"""Behaviour models in the page: those that are installed, and none that is named by its place."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from odscen.runs.layout import BEHAVIOUR_FILE, SUMO_FOLDER
from tests.web.conftest import finished

if TYPE_CHECKING:
    from starlette.testclient import TestClient

    from odscen.maps.store import Workspace


def start(client: TestClient, scenario: str, name: str, **options: object) -> Any:
    wish = {"scenario": scenario, "until": 5.0, "behaviour": {"name": name, "options": options}}
    return client.post("/api/runs", json=wish)


def test_the_models_that_ship_are_offered_with_their_options(client: TestClient) -> None:
    idm, imitation, pressure = client.get("/api/behaviours").json()
    assert [idm["name"], imitation["name"]] == ["idm", "imitation"]
    assert pressure["name"] == "max-pressure"
    assert not any(one["error"] for one in (idm, imitation, pressure))
    assert {one["name"] for one in pressure["options"]} == {"interval", "hold"}
    options = {one["name"]: one for one in idm["options"]}
    assert options["headway"]["title"] == "Time headway, s"
    assert (options["headway"]["usual"], options["headway"]["low"]) == (1.2, 0.0)
    assert (options["changes_lanes"]["kind"], options["changes_lanes"]["usual"]) == (
        "boolean",
        True,
    )
    # A file of the server is not to be chosen from afar.
    assert [one["name"] for one in imitation["options"]] == ["sampled"]


@pytest.mark.slow
def test_a_run_is_driven_by_the_model_that_is_chosen(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    usual = client.post("/api/runs", json={"scenario": sampled, "until": 5.0}).json()["run"]
    driven = start(client, sampled, "idm", headway=3.0).json()["run"]
    assert [finished(client, one)["state"] for one in (usual, driven)] == ["completed"] * 2
    said = json.loads((workspace.runs / driven / SUMO_FOLDER / BEHAVIOUR_FILE).read_text())
    assert (said["name"], said["options"]["headway"]) == ("idm", 3.0)
    assert not (workspace.runs / usual / SUMO_FOLDER / BEHAVIOUR_FILE).exists()
    summaries = [
        json.loads((workspace.runs / one / "summary.json").read_text()) for one in (usual, driven)
    ]
    assert [one.get("behaviour") for one in summaries] == [None, "idm"]
    trajectories = [
        (workspace.runs / one / "trajectories.parquet").read_bytes() for one in (usual, driven)
    ]
    assert trajectories[0] != trajectories[1]


@pytest.mark.parametrize(
    ("name", "options", "status", "said"),
    [
        ("os:system", {}, 404, "behaviour model"),
        ("drivers.py:Mine", {}, 404, "idm"),
        ("idm", {"headway": 99}, 422, "not within 0..10"),
        ("idm", {"haste": 1}, 422, "it has no option 'haste'"),
        ("signal-agent", {"agent": "/etc/passwd"}, 404, "behaviour model"),
        ("imitation", {"weights": "/etc/passwd"}, 422, "it has no option 'weights'"),
    ],
)
def test_what_is_not_offered_is_refused_before_anything_runs(
    client: TestClient,
    workspace: Workspace,
    sampled: str,
    name: str,
    options: dict[str, object],
    status: int,
    said: str,
) -> None:
    answer = start(client, sampled, name, **options)
    assert answer.status_code == status, answer.text
    assert said in answer.text
    assert not [*workspace.runs.glob("*")]
