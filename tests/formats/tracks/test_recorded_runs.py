"""What road users of recordings do in runs: follow exactly, also after a pause, or react."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import odscen
from odscen.app.exchange.exports import export_run
from odscen.records.run_plan import Plan
from odscen.runs import layout
from odscen.sumo.runner.long_runs import resume
from tests.formats.tracks.test_tracks_on_maps import ROOT, STEP, track, worst_departure
from tests.sumo.conftest import start_killed_workers

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> odscen.Workspace:
    store = odscen.Workspace.open(tmp_path_factory.mktemp("recorded-runs"))
    store.add_map(ROOT / "maps" / "signal_crossing.xodr")
    return store


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two cars in one lane, 30 m from middle to middle, both at 10 m/s for 9 s."""
    t = np.arange(0.0, 9.0 + 1e-9, STEP)
    cars = [
        track(name, "car", t, x + 10.0 * t, np.zeros_like(t), (4.5, 1.8))
        for name, x in (("ahead", -110.0), ("after", -140.0))
    ]
    file = tmp_path_factory.mktemp("tracks") / "pair.csv"
    pl.concat(cars).write_csv(file)
    return file


def run_with_slow_ego(
    workspace: odscen.Workspace, file: Path, follow: str, out: Path
) -> odscen.Run:
    """A run in which "ahead" is the ego, and drives at 4 m/s instead of its 10."""
    scenario = odscen.import_file(
        workspace, file, on_map="signal_crossing", options={"ego": "ahead", "follow": follow}
    ).scenario
    assert scenario is not None
    actors = tuple(
        actor.model_copy(update={"speed": 4.0, "initial_speed": 4.0}) if actor.ego else actor
        for actor in scenario.actors
    )
    return odscen.run(workspace, scenario.model_copy(update={"actors": actors}), out=out)


def states_of(run: odscen.Run, name: str) -> pl.DataFrame:
    rows: pl.DataFrame = run.trajectories()
    return rows.filter(pl.col("id") == name).sort("time")


def test_who_reacts_leaves_its_track_when_a_collision_is_three_seconds_away(
    workspace: odscen.Workspace, pair: Path, tmp_path: Path
) -> None:
    run = run_with_slow_ego(workspace, pair, "react", tmp_path / "react")
    ego, after = states_of(run, "ahead"), states_of(run, "after")
    both = ego.join(after, on="time", suffix="_after").sort("time")
    gap = (both["x"] - both["x_after"] - (both_lengths(run) / 2.0)).to_numpy()
    time, own = both["time"].to_numpy(), both["x_after"].to_numpy()
    recorded = -140.0 + 10.0 * (time - STEP)
    closing = 10.0 - both["speed"].to_numpy()
    # 25.5 m apart, 6 m/s faster: three seconds are left after (25.5 - 18) / 6 = 1.25 s.
    trigger = time[np.argmax(gap / np.maximum(closing, 1e-6) < 3.0)]
    assert trigger == pytest.approx(1.25, abs=0.5)
    events = run.events().filter(pl.col("rule") == "react-after").sort("time")
    assert events.height > 0
    assert float(events["time"][0]) == pytest.approx(trigger, abs=0.1)
    # Until then on its track within 2 cm, then it brakes by itself.
    before = time < trigger
    assert np.abs(own - recorded)[before].max() < 0.02
    assert (recorded - own)[np.searchsorted(time, 3.0)] == pytest.approx(4.4, abs=0.5)
    beside = np.abs((both["y"] - both["y_after"]).to_numpy()) > 1.8
    # It overtakes in the lane beside, and comes too near at no time.
    assert gap[~beside].min() > 5.0
    assert gap[-1] < -20.0


def both_lengths(run: odscen.Run) -> float:
    plan = Plan.from_json((run.folder / layout.PLAN_FILE).read_text(encoding="utf-8"))
    return sum(actor.length for actor in plan.actors)


def test_who_follows_its_track_stays_on_it_whatever_the_ego_does(
    workspace: odscen.Workspace, pair: Path, tmp_path: Path
) -> None:
    run = run_with_slow_ego(workspace, pair, "track", tmp_path / "track")
    after = states_of(run, "after")
    recorded = -140.0 + 10.0 * (after["time"].to_numpy() - STEP)
    assert np.abs(after["x"].to_numpy() - recorded).max() < 0.02
    # It would have hit the ego: nothing keeps it from that.
    ego = states_of(run, "ahead").join(after, on="time", suffix="_after")
    assert (ego["x"] - ego["x_after"]).to_numpy().min() < 0.0


