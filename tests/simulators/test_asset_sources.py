"""An asset source from outside: its model and its weather in lists, on the page and in a run."""

from __future__ import annotations

import doctest
import json
import logging
import sys
from pathlib import Path

import pytest
from starlette.testclient import TestClient

import odscen
from odscen.app.scenarios import read_scenario, write_scenario
from odscen.base.categories import Body
from odscen.base.errors import WorkspaceError
from odscen.carla.server.server_models import ServerModels
from odscen.cli import main
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.simulators import assets
from odscen.simulators.assets import AssetSource, FetchedModels, ShippedCatalogue, installed_assets
from odscen.web.application import create_app
from tests.app.conftest import sampled, workspace
from tests.installed_packages import install, install_shown

__all__ = ["sampled", "workspace"]

MODEL, PRESET = "harbour.cargo_bike", "SeaFog"


@pytest.fixture
def harbour(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The source of the document, which is installed."""
    monkeypatch.setattr(assets, "installed_assets", installed_assets.__wrapped__)
    heading = "## Models and weather of your own"
    install_shown("assets.md", heading, tmp_path / "site", monkeypatch)


@pytest.mark.usefixtures("harbour")
def test_the_list_has_what_ships_and_what_packages_add(
    workspace: Workspace, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ["odscen", "assets", "list", "--workspace", str(workspace.root), "--json"]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    listed = json.loads(capsys.readouterr().out)
    models = {row["id"]: row for row in listed["blueprints"]}
    assert models[MODEL]["body"] == {"length": 2.6, "width": 0.9, "height": 1.8}
    assert len(models) == len(assets.shipped_assets().blueprints) + 1
    assert PRESET in {row["name"] for row in listed["weather"]}


@pytest.mark.usefixtures("harbour")
def test_the_page_offers_them(workspace: Workspace) -> None:
    with TestClient(create_app(workspace), base_url="http://127.0.0.1") as client:
        offered = json.dumps(client.get("/api/assets").json())
    assert MODEL in offered
    assert PRESET in offered


@pytest.mark.slow
@pytest.mark.usefixtures("harbour")
def test_a_scenario_with_both_runs(workspace: Workspace, sampled: Path, tmp_path: Path) -> None:
    scenario = read_scenario(sampled)
    index, cyclist = next(
        (k, one) for k, one in enumerate(scenario.actors) if one.category == "bicycle"
    )
    actors = list(scenario.actors)
    actors[index] = cyclist.model_copy(update={"model": MODEL})
    sky = scenario.environment.model_copy(update={"preset": PRESET})
    changed = scenario.model_copy(update={"actors": tuple(actors), "environment": sky})
    file = write_scenario(changed, tmp_path / "harbour.scenario.json")
    run = odscen.run(workspace, file, settings=RunSettings(until=20.0), out=tmp_path / "runs")
    assert run.status == "completed"
    plan = json.loads((run.folder / "plan.json").read_text())
    row = next(one for one in plan["actors"] if one["id"] == cyclist.id)
    assert (row["model"], row["length"], row["width"]) == (MODEL, 2.6, 0.9)


def test_a_package_that_breaks_is_left_out_and_the_log_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    entries = {"odscen.asset_sources": {"broken": "broken_assets:Mine"}}
    code = "class Mine:\n    def models(self):\n        raise OSError('no disk')\n"
    install(tmp_path, monkeypatch, code=code, entry_points=entries)
    with caplog.at_level(logging.WARNING):
        found = installed_assets.__wrapped__()
    assert not found.blueprints
    assert "broken_assets:Mine are left out: OSError('no disk')" in caplog.text


def test_what_ships_what_was_fetched_and_a_carla_server_are_sources_alike(tmp_path: Path) -> None:
    for source in (ShippedCatalogue, FetchedModels, ServerModels):
        assert issubclass(source, AssetSource)
    file = tmp_path / "blueprints.json"
    row = assets.blueprint_row(next(iter(assets.shipped_assets().blueprints.values())))
    file.write_text(json.dumps({"blueprints": [row]}))
    (model,) = FetchedModels(file).models()
    assert assets.blueprint_row(model) == row


@pytest.mark.parametrize(
    ("field", "value"),
    [("id", []), ("id", 7), ("category", "horse"), ("length", "4.5"), ("width", True), ("age", {})],
)
def test_a_row_of_another_kind_is_refused_with_its_field_or_value(
    tmp_path: Path, field: str, value: object
) -> None:
    row = assets.blueprint_row(next(iter(assets.shipped_assets().blueprints.values())))
    file = tmp_path / "blueprints.json"
    file.write_text(json.dumps({"blueprints": [row | {field: value}]}))
    with pytest.raises(WorkspaceError, match=f"{field} cannot be|'horse'"):
        FetchedModels(file).models()


@pytest.mark.parametrize("rows", [["mini"], [None], [7], "mini", {"id": "mini"}, [["id", "mini"]]])
def test_rows_that_are_none_are_refused(tmp_path: Path, rows: object) -> None:
    file = tmp_path / "blueprints.json"
    file.write_text(json.dumps({"blueprints": rows}))
    with pytest.raises(WorkspaceError, match="not a catalogue of models"):
        FetchedModels(file).models()


def test_the_example_of_the_seam_runs() -> None:
    (example,) = doctest.DocTestFinder(recurse=False).find(
        AssetSource, "AssetSource", globs={**vars(assets), "Body": Body}
    )
    found = doctest.DocTestRunner().run(example)
    assert (found.attempted, found.failed) == (2, 0)
