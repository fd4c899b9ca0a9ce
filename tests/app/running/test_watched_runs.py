from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from odscen.app.running.runs import run
from odscen.app.running.watched_runs import watch
from odscen.app.scenarios import read_scenario
from odscen.base.errors import ConflictError, ScenarioError
from odscen.maps.store import Workspace
from odscen.records.run_events import events_from_json
from odscen.runs.finished_run import Run
from odscen.runs.run_settings import RunSettings
from odscen.scenario.document.scenario_document import Scenario

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
