"""What an external driver model costs: about 300 vehicles driven, against plain SUMO.

``python -m bench behaviour``. Steps of 0.1 s, as learned drivers have them. Each column is stepped
in a process of its own, in turns (see ``bench/in_turns.py``): SUMO with its outputs alone; the run
without a model; with one that controls nobody; with the intelligent driver for all; and with the
same in another process, over a pipe, whose processor time counts. Aim: IDM at most 2.0 times SUMO.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
from pathlib import Path

from bench.in_turns import seconds_of
from bench.rules import MAP, on_the_road, traffic
from odscen.app.maps import load_map
from odscen.app.runs import check_run, prepare_run
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.sumo.realize.run_settings import RunSettings
from odscen.sumo.runner.run_jobs import run_prepared
from odscen.workspace.store import Workspace

ROUNDS = 5
PIPED = (
    "from odscen.learning.behaviour.behaviour_messages import serve; "
    "from odscen.learning.behaviour.intelligent_driver import IntelligentDriver; "
    "serve(IntelligentDriver())"
)
DOORS = {
    "run": None,
    "nobody": BehaviourDoor(name="bench.behaviour:Nobody"),
    "idm": BehaviourDoor(name="idm"),
    "idm, one lane": BehaviourDoor(name="idm", options={"changes_lanes": 0.0}),
    "piped": BehaviourDoor(command=f'{sys.executable} -c "{PIPED}"'),
}


class Nobody:
    """Controls nobody."""

    def init(self, rng, scene):
        del rng, scene

    def act(self, seen, state):
        import numpy as np

        from odscen.learning.behaviour.behaviour_model import Action

        del state
        return Action(speed=seen.speed), np.zeros(len(seen), dtype=bool)


def main() -> None:
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as folder:
        root = Path(folder)
        workspace = Workspace.open(root / "workspace")
        loaded = load_map(workspace.add_map(MAP))
        scenario = traffic(loaded, rules=0)
        made = {}
        for name, door in DOORS.items():
            settings = RunSettings(behaviour=door)
            checked = check_run(workspace, scenario, name=name, settings=settings)
            made[name] = run_prepared(prepare_run(checked), root / name)
            if made[name].status != "completed":
                raise SystemExit(str(made[name].summary.get("error")))
        ways = [(made["run"].folder, "sumo"), *((run.folder, "run") for run in made.values())]
        names = ["sumo", *made]
        print("on the road, mean:", *(f"{n} {on_the_road(run):.0f}" for n, run in made.items()))
        rounds = []
        for number in range(ROUNDS + 1):
            found = seconds_of(ways)
            if number:  # the first round warms up
                rounds.append(found)
                print(*(f"{n} {s:.2f} s" for n, s in zip(names, found, strict=True)), flush=True)
        for way, name in enumerate(names[1:], start=1):
            for base in (0, 1):
                ratios = [one[way] / one[base] for one in rounds]
                print(
                    f"{name} / {names[base]}: median {statistics.median(ratios):.2f} "
                    f"({min(ratios):.2f} to {max(ratios):.2f})"
                )


if __name__ == "__main__":
    main()
