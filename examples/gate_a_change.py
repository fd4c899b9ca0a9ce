"""A gate: baselines are written, a lane is narrowed, and the first line names it.

Run it with ``python examples/gate_a_change.py [WORKSPACE]``.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import odscen
from odscen.experiments import Update, junit_xml, read_suite, run_suite

MAP = "signal_crossing"
SUITE = """
name = "crossing"
maps = ["signal_crossing.xodr"]
scenarios = ["crossing.scenario.json"]
baselines = "baselines"
until = 30
"""


def gate(workspace: odscen.Workspace) -> None:
    folder = workspace.root / "suite"
    settings = odscen.GenerationSettings(map_name=MAP, seed=1, fill=0.2)
    (file,) = odscen.generate(workspace, settings=settings)
    odscen.write_scenario(odscen.read_scenario(file), folder / "crossing.scenario.json")
    xodr = folder / "signal_crossing.xodr"
    xodr.write_bytes(workspace.map(MAP).read("xodr"))
    (folder / "suite.toml").write_text(SUITE)

    suite = read_suite(folder / "suite.toml")
    print("baseline:", run_suite(workspace, suite, update=Update(wanted=True)).exit_code)
    print("again:", run_suite(workspace, suite).exit_code)
    xodr.write_text(xodr.read_text().replace('<width a="3.25"', '<width a="2.4"', 1))
    result = run_suite(workspace, suite)
    print("narrowed:", result.exit_code, *result.cases[0].changed_inputs)
    (workspace.root / "junit.xml").write_text(junit_xml(result))


if __name__ == "__main__":
    root = Path(sys.argv[1] if sys.argv[1:] else tempfile.mkdtemp())
    store = odscen.Workspace.open(root)
    store.add_map(next(path for path in odscen.shipped_maps() if path.stem == MAP))
    gate(store)
