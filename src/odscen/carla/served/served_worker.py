"""The process of a mirrored run for a page: ``python -m odscen.carla.served.served_worker``.

The client may end its process, and holds Python's lock while it waits; a web server has neither to
spare. The job is the first line of standard input, commands are the lines after it, and what is to
be seen goes to standard output, all as in :mod:`odscen.sumo.worker.protocol`.
"""

from __future__ import annotations

import sys
import threading
import time
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.base.errors import OdscenError
from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.served.served_run import ServedJob
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.reporter import Reporter
from odscen.sumo.worker.output_capture import captured_output
from odscen.sumo.worker.protocol import (
    Done,
    Failed,
    FrameMessage,
    Incidents,
    Lights,
    ShotMessage,
    encode,
)
from odscen.sumo.worker.snapshots import frame_bytes, frame_rows
from odscen.sumo.worker.steering import Steering

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.runs.reporter import Progress
    from odscen.sumo.runner.in_step import Step
    from odscen.sumo.worker.protocol import Message

_WINDOW = 0.5
"""Wall seconds that the real-time factor is measured over."""


def main() -> int:
    """Run the job; 0 when it has ended by itself or was stopped."""
    # Unbuffered: what comes after the line is read by the steering.
    with FileIO(sys.stdin.fileno(), closefd=False) as stdin:
        job = ServedJob.from_line(stdin.readline())
    with captured_output(Path(job.log)) as stdout:
        sending = threading.Lock()  # pictures come in a thread of their own

        def send(message: Message, payload: bytes) -> None:
            with sending:
                stdout.buffer.write(encode(message).encode() + payload)
                stdout.buffer.flush()

        try:
            send(run(job, send), b"")
        except OdscenError as error:
            send(Failed(str(error)), b"")
            return 3
    return 0


def run(job: ServedJob, send: Callable[[Message, bytes], None]) -> Done | Failed:
    """Run a job to its end."""
    steering = Steering(sys.stdin.fileno(), job.pace, step_length=job.step_length)
    page = _PageFollower(job, steering, send)
    start = time.perf_counter()
    result, report = cosim(
        Workspace.open(Path(job.workspace)),
        Path(job.scenario),
        CosimOptions(
            address=Address.parse(job.address),
            on_step=page.on_step,
            on_picture=lambda jpeg: send(ShotMessage(len(jpeg)), jpeg),
        ),
        settings=job.settings,
        reporter=_ProgressSender(send),
    )
    troubles = dict.fromkeys((report.error, *report.left_behind, result.summary["error"]))
    if any(troubles):
        return Failed(" ".join(str(words) for words in troubles if words))
    summary = result.summary
    return Done(
        float(summary["sim_seconds"]),
        int(summary["steps"]),
        time.perf_counter() - start,
        stopped=steering.stopped,
    )


class _ProgressSender(Reporter):
    """Sends how far the run is."""

    def __init__(self, send: Callable[[Message, bytes], None]) -> None:
        self._send = send

    def advanced(self, progress: Progress) -> None:
        self._send(progress, b"")


class _PageFollower:
    """Shows steps to a user who watches, and waits for its pace."""

    def __init__(
        self, job: ServedJob, steering: Steering, send: Callable[[Message, bytes], None]
    ) -> None:
        self._job = job
        self._steering = steering
        self._send = send
        self._pace = steering.pace
        self._lights: dict[str, str] = {}
        self._count = self._framed = 0
        self._mark = time.monotonic(), 0
        self._factor = 0.0

    def on_step(self, step: Step) -> bool:
        """Show a step, then wait until the next may be made; false if the run is to stop."""
        self._count += 1
        self._measure_pace()
        changed = {n: state for n, state in step.lights.items() if self._lights.get(n) != state}
        if changed:
            self._lights |= changed
            self._send(Lights(changed), b"")
        if step.incidents:
            self._send(Incidents([dict(event) for event in step.incidents]), b"")

        def idle(_has_time: bool) -> None:
            self._send_frame(step)

        return self._steering.next_step(idle)

    def _send_frame(self, step: Step) -> None:
        """Send a frame if one is wanted, and the pace if it has changed."""
        if self._steering.pace != self._pace:
            self._pace = self._steering.pace
            self._send(self._pace, b"")
        if not self._steering.frame_wanted or self._framed == self._count:
            return
        self._steering.frame_wanted = False
        self._framed = self._count
        rows = frame_rows(
            step.index, step.x, step.y, step.hdg, step.speed, step.signals, origin=self._job.origin
        )
        frame = frame_bytes(
            rows,
            step=self._count,
            time=step.time,
            real_time_factor=self._factor,
            arrived=step.arrived,
        )
        self._send(FrameMessage(len(frame)), frame)

    def _measure_pace(self) -> None:
        now, (then, count) = time.monotonic(), self._mark
        if now - then >= _WINDOW:
            self._factor = (self._count - count) * self._job.step_length / (now - then)
            self._mark = now, self._count


if __name__ == "__main__":
    sys.exit(main())
