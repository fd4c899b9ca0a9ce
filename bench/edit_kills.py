"""A server that is killed while a scenario is edited, against what it had answered.

``python -m bench edit_kills [--kills N] [--seed N]``: one edit after the other, each named by a
number, is sent to ``odscen serve``, which is killed by SIGKILL at random moments and started again.
The number that the scenario then has must be that of the last edit that was answered, or of the one
that was on its way; none may be gone or twice. At the end all edits are undone, one by one, which
must give each number once, and done again.
"""

from __future__ import annotations

import argparse
import http.client
import json
import os
import random
import shutil
import signal
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from bench.study_kills import MARK, processes_of
from odscen.app.generation import generate
from odscen.app.scenarios import SUFFIX
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.scenario.sampling.generation_settings import GenerationSettings
from tools import page

LONGEST = 1.5
"""Wall seconds from the first edit of a server to its kill at most."""


class Client:
    """Asks a server for one scenario, on a connection of its own each time."""

    def __init__(self, served: page.Served, name: str) -> None:
        self._address = served.url.removeprefix("http://")
        self._place = f"/api/scenarios/{name}"

    def ask(self, method: str, what: str = "", body: Any = None) -> Any:
        """The answer; ``OSError`` or ``HTTPException`` if the server has died."""
        connection = http.client.HTTPConnection(self._address, timeout=60)
        headers = {"Content-Type": "application/json"}
        text = None if body is None else json.dumps(body)
        connection.request(method, self._place + what, text, headers)
        answer = connection.getresponse()
        said = json.loads(answer.read())
        if answer.status != 200:
            raise RuntimeError(f"{method} {what} answers {answer.status}: {said}")
        return said

    def edit(self, version: int, number: int) -> Any:
        edits = [{"kind": "set_seed", "seed": number}]
        return self.ask("POST", "/edits", {"version": version, "edits": edits})


def main() -> None:
    options = argparse.ArgumentParser(prog="bench edit_kills")
    options.add_argument("--kills", type=int, default=20)
    options.add_argument("--seed", type=int, default=1, help="of the moments")
    asked = options.parse_args()
    chance = random.Random(asked.seed)
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as name:
        workspace = Workspace.open(Path(name) / "workspace")
        entry = workspace.add_map(next(p for p in shipped_maps() if p.stem == "signal_crossing"))
        (path,) = generate(workspace, settings=GenerationSettings(map_name=entry.name, seed=0))
        scenario = path.name.removesuffix(SUFFIX)
        os.environ[MARK] = name
        answered = written = lost = 0
        for _ in range(asked.kills):
            with page.served(workspace.root) as server:
                client = Client(server, scenario)
                state = client.ask("GET")
                found = state["document"]["seed"]
                lost += max(0, answered - found)
                written += max(0, found - answered)
                moment = chance.uniform(0.0, LONGEST)
                killer = threading.Timer(moment, server.process.send_signal, [signal.SIGKILL])
                killer.start()
                answered = found
                # What an edit finds when the server dies is one of these.
                with suppress(OSError, http.client.HTTPException):
                    while True:
                        state = client.edit(state["version"], answered + 1)
                        answered = state["document"]["seed"]
                killer.join()
        time.sleep(2.5)  # files that are younger may be another machine's and are left alone
        with page.served(workspace.root) as server:
            client = Client(server, scenario)
            state = client.ask("GET")
            last = state["document"]["seed"]
            lost += max(0, answered - last)
            numbers = [last]
            while state["undo"] is not None:
                state = client.ask("POST", "/undo", {"version": state["version"]})
                numbers.append(state["document"]["seed"])
            while state["redo"] is not None:
                state = client.ask("POST", "/redo", {"version": state["version"]})
            again = state["document"]["seed"]
        time.sleep(1.0)
        left = sorted(
            str(path.relative_to(workspace.root))
            for path in workspace.root.rglob("*")
            if ".part" in path.name or path.name.startswith((".building-", ".removed-"))
        )
        running = processes_of(name)
        kept = len(numbers) - 1
        once = numbers == list(range(last, last - kept - 1, -1))
        print(
            f"{last} edits, the server killed {asked.kills} times; {lost} answered edits lost, "
            f"{written} written that were not answered; undone {kept} times "
            f"({'each number once' if once else numbers}), done again up to {again}; left behind: "
            f"{', '.join(left) or 'no file'}, {len(running)} processes",
            flush=True,
        )
        shutil.rmtree(workspace.root, ignore_errors=True)


if __name__ == "__main__":
    main()
