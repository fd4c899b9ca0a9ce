"""The worker's ear: commands that say when the next step may be made."""

from __future__ import annotations

import os
import select
import threading
import time
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

from odscen.sumo.worker.protocol import Command, Pace, decode

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

MAX_LAG = 0.2
"""Wall seconds that a run may be behind its pace and still try to catch up."""

_BLOCK = 65536


class Steering:
    """Pause, pace and end of a run, as commanded from outside.

    Commands are read in a thread of their own, so that a step is never held up by reading. When
    the other end is closed (the program that started the run is gone) the run is to stop.

    Parameters
    ----------
    commands
        File descriptor that commands arrive on.
    pace
        How to start.
    step_length
        Simulated seconds of a step.
    heard
        What another process of the run has handed over: commands that come before all others.

    Attributes
    ----------
    stopped
        Whether the run is to end now.
    frame_wanted
        Whether a frame is awaited; its maker takes the wish back.
    """

    def __init__(
        self, commands: int, pace: Pace, *, step_length: float, heard: Sequence[Command] = ()
    ) -> None:
        self.paused = pace.paused
        self.speed = pace.speed
        self.stopped = False
        self.frame_wanted = False
        self._steps = 1 if pace.paused else 0
        self._step_length = step_length
        self._due = time.monotonic()
        self._queue: SimpleQueue[Command] = SimpleQueue()
        for command in heard:
            self._queue.put(command)
        self._enough, self._no_more = os.pipe()
        self._ear = threading.Thread(
            target=self._listen_for_commands, args=(commands,), daemon=True
        )
        self._ear.start()

    def hand_over(self) -> list[Pace | Command]:
        """Stop listening; how another process of the run is to go on, its pace first."""
        os.close(self._no_more)
        self._ear.join()
        os.close(self._enough)
        heard = [Command("frame")] * self.frame_wanted + [Command("pause")] * self.paused
        heard += [Command("step")] * self._steps
        while not self._queue.empty():
            heard.append(self._queue.get())
        return [Pace(speed=self.speed), *heard]

    @property
    def pace(self) -> Pace:
        """What is so now."""
        return Pace(self.paused, self.speed)

    def next_step(self, idle: Callable[[bool], None]) -> bool:
        """Wait until the next step may be made; false if the run is to stop instead.

        Parameters
        ----------
        idle
            Called before each wait with true, or once with false if there is no time to lose.
        """
        self._drain_queue()
        while not self.stopped:
            if self._steps:
                self._steps -= 1
                idle(False)
                return True
            pause = None if self.paused else self._seconds_of_slack()
            if pause is not None and pause <= 0:
                idle(False)
                return True
            idle(True)
            self._wait_for_commands(pause)
        return False

    def _seconds_of_slack(self) -> float:
        """Seconds until the next step is due; sets when the one after it is, once it is."""
        if self.speed is None:
            return 0.0
        now = time.monotonic()
        if self._due > now:
            return self._due - now
        self._due = max(self._due, now - MAX_LAG) + self._step_length / self.speed
        return 0.0

    def _wait_for_commands(self, seconds: float | None) -> None:
        try:
            self._obey_command(self._queue.get(timeout=seconds))
        except Empty:
            return
        self._drain_queue()

    def _drain_queue(self) -> None:
        while not self._queue.empty():
            self._obey_command(self._queue.get())

    def _obey_command(self, command: Command) -> None:
        if command.do == "frame":
            self.frame_wanted = True
        elif command.do == "stop":
            self.stopped = True
        elif command.do == "speed":
            self.speed = command.speed
            self._due = time.monotonic()
        elif command.do == "resume":
            self.paused = False
            self._due = time.monotonic()
        else:
            self.paused = True
            self._steps = self._steps + 1 if command.do == "step" else 0

    def _listen_for_commands(self, commands: int) -> None:
        # os.read and not a file object: its lock, held by a thread that waits, would end the
        # interpreter with a fatal error.
        rest = b""
        while rest or self._enough not in select.select([commands, self._enough], [], [])[0]:
            if not (block := os.read(commands, _BLOCK)):
                self._queue.put(Command("stop"))
                return
            *lines, rest = (rest + block).split(b"\n")
            for line in lines:
                command = decode(line)
                if isinstance(command, Command):
                    self._queue.put(command)
