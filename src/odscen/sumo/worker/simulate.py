"""One simulation in a process: ``python -m odscen.sumo.worker.simulate RUN/plan.json [PACE]``.

libsumo holds one simulation per process, and a crash of SUMO takes its process with it; so every
run has a process of its own, and only the runner starts it, or has it forked by
:mod:`odscen.sumo.worker.fork_server`. It reads the plan and the SUMO files
beside it, steps until no road user is left or the end is reached, writes ``events.json`` and
``actors.json``, and sends :mod:`odscen.sumo.worker.protocol` messages to its stdout. Whatever SUMO
says goes to ``sumo.log``. With a :class:`~odscen.sumo.worker.protocol.Pace` as second argument the
run can be watched and takes commands on its stdin; with a
:class:`~odscen.sumo.worker.protocol.Lockstep` it makes each step when it is asked to.

If the plan says so, it makes one slice of the run (see :mod:`odscen.sumo.worker.slices`) and then
begins anew for the next one: ``exec`` gives it a fresh memory under the same number, with the same
files open. Commands that it has heard and not obeyed follow the pace as arguments.
"""

from __future__ import annotations

import gc
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from odscen.base.atomic_folders import in_use
from odscen.base.errors import OdscenError
from odscen.base.system_errors import NO_MEMORY, system_words
from odscen.results.records.light_programs import programs_from_json
from odscen.results.records.run_plan import Plan
from odscen.sumo.folder.layout import (
    BEHAVIOUR_FILE,
    CONFIG_FILE,
    LIGHTS_FILE,
    LOG_FILE,
    STORY_FILE,
    SUMO_FOLDER,
)
from odscen.sumo.outputs.output_tables import (
    are_small,
    make_results,
    outputs_to,
)
from odscen.sumo.worker.lockstep import LockstepWatch
from odscen.sumo.worker.output_capture import captured_output
from odscen.sumo.worker.protocol import (
    Command,
    Done,
    Failed,
    Left,
    Lockstep,
    Message,
    Pace,
    decode,
    encode,
)
from odscen.sumo.worker.simulation.session import open_session
from odscen.sumo.worker.slices import run_slice
from odscen.sumo.worker.steering import Steering
from odscen.sumo.worker.stepping import Stepper
from odscen.sumo.worker.watch import Watch

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from odscen.sumo.worker.behaviour.behaviour_run import BehaviourRun
    from odscen.sumo.worker.story.story_run import StoryRun


def main() -> int:
    """Run the plan named on the command line; 0 when the simulation ended by itself."""
    return run_plan(Path(sys.argv[1]), sys.argv[2:])


def run_plan(plan_file: Path, how: Sequence[str] = (), *, raw: bool = False) -> int:
    """Run a plan, with the pace and the commands of ``how``; the exit code of the process.

    With ``raw`` it may leave what SUMO has written to its reader, see :class:`Done`.
    """
    folder = plan_file.parent
    with in_use(folder), captured_output(folder / LOG_FILE) as stdout:

        def send(message: Message, payload: bytes = b"") -> None:
            stdout.buffer.write(encode(message).encode() + payload)
            stdout.buffer.flush()

        try:
            gc.disable()  # takes as long as the reading itself
            plan = Plan.from_json(plan_file.read_text(encoding="utf-8"))
            gc.freeze()  # the plan stays, and need not be gone through again and again
            gc.enable()
            watch = _watch(plan, folder, how, send) if how else None
            done = simulate(plan, folder, send, watch, raw=raw)
            if done is not None:
                send(done)
        except OdscenError as error:
            send(Failed(str(error)))
            return 3
        except OSError as error:
            send(Failed(system_words(error)))
            return 3
        except MemoryError:
            send(Failed(NO_MEMORY))
            return 3
    if done is None:
        _begin_anew(watch)
    return 0


def simulate(
    plan: Plan,
    folder: Path,
    send: Callable[[Message], None],
    watch: Watch | LockstepWatch | None = None,
    *,
    raw: bool = False,
) -> Done | None:
    """Run the simulation in ``folder`` and write its results.

    Parameters
    ----------
    raw
        Whether the results of a small run may be left to be made from what it returns.

    Returns
    -------
    ``None`` if that was a slice, and others follow.

    Raises
    ------
    SimulationError
        If SUMO refuses to start or stops with an error.
    """
    stepper = Stepper(plan, send, watch, _story(plan, folder), _behaviour(plan, folder))
    try:
        if plan.slice_length is not None:
            return run_slice(plan, folder, stepper)
        done = _in_one_piece(plan, folder, stepper, raw=raw)
    finally:
        if stepper.behaviour is not None:
            stepper.behaviour.close()
    return done


def _story(plan: Plan, folder: Path) -> StoryRun | None:
    """Rules of the run; without any, nothing of theirs is imported."""
    if not (folder / SUMO_FOLDER / STORY_FILE).is_file():
        return None
    from odscen.sumo.worker.story.story_run import StoryRun

    return StoryRun.in_folder(folder, plan)


def _behaviour(plan: Plan, folder: Path) -> BehaviourRun | None:
    """What drives instead of SUMO; without it, nothing of it is imported."""
    if not (folder / SUMO_FOLDER / BEHAVIOUR_FILE).is_file():
        return None
    from odscen.sumo.worker.behaviour.behaviour_run import BehaviourRun

    return BehaviourRun.in_folder(folder, plan)


def _begin_anew(watch: Watch | LockstepWatch | None) -> None:
    """Become a fresh process that runs the next slice."""
    own = len(sys.orig_argv) - len(sys.argv) + 2  # as it was started, up to the plan
    how = watch.steering.hand_over() if isinstance(watch, Watch) else []
    arguments = [sys.executable, *sys.orig_argv[1:own], *map(encode, how)]
    os.execv(sys.executable, arguments)  # noqa: S606 - no shell is wanted


def _in_one_piece(plan: Plan, folder: Path, stepper: Stepper, *, raw: bool) -> Done:
    start = time.perf_counter()
    sumo = folder / SUMO_FOLDER
    arguments = ["--configuration-file", str(sumo / CONFIG_FILE), *outputs_to(folder, sumo)]
    with open_session(arguments) as session:
        now = stepper.run(session, plan.until)
        lengths = session.lanes.lengths()
    left = None
    if raw and are_small(folder):
        left = Left(lengths, stepper.recorder.hand_over())
    else:
        make_results(folder, plan, stepper.recorder.events, lengths)
    return Done(now, stepper.steps, time.perf_counter() - start, stepper.stopped, left)


def _watch(
    plan: Plan, folder: Path, how: Sequence[str], send: Callable[[Message, bytes], None]
) -> Watch | LockstepWatch:
    start, *heard = map(decode, how)
    if isinstance(start, Lockstep):
        return LockstepWatch(plan, start, sys.stdin.fileno(), send)
    steering = Steering(
        sys.stdin.fileno(),
        start if isinstance(start, Pace) else Pace(),
        step_length=plan.step_length,
        heard=[command for command in heard if isinstance(command, Command)],
    )
    return Watch(plan, steering, send, detectors=_detectors(folder))


def _detectors(folder: Path) -> list[str]:
    """SUMO's ids of the detectors that lights are shown with."""
    file = folder / LIGHTS_FILE
    lights = programs_from_json(file.read_text(encoding="utf-8")) if file.is_file() else ()
    return [one.id for light in lights for one in light.detectors]


if __name__ == "__main__":
    sys.exit(main())
