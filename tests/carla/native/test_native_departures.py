"""Departures with CARLA alone are within one tick of the plan, at no ticks beyond the run's.

What is recorded of their speed is how they move, with and without physics.
"""

from __future__ import annotations

import json
from pathlib import Path

import polars as pl
import pytest

from odscen.carla.native.native_run import NativeOptions, run_native
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.carla.conftest import MAPS, Sample, scenario_of
from tests.carla_standin.process import StandIn

pytest.importorskip("carla", reason="co-simulation needs the package carla")

CROSSING, WEAVE = MAPS / "signal_crossing.xodr", MAPS / "motorway_weave.xodr"
TICK, SECONDS = 0.05, 3.0
DEPARTS = {"a": 0.0, "b": 0.33, "c": 0.5, "d": 1.27, "e": 2.01}
"""Seconds, some between two ticks."""


@pytest.mark.slow
@pytest.mark.parametrize("physics", [False, True])
def test_departures_are_within_a_tick_of_the_plan_and_cost_no_ticks(
    workspace: Workspace, tmp_path: Path, physics: bool
) -> None:
    """Even where a server takes nothing less than 0.5 m above the ground."""
    actors = [
        {
            "id": name, "category": "car", "depart": depart, "goal": "4.1.-1.200",
            "spawn": f"2.1.-{1 + k % 2}.{40 + 30 * k}",
        }
        for k, (name, depart) in enumerate(DEPARTS.items())
    ]  # fmt: skip
    path = scenario_of(workspace, WEAVE, actors, tmp_path)
    with StandIn(WEAVE, map_name=WEAVE.stem, least_lift=0.5) as server:
        result, _ = run_native(
            workspace,
            path,
            NativeOptions(Address(server.host, server.port), physics=physics),
            settings=RunSettings(until=SECONDS),
            out=tmp_path / "runs",
        )
        ticks = server.calls()["tick_cue"]
    # A client that has waited too long is told from a run without departures.
    assert result.known.get("error") is None
    events = json.loads((result.folder / "events.json").read_text())["events"]
    late = {
        event["actor"]: event["time"] - DEPARTS[event["actor"]]
        for event in events
        if event["kind"] == "departed"
    }
    assert set(late) == set(DEPARTS)
    assert min(late.values()) >= -1e-9
    assert max(late.values()) < TICK
    # The client ticks once or twice by itself when it sets the length of a tick.
    assert SECONDS / TICK <= ticks <= SECONDS / TICK + 2
    assert_speeds_are_how_they_move(result.trajectories())


@pytest.mark.slow
def test_carlas_own_walkers_depart_on_time_and_walk_as_is_recorded(
    workspace: Workspace, sample: Sample, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the client's own walker AI on a navigation mesh, among vehicles with physics."""
    monkeypatch.setenv("HOME", str(tmp_path))  # where the client keeps the mesh
    seconds = 8.0
    path = sample(CROSSING, seed=5)
    with StandIn(CROSSING, navigation=True) as server:
        result, report = run_native(
            workspace,
            path,
            NativeOptions(Address(server.host, server.port)),
            settings=RunSettings(until=seconds),
            out=tmp_path / "runs",
        )
        calls = server.calls()
    assert list(tmp_path.rglob("*.bin"))
    assert calls["apply_control_to_walker"] == 0
    assert not [note for note in report.notes if "navigation mesh" in note]
    plan = json.loads((result.folder / "plan.json").read_text())
    planned = {one["id"]: one for one in plan["actors"]}
    events = json.loads((result.folder / "events.json").read_text())["events"]
    late = {
        event["actor"]: event["time"] - planned[event["actor"]]["depart"]
        for event in events
        if event["kind"] == "departed"
    }
    assert set(late) == {name for name, one in planned.items() if one["depart"] <= seconds - TICK}
    assert -1e-9 <= min(late.values()) <= max(late.values()) < TICK
    assert calls["tick_cue"] <= seconds / TICK + 2
    ways = assert_speeds_are_how_they_move(result.trajectories())
    walkers = ways.filter(pl.col("category") == "pedestrian")
    typical = walkers.group_by("id").agg(pl.col("speed").median())["speed"].to_numpy()
    assert len(typical) >= 2
    assert 1.0 < typical.min() <= typical.max() < 1.8


def assert_speeds_are_how_they_move(table: pl.DataFrame) -> pl.DataFrame:
    """Within 0.1 m/s at every tick, and everybody drives."""
    ways = table.sort("id", "time").with_columns(
        moved=((pl.col("x").diff() ** 2 + pl.col("y").diff() ** 2).sqrt() / TICK).over("id")
    )
    off = (ways["moved"] - ways["speed"]).abs().drop_nulls().to_numpy()
    assert len(off) > 5 * 15
    assert off.max() < 0.1
    assert ways.group_by("id").agg(pl.col("speed").max())["speed"].to_numpy().min() > 1.0
    return ways
