"""Lights: timed after the demand, and judged beside today's program by paired runs.

Run it with ``python examples/time_lights.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import odscen
from odscen import demand, edit, signals

MAP = "signal_crossing"


def time_lights(workspace: odscen.Workspace) -> None:
    graph = workspace.map(MAP).graph()
    today = edit.new_scenario(graph, name="rush", roi=graph.segments.ids)
    today = edit.set_simulation(today, duration=300)
    today = demand.add_background(workspace, today, name="all", trips=120)
    for program in signals.signal_programs(workspace, today):
        print(f"junction {', '.join(program.junctions)}: {program.control}")

    timed = signals.time_signals(workspace, today, begin=0, end=300)
    print(*timed.to_words(), sep="\n")
    judged = signals.evaluate_signals(workspace, timed.scenario, today=today, seeds=(1, 2))
    print(judged.words)


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    time_lights(store)
