"""A run watched step by step, and stopped as soon as half of the road users have arrived.

Run it with ``python examples/watch_a_run.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import odscen

MAP = "roundabout"


def until_half_have_arrived(workspace: odscen.Workspace, scenario: odscen.Scenario) -> odscen.Run:
    with odscen.watch(workspace, scenario) as steps:
        for step in steps:  # SUMO waits for each turn of the loop
            stopped = step.ids[step.speed < 0.1]
            if step.time % 10 == 0 and len(step.ids):
                mean = step.speed.mean()
                print(f"{step.time:4.0f} s: {len(step.ids)} under way, {mean:.1f} m/s on average")
                print(f"        {len(stopped)} stopped {', '.join(stopped[:3])}")
            if step.arrived >= len(scenario.actors) / 2:
                break
    return steps.run


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    wanted = odscen.GenerationSettings(map_name=MAP, seed=2, fill=0.3)
    (path,) = odscen.generate(store, settings=wanted)
    run = until_half_have_arrived(store, odscen.read_scenario(path))
    arrived, planned = run.counts["arrived"], run.counts["planned"]
    print(f"{arrived} of {planned} arrived in {run.summary['sim_seconds']:g} s; see {run.report}")
