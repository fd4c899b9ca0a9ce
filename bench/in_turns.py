"""Runs stepped once more side by side: processes that take turns of a twentieth of a second.

So that all meet the same machine. ``python -m bench.in_turns RUN HOW`` makes the steps of a run
that has ended and prints processor seconds, those of programs that it starts included, and how many
of them its rules took between steps; starting is not in them. ``HOW`` is ``run`` (as the run was),
``sumo`` (SUMO's steps and its outputs alone), or what drives, as JSON.
"""

from __future__ import annotations

import itertools
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import typing
from pathlib import Path
from time import process_time as clock
from typing import TYPE_CHECKING

from odscen.records.run_plan import Plan
from odscen.runs.layout import CONFIG_FILE
from odscen.sumo.outputs.output_tables import outputs_to
from odscen.sumo.worker.behaviour.behaviour_run import BehaviourRun
from odscen.sumo.worker.simulation.session import open_session
from odscen.sumo.worker.stepping import Stepper
from odscen.sumo.worker.story.story_run import StoryRun

if TYPE_CHECKING:
    from collections.abc import Sequence

    from odscen.sumo.worker.recorder import Recorder

TURN = 0.05
"""Seconds."""


def seconds_of(runs: Sequence[tuple[Path, str]]) -> list[float]:
    """Processor seconds of the steps of each run, all made once more, in turns."""
    return [all_of_it for all_of_it, _ in shares_of(runs)]


def shares_of(runs: Sequence[tuple[Path, str]]) -> list[tuple[float, float]]:
    """As :func:`seconds_of`, and the seconds of its rules, which are in them."""
    started = [
        subprocess.Popen(
            [sys.executable, "-m", "bench.in_turns", str(run), how],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )
        for run, how in runs
    ]  # fmt: skip
    outs = [typing.cast("typing.TextIO", one.stdout) for one in started]
    for one, out in zip(started, outs, strict=True):
        out.readline()
        one.send_signal(signal.SIGSTOP)
        typing.cast("typing.TextIO", one.stdin).close()
    for one in itertools.cycle(started):
        one.send_signal(signal.SIGCONT)
        time.sleep(TURN)
        if one.poll() is None:
            one.send_signal(signal.SIGSTOP)
        elif all(other.poll() is not None for other in started):
            break
    found = [out.read().split()[-2:] for out in outs]
    return [(float(whole), float(rules)) for whole, rules in found]


class _Timed:
    """Rules of a run, and the processor seconds that they take between steps."""

    def __init__(self, story: StoryRun) -> None:
        self.seconds = 0.0
        self._after_step = story.after_step
        story.after_step = self.after_step  # type: ignore[method-assign]

    def after_step(self, time: float, recorder: Recorder) -> None:
        begin = clock()
        self._after_step(time, recorder)
        self.seconds += clock() - begin


def _step_again(run: Path, how: str) -> None:
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as folder:
        copy = Path(shutil.copytree(run, Path(folder) / "run"))
        plan = Plan.from_json((copy / "plan.json").read_text(encoding="utf-8"))
        sumo = copy / "sumo"
        if how.startswith("{"):
            (sumo / "behaviour.json").write_text(how, encoding="utf-8")
        story = StoryRun.in_folder(copy, plan) if (sumo / "story.json").is_file() else None
        timed = None if story is None else _Timed(story)
        driven = (sumo / "behaviour.json").is_file()
        behaviour = BehaviourRun.in_folder(copy, plan) if driven else None
        stepper = Stepper(plan, lambda _: None, None, story, behaviour)
        arguments = ["--configuration-file", str(sumo / CONFIG_FILE), *outputs_to(copy, sumo)]
        with open_session(arguments) as session:
            print("ready", flush=True)
            sys.stdin.read()
            begin = clock()
            if how == "sumo":
                while session.step() < plan.until and session.expected():
                    pass
            else:
                stepper.run(session, plan.until)
            spent = clock() - begin
        if behaviour is not None:
            behaviour.close()
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        own = 0.0 if timed is None else timed.seconds
        print(spent + children.ru_utime + children.ru_stime, own)


if __name__ == "__main__":
    _step_again(Path(sys.argv[1]), sys.argv[2])
