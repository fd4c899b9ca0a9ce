"""Sweeps as the page asks for them: planned, run, stopped, resumed, and a case by itself."""

from __future__ import annotations

import json
import shutil
from typing import TYPE_CHECKING, Any

import polars as pl
import pytest
from starlette.testclient import TestClient

from odscen.app.running.runs import run
from odscen.app.scenarios import SUFFIX
from odscen.experiments.sweeps import SweepSettings, begin_sweep, estimate
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.runs.finished_run import Run
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.sweeps.sweep_plan import SweepPlan, axis_from_text
from odscen.web.application import create_app
from odscen.web.security import LOOPBACK
from tests.sumo.story_case import MIDDLE, RIGHT, document, node_at, workspace
from tests.web.conftest import finished, wait_for

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

MOTORWAY, NAME = "motorway_weave", "swept"
VARY = [
    {"parameter": "gap", "low": 10, "high": 40, "steps": 3},
    {"parameter": "van", "values": [12, 26]},
]
WISH = {"scenario": NAME, "vary": VARY, "safe": ["min_ttc >= 0.8"], "figures": ["mean_speed"]}


def actor(name: str, x: float, y: float, speed: Any, **fields: Any) -> dict[str, Any]:
    about = {"id": name, "category": "car", "spawn": node_at(MOTORWAY, x, y)}
    goal = node_at(MOTORWAY, 900.0, MIDDLE)
    return about | {"goal": goal, "speed": speed, "initial_speed": speed} | fields


def cut_in() -> str:
    """A van comes over when the ego, at 30 m/s behind it on the next lane, is `gap` metres away."""
    data = json.loads(dumps(document(MOTORWAY, [], [], until=5.0)))
    when = {"distance": {"of": "ego", "to": "van", "along": "longitudinal", "below": "$gap"}}
    data["actors"] = [
        actor("ego", 300.0, MIDDLE, 30.0, ego=True), actor("van", 345.0, RIGHT, "$van")
    ]  # fmt: skip
    data["rules"] = [{"id": "r", "actor": "van", "when": when, "then": [{"lane": {"by": 1}}]}]
    data["parameters"] = {
        "gap": {"value": 20, "unit": "m", "min": 5, "max": 50},
        "van": {"value": 20, "unit": "m/s", "min": 10, "max": 30},
    }
    return dumps(loads(json.dumps(data)))


@pytest.fixture(scope="module")
def client() -> Iterator[TestClient]:
    place = workspace().scenarios / f"{NAME}{SUFFIX}"
    text = cut_in()
    place.parent.mkdir(exist_ok=True)
    place.write_text(text, encoding="utf-8")
    app = create_app(workspace(), hosts=LOOPBACK | {"testserver"})
    with TestClient(app) as opened:
        yield opened


def asked(client: TestClient, path: str, body: Any = None, *, status: int = 202) -> Any:
    answer = client.post(f"/api/sweeps{path}", json=body)
    assert answer.status_code == status, answer.text
    return answer.json()


def ended(client: TestClient, sweep: str) -> dict[str, Any]:
    def over() -> dict[str, Any] | None:
        info: dict[str, Any] = client.get(f"/api/sweeps/{sweep}").json()
        return info if info["state"] != "running" else None

    found: dict[str, Any] = wait_for(over, seconds=120)
    return found


def _summary(client: TestClient, run: str) -> dict[str, Any]:
    found: dict[str, Any] = client.get(f"/api/runs/{run}/summary").json()
    return found


@pytest.fixture(scope="module")
def done(client: TestClient) -> dict[str, Any]:
    return ended(client, asked(client, "", {**WISH, "processes": 2})["sweep"])


@pytest.mark.slow
def test_a_sweep_says_how_far_it_is_and_what_has_come_of_it(
    client: TestClient, done: dict[str, Any]
) -> None:
    assert done["sweep"] == f"{NAME}-1"
    assert (done["state"], done["error"]) == ("done", None)
    assert (done["cases"], done["ended"], done["scenario"]) == (6, 6, NAME)
    assert done["parameters"] == ["gap", "van"]
    assert done["safe"] + done["unsafe"] == 6
    assert done["unsafe"] >= 1
    assert client.get("/api/sweeps", params={"scenario": NAME}).json()[0] == done
    assert client.get("/api/sweeps", params={"scenario": "other"}).json() == []


@pytest.mark.slow
def test_the_cases_are_those_of_the_table_with_the_boundary(
    client: TestClient, done: dict[str, Any]
) -> None:
    found = client.get(f"/api/sweeps/{done['sweep']}/cases").json()
    assert found["limits"] == ["no collision", "min_ttc >= 0.8"]
    assert found["parameters"] == [{"name": "gap", "unit": "m"}, {"name": "van", "unit": "m/s"}]
    assert [one["values"] for one in found["cases"]] == [
        [gap, van] for gap in (10.0, 25.0, 40.0) for van in (12.0, 26.0)
    ]
    table = pl.read_parquet(workspace().sweeps / done["sweep"] / "cases.parquet")
    names = [one["name"] for one in found["columns"]]
    assert names[-1] == "mean_speed"
    for index, column in enumerate(names):
        told = [one["measures"][index] for one in found["cases"]]
        assert told == [None if v is None else float(v) for v in table[column].to_list()]
    assert found["boundary"]
    assert all(10 <= x <= 40 and 12 <= y <= 26 for line in found["boundary"] for x, y in line)


