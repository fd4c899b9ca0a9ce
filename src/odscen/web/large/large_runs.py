"""Runs of large scenarios: all that the server does of a run is done in a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from odscen.base.atomic_folders import scratch_folder
from odscen.base.error_data import error_from_data
from odscen.base.errors import ToolError
from odscen.scenario.document.json_form import loads
from odscen.sumo.runner.worker_process import messages
from odscen.sumo.worker.protocol import Done, Failed

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.maps.store import Workspace
    from odscen.runs.run_settings import RunSettings
    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.runner.live_run import Live

_WORKER = "odscen.web.large.run_worker"


class LargeRun:
    """A run whose scenario has been checked, by the process that is to carry it out.

    Parameters
    ----------
    workspace
        Has the map.
    scenario
        The scenario's file.
    name
        Of the run, in messages.
    settings
        How it is run.
    live
        What it is steered and watched by.

    Raises
    ------
    ScenarioError
        With every error of the scenario.
    NotFoundError
        If the workspace does not have its map.
    """

    def __init__(
        self, workspace: Workspace, scenario: Path, *, name: str, settings: RunSettings, live: Live
    ) -> None:
        self._live = live
        self._scratch = ExitStack()
        self._folder = self._scratch.enter_context(scratch_folder())
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        self._process = _AskedToEnd(
            [sys.executable, "-m", _WORKER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            start_new_session=True,
        )
        self._send_message(
            {
                "workspace": str(workspace.root),
                "scenario": str(scenario),
                "name": name,
                "settings": settings.to_dict(),
                "introduction": str(self._introduction_file),
                "paused": live.start.paused,
                "speed": live.start.speed,
            }
        )
        self.scenario: Scenario = loads(self._read_answer()["scenario"])

    def introduction(self) -> str:
        """Text that introduces all road users to who watches the run, once it is prepared."""
        return self._introduction_file.read_text(encoding="utf-8")

    def end(self) -> None:
        """End it before it has begun."""
        self._close_process()
        self.forget()

    def forget(self) -> None:
        """Remove what introduces its road users."""
        self._scratch.close()

    def follow(
        self,
        name: str,
        *,
        preparing: Callable[[str], None],
        prepared: Callable[[float | None], None],
        ended: Callable[[], None],
    ) -> str | None:
        """Carry it out, to its end.

        Parameters
        ----------
        name
            Of the run's folder.
        preparing
            Called with words on how far routes by travel time have been found.
        prepared
            Called with the length of a slice, s, when it is prepared; ``None`` for one piece.
        ended
            Called when the simulation has ended, before the report is written.

        Returns
        -------
        Why it failed without a folder; ``None`` if it did not.
        """
        failed: str | None = None
        try:
            self._write_line(f"{name}\n".encode())
            answer = self._read_answer()
            while "preparing" in answer:
                preparing(answer["preparing"])
                answer = self._read_answer()
            prepared(answer["slice_length"])
            self._live.attach(self._process)
            for message, payload in messages(self._process):
                self._live.take(message, payload)
                if isinstance(message, Done):
                    ended()
                elif isinstance(message, Failed):
                    failed = message.reason
        finally:
            self._live.detach()
            self._close_process()
        return failed

    def _close_process(self) -> None:
        with self._process:
            self._process.kill()
        self._log.close()

    @property
    def _introduction_file(self) -> Path:
        return self._folder / "introduction.json"

    def _send_message(self, message: dict[str, Any]) -> None:
        self._write_line(json.dumps(message).encode() + b"\n")

    def _write_line(self, line: bytes) -> None:
        stdin: IO[bytes] | None = self._process.stdin
        assert stdin is not None
        try:
            stdin.write(line)
            stdin.flush()
        except BrokenPipeError:
            return  # why it has ended is asked next

    def _read_answer(self) -> dict[str, Any]:
        """The next line of the process; its error is raised here."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        answer: dict[str, Any] = json.loads(line) if line else {}
        if not answer or "error" in answer:
            words = self._read_log_end()
            self.end()
            if answer:
                raise error_from_data(answer["error"])
            raise ToolError("the process of the run has ended without a result", output=words)
        return answer

    def _read_log_end(self) -> str:
        self._log.seek(0)
        return self._log.read().decode("utf-8", "replace")[-2000:]


class _AskedToEnd(subprocess.Popen[bytes]):
    """A process that is only ever asked to end: it has a simulation to end."""

    def kill(self) -> None:
        """Ask it to end."""
        self.terminate()
