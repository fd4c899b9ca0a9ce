"""Simulators in the page: those that are installed, chosen for a run, which is then played back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from tests.installed_packages import install_shown
from tests.web.conftest import finished

if TYPE_CHECKING:
    from pathlib import Path

    from starlette.testclient import TestClient

    from odscen.maps.store import Workspace


@pytest.fixture
def steady(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    install_shown("simulators.md", "## A simulator of your own", tmp_path / "site", monkeypatch)
    return "steady"


def start(client: TestClient, scenario: str, name: str, **options: object) -> Any:
    wish = {"scenario": scenario, "until": 30.0, "simulator": {"name": name, "options": options}}
    return client.post("/api/runs", json=wish)


def test_simulators_are_offered_with_their_options(client: TestClient, steady: str) -> None:
    offered = {one["name"]: one for one in client.get("/api/simulators").json()}
    assert [*offered] == ["sumo", "carla-mirror", "carla-native", "metadrive", "esmini", steady]
    assert not any(one["error"] for one in offered.values())
    assert [one["name"] for one in offered["carla-native"]["options"]] == ["physics"]
    assert [one["name"] for one in offered["metadrive"]["options"]] == ["ego", "traffic"]
    assert [one["name"] for one in offered["esmini"]["options"]] == ["play"]
    assert offered[steady]["options"][0]["usual"] == 8.0


def test_a_page_cannot_choose_what_program_the_server_starts(
    client: TestClient, sampled: str
) -> None:
    for name, option in (("metadrive", "python"), ("esmini", "program")):
        refused = start(client, sampled, name, **{option: "/bin/true"})
        assert refused.status_code == 422
        assert "where this server is started" in refused.text


@pytest.mark.slow
def test_a_run_of_the_page_is_played_by_the_simulator_that_is_chosen(
    client: TestClient, workspace: Workspace, sampled: str, steady: str
) -> None:
    run = start(client, sampled, steady, speed=6.0).json()["run"]
    info = finished(client, run)
    assert info["state"] == "completed", info["error"]
    assert info["summary"]["driven_by"] == "Steady traffic"
    assert info["progress"]["planned"] == info["summary"]["actors"]["planned"]
    assert (workspace.runs / run / "report.html").is_file()
    assert client.get(f"/api/runs/{run}/report.html").status_code == 200
    replay = client.get(f"/api/runs/{run}/trajectories")
    assert replay.status_code == 200
    assert len(replay.content) > 1000


def test_what_is_not_done_is_listed_before_the_run(
    client: TestClient, sampled: str, steady: str
) -> None:
    url = f"/api/simulators/{steady}/unsupported"
    assert client.get(url, params={"scenario": sampled}).json() == []
    refused = client.get("/api/simulators/os:system/unsupported", params={"scenario": sampled})
    assert refused.status_code == 422
    assert "there is no simulator 'os:system'; there are sumo" in refused.text


@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("my_traffic.py:Mine", {}, "there is no simulator"),
        ("steady", {"speed": 0.1}, "not within 0.5.."),
        ("steady", {"haste": 1}, "it has no option 'haste'"),
    ],
)
def test_what_is_not_offered_is_refused_before_anything_runs(
    client: TestClient, workspace: Workspace, sampled: str, steady: str, name: str,
    options: dict[str, object], said: str,
) -> None:  # fmt: skip
    del steady
    answer = start(client, sampled, name, **options)
    assert answer.status_code == 422, answer.text
    assert said in answer.text
    assert not [*workspace.runs.glob("*")]
