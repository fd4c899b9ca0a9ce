"""``odscen new``."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from odscen.scenario.templates.template_registry import TEMPLATES
from tests.cli.conftest import odscen


@pytest.mark.slow
def test_without_a_name_all_templates_are_listed_with_their_numbers() -> None:
    for arguments in (("new",), ("new", "--template"), ("new", "--template", "--json")):
        done = odscen(*arguments)
        assert done.code == 0, done.err
        for name in TEMPLATES:
            assert f"{name}: " in done.err
    listed = {one["name"]: one for one in done.json["templates"]}
    assert list(listed) == list(TEMPLATES)
    ttc = next(one for one in listed["cut-in"]["parameters"] if one["name"] == "ttc")
    assert (ttc["default"], ttc["unit"]) == (None, "s")
    assert "UN Regulation No. 157" in listed["cut-in"]["source"]


@pytest.mark.slow
def test_a_template_is_placed_checked_and_run(workspace: Path, tmp_path: Path) -> None:
    options = ("--map", "signal_crossing", "--out", tmp_path, "--workspace", workspace)
    done = odscen("new", "--template", "mid-block", *options, "--set", "ego_speed=8", "--json")
    assert done.code == 0, done.err
    file = Path(done.json["file"])
    ego = json.loads(file.read_text())["actors"][0]
    assert (ego["ego"], ego["speed"]) == (True, 8.0)
    assert odscen("check", file, "--json", "--workspace", workspace).json["problems"] == []
    run = odscen("run", file, "--out", tmp_path / "runs", "--json", "--workspace", workspace)
    assert run.json["status"] == "completed"


@pytest.mark.slow
def test_what_cannot_be_placed_ends_with_the_reason_and_no_file(
    workspace: Path, tmp_path: Path
) -> None:
    options = ("--out", tmp_path, "--workspace", workspace)
    for arguments, message in (
        (("cut-in", "--map", "signal_crossing"), "has no room for a cut-in: of "),
        (("cut-in",), "name the map to place it on with --map"),
        (("cut-in", "--map", "signal_crossing", "--set", "over=much"), "--set wants NAME=NUMBER"),
        (("cutin", "--map", "signal_crossing"), "did you mean cut-in"),
    ):
        done = odscen("new", "--template", *arguments, *options)
        assert (done.code, message in done.err) == (2, True), done.err
    assert list(tmp_path.iterdir()) == []
