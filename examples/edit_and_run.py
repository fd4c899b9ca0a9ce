"""A scene from a template, edited with undo, given demand, its light timed after it, and run.

Run it with ``python examples/edit_and_run.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import odscen

MAP = "signal_crossing"


def edit_scene(workspace: odscen.Workspace) -> Path:
    """Place a template and edit it; return its file, which the page opens with the same undo."""
    editing = odscen.Editing(workspace, odscen.place_template(workspace, "mid-block", MAP))

    editing.apply("set_simulation", duration=300)
    editing.apply("set_seed", seed=7)
    editing.undo()
    print(f"undone: {editing.redo_label}, seed {editing.scenario.seed}")

    # Whatever makes a scenario of a scenario can be a step of undo, too.
    editing.change(
        "Background traffic",
        lambda scenario: odscen.add_background(workspace, scenario, name="town", trips=60),
    )
    timed = odscen.time_signals(workspace, editing.scenario, begin=0, end=300)
    editing.change("Time the light", lambda _: timed.scenario)
    print(*timed.to_words(), sep="\n")

    print("steps:", ", ".join(step.label for step in editing.steps))
    return editing.save(workspace.scenarios / "mid-block.scenario.json")


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    run = odscen.run(store, edit_scene(store), settings=odscen.RunSettings(until=120.0))
    print(f"{run.counts['inserted']} road users, mean delay {run.figures['mean_delay']:.1f} s")
