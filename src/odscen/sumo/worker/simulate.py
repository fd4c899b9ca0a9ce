"""One simulation in a process: ``python -m odscen.sumo.worker.simulate RUN/plan.json [PACE]``.

libsumo holds one simulation per process, and a crash of SUMO takes its process with it; so every
run has a process of its own, and only the runner starts it, or has it forked by
:mod:`odscen.sumo.worker.fork_server`. It reads the plan and the SUMO files
beside it, steps until no road user is left or the end is reached, writes ``events.json`` and
``actors.json``, and sends :mod:`odscen.sumo.worker.protocol` messages to its stdout. Whatever SUMO
says goes to ``sumo.log``. With a :class:`~odscen.sumo.worker.protocol.Pace` as second argument the
run can be watched and takes commands on its stdin; with a
:class:`~odscen.sumo.worker.protocol.Lockstep` it makes each step when it is asked to.

If the plan says so, the run is made in slices (see :mod:`odscen.sumo.worker.slices`), each in a
process with a fresh memory: forked by this one (see :mod:`odscen.sumo.worker.slice_processes`) or,
where that is not possible, by ``exec``, under the same number and with the same files open.
Commands that one has heard and not obeyed follow the pace as arguments of the next.
"""

from __future__ import annotations

import gc
import os
import sys
import time
from contextlib import ExitStack, chdir, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from odscen.base.atomic_folders import in_use
from odscen.base.errors import OdscenError
from odscen.base.system_errors import NO_MEMORY, system_words
from odscen.records.light_programs import programs_from_json
from odscen.records.run_plan import Plan
from odscen.runs.layout import (
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
from odscen.sumo.worker import slice_processes
from odscen.sumo.worker.completion import CompleterGoneError, Completion
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
from odscen.sumo.worker.slice_processes import End
from odscen.sumo.worker.slices import run_slice
from odscen.sumo.worker.steering import Steering
from odscen.sumo.worker.stepping import Stepper
from odscen.sumo.worker.warm_imports import import_all, import_for
from odscen.sumo.worker.watch import Watch

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from odscen.sumo.worker.behaviour.behaviour_run import BehaviourRun
    from odscen.sumo.worker.behaviour.light_run import LightRun
    from odscen.sumo.worker.story.story_run import StoryRun

FAILED = 3
COMPLETER_GONE = 4
"""Exit codes."""
_FAILURES = (OdscenError, OSError, MemoryError)


class Send(Protocol):
    """Sends a message, and bytes after it."""

    def __call__(self, message: Message, payload: bytes = b"") -> None:
        """Send it."""


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
            plan = _read_plan(plan_file)
            if plan.slice_length is None:
                watch = _open_watch(plan, folder, how, send) if how else None
                send(simulate(plan, folder, send, watch, raw=raw))
                return 0
            end = _run_slices(plan, folder, send, how)
        except _FAILURES as error:
            send(Failed(_describe_error(error)))
            return FAILED
    if end.following is not None:
        _begin_anew(end.following)
    return end.code


def _read_plan(plan_file: Path) -> Plan:
    gc.disable()  # takes as long as the reading itself
    plan = Plan.from_json(plan_file.read_text(encoding="utf-8"))
    gc.freeze()  # the plan stays, and need not be gone through again and again
    gc.enable()
    return plan


def _run_slices(plan: Plan, folder: Path, send: Send, how: Sequence[str]) -> End:
    """Run all slices that are left, or the next one where processes cannot be forked."""
    with Completion(folder) as completion:

        def run(how: Sequence[str]) -> End:
            return _run_slice(plan, folder, send, completion, how)

        if slice_processes.POSSIBLE:
            import_all()
            import_for(folder, watched=bool(how))
            end = slice_processes.in_processes(how, run)
        else:
            end = run(how)
        if end.code == COMPLETER_GONE:
            raise completion.gone()
        return end


def _run_slice(
    plan: Plan, folder: Path, send: Send, completion: Completion, how: Sequence[str]
) -> End:
    try:
        watch = _open_watch(plan, folder, how, send) if how else None
        with _open_stepper(plan, folder, send, watch) as stepper:
            done = run_slice(plan, folder, stepper, completion)
    except CompleterGoneError:
        return End(COMPLETER_GONE)
    except _FAILURES as error:
        send(Failed(_describe_error(error)))
        return End(FAILED)
    if done is not None:
        send(done)
        return End(0)
    following = watch.steering.hand_over() if isinstance(watch, Watch) else []
    return End(0, [encode(command) for command in following])


def _describe_error(error: Exception) -> str:
    if isinstance(error, MemoryError):
        return NO_MEMORY
    return system_words(error) if isinstance(error, OSError) else str(error)


def simulate(
    plan: Plan,
    folder: Path,
    send: Send,
    watch: Watch | LockstepWatch | None = None,
    *,
    raw: bool = False,
) -> Done:
    """Run the simulation in ``folder`` in one piece and write its results.

    Parameters
    ----------
    raw
        Whether the results of a small run may be left to be made from what it returns.

    Raises
    ------
    SimulationError
        If SUMO refuses to start or stops with an error.
    """
    start = time.perf_counter()
    sumo = folder / SUMO_FOLDER
    configuration = str((sumo / CONFIG_FILE).absolute())
    arguments = ["--configuration-file", configuration, *outputs_to(folder, sumo)]
    with _open_stepper(plan, folder, send, watch) as stepper:
        with ExitStack() as open_things:
            with chdir(sumo):  # outputs of calibrators are named from where SUMO starts
                session = open_things.enter_context(open_session(arguments))
            now = stepper.run(session, plan.until)
            lengths = session.lanes.lengths()
        left = None
        if raw and are_small(folder):
            left = Left(lengths, stepper.recorder.hand_over())
        else:
            make_results(folder, plan, stepper.recorder.events, lengths)
        return Done(now, stepper.steps, time.perf_counter() - start, stepper.stopped, left)


@contextmanager
def _open_stepper(
    plan: Plan, folder: Path, send: Send, watch: Watch | LockstepWatch | None
) -> Iterator[Stepper]:
    behaviour, lights = _open_behaviour(plan, folder)
    stepper = Stepper(plan, send, watch, _open_story(plan, folder), behaviour, lights)
    try:
        yield stepper
    finally:
        opened = behaviour or lights  # one model, which is told once
        if opened is not None:
            opened.close()


def _open_story(plan: Plan, folder: Path) -> StoryRun | None:
    """Rules of the run; without any, nothing of theirs is imported."""
    if not (folder / SUMO_FOLDER / STORY_FILE).is_file():
        return None
    from odscen.sumo.worker.story.story_run import StoryRun

    return StoryRun.in_folder(folder, plan)


def _open_behaviour(plan: Plan, folder: Path) -> tuple[BehaviourRun | None, LightRun | None]:
    """What drives, and what switches lights; without any, nothing of it is imported."""
    if not (folder / SUMO_FOLDER / BEHAVIOUR_FILE).is_file():
        return None, None
    from odscen.sumo.worker.behaviour.opened_model import open_model

    return open_model(folder, plan)


def _begin_anew(following: Sequence[str]) -> None:
    """Become a fresh process that runs the next slice."""
    own = len(sys.orig_argv) - len(sys.argv) + 2  # as it was started, up to the plan
    arguments = [sys.executable, *sys.orig_argv[1:own], *following]
    os.execv(sys.executable, arguments)  # noqa: S606 - no shell is wanted


def _open_watch(plan: Plan, folder: Path, how: Sequence[str], send: Send) -> Watch | LockstepWatch:
    start, *heard = map(decode, how)
    if isinstance(start, Lockstep):
        return LockstepWatch(plan, start, sys.stdin.fileno(), send)
    steering = Steering(
        sys.stdin.fileno(),
        start if isinstance(start, Pace) else Pace(),
        step_length=plan.step_length,
        heard=[command for command in heard if isinstance(command, Command)],
    )
    return Watch(plan, steering, send, detectors=_read_detectors(folder))


def _read_detectors(folder: Path) -> list[str]:
    """SUMO's ids of the detectors that lights are shown with."""
    file = folder / LIGHTS_FILE
    lights = programs_from_json(file.read_text(encoding="utf-8")) if file.is_file() else ()
    return [detector.id for light in lights for detector in light.detectors]


if __name__ == "__main__":
    sys.exit(main())
