"""Warm-up, analysis intervals and confidence on the command line."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.cli.conftest import odscen

SUITES = Path(__file__).parents[2] / "suites" / "scenarios"


@pytest.fixture(scope="module")
def ran(workspace: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of four minutes, of which the first is warm-up, measured every minute."""
    folder = tmp_path_factory.mktemp("study")
    data = json.loads((SUITES / "signal_crossing.scenario.json").read_text(encoding="utf-8"))
    data["simulation"]["duration"] = 240
    (folder / "one.scenario.json").write_text(json.dumps(data), encoding="utf-8")
    given = ("--warm-up", "1min", "--interval", "1min", "--out", folder, "--workspace", workspace)
    found = odscen("run", folder / "one.scenario.json", *given)
    assert found.code == 0, found.err
    return folder / "one"


@pytest.mark.slow
def test_a_report_has_a_row_for_each_interval_after_the_warm_up(ran: Path, workspace: Path) -> None:
    told = odscen("report", ran, "--workspace", workspace, "--json").json
    rows = told["network"]
    assert [(row["begin"], row["end"]) for row in rows] == [(60, 120), (120, 180), (180, 240)]


@pytest.mark.slow
def test_a_finished_run_can_be_asked_for_other_intervals(
    ran: Path, workspace: Path, tmp_path: Path
) -> None:
    shutil.copytree(ran, tmp_path / "one")
    asked = ("--warm-up", "0", "--interval", "2min", "--workspace", workspace, "--json")
    told = odscen("report", tmp_path / "one", *asked).json
    rows = told["network"]
    assert [(row["begin"], row["end"]) for row in rows] == [(0, 120), (120, 240)]
    refused = odscen("report", tmp_path / "one", "--interval", "7", "--workspace", workspace)
    assert refused.code == 2
    assert "multiple" in refused.err


@pytest.mark.slow
def test_seeds_are_added_until_the_interval_is_narrow_or_the_most_are_run(
    ran: Path, workspace: Path, tmp_path: Path
) -> None:
    file = ran.parent / "one.scenario.json"
    usual = ("--out", tmp_path, "--workspace", workspace, "--json")
    wide = odscen("run", file, "--until-confident", "60 %", "--until", "120", *usual)
    (found,) = wide.json["confidence"]
    assert wide.code == 0, wide.err
    assert found["seeds"] == 5
    assert found["half_width"] <= 0.6 * found["mean"]
    few = ("--most-seeds", "6", "--until", "120", "--overwrite")
    narrow = odscen("run", file, "--until-confident", "5 %", *few, *usual)
    (found,) = narrow.json["confidence"]
    assert narrow.code == 1
    assert found["seeds"] == 6
    assert found["needed"] > 6
