"""Recorded traffic on a map, its scenes, and scenarios in which it drives again."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from typer.testing import CliRunner

import odscen
from odscen.app.exchange.recorded_traffic import show_recording
from odscen.cli.commands import command_line
from odscen.maps.map_entry import MapEntry

ROOT = Path(__file__).parents[3]
SHARED = ROOT.parent / "shared" / "recordings"
LEFT, RIGHT = 0.0, -3.25
"""y of the two lanes of road 3, which lead east from x = -146 to -18."""
STEP = 0.04


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> odscen.Workspace:
    store = odscen.Workspace.open(tmp_path_factory.mktemp("recordings"))
    store.add_map(ROOT / "maps" / "signal_crossing.xodr")
    return store


@pytest.fixture(scope="module")
def entry(workspace: odscen.Workspace) -> MapEntry:
    return workspace.map("signal_crossing")


def track(name: str, kind: str, time: Any, x: Any, y: Any, size: tuple[float, float]) -> Any:
    """Columns of one road user; headings, speeds and accelerations are derived when it is read."""
    return pl.DataFrame({"id": name, "kind": kind, "time": time, "x": x, "y": y}).with_columns(
        length=pl.lit(size[0]), width=pl.lit(size[1])
    )


def crossing_traffic() -> pl.DataFrame:
    """A cut-in, hard braking, a short TTC and a pedestrian who crosses, each at a known time."""
    t = np.arange(10.0, 18.0 + 1e-9, STEP)
    u = t - 10.0
    car = (4.5, 1.8)
    # From 13 s on it brakes by 6 m/s² from 12 to 3 m/s.
    braked = np.clip(u - 3.0, 0.0, 1.5)
    brakes_x = -120.0 + 12.0 * u - 3.0 * braked**2 - 9.0 * np.maximum(u - 4.5, 0.0)
    # It follows 20 m behind, keeps 12 m/s until 14.2 s, and would be 2 s away from then on.
    # The lane's border, at y = -1.625, is passed at 11.5 s.
    aside = np.clip((u - 0.5) / 2.0, 0.0, 1.0)
    cuts_y = LEFT + (RIGHT - LEFT) * (0.5 - 0.5 * np.cos(np.pi * aside))
    walked = np.arange(15.0, 22.0, STEP)
    tracks = [
        track("brakes", "car", t, brakes_x, np.full_like(t, LEFT), car),
        track("cuts", "car", t, -75.0 + 6.0 * u, cuts_y, car),
        track("behind", "truck", t, -90.0 + 6.0 * u, np.full_like(t, RIGHT), (8.0, 2.5)),
        track(
            "walks",
            "pedestrian",
            walked,
            np.full_like(walked, -50.0),
            5.0 - 1.5 * (walked - 15.0),
            (0.4, 0.4),
        ),
    ]
    return pl.concat(tracks)


@pytest.fixture(scope="module")
def crossing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("tracks") / "crossing.csv"
    crossing_traffic().write_csv(file)
    return file


@pytest.mark.slow
def test_scenes_are_those_that_were_made_and_no_others(crossing: Path, entry: MapEntry) -> None:
    shown = show_recording(odscen.read_recorded_traffic(crossing), entry)
    found = {row["kind"]: row for row in shown.scenes.to_dicts()}
    kinds = sorted(shown.scenes["kind"].to_list())
    assert kinds.count("lane_change") == kinds.count("cut_in") == kinds.count("hard_braking") == 1
    braking = found["hard_braking"]
    assert (braking["id"], braking["value"]) == ("brakes", pytest.approx(-6.0, abs=0.05))
    assert (braking["begin"], braking["end"]) == pytest.approx((13.0, 14.5), abs=2 * STEP)
    change = found["lane_change"]
    assert (change["id"], change["value"]) == ("cuts", -1.0)
    assert change["end"] == pytest.approx(11.5, abs=STEP)
    cut = found["cut_in"]
    assert (cut["id"], cut["other"]) == ("cuts", "behind")
    # 15 m between the middles, less half of both bodies, at 6 m/s.
    assert cut["value"] == pytest.approx((15.0 - 6.25) / 6.0, abs=0.01)
    crossings = shown.scenes.filter(pl.col("kind") == "crossing_pedestrian")
    by_vehicle = {row["other"]: row["value"] for row in crossings.to_dicts()}
    # "cuts" is at x = -50 at 14.17 s, "walks" at y = -3.25 at 20.5 s: 6.3 s are too long.
    # "behind" is there at 16.67 s, "brakes" at y = 0 at 17.62 s and 18.33 s.
    assert "cuts" not in by_vehicle
    assert by_vehicle["behind"] == pytest.approx(20.5 - 16.667, abs=0.05)
    exposure = shown.summary["exposure"]
    assert exposure["hours"] == pytest.approx(12.0 / 3600.0, abs=1e-4)
    # 8 s at 12 and at 3 m/s with 1.5 s between, and twice 48 m, one of which swerves.
    assert exposure["vehicle_km"] == pytest.approx(
        (12 * 3 + 7.5 * 1.5 + 3 * 3.5 + 96.2) / 1000, abs=2e-3
    )
    assert exposure["scenes"]["cut_in"]["count"] == 1


def independent_time_to_collision(a: dict[str, float], b: dict[str, float]) -> float:
    """Two bodies that both head east in one lane."""
    if abs(a["y"] - b["y"]) >= (a["width"] + b["width"]) / 2 or b["x"] <= a["x"]:
        return math.inf
    closing = a["speed"] - b["speed"]
    gap = b["x"] - a["x"] - (a["length"] + b["length"]) / 2
    return gap / closing if closing > 0 else math.inf


def test_short_times_to_collision_are_those_of_an_independent_search(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    t = np.arange(0.0, 20.0, 0.1)
    tracks = []
    for k in range(12):
        speed = rng.uniform(4.0, 16.0) + 2.0 * np.sin(rng.uniform(0.2, 1.0) * t + k)
        x = rng.uniform(-400.0, 0.0) + np.concatenate([[0.0], np.cumsum(speed[:-1] * 0.1)])
        tracks.append(track(f"v{k}", "car", t, x, np.full_like(t, 3.25 * (k % 3)), (4.5, 1.8)))
    file = tmp_path / "many.csv"
    pl.concat(tracks).write_csv(file)
    recorded = odscen.read_recorded_traffic(file)
    frames: set[tuple[str, str, float]] = set()
    for (time,), rows in recorded.rows.group_by("time"):
        states = rows.to_dicts()
        for a in states:
            for b in states:
                if a is not b and independent_time_to_collision(a, b) < 2.0:
                    frames.add((a["id"], b["id"], round(time, 3)))
    assert len(frames) > 50
    scenes = show_recording(recorded).scenes
    pairs = {(row["id"], row["other"]) for row in scenes.to_dicts()}
    assert pairs == {frame[:2] for frame in frames}
    for row in scenes.to_dicts():
        own = [f[2] for f in frames if f[:2] == (row["id"], row["other"])]
        assert round(row["begin"], 3) in own
        assert round(row["end"], 3) in own
    covered = {
        frame
        for frame in frames
        for row in scenes.to_dicts()
        if frame[:2] == (row["id"], row["other"]) and row["begin"] <= frame[2] + 1e-6
        if frame[2] <= row["end"] + 1e-6
    }
    assert covered == frames


def test_an_offset_is_found_and_states_against_their_lane_are_counted(
    workspace: odscen.Workspace, entry: MapEntry, tmp_path: Path
) -> None:
    t = np.arange(0.0, 10.0, 0.1)
    east = track("east", "car", t, -140.0 + 10 * t, np.full_like(t, RIGHT), (4.5, 1.8))
    north = track("north", "car", t, np.full_like(t, 3.25), -140.0 + 10 * t, (4.5, 1.8))
    wrong = track("wrong", "car", t, -40.0 - 8 * t, np.full_like(t, RIGHT), (4.5, 1.8))
    file = tmp_path / "shifted.csv"
    pl.concat([east, north]).with_columns(pl.col("x") + 0.8, pl.col("y") - 0.6).write_csv(file)
    moved = show_recording(odscen.read_recorded_traffic(file), entry, estimate=True)
    x, y, degrees = (float(part) for part in moved.summary["offset"].split(","))
    assert (x, y, degrees) == pytest.approx((-0.8, 0.6, 0.0), abs=0.02)
    assert moved.summary["agreement"]["vehicles"]["offset_95"] < 0.02
    pl.concat([east, wrong]).write_csv(file)
    picture = tmp_path / "map.svg"
    arguments = ["recording", "show", str(file), "--map", "signal_crossing", "--json", "--scenes"]
    arguments += ["--picture", str(picture), "--workspace", str(workspace.root)]
    said = CliRunner().invoke(command_line(), arguments)
    assert said.exit_code == 0, said.output
    agreement = json.loads(said.stdout)["agreement"]
    assert agreement["vehicles"] == {
        "states": 200,
        "on_lane": 1.0,
        "wrong_way": 0.5,
        "offset_median": 0.0,
        "offset_95": 0.0,
    }
    assert [road["road"] for road in agreement["roads"]] == ["3"]
    drawn = picture.read_text(encoding="utf-8")
    assert "Against its lane (" in drawn
    assert "On no lane (" not in drawn


def worst_departure(run: odscen.Run, rows: pl.DataFrame, later: float) -> dict[str, float]:
    """Metres between file and run at equal times, with those at which each begins and ends."""
    driven, worst = run.trajectories(), {}
    for (name,), own in rows.group_by("id"):
        found = driven.filter(pl.col("id") == name).sort("time")
        time, was = found["time"].to_numpy() - later, own["time"].to_numpy()
        assert (time[0], time[-1]) == pytest.approx((was[0], was[-1]), abs=0.02), name
        worst[str(name)] = max(
            float(np.abs(found[key].to_numpy() - np.interp(time, was, own[key])).max())
            for key in ("x", "y")
        )
    return worst


@pytest.mark.slow
def test_all_follow_their_tracks_in_the_run(
    workspace: odscen.Workspace, crossing: Path, tmp_path: Path
) -> None:
    read = odscen.import_file(
        workspace,
        crossing,
        on_map="signal_crossing",
        options={"window": "11..17"},
        out=tmp_path / "again.scenario.json",
    )
    assert read.scenario is not None
    assert {actor.id for actor in read.scenario.actors} == {"brakes", "cuts", "behind", "walks"}
    assert [problem for problem in read.problems if problem.severity == "error"] == []
    run = odscen.run(workspace, tmp_path / "again.scenario.json", out=tmp_path / "run")
    rows = odscen.read_recorded_traffic(crossing, window="11..17").rows
    worst = worst_departure(run, rows, STEP - 11.0)
    assert len(worst) == 4
    assert rows["time"].to_numpy().min() == pytest.approx(11.0)
    assert max(worst.values()) < 0.02


def test_the_ego_is_free_and_the_others_react_or_drive(
    workspace: odscen.Workspace, crossing: Path
) -> None:
    def imported(**options: str) -> odscen.Scenario:
        found = odscen.import_file(
            workspace, crossing, on_map="signal_crossing", options=options
        ).scenario
        assert found is not None
        return found

    react = imported(ego="behind", follow="react")
    assert [actor.id for actor in react.actors if actor.ego] == ["behind"]
    assert {rule.actor for rule in react.rules} == {"brakes", "cuts", "walks"}
    assert {rule.id for rule in react.rules} >= {"track-cuts", "react-cuts", "track-walks"}
    assert "react-walks" not in {rule.id for rule in react.rules}
    ego = next(actor for actor in react.actors if actor.ego)
    assert (ego.depart, ego.initial_speed, ego.speed) == pytest.approx((STEP, 6.0, 6.0))
    drive = imported(ego="behind", follow="drive")
    assert {rule.actor for rule in drive.rules} == {"walks"}
    brakes = next(actor for actor in drive.actors if actor.id == "brakes")
    assert brakes.speed == pytest.approx(12.0, abs=0.01)
    with pytest.raises(odscen.InputError, match=r"no road user 'van' .* brakes, cuts, walks"):
        imported(ego="van")


def test_who_comes_into_view_where_another_one_did_has_a_node_of_its_own(
    workspace: odscen.Workspace, tmp_path: Path
) -> None:
    t = np.arange(0.0, 6.0, STEP)
    cars = [
        track(f"car-{k}", "car", 4.0 * k + t, -120.0 + 8.0 * t, np.zeros_like(t), (4.5, 1.8))
        for k in range(3)
    ]
    file = tmp_path / "platoon.csv"
    pl.concat(cars).write_csv(file)
    read = odscen.import_file(workspace, file, on_map="signal_crossing")
    assert read.scenario is not None
    assert [problem for problem in read.problems if problem.severity == "error"] == []
    assert len({actor.spawn for actor in read.scenario.actors}) == 3
    run = odscen.run(workspace, read.scenario, out=tmp_path / "run")
    rows = odscen.read_recorded_traffic(file).rows
    assert max(worst_departure(run, rows, STEP).values()) < 0.02


@pytest.mark.slow
@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the recordings of ../shared")
@pytest.mark.parametrize(
    ("file", "map_file"),
    [
        ("omega-prime/pedestrian.osi", "omega-prime/fabriksgatan.xodr"),
        ("omega-prime/alks_cut-in.osi", "omega-prime/straight_500m.xodr"),
        ("interaction/vehicle_tracks_000.csv", "interaction/TestScenarioForScripts.osm"),
    ],
)
def test_recordings_of_others_are_driven_again(
    workspace: odscen.Workspace, file: str, map_file: str, tmp_path: Path
) -> None:
    options = {"origin": "0,0"} if map_file.endswith(".osm") else {}
    entry = workspace.add_map(SHARED / map_file, importing=odscen.ImportSettings(options=options))
    recorded = odscen.read_recorded_traffic(SHARED / file)
    agreement = show_recording(recorded, entry).summary["agreement"]["vehicles"]
    assert agreement["on_lane"] > 0.97
    read = odscen.import_file(workspace, SHARED / file, on_map=entry.name)
    assert read.scenario is not None
    run = odscen.run(workspace, read.scenario, out=tmp_path / "run")
    first = float(recorded.rows["time"].to_numpy().min())
    later = read.scenario.simulation.step_length - first
    assert max(worst_departure(run, recorded.rows, later).values()) < 0.02
