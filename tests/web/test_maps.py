from __future__ import annotations

import gzip
import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from starlette.testclient import TestClient

from odscen.app.removal import remove
from odscen.lanegraph.query import node_ids
from odscen.maps.store import Workspace
from odscen.web.application import create_app
from odscen.web.wire.map_messages import MapNames
from tests import own_importer
from tests.opendrive.snippets import document, lane, road, section
from tests.own_importer import PLACE
from tests.web.conftest import CROSSING, SHIPPED, job, wait_for

_ENTITIES = "".join(f'<!ENTITY b{i} "{f"&b{i - 1};" * 10}">' for i in range(1, 10))
BOMB = f'<!DOCTYPE a [<!ENTITY b0 "boom">{_ENTITIES}]><OpenDRIVE>&b9;</OpenDRIVE>'


def upload(client: TestClient, content: bytes, file: str = "m.xodr", **form: str) -> object:
    return client.post("/api/maps", files={"file": (file, content)}, data=form)


@pytest.mark.slow
def test_the_server_says_that_it_is_there_and_how_the_page_is_built(client: TestClient) -> None:
    assert client.get("/api/health").json()["version"]
    page = client.get("/")
    assert page.status_code == 200
    assert "npm run build" in page.text or '<div id="root">' in page.text


def test_a_built_page_is_served_for_its_own_addresses_and_not_for_missing_files(
    workspace: Workspace, tmp_path: Path
) -> None:
    (tmp_path / "static").mkdir()
    (tmp_path / "static" / "index.html").write_text("<title>the page</title>")
    (tmp_path / "static" / "a.js").write_text("1")
    with TestClient(
        create_app(workspace, static=tmp_path / "static"), base_url="http://localhost"
    ) as client:
        assert "the page" in client.get("/").text
        assert "the page" in client.get("/runs/7").text
        assert client.get("/a.js").text == "1"
        assert client.get("/b.js").status_code == 404
        assert client.get("/api/nothing").json()["error"]["kind"] == "NotFound"
        assert client.get("/..%2f..%2fmap.json").status_code == 404


def test_what_the_build_has_packed_goes_to_browsers_that_take_it(
    workspace: Workspace, tmp_path: Path
) -> None:
    for name, content in {"index.html": "<title>", "a.js": "1", "a.js.br": "packed"}.items():
        (tmp_path / name).write_text(content)

    with TestClient(create_app(workspace, static=tmp_path), base_url="http://localhost") as client:
        packed = client.head("/a.js", headers={"accept-encoding": "gzip, br;q=0.9"}).headers
        assert packed["content-encoding"] == "br"
        assert packed["content-type"].startswith("text/javascript")
        assert packed["content-length"] == str(len("packed"))
        assert "Accept-Encoding" in packed["vary"]
        assert client.get("/a.js", headers={"accept-encoding": "gzip"}).text == "1"
        assert client.get("/", headers={"accept-encoding": "br"}).text == "<title>"


def test_maps_are_listed_with_what_the_catalogue_knows(
    client: TestClient, workspace: Workspace
) -> None:
    (row,) = client.get("/api/maps").json()
    info = workspace.map(CROSSING).info
    assert row["name"] == CROSSING
    assert row["statistics"] == json.loads(json.dumps(info["statistics"]))
    assert row["report_counts"] == info["report"]["counts"]
    assert client.get(row["preview"]).headers["content-type"] == "image/svg+xml"
    unknown = {"confidence": None, "source_id": None}  # only importers of other formats say it
    entries = [{**entry, **unknown} for entry in info["report"]["entries"]]
    sent = client.get(f"/api/maps/{CROSSING}/report").json()
    assert sent == {**info["report"], "entries": entries}
    assert client.get(f"/api/maps/{CROSSING}/drawing").content == (
        workspace.map(CROSSING).path("drawing").read_bytes()
    )


def test_a_map_tells_its_lights_as_the_live_view_names_them(client: TestClient) -> None:
    (light,) = client.get(f"/api/maps/{CROSSING}").json()["lights"]
    assert light["names"] == ["10001"]
    assert len(light["green"]) > 1
    assert [name for names in light["signals"] for name in names]


