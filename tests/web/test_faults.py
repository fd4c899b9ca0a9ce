from __future__ import annotations

import os

import pytest
from starlette.testclient import TestClient

from odscen.maps.store import Workspace
from tests.web.conftest import CROSSING, finished


def test_a_full_disk_is_507_with_what_to_do_and_the_scenario_stays(
    client: TestClient, workspace: Workspace, sampled: str
) -> None:
    before = client.get(f"/api/scenarios/{sampled}").json()
    file = workspace.scenarios / f"{sampled}.scenario.json"
    text = file.read_bytes()
    part = file.with_name(f".{file.name}.{os.getpid()}.part")
    part.symlink_to("/dev/full")
    edit = {"version": before["version"], "edits": [{"kind": "set_seed", "seed": 77}]}
    answer = client.post(f"/api/scenarios/{sampled}/edits", json=edit)
    assert answer.status_code == 507
    assert answer.json()["error"]["message"] == f"{file}: the disk is full; free some room"
    assert file.read_bytes() == text
    part.unlink(missing_ok=True)
    assert client.post(f"/api/scenarios/{sampled}/edits", json=edit).status_code in (200, 409)


def test_a_folder_that_cannot_be_written_is_503_and_never_a_traceback(
    client: TestClient, workspace: Workspace
) -> None:
    workspace.scenarios.write_text("a file where a folder belongs")
    answer = client.post("/api/scenarios", json={"map": CROSSING, "name": "new"})
    assert answer.status_code == 503
    assert "Not a directory" in answer.json()["error"]["message"]
    assert "Traceback" not in answer.text


def test_files_of_a_map_that_are_gone_are_refused_with_what_to_do(
    client: TestClient, workspace: Workspace
) -> None:
    (workspace.root / "maps" / CROSSING / "preview.svg").unlink()
    answer = client.get(f"/api/maps/{CROSSING}/preview.svg")
    assert answer.status_code == 409
    message = answer.json()["error"]["message"]
    assert "preview.svg" in message
    assert "no such file" in message
    assert f"odscen doctor --repair builds map {CROSSING!r} anew" in message


@pytest.mark.parametrize("kind", ["od", "counts", "profile", "zones"])
def test_a_table_with_an_endless_cell_is_refused_with_its_line(
    client: TestClient, sampled: str, kind: str
) -> None:
    version = client.get(f"/api/scenarios/{sampled}").json()["version"]
    answer = client.post(
        f"/api/scenarios/{sampled}/demand/table",
        files={"file": ("t.csv", "a," + "x" * 200_000)},
        data={"kind": kind, "version": str(version)},
    )
    assert answer.status_code == 422
    assert "line 1: this is no table" in answer.json()["error"]["message"]


def test_large_answers_are_compressed_and_packed_ones_left_alone(
    client: TestClient, sampled: str
) -> None:
    packed = client.get(f"/api/scenarios/{sampled}", headers={"Accept-Encoding": "gzip"})
    assert packed.headers["content-encoding"] == "gzip"
    plain = client.get(f"/api/scenarios/{sampled}", headers={"Accept-Encoding": "identity"})
    assert "content-encoding" not in plain.headers
    assert packed.json() == plain.json()
    assert "content-encoding" not in client.get("/api/health").headers


@pytest.mark.slow
def test_the_load_bench_measures_every_kind_of_load() -> None:
    from bench.server_load import measure

    rows = list(measure(connections=6, uploads=2, actors=7000, runs=2, seconds=0.2))
    assert [row.failed for row in rows] == [0] * 12
    assert all(row.asked for row in rows)


@pytest.mark.slow
@pytest.mark.parametrize("sums", [True, False])
def test_damaged_records_of_lights_are_named_by_the_page(
    client: TestClient, workspace: Workspace, sampled: str, sums: bool
) -> None:
    run = client.post("/api/runs", json={"scenario": sampled, "until": 2}).json()["run"]
    assert finished(client, run)["state"] == "completed"
    folder = workspace.runs / run
    (file,) = (*folder.glob("signal_states.parquet"), *folder.glob("signal_states/*.parquet"))
    file.write_bytes(b"PAR1 is no table PAR1")
    if not sums:
        (folder / "SHA256SUMS").unlink()
    answer = client.get(f"/api/runs/{run}/signals")
    assert answer.status_code == (409 if sums else 422)
    assert file.name in answer.json()["error"]["message"]
    download = client.get(f"/api/runs/{run}/files/{file.relative_to(folder)}")
    assert download.status_code == (409 if sums else 200)
    (folder / "scenario.json").write_text("[" * 100_000)
    assert client.get(f"/api/runs/{run}/content").status_code == (409 if sums else 404)
