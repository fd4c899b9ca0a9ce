"""``odscen signals`` on the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.scenario_document import MapReference
from odscen.workspace.store import Workspace
from tests.cli.conftest import odscen
from tests.signal_case import MAP, one_plan, scenario

if TYPE_CHECKING:
    from pathlib import Path


def test_a_program_is_shown_exported_and_imported_again(tmp_path: Path) -> None:
    space = tmp_path / "space"
    entry = Workspace.open(space).add_map(MAP)
    reference = MapReference(name=entry.name, sha256=entry.info["sha256"])
    file, signals = tmp_path / "one.scenario.json", tmp_path / "signals.add.xml"
    own = scenario(one_plan(offset=12)).model_copy(update={"map": reference})
    file.write_text(dumps(own))
    shown = odscen("signals", "show", file, "--workspace", space, "--json").json
    (light,) = shown["lights"]
    assert [group["id"] for group in light["groups"]][:2] == ["K1", "K1L"]
    assert light["plans"][0]["offset"] == 12.0
    assert "pedestrian clearance" in odscen("signals", "show", file, "--workspace", space).out
    odscen("signals", "export", file, "-o", signals, "--workspace", space)
    assert "<tlLogic" in signals.read_text()
    back = tmp_path / "back.scenario.json"
    told = odscen(
        "signals", "import", file, signals, "-o", back, "--workspace", space, "--json"
    ).json
    assert told == {"scenario": str(back), "notes": []}
    assert '"id": "K1L"' in back.read_text()
    wrong = odscen("signals", "import", file, file, "--workspace", space, "--json")
    assert wrong.code != 0
    assert "not XML" in wrong.json["error"]["message"]
