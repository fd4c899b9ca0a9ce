from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from odscen.app.removal import RemovalFacts, removal_facts, remove, removed_map
from odscen.app.running.runs import carry_out, check_file, prepare_run, run
from odscen.app.scenarios import read_scenario
from odscen.base.errors import ConflictError, NotFoundError
from odscen.base.folder_locks import locked
from odscen.maps.store import Workspace
from odscen.maps.wastebasket import Wastebasket
from odscen.runs.reporter import Reporter
from odscen.runs.run_settings import RunSettings

SHORT = RunSettings(until=5.0)
STATUS = {"format": "odscen-status", "version": 1, "scenario": "s", "time": 0, "until": 9}


@pytest.fixture
def own(workspace: Workspace, tmp_path: Path) -> Workspace:
    """A workspace with the maps of all tests, without the scenarios and runs that others made."""
    root = tmp_path / "own"
    shutil.copytree(workspace.root, root, ignore=shutil.ignore_patterns("scenarios", "runs"))
    own = Workspace.open(root)
    own.scenarios.mkdir(exist_ok=True)
    return own


def long_run(workspace: Workspace, name: str, *, about: dict[str, str]) -> Path:
    """Write the folder of a run in slices that has not ended."""
    folder = workspace.runs / name
    folder.mkdir(parents=True)
    (folder / "status.json").write_text(json.dumps(STATUS))
    (folder / "run.json").write_text(json.dumps({"about": about}))
    return folder


def test_removing_a_map_says_what_was_made_on_it_by_name_or_by_content(
    own: Workspace, sampled: Path
) -> None:
    scenario = read_scenario(sampled)
    name, sha256 = scenario.map.name, scenario.map.sha256
    shutil.copy(sampled, own.scenarios / "one.scenario.json")
    (own.scenarios / "broken.scenario.json").write_text('{"map": [')
    (own.scenarios / "odd.scenario.json").write_text('{"map": {"name": [], "sha256": {}}}')
    (own.scenarios / "other.scenario.json").write_text('{"map": {"name": "other"}}')
    (own.scenarios / "late.scenario.json").write_text(
        json.dumps({"description": "x" * 100_000, "map": {"name": name}})
    )
    live = long_run(own, "one-1", about={"map": "a former name", "map_sha256": sha256})
    long_run(own, "one-2", about={"map": name})
    long_run(own, "other-1", about={"map": "other"})
    with locked(live, what="run"):
        found = removal_facts(own, "map", name)
        assert found == RemovalFacts("map", name, scenarios=2, runs=2, live=1)
        assert removal_facts(own, "scenario", "one").live == 1
        with pytest.raises(ConflictError, match="running in another process"):
            remove(own, "run", "one-1")
    assert removal_facts(own, "scenario", "one") == RemovalFacts("scenario", "one", 0, 2, 0)
    for kind, unknown in (("map", "x"), ("scenario", "x"), ("run", "x")):
        with pytest.raises(NotFoundError):
            removal_facts(own, kind, unknown)  # type: ignore[arg-type]


def test_a_damaged_map_can_be_removed(own: Workspace, sampled: Path) -> None:
    name = read_scenario(sampled).map.name
    (own.root / "maps" / name / "map.json").write_text('{"sha256": [1')
    assert removal_facts(own, "map", name).kind == "map"
    item = remove(own, "map", name)
    assert name not in own.map_names()
    assert removed_map(own, "") is None
    Wastebasket(own).restore(item.id)
    assert name in own.map_names()


@pytest.mark.slow
def test_a_run_whose_map_is_removed_while_it_goes_on_ends_with_its_report(
    own: Workspace, sampled: Path, tmp_path: Path
) -> None:
    kept = run(own, sampled, settings=SHORT, out=tmp_path / "kept").folder
    checked = check_file(own, sampled, out=tmp_path / "removed", settings=SHORT)
    prepared = prepare_run(checked)
    name, sha256 = checked.scenario.map.name, checked.scenario.map.sha256

    class TakeMapAway(Reporter):
        def started(self) -> None:
            remove(own, "map", name)

    done = carry_out(checked, prepared, reporter=TakeMapAway())
    assert done.status == "completed"
    assert name not in own.map_names()
    assert (done.folder / "actors.json").read_bytes() == (kept / "actors.json").read_bytes()
    assert "<svg" in (done.folder / "report.html").read_text(encoding="utf-8")
    found = removed_map(own, sha256)
    assert found is not None
    assert found.path("net").is_file()
