"""OpenSCENARIO files that a page sends, and the exports that it downloads."""

from __future__ import annotations

import io
import json
import re
import shutil
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from lxml import etree
from starlette.testclient import TestClient

from odscen.app.exchange.imports import import_file
from odscen.formats.base import VERDICTS
from odscen.maps import child_process
from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import loads
from odscen.web.application import create_app
from odscen.web.security import LOOPBACK
from tests import own_format
from tests.app.test_scenario_imports import FILE, ROAD, SPEED
from tests.web.conftest import CROSSING, finished, job

if TYPE_CHECKING:
    from collections.abc import Iterator

CUT_IN = FILE.replace("ACTION", SPEED)
SHARED = Path(__file__).parents[4] / "shared/osc/esmini"


@pytest.fixture(scope="module")
def with_road(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a workspace that has the road as well."""
    root = tmp_path_factory.mktemp("with-road") / "workspace"
    shutil.copytree(built, root)
    Workspace.open(root).add_map_content(ROAD.encode(), file="road.xodr", name="road")
    return root


@pytest.fixture
def known(with_road: Path, tmp_path: Path) -> Iterator[TestClient]:
    """Client of a server that knows the road."""
    root = tmp_path / "known"
    shutil.copytree(with_road, root)
    with TestClient(create_app(Workspace.open(root), hosts=LOOPBACK | {"testserver"})) as opened:
        yield opened


def send(client: TestClient, *files: tuple[str, str | bytes], **form: str) -> dict[str, Any]:
    """The job of an import, once it has ended."""
    parts = [("files", (name, content)) for name, content in files]
    return job(client, client.post("/api/imports/openscenario", files=parts, data=form))


def failure(client: TestClient, *files: tuple[str, str | bytes]) -> str:
    """Why an import has failed."""
    ended = send(client, *files)
    assert ended["state"] == "failed", ended
    message: str = ended["error"]["message"]
    return message


def report_of(client: TestClient, *files: tuple[str, str | bytes], **form: str) -> dict[str, Any]:
    ended = send(client, *files, **form)
    assert ended["state"] == "done", ended["error"]
    found: dict[str, Any] = client.get(f"/api/scenarios/{ended['result']}/import").json()
    return found


@pytest.mark.slow
def test_a_file_and_its_map_become_a_scenario_with_a_report(client: TestClient) -> None:
    report = report_of(client, ("cut_in.xosc", CUT_IN), ("road.xodr", ROAD))
    assert {one: report[one] for one in ("scenario", "file", "map", "added", "sweep")} == {
        "scenario": "cut_in-1",
        "file": "cut_in.xosc",
        "map": "road",
        "added": True,
        "sweep": False,
    }
    document = client.get("/api/scenarios/cut_in-1").json()["document"]
    assert [one["id"] for one in document["actors"]] == ["Ego", "Other"]
    assert [one["id"] for one in document["rules"]][-2:] == ["cut-in", "later"]
    count = len(etree.fromstring(CUT_IN).xpath("//*"))
    assert sum(len(report[verdict]) for verdict in VERDICTS) == count
    assert report["refused"] == []


@pytest.mark.slow
def test_rows_of_the_report_have_the_place_on_the_map_that_they_are_about(
    known: TestClient,
) -> None:
    broken = CUT_IN.replace('laneId="-1" s="48.6"', 'laneId="-1" s="60"')
    broken = broken.replace('<RelativeTargetLane entityRef="Other" value="1"/>', "<Sideways/>")
    report = report_of(known, ("cut_in.xosc", broken))
    (refused,) = report["refused"]
    assert refused["xpath"].endswith("/Event[1]")
    assert refused["line"] == 1 + broken[: broken.index("<Event name")].count("\n")
    # The event is the other's, which starts 40 m before the ego, a lane to the right.
    assert (refused["x"], refused["y"]) == (pytest.approx(100.0, abs=1.5), -5.25)
    place = next(one for one in report["taken"] if one["xpath"].endswith("/LanePosition"))
    assert (place["x"], place["y"]) == (60.0, -1.75)
    assert next(one for one in report["taken"] if one["xpath"].endswith("/Init"))["x"] is None


def test_a_map_that_the_workspace_has_is_not_added_again(client: TestClient) -> None:
    assert report_of(client, ("a.xosc", CUT_IN), ("road.xodr", ROAD))["added"] is True
    for files in ([("a.xosc", CUT_IN)], [("a.xosc", CUT_IN), ("Road.XODR", ROAD)]):
        again = report_of(client, *files)
        assert (again["map"], again["added"]) == ("road", False)
    assert [one["name"] for one in client.get("/api/maps").json()] == ["road", CROSSING]


def test_another_map_of_the_same_name_is_added_beside_it(known: TestClient) -> None:
    longer = ROAD.replace('length="500"', 'length="400"')
    other = report_of(known, ("a.xosc", CUT_IN), ("road.xodr", longer))
    assert (other["map"], other["added"]) == ("road-2", True)


def test_a_missing_map_is_named_with_what_to_do(client: TestClient) -> None:
    words = failure(client, ("cut_in.xosc", CUT_IN), ("town.xodr", ROAD))
    assert words.startswith("cut_in.xosc: it plays on the map 'road.xodr', which is neither")
    assert "What was sent is town.xodr." in words
    assert words.endswith("Send that map together with the scenario, or add it first.")
    assert [one["name"] for one in client.get("/api/maps").json()] == [CROSSING]
    assert client.get("/api/scenarios").json() == []


def test_a_file_that_names_no_map_plays_on_the_one_that_was_sent_with_it(
    client: TestClient,
) -> None:
    bare = CUT_IN.replace('<LogicFile filepath="road.xodr"/>', "")
    assert bare != CUT_IN
    words = failure(client, ("cut_in.xosc", bare))
    assert "names no map" in words
    assert words.endswith("send one map together with it")
    assert report_of(client, ("cut_in.xosc", bare), ("town.xodr", ROAD))["map"] == "town"


def test_names_in_a_file_reach_nothing_on_the_disk(client: TestClient, tmp_path: Path) -> None:
    """The map is on the disk where the file says, and so is a catalog that it names."""
    (tmp_path / "road.xodr").write_text(ROAD, encoding="utf-8")
    for named in (tmp_path / "road.xodr", f"../../../../../../..{tmp_path}/road.xodr"):
        words = failure(client, ("../../a.xosc", CUT_IN.replace("road.xodr", str(named))))
        assert "it plays on the map 'road.xodr', which is neither" in words
    varied = (
        '<OpenSCENARIO><FileHeader revMajor="1" revMinor="2"/><ParameterValueDistribution>'
        f'<ScenarioFile filepath="{tmp_path}/cut_in.xosc"/><Deterministic/>'
        "</ParameterValueDistribution></OpenSCENARIO>"
    )
    (tmp_path / "cut_in.xosc").write_text(CUT_IN, encoding="utf-8")
    words = failure(client, ("v.xosc", varied), ("road.xodr", ROAD))
    assert words == (
        "v.xosc: it needs the file 'cut_in.xosc', which was not sent with it; send both files"
    )


def test_names_of_files_are_shown_and_never_become_paths(
    client: TestClient, workspace: Workspace
) -> None:
    report = report_of(client, ("../../../etc/cut in.xosc", CUT_IN), ("C:\\m\\road.xodr", ROAD))
    assert (report["scenario"], report["map"]) == ("cut_in-1", "road")
    assert {one["file"] for one in report["taken"]} == {"cut in.xosc"}
    (written,) = workspace.scenarios.glob("*.json")
    assert written.name == "cut_in-1.scenario.json"


def test_a_body_comes_from_a_catalog_that_was_sent(known: TestClient) -> None:
    catalog = (
        '<OpenSCENARIO><FileHeader revMajor="1" revMinor="2"/><Catalog name="Cars">'
        '<Vehicle name="long" vehicleCategory="truck"/></Catalog></OpenSCENARIO>'
    )
    asks = '<CatalogReference catalogName="Cars" entryName="long"/>'
    file = CUT_IN.replace('<Vehicle name="v" vehicleCategory="van"/>', asks)
    file = file.replace(
        "<RoadNetwork>",
        '<CatalogLocations><VehicleCatalog><Directory path="../cars"/></VehicleCatalog>'
        "</CatalogLocations><RoadNetwork>",
    )
    report = report_of(known, ("cars.xosc", catalog), ("a.xosc", file))
    document = known.get(f"/api/scenarios/{report['scenario']}").json()["document"]
    assert [one["category"] for one in document["actors"]] == ["car", "truck"]
    assert "cars.xosc" in {one["file"] for one in report["taken"]}


def test_a_distribution_gives_the_plan_of_a_sweep(known: TestClient) -> None:
    varied = (
        '<OpenSCENARIO><FileHeader revMajor="1" revMinor="2"/><ParameterValueDistribution>'
        '<ScenarioFile filepath="x/cut_in.xosc"/><Deterministic>'
        '<DeterministicSingleParameterDistribution parameterName="kph"><DistributionSet>'
        '<Element value="36"/><Element value="54"/></DistributionSet>'
        "</DeterministicSingleParameterDistribution></Deterministic>"
        "</ParameterValueDistribution></OpenSCENARIO>"
    )
    report = report_of(known, ("v.xosc", varied), ("cut_in.xosc", CUT_IN))
    assert report["sweep"] is True
    plan = known.get(f"/api/scenarios/{report['scenario']}/import/plan")
    assert plan.headers["content-disposition"] == 'attachment; filename="v-1.sweep.json"'
    assert "kph" in json.dumps(plan.json())


UNUSABLE: tuple[tuple[list[tuple[str, str]], str], ...] = (
    ([("road.xodr", ROAD)], r"no OpenSCENARIO file \(\.xosc\) was sent"),
    ([("a.xosc", "<OpenSCENARIO><")], r"^a\.xosc: .*line 1"),
    ([("a.xosc", "<Other/>")], r"^a\.xosc: the root element is 'Other', not 'OpenSCENARIO'"),
    ([("a.xosc", CUT_IN), ("b.xosc", CUT_IN)], r"these are 2 scenarios \(a\.xosc, b\.xosc\)"),
    (
        [("a.xosc", "<OpenSCENARIO><Catalog name='c'/></OpenSCENARIO>")],
        r"^a\.xosc: there is no scenario among the files: none has a Storyboard",
    ),
    (
        [("a.xosc", CUT_IN.replace('s="48.6"', 's="far"'))],
        r"a\.xosc: /OpenSCENARIO/.*LanePosition \(line \d+\): s='far' is no number",
    ),
)


def test_what_cannot_be_used_is_refused_with_its_name(known: TestClient) -> None:
    for files, words in UNUSABLE:
        assert re.search(words, failure(known, *files)), words
    assert known.get("/api/scenarios").json() == []


def test_a_map_that_came_with_a_refused_file_is_not_kept(known: TestClient) -> None:
    other = ROAD.replace('length="500"', 'length="510"')
    assert other != ROAD
    failure(known, ("a.xosc", CUT_IN.replace('s="48.6"', 's="far"')), ("road.xodr", other))
    assert [row["name"] for row in known.get("/api/maps").json()] == ["road", CROSSING]


def test_the_report_goes_where_the_scenario_goes(known: TestClient) -> None:
    name = report_of(known, ("a.xosc", CUT_IN))["scenario"]
    known.put(f"/api/scenarios/{name}/name", json={"name": "mine"})
    assert known.get("/api/scenarios/mine/import").json()["scenario"] == "mine"
    item = known.delete("/api/scenarios/mine").json()["id"]
    assert known.get("/api/scenarios/mine/import").status_code == 404
    known.post(f"/api/trash/{item}/restore")
    assert known.get("/api/scenarios/mine/import").json()["file"] == "a.xosc"


def test_a_scenario_that_was_not_imported_has_no_report(client: TestClient, sampled: str) -> None:
    for place in ("import", "import/plan"):
        assert client.get(f"/api/scenarios/{sampled}/{place}").status_code == 404


def opened(client: TestClient, name: str, **query: str) -> dict[str, bytes]:
    """Files of an export, by name."""
    answer = client.get(f"/api/scenarios/{name}/export", params=query)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "application/zip"
    again = client.get(f"/api/scenarios/{name}/export", params=query)
    assert again.content == answer.content
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        return {one: archive.read(one) for one in archive.namelist()}


@pytest.mark.slow
@pytest.mark.parametrize("version", ["1.0", "1.3"])
def test_an_export_to_openscenario_comes_back_as_the_same_scenario(
    known: TestClient, version: str
) -> None:
    name = report_of(known, ("a.xosc", CUT_IN))["scenario"]
    files = opened(known, name, to="openscenario", version=version)
    assert sorted(files) == [f"{name}.export.json", f"{name}.xosc", "road.xodr"]
    assert files["road.xodr"] == ROAD.encode()
    header = etree.fromstring(files[f"{name}.xosc"]).find("FileHeader")
    assert header is not None
    assert header.get("revMinor") == version[-1]
    notes = known.get(
        f"/api/scenarios/{name}/export/notes", params={"to": "openscenario", "version": version}
    ).json()
    said = json.loads(files[f"{name}.export.json"])
    assert notes == {"files": sorted(files), **said}
    back = report_of(known, (f"{name}.xosc", files[f"{name}.xosc"]))["scenario"]
    before, after = (known.get(f"/api/scenarios/{one}").json()["document"] for one in (name, back))
    assert [one["spawn"] for one in after["actors"]] == [one["spawn"] for one in before["actors"]]


def test_an_export_to_sumo_has_all_that_it_needs(client: TestClient, sampled: str) -> None:
    files = opened(client, sampled, to="sumo")
    assert {Path(one).suffix for one in files} >= {".sumocfg", ".xml"}
    assert any(one.endswith(".net.xml") for one in files)
    notes = client.get(f"/api/scenarios/{sampled}/export/notes", params={"to": "sumo"}).json()
    assert notes == {"files": sorted(files), "approximated": [], "left_out": []}


@pytest.mark.slow
def test_an_export_as_a_graph_is_the_download(client: TestClient, sampled: str) -> None:
    (content,) = opened(client, sampled, to="graphml").values()
    plain = client.get(f"/api/scenarios/{sampled}/download", params={"form": "graphml"})
    assert content == plain.content


def test_an_export_that_cannot_be_is_refused(client: TestClient, sampled: str) -> None:
    for query, status, words in (
        ({"to": "paper"}, 404, "paper"),
        ({"to": "openscenario", "version": "2.0"}, 422, "2.0"),
        ({"to": "sumo", "version": "1.2"}, 422, "the format sumo has no version"),
    ):
        for place in ("export", "export/notes"):
            answer = client.get(f"/api/scenarios/{sampled}/{place}", params=query)
            assert answer.status_code == status
            assert words in answer.json()["error"]["message"]


def test_the_command_line_reads_the_same(known: TestClient, tmp_path: Path) -> None:
    (tmp_path / "a.xosc").write_text(CUT_IN, encoding="utf-8")
    (tmp_path / "road.xodr").write_text(ROAD, encoding="utf-8")
    here = import_file(Workspace.open(tmp_path / "w"), tmp_path / "a.xosc")
    there = report_of(known, ("a.xosc", CUT_IN))
    text = known.get(f"/api/scenarios/{there['scenario']}/download").text
    assert loads(text) == here.scenario
    for verdict in VERDICTS:
        assert there[verdict] == [row._asdict() for row in here.lists[verdict]]


@pytest.mark.slow
@pytest.mark.skipif(not SHARED.is_dir(), reason="../shared/osc is not here")
def test_a_scene_of_esmini_is_imported_with_its_map(client: TestClient) -> None:
    file, road = SHARED / "xosc/cut-in.xosc", SHARED / "xodr/e6mini.xodr"
    report = report_of(client, (file.name, file.read_bytes()), (road.name, road.read_bytes()))
    assert (report["map"], report["refused"]) == ("e6mini", [])
    assert len(report["taken"]) > 80


@pytest.mark.slow
def test_a_finished_run_is_downloaded_as_it_happened(client: TestClient, sampled: str) -> None:
    answer = client.post("/api/runs", json={"scenario": sampled, "until": 3})
    run = str(answer.json()["run"])
    finished(client, run)
    wish = {"to": "openscenario", "version": "1.2"}
    answer = client.get(f"/api/runs/{run}/export", params=wish)
    assert answer.status_code == 200, answer.text
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        (name,) = (one for one in archive.namelist() if one.endswith(".xosc"))
        root = etree.fromstring(archive.read(name))
        assert any(one.endswith(".xodr") for one in archive.namelist())
    lines = root.findall(".//FollowTrajectoryAction")
    assert lines
    assert root.find(".//TimeReference/Timing") is not None
    assert client.get("/api/runs/none/export", params=wish).status_code == 404
    assert client.get(f"/api/runs/{run}/export", params={"to": "graphml"}).status_code == 422


@pytest.mark.slow
def test_a_format_of_a_package_is_listed_downloaded_and_read(
    client: TestClient, sampled: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own_format.install(tmp_path, monkeypatch)
    try:
        listed = {one["id"]: one for one in client.get("/api/formats").json()}
        assert {"openscenario", "sumo", "graphml", "arrays", "waymo"} <= listed.keys()
        own = listed["actors"]
        assert (own["title"], own["reads"], own["writes"]) == (
            "Table of road users (CSV)", True, True,
        )  # fmt: skip
        (name,) = files = opened(client, sampled, to="actors")
        assert name == f"{sampled}.actors.csv"
        # A child that waits for work has been started before the package was there.
        monkeypatch.setattr(child_process, "_take_child", child_process._Child)
        parts = [("files", (name, files[name]))]
        started = client.post("/api/imports/actors", files=parts)
        assert "names no map" in job(client, started)["error"]["message"]
        road = Path(__file__).parents[3] / "maps" / f"{CROSSING}.xodr"
        parts.append(("files", (road.name, road.read_bytes())))
        ended = job(client, client.post("/api/imports/actors", files=parts))
        assert ended["state"] == "done", ended["error"]
        place = f"/api/scenarios/{ended['result']}"
        before = client.get(f"/api/scenarios/{sampled}").json()["document"]["actors"]
        after = client.get(place).json()["document"]["actors"]
        assert [one["spawn"] for one in after] == [one["spawn"] for one in before]
        assert len(client.get(f"{place}/import").json()["taken"]) == len(before)
    finally:
        own_format.forget()
