"""A real ``odscen serve`` on a free port with a throw-away workspace."""

from __future__ import annotations

import http.client
import re
import shutil
import time
from dataclasses import dataclass, field
from pathlib import Path

from bench.fuzz.limits import Limits, high_water, kill_tree
from bench.fuzz.material import Material

_URL = re.compile(r"http://127\.0\.0\.1:(\d+)/\S*")
START = 60.0
TRIALS = 200
"""Trials with one server; what they uploaded and deleted goes with it."""


@dataclass(slots=True)
class Served:
    """The server of the bench, started when it is first needed and now and then anew."""

    material: Material
    limits: Limits
    root: Path
    pid: int = 0
    port: int = 0
    trials: int = 0
    read: int = 0
    starts: int = field(default=0)

    @property
    def folder(self) -> Path:
        return self.root / f"served-{self.starts}"

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def ready(self) -> None:
        """Make sure that a server answers."""
        self.trials += 1
        if self.pid and self.trials <= TRIALS and high_water(self.pid):
            return
        self.stop()
        self.starts += 1
        self.trials = self.read = 0
        self.folder.mkdir(parents=True)
        shutil.copytree(self.material.workspace, self.folder / "workspace")
        scenarios = self.folder / "workspace" / "scenarios"
        scenarios.mkdir(exist_ok=True)
        for name in ("done.scenario.json", "full.scenario.json", "turned.scenario.json"):
            shutil.copy(self.material.file(name), scenarios)
        argv = [
            "serve",
            "--port",
            "0",
            "--no-browser",
            "--workspace",
            str(self.folder / "workspace"),
            *_no_token(),
        ]
        self.pid = self.limits.start(argv, self.folder, whole=True)
        self.limits.own.add(self.pid)
        self.port = self._port()

    def _port(self) -> int:
        end = time.monotonic() + START
        while time.monotonic() < end:
            if found := _URL.search(self.said(whole=True)):
                port = int(found[1])
                _answers(port, end)
                return port
            time.sleep(0.05)
        raise RuntimeError(f"odscen serve does not start: {self.said(whole=True)}")

    def said(self, *, whole: bool = False) -> str:
        """What the server has written since it was last asked."""
        text = ""
        for name in ("err", "out"):
            file = self.folder / name
            text += file.read_text(encoding="utf-8", errors="replace") if file.exists() else ""
        new = text if whole else text[self.read :]
        if not whole:
            self.read = len(text)
        return new

    def stop(self) -> None:
        """Kill the server, if there is one, and remove its workspace."""
        if self.pid:
            kill_tree(self.pid)
            self.limits.own.discard(self.pid)
            self.limits.clean(0.0)
            shutil.rmtree(self.folder, ignore_errors=True)
            self.pid = 0


def _answers(port: int, end: float) -> None:
    while time.monotonic() < end:
        try:
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
            connection.request("GET", "/api/health")
            connection.getresponse().read()
        except OSError:
            time.sleep(0.05)
        else:
            return


def _no_token() -> list[str]:
    import inspect

    from odscen.cli.serve_command import serve

    return ["--no-token"] if "token" in inspect.signature(serve).parameters else []
