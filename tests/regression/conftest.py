import shutil
from pathlib import Path

import pytest

from odscen.regression.gates import run_suite
from odscen.regression.suite import read_suite
from odscen.workspace.store import Workspace

ROOT = Path(__file__).parents[2]

SUITE = """
name = "small"
maps = ["maps/*.xodr"]
scenarios = ["*.scenario.json"]
baselines = "baselines"
seeds = [1, 2]
expect = ["arrived >= 97 %", "teleported == 0"]
"""


@pytest.fixture(scope="session")
def store(tmp_path_factory):
    return Workspace.open(tmp_path_factory.mktemp("workspace"))


def copy_suite(folder, *names):
    """Some shipped scenarios with their maps and a suite, to be changed at will."""
    (folder / "maps").mkdir()
    for name in names:
        shutil.copy(ROOT / "maps" / f"{name}.xodr", folder / "maps")
        shutil.copy(ROOT / "suites" / "scenarios" / f"{name}.scenario.json", folder)
    file = folder / "small.toml"
    file.write_text(SUITE)
    return file


@pytest.fixture(scope="module")
def with_baseline(store, tmp_path_factory):
    """A suite of two scenarios with baselines written."""
    file = copy_suite(tmp_path_factory.mktemp("suite"), "signal_crossing", "t_junction_signs")
    result = run_suite(store, read_suite(file), update_baseline=True, processes=2)
    assert result.exit_code == 0
    assert all(case.updated for case in result.cases)
    return file


@pytest.fixture
def suite(with_baseline, tmp_path):
    """A copy of it of one's own."""
    shutil.copytree(with_baseline.parent, tmp_path, dirs_exist_ok=True)
    return tmp_path / with_baseline.name