@pytest.mark.slow
def test_page_and_table_can_be_downloaded_and_nothing_else(
    client: TestClient, done: dict[str, Any]
) -> None:
    files = f"/api/sweeps/{done['sweep']}/files"
    page = client.get(f"{files}/sweep.html")
    assert "6 cases of gap, van" in page.text
    assert "default-src 'none'" in page.headers["Content-Security-Policy"]
    assert client.get(f"{files}/cases/case-002.scenario.json").json()["name"] == "case-002"
    for path in ("sweep.json", "runs/case-001/summary.json", "..%2F..%2Fscenarios", "none.html"):
        assert client.get(f"{files}/{path}").status_code == 404


@pytest.mark.slow
def test_a_case_that_is_opened_runs_alone_with_the_same_figures(
    client: TestClient, done: dict[str, Any], tmp_path: Path
) -> None:
    found = client.get(f"/api/sweeps/{done['sweep']}/cases").json()["cases"]
    case = next(one["case"] for one in found if one["safe"] is False)
    opened = asked(client, f"/{done['sweep']}/cases/{case}/scenario", {}, status=201)
    assert opened["name"] == f"{NAME}-1-{case}"
    assert opened["document"]["formulas"] == {}
    assert opened["document"]["name"].endswith(f", {case}")
    again = asked(client, f"/{done['sweep']}/cases/{case}/scenario", {}, status=201)
    assert again["name"] == opened["name"]
    there = Run.open(workspace().sweeps / done["sweep"] / "runs" / case)

    settings = RunSettings(recording=Recording(emissions=False, criticality=True))
    file = workspace().scenarios / f"{opened['name']}{SUFFIX}"
    alone = run(workspace(), file, settings=settings, out=tmp_path)
    assert alone.figures == there.figures
    assert alone.figures["min_ttc"] is not None
    assert alone.trajectories().equals(there.trajectories())

    started = client.post("/api/runs", json={"scenario": opened["name"]}).json()["run"]
    assert finished(client, started)["state"] == "completed"
    figures = Run.open(workspace().runs / started).figures
    assert figures["min_ttc"] == there.figures["min_ttc"]
    met = {one["criterion"]: one["passed"] for one in _summary(client, started)["criteria"]}
    assert met.keys() == {"collided(ego) == 0", "min_ttc(ego) >= 0.8 s"}
    assert not all(met.values())
    shared = [name for name in figures if there.figures.get(name) is not None]
    assert {"mean_delay", "vehicle_km"} <= set(shared)
    assert {name: figures[name] for name in shared} == {
        name: there.figures[name] for name in shared
    }

    edit = {"version": opened["version"], "edits": [{"kind": "set_seed", "seed": 9}]}
    assert client.post(f"/api/scenarios/{opened['name']}/edits", json=edit).status_code == 200
    other = asked(client, f"/{done['sweep']}/cases/{case}/scenario", {}, status=201)
    assert other["name"] == f"{opened['name']}-1"


@pytest.mark.slow
def test_a_sweep_that_was_stopped_and_resumed_has_the_same_table(
    client: TestClient, done: dict[str, Any]
) -> None:
    name = asked(client, "", WISH)["sweep"]
    refused = client.post("/api/sweeps", json=WISH)
    assert refused.status_code == 409
    assert "is under way" in refused.json()["error"]["message"]
    wait_for(lambda: client.get(f"/api/sweeps/{name}").json()["ended"] >= 1, seconds=60)
    asked(client, f"/{name}/stop")
    stopped = ended(client, name)
    assert stopped["state"] == "stopped"
    assert 1 <= stopped["ended"] < 6
    partly = client.get(f"/api/sweeps/{name}/cases").json()["cases"]
    assert [one["status"] for one in partly].count("completed") == stopped["ended"]
    assert "waiting" in {one["status"] for one in partly}
    assert client.post(f"/api/sweeps/{name}/stop").status_code == 409

    asked(client, f"/{name}/resume", {"processes": 2})
    assert ended(client, name)["state"] == "done"
    for file in ("cases.parquet", "sweep.html"):
        first, second = (workspace().sweeps / one / file for one in (done["sweep"], name))
        assert first.read_bytes() == second.read_bytes()
    assert client.post(f"/api/sweeps/{name}/resume", json={}).status_code == 409

    assert client.delete(f"/api/sweeps/{name}").status_code == 204
    assert client.get(f"/api/sweeps/{name}").status_code == 404
    assert not (workspace().sweeps / name).exists()


