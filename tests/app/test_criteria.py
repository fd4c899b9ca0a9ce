from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from odscen.app.running.runs import run
from odscen.app.scenarios import check_scenario, read_scenario, write_scenario
from odscen.base.errors import ScenarioError
from odscen.figures.judging.expectations import parse_expectation
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.json_form import dumps, loads

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.maps.store import Workspace


def asking(sampled: Path, folder: Path, *criteria: str) -> Path:
    scenario = read_scenario(sampled).model_copy(update={"criteria": criteria})
    return write_scenario(scenario, folder / "asking.scenario.json")


@pytest.mark.slow
def test_a_run_is_judged_by_the_criteria_of_its_scenario_and_fails_only_where_asked(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    first = read_scenario(sampled).actors[0].id
    file = asking(
        sampled,
        tmp_path,
        f"arrived({first}) == 1",
        f"max_speed({first}) <= 200 km/h",
        "min_ttc >= 0 s",
    )
    settings = RunSettings(until=5.0)
    result = run(workspace, file, settings=settings, out=tmp_path / "runs")
    rows = result.summary["criteria"]
    assert [row["passed"] for row in rows] == [False, True, True]
    assert rows[0]["words"] == f"{first} reaches its goal"
    assert 0.0 <= rows[1]["value"] <= 200.0
    assert rows[1]["unit"] == "km/h"
    assert result.exit_code == 0
    assert result.report is not None
    text = result.report.read_text(encoding="utf-8")
    assert f"{first} reaches its goal" in text
    assert "1 of 3 criteria not met" in text
    wanted = RunSettings(until=5.0, expectations=(parse_expectation("criteria"),))
    again = run(workspace, file, settings=wanted, out=tmp_path / "again")
    assert again.exit_code == 1


@pytest.mark.slow
def test_a_run_without_criteria_says_nothing_of_them(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    result = run(workspace, sampled, settings=RunSettings(until=2.0), out=tmp_path / "runs")
    assert "criteria" not in result.summary
    assert '"criteria"' not in (result.folder / "plan.json").read_text(encoding="utf-8")


def test_criteria_that_cannot_be_judged_are_refused_with_their_place(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    file = asking(sampled, tmp_path, "collidde == 0", "arrived(nobody) == 1", "arrived(ego) == 1")
    found = [one for one in check_scenario(workspace, file) if one.where.startswith("criteria")]
    assert [(one.code, one.where) for one in found] == [
        ("criterion_unknown", "criteria[0]"),
        ("criterion_without_actor", "criteria[1]"),
        ("criterion_without_actor", "criteria[2]"),
    ]
    with pytest.raises(ScenarioError):
        run(workspace, file, settings=RunSettings(until=2.0), out=tmp_path / "runs")
    assert not (tmp_path / "runs").exists()


def test_a_document_keeps_its_criteria_and_one_without_any_has_no_word_of_them(
    sampled: Path,
) -> None:
    scenario = read_scenario(sampled)
    assert "criteria" not in dumps(scenario)
    asked = scenario.model_copy(update={"criteria": ("collided == 0", "min_ttc(ego) >= 1.5 s")})
    assert loads(dumps(asked)) == asked
