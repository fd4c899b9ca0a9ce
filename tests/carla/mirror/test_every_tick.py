"""What the server shows in every tick, between SUMO's steps too, against SUMO's own recording.

Between two steps a road user is on the straight line from one place to the other, turns the short
way and changes its speed evenly; heights are those of the client's own map.
"""

from __future__ import annotations

import json
import math
from collections import defaultdict
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.carla.conftest import MAPS, Sample
from tests.carla.mirror.test_mirror_on_maps import Oracle, ego_of
from tests.carla.observer import Frame, Observer
from tests.carla_standin.generated import Generation
from tests.carla_standin.process import StandIn
from tests.carla_standin.road_map import RoadMap

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

STEP, TICKS, SECONDS = 0.5, 10, 15.0
LIMITS = {"place": 0.05, "heading": 0.5, "speed": 0.1, "height": 0.05, "feet": 0.03}
"""Metres, degrees and m/s."""
KERB = 0.1
"""Metres by which the server's sidewalks are higher than the map's."""

OTHER = MAPS / "t_junction_signs.xodr"

State = dict[str, float]


def recorded(folder: Path) -> list[dict[str, State]]:
    """Body centres after each step: CARLA's frame, heights left out."""
    plan = json.loads((folder / "plan.json").read_text())
    length = {actor["id"]: actor["length"] for actor in plan["actors"]}
    dx, dy = plan["net_offset"]
    rows = pl.read_parquet(folder / "trajectories.parquet").rename(
        lambda name: name.removeprefix("vehicle_").removeprefix("person_").replace("timestep_", "")
    )
    steps: dict[int, dict[str, State]] = defaultdict(dict)
    for row in rows.iter_rows(named=True):
        east = math.radians(row["angle"] - 90.0)
        half = length[row["id"]] / 2
        steps[round(row["time"] / STEP)][row["id"]] = {
            "x": row["x"] - dx - half * math.cos(east),
            "y": -(row["y"] - dy) - half * math.sin(east),
            "yaw": math.degrees(east), "speed": row["speed"], "lane": row["lane"],
        }  # fmt: skip
    return [steps[k] for k in range(max(steps) + 1)]


def between(last: State, now: State, share: float) -> State:
    turn = (now["yaw"] - last["yaw"] + 180.0) % 360.0 - 180.0
    return {
        "x": last["x"] + share * (now["x"] - last["x"]),
        "y": last["y"] + share * (now["y"] - last["y"]),
        "yaw": last["yaw"] + share * turn,
        "speed": last["speed"] + share * (now["speed"] - last["speed"]),
        "lane": now["lane"],
    }


def jumped(last: State, now: State) -> bool:
    """Whether SUMO has moved one further than it drives; that is shown with the step itself."""
    return math.hypot(now["x"] - last["x"], now["y"] - last["y"]) > 40.0 * STEP


class Judge:
    """Differences of what is seen from what is so, by kind."""

    def __init__(
        self,
        folder: Path,
        observer: Observer,
        workspace: Workspace,
        name: str,
        made: Generation | None,
    ) -> None:
        actors = json.loads((folder / "plan.json").read_text())["actors"]
        self.walks = {a["id"] for a in actors if a["category"] == "pedestrian"}
        self.boxes = observer.boxes
        self.oracle = Oracle(workspace, name)
        text = workspace.map(name).path("xodr").read_text(encoding="utf-8")
        self.server_map = RoadMap.of(text, name, made)
        self.off: dict[str, list[float]] = defaultdict(list)

    def look(self, name: str, seen: list[float], state: State) -> None:
        x, y, z, pitch, yaw, vx, vy, vz = seen
        ahead, up, _, half_height, _ = self.boxes[name]
        back = ahead * math.cos(math.radians(pitch))
        mx = x + back * math.cos(math.radians(yaw))
        my = y + back * math.sin(math.radians(yaw))
        self.off["place"].append(math.hypot(mx - state["x"], my - state["y"]))
        self.off["heading"].append(abs((yaw - state["yaw"] + 180.0) % 360.0 - 180.0))
        if name in self.walks:
            self._feet(x, y, z + up - half_height)
            return
        self.off["speed"].append(abs(math.hypot(vx, vy, vz) - state["speed"]))
        ground = self.oracle.ground(str(state["lane"]), state["x"], state["y"], state["yaw"])
        if ground is not None:
            self.off["height"].append(abs(z + ahead * math.sin(math.radians(pitch)) - ground[0]))

    def _feet(self, x: float, y: float, feet: float) -> None:
        """Feet on the server's ground, whose sidewalks are higher than the map says."""
        ground = self.server_map.surface(x, y, feet + 1.0, KERB)
        if ground is not None:
            self.off["feet"].append(abs(ground[0] - feet))