def test_names_of_places_come_in_parts_that_any_language_can_put_together(
    client: TestClient,
) -> None:
    answer = client.get(f"/api/maps/{CROSSING}/names")
    names = MapNames.model_validate_json(answer.content, extra="forbid")
    (junction,) = names.junctions
    assert (junction.id, junction.which) == ("j10001", "")
    assert junction.streets == ["East Street", "North Street"]
    assert sorted(leg.side for leg in junction.legs) == ["east", "north", "south", "west"]
    west = next(leg.segment for leg in junction.legs if leg.side == "west")
    road = next(road for road in names.roads if road.id == west)
    assert (road.street, road.side) == ("West Street", "west")
    assert [(end.junction, end.street) for end in road.ends] == [("j10001", "")]
    again = {"if-none-match": answer.headers["etag"]}
    assert client.get(f"/api/maps/{CROSSING}/names", headers=again).status_code == 304
    assert client.get("/api/maps/nowhere/names").status_code == 404


@pytest.mark.slow
def test_heights_are_those_of_the_nodes_and_none_of_a_flat_map(
    client: TestClient, workspace: Workspace
) -> None:
    assert client.get(f"/api/maps/{CROSSING}/heights").json() == {"z": [], "walks": []}
    workspace.add_map(SHIPPED / "rural_hills.xodr")
    columns = client.get("/api/maps/rural_hills/heights").json()
    graph = workspace.map("rural_hills").graph()
    assert np.ptp(graph.lanes.z) > 5
    assert np.allclose(columns["z"], graph.lanes.z, atol=1e-3)
    assert np.allclose(columns["walks"], graph.walks.z, atol=1e-3)


def test_graph_columns_are_the_graph(client: TestClient, workspace: Workspace) -> None:
    answer = client.get(f"/api/maps/{CROSSING}/graph")
    columns, graph = answer.json(), workspace.map(CROSSING).graph()
    names = [
        f"{columns['lane_keys'][lane]}.{i - columns['first_node'][lane]}"
        for i, lane in enumerate(columns["lane"])
    ]
    assert names == node_ids(graph)
    assert np.allclose(columns["x"], graph.lanes.x, atol=1e-3)
    assert columns["edges"]["target"] == graph.lanes.target.tolist()
    assert columns["walks"]["source"] == graph.walks.source.tolist()
    by_id = {one["id"]: one for one in columns["segments"]}
    assert [columns["segments"][i]["id"] for i in by_id["j10001"]["neighbours"]] == [
        "r1", "r2", "r3", "r4",
    ]  # fmt: skip
    again = client.get(
        f"/api/maps/{CROSSING}/graph", headers={"If-None-Match": answer.headers["etag"]}
    )
    assert again.status_code == 304
    plain = client.get(f"/api/maps/{CROSSING}/graph", headers={"Accept-Encoding": "identity"})
    assert plain.json() == columns
    assert "content-encoding" not in plain.headers


@pytest.mark.slow
def test_a_map_is_added_in_the_background_and_removed(client: TestClient) -> None:
    content = (SHIPPED / "t_junction_signs.xodr").read_bytes()
    done = job(client, upload(client, content, "t junction.xodr"))
    assert (done["state"], done["result"], done["share"]) == ("done", "t_junction", 1.0)
    assert [row["name"] for row in client.get("/api/maps").json()] == [CROSSING, "t_junction"]
    same = upload(client, content, "x.xodr", name="t_junction")
    assert job(client, same)["state"] == "done"
    other = upload(client, (SHIPPED / f"{CROSSING}.xodr").read_bytes(), name="t_junction")
    assert other.status_code == 409
    assert client.delete("/api/maps/t_junction").json()["kind"] == "map"
    assert client.delete("/api/maps/t_junction").status_code == 404


def test_a_map_that_cannot_be_read_is_a_failed_job_that_names_the_place(
    client: TestClient,
) -> None:
    content = (
        b'<OpenDRIVE><header revMajor="1" revMinor="6"/><road id="1" length="-3"/></OpenDRIVE>'
    )
    failed = job(client, upload(client, content, "bad.xodr"))
    assert failed["state"] == "failed"
    assert failed["error"]["kind"] == "OpenDriveError"
    assert failed["error"]["message"].startswith("bad.xodr: road 1")


