"""The runner's side of a run that can be watched: commands to it, and the newest of what it shows.

The thread that follows the worker puts in what arrives; any number of watchers take it out. A
frame replaces the one before it, and the worker makes one only when a watcher has asked, so that a
slow watcher costs neither memory nor simulation time.
"""

from __future__ import annotations

import threading
from contextlib import suppress
from dataclasses import dataclass, field
from typing import IO, TYPE_CHECKING, Any

from odscen.runs.reporter import Progress
from odscen.sumo.worker.protocol import (
    Command,
    Detectors,
    FrameMessage,
    Incidents,
    Lights,
    Pace,
    ShotMessage,
    encode,
)

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Callable

    from odscen.sumo.worker.protocol import Message


@dataclass(frozen=True, slots=True)
class LivePicture:
    """The newest frame; ``number`` counts frames from 1, 0 is none yet."""

    number: int = 0
    frame: bytes = b""


@dataclass(slots=True)
class _LatestSeen:
    picture: LivePicture = field(default_factory=LivePicture)
    shot: LivePicture = field(default_factory=LivePicture)
    lights: dict[str, str] = field(default_factory=dict)
    detectors: dict[str, bool] = field(default_factory=dict)
    incidents: list[dict[str, Any]] = field(default_factory=list)
    progress: Progress | None = None


class Live:
    """A run that can be watched and steered while it goes.

    Parameters
    ----------
    pace
        How it starts.
    """

    def __init__(self, pace: Pace | None = None) -> None:
        self.start = self.pace = pace or Pace()
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._ended = False
        self._asked = False
        self._seen = _LatestSeen()
        self._watchers: list[Callable[[], None]] = []
        self._early: list[Command] = []

    @property
    def failure(self) -> None:
        """Watching never makes a run fail."""

    @property
    def picture(self) -> LivePicture:
        """The newest frame."""
        return self._seen.picture

    @property
    def shot(self) -> LivePicture:
        """The newest picture of a camera, as JPEG; only mirrored runs have any."""
        return self._seen.shot

    @property
    def lights(self) -> dict[str, str]:
        """State of all traffic lights at the newest frame, by SUMO id; not to be changed."""
        return self._seen.lights

    @property
    def detectors(self) -> dict[str, bool]:
        """Whether detectors were occupied at the newest frame, by SUMO id; not to be changed."""
        return self._seen.detectors

    @property
    def incidents(self) -> list[dict[str, Any]]:
        """All incidents so far; only ever appended to."""
        return self._seen.incidents

    @property
    def progress(self) -> Progress | None:
        """The newest progress message."""
        return self._seen.progress

    @property
    def ended(self) -> bool:
        """Whether the worker has ended."""
        return self._ended

    @property
    def stop_wanted(self) -> bool:
        """Whether it was to stop before it had a worker."""
        with self._lock:
            return any(command.do == "stop" for command in self._early)

    # For watchers

    def add_watcher(self, wake: Callable[[], None]) -> None:
        """Call ``wake``, from another thread, whenever there is something new."""
        with self._lock:
            self._watchers.append(wake)

    def remove_watcher(self, wake: Callable[[], None]) -> None:
        """End it."""
        with self._lock:
            self._watchers.remove(wake)

    def ask_frame(self) -> None:
        """Ask for a frame newer than :attr:`picture`; asking again before it is there is free."""
        with self._lock:
            if self._asked:
                return
            self._asked = True
        self.command(Command("frame"))

    def command(self, command: Command) -> None:
        """Send a command; one that comes before the worker is there waits for it."""
        with self._lock:
            if self._process is None:
                if not self._ended:
                    self._early.append(command)
                return
            _write_command(self._process.stdin, command)

    def kill(self) -> None:
        """End the worker at once."""
        with self._lock:
            if self._process is not None:
                self._process.kill()

    # For the thread that follows the worker

    def attach(self, process: subprocess.Popen[bytes]) -> None:
        """Connect with a worker that has just been started with a pipe as its stdin."""
        with self._lock:
            self._process = process
            for command in self._early:
                _write_command(process.stdin, command)
            self._early.clear()

    def take(self, message: Message, payload: bytes) -> None:
        """Put in what the worker says."""
        with self._lock:
            seen = self._seen
            if isinstance(message, FrameMessage):
                seen.picture = LivePicture(seen.picture.number + 1, payload)
                self._asked = False
            elif isinstance(message, ShotMessage):
                seen.shot = LivePicture(seen.shot.number + 1, payload)
            elif isinstance(message, Lights):
                seen.lights = {**seen.lights, **message.states}
            elif isinstance(message, Detectors):
                seen.detectors = {**seen.detectors, **message.occupied}
            elif isinstance(message, Incidents):
                seen.incidents.extend(message.events)
            elif isinstance(message, Pace):
                self.pace = message
            elif isinstance(message, Progress):
                seen.progress = message
        self.wake()

    def detach(self) -> None:
        """Say that the worker has ended, however it did."""
        with self._lock:
            self._ended = True
            if self._process is not None and self._process.stdin is not None:
                with suppress(OSError):
                    self._process.stdin.close()
            self._process = None
        self.wake()

    def wake(self) -> None:
        """Wake all watchers."""
        with self._lock:
            watchers = tuple(self._watchers)
        for wake in watchers:
            wake()


def _write_command(stdin: IO[bytes] | None, command: Command) -> None:
    if stdin is None:
        return
    with suppress(OSError, ValueError):  # the worker has just ended
        stdin.write(encode(command).encode())
        stdin.flush()
