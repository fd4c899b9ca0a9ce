"""A mirrored run for a page: started in a process of its own, and followed to its end.

Also whether there is a server to mirror on, asked in a process of its own too.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple, Self

from odscen.runs.run_settings import AS_DESIGNED, RunSettings
from odscen.sumo.runner.worker_process import messages
from odscen.sumo.worker.protocol import Done, Failed, Pace

if TYPE_CHECKING:
    from odscen.carla.server.client import Address
    from odscen.sumo.runner.live_run import Live

WORKER = "odscen.carla.served.served_worker"
PROBE = "odscen.carla.server.probe"
PROBE_SECONDS = 15.0
"""Wall seconds that a probe may take: importing the client is most of it."""

ServerState = Literal["connected", "absent", "wrong_version"]


@dataclass(frozen=True, slots=True)
class ServedJob:
    """What the worker is to do.

    Attributes
    ----------
    workspace, scenario, log
        Paths; the run's folder has the name of the scenario's file.
    address
        Of the server, ``HOST:PORT``.
    step_length
        Seconds of a step, whoever has chosen it.
    origin
        What frames have subtracted, see :func:`odscen.sumo.worker.snapshots.origin`.
    settings
        How the scenario is run.
    """

    workspace: str
    scenario: str
    log: str
    address: str
    step_length: float
    origin: tuple[float, float] = (0.0, 0.0)
    settings: RunSettings = AS_DESIGNED
    paused: bool = False
    speed: float | None = None

    @property
    def pace(self) -> Pace:
        """How to start."""
        return Pace(self.paused, self.speed)

    def to_line(self) -> bytes:
        """As the first line of the worker's standard input."""
        data = asdict(self) | {"settings": self.settings.to_dict()}
        return (json.dumps(data) + "\n").encode()

    @classmethod
    def from_line(cls, line: bytes) -> Self:
        """Inverse of :meth:`to_line`."""
        data = json.loads(line)
        own = {
            "origin": tuple(data["origin"]),
            "settings": RunSettings.from_dict(data["settings"]),
        }
        return cls(**{**data, **own})


def run_served(job: ServedJob, live: Live) -> Done | Failed:
    """Run a job in its process; watchers of ``live`` see it, and can steer it."""
    with (
        Path(job.log).open("ab") as log,
        _Worker(
            [sys.executable, "-m", WORKER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=log,
            start_new_session=True,  # Ctrl-C is for the server, which then stops it
        ) as process,
    ):
        last: Done | Failed | None = None
        try:
            if process.stdin is not None:
                process.stdin.write(job.to_line())
                process.stdin.flush()
            live.attach(process)
            for message, payload in messages(process):
                live.take(message, payload)
                if isinstance(message, Done | Failed):
                    last = message
        except BaseException:
            process.kill()
            raise
        finally:
            live.detach()
    return last or Failed(_explain_crash(process.returncode))


class _Worker(subprocess.Popen[bytes]):
    """A process that is only ever asked to end: it has a server to give back."""

    def kill(self) -> None:
        """Ask it to end."""
        self.terminate()


class ServerCheck(NamedTuple):
    """What is at an address, and what to do about it, in words."""

    state: ServerState
    message: str


def probe(address: Address) -> ServerCheck:
    """See whether a CARLA server of the right release is at an address."""
    if not address.listens():
        return ServerCheck("absent", f"No CARLA server is at {address}.")
    try:
        done = subprocess.run(
            [sys.executable, "-m", PROBE, str(address)],
            capture_output=True,
            timeout=PROBE_SECONDS,
            check=False,
            start_new_session=True,
        )
        state, message = json.loads(done.stdout.splitlines()[-1])
    except (subprocess.TimeoutExpired, ValueError, IndexError):
        return ServerCheck(
            "absent", f"Something is at {address}, but it does not answer as CARLA does."
        )
    return ServerCheck(state, message)


def _explain_crash(code: int) -> str:
    if code < 0:
        name = signal.Signals(-code).name if -code in set(signal.Signals) else str(-code)
        return f"the CARLA client crashed: its process was ended by signal {name}"
    return f"the process of the mirrored run ended with exit code {code} without a result"
