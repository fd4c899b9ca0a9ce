"""An actor does what was recorded: from a table, and from an earlier run."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from odscen.app.running.runs import run
from odscen.app.running.trajectories import attach_trajectory
from odscen.app.scenarios import read_scenario, write_scenario
from odscen.base.errors import InputError, ScenarioError
from odscen.cli.commands import command_line
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings

SETTINGS = RunSettings(until=20.0)


@pytest.mark.slow
def test_what_a_road_user_of_an_earlier_run_did_is_done_again(
    workspace: Workspace, sampled: Path, tmp_path: Path
) -> None:
    scenario = read_scenario(sampled)
    first = run(workspace, scenario, settings=SETTINGS, out=tmp_path / "first")
    table = first.trajectories()
    cars = [one.id for one in scenario.actors if one.category == "car"]
    name = max(cars, key=lambda car: float(table.filter(table["id"] == car)["x"].n_unique()))
    again = attach_trajectory(scenario, first.folder, actor=name, of=name, begin=3.0)
    assert [rule.id for rule in again.rules] == [f"replay-{name}"]
    file = write_scenario(again, tmp_path / "again.scenario.json")
    second = run(workspace, read_scenario(file), settings=SETTINGS, out=tmp_path / "second")
    old, new = (one.filter(one["id"] == name) for one in (table, second.trajectories()))
    step = scenario.simulation.step_length
    begin = float(old["time"][0])
    assert float(new["time"][0]) == pytest.approx(3.0)
    times = np.arange(3.0, min(19.0, 3.0 + float(old["time"][-1]) - begin), step)
    for key in ("x", "y"):
        was = np.interp(times - 3.0 + begin, old["time"], old[key])
        assert np.interp(times, new["time"], new[key]) == pytest.approx(was, abs=0.02)


@pytest.mark.slow
def test_the_command_writes_a_rule_and_replaces_the_one_before(
    sampled: Path, tmp_path: Path
) -> None:
    table = tmp_path / "tape.csv"
    table.write_text("time,x,y\n0,0,0\n1,5,0\n2,10,0\n", encoding="utf-8")
    name = read_scenario(sampled).actors[0].id
    out = tmp_path / "out.scenario.json"
    for source in (sampled, out):
        arguments = ["replay", str(source), str(table), "--actor", name, "-o", str(out), "--json"]
        found = CliRunner().invoke(command_line(), arguments)
        assert found.exit_code == 0, found.output
    assert json.loads(found.stdout)["rule"] == f"replay-{name}"
    [rule] = read_scenario(out).rules
    step = read_scenario(sampled).simulation.step_length
    assert rule.when.time is not None
    assert rule.when.time.after == 0.0
    appear, replay = (item for item in rule.then)
    assert appear.appear is not None
    assert appear.appear.speed == 5.0
    assert replay.replay is not None
    assert len(replay.replay.rows) == 3
    assert step > 0.0


def test_a_wrong_actor_or_file_is_named(sampled: Path, tmp_path: Path) -> None:
    scenario, table = read_scenario(sampled), tmp_path / "tape.csv"
    table.write_text("time,x\n0,0\n", encoding="utf-8")
    with pytest.raises(ScenarioError, match="no actor 'lorry'"):
        attach_trajectory(scenario, table, actor="lorry")
    with pytest.raises(InputError, match=r"those of no schema.*there are time, x") as error:
        attach_trajectory(scenario, table, actor=scenario.actors[0].id)
    assert error.value.file == table.name
