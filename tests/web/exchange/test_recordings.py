"""Recordings sent to the server: placed, looked at by time, made scenarios of."""

from __future__ import annotations

import json
import struct
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from typer.testing import CliRunner

from odscen.app.doctor import examine
from odscen.app.exchange import kept_recordings
from odscen.app.exchange.imports import DiskFile
from odscen.base.errors import InputError, LimitError
from odscen.base.folder_locks import locked
from odscen.cli.commands import command_line
from odscen.formats.tracks import table_schemas
from odscen.formats.tracks.read_recording import choose_recording
from odscen.maps.store import Workspace
from odscen.web.exchange import recording_routes
from tests.formats.tracks.test_tracks_on_maps import SHARED, crossing_traffic
from tests.web.conftest import job as result_of

if TYPE_CHECKING:
    from starlette.testclient import TestClient

COLUMNS = 5


def send(client: TestClient, files: dict[str, bytes]) -> Any:
    sent = [("files", (name, content)) for name, content in files.items()]
    return result_of(client, client.post("/api/recordings", files=sent))


@pytest.fixture
def recording(client: TestClient) -> str:
    job = send(client, {"crossing.csv": crossing_traffic().write_csv().encode()})
    assert job["state"] == "done", job
    return str(job["result"])


def moments(content: bytes) -> tuple[Any, Any, Any]:
    count, rows = struct.unpack_from("<II", content)
    times = np.frombuffer(content, "<f8", count, 8)
    first = np.frombuffer(content, "<u4", count + 1, 8 + 8 * count)
    body = np.frombuffer(content, "<f4", COLUMNS * rows, 8 + 8 * count + 4 * (count + 1))
    return times, first, body.reshape(rows, COLUMNS)


@pytest.mark.slow
def test_a_recording_finds_its_map_and_is_looked_at_by_time(
    client: TestClient, recording: str
) -> None:
    info = client.get(f"/api/recordings/{recording}").json()
    assert info["map"] == "signal_crossing"
    assert info["vehicles"]["on_lane"] > 0.99
    assert {scene["kind"] for scene in info["scenes"]} >= {"cut_in", "hard_braking"}
    assert b"<svg" in client.get(f"/api/recordings/{recording}/picture").content
    fits = client.get(f"/api/recordings/{recording}/maps").json()
    assert [fit["map"] for fit in fits] == ["signal_crossing"]

    times, first, rows = moments(client.get(f"/api/recordings/{recording}/moments").content)
    file = crossing_traffic()
    assert len(rows) == file.height
    assert times[[0, -1]].tolist() == [10.0, 21.96]
    origin = info["origin"]
    for k in (0, 100, len(times) - 1):
        own = rows[first[k] : first[k + 1]]
        seen = {
            info["users"][int(user)]["id"]: (x + origin[0], y + origin[1])
            for user, x, y, _, _ in own.tolist()
        }
        there = file.filter((file["time"] - times[k]).abs() < 1e-6)
        expected = {name: (x, y) for name, x, y in there.select("id", "x", "y").iter_rows()}
        assert seen.keys() == expected.keys()
        for name, place in seen.items():
            assert place == pytest.approx(expected[name], abs=1e-4)
    # One moment more on each side of a part; fewer, evenly, if there are too many rows.
    part = client.get(f"/api/recordings/{recording}/moments?begin=12&end=13").content
    assert moments(part)[0][[0, -1]] == pytest.approx([12.0, 13.0], abs=0.041)
    few = moments(client.get(f"/api/recordings/{recording}/moments?most=100").content)[0]
    assert len(few) <= 100
    assert np.ptp(np.diff(few)) < 1e-6


