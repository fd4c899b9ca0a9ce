from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

from tests.carla_standin import driving
from tests.carla_standin.conftest import MAPS

carla = pytest.importorskip("carla", reason="the real client asks the stand-in")

SCRIPT = """
import json, math, os, socket, sys
from pathlib import Path
from tests.carla_standin.conftest import connect, synchronize
from tests.carla_standin.process import StandIn

with socket.socket() as probe:
    probe.bind(("", 0))
    port = probe.getsockname()[1]
physics = sys.argv[2] == "physics"
with StandIn(Path(sys.argv[1])) as server:
    client = connect(server)
    world = synchronize(client)
    roads = world.get_map()
    blueprint = world.get_blueprint_library().find("vehicle.tesla.model3")
    cars = [world.spawn_actor(blueprint, at) for at in roads.get_spawn_points()[:5]]
    world.tick()
    manager = client.get_trafficmanager(port)
    manager.set_synchronous_mode(True)
    manager.set_random_device_seed(3)
    manager.set_hybrid_physics_mode(not physics)
    for car in cars:
        car.set_autopilot(True, port)
        manager.set_desired_speed(car, 30.0)
        manager.auto_lane_change(car, False)
    told = {"off_lane": [], "speed": [], "moved": [], "turned": [], "steer": []}
    last = None
    for _ in range(260 if physics else 60):
        world.tick()
        snapshot = world.get_snapshot()
        seen = [snapshot.find(car.id) for car in cars]
        for car, before, now in zip(cars, last or seen, seen):
            at = now.get_transform().location
            told["off_lane"].append(roads.get_waypoint(at).transform.location.distance(at))
            told["moved"].append(before.get_transform().location.distance(at) / 0.05)
            velocity = now.get_velocity()
            told["speed"].append(math.hypot(velocity.x, velocity.y, velocity.z))
            told["turned"].append(abs(now.get_angular_velocity().z))
            told["steer"].append(abs(car.get_control().steer))
        last = seen
    print(json.dumps(told))
    sys.stdout.flush()
    # The manager's thread kills the process when its server goes before it.
    os._exit(0)
"""


def driven_by_the_manager(how: str) -> dict[str, Any]:
    # In a process of its own: the Traffic Manager aborts on any error, and cannot be caught.
    ended = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(MAPS / "town_5x5.xodr"), how],
        cwd=MAPS.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return dict(json.loads(ended.stdout.splitlines()[-1]))


def test_the_clients_traffic_manager_drives_vehicles_without_physics() -> None:
    told = driven_by_the_manager("still")
    assert min(max(told["moved"][car::5]) for car in range(5)) > 5.0
    assert max(told["speed"][5 * 5 :]) == 0.0  # once the manager has taken their physics


@pytest.mark.slow
def test_the_clients_traffic_manager_drives_vehicles_with_physics_by_their_controls() -> None:
    told = driven_by_the_manager("physics")
    for car in range(5):
        speeds = told["speed"][car::5]
        assert max(speeds) == pytest.approx(30.0 / 3.6, abs=0.5)
        assert max(told["off_lane"][car::5][20:]) < 1.0  # once it is on the ground
    assert max(told["turned"]) > 10.0
    assert max(told["steer"]) > 0.05
    changes = [(b - a) / 0.05 for a, b in zip(told["speed"][50:], told["speed"][55:], strict=False)]
    assert 2.0 < max(changes) < driving.ENGINE
    assert min(changes) > -driving.BRAKES - 1.0
    # What it says of its speed is how it moves.
    off = [abs(v - m) for v, m in zip(told["speed"][5:], told["moved"][5:], strict=True)]
    assert max(off) < 0.01