@pytest.mark.parametrize(
    "content",
    [
        BOMB.encode(),
        b'<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><OpenDRIVE>&x;</OpenDRIVE>',
        b"<OpenDRIVE>" + b"<a>" * 200_000,
        gzip.compress(b"<OpenDRIVE>" + b" " * 10_000_000),
        os.urandom(1000),
        b"",
    ],
    ids=["entity bomb", "external entity", "nesting", "zip bomb", "noise", "nothing"],
)
def test_a_malicious_file_is_refused_with_words_and_leaves_nothing(
    client: TestClient, workspace: Workspace, content: bytes
) -> None:
    failed = job(client, upload(client, content))
    assert failed["state"] == "failed"
    assert failed["error"]["kind"] == "OpenDriveError"
    assert "root:" not in failed["error"]["message"]
    assert sorted(path.name for path in (workspace.root / "maps").iterdir()) == [CROSSING]


def test_unknown_maps_and_jobs_are_not_found(client: TestClient) -> None:
    for path in ("", "/graph", "/drawing", "/report", "/preview.svg"):
        answer = client.get(f"/api/maps/nowhere{path}")
        assert answer.status_code == 404
        assert answer.json()["error"]["kind"] == "NotFoundError"
    assert client.get("/api/jobs/job-99").status_code == 404


def test_all_shipped_maps_can_be_added_at_once(client: TestClient) -> None:
    started = client.post("/api/maps/shipped")
    assert started.status_code == 202
    assert client.get(f"/api/jobs/{started.json()['job']}").json()["state"] in ("queued", "running")


def test_assets_list_seven_categories_models_and_weather(client: TestClient) -> None:
    assets = client.get("/api/assets").json()
    assert len(assets["categories"]) == 7
    assert {one["category"] for one in assets["blueprints"]} == {
        one["category"] for one in assets["categories"]
    }
    assert "ClearNoon" in [one["name"] for one in assets["weather"]]


@pytest.mark.slow
def test_a_map_can_be_added_with_a_network_by_netconvert(
    client: TestClient, workspace: Workspace
) -> None:
    content = (SHIPPED / "t_junction_signs.xodr").read_bytes()
    done = job(client, upload(client, content, "by_netconvert.xodr", converter="netconvert"))
    assert done["result"] == "by_netconvert"
    rows = {row["name"]: row["network"] for row in client.get("/api/maps").json()}
    assert rows["by_netconvert"] == {"converter": "netconvert", "source": None}
    assert rows[CROSSING] == {"converter": "odscen", "source": None}
    assert upload(client, content, "m.xodr", converter="file").status_code == 422
    remove(workspace, "map", "by_netconvert")


def motorway() -> bytes:
    """200 km of motorway in 10 kB, which take several seconds."""
    lanes = section(*(lane(-k) for k in (1, 2, 3)))
    line = '<geometry s="0" x="{}" y="0" hdg="0" length="10000"><line/></geometry>'
    roads = (
        road(str(k), length=10_000, plan=line.format(10_000 * k), lanes=lanes) for k in range(20)
    )
    return document(*roads).encode()


@pytest.mark.slow
def test_a_map_that_takes_long_does_not_delay_another_and_can_be_cancelled(
    client: TestClient, workspace: Workspace
) -> None:
    slow = upload(client, motorway(), "slow.xodr").json()["job"]
    again = upload(client, motorway(), "slow.xodr")
    assert (again.status_code, again.json()["error"]["kind"]) == (409, "ConflictError")
    assert "map 'slow' is being worked on" in again.json()["error"]["message"]
    small = (SHIPPED / "t_junction_signs.xodr").read_bytes()
    assert job(client, upload(client, small, "small.xodr"))["state"] == "done"
    assert client.get("/api/health").status_code == 200
    assert client.get(f"/api/jobs/{slow}").json()["state"] == "running"
    assert client.delete(f"/api/jobs/{slow}").status_code == 202
    wait_for(lambda: client.get(f"/api/jobs/{slow}").json()["state"] == "cancelled")
    assert client.delete(f"/api/jobs/{slow}").status_code == 409
    assert client.delete("/api/jobs/job-99").status_code == 404
    assert sorted(path.name for path in (workspace.root / "maps").iterdir()) == [CROSSING, "small"]


def test_the_end_of_the_server_ends_what_is_being_added(workspace: Workspace) -> None:
    with TestClient(create_app(workspace, hosts=None, token=None)) as client:
        for number in range(4):  # more than are built at once on a machine of two cores
            assert upload(client, motorway(), f"slow{number}.xodr").status_code == 202
    assert [path.name for path in (workspace.root / "maps").iterdir()] == [CROSSING]