@pytest.mark.slow
def test_a_part_becomes_a_scenario_with_its_tracks_as_ghosts(
    client: TestClient, recording: str
) -> None:
    part = {"begin": 10.0, "end": 16.0, "ego": "behind", "follow": "react"}
    job = result_of(client, client.post(f"/api/recordings/{recording}/scenarios", json=part))
    assert job["state"] == "done", job
    state = client.get(f"/api/scenarios/{job['result']}").json()
    document = state["document"]
    assert [actor["id"] for actor in document["actors"] if actor["ego"]] == ["behind"]
    assert document["criteria"] == ["collided(ego) == 0"]
    assert not [one for one in state["problems"] if one["severity"] == "error"]
    ghosts = {one["id"]: one for one in client.get(f"/api/scenarios/{job['result']}/ghosts").json()}
    assert ghosts["cuts"]["actor"] == "cuts"
    # In the time of the run, 0.04 s later than that of the recording less its first instant.
    assert ghosts["cuts"]["time"][0] == pytest.approx(0.04)
    assert ghosts["cuts"]["time"][-1] == pytest.approx(6.04)
    assert (ghosts["cuts"]["x"][0], ghosts["cuts"]["y"][0]) == pytest.approx((-75.0, 0.0))
    report = client.get(f"/api/scenarios/{job['result']}/import").json()
    assert report["file"] == "crossing.csv"

    other = client.post("/api/scenarios", json={"map": "signal_crossing"}).json()["name"]
    assert client.get(f"/api/scenarios/{other}/ghosts").json() == []
    wrong = result_of(
        client,
        client.post(f"/api/recordings/{recording}/scenarios", json=part | {"ego": "nobody"}),
    )
    assert "no road user 'nobody'" in wrong["error"]["message"]

    assert client.get("/api/recordings").json()[0]["name"] == recording
    client.delete(f"/api/recordings/{recording}")
    assert client.get("/api/recordings").json() == []
    assert client.get(f"/api/recordings/{recording}").status_code == 404
    assert client.get(f"/api/scenarios/{job['result']}/ghosts").json() != []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "route"),
    [
        ("about.json", ""),
        ("SHA256SUMS", ""),
        ("agreement.svg", "/picture"),
        ("rows.bin", "/moments"),
        ("times.bin", "/moments"),
        ("first.bin", "/moments"),
        ("placed.parquet", "/maps"),
    ],
)
def test_a_changed_byte_of_a_recording_is_noticed_and_hides_no_other(
    client: TestClient, workspace: Workspace, recording: str, file: str, route: str
) -> None:
    assert client.get(f"/api/recordings/{recording}{route}").status_code == 200
    path = workspace.recordings / recording / file
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    refused = client.get(f"/api/recordings/{recording}{route}")
    assert 400 <= refused.status_code < 500
    assert file in refused.text
    assert client.get("/api/recordings").status_code == 200
    steps = list(examine(workspace))
    assert [(step.what, step.name, step.harm) for step in steps] == [("recording", recording, True)]
    assert client.delete(f"/api/recordings/{recording}").status_code == 204
    assert client.get("/api/recordings").json() == []


@pytest.mark.slow
def test_a_recording_that_lies_elsewhere_is_moved_onto_the_lanes(client: TestClient) -> None:
    away = crossing_traffic().with_columns(x=crossing_traffic()["x"] + 500.0)
    job = send(client, {"away.csv": away.write_csv().encode()})
    name = job["result"]
    assert client.get(f"/api/recordings/{name}").json()["map"] is None
    refused = client.post(f"/api/recordings/{name}/scenarios", json={"begin": 10, "end": 16})
    assert "needs a map" in result_of(client, refused)["error"]["message"]
    place = {"map": "signal_crossing", "offset": "-500,1.2", "estimate": True}
    job = result_of(client, client.post(f"/api/recordings/{name}/map", json=place))
    assert job["state"] == "done", job
    info = client.get(f"/api/recordings/{name}").json()
    assert info["vehicles"]["on_lane"] > 0.99
    assert info["offset"][1] == pytest.approx(0.0, abs=0.35)
    unknown = client.post(f"/api/recordings/{name}/map", json={"map": "nowhere"})
    assert result_of(client, unknown)["error"]["kind"] == "NotFoundError"


def test_of_several_files_the_tracks_are_read(tmp_path: Path) -> None:
    def file(name: str, titles: str) -> DiskFile:
        (tmp_path / name).write_text(f"{titles}\n")
        return DiskFile(tmp_path / name)

    levelx = [
        file("07_tracksMeta.csv", "trackId,width,length,class"),
        file("07_recordingMeta.csv", "recordingId,frameRate"),
        file("07_tracks.csv", "trackId,frame,xCenter,yCenter,heading,xVelocity,yVelocity"),
    ]
    assert choose_recording(levelx) == 2
    interaction = "track_id,frame_id,timestamp_ms,agent_type,x,y,vx,vy"
    both = [file(f"{kind}_tracks_000.csv", interaction) for kind in ("pedestrian", "vehicle")]
    assert choose_recording(both) == 1
    with pytest.raises(InputError, match="several recordings were sent"):
        choose_recording([*levelx, both[1]])
    with pytest.raises(InputError, match="none of the files has tracks"):
        choose_recording(levelx[:2])


