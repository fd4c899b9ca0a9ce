"""Generators and drivers learn from recorded traffic by the commands that learn from runs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from typer.testing import CliRunner

import odscen
from odscen.app.learned.snapshot_data import read_shards
from odscen.cli.commands import command_line
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.learning.traffic_snapshots import SignalAhead

ROOT = Path(__file__).parents[3]
CROSSING = "signal_crossing"
SCENARIO = ROOT / "suites" / "scenarios" / f"{CROSSING}.scenario.json"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> odscen.Workspace:
    store = odscen.Workspace.open(tmp_path_factory.mktemp("recorded-data"))
    store.add_map(ROOT / "maps" / f"{CROSSING}.xodr")
    return store


@pytest.fixture(scope="module")
def recording(workspace: odscen.Workspace, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Tracks of a run of two minutes, of which nothing but places and speeds is left."""
    settings = odscen.RunSettings(until=120.0, step_length=0.1)
    folder = tmp_path_factory.mktemp("recording")
    run = odscen.run(workspace, SCENARIO, out=folder / "run", settings=settings)
    rows = odscen.read_recorded_traffic(run.folder).rows
    rows.select("id", "time", "kind", "x", "y", "hdg", "speed", "length", "width").write_parquet(
        folder / "recorded.parquet"
    )
    return folder / "recorded.parquet"


def said(*arguments: object) -> dict[str, Any]:
    result = CliRunner().invoke(command_line(), [*map(str, arguments), "--json"])
    assert result.exit_code == 0, result.output
    found: dict[str, Any] = json.loads(result.stdout)
    return found


def test_a_generator_is_trained_on_a_recording_as_on_runs(
    workspace: odscen.Workspace, recording: Path, tmp_path: Path
) -> None:
    place = ("--workspace", workspace.root)
    data = (
        "learn",
        "data",
        "--recording",
        recording,
        "--map",
        CROSSING,
        "--out",
        tmp_path / "data",
    )
    made = said(*data, *place)["runs"]
    assert [(Path(row["file"]).name, row["skipped"]) for row in made] == [
        (f"{CROSSING}-recorded.shard.npz", None)
    ]
    (shard,) = read_shards(tmp_path / "data")
    assert len(shard.snapshots) == 4
    assert (shard.map_name, shard.about["recording"]) == (CROSSING, "recorded")
    # Who is in a snapshot is who was recorded at that time, on the node beneath.
    rows = pl.read_parquet(recording).filter(pl.col("kind") != "pedestrian")
    first, lanes = shard.snapshots[0], workspace.map(CROSSING).graph().lanes
    there = rows.filter(pl.col("time") == rows["time"].min())
    assert 0.9 * there.height <= len(first.node) <= there.height
    places = np.column_stack([lanes.x[first.node], lanes.y[first.node]])
    away = np.hypot(*(places[:, None] - there.select("x", "y").to_numpy()[None]).T).min(axis=0)
    assert away.max() < 2.5
    assert (first.lights.state == SignalAhead.NONE).all()
    model = tmp_path / "model.npz"
    about = said("learn", "train", "--data", tmp_path / "data", "--out", model, *place)["about"]
    assert about["snapshots"] == 4
    measured = said(
        "learn", "evaluate", "--data", tmp_path / "data", "--model", model, "--no-run", *place
    )["maps"]
    assert {row["map_name"] for row in measured} == {CROSSING}


def test_a_driver_is_trained_on_a_recording_and_drives(
    workspace: odscen.Workspace, recording: Path, tmp_path: Path
) -> None:
    place, weights = ("--workspace", workspace.root), tmp_path / "driver.npz"
    learned = ("learn", "driver", "--recording", recording, "--map", CROSSING, "--out", weights)
    (score,) = said(*learned, *place)["maps"]
    assert score["map_name"] == "recorded"
    assert score["rows"] > 200
    # On the last 30 % of the time, that was not learned from.
    assert score["learned"] < 0.95 * score["constant"]
    same = said(*learned[:-1], tmp_path / "again.npz", *place)["maps"]
    assert same == [score]
    assert (tmp_path / "again.npz").read_bytes() == weights.read_bytes()
    settings = odscen.RunSettings(
        until=60.0, behaviour=BehaviourDoor(name="imitation", options={"weights": str(weights)})
    )
    run = odscen.run(workspace, SCENARIO, out=tmp_path / "run", settings=settings)
    assert run.status == "completed"
    assert run.figure("mean_speed") > 2.0


def test_recordings_need_the_one_map_that_they_lie_on(
    workspace: odscen.Workspace, recording: Path, tmp_path: Path
) -> None:
    for command in ("data", "driver"):
        arguments = ["learn", command, "--recording", str(recording), "--out", str(tmp_path / "x")]
        result = CliRunner().invoke(
            command_line(), [*arguments, "--workspace", str(workspace.root)]
        )
        assert isinstance(result.exception, odscen.InputError)
        assert "name the map that the recordings lie on" in str(result.exception)
