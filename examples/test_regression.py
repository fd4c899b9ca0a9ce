"""A regression test: pytest runs a scenario and holds what comes out against bounds.

Run it with ``pytest examples/test_regression.py``.

The fixture ``odscen_run`` comes with odscen. A run that fails, or that falls short of ``expect``,
fails the test; everything else is plain pytest on the finished run.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import odscen

SCENARIO = Path(__file__).parents[1] / "suites" / "scenarios" / "signal_crossing.scenario.json"


@pytest.fixture(scope="session")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> odscen.Workspace:
    store = odscen.Workspace.open(tmp_path_factory.mktemp("workspace"))
    maps = {path.stem: path for path in odscen.shipped_maps()}
    store.add_map(maps["signal_crossing"])
    return store


@pytest.mark.parametrize("seed", [1, 2])
def test_the_crossing_keeps_its_level_of_service(
    odscen_run: Callable[..., odscen.Run], workspace: odscen.Workspace, seed: int
) -> None:
    expect = ["arrived >= 97 %", "teleported == 0", "mean_delay <= 60 s"]
    run = odscen_run(SCENARIO, seed=seed, expect=expect, workspace=workspace.root)
    (junction,) = run.figures_by("junction").to_dicts()
    assert junction["level"] < "F"  # of the Highway Capacity Manual: A is best