@pytest.mark.slow
def test_a_plan_says_how_many_cases_there_are_and_what_they_take(client: TestClient) -> None:
    planned = asked(client, "/plan", {**WISH, "processes": 2}, status=200)
    assert (planned["cases"], planned["tried"]) == (6, "case-004")
    assert 0 < planned["case_seconds"] < 60
    share = planned["case_seconds"] * 6 / planned["processes"]
    assert planned["seconds"] == pytest.approx(share)
    assert planned["disk"] > 6 * 1000
    assert not [one for one in client.get("/api/sweeps").json() if one["state"] == "running"]


@pytest.mark.slow
def test_values_of_a_table_belong_together(client: TestClient) -> None:
    rows = {"parameters": ["van", "gap"], "table": [[12, 10], [26, 40]]}
    planned = asked(client, "/plan", {**WISH, "vary": [rows]}, status=200)
    assert (planned["cases"], planned["tried"]) == (2, "case-002")
    answer = client.post(
        "/api/sweeps/plan", json={**WISH, "vary": [{**rows, "table": [[12, 10], [26]]}]}
    )
    assert answer.status_code == 422
    assert "vary[0]" in answer.json()["error"]["message"]


def test_a_sweep_of_a_server_that_has_ended_is_stopped_and_can_be_deleted(
    client: TestClient,
) -> None:
    plan = SweepPlan((axis_from_text("gap=10,20,30"),))
    begin_sweep(workspace().sweeps / f"{NAME}-99", loads(cut_in()), plan, SweepSettings())
    info = client.get(f"/api/sweeps/{NAME}-99").json()
    assert (info["state"], info["cases"], info["ended"], info["safe"]) == ("stopped", 3, 0, None)
    table = client.get(f"/api/sweeps/{NAME}-99/cases").json()
    assert [one["status"] for one in table["cases"]] == ["waiting"] * 3
    assert client.delete(f"/api/sweeps/{NAME}-99").status_code == 204
    assert client.get(f"/api/sweeps/{NAME}-99").status_code == 404


@pytest.mark.slow
def test_a_case_that_takes_too_long_is_given_up_by_the_estimate() -> None:
    plan = SweepPlan((axis_from_text("gap=10,20"),))
    data = json.loads(cut_in())
    data["simulation"]["duration"] = 500_000.0
    data["actors"][0] |= {"speed": 0.15, "initial_speed": 0.15}
    crawling = loads(json.dumps(data))  # 4,000 s to the goal: a second of computing
    found = estimate(workspace(), crawling, plan, settings=SweepSettings(), patience=0.05)
    assert not found.whole
    assert found.seconds >= 0.05


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"vary": [{"parameter": "speed", "values": [1]}]}, "no parameter 'speed'"),
        ({"vary": [{"parameter": "gap", "low": 5}]}, "not a finite number"),
        ({"vary": [{"parameter": "gap", "low": 5, "high": 9}]}, "needs the number of steps"),
        ({"vary": [*VARY, VARY[0]]}, "'gap' is varied twice"),
        ({"method": "sobol"}, "needs a number of samples"),
        ({"safe": ["min_tt >= 1"]}, "no column 'min_tt'"),
        ({"figures": ["speediness"]}, "no figure of runs is called 'speediness'"),
        ({"vary": [{"parameter": "gap", "values": [500]}]}, r"value 500 is outside 5..50 m"),
    ],
)
def test_what_cannot_be_swept_is_refused_by_the_plan(
    client: TestClient, changes: dict[str, Any], words: str
) -> None:
    answer = client.post("/api/sweeps/plan", json={**WISH, **changes})
    assert answer.status_code == 422
    assert words in answer.json()["error"]["message"]


def test_names_of_sweeps_and_cases_that_are_none_are_not_found(client: TestClient) -> None:
    for path in ("/none", "/none/cases", "/none/files/sweep.html"):
        assert client.get(f"/api/sweeps{path}").status_code == 404
    assert client.post("/api/sweeps/none/cases/case-001/scenario", json={}).status_code == 404


def test_the_page_resumes_no_sweep_whose_folder_names_code(
    client: TestClient, tmp_path: Path
) -> None:
    mark, name = tmp_path / "executed", f"{NAME}-901"
    plan = SweepPlan((axis_from_text("gap=10,40"),))
    for number, door in enumerate(
        (BehaviourDoor(command=f"touch {mark}"), BehaviourDoor(socket=str(mark)))
    ):
        folder = workspace().sweeps / f"{name}{number}"
        begin_sweep(folder, loads(cut_in()), plan, SweepSettings(behaviour=door))
        refused = asked(client, f"/{folder.name}/resume", {"processes": 1}, status=422)
        assert "what a folder says is not executed" in refused["error"]["message"]
        assert not (folder / "runs").exists()
        shutil.rmtree(folder)
    assert not mark.exists()
