"""Runs stepped once more side by side: processes that take turns of a twentieth of a second.

So that all meet the same machine. ``python -m bench.in_turns RUN HOW`` makes the steps of a run
that has ended and prints processor seconds, those of programs that it starts included; starting is
not in them. ``HOW`` is ``run`` (as the run was), ``sumo`` (SUMO's steps and its outputs
alone), or what drives, as JSON.
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
from typing import TYPE_CHECKING

from odscen.results.records.run_records import Plan
from odscen.sumo.folder.layout import CONFIG_FILE
from odscen.sumo.outputs.output_tables import outputs_to
from odscen.sumo.worker.behaviour.behaviour_run import BehaviourRun
from odscen.sumo.worker.session import open_session
from odscen.sumo.worker.stepping import Stepper
from odscen.sumo.worker.story.story_run import StoryRun

if TYPE_CHECKING:
    from collections.abc import Sequence

TURN = 0.05
"""Seconds."""


def seconds_of(runs: Sequence[tuple[Path, str]]) -> list[float]:
    """Processor seconds of the steps of each run, all made once more, in turns."""
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
    return [float(out.read().split()[-1]) for out in outs]


def _step_again(run: Path, how: str) -> None:
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as folder:
        copy = Path(shutil.copytree(run, Path(folder) / "run"))
        plan = Plan.from_json((copy / "plan.json").read_text(encoding="utf-8"))
        sumo = copy / "sumo"
        if how.startswith("{"):
            (sumo / "behaviour.json").write_text(how, encoding="utf-8")
        story = StoryRun.in_folder(copy, plan) if (sumo / "story.json").is_file() else None
        driven = (sumo / "behaviour.json").is_file()
        behaviour = BehaviourRun.in_folder(copy, plan) if driven else None
        stepper = Stepper(plan, lambda _: None, None, story, behaviour)
        arguments = ["--configuration-file", str(sumo / CONFIG_FILE), *outputs_to(copy, sumo)]
        with open_session(arguments) as session:
            print("ready", flush=True)
            sys.stdin.read()
            begin = time.process_time()
            if how == "sumo":
                while session.step() < plan.until and session.expected():
                    pass
            else:
                stepper.run(session, plan.until)
            spent = time.process_time() - begin
        if behaviour is not None:
            behaviour.close()
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        print(spent + children.ru_utime + children.ru_stime)


if __name__ == "__main__":
    _step_again(Path(sys.argv[1]), sys.argv[2])