def test_recordings_of_one_name_that_come_together_are_both_kept(
    workspace: Workspace, tmp_path: Path
) -> None:
    file = tmp_path / "crossing.csv"
    crossing_traffic().write_csv(file)
    sent = [kept_recordings.SentPath(file.name, file)]
    names = []

    def add(*_: object) -> None:
        if not names:
            names.append("being added")
            kept = kept_recordings.add_recording(workspace, sent, progress=lambda *_: None)
            names.append(kept.name)

    def begin_other(step: str, _: float) -> None:
        if "placing" in step:  # while the first has its name
            add()

    first = kept_recordings.add_recording(workspace, sent, progress=begin_other)
    assert [first.name, *names[1:]] == ["crossing", "crossing-2"]
    assert sorted(kept_recordings.recording_names(workspace)) == ["crossing", "crossing-2"]
    twice = [kept_recordings.SentPath(name, file) for name in ("a.csv", "b/a.csv")]
    with pytest.raises(InputError, match=r"several files that were sent are called a\.csv"):
        kept_recordings.add_recording(workspace, twice, progress=lambda *_: None)


def test_a_recording_that_is_being_placed_is_not_deleted_and_put_back(
    client: TestClient, workspace: Workspace, recording: str
) -> None:
    folder = workspace.recordings / recording
    with locked(folder, what="it"):
        refused = client.delete(f"/api/recordings/{recording}")
        assert refused.status_code == 409
        assert "in the hands of" in refused.text
    assert client.delete(f"/api/recordings/{recording}").status_code == 204
    assert not list(workspace.recordings.iterdir())


