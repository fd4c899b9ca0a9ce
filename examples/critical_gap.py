"""A cut-in: which gaps are critical? A sweep over a grid, then a search where it gets close.

Run it with ``python examples/critical_gap.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import odscen
from odscen.experiments import (
    Range,
    SearchSettings,
    SweepPlan,
    SweepSettings,
    search,
    sweep,
)

MAP = "motorway_weave"


def look(workspace: odscen.Workspace) -> None:
    editing = odscen.Editing(workspace, odscen.place_template(workspace, "cut-in", MAP))
    editing.apply("set_parameter", parameter="ttc", value=2.0, min=0.5, max=6.0)
    editing.apply("set_formula", place="rules/cut-in/when/ttc/below", formula="$ttc")
    scenario = editing.scenario
    judged = SweepSettings(safe=("min_ttc >= 2.5",))
    axis = Range("ttc", 1.0, 5.0, steps=3)

    swept = sweep(workspace, scenario, SweepPlan((axis,)), workspace.root / "grid", settings=judged)
    for row in swept.table.iter_rows(named=True):
        print(f"ttc {row['ttc']:.1f} s: {'safe' if row['safe'] else 'not safe'}")

    asked = SearchSettings(method="sobol", runs=4)
    found = search(
        workspace, scenario, (axis,), workspace.root / "search",
        search_settings=asked, settings=judged, processes=2,
    )  # fmt: skip
    print(f"{len(found.critical)} of {found.table.height} cases are critical")


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    look(store)
