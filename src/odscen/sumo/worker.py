"""The process that runs one simulation: ``python -m odscen.sumo.worker RUN/plan.json [PACE]``.

libsumo holds one simulation per process, and a crash of SUMO takes its process with it; so every
run has a process of its own, and only the runner starts it. It reads the plan and the SUMO files
beside it, steps until nobody is left or the end is reached, writes ``events.json`` and
``actors.json``, and sends :mod:`odscen.sumo.progress` messages to its stdout. Whatever SUMO says
goes to ``sumo.log``. With a :class:`~odscen.sumo.progress.Pace` as second argument the run can be
watched and takes commands on its stdin; with a :class:`~odscen.sumo.progress.Lockstep` it makes
each step when it is told to.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.errors import OdscenError
from odscen.results.records import Plan, events_to_json
from odscen.results.summary import actor_outcomes, actors_to_json
from odscen.sumo.layout import (
    ACTORS_FILE,
    CONFIG_FILE,
    EVENTS_FILE,
    LOG_FILE,
    SUMO_FOLDER,
    TRAJECTORIES_FILE,
)
from odscen.sumo.lockstep import LockstepWatch
from odscen.sumo.progress import (
    Done,
    Failed,
    Lockstep,
    Message,
    Pace,
    Progress,
    decode,
    encode,
)
from odscen.sumo.recorder import Recorder
from odscen.sumo.session import captured_output, open_session
from odscen.sumo.steering import Steering
from odscen.sumo.watch import Watch

if TYPE_CHECKING:
    from collections.abc import Callable

MESSAGE_PAUSE = 0.25
"""Least wall seconds between two progress messages."""


def main() -> int:
    """Run the plan named on the command line; 0 when the simulation ended by itself."""
    plan_file = Path(sys.argv[1])
    folder = plan_file.parent
    with captured_output(folder / LOG_FILE) as stdout:

        def send(message: Message, payload: bytes = b"") -> None:
            stdout.buffer.write(encode(message).encode() + payload)
            stdout.buffer.flush()

        try:
            plan = Plan.from_json(plan_file.read_text(encoding="utf-8"))
            watch = _watch(plan, sys.argv[2], send) if len(sys.argv) > 2 else None
            send(simulate(plan, folder, send, watch))
        except (OdscenError, OSError) as error:
            send(Failed(str(error)))
            return 3
    return 0


def simulate(
    plan: Plan,
    folder: Path,
    send: Callable[[Message], None],
    watch: Watch | LockstepWatch | None = None,
) -> Done:
    """Run the simulation in ``folder`` and write its events and actors.

    Raises
    ------
    SimulationError
        If SUMO refuses to start or stops with an error.
    """
    start = time.perf_counter()
    recorder = Recorder(plan)
    sim_seconds, steps = _steps(plan, folder, recorder, send, watch)
    wall_seconds = time.perf_counter() - start
    events = tuple(recorder.events)
    outcomes = actor_outcomes(plan, events)
    (folder / EVENTS_FILE).write_text(events_to_json(events), encoding="utf-8")
    (folder / ACTORS_FILE).write_text(actors_to_json(outcomes), encoding="utf-8")
    stopped = watch is not None and watch.stopped
    return Done(sim_seconds, steps, wall_seconds, stopped)


def _watch(plan: Plan, how: str, send: Callable[[Message, bytes], None]) -> Watch | LockstepWatch:
    start = decode(how)
    if isinstance(start, Lockstep):
        return LockstepWatch(plan, start, sys.stdin.fileno(), send)
    steering = Steering(
        sys.stdin.fileno(),
        start if isinstance(start, Pace) else Pace(),
        step_length=plan.step_length,
    )
    return Watch(plan, steering, send)


def _steps(
    plan: Plan,
    folder: Path,
    recorder: Recorder,
    send: Callable[[Message], None],
    watch: Watch | LockstepWatch | None,
) -> tuple[float, int]:
    arguments = [
        "--configuration-file",
        str(folder / SUMO_FOLDER / CONFIG_FILE),
        "--fcd-output",
        str(folder / TRAJECTORIES_FILE),
    ]
    planned, steps, sent = len(plan.actors), 0, 0.0
    with open_session(arguments) as session:
        now = session.time
        while now < plan.until and session.expected() > 0:
            if watch is not None and not watch.next_step(session, recorder):
                break
            session.step()
            recorder.record(session, now)
            now = session.time
            steps += 1
            clock = time.monotonic()
            if clock - sent >= MESSAGE_PAUSE:
                sent = clock
                running = session.running()
                send(
                    Progress(now, plan.until, running, recorder.departed, recorder.arrived, planned)
                )
        if watch is not None:  # whoever watches sees how it ends
            watch.show(session, recorder)
            running = session.running()
            send(Progress(now, plan.until, running, recorder.departed, recorder.arrived, planned))
        return now, steps


if __name__ == "__main__":
    sys.exit(main())
