"""Scenes of recorded traffic mirrored into CARLA: where the file has them, at its time."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

import odscen
from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import dumps
from tests.carla.observer import Frame, Observer
from tests.carla_standin.process import StandIn
from tests.formats.tracks.test_tracks_on_maps import ROOT, SHARED, crossing_traffic

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

pytestmark = pytest.mark.slow

SCENES = {
    "own": ("crossing.csv", ROOT / "maps" / "signal_crossing.xodr", "behind"),
    "fabriksgatan": (
        "omega-prime/pedestrian.osi", SHARED / "omega-prime/fabriksgatan.xodr", "",
    ),
    "alks": ("omega-prime/alks_cut-in.osi", SHARED / "omega-prime/straight_500m.xodr", ""),
    "interaction": (
        "interaction/vehicle_tracks_000.csv", SHARED / "interaction/TestScenarioForScripts.osm", "",
    ),
}  # fmt: skip
"""Recording, its map, and who is the ego where others react or drive."""
NEAR, SOON = 0.02, 0.02
"""Metres and seconds by which what is shown may differ from the file."""


@pytest.fixture(scope="module", params=SCENES)
def scene(
    request: pytest.FixtureRequest, workspace: Workspace, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, str, str]:
    """A recording, the name of its map, and the ego."""
    name, map_file, ego = SCENES[request.param]
    if not map_file.is_file():
        pytest.skip("needs the recordings of ../shared")
    options = {"origin": "0,0"} if map_file.suffix == ".osm" else {}
    entry = workspace.add_map(map_file, importing=odscen.ImportSettings(options=options))
    file = SHARED / name
    if request.param == "own":
        file = tmp_path_factory.mktemp("own") / name
        crossing_traffic().write_csv(file)
    if not ego:
        rows = odscen.read_recorded_traffic(file).rows
        drivers = rows.filter(pl.col("category") != "pedestrian")
        ego = str(drivers.group_by("id").len().sort("len", "id")["id"][-1])
    return file, entry.name, ego


def mirrored(
    workspace: Workspace, scenario: odscen.Scenario, out: Path
) -> tuple[odscen.Run, list[Frame], Observer]:
    """The run, and what a client saw from the first frame with a road user on."""
    path = out / "scene.scenario.json"
    path.write_text(dumps(scenario), encoding="utf-8")
    entry = workspace.map(scenario.map.name)
    ego = next((actor.id for actor in scenario.actors if actor.ego), "nobody")
    options = {"tick": scenario.simulation.step_length}
    with (
        StandIn(entry.path("xodr"), map_name=entry.name) as server,
        Observer(server, out / "seen.json", ego=ego) as observer,
    ):
        address = Address(server.host, server.port)
        result, report = cosim(workspace, path, CosimOptions(address, **options), out=out)
    assert (result.status, report.error, report.refused) == ("completed", None, [])
    first = next(k for k, frame in enumerate(observer.frames) if frame.users)
    return odscen.Run.open(result.folder), observer.frames[first:], observer


def shown_places(frames: list[Frame], observer: Observer, step: float) -> pl.DataFrame:
    """Middles of bodies in the frame of the map, and seconds from the first frame on."""
    rows: list[dict[str, Any]] = []
    for number, frame in enumerate(frames):
        for user, (x, y, _, pitch, yaw, *_) in frame.users.items():
            ahead, right = observer.boxes[user][0], observer.boxes[user][4]
            turn = math.radians(yaw)
            back = ahead * math.cos(math.radians(pitch))
            rows.append(
                {
                    "id": user,
                    "time": number * step,
                    "x": x + back * math.cos(turn) - right * math.sin(turn),
                    "y": -(y + back * math.sin(turn) + right * math.cos(turn)),
                }
            )
    return pl.DataFrame(rows)


def worst_departures(shown: pl.DataFrame, tracks: pl.DataFrame, begin: float) -> dict[str, float]:
    """Metres between what is shown and tracks, at the time of the tracks."""
    worst = {}
    for (user,), own in tracks.group_by("id"):
        there = shown.filter(pl.col("id") == user).sort("time")
        time, was = there["time"].to_numpy() + begin, own["time"].to_numpy()
        assert (time[0], time[-1]) == pytest.approx((was[0], was[-1]), abs=SOON), user
        x, y = (np.interp(time, was, own[axis].to_numpy()) for axis in ("x", "y"))
        apart = np.hypot(there["x"].to_numpy() - x, there["y"].to_numpy() - y)
        worst[str(user)] = float(np.asarray(apart).max())
    return worst


def imported(workspace: Workspace, scene: tuple[Path, str, str], **options: str) -> odscen.Scenario:
    found = odscen.import_file(workspace, scene[0], on_map=scene[1], options=options).scenario
    assert found is not None
    return found


def test_who_follows_its_track_is_shown_where_and_when_the_file_has_it(
    workspace: Workspace, scene: tuple[Path, str, str], tmp_path: Path
) -> None:
    scenario = imported(workspace, scene, follow="track")
    _, frames, observer = mirrored(workspace, scenario, tmp_path)
    shown = shown_places(frames, observer, scenario.simulation.step_length)
    rows = odscen.read_recorded_traffic(scene[0]).rows
    known = rows.filter(pl.col("id").is_in([actor.id for actor in scenario.actors]))
    assert known["id"].n_unique() == shown["id"].n_unique() == len(scenario.actors)
    worst = worst_departures(shown, known, float(rows["time"].to_numpy().min()))
    assert max(worst.values()) <= NEAR, worst


@pytest.mark.parametrize("follow", ["react", "drive"])
def test_a_scene_with_a_free_ego_is_shown_as_sumo_drives_it(
    workspace: Workspace, scene: tuple[Path, str, str], follow: str, tmp_path: Path
) -> None:
    scenario = imported(workspace, scene, follow=follow, ego=scene[2])
    run, frames, observer = mirrored(workspace, scenario, tmp_path)
    shown = shown_places(frames, observer, scenario.simulation.step_length)
    driven = run.trajectories()
    assert set(shown["id"].to_list()) == set(driven["id"].to_list())
    begin = float(driven["time"].to_numpy().min())
    for (user,), own in driven.group_by("id"):
        there = shown.filter(pl.col("id") == user)
        steps = pl.DataFrame({"step": (there["time"] / scenario.simulation.step_length).round()})
        seen = there.with_columns(steps["step"])
        ran = own.with_columns(
            step=((pl.col("time") - begin) / scenario.simulation.step_length).round()
        )
        both = seen.join(ran, on="step", suffix="_run")
        assert both.height >= 0.95 * own.height, user
        apart = np.hypot(both["x"] - both["x_run"], both["y"] - both["y_run"])
        assert float(np.asarray(apart).max()) <= NEAR, user
