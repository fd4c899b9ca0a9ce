from __future__ import annotations

import itertools
import json
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import httpx2
import numpy as np
import polars as pl
import pytest
from starlette.testclient import TestClient, WebSocketTestSession
from starlette.websockets import WebSocketDisconnect
from websockets.sync.client import connect

from odscen.app.running.runs import run as run_scenario
from odscen.app.scenarios import SUFFIX
from odscen.base.errors import SimulationError
from odscen.base.frames import SumoPose, sumo_to_xodr
from odscen.carla.server.client import Address
from odscen.figures.measures.summary import actors_from_json
from odscen.maps.store import Workspace
from odscen.records.run_plan import Plan
from odscen.runs.run_settings import RunSettings
from odscen.runs.run_sums import seal_again
from odscen.web import active_runs
from tests.web.conftest import CROSSING, finished, wait_for


class Seen(NamedTuple):
    """What one client was shown."""

    texts: list[dict[str, Any]]
    frames: list[np.ndarray]

    def of(self, kind: str) -> list[dict[str, Any]]:
        return [text for text in self.texts if text["type"] == kind]

    @property
    def names(self) -> list[str]:
        return [actor["id"] for actor in self.of("hello")[0]["actors"]]


def start(client: TestClient, scenario: str, **wish: object) -> str:
    answer = client.post("/api/runs", json={"scenario": scenario, **wish})
    assert answer.status_code == 202, answer.text
    return str(answer.json()["run"])


def control(client: TestClient, run: str, action: str, **more: object) -> None:
    answer = client.post(f"/api/runs/{run}/control", json={"action": action, **more})
    assert answer.status_code == 200, answer.text


def messages(socket: WebSocketTestSession) -> Iterator[dict[str, Any] | np.ndarray]:
    """Yield what the server sends, answering each frame, until the end."""
    while True:
        message = socket.receive()
        if message["type"] == "websocket.close":
            return
        if message.get("bytes"):
            yield np.frombuffer(message["bytes"], "<f4")
            socket.send_text("ack")
        else:
            yield json.loads(message["text"])


def watch(client: TestClient, run: str) -> Seen:
    seen = Seen([], [])
    with client.websocket_connect(f"/api/runs/{run}/live") as socket:
        for message in messages(socket):
            if isinstance(message, np.ndarray):
                seen.frames.append(message)
            else:
                seen.texts.append(message)
    return seen


def recorded(workspace: Workspace, run: str) -> dict[tuple[str, float], tuple[float, ...]]:
    """Body centres by actor and time from the trajectories, straight from the file."""
    folder = workspace.runs / run
    plan = Plan.from_json((folder / "plan.json").read_text())
    lengths = {actor.id: actor.length for actor in plan.actors}
    table = pl.read_parquet(folder / "trajectories.parquet")
    prefix = "vehicle" if "vehicle_id" in table.columns else "person"
    found = {}
    for row in table.filter(pl.col(f"{prefix}_id").is_not_null()).iter_rows(named=True):
        name = row[f"{prefix}_id"]
        front = SumoPose(row[f"{prefix}_x"], row[f"{prefix}_y"], 0, row[f"{prefix}_angle"])
        pose = sumo_to_xodr(front, length=lengths[name], net_offset=plan.net_offset)
        speed = row[f"{prefix}_speed"]
        time_ = round(float(row["timestep_time"]), 2)
        found[name, time_] = (float(pose.x), float(pose.y), float(pose.hdg), speed)
    return found


