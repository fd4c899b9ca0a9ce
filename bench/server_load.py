"""Whether the server stays there under load: how long ``/api/health`` takes meanwhile.

Aim: at most 0.5 s with 500 connections, 100 slow uploads, a scenario of 200,000 actors, 20 runs at
once, each by itself. The server is a process of its own; each answer is asked for on a connection
of its own, as a new client would.
"""

from __future__ import annotations

import http.client
import json
import socket
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import cycle
from pathlib import Path
from typing import NamedTuple

import numpy as np

from odscen.app.generation import generate
from odscen.app.scenarios import SUFFIX, read_scenario
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import dumps
from odscen.scenario.sampling.generation_settings import GenerationSettings
from tools import page as tool

MAP = "signal_crossing"
AIM = 0.5
PAUSE = 0.02


class Row(NamedTuple):
    """What was asked of the server, and how long its health took meanwhile; seconds."""

    load: str
    seconds: float
    asked: int
    failed: int
    median: float
    largest: float


def main() -> None:
    print(f"| load | s | asked | failed | median, s | largest, s (aim {AIM}) |")
    print("|---|---|---|---|---|---|")
    for row in measure():
        print(
            f"| {row.load} | {row.seconds:.1f} | {row.asked} | {row.failed} "
            f"| {row.median:.3f} | {row.largest:.3f} |",
            flush=True,
        )


def measure(
    *,
    connections: int = 500,
    uploads: int = 100,
    actors: int = 200_000,
    runs: int = 20,
    seconds: float = 8.0,
) -> Iterator[Row]:
    """Yield a row for each kind of load."""
    with tempfile.TemporaryDirectory() as name:
        workspace = Workspace.open(Path(name))
        workspace.add_map(next(path for path in shipped_maps() if path.stem == MAP))
        path = generate(workspace, settings=GenerationSettings(map_name=MAP, seed=5, fill=0.3))[0]
        crowd = _crowd(path, actors)
        with tool.served(Path(name)) as server:
            address = server.url.removeprefix("http://")
            yield _while(address, "nothing", lambda: time.sleep(seconds))
            with ExitStack() as stack:
                for number in range(connections):
                    stack.enter_context(_connection(address, finished=number % 2 == 0))
                yield _while(address, f"{connections} connections", lambda: time.sleep(seconds))
            with _slow_uploads(address, uploads):
                yield _while(address, f"{uploads} slow uploads", lambda: time.sleep(seconds))
            scenario = path.name.removesuffix(SUFFIX)
            yield _while(address, f"{runs} runs at once", lambda: _runs(address, scenario, runs))
            label = f"a scenario of {actors:,} actors: "
            for what, work in _steps(address, crowd):
                yield _while(address, label + what, work)
            with ExitStack() as stack:
                for number in range(connections):
                    stack.enter_context(_connection(address, finished=number % 2 == 0))
                stack.enter_context(_slow_uploads(address, uploads))
                yield _while(
                    address, "all of it at once", lambda: _at_once(address, crowd, scenario, runs)
                )


def _while(address: str, load: str, work: Callable[[], None]) -> Row:
    """Do the work, and ask for the server's health all the time."""
    times: list[float] = []
    failed = 0
    done = threading.Event()

    def ask() -> None:
        nonlocal failed
        while not done.is_set():
            start = time.perf_counter()
            try:
                if _call(address, "GET", "/api/health") != 200:
                    failed += 1
            except OSError:
                failed += 1
            times.append(time.perf_counter() - start)
            time.sleep(PAUSE)

    asking = threading.Thread(target=ask)
    start = time.perf_counter()
    asking.start()
    try:
        work()
    finally:
        took = time.perf_counter() - start
        done.set()
        asking.join()
    return Row(load, took, len(times), failed, float(np.median(times)), max(times))


def _call(
    address: str, method: str, path: str, body: bytes | None = None, kind: str = "application/json"
) -> int:
    """Status of an answer that was read to its end."""
    client = http.client.HTTPConnection(address, timeout=600)
    try:
        headers = {} if body is None else {"Content-Type": kind}
        client.request(method, path, body, headers)
        answer = client.getresponse()
        answer.read()
        return answer.status
    finally:
        client.close()