def judged(
    workspace: Workspace, path: Path, xodr: Path, tmp_path: Path, *, generated: bool = False
) -> tuple[dict[str, list[float]], int]:
    """Differences in all ticks, and how many ticks there were.

    The server has the map, or else makes a world of it.
    """
    there = OTHER if generated else xodr
    with StandIn(there, map_name=there.stem, kerb=KERB) as server:
        with Observer(server, tmp_path / "seen.json", ego=ego_of(path)) as observer:
            result, report = cosim(
                workspace,
                path,
                CosimOptions(
                    Address(server.host, server.port), tick=STEP / TICKS, sensed_speed=True
                ),
                out=tmp_path,
                settings=RunSettings(until=SECONDS, step_length=STEP),
            )
        assert (result.status, report.error, report.refused) == ("completed", None, [])
        made = Generation.of(server.generation()) if generated else None
    steps = recorded(result.folder)
    judge = Judge(result.folder, observer, workspace, xodr.stem, made)
    first = next(number for number, frame in enumerate(observer.frames) if frame.users)
    frames = observer.frames[first : first + (len(steps) - 1) * TICKS + 1]
    for number, frame in enumerate(frames):
        compare(judge, steps, number, frame)
    return judge.off, len(frames)


def compare(judge: Judge, steps: list[dict[str, Any]], number: int, frame: Frame) -> None:
    k = math.ceil(number / TICKS)
    share = number / TICKS - (k - 1)
    now, last = steps[k], steps[max(k - 1, 0)]
    expected = (
        set(now) if share == 1.0 else {n for n in now if n in last and not jumped(last[n], now[n])}
    )
    assert expected <= set(frame.users), f"frame {frame.number}"
    for name in sorted(expected):
        state = now[name] if share == 1.0 else between(last[name], now[name], share)
        judge.look(name, frame.users[name], state)


def assert_exact(off: dict[str, list[float]], frames: int) -> None:
    assert frames > 0.9 * SECONDS / STEP * TICKS
    for kind, limit in LIMITS.items():
        assert len(off[kind]) > 100, kind
        assert max(off[kind]) <= limit, kind


@pytest.mark.slow
def test_a_level_town_is_shown_exactly_in_every_tick(
    workspace: Workspace, sample: Sample, tmp_path: Path
) -> None:
    xodr = MAPS / "town_5x5.xodr"
    assert_exact(*judged(workspace, sample(xodr, seed=7, fill=0.1), xodr, tmp_path))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["carla-2019/Town05", "carla-2020/Town04"])
def test_towns_with_slopes_and_bridges_are_shown_exactly_in_every_tick(
    workspace: Workspace, sample: Sample, shared_maps: Path, tmp_path: Path, name: str
) -> None:
    xodr = shared_maps / f"{name}.xodr"
    assert_exact(*judged(workspace, sample(xodr, seed=5, fill=0.1, segments=30), xodr, tmp_path))


@pytest.mark.slow
def test_a_world_made_of_a_town_with_slopes_is_shown_exactly_in_every_tick(
    workspace: Workspace, sample: Sample, shared_maps: Path, tmp_path: Path
) -> None:
    xodr = shared_maps / "carla-2020/Town04.xodr"
    path = sample(xodr, seed=5, fill=0.1, segments=30)
    assert_exact(*judged(workspace, path, xodr, tmp_path, generated=True))
