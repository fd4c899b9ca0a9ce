"""Tables, whole days and the fit to counts, over the wire."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from starlette.testclient import TestClient

from odscen.app.demand import demands
from odscen.app.maps import load_map
from odscen.maps.store import Workspace
from odscen.scenario import edits
from odscen.scenario.checks import demand_checks
from odscen.scenario.checks.demand_checks import demand_problems
from odscen.scenario.demand.count_stations import place_points
from odscen.scenario.document.json_form import loads
from odscen.scenario.document.problems import Problem
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.edits import demand_edits
from odscen.scenario.placing.region import Region
from tests.web.conftest import CROSSING, finished, job, wait_for


@pytest.fixture
def state(client: TestClient) -> dict[str, Any]:
    """A scenario on the whole crossing, empty."""
    answer = client.post("/api/scenarios", json={"map": CROSSING, "name": "mine"})
    segments = ["j10001", "r1", "r2", "r3", "r4"]
    edits = [{"kind": "grow_roi", "segment": segment} for segment in segments]
    body = {"version": answer.json()["version"], "edits": edits}
    made: dict[str, Any] = client.post("/api/scenarios/mine/edits", json=body).json()
    assert made["document"]["roi"] == segments
    return made


def send(client: TestClient, version: int, kind: str, text: str | bytes, **fields: str) -> Any:
    return client.post(
        "/api/scenarios/mine/demand/table",
        files={"file": ("table.csv", text)},
        data={"version": str(version), "kind": kind, **fields},
    )


def test_tables_are_read_in_and_taken_back(client: TestClient, state: dict[str, Any]) -> None:
    zones = send(client, state["version"], "zones", "zone,segment\nwest,r1\n").json()
    day = send(client, zones["version"], "profile", "share\n1\n3\n", part="market").json()
    trips = send(
        client, day["version"], "od", "from;to;trips\nwest;r2;30\n", part="am", day="market"
    ).json()
    counts = send(
        client, trips["version"], "counts", "place,begin,end,count\nr1>j10001,0,900,12\n"
    ).json()
    demand = counts["document"]["demand"]
    assert demand["matrices"][0]["trips"] == [["west", "r2", 30]]
    assert (demand["matrices"][0]["id"], demand["matrices"][0]["profile"]) == ("am", "market")
    assert demand["counts"][0]["rows"] == [["r1>j10001", 0, 900, 12]]
    assert counts["undo"] == "Table of counts"
    undone = client.post("/api/scenarios/mine/undo", json={"version": counts["version"]}).json()
    assert undone["document"] == trips["document"]


def test_files_of_other_programs_are_named_and_read_in(
    client: TestClient, state: dict[str, Any]
) -> None:
    matrix = "$V;D2\n7.00 8.00\n1\n2\nr1 r2\n0 30\n20 0\n"
    refused = send(client, state["version"], "od", matrix)
    assert refused.status_code == 422
    assert "this seems to be a VISUM matrix in format V with 2 zones" in refused.text
    assert "File of another program" in refused.text
    answer = send(client, state["version"], "office", matrix).json()
    assert answer["undo"] == "Import of a VISUM matrix in format V with 2 zones"
    (found,) = answer["document"]["demand"]["matrices"]
    assert found["trips"] == [["r1", "r2", 30], ["r2", "r1", 20]]
    wrong = send(client, answer["version"], "office", "$V;D2\n7.00 8.00\n1\n2\nr1 r2\n0 x\n")
    assert wrong.status_code == 422
    assert "line 6: 'x' is no number" in wrong.text


@pytest.mark.parametrize(
    ("kind", "text", "told"),
    [
        (
            "od",
            "from,to,trips\nr1,r2,3\nr1,gone,3\n",
            ["line 3, column 'to': 'gone' is neither a zone nor a segment of the map"],
        ),
        (
            "counts",
            "place,begin,end,count\nr1>r2,0,900,3\nr9,0,900,3\nr2,0,600,3\n",
            ["line 2, column 'place'", "line 3, column 'place'", "line 4: the slice"],
        ),
        ("zones", "zone,segment\nin,r1\nout,r7\n", ["line 3, column 'segment'"]),
        (
            "inputs",
            "segment,0,900\nr1,1,2\nr9,1,2\nr8,1,2\n",
            ["line 3: the map has no segment 'r9'", "line 4: the map has no segment 'r8'"],
        ),
        ("profile", "share\n0\n0\n", ["at least one share must be above 0"]),
        ("od", "from,to,trips\nr1,r2,-3\n", ["line 2: trips must be a number from 0 on"]),
        ("od", "from,to,trips\nr1,r2,3\n".encode("utf-16"), ["not a text file in UTF-8"]),
        ("od", "", ["needed are from, to, trips"]),
    ],
)
def test_a_wrong_table_is_refused_by_line_and_column_and_changes_nothing(
    client: TestClient, state: dict[str, Any], kind: str, text: str | bytes, told: list[str]
) -> None:
    answer = send(client, state["version"], kind, text)
    assert answer.status_code == 422
    error = answer.json()["error"]
    said = "\n".join([error["message"], *error["problems"]])
    for words in told:
        assert words in said
    assert client.get("/api/scenarios/mine").json() == state


@pytest.mark.parametrize(
    ("kind", "head", "row"),
    [
        ("inputs", "segment,0,900", "r1,1,2"),
        ("zones", "zone,segment", "z{n},r1"),
        ("od", "from,to,trips,begin,end", "r1,r2,1,{n},1000"),
    ],
)
def test_a_table_of_many_rows_is_checked_once(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch, kind: str, head: str, row: str
) -> None:
    checks: list[int] = []

    def counted(scenario: Scenario, region: Region) -> Iterator[Problem]:
        checks.append(len(scenario.demand.inputs))
        return demand_problems(scenario, region)

    monkeypatch.setattr(demand_edits, "demand_problems", counted)
    loaded = load_map(workspace.map(CROSSING))
    empty = edits.new_scenario(loaded.sumo.graph, name="t", roi=("j10001", "r1", "r2", "r3", "r4"))
    rows = [row.format(n=n) for n in range(200)]
    made = demands.import_text(loaded, empty, "\n".join([head, *rows]), kind=kind)
    parts = {"inputs": made.demand.inputs, "zones": made.demand.zones, "od": made.demand.matrices}
    assert len(parts[kind]) == 200
    assert len(checks) == 1


def test_where_an_entry_leads_is_searched_once_for_all_of_its_rows(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At each check of the scenario: a table of 2,000 rows made one unusable for minutes."""
    searched: list[tuple[int, ...]] = []
    search = demand_checks._reached_segments

    def counted(nodes: tuple[int, ...], region: Region) -> frozenset[str]:
        searched.append(nodes)
        return search(nodes, region)

    monkeypatch.setattr(demand_checks, "_reached_segments", counted)
    loaded = load_map(workspace.map(CROSSING))
    empty = edits.new_scenario(loaded.sumo.graph, name="t", roi=("j10001", "r1", "r2", "r3", "r4"))
    table = "segment,0,900\n" + "r1,1,2\nr2,1,2\n" * 100
    made = demands.import_text(loaded, empty, table, kind="inputs", to=(("r3", 1.0),))
    assert [part.to for part in made.demand.inputs] == [(("r3", 1.0),)] * 200
    assert len(searched) == 2


