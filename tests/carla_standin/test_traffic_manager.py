from __future__ import annotations

import json
import subprocess
import sys

import pytest

from tests.carla_standin.conftest import MAPS

carla = pytest.importorskip("carla", reason="the real client asks the stand-in")

SCRIPT = """
import json, os, socket, sys
from pathlib import Path
from tests.carla_standin.conftest import connect, synchronize
from tests.carla_standin.process import StandIn

with socket.socket() as probe:
    probe.bind(("", 0))
    port = probe.getsockname()[1]
with StandIn(Path(sys.argv[1])) as server:
    client = connect(server)
    world = synchronize(client)
    blueprint = world.get_blueprint_library().find("vehicle.tesla.model3")
    cars = [world.spawn_actor(blueprint, at) for at in world.get_map().get_spawn_points()[:5]]
    world.tick()
    manager = client.get_trafficmanager(port)
    manager.set_synchronous_mode(True)
    manager.set_hybrid_physics_mode(True)
    for car in cars:
        car.set_autopilot(True, port)
    before = [car.get_location() for car in cars]
    for _ in range(100):
        world.tick()
    print(json.dumps([car.get_location().distance(at) for car, at in zip(cars, before)]))
    sys.stdout.flush()
    # The manager's thread kills the process when its server goes before it.
    os._exit(0)
"""


def test_the_clients_traffic_manager_drives_vehicles_on_the_stand_in() -> None:
    # In a process of its own: the Traffic Manager aborts on any error, and cannot be caught.
    ended = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(MAPS / "town_5x5.xodr")],
        cwd=MAPS.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    distances = json.loads(ended.stdout.splitlines()[-1])
    assert len(distances) == 5
    assert min(distances) > 5.0