@pytest.mark.slow
def test_a_whole_run_is_watched_and_frames_are_where_the_trajectories_say(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    run = start(client, sampled, speed=40)
    seen = watch(client, run)
    info = finished(client, run)
    assert info["state"] == "completed"
    assert seen.of("end") == [{"type": "end", "state": "completed", "error": None}]
    truth = recorded(workspace, run)
    assert len(seen.frames) > 20
    steps = [frame[0] for frame in seen.frames]
    assert steps == sorted(set(steps))
    assert seen.frames[-1][4] == info["summary"]["actors"]["arrived"]
    names, compared = seen.names, 0
    for frame in seen.frames:
        rows = frame[5:].reshape(-1, 6)
        assert len(rows) == frame[2]
        moment = round(float(frame[1]), 2)
        assert {names[int(row[0])] for row in rows} == {n for n, t in truth if t == moment}
        for row in rows:
            x, y, hdg, speed = truth[names[int(row[0])], moment]
            assert np.hypot(row[1] - x, row[2] - y) < 0.02
            assert abs((row[3] - hdg + np.pi) % (2 * np.pi) - np.pi) < 1e-3
            assert abs(row[4] - speed) < 0.01
            compared += 1
    assert compared > 200
    lights = seen.of("lights")
    assert set(lights[0]["lights"]) == {
        light["id"] for light in client.get(f"/api/maps/{CROSSING}").json()["lights"]
    }
    assert len(lights) > 1


@pytest.mark.slow
def test_watching_changes_nothing_in_what_is_recorded(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    alone = start(client, sampled)
    finished(client, alone)
    watched = start(client, sampled, speed=60)
    watch(client, watched)
    finished(client, watched)
    for name in ("trajectories.parquet", "events.json", "actors.json"):
        assert (workspace.runs / alone / name).read_bytes() == (
            workspace.runs / watched / name
        ).read_bytes()


@pytest.mark.slow
def test_a_run_is_paused_stepped_sped_up_and_stopped(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    run = start(client, sampled, paused=True, seed=3)
    with client.websocket_connect(f"/api/runs/{run}/live") as socket:
        steps: list[int] = []
        for message in messages(socket):
            if isinstance(message, np.ndarray):
                steps.append(int(message[0]))
                if len(steps) <= 3:
                    control(client, run, "step")
                elif len(steps) == 4:
                    assert client.get(f"/api/runs/{run}").json()["state"] == "paused"
                    control(client, run, "speed", speed=20)
                    control(client, run, "resume")
                elif len(steps) == 8:
                    control(client, run, "stop")
            elif message["type"] == "end":
                assert message["state"] == "stopped"
    assert steps[:4] == [1, 2, 3, 4]
    info = finished(client, run)
    assert info["state"] == "stopped"
    assert info["summary"]["stopped"]
    assert info["summary"]["seed"] == 3
    assert info["summary"]["steps"] < 60
    assert (workspace.runs / run / "report.html").is_file()
    late = client.post(f"/api/runs/{run}/control", json={"action": "pause"})
    assert late.status_code == 409


@pytest.mark.slow
def test_the_pace_is_kept(client: TestClient, sampled: str) -> None:
    begun = time.monotonic()
    run = start(client, sampled, speed=10, until=20)
    with client.websocket_connect(f"/api/runs/{run}/live") as socket:
        shown = [
            float(message[1]) for message in messages(socket) if isinstance(message, np.ndarray)
        ]
    assert shown[-1] == pytest.approx(20, abs=1)
    assert time.monotonic() - begun > 1.9  # a busy machine may be late; nothing may be early


@pytest.mark.slow
def test_a_finished_run_has_figures_a_report_and_a_replay(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    run = start(client, sampled)
    info = finished(client, run)
    assert client.get(f"/api/runs/{run}/summary").json() == info["summary"]
    assert "<html" in client.get(f"/api/runs/{run}/report.html").text
    (workspace.runs / run / "report.html").unlink()
    assert "<html" in client.get(f"/api/runs/{run}/report.html").text, "it is written when opened"
    truth = recorded(workspace, run)
    for every in (1, 4):
        replay = client.get(f"/api/runs/{run}/trajectories?every={every}").json()
        assert len(replay["first"]) == len(replay["times"]) + 1
        rows = 0
        for i, moment in enumerate(replay["times"]):
            for row in range(replay["first"][i], replay["first"][i + 1]):
                name = replay["actors"][replay["actor"][row]]["id"]
                x, y, hdg, _ = truth[name, round(moment, 2)]
                assert abs(replay["x"][row] - x) < 0.011
                assert abs(replay["y"][row] - y) < 0.011
                assert abs(replay["hdg"][row] - hdg) < 1e-3
                rows += 1
        assert rows == len(replay["x"])
        assert rows == len(truth) if every == 1 else rows < len(truth) / 2
    assert [row["run"] for row in client.get("/api/runs").json()] == [run]
    assert client.delete(f"/api/runs/{run}").json()["name"] == run
    assert client.get(f"/api/runs/{run}").status_code == 404


@pytest.mark.slow
def test_a_finished_run_says_what_became_of_its_egos(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    state = client.get(f"/api/scenarios/{sampled}").json()
    driver = next(one for one in state["document"]["actors"] if one["category"] == "car")["id"]
    edits = [{"kind": "set_ego", "actor": driver}]
    wish = {"version": state["version"], "edits": edits}
    assert client.post(f"/api/scenarios/{sampled}/edits", json=wish).is_success
    run = start(client, sampled)
    finished(client, run)
    folder = workspace.runs / run
    rows = [row for row in actors_from_json((folder / "actors.json").read_text()) if row.ego]
    assert [row.id for row in rows] == [driver]
    found = client.get(f"/api/runs/{run}/egos").json()["egos"]
    assert [(one["id"], one["status"], one["mean_speed"]) for one in found] == [
        (row.id, row.status, row.mean_speed) for row in rows
    ]


@pytest.mark.slow
def test_a_finished_run_is_told_over_time(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    run = start(client, sampled)
    actors = finished(client, run)["summary"]["actors"]
    curves = client.get(f"/api/runs/{run}/curves").json()
    counts, speeds, shares = curves["counts"], curves["speeds"], curves["shares"]
    assert counts["arrived"][-1] == actors["arrived"]
    assert counts["running"][-1] == actors["running"]
    assert max(counts["running"]) > 3
    truth = recorded(workspace, run)
    last = counts["time"][-1] - 1.0  # a bin of one second, as the run is short
    there = {name for name, t in truth if last <= t < last + 1.0}
    assert counts["running"][-2] == pytest.approx(len(there), abs=2)
    assert len(speeds["mean"]) == len(speeds["time"])
    assert all(
        low <= mean + 1e-3 and high <= shares["edges"][-1]
        for low, mean, high in zip(speeds["low"], speeds["mean"], speeds["high"], strict=True)
        if low is not None and low == high
    )
    assert sum(shares["share"]) == pytest.approx(1, abs=1e-2)
    assert len(shares["edges"]) == len(shares["share"]) + 1


@pytest.mark.slow
def test_incidents_of_a_finished_run_are_those_that_were_told_live(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    run = start(client, sampled)
    seen = watch(client, run)
    finished(client, run)
    told = [event for text in seen.of("events") for event in text["events"]]
    answer = client.get(f"/api/runs/{run}/events").json()
    assert answer == {"events": told, "left_off": 0}
    file = workspace.runs / run / "events.json"
    crash = {"time": 1.5, "kind": "collision", "actor": "a", "partner": "b", "x": 1.0, "y": 2.0}
    document = json.loads(file.read_text())
    document["events"].append(crash)
    file.write_text(json.dumps(document))
    refused = client.get(f"/api/runs/{run}/events")
    assert refused.status_code == 409
    assert "events.json: expected sha256" in refused.json()["error"]["message"]
    seal_again(file.parent, "events.json")
    assert crash in client.get(f"/api/runs/{run}/events").json()["events"]


@pytest.mark.slow
def test_a_replay_has_no_more_rows_than_asked_for(client: TestClient, sampled: str) -> None:
    run = start(client, sampled)
    finished(client, run)
    whole = client.get(f"/api/runs/{run}/trajectories").json()
    half = client.get(f"/api/runs/{run}/trajectories?most={len(whole['x']) // 2}").json()
    assert half["times"] == whole["times"][::2] or half["times"] == whole["times"][::3]
    assert half["times"][0] == whole["times"][0]


@pytest.mark.slow
def test_runs_of_one_scenario_are_found_after_a_restart_too(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    client.post(f"/api/scenarios/{sampled}/copy", json={"name": f"{sampled}-1"})
    first, other = start(client, sampled), start(client, f"{sampled}-1")
    assert finished(client, first)["finished"] > 0
    finished(client, other)
    second = start(client, sampled)
    finished(client, second)
    again = active_runs.Runs(workspace, Address())
    try:
        assert [row.run for row in again.rows(scenario=sampled)] == [first, second]
        assert [row.run for row in again.rows(scenario=f"{sampled}-1")] == [other]
        assert again.rows(scenario="nobody") == []
        assert [row.state for row in again.rows(scenario=sampled)] == ["completed"] * 2
    finally:
        again.close()
    listed = client.get("/api/runs", params={"scenario": sampled}).json()
    assert [row["run"] for row in listed] == [first, second]


@pytest.mark.slow
def test_runs_from_the_command_line_are_among_those_of_their_scenario(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    document = workspace.scenarios / f"{sampled}{SUFFIX}"
    made = run_scenario(workspace, document, settings=RunSettings(until=2.0)).folder.name
    numbered = start(client, sampled)
    finished(client, numbered)
    listed = client.get("/api/runs", params={"scenario": sampled}).json()
    assert [row["run"] for row in listed] == [made, numbered] == [sampled, f"{sampled}-1"]


@pytest.mark.slow
def test_runs_of_a_changed_scenario_can_be_told_apart(client: TestClient, sampled: str) -> None:
    def digest() -> str:
        run = start(client, sampled, until=2)
        finished(client, run)
        return str(client.get(f"/api/runs/{run}/content").json()["digest"])

    def edit(**change: object) -> None:
        version = client.get(f"/api/scenarios/{sampled}").json()["version"]
        wish = {"version": version, "edits": [change]}
        answer = client.post(f"/api/scenarios/{sampled}/edits", json=wish)
        assert answer.status_code == 200, answer.text

    before = digest()
    edit(kind="rename", name="the same by another name")
    assert digest() == before
    edit(kind="set_seed", seed=77)
    assert digest() != before


@pytest.mark.slow
def test_a_run_says_at_which_time_of_day_it_began_when_the_scenario_has_another_since(
    client: TestClient, sampled: str
) -> None:
    def begin_at(clock: float) -> None:
        version = client.get(f"/api/scenarios/{sampled}").json()["version"]
        wish = {"version": version, "edits": [{"kind": "set_clock", "clock": clock}]}
        assert client.post(f"/api/scenarios/{sampled}/edits", json=wish).status_code == 200

    begin_at(35_100)
    run = start(client, sampled, until=2)
    assert client.get(f"/api/runs/{run}").json()["clock"] == 35_100
    finished(client, run)
    begin_at(0)
    assert client.get(f"/api/runs/{run}/content").json()["clock"] == 35_100


@pytest.mark.slow
def test_a_run_whose_preparation_fails_can_be_removed(
    client: TestClient, sampled: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise SimulationError("no way")

    monkeypatch.setattr(active_runs, "prepare_run", refuse)
    run = start(client, sampled)
    assert finished(client, run)["error"] == "no way"
    assert client.delete(f"/api/runs/{run}").json() is None
    assert client.get(f"/api/runs/{run}").status_code == 404


@pytest.mark.slow
def test_a_scenario_with_errors_is_not_run(client: TestClient) -> None:
    client.post("/api/scenarios", json={"map": CROSSING, "name": "empty"})
    answer = client.post("/api/runs", json={"scenario": "empty"})
    assert answer.status_code == 422
    assert "region of interest is empty" in answer.json()["error"]["message"]
    assert client.get("/api/runs").json() == []


@pytest.mark.slow
def test_a_run_that_sumo_refuses_is_a_failed_run_in_sumos_words_and_harms_no_other(
    client: TestClient, sampled: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    good = start(client, sampled, speed=5)
    wait_for(lambda: client.get(f"/api/runs/{good}").json()["state"] == "running" or None)
    real = active_runs.prepare_run

    def spoiled(*arguments: Any, **more: Any) -> Any:
        prepared = real(*arguments, **more)
        files = dict(prepared.sumo_files)
        files["routes.rou.xml"] = (
            '<routes><vehicle id="a" depart="0"><route edges="nowhere"/></vehicle></routes>'
        )
        object.__setattr__(prepared, "sumo_files", files)
        return prepared

    monkeypatch.setattr(active_runs, "prepare_run", spoiled)
    bad = start(client, sampled)
    seen = watch(client, bad)
    assert seen.of("end")[0]["state"] == "failed"
    assert "nowhere" in seen.of("end")[0]["error"]
    info = finished(client, bad)
    assert (info["state"], info["summary"]["status"]) == ("failed", "failed")
    assert "nowhere" in info["error"]
    assert client.get(f"/api/runs/{good}").json()["state"] == "running"
    control(client, good, "stop")
    assert finished(client, good)["state"] == "stopped"


@pytest.mark.slow
def test_a_worker_that_is_killed_is_a_failed_run(client: TestClient, sampled: str) -> None:
    run = start(client, sampled, speed=1)
    with client.websocket_connect(f"/api/runs/{run}/live") as socket:
        said = []
        for message in messages(socket):
            if isinstance(message, np.ndarray):
                client.app.state.services.runs.active(run).live.kill()
            else:
                said.append(message)
    assert said[-1]["state"] == "failed"
    assert "SIGKILL" in said[-1]["error"]
    assert finished(client, run)["state"] == "failed"
    for what in ("trajectories", "curves", "events", "report.html"):
        assert client.get(f"/api/runs/{run}/{what}").status_code == 404


def test_a_socket_for_an_unknown_run_is_refused(client: TestClient) -> None:
    with (
        pytest.raises(WebSocketDisconnect),
        client.websocket_connect("/api/runs/nothing-1/live"),
    ):
        pass


@pytest.mark.slow
def test_a_client_that_never_reads_costs_the_others_nothing(served: str, sampled: str) -> None:
    url = f"http://{served}/api"
    run = httpx2.post(f"{url}/runs", json={"scenario": sampled, "speed": 5}).json()["run"]
    address = f"ws://{served}/api/runs/{run}/live"
    deaf = [connect(address) for _ in range(3)]
    steps, frames = [], 0
    with connect(address) as socket:
        for message in socket:
            if isinstance(message, bytes):
                frames += 1
                steps.append(int(np.frombuffer(message, "<f4")[0]))
                socket.send("ack")
                if frames == 40:
                    httpx2.post(f"{url}/runs/{run}/control", json={"action": "stop"})
            else:
                last = json.loads(message)
    assert last["type"] == "end"
    # Every step of a run of 10 steps a second, but for those that a busy machine skips.
    assert steps[-1] - steps[0] < 2 * len(steps)
    for socket in deaf:
        socket.socket.close()
    assert httpx2.get(f"{url}/health").status_code == 200


@pytest.mark.slow
def test_a_slow_client_gets_the_newest_frame_and_only_that(served: str, sampled: str) -> None:
    url = f"http://{served}/api"
    wish = {"scenario": sampled, "speed": 5}  # so that it lasts longer than a busy machine takes
    run = httpx2.post(f"{url}/runs", json=wish).json()["run"]
    with connect(f"ws://{served}/api/runs/{run}/live") as socket:
        steps = []
        for message in socket:
            if isinstance(message, bytes):
                steps.append(int(np.frombuffer(message, "<f4")[0]))
                if len(steps) == 4:
                    break
                time.sleep(0.5)
                socket.send("ack")
    httpx2.post(f"{url}/runs/{run}/control", json={"action": "stop"})
    assert all(b - a > 1 for a, b in itertools.pairwise(steps[1:]))  # a queue would give each


@pytest.mark.slow
def test_several_run_at_once_and_the_end_of_the_server_is_their_end(
    client: TestClient, sampled: str
) -> None:
    names = [start(client, sampled, speed=0.5) for _ in range(3)]
    assert len(set(names)) == 3
    shared = client.app.state.services
    for name in names:
        wait_for(lambda name=name: client.get(f"/api/runs/{name}").json()["state"] == "running")
    shared.close()
    assert {shared.runs.info(name).state for name in names} == {"stopped"}


@pytest.mark.slow
def test_at_most_so_many_go_on_at_a_time(
    client: TestClient, sampled: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(active_runs, "MOST", 1)
    run = start(client, sampled, speed=1)
    answer = client.post("/api/runs", json={"scenario": sampled})
    assert answer.status_code == 409
    assert client.delete(f"/api/runs/{run}").status_code == 409
    control(client, run, "stop")
    finished(client, run)


@pytest.mark.slow
def test_the_server_never_imports_libsumo(workspace: Workspace, sampled: str) -> None:
    script = """
import sys, time
from pathlib import Path
from starlette.testclient import TestClient
from odscen.maps.store import Workspace
from odscen.web.application import create_app
with TestClient(create_app(Workspace.open(Path(sys.argv[1]))), base_url="http://localhost") as c:
    run = c.post("/api/runs", json={"scenario": sys.argv[2]}).json()["run"]
    while c.get(f"/api/runs/{run}").json()["state"] not in ("completed", "failed"):
        time.sleep(0.05)
    print(c.get(f"/api/runs/{run}").json()["state"], "libsumo" in sys.modules)
"""
    done = subprocess.run(
        [sys.executable, "-c", script, workspace.root, sampled],
        capture_output=True,
        text=True,
        timeout=180,
        check=True,
    )
    assert done.stdout.split() == ["completed", "False"]


@pytest.mark.slow
def test_a_worker_ends_when_the_program_that_started_it_is_gone(
    workspace: Workspace, sampled: str, tmp_path: Path
) -> None:
    script = """
import os, sys, threading, time
from pathlib import Path
from odscen.app.maps import load_map
from odscen.app.scenarios import read_scenario
from odscen.maps.store import Workspace
from odscen.runs.run_sums import seal_again
from odscen.sumo.runner.live_run import Live
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.worker.protocol import Pace
from odscen.sumo.runner.run_jobs import run_prepared
workspace = Workspace.open(Path(sys.argv[1]))
scenario = read_scenario(workspace.scenarios / f"{sys.argv[2]}.scenario.json")
entry = workspace.map("signal_crossing")
prepared = prepare(scenario, load_map(entry).sumo, entry.path("net"))
live = Live(Pace(speed=0.1))
threading.Thread(
    target=run_prepared, args=(prepared, Path(sys.argv[3]) / "run"), kwargs={"live": live},
    daemon=True,
).start()
while live.progress is None:
    time.sleep(0.01)
print(live._process.pid, flush=True)
os._exit(0)
"""
    done = subprocess.run(
        [sys.executable, "-c", script, workspace.root, sampled, tmp_path],
        capture_output=True,
        text=True,
        timeout=180,
        check=True,
    )
    pid = int(done.stdout)
    wait_for(lambda: not _alive(pid))


def _alive(pid: int) -> bool:
    import psutil

    return psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE


@pytest.mark.slow
def test_threads_end_with_the_server(client: TestClient, sampled: str) -> None:
    run = start(client, sampled)
    finished(client, run)
    client.app.state.services.close()
    wait_for(lambda: not any(t.name.startswith(("run", "job")) for t in threading.enumerate()))


def test_an_interrupted_long_run_is_listed_as_such_and_can_be_removed(
    client: TestClient, workspace: Workspace
) -> None:
    folder = workspace.runs / "night"
    folder.mkdir(parents=True)
    status = {
        "format": "odscen-status", "version": 1, "scenario": "night", "time": 7200.0,
        "until": 86400.0, "slices": 2, "running": 5, "departed": 50, "arrived": 45, "planned": 900,
    }  # fmt: skip
    (folder / "status.json").write_text(json.dumps(status))
    (folder / "run.json").write_text(json.dumps({"about": {"map": "town"}}))
    (info,) = [row for row in client.get("/api/runs").json() if row["run"] == "night"]
    assert (info["state"], info["map"]) == ("interrupted", "town")
    assert info["progress"]["arrived"] == 45
    assert info["error"].startswith("Interrupted at 2:00 of 24:00 h.")
    for part in ("summary", "report.html", "trajectories"):
        refused = client.get(f"/api/runs/night/{part}")
        assert refused.status_code == 409
        assert "odscen resume" in refused.json()["error"]["message"]
    assert client.delete("/api/runs/night").status_code == 200
    assert not folder.exists()


@pytest.mark.slow
def test_a_run_says_how_far_its_routes_by_travel_time_have_been_found(
    client: TestClient, sampled: str
) -> None:
    version = client.get(f"/api/scenarios/{sampled}").json()["version"]
    wanted = [
        {"kind": "set_background", "background": "some", "per_km": 20},
        {"kind": "set_routes", "by": "travel_time", "iterations": 3},
    ]
    path = f"/api/scenarios/{sampled}/edits"
    answer = client.post(path, json={"version": version, "edits": wanted})
    assert answer.status_code == 200, answer.text
    run = start(client, sampled)
    said = wait_for(lambda: client.get(f"/api/runs/{run}").json()["preparing"])
    assert said.startswith("routes, iteration ")
    assert "gap" in said
    info = finished(client, run)
    assert (info["state"], info["preparing"]) == ("completed", None)
