from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from odscen.app.maps import load_map
from odscen.app.running.runs import run
from odscen.app.running.watched_runs import watch
from odscen.app.scenarios import read_scenario
from odscen.base.categories import Category
from odscen.base.errors import ConflictError, ScenarioError
from odscen.lanegraph.query import node_id
from odscen.maps.store import Workspace
from odscen.records.run_events import events_from_json
from odscen.runs.finished_run import Run
from odscen.runs.recorded import read_light_states
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.scenario_document import (
    Actor,
    Background,
    Demand,
    Scenario,
    Simulation,
)

SETTINGS = RunSettings(until=20.0)


@pytest.fixture(scope="module")
def plain(workspace: Workspace, sampled: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    return run(workspace, sampled, settings=SETTINGS, out=tmp_path_factory.mktemp("plain"))


def watchers() -> list[threading.Thread]:
    return [one for one in threading.enumerate() if one.name == "odscen-watch"]


@pytest.mark.slow
def test_a_watched_run_has_the_bytes_of_one_that_is_not(
    workspace: Workspace, sampled: Path, tmp_path: Path, plain: Run
) -> None:
    with watch(workspace, sampled, settings=SETTINGS, out=tmp_path) as steps:
        times = [step.time for step in steps]
    assert times == [0.5 * number for number in range(40)]
    for name in ("trajectories.parquet", "events.json", "actors.json", "figures.json"):
        assert (steps.run.folder / name).read_bytes() == (plain.folder / name).read_bytes()
    assert steps.run.report is not None
    assert watchers() == []


@pytest.mark.slow
def test_steps_are_where_the_trajectories_are(
    workspace: Workspace, sampled: Path, tmp_path: Path, plain: Run
) -> None:
    recorded = plain.trajectories()
    with watch(workspace, sampled, settings=SETTINGS, out=tmp_path) as steps:
        for step in steps:
            count = len(step.ids)
            for values in (step.x, step.y, step.z, step.hdg, step.pitch, step.speed, step.index):
                assert values.shape == (count,)
            rows = recorded.filter(pl.col("time") == step.time).sort("id")
            order = np.argsort(step.ids)
            assert rows["id"].to_list() == step.ids[order].tolist()
            x, y, speed = (rows[name].to_numpy() for name in ("x", "y", "speed"))
            assert np.hypot(x - step.x[order], y - step.y[order]).max(initial=0.0) < 0.01
            # Recorded is the speed of the body, which moves aside in a change of lanes and turns.
            assert np.abs(speed - step.speed[order]).max(initial=0.0) < 1.5
            assert np.median(np.abs(speed - step.speed[order])) < 1e-4


@pytest.mark.slow
def test_leaving_the_loop_stops_the_run_and_keeps_what_happened(
    workspace: Workspace, sampled: Path, tmp_path: Path, plain: Run
) -> None:
    with watch(workspace, sampled, settings=SETTINGS, out=tmp_path) as steps:
        for step in steps:
            if step.time >= 5.0:
                break
        with pytest.raises(ConflictError, match="has not ended"):
            _ = steps.run
    summary = steps.run.summary
    assert (summary["status"], summary["stopped"]) == ("completed", True)
    assert 5.0 <= summary["sim_seconds"] <= 7.0
    # The speed of the last record is that of one step, not of two.
    early = steps.run.trajectories().filter(pl.col("time") <= 5.0).drop("speed")
    assert early.equals(plain.trajectories().filter(pl.col("time") <= 5.0).drop("speed"))
    assert watchers() == []


@pytest.mark.slow
def test_an_error_in_the_loop_comes_out_and_leaves_no_process(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    seen = []

    def look() -> None:
        with watch(workspace, sampled, settings=SETTINGS, out=tmp_path) as steps:
            seen.append(steps)
            for step in steps:
                _ = 1 / (step.time < 3.0)

    with pytest.raises(ZeroDivisionError):
        look()
    assert seen[0].run.summary["stopped"] is True
    assert watchers() == []


@pytest.mark.slow
def test_a_run_that_nobody_looks_at_is_stopped_too(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    with watch(workspace, sampled, settings=SETTINGS, out=tmp_path) as steps:
        pass
    assert steps.run.summary["sim_seconds"] <= 2.0
    assert list(steps) == []


def test_what_keeps_a_run_from_starting_is_raised_before_any_step(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    scenario = read_scenario(sampled)
    twice = scenario.model_copy(update={"actors": (*scenario.actors, scenario.actors[0])})
    with pytest.raises(ScenarioError), watch(workspace, twice, out=tmp_path):
        pytest.fail("it has started")
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_run_in_the_folder_is_refused_to_whoever_asks_for_steps(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    name = sampled.name.removesuffix(".scenario.json")
    (tmp_path / name).mkdir()
    (tmp_path / name / "status.json").write_text('{"format": "odscen-status", "time": 3}')
    with (
        pytest.raises(ConflictError, match="has not ended"),
        watch(workspace, sampled, settings=SETTINGS, out=tmp_path) as steps,
    ):
        list(steps)
    assert watchers() == []


def _driven(path: Path) -> Scenario:
    """The scenario with one car that has an empty road, at 10 m/s."""
    scenario = read_scenario(path)
    car = next(one for one in scenario.actors if one.category == "car")
    fast = car.model_copy(update={"initial_speed": 5.0, "depart": 0.0, "id": "own"})
    simulation = scenario.simulation.model_copy(update={"step_length": 0.1})
    return scenario.model_copy(
        update={"actors": (fast,), "flows": (), "rules": (), "simulation": simulation}
    )


@pytest.mark.slow
def test_a_program_lets_an_actor_brake_and_drive_on_from_the_step_it_looks_at(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    speeds = {}
    with watch(workspace, _driven(sampled), settings=RunSettings(until=8.0), out=tmp_path) as steps:
        for step in steps:
            speeds[round(step.time, 1)] = float(step.speed[0])
            if step.time == pytest.approx(1.0):
                steps.act("own", brake={"by": 2.0}, horn={})
            if step.time == pytest.approx(5.0):
                steps.act("own", go={})
    begin = speeds[1.0]
    for number in range(1, 10):
        mean = begin - 0.2 * (number - 0.5)  # of the step that leads there
        assert speeds[round(1.0 + number / 10, 1)] == pytest.approx(mean, abs=0.01)
    assert speeds[5.0] == 0.0
    assert speeds[7.9] > 3.0
    events = events_from_json((steps.run.folder / "events.json").read_text())
    said = [(one.rule, str(one.kind), one.time) for one in events if one.rule]
    assert said[:2] == [("act-1", "rule_started", 1.0), ("act-1", "rule_acted", 1.0)]


@pytest.mark.slow
def test_what_is_wrong_with_an_action_is_said_at_once(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    with watch(workspace, _driven(sampled), settings=RunSettings(until=2.0), out=tmp_path) as steps:
        with pytest.raises(ConflictError, match="while a step is looked at"):
            steps.act("own", go={})
        next(steps)
        with pytest.raises(ScenarioError, match="no actor 'lorry'"):
            steps.act("lorry", go={})
        with pytest.raises(ScenarioError, match="brake"):
            steps.act("own", brake={"hard": True})
        with pytest.raises(ScenarioError, match="for pedestrians"):
            steps.act("own", walk={"to": [0.0, 0.0]})


@pytest.mark.slow
def test_a_program_ends_the_run_by_a_rule(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    times = []
    with watch(workspace, sampled, settings=SETTINGS, out=tmp_path) as steps:
        for step in steps:
            times.append(step.time)
            if step.time == 5.0:
                steps.act(str(step.ids[0]), end={})
    assert times[-1] == 5.0
    assert (steps.run.status, steps.run.summary["stopped"]) == ("completed", False)
    assert steps.run.trajectories()["time"].max() == 5.0
    assert "rule_acted" in steps.run.events()["kind"].to_list()


LIGHT, WESTWARD, NORTHWARD = "10001", "r1>r3", "r2>r4"
"""The light of the crossing; the first of the two movements has green from 0 to 17 s."""


def _towards_the_light(workspace: Workspace, path: Path) -> tuple[Scenario, str, int]:
    """A car 100 m before its stop line; its light by SUMO id, and the letter for it."""
    on = load_map(workspace.map("signal_crossing"))
    light, lanes = on.lights[0], on.sumo.graph.lanes
    keys = list(map(str, lanes.lanes.keys))
    link, before, behind = next(
        (link, *map(keys.index, one.lanes))
        for link, one in enumerate(light.movements)
        if one.name == WESTWARD and set(one.lanes) <= set(keys)
    )
    first, last = lanes.lanes.first_node[before : before + 2].tolist()
    beyond = int(lanes.lanes.first_node[behind + 1]) - 2
    spawn = max(first + 2, last - 1 - round(100.0 / lanes.spacing))
    car = Actor(
        id="van",
        category=Category.CAR,
        spawn=node_id(on.sumo.graph, spawn),
        goal=node_id(on.sumo.graph, beyond),
    )
    simulation = Simulation(step_length=0.1)
    changes = {"actors": (car,), "flows": (), "rules": (), "simulation": simulation}
    return read_scenario(path).model_copy(update=changes), on.sumo.lights[0].id, link


@pytest.mark.slow
def test_a_program_switches_a_light_and_who_would_have_passed_stops(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    scenario, light, link = _towards_the_light(workspace, sampled)
    settings = RunSettings(until=30.0)
    speeds: dict[str, list[float]] = {"left alone": [], "switched": []}
    shown: dict[float, str] = {}
    runs = {}
    for name, found in speeds.items():
        with watch(workspace, scenario, settings=settings, name=name, out=tmp_path) as steps:
            for step in steps:
                found.extend(step.speed[step.ids == "van"])
                if name == "switched":
                    shown[round(step.time, 1)] = step.lights[light][link]
                    if step.time == pytest.approx(2.0):
                        steps.switch_light(LIGHT, NORTHWARD)
        runs[name] = steps.run
    assert min(speeds["left alone"][40:]) > 5.0
    assert min(speeds["switched"][40:]) < 0.01
    assert {shown[time] for time in (0.5, 1.0, 2.0)} <= set("gG")
    assert {letter for time, letter in shown.items() if 2.1 < time < 17.0} == {"r"}
    logged = read_light_states(runs["switched"].folder).filter(pl.col("light") == light)
    changes = [(time, state[link]) for time, state in logged.select("time", "state").iter_rows()]
    assert next(time for time, letter in changes if letter == "r") == pytest.approx(2.1, abs=0.11)
    events = events_from_json((runs["switched"].folder / "events.json").read_text())
    said = [(one.time, one.detail) for one in events if one.kind == "rule_acted"]
    assert said == [(pytest.approx(2.0), f"light {LIGHT}: {NORTHWARD} green")]


@pytest.mark.slow
def test_what_is_wrong_with_a_switched_light_is_said_at_once(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    scenario, _, _ = _towards_the_light(workspace, sampled)
    with watch(workspace, scenario, settings=RunSettings(until=2.0), out=tmp_path) as steps:
        with pytest.raises(ConflictError, match="while a step is looked at"):
            steps.switch_light(LIGHT, WESTWARD)
        next(steps)
        with pytest.raises(ScenarioError, match="no traffic light '7'; there are 10001"):
            steps.switch_light("7", WESTWARD)
        with pytest.raises(ScenarioError, match="has no movement 'r1>r9'; there are r1>r2, "):
            steps.switch_light(LIGHT, "r1>r9")
        with pytest.raises(ScenarioError, match="green needs a movement"):
            steps.switch_light(LIGHT)
        with pytest.raises(ScenarioError, match="shows"):
            steps.switch_light(LIGHT, shows="blue")  # type: ignore[arg-type]
        with pytest.raises(ScenarioError, match="no actor 'program'"):
            steps.act("program", go={})


@pytest.mark.slow
def test_without_actors_lights_are_switched_too_and_vehicles_of_demand_act(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    empty, light, _ = _towards_the_light(workspace, sampled)
    demand = Demand(background=(Background(id="traffic", per_km=8.0),))
    scenario = empty.model_copy(update={"actors": (), "demand": demand})
    dark, named, speeds = set(), "", []
    with watch(workspace, scenario, settings=RunSettings(until=20.0), out=tmp_path) as steps:
        for step in steps:
            if step.time == pytest.approx(2.0):
                steps.switch_light(LIGHT, shows="off")
            if step.time == pytest.approx(12.0):
                steps.switch_light(LIGHT, shows="program")
            if 3.0 < step.time < 12.0:
                dark |= set(step.lights[light])
            if not named and (step.speed > 5.0).any():
                named = str(step.ids[step.speed > 5.0][0])
                steps.act(named, brake={"by": 5.0})
            speeds.extend(step.speed[step.ids == named])
    assert dark <= set("oO")
    assert set(step.lights[light]) & set("rgG")
    assert speeds[-1] == 0.0
    assert named not in {actor.id for actor in scenario.actors}
