"""What an external driver model costs: about 300 vehicles driven, against plain SUMO.

``python -m bench behaviour``. Steps of 0.1 s, as learned drivers have them. Each column is stepped
in a process of its own, in turns (see ``bench/in_turns.py``): SUMO with its outputs alone; the run
without a model; with one that controls nobody; with the intelligent driver for all; and with the
same in another process, over a pipe, whose processor time counts. Aim: IDM at most 2.0 times SUMO.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import tempfile
from pathlib import Path

from bench.in_turns import seconds_of
from bench.rules import MAP, traffic
from odscen.app.maps import load_map
from odscen.app.running.runs import check_run, prepare_run
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.run_jobs import run_prepared

PIPED = (
    "from odscen.learning.behaviour.behaviour_messages import serve; "
    "from odscen.learning.behaviour.intelligent_driver import IntelligentDriver; "
    "serve(IntelligentDriver())"
)
DOORS = {
    "nobody": {"name": "bench.behaviour:Nobody"},
    "idm": {"name": "idm"},
    "imitation": {"name": "imitation"},
    "piped": {"command": f'{sys.executable} -c "{PIPED}"'},
}


class Nobody:
    """Controls nobody."""

    def init(self, rng, scene):
        del rng, scene

    def act(self, seen, state):
        import numpy as np

        from odscen.learning.behaviour.behaviour_model import DrivingAction

        del state
        return DrivingAction(speed=seen.speed), np.zeros(len(seen), dtype=bool)


def main() -> None:
    options = argparse.ArgumentParser(prog="bench behaviour")
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("--seconds", type=float, default=80.0, help="simulated")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as folder:
        root = Path(folder)
        workspace = Workspace.open(root / "workspace")
        loaded = load_map(workspace.add_map(MAP))
        settings = RunSettings(until=asked.seconds)
        checked = check_run(workspace, traffic(loaded, rules=0), name="traffic", settings=settings)
        run = run_prepared(prepare_run(checked), root / "run")
        if run.status != "completed":
            raise SystemExit(str(run.summary.get("error")))
        rows = run.trajectories().group_by("time").len()["len"]
        print(f"on the road: mean {rows.mean():.0f}, {asked.seconds:g} s", flush=True)
        ways = [(run.folder, how) for how in ("sumo", "run", *map(json.dumps, DOORS.values()))]
        _compare(ways, ["sumo", "run", *DOORS], asked.rounds)


def _compare(ways: list[tuple[Path, str]], names: list[str], count: int) -> None:
    rounds = []
    for number in range(count + 1):
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
