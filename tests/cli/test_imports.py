"""``odscen import`` on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

from odscen.base.given_arrays import npz_bytes
from odscen.learning.hetero_data import read_arrays
from tests.app.test_imported_sweeps import between, of, varied
from tests.app.test_scenario_imports import FILE, SPEED, given
from tests.cli.conftest import odscen


@pytest.mark.slow
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


@pytest.mark.slow
def test_arrays_are_exported_changed_and_imported(workspace: Path, tmp_path: Path) -> None:
    place = ("--workspace", workspace)
    (row,) = odscen("generate", "--map", "signal_crossing", "--fill", "0.2", *place, "--json").json[
        "scenarios"
    ]
    exported = odscen("export", row["file"], "--to", "arrays", "-o", tmp_path, *place, "--json")
    (file,) = exported.json["files"]
    out = tmp_path / "back.scenario.json"
    found = odscen("import", file, "--out", out, *place, "--json")
    assert (found.code, found.json) == (0, {"file": str(out), "problems": []})
    assert out.read_bytes() == Path(row["file"]).read_bytes()

    arrays = read_arrays(Path(file))
    arrays["actor_node"][1] = arrays["actor_node"][0]
    (tmp_path / "changed.npz").write_bytes(npz_bytes(arrays))
    found = odscen("import", tmp_path / "changed.npz", "--out", out, *place, "--json")
    assert [one["code"] for one in found.json["problems"]] == ["node_taken"]
    assert odscen("check", tmp_path / "changed.npz", *place).code == 2
    arrays["actor_speed"][1] = 1e6
    (tmp_path / "changed.npz").write_bytes(npz_bytes(arrays))
    found = odscen("import", tmp_path / "changed.npz", "--out", out, *place)
    assert found.code == 2
    assert "array actor_speed, row 1" in found.err
    assert odscen("import", file, "--map", "x", "--out", out, *place).code == 2
