"""A long run: a chain of slices, each started from the state that the one before has saved.

Going on after loading a state is not what SUMO would have done without saving: so every long run
goes through the same reloads, interrupted or not. Nor does SUMO do the same with the same state in
every process: who yields inside a junction depends on the order of addresses in memory, which a
network that was loaded before has disturbed. So each slice has a process of its own, interrupted or
not (see :mod:`odscen.sumo.worker.slice_processes`), and a run that goes on from slice ``k`` ends
with the same results as one that was never interrupted. At each boundary SUMO closes its outputs.

Another process tidies and completes the slice.
"""

from __future__ import annotations

import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.base.errors import SimulationError
from odscen.runs import layout
from odscen.runs.checkpoint import (
    STATE_FILE,
    Checkpoint,
    last_number,
    part_folder,
    read_checkpoint,
    slice_folder,
)
from odscen.runs.parts import check_room
from odscen.sumo.outputs.output_tables import outputs_to
from odscen.sumo.worker.completer import WrittenSlice
from odscen.sumo.worker.protocol import Done
from odscen.sumo.worker.route_slices import RouteSlices
from odscen.sumo.worker.simulation.session import open_session

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.records.run_plan import Plan
    from odscen.sumo.worker.completion import Completion
    from odscen.sumo.worker.simulation.session import Session
    from odscen.sumo.worker.stepping import Stepper

_SAVING = (
    "--save-state.rng", "true",
    "--save-state.transportables", "true",
    "--save-state.precision", "6",
)  # fmt: skip


def run_slice(plan: Plan, run: Path, stepper: Stepper, completion: Completion) -> Done | None:
    """Run the next slice of a long run; ``None`` if others follow, else the results are written.

    Raises
    ------
    SimulationError
        If SUMO stops with an error, or what it wrote is not whole.
    OSError
        If the disk is full, for example.
    """
    number = last_number(run)
    done = read_checkpoint(run, number) if number else None
    if done is not None:
        stepper.recorder.restore(done.recorder)
        stepper.steps = done.steps
        if stepper.story is not None:
            stepper.story.restore(done.story)
        if stepper.behaviour is not None:
            stepper.behaviour.restore(done.driven)
        if stepper.lights is not None:
            stepper.lights.restore(done.lights)
    routes = RouteSlices(run / layout.SUMO_FOLDER / layout.ROUTES_FILE)
    if done is None or not done.last:
        written = _RunningSlice(plan, run, done, routes).run(stepper)
        completion.complete(written)
        done = written.checkpoint
    if not done.last:
        return None
    completion.write_results()
    return Done(done.time, done.steps, done.wall_seconds, done.stopped)


class _RunningSlice:
    """One slice: begun from ``before``, the slice before it."""

    def __init__(
        self, plan: Plan, run: Path, before: Checkpoint | None, routes: RouteSlices
    ) -> None:
        self._plan = plan
        self._run = run
        self._before = before
        self._routes = routes
        self._number = 1 if before is None else before.number + 1
        length = plan.slice_length or plan.until
        self._end = min(self._number * length, plan.until)

    def run(self, stepper: Stepper) -> WrittenSlice:
        """Simulate it."""
        before, start = self._before, time.perf_counter()
        if before is not None:
            check_room(self._run, before.number)
        part = part_folder(self._run, self._number)
        routes = part / layout.ROUTES_FILE
        offset = self._routes.cut(before.routes if before else 0, self._end, routes)
        more = self._end < self._plan.until and self._routes.more(offset)
        with _open_slice_session(self._slice_arguments(part), self._number) as session:
            self._compare_restored(session, stepper)
            goes_on = self._end < self._plan.until
            now = stepper.run(session, self._end, more=more, saved=goes_on)
            last = self._is_last(session, stepper, now, more=more)
            present = session.present()
            running = session.running()
            lanes, lengths = session.vehicles_by_lane(), session.lanes.lengths()
            if not last:
                # SUMO puts a state where it puts outputs, relative to the folder that it is given.
                session.save(self._run / layout.SUMO_FOLDER / STATE_FILE)
                if stepper.story is not None:
                    stepper.story.mend(part / STATE_FILE)
        routes.unlink()
        events = stepper.recorder.drain()
        seconds = time.perf_counter() - start + (before.wall_seconds if before else 0.0)
        checkpoint = Checkpoint(
            number=self._number,
            time=now,
            last=last,
            stopped=stepper.stopped,
            routes=offset,
            steps=stepper.steps,
            wall_seconds=seconds,
            memory=memory_now(),
            running=running,
            present=sorted(present),
            recorder=stepper.recorder.state(),
            lanes=lanes,
            files={},
            story={} if stepper.story is None else stepper.story.state(),
            driven=[] if stepper.behaviour is None else stepper.behaviour.state(),
            lights={} if stepper.lights is None else stepper.lights.state(),
        )
        parked = frozenset(before.recorder["parked"]) if before else frozenset()
        return WrittenSlice(
            part, checkpoint, events, lengths, before.lanes if before else {}, parked
        )

    def _slice_arguments(self, part: Path) -> list[str]:
        sumo = self._run / layout.SUMO_FOLDER
        arguments = ["--configuration-file", str(sumo / layout.CONFIG_FILE)]
        arguments += ["--route-files", str(part / layout.ROUTES_FILE), *_SAVING]
        arguments += outputs_to(part, sumo)
        if self._before is not None:
            state = slice_folder(self._run, self._before.number) / STATE_FILE
            arguments += ["--load-state", str(state), "--begin", f"{self._before.time:.10g}"]
        return arguments

    def _compare_restored(self, session: Session, stepper: Stepper) -> None:
        """Say who has not come back; none has ever been seen to be lost, but we look."""
        if self._before is None:
            return
        if abs(session.time - self._before.time) > 1e-6:
            raise SimulationError(
                f"SUMO resumes at {session.time:g} s instead of {self._before.time:g} s"
            )
        missing = [name for name in self._before.present if not session.knows(name)]
        stepper.recorder.lose(session.time, missing)

    def _is_last(self, session: Session, stepper: Stepper, now: float, *, more: bool) -> bool:
        empty = not more and session.expected() == 0 and not stepper.waits
        return now >= self._plan.until or empty or stepper.stopped or stepper.over


@contextmanager
def _open_slice_session(arguments: list[str], number: int) -> Iterator[Session]:
    try:
        with open_session(arguments) as session:
            yield session
    except SimulationError as error:
        raise SimulationError(f"slice {number}: {error}") from error


def memory_now() -> int:
    """Bytes that this process holds in memory; 0 where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except (OSError, ValueError, IndexError):
        return 0
    import os

    return pages * os.sysconf("SC_PAGE_SIZE")
