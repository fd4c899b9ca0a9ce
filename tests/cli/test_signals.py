"""``odscen signals`` on the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.scenario_document import MapReference
from tests.cli.conftest import odscen
from tests.signal_case import MAP, one_plan, scenario

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario


@pytest.mark.slow
def test_a_program_is_shown_exported_and_imported_again(tmp_path: Path) -> None:
    space = tmp_path / "space"
    entry = Workspace.open(space).add_map(MAP)
    reference = MapReference(name=entry.name, sha256=entry.info["sha256"])
    file, signals = tmp_path / "one.scenario.json", tmp_path / "signals.add.xml"
    own = scenario(one_plan(offset=12)).model_copy(update={"map": reference})
    file.write_text(dumps(own))
    shown = odscen("signals", "show", file, "--workspace", space, "--json").json
    (light,) = shown["lights"]
    assert [group["id"] for group in light["groups"]][:2] == ["V1", "V1L"]
    assert light["plans"][0]["offset"] == 12.0
    assert "pedestrian clearance" in odscen("signals", "show", file, "--workspace", space).out
    odscen("signals", "export", file, "-o", signals, "--workspace", space)
    assert "<tlLogic" in signals.read_text()
    back = tmp_path / "back.scenario.json"
    told = odscen(
        "signals", "import", file, signals, "-o", back, "--workspace", space, "--json"
    ).json
    assert told == {"scenario": str(back), "notes": []}
    assert '"id": "V1L"' in back.read_text()
    wrong = odscen("signals", "import", file, file, "--workspace", space, "--json")
    assert wrong.code != 0
    assert "not well-formed XML" in wrong.json["error"]["message"]


def placed(space: Path, one: Scenario, name: str, file: Path) -> Path:
    sha256 = Workspace.open(space).map(name).info["sha256"]
    reference = MapReference(name=name, sha256=sha256)
    file.write_text(dumps(one.model_copy(update={"map": reference})))
    return file


@pytest.mark.slow
def test_lights_are_timed_after_the_demand(workspace: Path, tmp_path: Path) -> None:
    file = placed(workspace, scenario(None), "signal_crossing", tmp_path / "one.scenario.json")
    out = tmp_path / "timed.scenario.json"
    timing = ("signals", "webster", file, "-o", out, "--workspace", workspace)
    told = odscen(*timing, "--seeds", "1,2", "--json").json
    assert told["evaluation"]["seeds"] == [1, 2]
    assert told["evaluation"]["verdict"] in ("better", "unclear")
    (light,) = told["lights"]
    assert told["scenario"] == str(out)
    assert light["junctions"] == ["10001"]
    assert {"volume", "flow_ratio", "v_c"} <= light["lanes"][0].keys()
    shown = odscen("signals", "show", out, "--workspace", workspace, "--json").json
    seconds = [one["seconds"] if isinstance(one, dict) else one[0]
               for one in shown["lights"][0]["plans"][0]["phases"]]  # fmt: skip
    assert sum(seconds) == light["cycle"]
    table = odscen(*timing, "--no-trial").out
    assert "flow ratio" in table
    assert "v/c" in table
    few = odscen(
        "signals",
        "webster",
        file,
        "--no-trial",
        "--turn-arrows",
        "-o",
        out,
        "--workspace",
        workspace,
        "--json",
    )
    assert few.json["arrows"] == []
    busy = placed(
        workspace, scenario(None, vehicles=900.0), "signal_crossing", tmp_path / "two.scenario.json"
    )
    told = odscen(
        "signals", "webster", busy, "--no-trial", "--turn-arrows", "-o", out,
        "--workspace", workspace,
    )  # fmt: skip
    assert "the left turn from r1 has got an arrow" in told.err
    wrong = odscen("signals", "webster", file, "--end", 9000, "--workspace", workspace, "--json")
    assert wrong.code != 0
    assert "which lasts 600 s" in wrong.json["error"]["message"]


@pytest.mark.slow
def test_a_corridor_without_two_lights_is_refused(workspace: Path, tmp_path: Path) -> None:
    file = placed(workspace, scenario(None), "signal_crossing", tmp_path / "one.scenario.json")
    command = ("signals", "coordinate", file, "--workspace", workspace, "--json")
    for options, message in (
        (("--along", "r1"), "a corridor needs two traffic lights, but r1 has 1"),
        (("--junctions", "10001"), "a corridor needs two traffic lights, but 10001 has 1"),
        (("--along", "Nowhere"), "Nowhere"),
        ((), "name either the junctions"),
    ):
        wrong = odscen(*command, *options)
        assert wrong.code != 0
        assert message in wrong.json["error"]["message"]


@pytest.mark.slow
def test_programs_are_drawn_into_a_file_or_a_folder(workspace: Path, tmp_path: Path) -> None:
    one = scenario(one_plan(offset=12))
    file = placed(workspace, one, "signal_crossing", tmp_path / "one.scenario.json")
    sheet, folder = tmp_path / "light.svg", tmp_path / "sheets"
    show = ("signals", "show", file, "--workspace", workspace)
    told = odscen(*show, "--json", "--svg", sheet).json
    assert told["svg"] == [str(sheet)]
    assert len(told["lights"]) == 1
    assert "cycle 84 s, offset 12 s" in sheet.read_text(encoding="utf-8").lower()
    assert odscen(*show, "--svg", folder, "--junction", "10001").code == 0
    assert [path.name for path in folder.iterdir()] == ["10001.svg"]
    assert (folder / "10001.svg").read_text(encoding="utf-8") == sheet.read_text(encoding="utf-8")
    wrong = odscen(*show, "--json", "--svg", tmp_path / "no.svg", "--junction", "77")
    assert wrong.code != 0
    assert "10001" in wrong.json["error"]["message"]
    assert not (tmp_path / "no.svg").exists()


@pytest.mark.slow
def test_a_program_that_makes_it_worse_is_not_written_unless_one_says_so(
    workspace: Path, tmp_path: Path
) -> None:
    """A cycle of two minutes for a street with little traffic."""
    file = placed(
        workspace, scenario(None, walkers=0.0), "signal_crossing", tmp_path / "one.scenario.json"
    )
    out = tmp_path / "slow.scenario.json"
    slow = ("signals", "webster", file, "-o", out, "--shortest", 120, "--seeds", "1,2,3",
            "--workspace", workspace)  # fmt: skip
    refused = odscen(*slow, "--json")
    assert refused.code == 2
    assert "worse than today. Nothing was written" in refused.json["error"]["message"]
    assert not out.exists()
    assert odscen(*slow, "--anyway").code == 0
    told = odscen(
        "signals", "evaluate", out, "--seeds", "1,2,3", "--workspace", workspace, "--json"
    ).json
    assert told["verdict"] == "worse"
    assert told["figures"]["mean_delay"]["low"] > 0.0
