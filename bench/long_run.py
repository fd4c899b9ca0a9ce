"""A long run in slices by odscen against bare ``sumo`` in one piece, same demand, same recording.

``python -m bench.long_run RUN [HOURS]``: RUN is the folder of a long run (of which plan, network,
routes and configuration are taken); HOURS of it are run, in slices of an hour. CPU seconds, as wall
time on a shared machine measures the neighbours. Aim: at most 1.15.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from bench.recording import without_outputs
from odscen.results.records import Plan
from odscen.sumo import layout

SLICE = 3600.0


def main() -> None:
    if len(sys.argv) < 2:
        print("skipped: name the folder of a long run")
        return
    given, hours = Path(sys.argv[1]), float(sys.argv[2]) if len(sys.argv) > 2 else 3.0
    import sumo

    with tempfile.TemporaryDirectory() as name:
        run = Path(name)
        shutil.copytree(given / layout.SUMO_FOLDER, run / layout.SUMO_FOLDER)
        plan = Plan.from_json((given / layout.PLAN_FILE).read_text(encoding="utf-8"))
        until = hours * 3600.0
        actors = tuple(actor for actor in plan.actors if actor.depart < until)
        plan = replace(plan, until=until, slice_length=SLICE, actors=actors)
        (run / layout.PLAN_FILE).write_text(plan.to_json(), encoding="utf-8")
        config = run / layout.SUMO_FOLDER / layout.CONFIG_FILE
        binary = Path(sumo.SUMO_HOME) / "bin" / "sumo"
        bare = [str(binary), "-c", str(config), "--end", f"{until:g}"]
        ours = [sys.executable, "-m", "odscen.sumo.worker", str(run / layout.PLAN_FILE)]
        quiet = config.with_name("quiet.sumocfg")
        quiet.write_text(without_outputs(config.read_text(encoding="utf-8")), encoding="utf-8")
        silent = [str(binary), "-c", str(quiet), "--end", f"{until:g}"]
        seconds = {"sumo": cpu(bare), "odscen": cpu(ours)}
        shown = json.loads((run / layout.ACTORS_FILE).read_text(encoding="utf-8"))["actors"]
        seconds["silent"] = cpu(silent)
    inserted = sum(actor["status"] != "waiting" for actor in shown)
    print(
        f"{hours:g} h, {inserted:,} on the road: odscen {seconds['odscen']:.1f} s, sumo with the "
        f"same output {seconds['sumo']:.1f} s, ratio {seconds['odscen'] / seconds['sumo']:.2f} "
        f"(aim 1.15); sumo without output {seconds['silent']:.1f} s, ratio "
        f"{seconds['odscen'] / seconds['silent']:.2f}"
    )


def cpu(command: list[str]) -> float:
    before = os.times()
    subprocess.run(command, check=True, capture_output=True)
    after = os.times()
    spent = after.children_user + after.children_system
    return spent - before.children_user - before.children_system


if __name__ == "__main__":
    main()
