"""The ego that SUMO drives: others find it, sensors sit on it, and a user's function sees all."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from odscen.base.errors import InputError
from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.mirror.cosim_report import CosimReport
from odscen.carla.mirror.tick_hook import load_hook
from odscen.carla.sensors.sensor_file import parse_sensors
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.finished_run import Run
from odscen.runs.run_settings import RunSettings
from tests.carla.conftest import MAPS, scenario_of
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

WEAVE = MAPS / "motorway_weave.xodr"
TICK, STEP, SECONDS = 0.1, 0.5, 5.0
ACTORS = [
    {
        "id": "ego", "category": "car", "model": "vehicle.tesla.model3", "ego": True,
        "spawn": "2.1.-1.40", "goal": "4.1.-1.200", "speed": 20.0,
    },
    {"id": "other", "category": "car", "spawn": "2.1.-2.40", "goal": "4.1.-1.200"},
]  # fmt: skip
SENSORS = {
    "sensors": [
        {
            "name": "front",
            "type": "sensor.camera.rgb",
            "place": {"x": 1.5, "z": 2.4},
            "attributes": {"image_size_x": 32, "image_size_y": 18, "sensor_tick": 0.2},
        }
    ]
}


def run(
    workspace: Workspace,
    tmp_path: Path,
    *,
    actors: list[dict[str, Any]] = ACTORS,
    **options: Any,
) -> tuple[Run, CosimReport, list[dict[str, Any]]]:
    path = scenario_of(workspace, WEAVE, actors, tmp_path)
    with StandIn(WEAVE, map_name=WEAVE.stem) as server:
        result, report = cosim(
            workspace,
            path,
            CosimOptions(Address(server.host, server.port), tick=TICK, **options),
            out=tmp_path / "runs",
            settings=RunSettings(until=SECONDS, step_length=STEP),
        )
        return result, report, server.actors()


@pytest.mark.slow
def test_the_hook_gets_world_and_actors_after_each_tick_and_the_ego_is_the_hero(
    workspace: Workspace, tmp_path: Path
) -> None:
    seen: list[tuple[int, dict[str, str], float]] = []

    def hook(world: Any, actors: Mapping[str, Any]) -> None:
        roles = {name: actor.attributes["role_name"] for name, actor in actors.items()}
        x = actors["ego"].get_transform().location.x if "ego" in actors else 0.0
        seen.append((world.get_snapshot().frame, roles, x))

    result, report, _ = run(workspace, tmp_path, hook=hook)
    assert (result.status, report.error) == ("completed", None)
    frames = [frame for frame, _, _ in seen]
    assert len(frames) == report.ticks
    assert frames == list(range(frames[0], frames[0] + len(frames)))
    assert seen[-1][1] == {"ego": "hero", "other": "odscen.other"}
    places = np.array([x for _, _, x in seen if x])
    moved = np.diff(places)[5:]
    assert moved.min() > 0.1, "it moves in every tick"
    assert 0.8 < moved.max() < 1.5, "by 9 m/s at the end, not by SUMO's steps"


@pytest.mark.slow
def test_cars_have_different_colours_and_each_its_own_in_every_run(
    workspace: Workspace, tmp_path: Path
) -> None:
    def colours_of(folder: Path) -> dict[str, str]:
        seen: dict[str, str] = {}

        def hook(_world: Any, actors: Mapping[str, Any]) -> None:
            seen.update({name: actor.attributes["color"] for name, actor in actors.items()})

        more = [{**ACTORS[1], "id": f"other{k}", "spawn": f"2.1.-3.{20 + 5 * k}"} for k in range(6)]
        run(workspace, folder, actors=[*ACTORS, *more], hook=hook)
        return seen

    first, second = (tmp_path / name for name in ("first", "second"))
    first.mkdir()
    second.mkdir()
    seen = colours_of(first)
    assert len(seen) == 8
    assert len(set(seen.values())) == 2, "the stand-in has two colours"
    assert colours_of(second) == seen


@pytest.mark.slow
def test_a_hook_that_fails_ends_the_run_with_its_name(workspace: Workspace, tmp_path: Path) -> None:
    def broken(_world: Any, _actors: Mapping[str, Any]) -> None:
        raise ValueError("no such thing")

    result, report, _ = run(workspace, tmp_path, hook=broken)
    assert result.status == "failed"
    assert report.error is not None
    assert "broken failed: ValueError('no such thing')" in report.error


@pytest.mark.parametrize("words", ["json", "json:", "json:nothing", "no_such_module:run", "json:x"])
def test_a_hook_that_is_none_is_refused(words: str) -> None:
    with pytest.raises(InputError, match="hook"):
        load_hook(words)


@pytest.mark.slow
def test_a_sensor_on_the_ego_is_recorded_into_the_runs_folder(
    workspace: Workspace, tmp_path: Path
) -> None:
    pytest.importorskip("av", reason="pictures need the package av")
    sensors = parse_sensors(json.dumps(SENSORS), file="sensors.json")
    result, report, left = run(workspace, tmp_path, sensors=sensors, parity=False)
    assert (result.status, report.error) == ("completed", None)
    assert not [actor for actor in left if actor["type_id"].startswith(("sensor", "vehicle"))]
    folder = result.folder / "sensors" / "front"
    pictures = sorted(path.name for path in folder.glob("*.png"))
    assert pictures == [f"{k:06d}.png" for k in range(1, len(pictures) + 1)]
    assert report.sensors == {"front": len(pictures)}
    assert len(pictures) == pytest.approx(SECONDS / 0.2, abs=3)
    header, *rows = (folder / "index.csv").read_text().splitlines()
    assert header == "number,frame,time,x,y,z,pitch,yaw,roll"
    table = np.array([[float(value) for value in row.split(",")] for row in rows])
    assert len(table) == len(pictures)
    assert np.diff(table[:, 2]) == pytest.approx(0.2, abs=1e-4)
    assert np.diff(table[:, 3])[3:].min() > 0.4, "it drives with the ego"
    assert [path.name for path in (tmp_path / "runs").iterdir()] == [result.folder.name]


@pytest.mark.slow
@pytest.mark.parametrize("sensed_speed", [False, True])
def test_lidar_and_radar_on_the_ego_are_recorded_and_radar_sees_speeds_with_physics_only(
    workspace: Workspace, tmp_path: Path, sensed_speed: bool
) -> None:
    ego = {**ACTORS[0], "speed": 8.0, "initial_speed": 8.0}
    ahead = {
        "id": "ahead", "category": "car", "spawn": "2.1.-1.60", "goal": "4.1.-1.200",
        "speed": 14.0, "initial_speed": 14.0,
    }  # fmt: skip
    scan = {"place": {"x": 0.0, "z": 1.0}}
    sensors = {
        "sensors": [
            {"name": "top", "type": "sensor.lidar.ray_cast", **scan},
            {"name": "bow", "type": "sensor.other.radar", **scan},
        ]
    }
    wishes = parse_sensors(json.dumps(sensors), file="sensors.json")
    result, report, _ = run(
        workspace, tmp_path, actors=[ego, ahead], sensors=wishes, parity=False,
        sensed_speed=sensed_speed,
    )  # fmt: skip
    assert (result.status, report.error) == ("completed", None)
    assert set(report.sensors) == {"top", "bow"}
    assert min(report.sensors.values()) >= 40
    table = result.trajectories()
    last = table.filter(pl.col("time") == pl.col("time").max()).sort("id")
    gap = float(last["x"][0] - last["x"][1])
    points = last_of(result, "top")
    other = points[np.argmax(points[:, 0])]
    assert other[0] == pytest.approx(gap, abs=0.6), "ahead of the ego, which is its origin"
    assert abs(other[1]) < 0.3
    [found] = last_of(result, "bow")
    assert found[3] == pytest.approx(gap, abs=0.6)
    driven = last["speed"].to_numpy()
    wanted = driven[0] - driven[1] if sensed_speed else -driven[1]
    assert found[0] == pytest.approx(wanted, abs=0.3)


def last_of(result: Run, name: str) -> np.ndarray:
    """What a sensor has seen in the last tick."""
    array = np.load(max((result.folder / "sensors" / name).glob("*.npy")))
    assert array.dtype == np.float32
    return np.asarray(array)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"type": "vehicle.tesla.model3"}, "sensors\\[0\\].type"),
        ({"name": "../up"}, "sensors\\[0\\].name"),
        ({"place": {"x": "ahead"}}, "sensors\\[0\\].place.x"),
        ({"colour": "red"}, "sensors\\[0\\].colour"),
    ],
)
def test_a_wrong_sensor_is_refused_with_its_place(changed: dict[str, Any], words: str) -> None:
    data = {"sensors": [{**SENSORS["sensors"][0], **changed}]}
    with pytest.raises(InputError, match=f"sensors.json: {words}"):
        parse_sensors(json.dumps(data), file="sensors.json")


@pytest.mark.slow
def test_an_attribute_that_the_sensor_does_not_have_ends_the_run_with_its_name(
    workspace: Workspace, tmp_path: Path
) -> None:
    data = {"sensors": [{**SENSORS["sensors"][0], "attributes": {"colour": "red"}}]}
    result, report, _ = run(
        workspace, tmp_path, sensors=parse_sensors(json.dumps(data), file="s.json")
    )
    assert result.status == "failed"
    assert "front: sensor.camera.rgb has no attribute 'colour'" in str(report.error)
