"""Routes by travel time in real runs on the shipped town."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from lxml import etree

from odscen.app.maps import LoadedMap, load_map
from odscen.app.running.reports import write_report
from odscen.app.running.runs import carry_out, check_run, prepare_run
from odscen.maps.store import Workspace
from odscen.records.assignment_steps import Assignment, AssignmentStep
from odscen.records.run_plan import Plan
from odscen.runs.layout import ASSIGNMENT_FILE, ROUTES_FILE
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.scenario_document import MapReference, Scenario
from odscen.sumo.realize.realization import realize
from odscen.sumo.runner.assignment import AssignedRoutes, assign_routes
from odscen.sumo.runner.long_runs import resume
from odscen.sumo.runner.run_jobs import run_prepared
from tests.reporters import Listener
from tests.sumo.runner.test_long_runs import TOWN, killed, results

pytestmark = pytest.mark.slow(together=True)

if TYPE_CHECKING:
    from pathlib import Path

UNTIL = 900.0


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    made = Workspace.open(tmp_path_factory.mktemp("assignment"))
    made.add_map(TOWN)
    return made


@pytest.fixture(scope="module")
def town(workspace: Workspace) -> LoadedMap:
    return load_map(workspace.map("town_5x5"))


def scenario(loaded: LoadedMap, routes: dict[str, Any], **fields: Any) -> Scenario:
    graph = loaded.sumo.graph
    place = MapReference(name=graph.map_name, sha256=graph.map_sha256, spacing=graph.lanes.spacing)
    demand = {"background": [{"id": "b", "trips": 500.0, "end": 600.0}], "routes": routes}
    return Scenario.model_validate(
        {
            "name": "test",
            "map": place,
            "roi": tuple(map(str, graph.segments.ids)),
            "demand": demand,
            "simulation": {"duration": UNTIL},
            "actors": [{"id": "placed", "category": "car", "spawn": "1.0.-1.2"}],
            **fields,
        }
    )


BY_TIME = {"by": "travel_time", "iterations": 4, "gap": 0.0, "interval": 300.0}


@pytest.fixture(scope="module")
def assigned(workspace: Workspace, town: LoadedMap) -> AssignedRoutes:
    return found(workspace, town)


def found(workspace: Workspace, town: LoadedMap) -> AssignedRoutes:
    net = workspace.map("town_5x5").checked("net")
    return assign_routes(scenario(town, BY_TIME), town.sumo, net, settings=RunSettings())


def edges(files: dict[str, str]) -> dict[str, str]:
    tree = etree.fromstring(files[ROUTES_FILE].encode())
    return {one.get("id"): one.find("route").get("edges") for one in tree.iter("vehicle")}


def test_the_gap_shrinks_and_the_routes_of_the_smallest_are_kept(assigned: AssignedRoutes) -> None:
    steps = assigned.found.steps
    assert [step.iteration for step in steps] == [1, 2, 3, 4]
    assert steps[0].gap > 0.02
    assert assigned.found.gap == min(step.gap for step in steps) < 0.5 * steps[0].gap
    assert steps[-1].travel_time < steps[0].travel_time
    assert all(step.teleported == step.waiting == 0 for step in steps)
    assert steps[1].changed <= 250


def test_the_same_scenario_finds_the_same_routes(
    workspace: Workspace, town: LoadedMap, assigned: AssignedRoutes
) -> None:
    again = found(workspace, town)
    assert again.found == assigned.found
    assert again.paths.keys() == assigned.paths.keys()
    assert all(np.array_equal(again.paths[name], path) for name, path in assigned.paths.items())


def test_trips_that_are_not_run_choose_routes_too(workspace: Workspace, town: LoadedMap) -> None:
    net, wanted = workspace.map("town_5x5").checked("net"), {**BY_TIME, "iterations": 2}
    more = {"background": [{"id": "b", "trips": 900.0, "end": 600.0}], "routes": wanted}
    found = assign_routes(
        scenario(town, wanted),
        town.sumo,
        net,
        settings=RunSettings(),
        wider=scenario(town, wanted, demand=more),
    )
    assert {f"b.{number}" for number in range(900)} == found.paths.keys()
    first = assign_routes(scenario(town, wanted), town.sumo, net, settings=RunSettings())
    assert found.found.steps[0].travel_time == first.found.steps[0].travel_time


def test_placed_actors_keep_the_shortest_route(town: LoadedMap, assigned: AssignedRoutes) -> None:
    by_length = edges(realize(scenario(town, {}), town.sumo).files)
    by_time = edges(realize(scenario(town, BY_TIME), town.sumo, assigned=assigned.paths).files)
    assert by_time["placed"] == by_length["placed"]
    changed = [name for name in by_length if by_time[name] != by_length[name]]
    assert len(changed) > 25


def test_a_run_keeps_how_its_routes_were_found_and_shows_it(
    workspace: Workspace, town: LoadedMap, tmp_path: Path
) -> None:
    wanted = {**BY_TIME, "iterations": 2}
    listener = Listener()
    checked = check_run(workspace, scenario(town, wanted), name="run", out=tmp_path)
    run = carry_out(checked, prepare_run(checked, reporter=listener), reports=False)
    text = (run.folder / ASSIGNMENT_FILE).read_text(encoding="utf-8")
    kept = Assignment.from_json(text)
    assert [step.words for step in kept.steps] == listener.words
    assert run.to_dict()["files"]["assignment"].endswith(ASSIGNMENT_FILE)
    page = write_report(run.folder, run.summary).read_text(encoding="utf-8")
    assert "Routes by travel time" in page
    assert f"a gap of {100 * kept.gap:.2f} %; 0 % was wanted and is not reached" in page


def test_a_resumed_run_has_its_routes_already(
    workspace: Workspace,
    town: LoadedMap,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wanted = {**BY_TIME, "iterations": 2, "informed": 0.5, "period": 30.0}
    settings = RunSettings(slice_length=300.0)
    checked = check_run(
        workspace, scenario(town, wanted), name="alone", out=tmp_path, settings=settings
    )
    prepared = prepare_run(checked)
    alone = results(run_prepared(prepared, tmp_path / "alone").folder)
    killed(prepared, tmp_path / "killed", monkeypatch, KILL_AFTER_SLICE=1)
    resume(tmp_path / "killed")
    assert results(tmp_path / "killed") == alone


def test_a_share_of_drivers_looks_for_quicker_routes(town: LoadedMap) -> None:
    made = realize(scenario(town, {"informed": 0.25, "period": 20.0}), town.sumo)
    plan: Plan = made.plan
    informed = {one.id for one in plan.actors if one.informed}
    assert 0.2 < len(informed) / 500 < 0.3
    assert "placed" not in informed
    tree = etree.fromstring(made.files[ROUTES_FILE].encode())
    periods = {
        one.get("id"): one.find("param[@key='device.rerouting.period']").get("value")
        for one in tree.iter("vehicle")
        if one.find("param") is not None
    }
    assert periods == dict.fromkeys(informed, "20")
    more = realize(scenario(town, {"informed": 0.5}), town.sumo).plan
    assert informed < {one.id for one in more.actors if one.informed}


def test_an_assignment_survives_json() -> None:
    step = AssignmentStep(1, 0.125, None, 3, 2, 1, 0)
    kept = Assignment(0.01, 1, (step,))
    assert Assignment.from_json(kept.to_json()) == kept
    assert json.loads(kept.to_json())["steps"][0]["gap"] == 0.125
    assert step.words == "routes, iteration 1: gap 12.50 %"


def test_informed_drivers_avoid_the_queue_behind_a_broken_down_vehicle(
    workspace: Workspace, town: LoadedMap, tmp_path: Path
) -> None:
    broken = {
        "id": "broken", "kind": "incident", "begin": 100.0, "end": 800.0, "lane": "25.0.-1",
        "s": 40.0,
    }  # fmt: skip
    lost = {}
    for share in (0.0, 1.0):
        one = scenario(town, {"informed": share, "period": 30.0}, measures=[broken])
        name = f"informed-{share:g}"
        run = run_prepared(
            prepare_run(check_run(workspace, one, name=name, out=tmp_path)), tmp_path / name
        )
        assert run.status == "completed"
        lost[share] = run.summary["figures"]["mean_delay"]
    assert lost[1.0] < 0.9 * lost[0.0]
