"""The loop that every run goes through: step, record, report how far it is."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from odscen.runs.reporter import Progress
from odscen.sumo.worker.detours import Detours
from odscen.sumo.worker.diversions import Diversions
from odscen.sumo.worker.lockstep import LockstepWatch
from odscen.sumo.worker.missed_lanes import PATIENCE, MissedLanes
from odscen.sumo.worker.recorder import Recorder

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from odscen.records.run_plan import Plan
    from odscen.sumo.worker.behaviour.behaviour_run import BehaviourRun
    from odscen.sumo.worker.behaviour.light_run import LightRun
    from odscen.sumo.worker.protocol import Message
    from odscen.sumo.worker.simulation.session import Session
    from odscen.sumo.worker.story.story_run import StoryRun
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
    behaviour
        What drives vehicles instead of SUMO, if anything does.
    lights
        What switches lights instead of their programs, if anything does.
    """

    def __init__(
        self,
        plan: Plan,
        send: Callable[[Message], None],
        watch: Watch | LockstepWatch | None,
        story: StoryRun | None = None,
        behaviour: BehaviourRun | None = None,
        lights: LightRun | None = None,
    ) -> None:
        self.story = story
        self.behaviour = behaviour
        self.lights = lights
        self.recorder = Recorder(plan)
        self.steps = 0
        self._plan = plan
        self._diversions = Diversions(plan) if plan.measures else None
        # Vehicles of a SUMO project do as they do in SUMO, until something is closed to them.
        own = frozenset(a.id for a in plan.actors if not a.from_file)
        self._missed_lanes = MissedLanes(plan.net_offset, None if plan.closed else own)
        self._take_gaps = None if len(own) == len(plan.actors) else own
        self._detours: Detours | None = None
        self._send = send
        self._watch = watch
        self._led = watch if isinstance(watch, LockstepWatch) and watch.rules else None
        if story is not None and (behaviour is not None or isinstance(watch, LockstepWatch)):
            story.look_always()
        if story is not None and isinstance(watch, LockstepWatch) and watch.drives:
            story.leave_end_open()
        self._due: float | None = None
        self._sent = 0.0
        self._start: tuple[float, int] | None = None
        self._busy = 0.0

    @property
    def stopped(self) -> bool:
        """Whether a user who watches has ended the run."""
        return self._watch is not None and self._watch.stopped

    @property
    def over(self) -> bool:
        """Whether a rule has ended the run."""
        return self.story is not None and self.story.over

    @property
    def waits(self) -> bool:
        """Whether a rule may let an actor appear that is not there yet."""
        return self.story is not None and self.story.waits

    def run(
        self, session: Session, until: float, *, more: bool = False, saved: bool = False
    ) -> float:
        """Step until ``until``, or until no road user is left; simulated seconds then.

        Parameters
        ----------
        more
            Whether road users are to come that this simulation does not know of.
        saved
            Whether the state then is saved: no change of lanes begins that would not be over.
        """
        watch, clock, now = self._watch, time.monotonic, session.time
        if self.story is not None:
            self.story.begin(session)
        if self._start is None:
            self._start = now, self.recorder.departed
        held = self._begin_of_hold(session, now, until) if saved else math.inf
        begin, waited = clock(), 0.0
        while now < until and not self.over and (more or session.expected() > 0 or self.waits):
            if watch is not None:
                asked = clock()
                if not watch.next_step(session, self.recorder):
                    break
                waited += clock() - asked
            self._take_rules(session)
            if self.over:
                break
            if now >= held:
                session.hold_lanes(but=self._list_moved_by_others())
            now = self._make_step(session, now)
            if clock() - self._sent >= MESSAGE_PAUSE:
                self._sent = clock()
                self._report_progress(session, now, self._busy + self._sent - begin - waited)
        self._take_rules(session)
        if saved:
            session.turning_gaps.forget()
            session.lateral_places.forget()
            session.curve_speeds.forget()
            session.turn_exits.forget()
        self._busy += clock() - begin - waited
        self._finish_run(session, now, more=more)
        return now

    def _begin_of_hold(self, session: Session, begin: float, until: float) -> float:
        """From when on no vehicle begins to change lanes: half of the time is free at least."""
        takes = session.lane_change_duration
        if takes <= 0.0 or self.behaviour is not None:
            return math.inf
        return max(until - takes - 0.5 * self._plan.step_length, 0.5 * (begin + until))

    def _make_step(self, session: Session, now: float) -> float:
        """Make a step, with what measures and rules do before and after it; seconds then."""
        recorder = self.recorder
        if self._diversions is not None:
            recorder.add(self._diversions.before_step(session, now, self._plan.step_length))
        if self._missed_lanes.due(now, self._plan.step_length):
            self._change_routes(session, now)
        if self.lights is not None:
            self.lights.before_step(session)
        if self.behaviour is not None:
            self.behaviour.before_step(session, self._list_moved_by_others())
        else:
            moved = self._list_moved_by_others()
            session.turning_gaps.before_step(only=self._take_gaps, moved=moved)
            session.curve_speeds.before_step(only=self._take_gaps, moved=moved)
            session.turn_exits.before_step(only=self._take_gaps, moved=moved)
            session.lateral_places.before_step(
                only=self._take_gaps, moved=moved, placed=self._list_placed_by_others()
            )
        after = session.step()
        if self.story is not None:
            self.story.say_speeds()
        if self.behaviour is None:
            session.turning_gaps.after_step()
        recorder.record(session, now)
        if self.story is not None or self._led is not None:
            self._due = now
        if self._led is None:
            if self.story is not None and isinstance(self._watch, LockstepWatch):
                self._watch.look(session)
            self._take_rules(session)
        self.steps += 1
        return after

    def _change_routes(self, session: Session, now: float) -> None:
        """Let those who did not get to the lane of their route take another one."""
        if not session.stopped.longer_than(PATIENCE):
            return
        diversions = self._diversions
        if diversions is not None and diversions.detours is not None:
            detours, closed = diversions.detours, diversions.closed_pairs
        else:
            self._detours = self._detours or Detours(session.lanes.links())
            detours, closed = self._detours, {}
        moved = self._list_moved_by_others()
        self.recorder.add(self._missed_lanes.before_step(session, now, detours, closed, moved))

    def _list_moved_by_others(self) -> Collection[str]:
        """Who is moved by rules or by another program."""
        moved = frozenset() if self.story is None else self.story.moved
        placed = self._watch.placed if isinstance(self._watch, LockstepWatch) else None
        return moved if placed is None else moved | {placed}

    def _list_placed_by_others(self) -> Collection[str]:
        """Who is put somewhere by rules or by another program."""
        placed = frozenset() if self.story is None else self.story.placed
        other = self._watch.placed if isinstance(self._watch, LockstepWatch) else None
        return placed if other is None else placed | {other}

    def _take_rules(self, session: Session) -> None:
        """Let rules act on the last step: at once, or when a program has given others."""
        heard = [] if self._led is None else self._led.heard
        if heard and self.story is None:
            from odscen.sumo.worker.story.story_run import StoryRun

            self.story = StoryRun.without_rules(self._plan)
            self.story.look_always()
            self.story.leave_end_open()
            self.story.begin(session)
        while heard and self.story is not None:
            self.story.add(heard.pop(0))
        if self._due is not None and self.story is not None:
            self.story.after_step(self._due, self.recorder)
        self._due = None

    def _finish_run(self, session: Session, now: float, *, more: bool) -> None:
        """Say how it ends, if it does, and show it to who watches."""
        empty = not more and session.expected() == 0 and not self.waits
        if empty:
            self.recorder.road_is_empty(now)
        if self._diversions is not None and (empty or self.over or now >= self._plan.until):
            self.recorder.add(self._diversions.last_events(now))
        if self._watch is not None:
            self._watch.show_last(session, self.recorder)
            self._report_progress(session, now, self._busy)

    def _report_progress(self, session: Session, now: float, busy: float) -> None:
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
