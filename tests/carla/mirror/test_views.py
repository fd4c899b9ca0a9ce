"""Cameras of a mirrored run: where they are in every tick."""

from __future__ import annotations

import base64
import math
import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.sensors.pictures import Wish
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.carla.conftest import MAPS, scenario_of
from tests.carla.observer import Observer
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")
pytest.importorskip("av", reason="pictures need the package av")

WEAVE = MAPS / "motorway_weave.xodr"
TICK, STEP = 0.05, 0.5
EGO = {
    "id": "ego", "category": "car", "model": "vehicle.tesla.model3", "ego": True,
    "spawn": "2.1.-1.40", "goal": "4.1.-1.200", "speed": 25.0,
}  # fmt: skip


def test_the_camera_is_above_the_ego_in_every_tick_and_all_pictures_are_counted(
    workspace: Workspace, tmp_path: Path
) -> None:
    path = scenario_of(workspace, WEAVE, [EGO], tmp_path)
    with (
        StandIn(WEAVE, map_name=WEAVE.stem) as server,
        Observer(server, tmp_path / "seen.json") as observer,
    ):
        result, report = cosim(
            workspace,
            path,
            CosimOptions(
                Address(server.host, server.port),
                tick=TICK,
                pictures=Wish(tmp_path / "frames", width=64, height=36),
            ),
            out=tmp_path,
            settings=RunSettings(until=6.0, step_length=STEP),
        )
    assert (result.status, report.error) == ("completed", None)
    both = [frame.users for frame in observer.frames if {"ego", "camera"} <= frame.users.keys()]
    places = np.array([[*seen["ego"][:2], *seen["camera"][:2]] for seen in both])
    assert len(places) > 90
    moved = np.hypot(*np.diff(places[:, :2], axis=0).T)
    assert moved.max() > 0.5, "it drove"
    assert np.hypot(*(places[:, :2] - places[:, 2:]).T).max() <= 0.05
    written = len(list((tmp_path / "frames").iterdir()))
    assert written == report.pictures - report.pictures_dropped
    assert math.isclose(written, 60, abs_tol=12)


def test_a_sheet_has_the_plan_beside_what_the_camera_saw_in_the_same_tick(
    workspace: Workspace, tmp_path: Path
) -> None:
    path = scenario_of(workspace, WEAVE, [EGO], tmp_path)
    with StandIn(WEAVE, map_name=WEAVE.stem) as server:
        result, _ = cosim(
            workspace,
            path,
            CosimOptions(
                Address(server.host, server.port),
                tick=TICK,
                pictures=Wish(sheet=4, width=64, height=36),
            ),
            out=tmp_path,
            settings=RunSettings(until=8.0, step_length=STEP),
        )
    page = result.folder / "picture_sheet.html"
    text = page.read_text(encoding="utf-8")
    times = [float(one) for one in re.findall(r"<h2>([\d.]+) s</h2>", text)]
    assert len(times) == 4
    assert times[-1] - times[0] >= 5.0
    steps = np.diff(times)
    assert steps.max() <= 2.0 * steps.min()
    driven = result.trajectories().filter(pl.col("id") == "ego").sort("time")
    boxes = re.findall(r'viewBox="(-?\d+) (-?\d+) (\d+) (\d+)" class="run-map"', text)
    for time, box in zip(times, boxes, strict=True):
        left, top, wide, tall = (float(one) / 100.0 for one in box)
        assert (wide, tall) == (120.0, pytest.approx(67.5, abs=0.01))
        where = [np.interp(time, driven["time"], driven[name]) for name in ("x", "y")]
        # The camera is where the tick before has shown the ego to be.
        assert math.hypot(left + wide / 2 - where[0], -top - tall / 2 - where[1]) <= 0.1
    assert text.count('class="c-car body"') == 4
    pictures = re.findall(r'src="data:image/jpeg;base64,([^"]+)"', text)
    assert [base64.b64decode(one)[:2] for one in pictures] == [b"\xff\xd8"] * 4