@contextmanager
def _connection(address: str, *, finished: bool) -> Iterator[None]:
    """A connection that has been answered and stays, or that never ends the head of a request."""
    host, port = address.rsplit(":", 1)
    with socket.create_connection((host, int(port)), timeout=60) as opened:
        head = f"GET /api/health HTTP/1.1\r\nHost: {address}\r\n"
        opened.sendall((head + ("\r\n" if finished else "X-Slow: ")).encode())
        yield


@contextmanager
def _slow_uploads(address: str, count: int) -> Iterator[None]:
    """Maps that come at a few kilobytes a second each."""
    done = threading.Event()
    host, port = address.rsplit(":", 1)
    head = (
        f"POST /api/maps HTTP/1.1\r\nHost: {address}\r\nContent-Length: 60000000\r\n"
        "Content-Type: multipart/form-data; boundary=b\r\n\r\n"
        '--b\r\nContent-Disposition: form-data; name="file"; filename="m.xodr"\r\n\r\n'
    ).encode()

    def send() -> None:
        with ExitStack() as stack:
            opened = [
                stack.enter_context(socket.create_connection((host, int(port)), timeout=60))
                for _ in range(count)
            ]
            for one in opened:
                one.sendall(head)
            while not done.wait(0.2):
                for one in opened:
                    one.sendall(b"x" * 1024)

    sending = threading.Thread(target=send)
    sending.start()
    try:
        yield
    finally:
        done.set()
        sending.join()


def _runs(address: str, scenario: str, count: int) -> None:
    """Start runs at once, as many as the server takes, and wait for their ends."""
    wish = json.dumps({"scenario": scenario, "until": 120}).encode()
    starts = [
        threading.Thread(target=_call, args=(address, "POST", "/api/runs", wish))
        for _ in range(count)
    ]
    for one in starts:
        one.start()
    for one in starts:
        one.join()
    while any(info["state"] in ("preparing", "running", "finishing") for info in _list(address)):
        time.sleep(0.2)


def _list(address: str) -> list[dict[str, str]]:
    client = http.client.HTTPConnection(address, timeout=600)
    try:
        client.request("GET", "/api/runs")
        found: list[dict[str, str]] = json.loads(client.getresponse().read())
        return found
    finally:
        client.close()


def _crowd(path: Path, count: int) -> bytes:
    """A scenario with so many actors, each departing from one of the places of another."""
    scenario = read_scenario(path)
    known = scenario.actors
    actors = tuple(
        one.model_copy(update={"id": f"a{n}", "depart": 5.0 * (n // len(known))})
        for n, one in zip(range(count), cycle(known), strict=False)
    )
    return dumps(scenario.model_copy(update={"name": "crowd", "actors": actors})).encode()


def _steps(
    address: str, document: bytes, *, name: str = "crowd"
) -> Iterator[tuple[str, Callable[[], None]]]:
    """What people do with a scenario, one after the other; each is made when its turn comes."""
    kind = "multipart/form-data; boundary=b"
    form = b'--b\r\nContent-Disposition: form-data; name="%s"%s\r\n\r\n%s\r\n'
    body = form % (b"file", b'; filename="crowd.json"', document)
    body += form % (b"name", b"", name.encode()) + b"--b--"
    own = f"/api/scenarios/{name}"

    def done(status: int, method: str, path: str, *content: object) -> Callable[[], None]:
        def work() -> None:
            found = _call(address, method, path, *content)  # type: ignore[arg-type]
            if found != status:
                raise RuntimeError(f"{method} {path} was answered with {found}")

        return work

    edit = {"version": 1, "edits": [{"kind": "set_seed", "seed": 6}]}
    yield "uploaded, checked", done(201, "POST", "/api/scenarios/upload", body, kind)
    yield "listed", done(200, "GET", "/api/scenarios")
    yield "opened, checked", done(200, "GET", own)
    yield "edited, checked", done(200, "POST", f"{own}/edits", json.dumps(edit).encode())
    yield "undone", done(200, "POST", f"{own}/undo", b'{"version": 2}')
    yield "downloaded", done(200, "GET", f"{own}/download")
    yield "its map asked after", done(200, "GET", f"/api/maps/{MAP}/removal")


def _at_once(address: str, document: bytes, scenario: str, runs: int) -> None:
    """Runs, and all that is done with a large scenario, while others do the same."""

    def use() -> None:
        for _, work in _steps(address, document, name="more"):
            work()

    using = threading.Thread(target=use)
    using.start()
    try:
        _runs(address, scenario, runs)
    finally:
        using.join()
