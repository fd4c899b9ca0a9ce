import importlib
import os
import shutil
import subprocess
import sys
import tomllib

import pytest

from odscen.maps.store import Workspace
from tests.experiments.conftest import ROOT


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


def run_pytest(project, workspace, *arguments, early=True):
    """Not ``early``: as the entry point loads the plugin, after pytest has looked for its root."""
    command = [sys.executable, "-m", "pytest", *arguments]
    plugin = "odscen.experiments.regression.pytest_plugin"
    environment = os.environ | {
        "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
        "ODSCEN_WORKSPACE": "" if workspace is None else str(workspace),
    }
    if early:
        command += ["-p", plugin]
    else:
        environment["PYTEST_PLUGINS"] = plugin
    return subprocess.run(
        command, cwd=project, env=environment, capture_output=True, text=True, check=False
    )


def test_pytest_finds_the_plugin_by_its_entry_point():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    module = importlib.import_module(project["entry-points"]["pytest11"]["odscen"])
    assert callable(module.pytest_collect_file)


@pytest.mark.slow
def test_scenario_files_are_left_alone_unless_asked_for(project, workspace):
    (project / "test_other.py").write_text(
        "import sys\n\ndef test_nothing_is_loaded():\n"
        "    assert not {'libsumo', 'polars', 'numpy', 'odscen.app'} & set(sys.modules)\n"
    )
    done = run_pytest(project, workspace, "-q")
    assert "1 passed" in done.stdout, done.stdout


@pytest.mark.slow
def test_scenario_files_are_collected_with_every_seed(project, workspace):
    (project / "pytest.ini").write_text(
        "[pytest]\nodscen_collect = true\nodscen_seeds = 1 2\n"
        "odscen_expect =\n    arrived >= 97 %\n"
    )
    done = run_pytest(project, workspace, "-v")
    assert done.returncode == 0, done.stdout
    assert "t_junction_signs.scenario.json::seed-2 PASSED" in done.stdout


@pytest.mark.slow
def test_a_missed_expectation_fails_the_file_in_plain_words(project, workspace):
    (project / "pytest.ini").write_text("[pytest]\nodscen_expect = mean_delay <= 1 s\n")
    done = run_pytest(project, workspace, "t_junction_signs.scenario.json")
    assert done.returncode == 1
    assert "expected mean_delay <= 1 s, but it is" in done.stdout
    assert "Traceback" not in done.stdout


@pytest.mark.slow
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


@pytest.mark.slow
def test_paths_are_relative_to_the_file_of_the_test(project, workspace):
    """From wherever pytest is started, as for any data beside a test."""
    (project / "deep").mkdir()
    shutil.move(project / "t_junction_signs.scenario.json", project / "deep" / "mine.scenario.json")
    (project / "deep" / "test_mine.py").write_text(
        "import pytest\n\n@pytest.fixture(scope='module')\ndef crossing(odscen_run):\n"
        "    return odscen_run('mine.scenario.json', until=10)\n\n"
        "def test_it(crossing):\n    assert crossing.summary['status'] == 'completed'\n"
    )
    done = run_pytest(project, workspace, "-q")
    assert "1 passed" in done.stdout, done.stdout


PROJECT = """
[tool.pytest.ini_options]
testpaths = ["tests"]
odscen_workspace = "{workspace}"
"""
MODULE = """
import pytest

@pytest.fixture(scope="module", params=[1, 2])
def crossing(request, odscen_run):
    return odscen_run("t_junction_signs.scenario.json", seed=request.param, until=60)

def test_delay(crossing):
    assert crossing.figure("mean_delay") < 60

def test_seed(crossing):
    assert crossing.summary["seed"] in (1, 2)
"""


@pytest.mark.slow
def test_options_stand_in_the_configuration_and_fixtures_of_a_module_run_scenarios(
    project, workspace
):
    (project / "pyproject.toml").write_text(
        PROJECT.format(workspace=os.path.relpath(workspace, project))
    )
    (project / "tests").mkdir()
    (project / "tests" / "test_mine.py").write_text(MODULE)
    done = run_pytest(project, None, "-q")
    assert "4 passed" in done.stdout, done.stdout


@pytest.mark.slow
def test_the_workspace_option_moves_no_root_and_takes_no_tests_away(project, workspace):
    (project / "pyproject.toml").write_text('[tool.pytest.ini_options]\ntestpaths = ["tests"]\n')
    (project / "tests").mkdir()
    (project / "tests" / "test_mine.py").write_text("def test_it():\n    pass\n")
    (project / "elsewhere").mkdir()
    (project / "elsewhere" / "test_other.py").write_text("def test_other():\n    pass\n")
    option = f"--odscen-workspace={workspace}"
    done = run_pytest(project, None, option, "--collect-only", early=False)
    assert f"rootdir: {project}" in done.stdout, done.stdout
    assert "1 test collected" in done.stdout
    done = run_pytest(project, None, "--odscen-workspace", str(workspace), early=False)
    assert done.returncode == 4
    assert "write --odscen-workspace=DIR" in done.stderr


@pytest.mark.slow
def test_scenarios_and_seeds_are_shared_out_among_processes(project, workspace):
    (project / "pytest.ini").write_text("[pytest]\nodscen_collect = true\nodscen_seeds = 1 2\n")
    option = f"--odscen-workspace={workspace}"
    done = run_pytest(project, None, "-p", "xdist", "-n", "2", "-v", option)
    assert done.returncode == 0, done.stdout + done.stderr
    passed = [line for line in done.stdout.splitlines() if "PASSED" in line]
    assert len(passed) == 2
    assert any("seed-1" in line for line in passed)


@pytest.mark.slow
def test_failures_show_the_line_of_the_test_and_nothing_of_ours(project, workspace):
    (project / "test_mine.py").write_text(
        "def test_delay(odscen_run):\n"
        "    run = odscen_run('t_junction_signs.scenario.json', until=60)\n"
        "    assert run.figure('mean_delay') < 0.01\n\n"
        "def test_name(odscen_run):\n"
        "    run = odscen_run('t_junction_signs.scenario.json', until=60)\n"
        "    assert run.figure('mean_dealy') < 30\n\n"
        "def test_file(odscen_run):\n"
        "    odscen_run('no.scenario.json')\n"
    )
    done = run_pytest(project, workspace, "-q")
    assert "3 failed" in done.stdout, done.stdout
    assert "where" in done.stdout
    assert "<Run of t_junction_signs, seed 16: completed>" in done.stdout
    assert "no figure named 'mean_dealy'; did you mean mean_delay" in done.stdout
    assert "Failed: no.scenario.json: No such file or directory" in done.stdout
    for internal in ("pytest_plugin.py", "finished_run.py", "app/running/runs.py"):
        assert internal not in done.stdout