@pytest.mark.slow
def test_a_whole_day_keeps_who_is_there_and_is_one_step_for_undo(
    client: TestClient, state: dict[str, Any], workspace: Workspace
) -> None:
    wish = {"version": state["version"], "trips": 400}
    ended = job(client, client.post("/api/scenarios/mine/demand/day", json=wish))
    assert (ended["state"], ended["result"]) == ("done", "mine"), ended["error"]
    made, scenario = ended["day"], client.get("/api/scenarios/mine").json()
    document = scenario["document"]
    ids = load_map(workspace.map(CROSSING)).sumo.graph.segments.ids
    assert set(document["roi"]) == set(ids)
    assert document["simulation"]["duration"] == 86_400
    (matrix,) = document["demand"]["matrices"]
    assert (matrix["profile"], matrix["begin"], matrix["end"]) == ("weekday", 0, 86_400)
    assert sum(row[2] for row in matrix["trips"]) == pytest.approx(made["trips"], rel=0.02)
    assert made["volume"] < made["capacity"]
    assert "busiest hour is usable with 2 seeds" in made["found"]
    assert not [one for one in scenario["problems"] if one["severity"] == "error"]
    again = job(client, client.post("/api/scenarios/mine/demand/day", json=wish))
    assert (again["state"], again["error"]["kind"]) == ("failed", "ConflictError")
    body = {"version": scenario["version"]}
    undone = client.post("/api/scenarios/mine/undo", json=body).json()
    assert undone["document"] == state["document"]


@pytest.mark.slow
def test_a_day_that_is_being_tried_is_cancelled_within_a_second_and_changes_nothing(
    client: TestClient, state: dict[str, Any]
) -> None:
    wish = {"version": state["version"], "trips": 40_000}
    begun = client.post("/api/scenarios/mine/demand/day", json=wish).json()["job"]
    path = f"/api/jobs/{begun}"
    wait_for(lambda: client.get(path).json()["step"] == "trying the busiest hour")
    other = client.post("/api/scenarios/mine/demand/day", json=wish)
    assert other.status_code == 409
    assert begun in other.json()["error"]["message"]
    assert client.delete(path).status_code == 202
    wait_for(lambda: client.get(path).json()["state"] == "cancelled")
    assert client.get("/api/scenarios/mine").json() == state


@pytest.mark.slow
def test_the_fit_of_a_run_is_that_of_its_trajectories_with_places_on_the_map(
    client: TestClient, state: dict[str, Any], workspace: Workspace
) -> None:
    text = "place,begin,end,count\nr1>j10001,0,300,25\nr1>j10001>r2,0,300,900\n"
    version = send(client, state["version"], "counts", text).json()["version"]
    edit = {"kind": "set_simulation", "duration": 300}
    client.post("/api/scenarios/mine/edits", json={"version": version, "edits": [edit]})
    run = client.post("/api/runs", json={"scenario": "mine"}).json()["run"]
    assert finished(client, run)["state"] == "completed"
    assert client.get(f"/api/runs/{run}/content").json()["counts"] == 2
    found = client.get(f"/api/runs/{run}/fit").json()
    ours = demands.fit_counts(workspace, workspace.runs / run)
    assert [row["modelled"] for row in found["rows"]] == [row.modelled for row in ours.rows]
    assert found["met"] == sum(row.met for row in ours.rows) < 2
    assert "add up to 900" in found["rows"][1]["why"]
    scenario = loads(json.dumps(client.get("/api/scenarios/mine").json()["document"]))
    graph = load_map(workspace.map(CROSSING)).sumo.graph
    points = place_points(graph, [row[0] for row in scenario.demand.counts[0].rows])
    assert [(row["x"], row["y"]) for row in found["rows"]] == list(points.values())


@pytest.mark.slow
def test_a_run_without_counts_has_no_fit(client: TestClient, sampled: str) -> None:
    run = client.post("/api/runs", json={"scenario": sampled, "until": 5}).json()["run"]
    finished(client, run)
    assert client.get(f"/api/runs/{run}/content").json()["counts"] == 0
    assert client.get(f"/api/runs/{run}/fit").status_code == 422
