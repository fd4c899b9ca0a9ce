"""Long runs from the page: what they need, interruption, going on, and their files."""

from __future__ import annotations

import json
from pathlib import Path

import polars as pl
import pytest
from starlette.testclient import TestClient

from odscen.maps.store import Workspace
from odscen.web.application import create_app
from odscen.web.security import LOOPBACK
from tests.web.conftest import CROSSING, finished, wait_for
from tests.web.test_runs import control, start

HOURS = 3
WISH = {"until": HOURS * 3600, "step_length": 1.0, "every": 10}


@pytest.fixture
def busy(client: TestClient) -> str:
    return made_busy(client)


def made_busy(client: TestClient) -> str:
    """Make a scenario with somebody on the road for hours; its name."""
    client.post("/api/scenarios", json={"map": CROSSING, "name": "busy"})
    segments = ["j10001", "r1", "r2", "r3", "r4"]
    edits = [
        *({"kind": "grow_roi", "segment": segment} for segment in segments),
        {"kind": "set_simulation", "duration": HOURS * 3600},
        {"kind": "set_background", "background": "others", "trips": 900},
    ]
    version = client.get("/api/scenarios/busy").json()["version"]
    answer = client.post("/api/scenarios/busy/edits", json={"version": version, "edits": edits})
    assert answer.status_code == 200, answer.text
    return "busy"


def outcome(workspace: Workspace, run: str) -> list[bytes]:
    folder = workspace.runs / run
    files = [folder / "actors.json", folder / "events.json", *folder.glob("trajectories/*")]
    return [path.read_bytes() for path in sorted(files)]


def interrupted_after(client: TestClient, run: str, slices: int) -> None:
    wait_for(lambda: client.get(f"/api/runs/{run}").json()["slices"]["done"] >= slices)
    control(client, run, "interrupt")
    wait_for(lambda: client.get(f"/api/runs/{run}").json()["state"] == "interrupted")


@pytest.mark.slow
def test_an_interrupted_run_goes_on_to_the_same_end(
    client: TestClient, workspace: Workspace, busy: str
) -> None:
    whole = start(client, busy, **WISH)
    assert finished(client, whole)["state"] == "completed"
    run = start(client, busy, speed=1000, **WISH)
    wait_for(lambda: client.get(f"/api/runs/{run}").json()["slices"])
    interrupted_after(client, run, 1)
    info = client.get(f"/api/runs/{run}").json()
    assert info["slices"]["length"] == 3600
    assert info["slices"]["time"] == 3600 * info["slices"]["done"]
    refused = client.get(f"/api/runs/{run}/report.html")
    assert refused.status_code == 409
    assert "resumes it" in refused.json()["error"]["message"]
    with TestClient(create_app(workspace, hosts=LOOPBACK | {"testserver"})) as later:
        (row,) = [one for one in later.get("/api/runs").json() if one["run"] == run]
        assert (row["state"], row["slices"]) == ("interrupted", info["slices"])
        assert later.post(f"/api/runs/{run}/resume", json={}).status_code == 202
        assert later.post(f"/api/runs/{run}/resume", json={}).status_code == 409
        ended = finished(later, run)
    assert ended["state"] == "completed"
    assert len(ended["summary"]["slices"]["done"]) == HOURS
    assert outcome(workspace, run) == outcome(workspace, whole)
    assert client.post(f"/api/runs/{whole}/resume", json={}).status_code == 409


@pytest.mark.slow
def test_a_worker_that_dies_leaves_a_long_run_that_can_go_on(client: TestClient, busy: str) -> None:
    run = start(client, busy, speed=1000, **WISH)
    wait_for(lambda: client.get(f"/api/runs/{run}").json()["slices"])
    wait_for(lambda: client.get(f"/api/runs/{run}").json()["slices"]["done"])
    client.app.state.services.runs.active(run).live.kill()
    wait_for(lambda: client.get(f"/api/runs/{run}").json()["state"] == "interrupted")
    assert "resume" in client.get(f"/api/runs/{run}").json()["error"]
    client.post(f"/api/runs/{run}/resume", json={})
    assert finished(client, run)["state"] == "completed"


@pytest.mark.slow
def test_a_server_that_ends_leaves_long_runs_that_can_go_on(
    client: TestClient, workspace: Workspace, busy: str
) -> None:
    with TestClient(create_app(workspace, hosts=LOOPBACK | {"testserver"})) as first:
        run = start(first, busy, speed=100, **WISH)
        wait_for(lambda: first.get(f"/api/runs/{run}").json()["state"] == "running")
    assert client.get(f"/api/runs/{run}").json()["state"] == "interrupted"


@pytest.mark.slow
def test_only_long_runs_can_be_interrupted(client: TestClient, sampled: str) -> None:
    run = start(client, sampled, paused=True)
    wait_for(lambda: client.get(f"/api/runs/{run}").json()["state"] == "paused")
    answer = client.post(f"/api/runs/{run}/control", json={"action": "interrupt"})
    assert answer.status_code == 409
    control(client, run, "stop")
    assert finished(client, run)["state"] == "stopped"


def test_the_forecast_grows_with_what_is_recorded(client: TestClient, busy: str) -> None:
    def forecast(**wish: object) -> dict[str, int]:
        answer = client.post("/api/runs/forecast", json={"scenario": busy, **wish})
        assert answer.status_code == 200, answer.text
        found: dict[str, int] = answer.json()
        return found

    often, rarely, never = forecast(), forecast(every=10), forecast(trajectories=False)
    assert often["disk"] > rarely["disk"] > never["disk"] > 0
    assert often["planned"] == rarely["planned"] == pytest.approx(900, abs=60)
    assert often["free"] > 0
    assert client.get("/api/runs").json() == []


@pytest.mark.slow
def test_what_is_recorded_can_be_chosen(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    some = start(client, sampled, until=60, every=10)
    none = start(client, sampled, until=60, trajectories=False)
    assert finished(client, some)["state"] == finished(client, none)["state"] == "completed"
    times = pl.read_parquet(workspace.runs / some / "trajectories.parquet")["timestep_time"]
    assert set(times.unique().diff().drop_nulls()) == {10}
    assert not (workspace.runs / none / "trajectories.parquet").exists()
    shown = client.post("/api/runs", json={"scenario": sampled, "every": 10, "carla": True})
    assert shown.status_code == 422


@pytest.mark.slow
def test_files_of_a_run_are_listed_and_downloaded_and_no_others(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    run = start(client, sampled, until=5)
    finished(client, run)
    folder = workspace.runs / run
    (folder / "figures").mkdir(exist_ok=True)
    Path(folder / "figures/extra.csv").write_text("a,b\n1,2\n")
    files = {one["name"]: one["size"] for one in client.get(f"/api/runs/{run}/files").json()}
    assert {"report.html", "summary.json", "figures/extra.csv"} <= files.keys()
    assert not any(name.startswith(("sumo/", ".")) for name in files)
    for name, size in files.items():
        answer = client.get(f"/api/runs/{run}/files/{name}")
        assert len(answer.content) == size
        assert "attachment" in answer.headers["content-disposition"]
    for name in ("sumo/scenario.sumocfg", "../../maps", ".lock", "%2e%2e/x", "figures"):
        assert client.get(f"/api/runs/{run}/files/{name}").status_code == 404
    assert json.loads(client.get(f"/api/runs/{run}/files/summary.json").text)
