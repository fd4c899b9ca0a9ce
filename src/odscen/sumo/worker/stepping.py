"""The loop that every run goes through: step, record, report how far it is."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from odscen.sumo.worker.protocol import Progress
from odscen.sumo.worker.recorder import Recorder

if TYPE_CHECKING:
    from collections.abc import Callable

    from odscen.results.records.run_records import Plan
    from odscen.sumo.worker.lockstep import LockstepWatch
    from odscen.sumo.worker.protocol import Message
    from odscen.sumo.worker.session import Session
    from odscen.sumo.worker.story_run import StoryRun
    from odscen.sumo.worker.watch import Watch

MESSAGE_PAUSE = 0.25
"""Least wall seconds between two progress messages."""

_TOO_EARLY = 0.01
"""Share of the work before which nothing is said about the time left."""


class Stepper:
    """Steps simulations of one run, one after the other if it is in slices.

    Parameters
    ----------
    send
        Sends a message.
    watch
        Of a run that can be watched, or that goes in step with another.

    Attributes
    ----------
    recorder
        What has happened.
    steps
        Made so far.
    story
        The rules of the run, if it has any.
    """

    def __init__(
        self,
        plan: Plan,
        send: Callable[[Message], None],
        watch: Watch | LockstepWatch | None,
        story: StoryRun | None = None,
    ) -> None:
        self.story = story
        self.recorder = Recorder(plan)
        self.steps = 0
        self._plan = plan
        self._send = send
        self._watch = watch
        self._sent = 0.0
        self._start: tuple[float, int] | None = None
        self._busy = 0.0

    @property
    def stopped(self) -> bool:
        """Whether a user who watches has ended the run."""
        return self._watch is not None and self._watch.stopped

    def run(self, session: Session, until: float, *, more: bool = False) -> float:
        """Step until ``until``, or until no road user is left; simulated seconds then.

        Parameters
        ----------
        more
            Whether road users are to come that this simulation does not know of.
        """
        watch, record, clock = self._watch, self.recorder.record, time.monotonic
        story, now = self.story, session.time
        if story is not None:
            story.begin(session)
        if self._start is None:
            self._start = now, self.recorder.departed
        begin, waited = clock(), 0.0
        while now < until and (more or session.expected() > 0):
            if watch is not None:
                asked = clock()
                if not watch.next_step(session, self.recorder):
                    break
                waited += clock() - asked
            after = session.step()
            record(session, now)
            if story is not None:
                story.after_step(now, self.recorder)
            now = after
            self.steps += 1
            if clock() - self._sent >= MESSAGE_PAUSE:
                self._sent = clock()
                self._report(session, now, self._busy + self._sent - begin - waited)
        self._busy += clock() - begin - waited
        if not more and session.expected() == 0:
            self.recorder.road_is_empty(now)
        if self._watch is not None:  # a user who watches sees how it ends
            self._watch.show_last(session, self.recorder)
            self._report(session, now, self._busy)
        return now

    def _report(self, session: Session, now: float, busy: float) -> None:
        recorder, plan = self.recorder, self._plan
        self._send(
            Progress(
                now,
                plan.until,
                session.running(),
                recorder.departed,
                recorder.arrived,
                len(plan.actors),
                self._time_left(now, busy),
            )
        )

    def _time_left(self, now: float, busy: float) -> float | None:
        """Wall seconds of work left, of which ``busy`` have been done.

        Half of the work goes with time, half with departures.
        """
        if self._start is None:
            return None
        begin, departed = self._start
        seconds = max(self._plan.until - begin, 1e-9)
        actors = max(len(self._plan.actors) - departed, 1)
        share = 0.5 * (now - begin) / seconds + 0.5 * (self.recorder.departed - departed) / actors
        if share < _TOO_EARLY:
            return None
        return round(busy * (1.0 - share) / share, 1)
