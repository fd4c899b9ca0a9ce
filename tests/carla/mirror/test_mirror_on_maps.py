"""What the server shows, against SUMO's own recording turned into CARLA's frame by a few lines."""

from __future__ import annotations

import json
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from scipy.spatial import cKDTree

from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.carla.conftest import MAPS, Sample, lights_of_sumo_alone
from tests.carla.observer import Frame, Observer
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

STEP = 0.2
TICKS = 2
SECONDS = 12.0
LETTERS = {"G": "Green", "g": "Green", "y": "Yellow", "r": "Red", "s": "Red", "u": "Yellow"}


class Oracle:
    """Heights from the client's own map: waypoints a hand's breadth apart.

    Which deck of a bridge is meant, the roads say that SUMO's lane belongs to; which of the roads
    that cross in a junction, the direction.
    """

    def __init__(self, workspace: Workspace, name: str) -> None:
        entry = workspace.map(name)
        road_map = carla.Map(name, entry.path("xodr").read_text(encoding="utf-8"))
        points = [(w.transform, str(w.road_id)) for w in road_map.generate_waypoints(0.25)]
        self.xyz = np.array([(p.location.x, p.location.y, p.location.z) for p, _ in points])
        self.turn = np.array([(p.rotation.pitch, p.rotation.yaw) for p, _ in points])
        self.tree = cKDTree(self.xyz[:, :2])
        road = np.array([name for _, name in points])
        table = entry.lane_table()
        roads: dict[str, set[str]] = {}
        for interval in table.intervals:
            key = str(table.lane_keys[interval.lane].road)
            roads.setdefault(table.lane_list[interval.sumo].id, set()).add(key)
        self.own = {lane: np.isin(road, sorted(names)) for lane, names in roads.items()}

    def nearest(self, points: np.ndarray, x: float, y: float) -> int:
        xy = self.xyz[points, :2]
        return int(points[np.argmin(np.hypot(xy[:, 0] - x, xy[:, 1] - y))])

    def ground(
        self, lane: str, x: float, y: float, yaw: float
    ) -> tuple[float, float, float] | None:
        """Height, slope and direction (degrees) of the road, if it is known."""
        near = np.array(self.tree.query_ball_point((x, y), 12.0), dtype=int)
        own = near[self.own[lane][near]] if lane in self.own else near[:0]
        if not len(own):
            return None
        deck = self.xyz[self.nearest(own, x, y), 2]
        along = np.abs(np.sin(np.radians(self.turn[near, 1] - yaw))) < 0.4
        near = near[along & (np.abs(self.xyz[near, 2] - deck) < 2.0)]
        if not len(near):
            return None
        best = self.nearest(near, x, y)
        return self.xyz[best, 2], *self.turn[best]


