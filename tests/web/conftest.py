from __future__ import annotations

import shutil
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import uvicorn
from starlette.testclient import TestClient

from odscen.app.generation import generate
from odscen.app.scenarios import SUFFIX
from odscen.maps.store import Workspace
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.web.application import create_app
from odscen.web.security import LOOPBACK

SHIPPED = Path(__file__).parents[2] / "maps"
CROSSING = "signal_crossing"


@cache
def openapi_schema() -> dict[str, Any]:
    """What the server says of itself; it takes seconds, and whoever collects tests asks twice."""
    return create_app(Workspace(Path("nowhere"))).openapi()


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a workspace with one map, made once; tests get copies."""
    root = tmp_path_factory.mktemp("built")
    Workspace.open(root).add_map(SHIPPED / f"{CROSSING}.xodr")
    return root


@pytest.fixture
def workspace(built: Path, tmp_path: Path) -> Workspace:
    root = tmp_path / "workspace"
    shutil.copytree(built, root)
    return Workspace.open(root)


@pytest.fixture
def client(workspace: Workspace) -> Iterator[TestClient]:
    # "testserver" is the name that the test client's WebSockets ask for.
    app = create_app(workspace, hosts=LOOPBACK | {"testserver"})
    with TestClient(app) as opened:
        yield opened


@pytest.fixture
def sampled(workspace: Workspace) -> str:
    """Name of a scenario with cars and pedestrians that runs without problems."""
    path = generate(workspace, settings=GenerationSettings(map_name=CROSSING, seed=5, fill=0.25))[0]
    return path.name.removesuffix(SUFFIX)


@pytest.fixture
def served(workspace: Workspace) -> Iterator[str]:
    """``host:port`` of a real server."""
    with serving(workspace) as address:
        yield address


@contextmanager
def serving(workspace: Workspace, **options: Any) -> Iterator[str]:
    """``host:port`` of a real server with options of the application."""
    bound = socket.create_server(("127.0.0.1", 0))
    app = create_app(workspace, **options)
    config = uvicorn.Config(app, log_level="warning", ws="websockets-sansio")
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [bound]})
    thread.start()
    wait_for(lambda: server.started)
    try:
        yield f"127.0.0.1:{bound.getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join(timeout=60)
    assert not thread.is_alive()


def wait_for(condition: Callable[[], Any], *, seconds: float = 120.0) -> Any:
    """First true value of ``condition``."""
    end = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)
    return value


def finished(client: TestClient, run: str) -> dict[str, Any]:
    """Information on a run, once it has ended."""

    def ended() -> dict[str, Any] | None:
        info: dict[str, Any] = client.get(f"/api/runs/{run}").json()
        return info if info["state"] in ("completed", "stopped", "failed") else None

    return wait_for(ended)


def job(client: TestClient, answer: Any) -> dict[str, Any]:
    """Information on a job, once it has ended."""
    assert answer.status_code == 202, answer.text
    name = answer.json()["job"]

    def ended() -> dict[str, Any] | None:
        info: dict[str, Any] = client.get(f"/api/jobs/{name}").json()
        return info if info["state"] in ("done", "failed") else None

    return wait_for(ended)