@pytest.mark.slow
def test_of_a_recording_with_too_much_a_part_is_kept_or_asked_for(
    workspace: Workspace, recording: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = workspace.recordings / recording
    place = {"folder": str(folder), "workspace": str(workspace.root)}
    more = {"map_name": "signal_crossing", "offset": "", "estimate": False}
    monkeypatch.setattr(kept_recordings, "MOST_SCENES", 1)
    kept_recordings.place_kept_recording(**place, **more, progress=lambda *_: None)
    about = json.loads((folder / "about.json").read_text())
    assert len(about["scenes"]) == 1
    assert "more scenes, which are not listed" in about["summary"]["notes"][-1]
    (folder / "files").mkdir()
    crossing_traffic().write_csv(folder / "files" / "t.csv")
    monkeypatch.setattr(kept_recordings, "MOST_USERS", 3)
    with pytest.raises(LimitError, match=r"t\.csv: it has more than 3 road users; send a part"):
        kept_recordings.read_sent_recording(
            folder=str(folder), names=["t.csv"], find_in=None, progress=lambda *_: None
        )


def test_what_is_no_recording_is_refused_with_its_place(client: TestClient) -> None:
    job = send(client, {"tracks.csv": b"time,x,y\n0,1,2\n1,here,2\n"})
    assert "'here' is not a number" in job["error"]["message"]
    assert "line 3 > column x" in job["error"]["message"]
    job = send(client, {"road.xodr": b"<OpenDRIVE/>"})
    assert "no recorded traffic was sent" in job["error"]["message"]
    assert client.get("/api/recordings").json() == []


@pytest.mark.slow
def test_a_large_recording_is_there_before_its_scenes_are(
    client: TestClient, recording: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    at_once = client.get(f"/api/recordings/{recording}").json()
    monkeypatch.setattr(recording_routes, "SEARCHED_AT_ONCE", 0)
    monkeypatch.setattr(table_schemas, "LARGE_TABLE", 0)
    begun = threading.Event()
    search = kept_recordings.search_recording

    def search_when_asked(*args: Any, **more: Any) -> Any:
        assert begun.wait(60)
        return search(*args, **more)

    monkeypatch.setattr(recording_routes, "search_recording", search_when_asked)
    name = send(client, {"crossing.csv": crossing_traffic().write_csv().encode()})["result"]
    first = client.get(f"/api/recordings/{name}").json()
    assert (first["searched"], first["scenes"], first["vehicles"]) == (False, [], None)
    assert (first["map"], first["users"]) == (at_once["map"], at_once["users"])
    shown = client.get(f"/api/recordings/{name}/moments").content
    assert shown == client.get(f"/api/recordings/{recording}/moments").content
    assert client.get(f"/api/recordings/{name}/picture").status_code == 404
    # The one that has begun is joined.
    jobs = [client.post(f"/api/recordings/{name}/search") for _ in range(2)]
    assert jobs[0].json() == jobs[1].json()
    begun.set()
    assert result_of(client, jobs[0])["state"] == "done"
    then = client.get(f"/api/recordings/{name}").json()
    assert then["searched"]
    for key in ("scenes", "vehicles", "frequencies", "bounds", "users", "origin"):
        assert then[key] == at_once[key], key
    assert client.get(f"/api/recordings/{name}/moments").content == shown


FOLDERS = {
    "av2": (["scenario_0a1e6f0a.parquet", "log_map_archive_0a1e6f0a.json"], 44, "vehicles", 0.4),
    "commonroad": (["USA_Lanker-1_1_T-1.xml"], 24, "vehicles", 1.0),
    "interaction": (["vehicle_tracks_000.csv", "TestScenarioForScripts.osm"], 2, "vehicles", 1.0),
    "omega-prime": (["pedestrian.osi", "fabriksgatan.xodr"], 2, "vehicles", 1.0),
    "sind": (
        ["Ped_smoothed_tracks.csv", "Traffic_Lights.csv", "Xian_Shanglin.osm"],
        16, "pedestrians", 0.0,
    ),
}  # fmt: skip
"""Files of each folder, road users, and the share of states of a kind on lanes (walks) at least:
vehicles of the map of Argoverse 2 are parked beside its lanes or leave it, SinD's has no walks."""


@pytest.mark.slow
@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the recordings of ../shared")
@pytest.mark.parametrize("folder", FOLDERS)
def test_recordings_of_others_are_located_and_looked_at_by_time(
    client: TestClient, folder: str
) -> None:
    names, users, kind, on_lane = FOLDERS[folder]
    job = send(client, {name: (SHARED / folder / name).read_bytes() for name in names})
    assert job["state"] == "done", job
    info = client.get(f"/api/recordings/{job['result']}").json()
    assert info["map"] is not None
    assert len(info["users"]) == users
    assert info[kind]["on_lane"] >= on_lane
    times, first, rows = moments(client.get(f"/api/recordings/{job['result']}/moments").content)
    assert (times[0], times[-1]) == pytest.approx((info["begin"], info["end"]), abs=0.002)
    low, high = np.array(info["bounds"]).reshape(2, 2) - info["origin"]
    assert (rows[:, 1:3] >= low - 0.01).all()
    assert (rows[:, 1:3] <= high + 0.01).all()
    assert {int(user) for user in rows[:, 0]} == set(range(users))
    assert first[-1] == len(rows)


def test_a_form_that_is_damaged_or_has_no_room_is_refused(
    client: TestClient, workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    def send_form(body: bytes, kind: str = "multipart/form-data; boundary=b") -> Any:
        return client.post("/api/recordings", content=body, headers={"Content-Type": kind})

    head = b'--b\r\nContent-Disposition: form-data; name="files"; filename="../../t.csv"\r\n\r\n'
    assert send_form(b"{}", "application/json").status_code == 422
    for body, words in (
        (b"no form", "the form is damaged"),
        (head + b"time,x,y\n", "the form ends too early"),
        (b'--b\r\nContent-Disposition: form-data; name="map"\r\n\r\nm\r\n--b--\r\n', "no files"),
        (41 * (head + b"x\r\n") + b"--b--\r\n", "more than 40 files"),
    ):
        refused = send_form(body)
        assert refused.status_code == 422, refused.text
        assert words in refused.text
    job = result_of(client, send_form(head + b"time,x,y\n0,1,2\n1,3,2\n\r\n--b--\r\n"))
    assert (job["state"], job["result"]) == ("done", "t")
    monkeypatch.setattr(recording_routes, "_ROOM", 1 << 60)
    full = send_form(head + b"x\r\n--b--\r\n")
    assert full.status_code == 507, full.text
    assert "free some room" in full.text
    assert [path.name for path in workspace.recordings.iterdir()] == ["t"]


@pytest.mark.slow
def test_files_of_this_machine_are_kept_without_being_sent(
    workspace: Workspace, tmp_path: Path
) -> None:
    file = tmp_path / "crossing.csv"
    crossing_traffic().write_csv(file)
    command = ["recording", "add", str(file), "--json", "--workspace", str(workspace.root)]
    said = CliRunner().invoke(command_line(), command)
    assert said.exit_code == 0, said.output
    made = json.loads(said.stdout)
    assert (made["name"], made["map"], made["road_users"]) == ("crossing", "signal_crossing", 4)
    assert made["scenes"] == len(
        kept_recordings.open_recording(workspace, "crossing").about["scenes"]
    )
    assert made["scenes"] >= 4
    assert file.is_file()
    lost = CliRunner().invoke(command_line(), [*command[:2], str(tmp_path / "no.csv")])
    assert isinstance(lost.exception, InputError)
    assert "there is no such file" in str(lost.exception)
