"""A scene as OpenSCENARIO and back, and what differs.

Run it with ``python examples/to_openscenario.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import odscen

MAP = "motorway_weave"


def exchange(workspace: odscen.Workspace) -> None:
    scenario = odscen.place_template(workspace, "lead-brakes", MAP)
    folder = workspace.root / "xosc"
    written = odscen.export(workspace, scenario, folder, to="openscenario", name="lead-brakes")
    print("written:", *(file.name for file in written))
    xosc = next(file for file in written if file.suffix == ".xosc")
    imported = odscen.import_file(workspace, xosc, out=folder / "back.scenario.json")
    for verdict, rows in imported.lists.items():
        print(f"{verdict}: {len(rows)}")
    back = odscen.read_scenario(folder / "back.scenario.json")
    print(f"{len(scenario.actors)} actors there, {len(back.actors)} back")


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    exchange(store)
