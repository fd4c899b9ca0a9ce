"""The worker's side of a run that can be watched: steered from outside, and telling what is seen.

Frames are made only when one is awaited, and take a small share of the time while the run
is in a hurry; while it waits for its pace they cost nothing.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from odscen.records.run_events import EventKind, event_row
from odscen.sumo.worker.protocol import Detectors, FrameMessage, Incidents, Lights

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from odscen.records.run_plan import Plan
    from odscen.sumo.worker.protocol import Message
    from odscen.sumo.worker.recorder import Recorder
    from odscen.sumo.worker.simulation.session import Session
    from odscen.sumo.worker.steering import Steering

SHARE = 0.06
"""Of the time of a run in a hurry that frames may take."""
LEAST_PAUSE = 1 / 12
"""Wall seconds between two frames of a run in a hurry."""
_WINDOW = 0.5
"""Wall seconds that the real-time factor is measured over."""
_PLAIN = (EventKind.DEPARTED, EventKind.ARRIVED, EventKind.JAM_END)


class Watch:
    """What one run shows.

    Parameters
    ----------
    send
        Sends a message, and bytes after it.
    detectors
        SUMO's ids of detectors of lights that are shown.
    """

    def __init__(
        self,
        plan: Plan,
        steering: Steering,
        send: Callable[[Message, bytes], None],
        *,
        detectors: Sequence[str] = (),
    ) -> None:
        from odscen.sumo.worker.snapshots import Snapshots  # arrays, which few runs need

        self.steering = steering
        self._snapshots = Snapshots(plan)
        self._send = send
        self._pace = steering.pace
        self._step_length = plan.step_length
        self._lights: dict[str, str] = {}
        self._detectors = detectors
        self._occupied: dict[str, bool] = {}
        self._reported = 0
        self._step = self._framed = 0
        self._next_frame = 0.0
        self._mark = time.monotonic(), 0
        self._factor = 0.0

    @property
    def stopped(self) -> bool:
        """Whether a user has ended the run before its time."""
        return self.steering.stopped

    def next_step(self, session: Session, recorder: Recorder) -> bool:
        """Show what is wanted, then wait for the next step; false if the run is to stop."""

        def idle(has_time: bool) -> None:
            self._report_pace()
            if has_time or time.monotonic() >= self._next_frame:
                self.show(session, recorder)

        if not self.steering.next_step(idle):
            return False
        self._step += 1
        self._measure_pace()
        return True

    def show(self, session: Session, recorder: Recorder) -> None:
        """Send a frame if one is wanted and this step has none yet; and what has changed."""
        if self.steering.frame_wanted and self._framed != self._step:
            self._show_frame(session, recorder)

    def show_last(self, session: Session, recorder: Recorder) -> None:
        """Send the last frame, wanted or not: a user may ask for it later."""
        if self._framed != self._step:
            self._show_frame(session, recorder)

    def _show_frame(self, session: Session, recorder: Recorder) -> None:
        self.steering.frame_wanted = False
        self._framed = self._step
        start = time.monotonic()
        states = session.light_states()
        changed = {name: state for name, state in states.items() if self._lights.get(name) != state}
        if changed:
            self._lights = states
            self._send(Lights(changed), b"")
        self._report_detectors(session)
        self._report_incidents(recorder)
        frame = self._snapshots.frame(
            session,
            step=self._step,
            time=session.time - self._step_length,
            real_time_factor=self._factor,
            arrived=recorder.arrived,
        )
        self._send(FrameMessage(len(frame)), frame)
        end = time.monotonic()
        self._next_frame = end + max(LEAST_PAUSE, (end - start) * (1 / SHARE - 1))

    def _report_pace(self) -> None:
        if self.steering.pace != self._pace:
            self._pace = self.steering.pace
            self._send(self._pace, b"")

    def _report_detectors(self, session: Session) -> None:
        occupied = session.occupied(self._detectors)
        changed = {name: on for name, on in occupied.items() if self._occupied.get(name) != on}
        if changed:
            self._occupied = occupied
            self._send(Detectors(changed), b"")

    def _report_incidents(self, recorder: Recorder) -> None:
        new = recorder.since(self._reported)
        self._reported = recorder.count
        rows = [event_row(event) for event in new if event.kind not in _PLAIN]
        if rows:
            self._send(Incidents(rows), b"")

    def _measure_pace(self) -> None:
        now, (then, step) = time.monotonic(), self._mark
        if now - then >= _WINDOW:
            self._factor = (self._step - step) * self._step_length / (now - then)
            self._mark = now, self._step
