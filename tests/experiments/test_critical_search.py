"""Searches with real runs: what is found, resuming, and refusals."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from odscen.base.errors import ConflictError, InputError
from odscen.experiments.searches import SearchSettings, search
from odscen.experiments.sweeps import SweepSettings
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.sweeps.sweep_plan import Range
from tests.sumo.story_case import MIDDLE, document, node_at, workspace

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.experiments.searches import SearchResult
    from odscen.scenario.document.scenario_document import Scenario

MOTORWAY = "motorway_weave"
AXES = (Range("gap", 8.0, 80.0), Range("slow", 1.0, 20.0))
HOW = SearchSettings("random", runs=3, batch=2, seed=1)
SETTINGS = SweepSettings(safe=("clearance >= 1000",))


@pytest.fixture(scope="module")
def behind() -> Scenario:
    """An ego at 25 m/s behind a car that brakes to `slow` when the ego is `gap` metres away."""
    goal = node_at(MOTORWAY, 900.0, MIDDLE)
    actors = [
        {
            "id": name, "category": "car", "spawn": node_at(MOTORWAY, x, MIDDLE), "goal": goal,
            "speed": 25.0, "initial_speed": 25.0, "ego": name == "ego",
        }
        for name, x in (("ego", 300.0), ("lead", 400.0))
    ]  # fmt: skip
    when = {"time": {"after": 0.3}}
    then = [{"speed": {"to": "$slow", "shape": "step"}}]
    data = json.loads(dumps(document(MOTORWAY, [], [], until=2.0)))
    data |= {
        "actors": actors,
        "rules": [{"id": "r", "actor": "lead", "when": when, "then": then}],
        "parameters": {
            "slow": {"value": 10, "min": 0, "max": 30},
            "gap": {"value": 20, "min": 5, "max": 90},
        },
    }
    return loads(json.dumps(data))


@pytest.fixture(scope="module")
def found(behind: Scenario, tmp_path_factory: pytest.TempPathFactory) -> SearchResult:
    out = tmp_path_factory.mktemp("search") / "one"
    return search(workspace(), behind, AXES, out, search_settings=HOW, settings=SETTINGS)


@pytest.mark.slow
def test_what_is_critical_is_what_is_not_safe(found: SearchResult) -> None:
    assert found.table["status"].to_list() == ["completed"] * 3
    assert found.table["criticality"].null_count() == 0
    assert found.critical == ("case-001", "case-002", "case-003")
    archive = json.loads((found.folder / "criticals.json").read_text())
    assert [row["case"] for row in archive["archive"]] == list(found.archive)
    assert archive["coverage"] == pytest.approx(found.coverage) == 3 / 25


@pytest.mark.slow
def test_a_search_ends_with_the_same_files_after_an_interruption(
    behind: Scenario, found: SearchResult, tmp_path: Path
) -> None:
    again = tmp_path / "two"
    shutil.copytree(found.folder, again)
    for gone in ("cases.parquet", "criticals.json", "sweep.html"):
        (again / gone).unlink()
    shutil.rmtree(again / "runs" / "case-003")
    kept = (again / "runs" / "case-001" / "summary.json").stat().st_mtime_ns
    search(workspace(), behind, AXES, again, search_settings=HOW, settings=SETTINGS)
    for name in ("cases.parquet", "criticals.json", "sweep.html"):
        assert (again / name).read_bytes() == (found.folder / name).read_bytes()
    assert (again / "runs" / "case-001" / "summary.json").stat().st_mtime_ns == kept
    with pytest.raises(ConflictError, match="holds another search"):
        search(workspace(), behind, AXES, again, search_settings=replace(HOW, seed=2))


def test_an_unknown_parameter_or_count_is_refused_before_anything_runs(
    behind: Scenario, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="no parameter 'width'"):
        search(
            workspace(), behind, (Range("width", 0.0, 1.0),), tmp_path / "s", search_settings=HOW
        )
    with pytest.raises(InputError, match="runs must lie between 1"):
        SearchSettings(runs=0)
    assert not (tmp_path / "s").exists()
