"""Vehicles and walkers of another program at random poses among traffic: SUMO goes on."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from bench.foreign_poses import KINDS, run_among_traffic
from odscen.maps.store import Workspace

MAPS = Path(__file__).parents[4] / "maps"

# libsumo is one global simulation, so this runs in a process of its own.
SEEN = """
import math, sys
from odscen.sumo.worker.protocol import ForeignUser
from odscen.sumo.worker.simulation.libsumo_import import import_libsumo
from odscen.sumo.worker.simulation.session import open_session
places = [
    (160.0, 151.25, 90.0, 0.0), (160.0, -400.0, 0.0, 5.0), (1e6, 1e6, 0.0, 5.0),
    (math.nan, 151.25, 90.0, 0.0), (160.0, math.inf, 90.0, 0.0), (160.0, 151.25, 90.0, math.nan),
]
options = ["-n", sys.argv[1], "--step-length", "0.1", "--no-step-log", "--fcd-output", sys.argv[2]]
with open_session(options) as session:
    sumo, foreign = import_libsumo(), session.foreign_traffic()
    for _ in range(3):
        foreign.show(
            ForeignUser(str(number), kind, *place, 4.5, 1.8)
            for number, (place, kind) in enumerate(
                (place, kind) for place in places for kind in ("passenger", "pedestrian")
            )
        )
        session.step()
    print(*sorted(sumo.vehicle.getIDList()))
"""


@pytest.mark.parametrize(
    ("town", "poses"),
    [
        ("signal_crossing", 60),
        pytest.param("town_5x5", 500, marks=pytest.mark.slow),
        pytest.param("roundabout", 500, marks=pytest.mark.slow),
    ],
)
def test_no_pose_of_another_programs_road_user_ends_a_run(
    town: str, poses: int, tmp_path: Path
) -> None:
    workspace = Workspace.open(tmp_path / "workspace")
    entry = workspace.add_map(MAPS / f"{town}.xodr")
    shown, error = run_among_traffic(workspace, entry, tmp_path, seed=1, poses=poses)
    assert error is None
    assert sum(shown.shown.values()) >= poses
    assert set(shown.shown) == set(KINDS)


def test_only_those_on_a_lane_are_in_sumo(tmp_path: Path) -> None:
    entry = Workspace.open(tmp_path).add_map(MAPS / "signal_crossing.xodr")
    net = next(entry.folder.rglob("net.net.xml"))
    done = subprocess.run(
        [sys.executable, "-c", SEEN, str(net), str(tmp_path / "fcd.xml")],
        capture_output=True, text=True, timeout=180, check=True,
    )  # fmt: skip
    assert done.stdout.split() == ["carla:0", "carla:1"]
