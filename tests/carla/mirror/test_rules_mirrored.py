"""Rules in a mirrored run: CARLA shows what they make SUMO do, lights and walkers included."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from odscen.app.scenarios import write_scenario
from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.in_step import Step
from tests.carla.conftest import MAPS
from tests.carla_standin.process import StandIn
from tests.sumo.story_case import document, node_at, walk_node_at

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

TOWN = MAPS / "town_5x5.xodr"
PATH = [[230.0, 104.5], [238.0, 102.0]]
"""From lane to lane and beside both, in OpenDRIVE's frame."""


def plan(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "plan.json").read_text(encoding="utf-8")))


@pytest.mark.slow
def test_lights_walkers_and_paths_of_rules_are_shown(workspace: Workspace, tmp_path: Path) -> None:
    name = TOWN.stem
    workspace.add_map(TOWN)
    actors: list[dict[str, Any]] = [
        {"id": "ego", "category": "car", "spawn": node_at(name, 215.0, 103.4),
         "goal": node_at(name, 390.0, 103.4), "initial_speed": 5.0},
        {"id": "child", "category": "pedestrian", "spawn": walk_node_at(name, 290.0, 100.5),
         "goal": walk_node_at(name, 240.0, 109.5)},
    ]  # fmt: skip
    shown = {"indicator": "hazard", "high_beam": True, "fog": True}
    rules = [
        {"id": "lit", "actor": "ego", "when": {"time": {"after": 1.0}},
         "then": [{"lights": shown}]},
        {"id": "swerve", "actor": "ego", "when": {"time": {"after": 1.0}},
         "then": [{"path": {"points": PATH, "speed": 8.0}}]},
        {"id": "run", "actor": "child", "when": {"time": {"after": 1.0}},
         "then": [{"walk": {"to": [290.0, 104.0], "speed": 2.0}}]},
    ]  # fmt: skip
    file = write_scenario(document(name, actors, rules), tmp_path / "rules.scenario.json")
    seen: list[int] = []
    ways: list[list[float]] = []
    with StandIn(TOWN) as standin:
        client = carla.Client(standin.host, standin.port)
        client.set_timeout(5.0)
        world = client.get_world()

        def look(step: Step) -> bool:
            cars = [a for a in standin.actors() if a["type_id"].startswith("vehicle.")]
            ways.extend([x, y, yaw] for [[x, y, _], [_, yaw, _]] in [a["transform"] for a in cars])
            if step.time in (0.5, 3.0):
                states = dict(world.get_vehicles_light_states())
                seen.append(int(next(iter(states.values()), 0)))
            return True

        address = Address(standin.host, standin.port, 5.0)
        options = CosimOptions(address=address, on_step=look)
        result, report = cosim(
            workspace, file, options, out=tmp_path / "runs", settings=RunSettings(until=4.0)
        )
        assert report.error is None
    light = carla.VehicleLightState
    wanted = int(light.HighBeam | light.Fog | light.LeftBlinker | light.RightBlinker)
    assert [one & wanted for one in seen] == [0, wanted]
    [half] = [a["length"] / 2 for a in plan(result.folder)["actors"] if a["id"] == "ego"]
    x, y, yaw = np.array(ways).T
    front = np.column_stack(
        [x + half * np.cos(np.radians(yaw)), y + half * np.sin(np.radians(yaw))]
    )
    on_path = front[(front[:, 0] >= PATH[0][0]) & (front[:, 0] <= PATH[1][0])]
    assert len(on_path) > 5
    wanted = -np.interp(on_path[:, 0], *np.transpose(PATH))
    assert on_path[:, 1] == pytest.approx(wanted, abs=0.05)
    figures = json.loads((result.folder / "parity.json").read_text(encoding="utf-8"))
    assert figures["share_mirrored"] == 1.0
    assert figures["position_error_m"]["max"] <= 0.05
