"""``odscen sweep`` on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from odscen.base.errors import InputError
from odscen.cli.sweep_command import search
from odscen.experiments.searches import SearchSettings
from odscen.experiments.sweeps import SweepSettings
from tests.cli.conftest import odscen

SUITES = Path(__file__).parents[2] / "suites" / "scenarios"


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    """A shipped scenario, shortened, whose first flow has its volume from a parameter."""
    data = json.loads((SUITES / "signal_crossing.scenario.json").read_text(encoding="utf-8"))
    data["simulation"]["duration"] = 40
    data["flows"][0]["per_hour"] = "60 * $per_minute"
    data["parameters"] = {
        "per_minute": {"value": 3, "unit": "veh/min", "min": 1, "max": 20},
        "twice": {"value": "2 * $per_minute"},
    }
    file = tmp_path / "busy.scenario.json"
    file.write_text(json.dumps(data), encoding="utf-8")
    return file


@pytest.mark.slow
def test_a_sweep_has_a_folder_a_table_and_a_page(
    workspace: Path, scenario: Path, tmp_path: Path
) -> None:
    (tmp_path / "own.py").write_text(
        "def half(run):\n    return run.counts['planned'] / 2\n", encoding="utf-8"
    )
    given = ("--vary", "per_minute=2,12", "--figure", "planned", "--figure", "half=own.py:half")
    found = odscen("sweep", scenario, *given, "--workspace", workspace, "--json", cwd=tmp_path)
    assert found.code == 0, found.err
    assert "2 cases of per_minute" in found.err
    few, many = found.json["cases"]
    assert few["per_minute"] == 2.0
    assert many["planned"] > few["planned"]
    assert many["half"] == many["planned"] / 2
    folder = tmp_path / "busy-sweep"
    assert Path(found.json["folder"]) == Path("busy-sweep")
    assert (folder / "sweep.html").is_file()
    alone = odscen("check", folder / "cases" / "case-002.scenario.json", "--workspace", workspace)
    assert alone.code == 0


@pytest.mark.slow
def test_a_dry_run_lists_the_cases_and_runs_none(scenario: Path, tmp_path: Path) -> None:
    plan = tmp_path / "plan.toml"
    plan.write_text('[[vary]]\nparameter = "per_minute"\nfrom = 2\nto = 8\nsteps = 3\n')
    found = odscen("sweep", scenario, "--plan", plan, "--dry-run", "--json", cwd=tmp_path)
    assert found.json["cases"] == [{"per_minute": value} for value in (2.0, 5.0, 8.0)]
    usual = odscen("sweep", scenario, "--samples", 4, "--dry-run", "--json", cwd=tmp_path).json
    assert usual["plan"]["vary"] == [
        {"parameter": "per_minute", "from": 1.0, "to": 20.0, "steps": None}
    ]
    assert len(usual["cases"]) == 4
    assert usual["without_effect"] == {}
    assert not (tmp_path / "busy-sweep").exists()


def test_a_dry_run_says_which_variables_have_no_effect(scenario: Path, tmp_path: Path) -> None:
    data = json.loads(scenario.read_text(encoding="utf-8"))
    data["parameters"]["idle"] = {"value": 1, "min": 1, "max": 2}
    scenario.write_text(json.dumps(data), encoding="utf-8")
    given = ("--vary", "idle=1,2", "--vary", "per_minute=2,4", "--dry-run", "--json")
    found = odscen("sweep", scenario, *given, cwd=tmp_path)
    reason = "no number of the scenario is computed from it"
    assert found.json["without_effect"] == {"idle": reason}
    assert f"idle has no effect: {reason}" in found.err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--vary", "gap"], "'gap' varies nothing"),
        (["--vary", "per_minute=1..9"], "a grid needs the number of steps"),
        (
            ["--samples", "3", "--method", "best"],
            "'best' is not one of grid, latin, sobol, random, tpe",
        ),
        (["--vary", "per_minute=1,2", "--figure", "x=y"], "give the function as FILE.py:NAME"),
        (["--vary", "per_minute=1,2", "--figure", "beauty"], "no figure of runs is called"),
        (["--vary", "per_minute=1,2", "--plan", "plan.json"], "not both"),
        (["--plan", "plan.json"], "plan.json: not a plan of a sweep"),
    ],
)
def test_bad_input_is_exit_2_with_words_and_leaves_nothing(
    workspace: Path, scenario: Path, tmp_path: Path, given: list[str], words: str
) -> None:
    (tmp_path / "plan.json").write_text("[3", encoding="utf-8")
    found = odscen("sweep", scenario, *given, "--workspace", workspace, cwd=tmp_path)
    assert found.code == 2
    assert words in found.err
    assert not (tmp_path / "busy-sweep").exists()


def test_a_search_has_a_seed_of_its_proposals_and_another_one_of_its_runs(
    workspace: Path, scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given = {}

    def find(*_: object, search_settings: SearchSettings, settings: SweepSettings, **__: object):
        given.update(proposals=search_settings.seed, runs=settings.seed)
        raise InputError("enough is known")

    monkeypatch.setattr("odscen.experiments.searches.search", find)
    with pytest.raises(InputError, match="enough"):
        search(scenario, search_seed=5, seed=7, out=tmp_path / "found", workspace=workspace)
    assert given == {"proposals": 5, "runs": 7}
