import importlib
import os
import shutil
import subprocess
import sys
import tomllib

import pytest

from odscen.catalog.store import Workspace
from tests.regression.conftest import ROOT


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    root = tmp_path_factory.mktemp("workspace")
    Workspace.open(root).add_map(ROOT / "maps" / "t_junction_signs.xodr")
    return root


@pytest.fixture
def project(tmp_path):
    name = "t_junction_signs.scenario.json"
    shutil.copy(ROOT / "suites" / "scenarios" / name, tmp_path)
    return tmp_path


def run_pytest(project, workspace, *arguments):
    command = [sys.executable, "-m", "pytest", "-p", "odscen.regression.pytest_plugin", *arguments]
    environment = os.environ | {
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
        "ODSCEN_WORKSPACE": str(workspace),
    }
    return subprocess.run(
        command, cwd=project, env=environment, capture_output=True, text=True, check=False
    )


def test_pytest_finds_the_plugin_by_its_entry_point():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    module = importlib.import_module(project["entry-points"]["pytest11"]["odscen"])
    assert callable(module.pytest_collect_file)


def test_scenario_files_are_left_alone_unless_asked_for(project, workspace):
    (project / "test_other.py").write_text(
        "import sys\n\ndef test_nothing_is_loaded():\n"
        "    assert not {'libsumo', 'polars', 'numpy', 'odscen.app'} & set(sys.modules)\n"
    )
    done = run_pytest(project, workspace, "-q")
    assert "1 passed" in done.stdout, done.stdout


def test_scenario_files_are_collected_with_every_seed(project, workspace):
    (project / "pytest.ini").write_text(
        "[pytest]\nodscen_collect = true\nodscen_seeds = 1 2\n"
        "odscen_expect =\n    arrived >= 97 %\n"
    )
    done = run_pytest(project, workspace, "-v")
    assert done.returncode == 0, done.stdout
    assert "t_junction_signs.scenario.json::seed-2 PASSED" in done.stdout


def test_a_missed_expectation_fails_the_file_in_plain_words(project, workspace):
    (project / "pytest.ini").write_text("[pytest]\nodscen_expect = mean_delay <= 1 s\n")
    done = run_pytest(project, workspace, "t_junction_signs.scenario.json")
    assert done.returncode == 1
    assert "expected mean_delay <= 1 s, but it is" in done.stdout
    assert "Traceback" not in done.stdout


def test_the_fixture_gives_the_run_and_fails_what_falls_short(project, workspace):
    (project / "test_mine.py").write_text(
        "def test_good(odscen_run):\n"
        "    expect = ['arrived >= 97 %']\n"
        "    run = odscen_run('t_junction_signs.scenario.json', seed=3, expect=expect)\n"
        "    assert run.summary['seed'] == 3\n"
        "    assert (run.folder / 'trajectories.parquet').is_file()\n\n"
        "def test_bad(odscen_run):\n"
        "    odscen_run('t_junction_signs.scenario.json', expect=['arrived == 0'])\n"
    )
    done = run_pytest(project, workspace, "-q")
    assert "1 failed, 1 passed" in done.stdout, done.stdout
    assert "expected arrived == 0" in done.stdout
