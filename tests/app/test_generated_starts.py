"""Fills of a program in an environment without odscen: who is placed departs, as fast as asked."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from odscen.app.generation import generate
from odscen.app.generators import GeneratorDoor
from odscen.app.running.batches import run_many
from odscen.app.scenarios import read_scenario
from odscen.learning.fill import CheckedFill
from odscen.maps.store import Workspace
from odscen.runs.recorded import trajectory_files
from odscen.runs.run_settings import RunSettings
from odscen.scenario.sampling.generation_settings import GenerationSettings
from tests.app.conftest import MAPS
from tests.app.test_generators import PROGRAM

BARE = """
import sys
sys.path.append({numpy!r})
try:
    import odscen
except ModuleNotFoundError:
    pass
else:
    sys.exit("odscen is here")
"""


@pytest.fixture
def bare_program(tmp_path: Path) -> GeneratorDoor:
    """The twenty lines of docs/generators.md in a Python that has numpy and nothing else."""
    packages = tmp_path / "numpy-alone"
    packages.mkdir()
    (folder,) = np.__path__
    for part in (Path(folder), Path(folder).with_name("numpy.libs")):
        if part.is_dir():
            (packages / part.name).symlink_to(part)
    program = tmp_path / "program.py"
    program.write_text(BARE.format(numpy=str(packages)) + PROGRAM)
    return GeneratorDoor(command=f"{sys.executable} -I -S {program} {{in}}.npz {{out}}.npz")


@pytest.mark.slow(together=True)
@pytest.mark.parametrize("name", ["town_5x5", "rural_hills", "motorway_weave"])
def test_all_of_a_good_fill_depart_at_once_with_the_speed_that_was_asked(
    name: str, tmp_path: Path, bare_program: GeneratorDoor
) -> None:
    workspace = Workspace.open(tmp_path / "workspace")
    workspace.add_map(MAPS / f"{name}.xodr")
    fills: dict[str, CheckedFill] = {}
    settings = GenerationSettings(map_name=name, seed=3, count=2, fill=0.5, roi_segments=40)
    paths = generate(workspace, settings=settings, generator=bare_program, filled=fills.__setitem__)
    runs = run_many(
        workspace, paths, settings=RunSettings(until=1.0, step_length=0.5), reports=False
    )
    for path, run in zip(paths, runs, strict=True):
        actors, checked = read_scenario(path).actors, fills[read_scenario(path).name]
        assert len(actors) >= 0.99 * checked.given > 100
        assert {one.what for one in checked.remarks} <= {"clamped"}  # what no driver could brake
        assert run.summary["actors"]["inserted"] >= 0.99 * len(actors)
        rows = pl.concat([pl.read_parquet(one) for one in trajectory_files(run.folder)])
        begin = rows.filter(pl.col("timestep_time") == 0.0)
        first = dict(begin.select("vehicle_id", "vehicle_speed").iter_rows())
        near = [abs(first.get(one.id, np.inf) - (one.initial_speed or 0)) <= 0.1 for one in actors]
        assert np.mean(near) >= 0.99
