"""Drivers and pedestrians of whom it is known how they behave come out of their tracks."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

import odscen
from odscen.formats.tracks.critical_gaps import (
    GapChoice,
    estimate_critical_gap,
    find_gap_choices,
    judge_gaps,
)
from odscen.formats.tracks.driver_fit import fit_drivers
from odscen.formats.tracks.lane_places import fit_on_map
from odscen.formats.tracks.recorded_traffic import complete_tracks
from odscen.formats.tracks.road_user_habits import measure_habits
from odscen.lanegraph.query import node_id
from odscen.scenario import edits
from odscen.scenario.demand.inflow import entries
from odscen.scenario.placing.region import Region
from tests.formats.tracks.test_driver_fit import GOALS, ROAD

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> odscen.Workspace:
    store = odscen.Workspace.open(tmp_path_factory.mktemp("habits"))
    for name in ("rural_hills", "t_junction_signs", "signal_crossing"):
        store.add_map(ROOT / "maps" / f"{name}.xodr")
    return store


def log_normal(mean: float, std: float) -> tuple[float, float]:
    variance = np.log1p((std / mean) ** 2)
    return float(np.log(mean) - variance / 2.0), float(np.sqrt(variance))


def wait_for_gap(times: list[float], waits: float, wanted: float) -> float:
    """When one enters who takes the first gap of ``wanted`` seconds."""
    later = [time for time in times if time > waits]
    if later[0] - waits >= wanted:
        return waits + 0.1
    return next(a + 0.3 for a, b in pairwise(later) if b - a >= wanted)


@pytest.mark.parametrize(("mean", "std"), [(5.0, 1.2), (6.5, 1.5), (4.0, 0.8)])
def test_known_critical_gaps_are_estimated_within_a_tenth(mean: float, std: float) -> None:
    rng = np.random.default_rng(2)
    choices = []
    for k in range(400):
        times = np.cumsum(1.0 + rng.exponential(5.0, 300)).tolist()
        waits = float(rng.uniform(0.0, 20.0))
        enters = wait_for_gap(times, waits, float(rng.lognormal(*log_normal(mean, std))))
        accepted, rejected = judge_gaps(times, waits=waits, enters=enters)
        assert accepted is not None
        choices.append(GapChoice(str(k), "car", "", "left", accepted, rejected))
    found = estimate_critical_gap(choices)
    assert found is not None
    assert found["mean"] == pytest.approx(mean, rel=0.1)
    assert found["std"] == pytest.approx(std, rel=0.35)
    assert estimate_critical_gap(choices[:5]) is None


def minor_road_traffic(wanted: float, count: int) -> pl.DataFrame:
    """Cars from the south that take the first gap of ``wanted`` s of those on the major road.

    On t_junction_signs: the major road leads west at y = 1.625, the minor one north to x = 1.625.
    """
    rng = np.random.default_rng(4)
    times = np.cumsum(1.5 + rng.exponential(4.0, 40 * count)).tolist()
    parts = []

    def add(name: str, time: Any, x: Any, y: Any) -> None:
        parts.append(pl.DataFrame({"id": name, "time": time, "x": x, "y": y}))

    for k, passes in enumerate(times):
        # At 12 m/s, at x = 1.625 at that time.
        t = np.arange(-8.0, 8.0, 0.2)
        add(f"major-{k}", np.round(passes + t, 3), 1.625 - 12.0 * t, np.full_like(t, 1.625))
    last = 10.0
    for k in range(count):
        waits = last + 4.0
        enters = wait_for_gap(times, waits, wanted)
        last = enters
        stops = np.arange(waits, max(enters - 0.1, waits + 0.3), 0.2)
        near = np.full_like(stops, -15.5)
        # Then left over the junction, on the arc of its road, onto the one that leads west.
        u = np.arange(0.0, 5.0, 0.2)
        way = 5.0 * u
        turn = np.clip(way / 15.6, 0.0, 1.0) * np.pi / 2.0
        radius = 15.625
        x = 1.625 - radius * (1.0 - np.cos(turn)) - np.maximum(way - radius * np.pi / 2.0, 0.0)
        y = -14.0 + radius * np.sin(turn)
        add(
            f"minor-{k}",
            np.round(np.concatenate([stops, enters + u]), 3),
            np.concatenate([np.full_like(stops, 1.625), x]),
            np.concatenate([near, y]),
        )
    rows = pl.concat(parts).with_columns(kind=pl.lit("car"), length=pl.lit(4.5), width=pl.lit(1.8))
    return complete_tracks(rows, "test").rows


def test_gaps_that_were_taken_and_let_pass_are_found_on_the_map(
    workspace: odscen.Workspace,
) -> None:
    graph = workspace.map("t_junction_signs").graph()
    placed, _ = fit_on_map(minor_road_traffic(6.0, 60), graph)
    choices = [c for c in find_gap_choices(placed, graph) if c.id.startswith("minor")]
    assert {(choice.lane, choice.turn) for choice in choices} == {("3.0.-1", "left")}
    assert len(choices) == 60
    # All want 6 s: what is taken is longer, what is let pass is shorter.
    assert min(choice.accepted for choice in choices) > 5.8
    assert max(choice.rejected for choice in choices) < 6.2
    found = estimate_critical_gap(choices)
    assert found is not None
    # Nothing is known of the gaps between what was taken and what was let pass.
    assert found["mean"] == pytest.approx(6.0, rel=0.1)
    assert find_gap_choices(placed, graph, lit={"10001"}) == []


def run_traffic(
    workspace: odscen.Workspace, map_name: str, drivers: dict[str, Any], out: Path
) -> pl.DataFrame:
    entry = workspace.map(map_name)
    graph = entry.graph()
    scenario = edits.new_scenario(graph, name="habits", roi=graph.segments.ids)
    scenario = edits.set_simulation(scenario, duration=300.0, step_length=0.2)
    for number, place in enumerate(entries(Region.of(graph, scenario.roi))):
        scenario = edits.set_input(
            scenario, graph, inflow=f"leg-{number}", segment=place.segment,
            direction=place.direction, per_hour=250.0,
        )  # fmt: skip
    known = {"sets": [{"id": "known", "parameters": drivers}], "shares": {"known": 1}}
    scenario = odscen.Scenario.model_validate(scenario.model_dump(mode="json") | {"drivers": known})
    rows = odscen.read_recorded_traffic(odscen.run(workspace, scenario, out=out).folder).rows
    return fit_on_map(rows, graph)[0]


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.8, 1.1])
def test_speeds_in_curves_are_those_of_known_drivers(
    workspace: odscen.Workspace, tmp_path: Path, factor: float
) -> None:
    spread = {"kind": "normal", "mean": factor, "std": 0.05, "low": factor - 0.1}
    drivers = {"speedFactor": spread | {"high": factor + 0.1}}
    placed = run_traffic(workspace, "rural_hills", drivers, tmp_path / "run")
    cars = measure_habits(placed, workspace.map("rural_hills").graph())["curves"]["car"]
    assert cars["factor"]["road_users"] > 30
    assert cars["factor"]["p50"] == pytest.approx(factor, rel=0.05)
    assert cars["factor"]["std"] == pytest.approx(0.05, abs=0.02)
    # From 2 to 3 m/s2 at 1.0, see odscen.convert.model.curve_speed.
    assert 1.5 < cars["lateral_acceleration"]["p50"] < 4.0


@pytest.mark.slow
def test_known_drivers_who_were_held_out_are_nearer_to_the_fitted_than_to_the_default(
    workspace: odscen.Workspace, tmp_path: Path
) -> None:
    (tmp_path / "long.xodr").write_text(ROAD.replace("1500", "3000"))
    entry = workspace.add_map(tmp_path / "long.xodr")
    graph = entry.graph()

    def place(x: float) -> str:
        row = int(np.argmin(np.abs(graph.lanes.x - x)))
        return str(node_id(graph, row))

    known = {
        "tau": {"kind": "normal", "mean": 1.7, "std": 0.25, "low": 1.2, "high": 2.3},
        "minGap": {"kind": "normal", "mean": 3.0, "std": 0.4, "low": 2.0, "high": 4.0},
        "accel": {"kind": "normal", "mean": 1.5, "std": 0.2, "low": 1.0, "high": 2.0},
        "decel": {"kind": "normal", "mean": 2.5, "std": 0.3, "low": 1.8, "high": 3.2},
    }
    actors: list[dict[str, Any]] = [
        {"id": "lead", "category": "car", "spawn": place(600), "initial_speed": 8, "speed": 14}
    ]
    actors += [
        {"id": f"car-{k}", "category": "car", "spawn": place(600 - 35 * k), "initial_speed": 8}
        | {"style": "known"}
        for k in range(1, 13)
    ]
    rules = [
        {"id": f"r{k}", "actor": "lead", "when": {"time": {"after": 1 + 9.0 * k}}}
        | {"then": [{"speed": {"to": goal, "rate": 3.0}}]}
        for k, goal in enumerate(GOALS * 2)
    ]
    scenario = odscen.Scenario.model_validate(
        {
            "name": "platoon",
            "map": {"name": entry.name, "sha256": entry.sha256, "spacing": graph.lanes.spacing},
            "roi": list(graph.segments.ids),
            "simulation": {"duration": 110, "step_length": 0.1},
            "drivers": {"sets": [{"id": "known", "car_following": "IDM", "parameters": known}]},
            "actors": actors,
            "rules": rules,
        }
    )
    run = odscen.run(workspace, scenario, out=tmp_path / "run")
    report = fit_drivers(odscen.read_recorded_traffic(run.folder).rows).report
    cars = report["categories"]["car"]
    assert (cars["model"], cars["fitted"], cars["held_out"]) == ("IDM", 8, 4)
    for name, given in known.items():
        assert cars["parameters"][name]["mean"] == pytest.approx(given["mean"], rel=0.1)
    judged = {row["figure"]: row for row in report["comparison"] if "recorded" in row}
    assert list(judged) == ["headway", "speed", "acceleration", "time to collision"]
    for row in judged.values():
        assert row["nearer"] == "fitted", row
        assert row["fitted"]["distance"] < row["default"]["distance"], row


def test_walking_speeds_and_gaps_of_pedestrians_are_those_that_were_made(
    workspace: odscen.Workspace,
) -> None:
    rng = np.random.default_rng(3)
    times = np.cumsum(1.5 + rng.exponential(4.0, 1200)).tolist()
    speeds, parts, now = [], [], 10.0
    for k, passes in enumerate(times):
        t = np.arange(-5.0, 5.0, 0.2)
        # Along the left lane of road 3 of signal_crossing, at x = -80 at that time.
        parts.append(
            pl.DataFrame({"id": f"car-{k}", "time": np.round(passes + t, 3), "x": -80.0 + 10.0 * t})
            .with_columns(y=pl.lit(0.0), kind=pl.lit("car"))
        )  # fmt: skip
    for k in range(60):
        waits, pace = now + 3.0, float(rng.normal(1.4, 0.2))
        # It is in the lane 3 m further on: what it needs is known from where it starts.
        now = wait_for_gap(times, waits, 7.0)
        u = np.arange(0.0, 6.0, 0.2)
        time = np.concatenate([np.arange(waits - 2.0, now - 0.2, 0.2), now + u])
        y = np.concatenate(
            [-3.0 + np.minimum(np.arange(waits - 2.0, now - 0.2, 0.2) - waits, 0.0) * pace,
             -3.0 + pace * u]
        )  # fmt: skip
        parts.append(
            pl.DataFrame({"id": f"walker-{k}", "time": np.round(time, 3), "y": y})
            .with_columns(x=pl.lit(-80.0), kind=pl.lit("pedestrian"))
            .select("id", "time", "x", "y", "kind")
        )
        speeds.append(pace)
    graph = workspace.map("signal_crossing").graph()
    rows = complete_tracks(pl.concat(parts), "test").rows
    found = measure_habits(fit_on_map(rows, graph)[0], graph)["pedestrians"]
    assert found["walking_speed"]["mean"] == pytest.approx(float(np.mean(speeds)), rel=0.03)
    assert found["walking_speed"]["std"] == pytest.approx(float(np.std(speeds)), rel=0.1)
    assert found["crossed"] == 60
    assert found["critical_gap"]["mean"] == pytest.approx(7.0, rel=0.1)