def test_tracks_are_followed_exactly_in_a_run_in_slices_and_in_its_export(
    workspace: odscen.Workspace, pair: Path, tmp_path: Path
) -> None:
    scenario = odscen.import_file(workspace, pair, on_map="signal_crossing").scenario
    assert scenario is not None
    rows = odscen.read_recorded_traffic(pair).rows
    whole = odscen.run(workspace, scenario, out=tmp_path / "whole")
    sliced = odscen.run(
        workspace, scenario, out=tmp_path / "sliced", settings=odscen.RunSettings(slice_length=3.0)
    )
    for run in (whole, sliced):
        assert max(worst_departure(run, rows, STEP).values()) < 0.02
    exported = tmp_path / "exported"
    export_run(
        workspace, sliced.folder, exported, to="recording", options={"schema": "interaction"}
    )
    again = odscen.read_recorded_traffic(next(exported.rglob("vehicle_tracks_*.csv"))).rows
    assert again["id"].n_unique() == 2
    for (_,), own in again.group_by("id", maintain_order=True):
        time, x = own["time"].to_numpy(), own["x"].to_numpy()
        begin = -110.0 if x[0] > -125.0 else -140.0
        assert np.abs(x - (begin + 10.0 * (time - STEP))).max() < 0.02
        assert math.isclose(time[0], STEP, abs_tol=0.1)


@pytest.mark.parametrize("schema", ["interaction", "ind"])
def test_tracks_are_followed_exactly_in_a_run_that_was_killed_and_resumed(
    workspace: odscen.Workspace,
    pair: Path,
    schema: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scenario = odscen.import_file(workspace, pair, on_map="signal_crossing").scenario
    assert scenario is not None
    settings = odscen.RunSettings(slice_length=3.0)
    with monkeypatch.context() as patch:
        start_killed_workers(patch)
        patch.setenv("KILL_AT", "9")
        killed = odscen.run(workspace, scenario, out=tmp_path / "run", settings=settings)
    assert "SIGKILL" in killed.summary["error"]
    assert resume(killed.folder).status == "completed"
    run = odscen.Run.open(killed.folder)
    rows = odscen.read_recorded_traffic(pair).rows
    assert max(worst_departure(run, rows, STEP).values()) < 0.02
    export_run(workspace, run.folder, tmp_path / "out", to="recording", options={"schema": schema})
    table = next((tmp_path / "out").rglob("00_tracks.csv" if schema == "ind" else "vehicle_*.csv"))
    again = odscen.read_recorded_traffic(table).rows
    for (_,), own in again.group_by("id", maintain_order=True):
        time, x = own["time"].to_numpy(), own["x"].to_numpy()
        begin = -110.0 if x[0] > -125.0 else -140.0
        assert np.abs(x - (begin + 10.0 * (time - STEP))).max() < 0.02


def test_pedestrians_who_turn_over_corners_follow_their_tracks(
    workspace: odscen.Workspace, tmp_path: Path
) -> None:
    """SUMO ended in a fault where it took a walking area that was not on their way."""
    scenario = ROOT / "suites" / "scenarios" / "signal_crossing.scenario.json"
    settings = odscen.RunSettings(until=60.0, step_length=0.1)
    run = odscen.run(workspace, scenario, out=tmp_path / "run", settings=settings)
    rows = odscen.read_recorded_traffic(run.folder).rows
    walkers = rows.filter(pl.col("category") == "pedestrian")
    assert walkers["id"].n_unique() >= 5
    walkers.write_parquet(tmp_path / "walkers.parquet")
    read = odscen.import_file(workspace, tmp_path / "walkers.parquet", on_map="signal_crossing")
    assert read.scenario is not None
    again = odscen.run(workspace, read.scenario, out=tmp_path / "again")
    assert again.status == "completed"
    later = 0.1 - float(walkers["time"].min())  # type: ignore[arg-type]
    worst = worst_departure(again, walkers, later)
    assert len(worst) == walkers["id"].n_unique()
    assert max(worst.values()) < 0.02


def test_pedestrians_follow_their_tracks_where_vehicles_react_to_the_ego(
    workspace: odscen.Workspace, tmp_path: Path
) -> None:
    scenario = ROOT / "suites" / "scenarios" / "signal_crossing.scenario.json"
    settings = odscen.RunSettings(until=60.0, step_length=0.1)
    run = odscen.run(workspace, scenario, out=tmp_path / "run", settings=settings)
    rows = odscen.read_recorded_traffic(run.folder).rows
    rows.write_parquet(tmp_path / "all.parquet")
    walkers = rows.filter(pl.col("category") == "pedestrian")
    ego = rows.filter(pl.col("category") == "car")["id"][0]
    read = odscen.import_file(
        workspace, tmp_path / "all.parquet", on_map="signal_crossing",
        options={"ego": ego, "follow": "react"},
    )  # fmt: skip
    assert read.scenario is not None
    again = odscen.run(workspace, read.scenario, out=tmp_path / "again")
    assert again.status == "completed"
    worst = worst_departure(again, walkers, 0.1 - float(rows["time"].min()))  # type: ignore[arg-type]
    assert len(worst) == walkers["id"].n_unique()
    assert max(worst.values()) < 0.02
