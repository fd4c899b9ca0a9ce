from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from tests.cli.conftest import SHIPPED, odscen

if TYPE_CHECKING:
    from pathlib import Path

CROSSING = SHIPPED / "signal_crossing.xodr"


def narrowed(folder: Path) -> Path:
    file = folder / "narrowed.xodr"
    file.write_text(CROSSING.read_text().replace('<width a="3.25"', '<width a="2.4"', 1))
    return file


@pytest.mark.slow
def test_a_narrowed_lane_is_named_in_words_and_json_and_drawn(tmp_path: Path) -> None:
    after, svg = narrowed(tmp_path), tmp_path / "out" / "diff.svg"
    done = odscen("maps", "diff", CROSSING, after, "--svg", svg, "--exit-code")
    assert done.code == 1
    (line,) = done.out.splitlines()
    assert line.startswith("width of lane ")
    assert line.endswith(": 3.25 m -> 2.4 m")
    assert "Changed (1)" in svg.read_text()
    found = odscen("maps", "diff", CROSSING, after, "--json").json
    assert [one["what"] for one in found["changes"]] == ["width"]
    assert found["changes"][0]["words"] == line


@pytest.mark.slow
def test_a_map_of_the_workspace_is_compared_with_a_file(workspace: Path) -> None:
    call = ("maps", "diff", "signal_crossing", CROSSING, "--exit-code", "--workspace", workspace)
    assert odscen(*call).code == 0
    missing = odscen("maps", "diff", "nowhere", CROSSING, "--workspace", workspace)
    assert missing.code == 2
    assert "nowhere" in missing.err


@pytest.mark.slow
def test_two_scenarios_are_compared_field_by_field(tmp_path: Path) -> None:
    before = SHIPPED.parent / "suites" / "scenarios" / "signal_crossing.scenario.json"
    after = tmp_path / "after.scenario.json"
    after.write_text(before.read_text().replace('"step_length": 0.5', '"step_length": 0.4'))
    done = odscen("diff", before, after, "--exit-code")
    assert done.code == 1
    assert done.out == "simulation, step length: 0.5 -> 0.4\n"
    assert odscen("diff", before, before, "--exit-code").code == 0
    folder = odscen("diff", before, tmp_path)
    assert folder.code == 2
    assert "this is a folder, not a scenario" in folder.err
