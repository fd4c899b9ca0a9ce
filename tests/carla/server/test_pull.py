from __future__ import annotations

from pathlib import Path

import pytest

from tests.carla.conftest import MAPS
from tests.carla_standin.process import StandIn
from tests.cli.conftest import odscen

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")


@pytest.mark.slow
def test_maps_of_a_server_come_into_the_catalogue_and_it_shows_its_own_again(
    tmp_path: Path,
) -> None:
    others = {"T": MAPS / "t_junction_signs.xodr"}
    with StandIn(MAPS / "roundabout.xodr", map_name="Round", other_maps=others) as server:
        where = ("--carla", f"127.0.0.1:{server.port}", "--workspace", tmp_path, "--json")
        shown = odscen("maps", "pull", *where)
        assert [row["name"] for row in shown.json["maps"]] == ["Round"]
        named = odscen("maps", "pull", "T", *where)
        assert named.json["maps"][0]["nodes"] > 0
        unknown = odscen("maps", "pull", "U", *where)
        assert unknown.code == 2
        assert "no map of the server named 'U'" in unknown.json["error"]["message"]
        client = carla.Client(server.host, server.port)
        assert client.get_world().get_map().name.endswith("Round")
    assert {m["name"] for m in odscen("maps", "list", *where[2:]).json["maps"]} == {"Round", "T"}
