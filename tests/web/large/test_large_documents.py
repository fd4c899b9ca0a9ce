from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from odscen.app import editing
from odscen.maps.store import Workspace
from odscen.web import active_runs, drafts
from odscen.web.application import create_app
from odscen.web.security import LOOPBACK
from tests.web.conftest import CROSSING, finished, wait_for
from tests.web.test_long_runs import WISH, interrupted_after, made_busy, outcome
from tests.web.test_runs import start, watch

HOSTS = LOOPBACK | {"testserver"}


@pytest.fixture
def far(workspace: Workspace, monkeypatch: pytest.MonkeyPatch) -> Iterator[TestClient]:
    """A server for which every document is large, and that cannot read any itself."""

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("the server has read a document itself")

    for module in (editing, drafts):
        monkeypatch.setattr(module, "loads", refuse)
    with TestClient(create_app(workspace, hosts=HOSTS, large=1)) as opened:
        yield opened


def edit(client: TestClient, name: str, version: int, **fields: Any) -> Any:
    body = {"version": version, "edits": [fields]}
    return client.post(f"/api/scenarios/{name}/edits", json=body)


@pytest.mark.slow
def test_a_child_answers_all_that_is_asked_of_a_large_scenario(
    far: TestClient, sampled: str
) -> None:
    shown = far.get(f"/api/scenarios/{sampled}")
    assert (shown.status_code, shown.json()["version"]) == (200, 1)
    changed = edit(far, sampled, 1, kind="set_seed", seed=77).json()
    assert (changed["version"], changed["document"]["seed"]) == (2, 77)
    assert changed["undo"] == "Change the seed"
    undone = far.post(f"/api/scenarios/{sampled}/undo", json={"version": 2}).json()
    assert (undone["version"], undone["document"]["seed"]) == (3, 5)
    spawn = undone["document"]["actors"][0]["spawn"]
    assert far.get(f"/api/scenarios/{sampled}/goals", params={"spawn": spawn}).json()["goals"]
    assert far.get(f"/api/scenarios/{sampled}/roi").json()["inside"]
    download = far.get(f"/api/scenarios/{sampled}/download", params={"form": "graphml"})
    assert download.headers["content-disposition"].endswith(f'"{sampled}.graphml"')
    assert b"<graphml" in download.content
    copied = far.post(f"/api/scenarios/{sampled}/copy", json={}).json()
    assert (copied["name"], copied["version"]) == (f"{sampled}-1", 1)
    named = far.put(f"/api/scenarios/{copied['name']}/name", json={"name": "other"}).json()
    assert (named["name"], named["label"]) == ("other", f"Copy of {sampled}")
    rows = {row["name"]: row for row in far.get("/api/scenarios").json()}
    assert rows.keys() == {sampled, "other"}
    assert rows[sampled]["version"] == 3
    assert rows["other"]["actors"] == len(undone["document"]["actors"])


@pytest.mark.slow
def test_a_child_refuses_in_the_words_of_the_server(far: TestClient, sampled: str) -> None:
    stale = edit(far, sampled, 7, kind="set_seed", seed=1)
    assert (stale.status_code, stale.json()["error"]["current"]) == (409, 1)
    unknown = edit(far, sampled, 1, kind="move_actor", actor="nobody-1", to="1.0.-1.0")
    assert unknown.status_code in (404, 422)
    files = {"file": ("broken.json", b'{"format": "odscen-scenario"')}
    broken = far.post("/api/scenarios/upload", files=files)
    assert (broken.status_code, broken.json()["error"]["kind"]) == (422, "ScenarioError")
    assert "broken.json" in broken.json()["error"]["message"]
    assert far.get("/api/scenarios/nothing").status_code == 404


def test_a_large_upload_is_read_checked_and_saved_by_a_child(
    far: TestClient, workspace: Workspace, sampled: str
) -> None:
    content = (workspace.scenarios / f"{sampled}.scenario.json").read_bytes()
    form = {"files": {"file": ("a.json", content)}, "data": {"name": "mine"}}
    made = far.post("/api/scenarios/upload", **form)  # type: ignore[arg-type]
    assert (made.status_code, made.json()["name"]) == (201, "mine")
    assert (workspace.scenarios / "mine.scenario.json").read_bytes() == content
    assert far.post("/api/scenarios/upload", **form).status_code == 409  # type: ignore[arg-type]


@pytest.mark.slow
def test_what_a_child_answers_has_each_header_once_and_is_compressed_once(
    far: TestClient, sampled: str
) -> None:
    answer = far.get(f"/api/scenarios/{sampled}", headers={"Accept-Encoding": "gzip"})
    names = [name.lower() for name, _ in answer.headers.multi_items()]
    assert sorted(set(names)) == sorted(names)
    assert answer.headers["content-encoding"] == "gzip"
    assert answer.json()["name"] == sampled