@pytest.mark.slow
@pytest.mark.parametrize(
    "content", [b"[" * 100_000, b'{"name": ' + b"9" * 400 + b"}", b"<graphml>" + b"<a>" * 100_000]
)
def test_a_scenario_made_to_hurt_is_refused(client: TestClient, content: bytes) -> None:
    answer = client.post("/api/scenarios/upload", files={"file": ("bad.json", content)})
    assert (answer.status_code, answer.json()["error"]["kind"]) == (422, "ScenarioError")
    assert answer.json()["error"]["message"].startswith("bad.json: ")


def test_a_damaged_map_is_listed_as_broken_and_hides_no_other(
    client: TestClient, workspace: Workspace
) -> None:
    shutil.copytree(workspace.root / "maps" / CROSSING, workspace.root / "maps" / "torn")
    info = workspace.root / "maps" / "torn" / "map.json"
    whole = info.read_text(encoding="utf-8")
    for damaged in ("", whole[:300], "[]", "null", "{}", '{"builder": "6", "sha256": []}'):
        info.write_text(damaged, encoding="utf-8")
        assert [row["name"] for row in client.get("/api/maps").json()] == [CROSSING]
        (broken,) = client.get("/api/broken-maps").json()
        assert broken["name"] == "torn"
        assert broken["problem"]
    assert client.delete("/api/maps/torn").status_code == 200
    assert client.get("/api/broken-maps").json() == []


@pytest.mark.slow
def test_maps_of_an_older_odscen_are_listed_and_previewed_as_they_are_and_built_when_opened(
    tmp_path: Path,
) -> None:
    store = Workspace.open(tmp_path)
    about = store.add_map(SHIPPED / "t_junction_signs.xodr").folder / "map.json"
    (about.parent / "SHA256SUMS").unlink()
    older = json.loads(about.read_text()) | {"builder": "1"}
    about.write_text(json.dumps(older))
    with TestClient(create_app(store), base_url="http://localhost") as client:
        (row,) = client.get("/api/maps").json()
        assert row["name"] == "t_junction_signs"
        assert row["outdated"] is True
        assert client.get("/api/broken-maps").json() == []
        assert client.get(row["preview"]).status_code == 200
        assert json.loads(about.read_text())["builder"] == "1"
        assert client.get("/api/maps/t_junction_signs").json()["source"] == row["source"]
        assert json.loads(about.read_text())["builder"] != "1"
        del older["network"]  # as very old ones are
        (about.parent / "SHA256SUMS").unlink()
        about.write_text(json.dumps(older))
        assert client.get("/api/maps").json() == [row | {"outdated": False}]
        assert json.loads(about.read_text())["builder"] != "1"


@pytest.mark.slow
def test_a_map_of_another_format_is_taken_by_the_importer_of_an_installed_package(
    client: TestClient, workspace: Workspace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = tmp_path / "site"
    site.mkdir()
    own_importer.install(site, monkeypatch)
    formats = client.get("/api/map-importers").json()
    assert (formats[0]["name"], formats[0]["suffixes"]) == ("opendrive", [".xodr"])
    assert (formats[-1]["name"], formats[-1]["suffixes"]) == ("road", [".road"])
    assert formats[-1]["options"][0]["name"] == "lane_width"
    started = upload(client, PLACE, "My place.road", options='{"lane_width": 4}')
    assert job(client, started)["result"] == "My_place"  # type: ignore[arg-type]
    assert workspace.map("My_place").read("original") == PLACE
    row = next(row for row in client.get("/api/maps").json() if row["name"] == "My_place")
    assert (row["importer"], row["source"]) == ("road", "My_place.road")
    report = client.get("/api/maps/My_place/report").json()
    assert (report["entries"][0]["confidence"], report["entries"][0]["source_id"]) == (
        0.5,
        "line 3",
    )
    refused = upload(client, PLACE, "place.road", options="[]")
    assert refused.json()["error"]["message"] == "options are no JSON object"  # type: ignore[attr-defined]
    own_importer.forget()


@pytest.mark.slow
def test_a_file_of_no_known_format_is_refused_with_what_it_seems_to_be(client: TestClient) -> None:
    ended = job(client, upload(client, b"<kml/>", "town.kml"))  # type: ignore[arg-type]
    assert "it seems to be XML with the root element <kml>" in ended["error"]["message"]
