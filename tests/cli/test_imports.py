"""``odscen import`` on the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tests.app.test_imported_sweeps import between, of, varied
from tests.app.test_scenario_imports import FILE, SPEED, given
from tests.cli.conftest import odscen

if TYPE_CHECKING:
    from pathlib import Path


def test_a_distribution_gives_a_scenario_and_the_plan_that_sweeps_it(tmp_path: Path) -> None:
    file = varied(tmp_path, f"<Deterministic>{of('kph', between(20, 60, 20))}</Deterministic>")
    out, place = tmp_path / "all.scenario.json", ("--workspace", tmp_path / "workspace")
    found = odscen("import", file, "--out", out, *place, "--json")
    assert found.code == 0, found.err
    assert (found.json["file"], found.json["refused"]) == (str(out), [])
    plan = found.json["sweep"]
    assert plan == str(tmp_path / "all.sweep.json")
    listed = odscen("sweep", out, "--plan", plan, "--dry-run", "--json")
    assert listed.json["cases"] == [{"kph": value} for value in (20.0, 40.0, 60.0)]
    words = odscen("import", file, "--out", out, *place).err
    assert f"odscen sweep {out} --plan {plan}" in words.replace("\n", "")


def test_a_file_without_a_map_has_its_report_as_data_and_ends_with_2(tmp_path: Path) -> None:
    text = FILE.replace("ACTION", SPEED).replace('<LogicFile filepath="road.xodr"/>', "")
    file, out = given(tmp_path, text), tmp_path / "out.scenario.json"
    place = ("--workspace", tmp_path / "workspace")
    found = odscen("import", file, "--out", out, *place, "--json")
    assert found.code == 2
    assert "--map" in found.json["error"]["message"]
    assert len(found.json["taken"]) > 20
    reasons = {row["reason"] for row in found.json["refused"]}
    assert "its map is missing: no place can be found" in reasons