def test_small_and_large_scenarios_have_one_history(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    assert edit(client, sampled, 1, kind="set_seed", seed=8).json()["version"] == 2
    with TestClient(create_app(workspace, hosts=HOSTS, large=1)) as far:
        assert edit(far, sampled, 2, kind="set_seed", seed=9).json()["version"] == 3
    shown = client.post(f"/api/scenarios/{sampled}/undo", json={"version": 3}).json()
    assert (shown["version"], shown["document"]["seed"]) == (4, 8)


def test_a_large_scenario_that_needs_more_than_its_limit_is_refused_and_nothing_is_left(
    far: TestClient, sampled: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from odscen.maps.allowances import Allowance
    from odscen.web.large import large_documents

    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(scratch))
    little = Allowance(memory=1 << 30, seconds=0.0)
    monkeypatch.setattr(large_documents, "for_large_document", lambda _size: little)
    answer = far.get(f"/api/scenarios/{sampled}")
    assert (answer.status_code, answer.json()["error"]["kind"]) == (422, "LimitError")
    message = answer.json()["error"]["message"]
    assert message.startswith(f"working on scenario '{sampled}' ")
    assert message.endswith("that is the limit for a file of its size")
    assert list(scratch.iterdir()) == []
    assert far.get(f"/api/maps/{CROSSING}").status_code == 200


@pytest.mark.slow
def test_a_run_of_a_large_scenario_is_checked_watched_and_reported_by_another_process(
    far: TestClient, sampled: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("check_run", "prepare_run", "carry_out"):
        monkeypatch.setattr(active_runs, name, None)
    run = start(far, sampled, until=20)
    seen = watch(far, run)
    (hello,) = seen.of("hello")
    info = finished(far, run)
    assert (info["state"], info["scenario"], info["map"]) == ("completed", sampled, CROSSING)
    shown = far.get(f"/api/scenarios/{sampled}").json()["document"]
    ids = [sorted(one["id"] for one in said["actors"]) for said in (hello, shown)]
    assert ids[0] == ids[1]
    assert seen.of("end")[-1]["state"] == "completed"
    assert far.get(f"/api/runs/{run}/report.html").status_code == 200


@pytest.mark.slow
def test_the_same_run_of_a_large_and_a_small_scenario_gives_the_same_bytes(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    near = start(client, sampled, until=20)
    assert finished(client, near)["state"] == "completed"
    with TestClient(create_app(workspace, hosts=HOSTS, large=1)) as far:
        other = start(far, sampled, until=20)
        assert finished(far, other)["state"] == "completed"
    for name in ("events.json", "actors.json", "trajectories.parquet"):
        files = [(workspace.runs / run / name).read_bytes() for run in (near, other)]
        assert files[0] == files[1]


@pytest.mark.slow
def test_a_run_of_a_large_scenario_is_paused_and_stopped(far: TestClient, sampled: str) -> None:
    run = start(far, sampled, paused=True)
    wait_for(lambda: far.get(f"/api/runs/{run}").json()["state"] == "paused")
    far.post(f"/api/runs/{run}/control", json={"action": "stop"})
    assert finished(far, run)["state"] == "stopped"


@pytest.mark.slow
def test_a_large_scenario_with_errors_is_not_run(far: TestClient) -> None:
    far.post("/api/scenarios", json={"map": CROSSING, "name": "empty"})
    for path in ("/api/runs", "/api/runs/forecast"):
        answer = far.post(path, json={"scenario": "empty"})
        assert (answer.status_code, answer.json()["error"]["kind"]) == (422, "ScenarioError")
        assert "region of interest is empty" in answer.json()["error"]["message"]
    assert far.get("/api/runs").json() == []


@pytest.mark.slow
def test_the_forecast_of_a_large_scenario_is_that_of_a_small_one(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    wish = {"scenario": sampled, "until": 60}
    near = client.post("/api/runs/forecast", json=wish).json()
    with TestClient(create_app(workspace, hosts=HOSTS, large=1)) as far:
        other = far.post("/api/runs/forecast", json=wish).json()
    assert {**near, "free": 0} == {**other, "free": 0}


@pytest.mark.slow
def test_a_long_run_of_a_large_scenario_is_interrupted_and_resumed_to_its_end(
    far: TestClient, workspace: Workspace
) -> None:
    busy = made_busy(far)
    run = start(far, busy, speed=1000, **WISH)
    wait_for(lambda: far.get(f"/api/runs/{run}").json()["slices"])
    interrupted_after(far, run, 1)
    info = far.get(f"/api/runs/{run}").json()
    assert (info["error"], info["slices"]["length"]) == (None, 3600)
    assert far.post(f"/api/runs/{run}/resume", json={}).status_code == 202
    assert finished(far, run)["state"] == "completed"
    whole = start(far, busy, **WISH)
    assert finished(far, whole)["state"] == "completed"
    assert outcome(workspace, run) == outcome(workspace, whole)
