"""What goes wrong between two simulators: each ends in words and an exit code, and leaves nothing.

Every run is the command line in a process of its own: the client is C++, and might end it.
"""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest

from odscen.maps.store import Workspace
from tests.carla.conftest import MAPS, Sample
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

CROSSING = MAPS / "signal_crossing.xodr"
PATIENCE = 90.0
"""Seconds after which a run hangs."""


class Run:
    """``odscen cosim`` as a process."""

    def __init__(self, folder: Path, *arguments: object) -> None:
        self.out = folder
        self._process = subprocess.Popen(
            [
                sys.executable, "-m", "odscen", "cosim", *map(str, arguments), "--out",
                str(folder), "--json",
            ],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        self.process = psutil.Process(self._process.pid)

    def wait(self) -> tuple[int, dict[str, Any], str]:
        """Exit code, JSON, words."""
        try:
            out, err = self._process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            pytest.fail("the run hangs")
        return self._process.returncode, json.loads(out), err

    def signal(self, number: int) -> None:
        os.kill(self._process.pid, number)


Start = Callable[..., Run]


@pytest.fixture
def start(workspace: Workspace, sample: Sample, tmp_path: Path) -> Start:
    """Return a function that starts a run of a scenario at the crossing."""
    path = sample(CROSSING, seed=1)

    def started(server: StandIn | int, *arguments: object, until: float = 6.0) -> Run:
        port = server if isinstance(server, int) else server.port
        return Run(
            tmp_path, path, "--carla", f"127.0.0.1:{port}", "--workspace", workspace.root,
            "--until", until, "--step-length", 0.1, "--tick", 0.1, *arguments,
        )  # fmt: skip

    return started


def shown(server: StandIn, *, below: float = math.inf) -> list[str]:
    kinds = ("vehicle.", "walker.")
    there = [a for a in server.actors() if a["type_id"].startswith(kinds)]
    return [a["type_id"] for a in there if a["transform"][0][2] < below]


def is_as_before(server: StandIn) -> bool:
    """Whether nobody of ours is there and the server's time goes on by itself."""
    client = carla.Client(server.host, server.port)
    client.set_timeout(5.0)
    world = client.get_world()
    lights = world.get_actors().filter("traffic.traffic_light*")
    return (
        not shown(server)
        and not world.get_settings().synchronous_mode
        and bool(world.wait_for_tick(5.0))
        and not any(light.is_frozen() for light in lights)
    )


def wait_for_actors(server: StandIn, run: Run) -> None:
    """Wait for road users; one of each model is made aloft to be measured before the run."""
    deadline = time.monotonic() + PATIENCE
    while len(shown(server, below=100.0)) < 5:
        assert time.monotonic() < deadline
        assert run.process.status() != psutil.STATUS_ZOMBIE, "the run has ended early"
        time.sleep(0.05)


def recorded(run: Run) -> bool:
    """Whether SUMO's results so far were kept."""
    [folder] = [path for path in run.out.iterdir() if path.is_dir()]
    summary = json.loads((folder / "summary.json").read_text())
    files = ("trajectories.parquet", "events.json", "actors.json")
    return bool(summary["stopped"]) and all((folder / name).is_file() for name in files)


@pytest.mark.slow
def test_nothing_wrong_is_exit_code_0(start: Start) -> None:
    with StandIn(CROSSING) as server:
        code, told, _ = start(server).wait()
        assert code == 0
        assert told["status"] == "completed"
        assert told["carla"]["spawned"] == told["actors"]["inserted"] > 20
        assert is_as_before(server)


def test_an_absent_server_is_told_before_anything_runs(start: Start) -> None:
    run = start(9, "--timeout", 0.5)
    code, told, _ = run.wait()
    assert code == 3
    assert "no CARLA server at 127.0.0.1:9" in told["error"]["message"]
    assert list(run.out.iterdir()) == []


@pytest.mark.slow
def test_another_version_is_told(start: Start) -> None:
    with StandIn(CROSSING, version="0.9.14") as server:
        code, told, _ = start(server).wait()
        assert code == 3
        assert "release 0.9.14" in told["error"]["message"]


@pytest.mark.slow
def test_another_map_is_told_if_it_may_not_be_changed(start: Start) -> None:
    with StandIn(MAPS / "roundabout.xodr") as server:
        code, told, _ = start(server, "--keep-map").wait()
        assert code == 3
        assert "shows roundabout" in told["error"]["message"]
        assert is_as_before(server)


@pytest.mark.slow
def test_another_map_is_changed_if_it_may_be(start: Start) -> None:
    with StandIn(MAPS / "roundabout.xodr") as server:
        code, told, _ = start(server).wait()
        assert (code, told["carla"]["map"], told["carla"]["refused"]) == (0, "generated", [])
        assert told["carla"]["signals_missing"] == []
        assert is_as_before(server)


@pytest.mark.slow
def test_a_server_that_dies_ends_the_run_with_what_sumo_did(start: Start) -> None:
    with StandIn(CROSSING, die_at_tick=30) as server:
        run = start(server, "--timeout", 2)
        code, told, words = run.wait()
        assert (code, told["status"], told["usable"]["level"]) == (3, "failed", "not usable")
        assert (
            "is gone: no server listens there any more" in told["error"] == told["carla"]["error"]
        )
        assert "Traceback" not in words
        assert recorded(run)


@pytest.mark.slow
def test_a_server_that_freezes_for_a_while_is_waited_for(start: Start) -> None:
    with StandIn(CROSSING, freeze_at_tick=30, freeze_seconds=5.0) as server:
        code, told, _ = start(server, "--timeout", 10).wait()
        assert (code, told["carla"]["error"]) == (0, None)
        assert is_as_before(server)


@pytest.mark.slow
def test_a_server_that_freezes_for_too_long_is_given_back_once_it_thaws(start: Start) -> None:
    with StandIn(CROSSING, freeze_at_tick=30, freeze_seconds=5.0) as server:
        run = start(server, "--timeout", 1)
        code, told, _ = run.wait()
        assert code == 3
        assert "has not answered for 1 s" in told["carla"]["error"]
        assert told["carla"]["left_behind"] == []
        assert recorded(run)
        assert is_as_before(server)


@pytest.mark.slow
def test_a_server_that_freezes_for_ever_is_left_with_a_word(start: Start) -> None:
    with StandIn(CROSSING) as server:
        run = start(server, "--timeout", 3, until=60.0)
        wait_for_actors(server, run)
        server.pause()
        code, told, _ = run.wait()
        server.resume()
        assert code == 3
        assert "has not answered for 3 s" in told["carla"]["error"]
        assert "could not be taken back" in told["carla"]["left_behind"][0]
        assert recorded(run)


@pytest.mark.slow
def test_refused_spawns_are_tried_again_and_nobody_is_missing(start: Start) -> None:
    with StandIn(CROSSING, refuse_spawn_every=3) as server:
        code, told, _ = start(server).wait()
        assert (code, told["carla"]["refused"]) == (0, [])
        assert told["carla"]["spawned"] == told["actors"]["inserted"]
        assert is_as_before(server)


@pytest.mark.slow
def test_those_whom_the_server_never_takes_are_named(start: Start) -> None:
    with StandIn(CROSSING, refuse_spawn_every=1) as server:
        code, told, words = start(server).wait()
        assert (code, told["status"], told["carla"]["spawned"]) == (3, "failed", 0)
        assert "takes no road user" in told["error"]
        assert len(told["carla"]["refused"]) > 20
        assert "not taken by CARLA" in words
        assert "collision" in words
        assert is_as_before(server)


@pytest.mark.slow
def test_a_run_too_short_to_be_given_up_is_no_success_where_nobody_was_shown(start: Start) -> None:
    with StandIn(CROSSING, refuse_spawn_every=1) as server:
        code, told, _ = start(server, until=1.0).wait()
        assert (code, told["carla"]["spawned"]) == (3, 0)
        assert re.search(r"takes no road user|has taken none of \d+ road users", str(told))
        assert is_as_before(server)


@pytest.mark.slow
def test_a_server_that_does_not_say_where_the_ground_is_shows_the_run_with_a_word(
    start: Start,
) -> None:
    with StandIn(CROSSING, no_projection=True) as server:
        code, told, words = start(server, until=5.0).wait()
        assert (code, told["status"]) == (0, "completed")
        assert told["carla"]["spawned"] > 20
        assert sum("does not say where the ground is" in w for w in told["carla"]["warnings"]) == 1
        assert "does not say where the ground is" in words
        assert is_as_before(server)


@pytest.mark.slow
def test_another_client_that_ticks_ends_the_run_with_its_frames(start: Start) -> None:
    with StandIn(CROSSING) as server:
        run = start(server, until=60.0)
        wait_for_actors(server, run)
        other = carla.Client(server.host, server.port)
        other.set_timeout(5.0)
        other.get_world().tick()
        code, told, words = run.wait()
        assert (code, told["status"]) == (3, "failed")
        assert "only one client may tick" in told["error"] == told["carla"]["error"]
        assert told["carla"]["left_behind"] == []
        assert "Traceback" not in words
        assert recorded(run)
        assert is_as_before(server)


@pytest.mark.slow
def test_a_time_that_others_set_ends_the_run(start: Start) -> None:
    with StandIn(CROSSING, time_factor=2.0) as server:
        code, told, _ = start(server).wait()
        assert (code, told["status"]) == (3, "failed")
        assert "a tick of 0.1 s led the CARLA server" in told["error"]
        assert "by 0.2 s: another client changes its settings" in told["error"]
        assert is_as_before(server)


@pytest.mark.slow
def test_a_stream_that_is_cut_once_is_taken_up_again(start: Start) -> None:
    with StandIn(CROSSING, drop_stream_at_tick=30) as server:
        code, told, _ = start(server, "--timeout", 2).wait()
        assert (code, told["carla"]["error"]) == (0, None)
        assert told["carla"]["interruptions"] == 1
        assert is_as_before(server)


@pytest.mark.slow
def test_a_stream_that_stays_cut_ends_the_run(start: Start) -> None:
    with StandIn(CROSSING) as server:
        run = start(server, "--timeout", 1, until=60.0)
        wait_for_actors(server, run)
        server.set(drop_stream_at_tick=1, refuse_streams=True)
        code, told, _ = run.wait()
        server.set(refuse_streams=False)
        assert code == 3
        assert "has not answered" in told["carla"]["error"]
        assert recorded(run)
        assert is_as_before(server)


@pytest.mark.slow
def test_when_sumo_dies_nothing_is_left_in_carla(start: Start) -> None:
    with StandIn(CROSSING) as server:
        run = start(server, until=60.0)
        wait_for_actors(server, run)
        [worker] = [
            child
            for child in run.process.children()
            if "odscen.sumo.worker.simulate" in child.cmdline()
        ]
        worker.kill()
        code, told, _ = run.wait()
        assert (code, told["status"]) == (3, "failed")
        assert "ended by signal SIGKILL" in told["error"]
        assert is_as_before(server)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_keeps_what_sumo_did_and_leaves_nothing(
    start: Start, number: int
) -> None:
    with StandIn(CROSSING) as server:
        run = start(server, until=60.0)
        wait_for_actors(server, run)
        run.signal(number)
        code, told, _ = run.wait()
        assert code == 130
        assert told["carla"]["interrupted"]
        assert recorded(run)
        assert is_as_before(server)
