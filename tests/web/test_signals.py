"""Programs of traffic lights over the wire, of scenarios and of runs."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pytest
from pydantic import TypeAdapter

from odscen.app.scenarios import SUFFIX
from odscen.base.categories import Category
from odscen.runs.recorded import read_calls
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.scenario_document import MapReference
from odscen.web.wire.map_messages import MapDetails
from odscen.web.wire.signal_messages import LightProgramInfo, RunSignals
from tests.signal_case import JUNCTION, program, scenario
from tests.web.conftest import CROSSING, finished

if TYPE_CHECKING:
    from starlette.testclient import TestClient

    from odscen.maps.store import Workspace
    from odscen.scenario.document.scenario_document import Scenario

EVENING = 18.5 * 3600.0 - 60.0


@pytest.fixture
def own(workspace: Workspace) -> str:
    """Name of a scenario with the program of the guide, a minute before its evening plan."""
    return saved(
        workspace, scenario(program(), control="actuated", clock=EVENING, until=120.0), "own"
    )


@pytest.fixture
def buses(workspace: Workspace) -> str:
    """The same, and every third vehicle is a bus with priority."""
    one = scenario(program(bus_priority=True), control="actuated", clock=EVENING, until=120.0)
    mix = {Category.CAR: 0.67, Category.BUS: 0.33}
    flows = tuple(
        flow if Category.PEDESTRIAN in flow.mix else flow.model_copy(update={"mix": mix})
        for flow in one.flows
    )
    return saved(workspace, one.model_copy(update={"flows": flows}), "buses")


def saved(workspace: Workspace, one: Scenario, name: str) -> str:
    sha256 = workspace.map(CROSSING).info["sha256"]
    one = one.model_copy(update={"map": MapReference(name=CROSSING, sha256=sha256)})
    workspace.scenarios.mkdir(exist_ok=True)
    (workspace.scenarios / f"{name}{SUFFIX}").write_text(dumps(one))
    return name


class Watched(NamedTuple):
    """A run seen step by step: at the time of each frame who was on the road, and the detectors."""

    run: str
    rows: dict[float, set[str]]
    occupied: dict[float, set[str]]


def watched(client: TestClient, name: str, *, until: float) -> Watched:
    run = client.post("/api/runs", json={"scenario": name, "until": until, "paused": True})
    seen = Watched(run.json()["run"], {}, {})
    now: dict[str, bool] = {}
    ids: list[str] = []
    with client.websocket_connect(f"/api/runs/{seen.run}/live") as socket:
        while (message := socket.receive())["type"] != "websocket.close":
            if message.get("text") is None:
                frame = np.frombuffer(message["bytes"], "<f4")
                time = round(float(frame[1]), 2)
                seen.rows[time] = {ids[int(row[0])] for row in frame[5:].reshape(-1, 6)}
                seen.occupied[time] = {one for one, on in now.items() if on}
                socket.send_text("ack")
                client.post(f"/api/runs/{seen.run}/control", json={"action": "step"})
                continue
            text = json.loads(message["text"])
            if text["type"] == "hello":
                ids = [f"{one['category']} {one['id']}" for one in text["actors"]]
            if text["type"] == "detectors":
                now |= text["detectors"]
    assert finished(client, seen.run)["state"] == "completed"
    return seen


def exact(model: Any, data: Any) -> Any:
    """The message, if it is all that the schema says and nothing else."""
    adapter = TypeAdapter(model)
    made = adapter.validate_json(json.dumps(data), extra="forbid")
    assert adapter.dump_python(made, mode="json", by_alias=True) == data
    return made


def test_a_program_of_a_scenario_comes_with_plans_pictures_and_whose_it_is(
    client: TestClient, own: str
) -> None:
    answer = client.get(f"/api/scenarios/{own}/signals/{JUNCTION}")
    light = exact(LightProgramInfo, answer.json())
    assert (light.id, light.junctions, light.control) == ("J10001", [JUNCTION], "actuated")
    assert light.origin == "scenario"
    assert [(plan.id, plan.cycle, plan.times) for plan in light.plans] == [
        ("day", 84.0, [6 * 3600.0]), ("evening", 76.0, [18.5 * 3600.0]),
    ]  # fmt: skip
    stage = light.plans[0].stages[0]
    assert (stage.words, stage.split, stage.permissive) == (
        "stage 1: 20 s", 32.0, ["V1", "V1L", "V3", "V3L"],
    )  # fmt: skip
    assert 'href="#signal-ground"' in stage.picture
    assert 'id="signal-ground"' in light.ground
    assert {one.label for one in light.detectors} == {"D1", "C0", "C1"}
    assert not any(one.calls for one in light.detectors)
    assert "all red" in [key.words for key in light.legend]


def test_whose_a_program_is_follows_from_what_the_scenario_changes(
    client: TestClient, sampled: str, workspace: Workspace
) -> None:
    path = f"/api/scenarios/{sampled}/signals/{JUNCTION}"
    assert client.get(path).json()["origin"] == "odscen"
    file = workspace.scenarios / f"{sampled}{SUFFIX}"
    document = json.loads(file.read_text())
    document["signals"] = {"junctions": [{"junction": JUNCTION, "offset": 7}]}
    file.write_text(json.dumps(document))
    again = client.get(path).json()
    assert (again["origin"], again["plans"][0]["offset"]) == ("retimed", 7.0)


def test_an_unknown_light_and_a_program_that_is_refused_are_told(
    client: TestClient, own: str, workspace: Workspace
) -> None:
    wrong = client.get(f"/api/scenarios/{own}/signals/99")
    assert wrong.status_code == 404
    assert JUNCTION in wrong.json()["error"]["message"]
    file = workspace.scenarios / f"{own}{SUFFIX}"
    document = json.loads(file.read_text())
    document["signals"]["junctions"][0]["intergreens"] = [["V2", "P1", 1]]
    file.write_text(json.dumps(document))
    refused = client.get(f"/api/scenarios/{own}/signals/{JUNCTION}")
    assert refused.status_code == 422
    assert "V2" in refused.text


@pytest.mark.slow
def test_a_run_tells_what_its_lights_showed_and_when_detectors_were_occupied(
    client: TestClient, own: str
) -> None:
    wish = {"scenario": own, "until": 100, "paused": True}
    run = client.post("/api/runs", json=wish).json()["run"]
    under_way = exact(LightProgramInfo, client.get(f"/api/runs/{run}/signals/{JUNCTION}").json())
    assert [plan.id for plan in under_way.plans] == ["day", "evening"]
    client.post(f"/api/runs/{run}/control", json={"action": "resume"})
    assert finished(client, run)["state"] == "completed"
    (shown,) = exact(RunSignals, client.get(f"/api/runs/{run}/signals").json()).lights
    assert shown.light == "J10001"
    assert len(shown.times) == len(shown.shown) == len(shown.plans)
    assert shown.times == sorted(shown.times)
    assert {"day", "evening"} >= set(shown.plans)
    light = exact(LightProgramInfo, client.get(f"/api/runs/{run}/signals/{JUNCTION}").json())
    greens = {one.state for one in light.plans[0].phases if one.stage in ("1", "2", "3")}
    assert greens <= set(shown.states)  # stage 4 comes on call only
    calls = [call for one in light.detectors if one.label == "D1" for call in one.calls]
    assert calls
    assert all(0.0 <= begin < end <= 100.0 for begin, end in calls)
    assert client.get(f"/api/runs/{run}/signals/99").status_code == 404
    assert client.get("/api/runs/nothing/signals").status_code == 404
    assert client.get("/api/runs/nothing/signals/1").status_code == 404


@pytest.mark.slow
def test_a_run_that_is_watched_shows_which_detectors_are_occupied_as_its_log_says_later(
    client: TestClient, workspace: Workspace
) -> None:
    one = scenario(program(), control="actuated", clock=EVENING, walkers=600.0, until=120.0)
    seen = watched(client, saved(workspace, one, "busy"), until=100.0)
    calls = read_calls(workspace.runs / seen.run)
    assert calls is not None

    def logged(time: float) -> set[str]:
        return {name for name, begin, end in calls.iter_rows() if begin <= time < end}

    *times, _ = sorted(seen.occupied)  # the log ends before the last one
    assert len(times) > 150
    for time in times:
        # SUMO logs the state at one instant of each step.
        assert logged(time + 0.5) <= seen.occupied[time] <= logged(time) | logged(time + 0.5)
    light = client.get(f"/api/runs/{seen.run}/signals/{JUNCTION}").json()
    kinds = {one["id"]: one["call"] for one in light["detectors"]}
    assert {kinds[name] for on in seen.occupied.values() for name in on} == {False, True}


@pytest.mark.slow
def test_areas_for_buses_are_shown_and_occupied_only_while_a_bus_is_under_way(
    client: TestClient, buses: str
) -> None:
    light = client.get(f"/api/scenarios/{buses}/signals/{JUNCTION}").json()
    areas = [one for one in light["detectors"] if one["bus"]]
    assert {(one["label"], round(one["length"]), one["call"]) for one in areas} == {
        ("buses", 80, False)
    }
    assert all(f'data-detector="{one["id"]}"' in light["site"] for one in light["detectors"])
    assert "area in which buses are seen" in [key["words"] for key in light["legend"]]
    names = {one["id"] for one in areas}
    seen = watched(client, buses, until=60.0)
    there = {t: any(one.startswith("bus ") for one in rows) for t, rows in seen.rows.items()}
    assert any(names & on for on in seen.occupied.values())
    assert not any(names & on for t, on in seen.occupied.items() if not there[t])


def test_a_map_tells_where_its_signals_are(client: TestClient) -> None:
    (light,) = exact(MapDetails, client.get(f"/api/maps/{CROSSING}").json()).lights
    assert len(light.paths) == len(light.walks) == len(light.signals) == 24
    assert sum(light.walks) == 4
    assert light.paths[0][0] == (22.0, 5.75)


def state(client: TestClient, name: str) -> dict[str, Any]:
    found: dict[str, Any] = client.get(f"/api/scenarios/{name}").json()
    return found


def edited(client: TestClient, name: str, **edit: Any) -> Any:
    wish = {"version": state(client, name)["version"], "edits": [edit]}
    return client.post(f"/api/scenarios/{name}/edits", json=wish)


def post(client: TestClient, name: str, path: str, **wish: Any) -> Any:
    body = {"version": state(client, name)["version"], **wish}
    return client.post(f"/api/scenarios/{name}/{path}", json=body)


def shown(client: TestClient, name: str) -> dict[str, Any]:
    found: dict[str, Any] = client.get(f"/api/scenarios/{name}/signals/{JUNCTION}").json()
    return found


@pytest.mark.slow
def test_a_green_five_seconds_longer_is_in_sumos_file_and_in_what_a_run_shows(
    client: TestClient, sampled: str
) -> None:
    before = shown(client, sampled)["plans"][0]
    assert [one["end"] - one["begin"] for one in before["stages"]] == [13.0, 13.0]
    wish = {"kind": "set_green", "junction": JUNCTION, "stage": "1", "green": 18}
    assert edited(client, sampled, **wish).status_code == 200
    after = shown(client, sampled)["plans"][0]
    assert [one["end"] - one["begin"] for one in after["stages"]] == [18.0, 13.0]
    assert after["cycle"] == before["cycle"] + 5.0
    file = client.get(f"/api/scenarios/{sampled}/signals.add.xml")
    assert file.headers["content-type"].startswith("application/xml")
    assert 'duration="18"' in file.text
    run = client.post("/api/runs", json={"scenario": sampled, "until": 90}).json()["run"]
    assert finished(client, run)["state"] == "completed"
    (lights,) = client.get(f"/api/runs/{run}/signals").json()["lights"]
    green = next(one["state"] for one in after["phases"] if one["stage"] == "1")
    times = [*lights["times"], 90.0]
    lasted = [
        times[n + 1] - times[n]
        for n, row in enumerate(lights["shown"])
        if lights["states"][row] == green
    ]
    assert lasted[0] == pytest.approx(18.0, abs=0.5)
    version = state(client, sampled)["version"]
    undone = client.post(f"/api/scenarios/{sampled}/undo", json={"version": version}).json()
    assert undone["document"]["signals"]["junctions"] == []


def test_a_refused_green_says_why_and_changes_nothing(client: TestClient, own: str) -> None:
    before = state(client, own)
    wish = {"kind": "set_green", "junction": JUNCTION, "stage": "1", "green": 36, "plan": "day"}
    refused = edited(client, own, **wish)
    assert refused.status_code == 422
    assert "max_green of 35 s" in refused.json()["error"]["message"]
    assert state(client, own) == before


@pytest.mark.slow
def test_the_maps_program_is_taken_over_and_its_turn_gets_an_arrow(
    client: TestClient, sampled: str
) -> None:
    turn = {"approach": "r1", "turn": "left", "treatment": "permissive", "alone": True}
    assert shown(client, sampled)["turns"][0] == turn
    answer = post(client, sampled, f"signals/{JUNCTION}/own")
    assert answer.json()["label"] == f"Take over the program of {JUNCTION}"
    assert shown(client, sampled)["origin"] == "scenario"
    again = post(client, sampled, f"signals/{JUNCTION}/own")
    assert again.status_code == 422
    wish = {"kind": "set_turn", "junction": JUNCTION, "approach": "r1", "treatment": "both"}
    assert edited(client, sampled, **wish).status_code == 200
    light = shown(client, sampled)
    assert light["turns"][0] == {**turn, "treatment": "both"}
    assert [stage["id"] for stage in light["plans"][0]["stages"]] == ["1", "3", "2"]


def test_a_cycle_is_stretched_as_a_whole_and_too_short_a_one_refused(
    client: TestClient, own: str
) -> None:
    path = f"signals/{JUNCTION}/cycle"
    assert post(client, own, path, cycle=100, plan="day").status_code == 200
    day, evening = shown(client, own)["plans"]
    assert (day["cycle"], evening["cycle"]) == (100.0, 76.0)
    refused = post(client, own, path, cycle=30, plan="day")
    assert refused.status_code == 422
    assert "least greens and intergreens" in refused.json()["error"]["message"]
    assert post(client, own, path, cycle=90, plan="night").status_code == 404


def test_lights_are_timed_after_the_demand_and_programs_go_out_and_come_back(
    client: TestClient, sampled: str, workspace: Workspace
) -> None:
    one = scenario(None, vehicles=500.0, walkers=0.0, until=120.0)
    name = saved(workspace, one, "demand")
    timed = post(client, name, "signal-times/webster").json()
    assert timed["notes"][0].startswith(f"Junction {JUNCTION}: cycle ")
    (timing,) = timed["state"]["document"]["signals"]["junctions"]
    assert len(timing["green"]) == 2
    file = client.get(f"/api/scenarios/{name}/signals.add.xml").content
    version = state(client, sampled)["version"]
    taken = client.post(
        f"/api/scenarios/{sampled}/signal-times/import",
        data={"version": version},
        files={"file": ("signals.add.xml", file)},
    ).json()
    (back,) = taken["state"]["document"]["signals"]["junctions"]
    assert back["junction"] == JUNCTION
    assert taken["state"]["label"] == "Import signal programs"
    wrong = client.post(
        f"/api/scenarios/{sampled}/signal-times/import",
        data={"version": version + 1},
        files={"file": ("roads.xml", b"<net/>")},
    )
    assert wrong.status_code == 422
    assert "roads.xml" in wrong.text
    alone = post(client, name, "signal-times/corridor", junctions=[JUNCTION])
    assert alone.status_code == 422
    assert "needs two traffic lights" in alone.json()["error"]["message"]


def test_turns_get_arrows_before_lights_are_timed_if_that_is_asked_for(
    client: TestClient, workspace: Workspace
) -> None:
    name = saved(workspace, scenario(None, vehicles=900.0, walkers=0.0, until=120.0), "busy")
    timed = post(client, name, "signal-times/webster", turn_arrows=True).json()
    said = f"Junction {JUNCTION}: the left turn from r1 has got an arrow ("
    assert timed["notes"][0].startswith(said)
    (timing,) = timed["state"]["document"]["signals"]["junctions"]
    assert len(timing["stages"]) == 4
    assert sum(not stage["permissive"] for stage in timing["stages"]) == 2
    version = {"version": timed["state"]["version"]}
    undone = client.post(f"/api/scenarios/{name}/undo", json=version).json()
    assert undone["document"]["signals"]["junctions"] == [], "one step for undo"
    quiet = saved(workspace, scenario(None, vehicles=200.0, walkers=0.0, until=120.0), "quiet")
    few = post(client, quiet, "signal-times/webster", turn_arrows=True).json()
    assert few["notes"][0].startswith("No turn has got an arrow: ")
    assert few["notes"][1].startswith(f"Junction {JUNCTION}: cycle ")