def differences(
    folder: Path, observer: Observer, frames: list[Frame], oracle: Oracle
) -> dict[str, list[float]]:
    plan = json.loads((folder / "plan.json").read_text())
    actors = {actor["id"]: actor for actor in plan["actors"]}
    dx, dy = plan["net_offset"]
    rows = pl.read_parquet(folder / "trajectories.parquet").rename(
        lambda name: name.removeprefix("vehicle_").removeprefix("person_").replace("timestep_", "")
    )
    kinds = ("place", "height", "heading", "pitch", "feet")
    off: dict[str, list[float]] = {kind: [] for kind in kinds}
    for k, frame in enumerate(frames):
        now = rows.filter((pl.col("time") - k * STEP).abs() < 1e-6)
        assert set(frame.users) == set(now["id"]), f"step {k}"
        for row in now.iter_rows(named=True):
            actor = actors[row["id"]]
            x, y, z, pitch, yaw, *_ = frame.users[row["id"]]
            ahead, up, _, half_height, aside = observer.boxes[row["id"]]
            walks = actor["category"] == "pedestrian"
            if walks:
                off["feet"].append(abs(z + up - half_height - actor["z"]))
            # SUMO: front bumper, degrees clockwise from north. CARLA: middle, clockwise from east.
            east = math.radians(row["angle"] - 90.0)
            fx, fy = row["x"] - dx, -(row["y"] - dy)
            half = actor["length"] / 2
            cx, cy = fx - half * math.cos(east), fy - half * math.sin(east)
            ground = None if walks else oracle.ground(row["lane"], cx, cy, math.degrees(east))
            slope = 0.0
            if ground is not None:
                turn = east - math.radians(ground[2])
                slope = math.atan(math.tan(math.radians(ground[1])) * math.cos(turn))
                off["pitch"].append(abs(pitch - math.degrees(slope)))
            level = half * math.cos(slope)
            back = ahead * math.cos(math.radians(pitch))
            mx = x + back * math.cos(math.radians(yaw)) - aside * math.sin(math.radians(yaw))
            my = y + back * math.sin(math.radians(yaw)) + aside * math.cos(math.radians(yaw))
            off["place"].append(
                math.hypot(mx - fx + level * math.cos(east), my - fy + level * math.sin(east))
            )
            off["heading"].append(abs((yaw - math.degrees(east) + 180.0) % 360.0 - 180.0))
            if ground is not None:
                off["height"].append(abs(z + ahead * math.sin(math.radians(pitch)) - ground[0]))
    return off


def shown_lights(net: Path, states: dict[str, str]) -> dict[str, set[str]]:
    """What each signal may show, from the network file's own notes of its links."""
    found: dict[str, set[str]] = {}
    for logic in ET.parse(net).getroot().iter("tlLogic"):
        for note in logic.iter("param"):
            key = note.get("key", "")
            if key.startswith("linkSignalID:"):
                letter = states[logic.get("id", "")][int(key.removeprefix("linkSignalID:"))]
                for signal in note.get("value", "").split():
                    found.setdefault(signal, set()).add(LETTERS[letter])
    # A signal over several lanes shows green if any of them may go.
    order = ("Green", "Yellow", "Red")
    return {s: {next(o for o in order if o in states)} for s, states in found.items()}


def ego_of(path: Path) -> str:
    """Id of a scenario's ego."""
    actors = json.loads(path.read_text(encoding="utf-8"))["actors"]
    return next((actor["id"] for actor in actors if actor.get("ego")), "")


def mirrored(
    workspace: Workspace,
    path: Path,
    xodr: Path,
    tmp_path: Path,
    box_offset: tuple[float, float] = (0.0, 0.0),
    *,
    sensed_speed: bool = False,
) -> tuple[Path, Observer, list[Frame]]:
    with StandIn(xodr, map_name=xodr.stem, box_offset=box_offset) as server:
        before = server.actors()
        observer = Observer(server, tmp_path / "seen.json", ego=ego_of(path))
        with observer:
            result, report = cosim(
                workspace,
                path,
                CosimOptions(
                    Address(server.host, server.port), tick=STEP / TICKS, sensed_speed=sensed_speed
                ),
                out=tmp_path,
                settings=RunSettings(until=SECONDS, step_length=STEP),
            )
        assert result.status == "completed"
        assert (report.error, report.refused, report.left_behind) == (None, [], [])
        assert report.signals_missing == []
        assert [a["id"] for a in server.actors()] == [a["id"] for a in before]
    first = next(number for number, frame in enumerate(observer.frames) if frame.users)
    return result.folder, observer, observer.frames[first : first + report.ticks : TICKS]


