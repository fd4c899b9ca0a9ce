"""A watched run against the same run unwatched, and the time from "run" to the first frame.

Aims: a run with 2,000 vehicles slowed by at most 10 % while it is in a hurry, 20 steps of simulated
time a second held while it keeps that pace, and 1.5 s to the first frame on a shipped map.
"""

from __future__ import annotations

import os
import socket
import statistics
import tempfile
import threading
import time
from pathlib import Path

import httpx2
import numpy as np
import uvicorn
from websockets.sync.client import connect

from bench import recording
from odscen.app.generation import generate
from odscen.app.scenarios import SUFFIX
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.runs import layout
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.sumo.runner.live_run import Live
from odscen.sumo.runner.worker_process import run_worker
from odscen.sumo.worker.protocol import Command, Pace
from odscen.web.application import create_app

VEHICLES = 2200
SECONDS = 120.0
REPEATS = 3
MAP = "signal_crossing"


def main() -> None:
    first_frame()
    slowdown()


def first_frame() -> None:
    """From the request to the first frame, over a real server."""
    with tempfile.TemporaryDirectory() as name:
        workspace = Workspace.open(Path(name))
        workspace.add_map(next(path for path in shipped_maps() if path.stem == MAP))
        path = generate(workspace, settings=GenerationSettings(map_name=MAP, seed=5, fill=0.3))[0]
        scenario = path.name.removesuffix(SUFFIX)
        bound = socket.create_server(("127.0.0.1", 0))
        server = uvicorn.Server(uvicorn.Config(create_app(workspace), log_level="warning"))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [bound]})
        thread.start()
        address = f"127.0.0.1:{bound.getsockname()[1]}"
        times = [_first_frame(address, scenario) for _ in range(6)]
        server.should_exit = True
        thread.join()
    print(
        f"first frame on {MAP}: {times[0]:.2f} s for the first run of a server, then "
        f"{statistics.median(times[1:]):.2f} s (aim 1.5)"
    )


def _first_frame(address: str, scenario: str) -> float:
    begin = time.perf_counter()
    wish = {"scenario": scenario, "speed": 1}
    run = httpx2.post(f"http://{address}/api/runs", json=wish, timeout=30).json()["run"]
    with connect(f"ws://{address}/api/runs/{run}/live") as opened:
        for message in opened:
            if isinstance(message, bytes):
                break
    seconds = time.perf_counter() - begin
    httpx2.post(f"http://{address}/api/runs/{run}/control", json={"action": "stop"})
    return seconds


class Watcher:
    """A client that is as fast as the run: asks for the next frame once it has one."""

    def __init__(self, live: Live) -> None:
        self.steps: list[int] = []
        self.sizes: list[int] = []
        self._live = live
        self._number = 0
        live.add_watcher(self._wake)
        live.ask_frame()

    def _wake(self) -> None:
        picture = self._live.picture
        if picture.number > self._number:
            self._number = picture.number
            header = np.frombuffer(picture.frame, "<f4", count=5)
            self.steps.append(int(header[0]))
            self.sizes.append(int(header[2]))
            self._live.ask_frame()


def slowdown() -> None:
    import sumo

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        recording.VEHICLES, recording.SECONDS = VEHICLES, SECONDS
        recording.prepare(folder, Path(sumo.SUMO_HOME) / "bin")
        times: dict[str, list[float]] = {"unwatched": [], "unseen": [], "watched": []}
        watcher = None
        for turn in range(REPEATS + 1):
            for kind, values in times.items():
                live = None if kind == "unwatched" else Live(Pace())
                if live is not None and kind == "watched":
                    watcher = Watcher(live)
                seconds = _run(folder, live)
                if turn:
                    values.append(seconds)
        paced = _paced(folder)
    middle = {kind: statistics.median(values) for kind, values in times.items()}
    if watcher is None:
        raise AssertionError
    print(
        f"{VEHICLES} vehicles (at most {max(watcher.sizes)} at once): unwatched "
        f"{middle['unwatched']:.2f} s, can be watched but is not "
        f"{middle['unseen'] / middle['unwatched']:.3f} of it, watched "
        f"{middle['watched'] / middle['unwatched']:.3f} (aim 1.10), CPU seconds, "
        f"{len(watcher.steps)} frames"
    )
    print(paced)


def _run(folder: Path, live: Live | None) -> float:
    """CPU seconds of the worker, whose folder is as new."""
    for name in (layout.EVENTS_FILE, layout.ACTORS_FILE, layout.TRAJECTORIES_FILE, layout.LOG_FILE):
        (folder / name).unlink(missing_ok=True)
    before = os.times()
    ended = run_worker(folder, live=live)
    after = os.times()
    if ended.error:
        raise RuntimeError(ended.error)
    return (
        after.children_user
        + after.children_system
        - (before.children_user + before.children_system)
    )


def _paced(folder: Path) -> str:
    """Hold 20 steps a second (of half a second each) with everybody on the road."""
    for name in (layout.EVENTS_FILE, layout.ACTORS_FILE, layout.TRAJECTORIES_FILE, layout.LOG_FILE):
        (folder / name).unlink(missing_ok=True)
    live = Live(Pace())
    ended = threading.Thread(target=run_worker, args=(folder,), kwargs={"live": live})
    ended.start()
    while live.progress is None or live.progress.time < 60:
        time.sleep(0.01)
    live.command(Command("speed", 10.0))
    watcher = Watcher(live)
    time.sleep(1)
    seen, begin = len(watcher.steps), time.perf_counter()
    first = watcher.steps[-1]
    time.sleep(4)  # with what went before less than the 60 s that are left, at 10 a second
    seconds = time.perf_counter() - begin
    frames, steps = len(watcher.steps) - seen, watcher.steps[-1] - first
    live.command(Command("stop"))
    ended.join()
    return (
        f"at a pace of 20 steps a second with {watcher.sizes[-1]} vehicles: {steps / seconds:.1f} "
        f"steps and {frames / seconds:.1f} frames a second (aim 20)"
    )
