import json
import re
import shutil
from pathlib import Path

import pytest

from odscen.experiments.gates import Update, run_suite
from odscen.experiments.suite import read_suite
from odscen.maps.store import Workspace

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


TINY = """
name = "tiny"
maps = ["maps/*.xodr"]
scenarios = ["*.scenario.json"]
baselines = "baselines"
seeds = [1]
until = 20
"""


@pytest.fixture(scope="session")
def with_baseline(store, tmp_path_factory):
    """A suite of two scenarios with baselines written."""
    file = copy_suite(tmp_path_factory.mktemp("suite"), "signal_crossing", "t_junction_signs")
    result = run_suite(store, read_suite(file), update=Update(True), processes=2)
    assert result.exit_code == 0
    assert all(case.updated for case in result.cases)
    return file


@pytest.fixture
def suite(with_baseline, tmp_path):
    """A copy of it of one's own."""
    shutil.copytree(with_baseline.parent, tmp_path, dirs_exist_ok=True)
    return tmp_path / with_baseline.name


def edit_json(path, **fields):
    """Change the top of a JSON file."""
    path.write_text(json.dumps(json.loads(path.read_text()) | fields))


def write_tiny(folder, *names):
    """A suite of scenarios with two cars for 20 s, all the same but for their names."""
    (folder / "maps").mkdir(parents=True)
    shutil.copy(ROOT / "maps" / "t_junction_signs.xodr", folder / "maps")
    source = ROOT / "suites" / "scenarios" / "t_junction_signs.scenario.json"
    document = json.loads(source.read_text())
    cars = [actor for actor in document["actors"] if actor["category"] == "car"][:2]
    for name in names:
        file = folder / f"{name}.scenario.json"
        file.write_text(json.dumps(document | {"name": name, "actors": cars, "flows": []}))
    suite = folder / "tiny.toml"
    suite.write_text(TINY)
    return suite


@pytest.fixture(scope="session")
def tiny_baseline(store, tmp_path_factory):
    """Baseline of any of the tiny scenarios."""
    suite = write_tiny(tmp_path_factory.mktemp("tiny"), "one")
    assert run_suite(store, read_suite(suite), update=Update(True)).exit_code == 0
    return suite.parent / "baselines" / "one.json"


@pytest.fixture
def tiny(tiny_baseline, tmp_path):
    """Makes a suite of tiny scenarios with their baselines."""

    def made(*names):
        suite = write_tiny(tmp_path / "suite", *names)
        (suite.parent / "baselines").mkdir()
        for name in names:
            shutil.copy(tiny_baseline, suite.parent / "baselines" / f"{name}.json")
        return suite

    return made


@pytest.fixture(scope="session")
def mixed(store, with_baseline, tmp_path_factory):
    """A suite that was run with other signals, another map, a broken scenario and a deleted one."""
    folder = tmp_path_factory.mktemp("mixed") / "suite"
    shutil.copytree(with_baseline.parent, folder)
    timing = {"junction": "10001", "green": [60, 8]}
    edit_json(folder / "signal_crossing.scenario.json", signals={"junctions": [timing]})
    map_file = folder / "maps" / "t_junction_signs.xodr"
    text = map_file.read_text()
    road = re.search(r'<road name="Main Road" id="2".*?</road>', text, re.DOTALL)[0]
    map_file.write_text(text.replace(road, re.sub(r'<speed max="\d+"', '<speed max="20"', road)))
    broken = json.loads((folder / "t_junction_signs.scenario.json").read_text())
    broken["actors"][0]["spawn"] = "9.9.9.9"
    (folder / "broken.scenario.json").write_text(json.dumps(broken | {"name": "broken"}))
    shutil.copy(folder / "baselines" / "signal_crossing.json", folder / "baselines" / "gone.json")
    suite = read_suite(folder / with_baseline.name)
    return run_suite(store, suite, processes=2, out=folder.parent / "runs")
