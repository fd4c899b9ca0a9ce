from __future__ import annotations

import json
import time
from collections.abc import Iterator

import httpx2
import pytest
from starlette.testclient import TestClient

from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.web.application import create_app
from odscen.web.security import LOOPBACK
from tests.carla_standin.process import StandIn
from tests.web.conftest import CROSSING, SHIPPED, finished, serving

pytest.importorskip("carla", reason="co-simulation needs the package carla")
pytest.importorskip("av", reason="pictures need the package av")


@pytest.fixture
def standin() -> Iterator[StandIn]:
    with StandIn(SHIPPED / f"{CROSSING}.xodr") as server:
        yield server


@pytest.fixture
def page(workspace: Workspace, standin: StandIn) -> Iterator[TestClient]:
    app = create_app(
        workspace,
        hosts=LOOPBACK | {"testserver"},
        carla=Address(standin.host, standin.port, 5.0),
    )
    with TestClient(app) as opened:
        yield opened


def left(server: StandIn) -> list[str]:
    kinds = ("vehicle.", "walker.", "sensor.")
    return [a["type_id"] for a in server.actors() if a["type_id"].startswith(kinds)]


@pytest.mark.slow
def test_the_page_learns_that_a_server_is_there(page: TestClient, standin: StandIn) -> None:
    info = page.get("/api/carla").json()
    assert info["state"] == "connected"
    assert info["address"] == f"{standin.host}:{standin.port}"


def test_another_release_is_told_apart_from_nobody(page: TestClient, standin: StandIn) -> None:
    standin.set(version="0.9.15")
    info = page.get("/api/carla").json()
    assert info["state"] == "wrong_version"
    assert "0.9.15" in info["message"]


@pytest.mark.slow
def test_without_a_server_it_says_so_and_runs_go_on(workspace: Workspace, sampled: str) -> None:
    nobody = Address("127.0.0.1", 9, 0.5)
    with TestClient(create_app(workspace, hosts=None, carla=nobody)) as client:
        assert client.get("/api/carla").json()["state"] == "absent"
        run = client.post("/api/runs", json={"scenario": sampled, "until": 2}).json()["run"]
        assert finished(client, run)["state"] == "completed"
        run = client.post(
            "/api/runs", json={"scenario": sampled, "until": 2, "carla": True}
        ).json()["run"]
        info = finished(client, run)
        assert info["state"] == "failed"
        assert "no CARLA server at 127.0.0.1:9" in info["error"]


@pytest.mark.slow
def test_a_mirrored_run_is_watched_steered_and_kept(
    page: TestClient, standin: StandIn, sampled: str
) -> None:
    wish = {"scenario": sampled, "until": 30, "paused": True, "carla": True}
    run = page.post("/api/runs", json=wish).json()["run"]
    with page.websocket_connect(f"/api/runs/{run}/live") as socket:
        said = []
        while not (message := socket.receive()).get("bytes"):
            said.append(json.loads(message["text"])["type"])
        assert "hello" in said
        assert page.get(f"/api/runs/{run}").json()["carla"] is True
        assert len(left(standin)) > 1
        again = page.post("/api/runs", json=wish)
        assert again.status_code == 409
        assert "CARLA shows another run" in again.json()["error"]["message"]
    page.post(f"/api/runs/{run}/control", json={"action": "speed", "speed": None})
    page.post(f"/api/runs/{run}/control", json={"action": "resume"})
    time.sleep(0.5)
    page.post(f"/api/runs/{run}/control", json={"action": "stop"})
    info = finished(page, run)
    assert info["state"] == "stopped", info
    assert info["summary"]["actors"]["inserted"] > 0
    assert left(standin) == []


@pytest.mark.slow
def test_pictures_come_while_it_runs(workspace: Workspace, standin: StandIn, sampled: str) -> None:
    carla = Address(standin.host, standin.port, 5.0)
    with serving(workspace, carla=carla) as host, httpx2.Client(timeout=30.0) as client:
        wish = {"scenario": sampled, "until": 20, "speed": 5, "carla": True}
        run = client.post(f"http://{host}/api/runs", json=wish).json()["run"]
        with client.stream("GET", f"http://{host}/api/runs/{run}/camera") as stream:
            kind = stream.headers["content-type"]
            assert kind.startswith("multipart/x-mixed-replace")
            parts = "".join(chunk.decode("latin-1") for chunk in stream.iter_bytes())
    pictures = parts.split("--picture\r\n")[1:]
    assert len(pictures) > 3
    assert all(part.split("\r\n\r\n")[1].startswith("\xff\xd8") for part in pictures)


@pytest.mark.slow
def test_a_run_that_carla_does_not_show_has_no_camera(client: TestClient, sampled: str) -> None:
    run = client.post("/api/runs", json={"scenario": sampled, "until": 1}).json()["run"]
    assert client.get(f"/api/runs/{run}/camera").status_code == 404
    finished(client, run)
