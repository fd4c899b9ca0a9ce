"""Ticks that the Traffic Manager would never end: freed, or the run ended and said so."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import psutil
import pytest

from odscen.carla.native import native_run
from odscen.carla.native.native_run import NativeOptions, run_native
from odscen.carla.native.native_traffic import TickWatch, free
from odscen.carla.server.client import Address
from tests.carla.conftest import MAPS, Sample
from tests.carla_standin.process import StandIn
from tests.reporters import EachProgress

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.maps.store import Workspace

msgpack = pytest.importorskip("msgpack", reason="comes with the extra carla")

CROSSING = MAPS / "signal_crossing.xodr"

UNTIL_FREED = """
import json, os, socket, sys, time
from pathlib import Path
from odscen.carla.native.native_traffic import TickWatch
from tests.carla_standin.conftest import connect, synchronize
from tests.carla_standin.process import StandIn

with socket.socket() as probe:
    probe.bind(("", 0))
    port = probe.getsockname()[1]
with StandIn(Path(sys.argv[1])) as server:
    client = connect(server)
    world = synchronize(client)
    manager = client.get_trafficmanager(port)
    manager.set_synchronous_mode(True)
    watch = TickWatch(port, lambda: world.get_snapshot().frame, patience=0.5)
    first, ticks, end = world.get_snapshot().frame, 0, time.monotonic() + 25.0
    while watch.freed < 2 and time.monotonic() < end:
        with watch.tick():
            world.tick(10.0)
        ticks += 1
    frames = world.get_snapshot().frame - first
    print(json.dumps({"freed": watch.freed, "ticks": ticks, "frames": frames}))
    sys.stdout.flush()
    os._exit(0)
"""


class _Manager:
    """Takes requests as a Traffic Manager does on its port, and answers them."""

    def __init__(self) -> None:
        self.asked: list[Any] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while True:
            line, _ = self._listener.accept()
            with line:
                requests = msgpack.Unpacker()
                while part := line.recv(4096):
                    requests.feed(part)
                    for _, number, name, arguments in requests:
                        self.asked.append((name, arguments))
                        line.sendall(msgpack.packb([1, number, None, None]))


@pytest.fixture
def manager() -> _Manager:
    return _Manager()


FREEING = [("set_synchronous_mode", [False]), ("set_synchronous_mode", [True])]


def test_a_manager_is_called_by_leaving_and_entering_synchronous_mode(manager: _Manager) -> None:
    free(manager.port)
    assert manager.asked == FREEING


@pytest.mark.slow
def test_a_tick_whose_frame_has_come_is_freed_until_it_ends(manager: _Manager) -> None:
    frames = [7]
    watch = TickWatch(manager.port, lambda: frames[0], patience=0.0)
    with watch.tick():
        frames[0] = 8
        deadline = time.monotonic() + 20.0
        while watch.freed < 2 and time.monotonic() < deadline:
            time.sleep(0.01)
    assert watch.freed >= 2
    assert manager.asked[:4] == 2 * FREEING


@pytest.mark.slow
def test_a_server_that_takes_its_time_over_a_frame_is_left_alone(manager: _Manager) -> None:
    watch = TickWatch(manager.port, lambda: 7, patience=0.0)
    with watch.tick():
        time.sleep(0.8)
    time.sleep(0.3)
    assert watch.freed == 0
    assert manager.asked == []


def test_a_manager_that_does_not_listen_is_no_end_of_the_watch() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    frames = [7]
    watch = TickWatch(port, lambda: frames[0], patience=0.0)
    with watch.tick():
        frames[0] = 8
        time.sleep(0.8)
    assert watch.freed == 0
    with pytest.raises(ConnectionRefusedError):
        free(port)


@pytest.mark.slow
def test_the_clients_own_manager_is_freed_and_no_tick_is_lost() -> None:
    """An empty world is ticked some thousand times a second: a tick hangs every few thousand."""
    pytest.importorskip("carla", reason="the real Traffic Manager is to hang")
    done = subprocess.run(
        [sys.executable, "-c", UNTIL_FREED, str(CROSSING)],
        cwd=MAPS.parent,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    if told["freed"] == 0:
        pytest.skip(f"no tick of {told['ticks']} hung on this machine")
    assert told["ticks"] > 100
    assert told["frames"] == told["ticks"]


@pytest.mark.slow
def test_a_worker_that_gives_no_sign_is_ended_and_what_it_told_is_kept(
    workspace: Workspace, sample: Sample, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("carla", reason="co-simulation needs the package carla")
    monkeypatch.setattr(native_run, "SILENCE", 3.0)
    frozen: list[int] = []

    def freeze(told: Any) -> None:
        if told.time >= 2.0 and not frozen:
            for child in psutil.Process().children():
                with suppress(psutil.ZombieProcess):  # another test's, that has ended
                    if "multiprocessing.spawn" in " ".join(child.cmdline()):
                        frozen.append(child.pid)
                        os.kill(child.pid, signal.SIGSTOP)

    with StandIn(CROSSING) as server:
        options = NativeOptions(
            address=Address(server.host, server.port, timeout=0.5), physics=False
        )
        run, _ = run_native(
            workspace,
            sample(CROSSING, seed=5),
            options,
            out=tmp_path / "runs",
            reporter=EachProgress(freeze),
        )
        left = [one["type_id"] for one in server.actors() if "vehicle." in one["type_id"]]
    assert frozen
    assert not psutil.pid_exists(frozen[0])
    assert run.status == "failed"
    assert "gave no sign for" in str(run.summary["error"])
    assert left == []
    assert max(run.trajectories()["time"]) >= 1.9
