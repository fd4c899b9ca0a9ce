from __future__ import annotations

from pathlib import Path

import pytest

from odscen.maps.store import Workspace
from odscen.simulators.assets import shipped_assets
from tests.carla.conftest import MAPS
from tests.carla_standin.process import StandIn
from tests.cli.conftest import odscen

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")


@pytest.mark.slow
def test_the_models_of_a_server_take_the_place_of_those_shipped(tmp_path: Path) -> None:
    shipped = shipped_assets().blueprints
    with StandIn(MAPS / "roundabout.xodr") as server:
        before = server.actors()
        where = ("--carla", f"127.0.0.1:{server.port}", "--workspace", tmp_path, "--json")
        told = odscen("assets", "update", *where)
        assert told.code == 0
        assert [a["id"] for a in server.actors()] == [a["id"] for a in before]
    assert told.json["models"] > 90
    assert told.json["resized"] == []
    fetched = Workspace.open(tmp_path).assets().blueprints
    assert shipped.keys() - fetched.keys() == set(told.json["gone"])
    for name in fetched.keys() & shipped.keys():
        assert fetched[name].category == shipped[name].category
        assert fetched[name].body == pytest.approx(shipped[name].body, abs=1e-3)
    listed = odscen("assets", "list", "--workspace", tmp_path, "--json").json["blueprints"]
    assert {row["dimensions_source"] for row in listed} == {"server"}


def test_a_broken_file_of_models_is_named(tmp_path: Path) -> None:
    folder = tmp_path / "assets"
    folder.mkdir()
    (folder / "blueprints.json").write_text('{"blueprints": [{"id": 3}]}')
    answer = odscen("assets", "list", "--workspace", tmp_path, "--json")
    assert answer.code == 2
    assert "blueprints.json: not a catalogue of models" in answer.json["error"]["message"]