def check(
    workspace: Workspace,
    path: Path,
    xodr: Path,
    tmp_path: Path,
    box_offset: tuple[float, float] = (0.0, 0.0),
) -> dict[str, list[float]]:
    folder, observer, frames = mirrored(workspace, path, xodr, tmp_path, box_offset)
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    everybody_arrived = summary["actors"]["arrived"] == summary["actors"]["planned"]
    assert len(frames) == summary["steps"]
    assert everybody_arrived or len(frames) == round(SECONDS / STEP)
    off = differences(folder, observer, frames, Oracle(workspace, xodr.stem))
    assert max(off["place"]) <= 0.05
    assert max(off["heading"]) <= 0.5
    assert max(off["height"]) <= 0.05
    # Where a road bends from one slope to another, a waypoint has either.
    assert np.percentile(off["pitch"], 99.5) <= 0.5
    assert len(off["height"]) > 0.7 * len(off["place"]), "the oracle knows most places"
    alone = lights_of_sumo_alone(folder, len(frames))
    for frame, states in zip(frames, alone, strict=True):
        for signal, shown in shown_lights(folder / "sumo" / "net.net.xml", states).items():
            assert frame.lights[signal] in shown, f"signal {signal} in frame {frame.number}"
    return off


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_signalised_crossing_is_shown_exactly(
    workspace: Workspace, sample: Sample, tmp_path: Path, seed: int
) -> None:
    xodr = MAPS / "signal_crossing.xodr"
    off = check(workspace, sample(xodr, seed=seed), xodr, tmp_path)
    # The map is level, so the ground is where everybody starts.
    assert off["feet"]
    assert max(off["feet"]) <= 0.03


@pytest.mark.slow
@pytest.mark.parametrize("sensed_speed", [False, True])
def test_sensors_see_speeds_only_where_vehicles_keep_physics(
    workspace: Workspace, sample: Sample, tmp_path: Path, sensed_speed: bool
) -> None:
    xodr = MAPS / "signal_crossing.xodr"
    folder, observer, frames = mirrored(
        workspace, sample(xodr, seed=5), xodr, tmp_path, sensed_speed=sensed_speed
    )
    off = differences(folder, observer, frames, Oracle(workspace, xodr.stem))
    assert max(off["place"]) <= 0.05
    rows = pl.read_parquet(folder / "trajectories.parquet")
    driven = {(row[0], row[1]): row[2] for row in rows.select(
        "timestep_time", "vehicle_id", "vehicle_speed"
    ).drop_nulls().iter_rows()}  # fmt: skip
    walks = {a["id"] for a in json.loads((folder / "plan.json").read_text())["actors"]
             if a["category"] == "pedestrian"}  # fmt: skip
    wrong, moving = [], 0
    for k, frame in enumerate(frames):
        for name, (*_, vx, vy, vz) in frame.users.items():
            if name not in walks:
                told = driven[round(k * STEP, 6), name]
                moving += told > 1.0
                wrong.append(abs(math.hypot(vx, vy, vz) - (told if sensed_speed else 0.0)))
    assert moving > 100
    assert max(wrong) <= 0.1


@pytest.mark.slow
def test_bodies_are_in_the_middle_of_boxes_that_are_not_around_their_origin(
    workspace: Workspace, sample: Sample, tmp_path: Path
) -> None:
    xodr = MAPS / "signal_crossing.xodr"
    check(workspace, sample(xodr, seed=4), xodr, tmp_path, box_offset=(-0.4, 0.15))


@pytest.mark.slow
def test_hills_are_shown_exactly(workspace: Workspace, sample: Sample, tmp_path: Path) -> None:
    # CARLA's maps know no superelevation, so the oracle cannot judge heights with it.
    text = (MAPS / "rural_hills.xodr").read_text(encoding="utf-8")
    xodr = tmp_path / "level_hills.xodr"
    xodr.write_text(re.sub(r"<superelevation .*?/>", "", text), encoding="utf-8")
    off = check(workspace, sample(xodr, fill=0.4), xodr, tmp_path)
    assert off["height"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["carla-2019/Town05", "carla-2020/Town04"])
def test_towns_with_slopes_and_bridges_are_shown_exactly(
    workspace: Workspace, sample: Sample, shared_maps: Path, tmp_path: Path, name: str
) -> None:
    xodr = shared_maps / f"{name}.xodr"
    check(workspace, sample(xodr, seed=5, fill=0.1, segments=30), xodr, tmp_path)
