"""The process of a run of a large scenario: ``python -m odscen.web.large.run_worker``.

It checks, prepares, simulates and reports, all of which holds Python's lock for seconds. The job is
the first line of standard input; what was checked, and what was prepared, are the first lines of
standard output. After that both are those of a worker, see :mod:`odscen.sumo.worker.protocol`.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
from dataclasses import replace
from io import FileIO
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from odscen.app.running.runs import carry_out, check_run, prepare_run
from odscen.app.scenarios import read_scenario
from odscen.base.error_data import error_to_data
from odscen.base.errors import OdscenError
from odscen.maps.store import Workspace
from odscen.runs.reporter import Reporter
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.scenario_document import Scenario
from odscen.sumo.runner.live_run import Live
from odscen.sumo.worker.protocol import (
    Command,
    Failed,
    Pace,
    decode,
    encode,
)
from odscen.web.wire.live_messages import introduction

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from odscen.sumo.worker.protocol import Message


class _Relay(Live):
    """Passes on what the simulation says, and what it is asked."""

    def __init__(self, pace: Pace, channel: IO[bytes]) -> None:
        super().__init__(pace)
        self._channel = channel

    def take(self, message: Message, payload: bytes) -> None:
        """Pass on what the worker says."""
        super().take(message, payload)
        if not isinstance(message, Failed):  # that is for whoever follows it to say
            self._channel.write(encode(message).encode() + payload)
            self._channel.flush()

    def listen(self, stdin: FileIO) -> None:
        """Pass on commands; without the server this ends as Ctrl-C does."""
        for line in stdin:
            command = decode(line)
            if isinstance(command, Command):
                self.command(command)
        os.kill(os.getpid(), signal.SIGTERM)


class _WordsReporter(Reporter):
    """Passes on how far routes have been found."""

    def __init__(self, say: Callable[[Mapping[str, Any]], None]) -> None:
        self._say = say

    def said(self, words: str) -> None:
        self._say({"preparing": words})


def main() -> int:
    """Do the job; 0 when the run has ended, however it did."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    channel = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print must not come between the messages
    stdin = FileIO(sys.stdin.fileno(), closefd=False)
    said_all = False

    def say(message: Mapping[str, Any]) -> None:
        channel.write(json.dumps(message).encode() + b"\n")
        channel.flush()

    try:
        job = json.loads(stdin.readline())
        scenario = read_scenario(Path(job["scenario"]))
        settings = RunSettings.from_dict(job["settings"])
        workspace = Workspace.open(Path(job["workspace"]))
        checked = check_run(workspace, scenario, name=job["name"], settings=settings)
        say({"scenario": dumps(_without_road_users(scenario))})
        name = stdin.readline().decode().strip()
        if not name:
            return 0
        run = replace(checked, name=name, folder=workspace.runs / name)
        prepared = prepare_run(run, reporter=_WordsReporter(say))
        Path(job["introduction"]).write_text(introduction(prepared.plan), encoding="utf-8")
        say({"slice_length": prepared.plan.slice_length})
        said_all = True
        relay = _Relay(Pace(job["paused"], job["speed"]), channel)
        threading.Thread(target=relay.listen, args=(stdin,), daemon=True).start()
        carry_out(run, prepared, live=relay)
    except OdscenError as error:
        if said_all:
            channel.write(encode(Failed(str(error))).encode())
            channel.flush()
        else:
            say({"error": error_to_data(error)})
        return error.exit_code
    except KeyboardInterrupt:
        return 130
    return 0


def _without_road_users(scenario: Scenario) -> Scenario:
    """What the server has to know of it: its name, its map and its lights."""
    fields = Scenario.model_fields
    nothing = {name: fields[name].get_default(call_default_factory=True) for name in _ROAD_USERS}
    return scenario.model_copy(update=nothing)


_ROAD_USERS = ("actors", "flows", "demand")

if __name__ == "__main__":
    sys.exit(main())
