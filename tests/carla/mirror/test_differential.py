"""What the client's own components send for a road user is what the mirror sends for it.

The walker AI and, without physics, the Traffic Manager put road users where they are to be, as the
mirror does. Where one of them has put one, the mirror is asked to show one of odscen's at the same
place of odscen's own map, and the commands are compared as they were on the wire.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from odscen.maps.store import Workspace
from tests.carla.conftest import MAPS

pytest.importorskip("carla", reason="the client's own components are compared with")

SCRIPT = """
import json, os, sys
from pathlib import Path
from tests.carla.mirror import test_differential as test

sent = getattr(test, sys.argv[1])(Path(sys.argv[2]))
print(json.dumps(sent))
sys.stdout.flush()
# The Traffic Manager's thread kills the process when its server goes before it.
os._exit(0)
"""
CAR, WALKER = "vehicle.tesla.model3", "walker.pedestrian.0001"
Command = list[Any]
"""Index and arguments: the actor, ``[[x, y, z], [pitch, yaw, roll]]``, a walker's speed."""


def told(what: str, folder: Path, home: Path) -> list[list[Command]]:
    """Pairs of commands: the client's own component's and the mirror's."""
    ended = subprocess.run(
        [sys.executable, "-c", SCRIPT, what, str(folder)],
        cwd=MAPS.parent, env={**os.environ, "HOME": str(home)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    return list(json.loads(ended.stdout.splitlines()[-1]))


def of_the_walker_ai(root: Path) -> list[list[Command]]:
    import carla

    from odscen.carla.server.carla_server import Server
    from odscen.carla.server.client import Address
    from tests.carla_standin.process import StandIn

    walks = Workspace.open(root).map("signal_crossing").graph().walks
    nodes = [np.asarray(one) for one in (walks.x, walks.y, walks.z)]
    with (
        StandIn(MAPS / "signal_crossing.xodr", navigation=True) as stand_in,
        Server(Address(stand_in.host, stand_in.port)) as server,
    ):
        server.synchronize(0.05)
        world = server.world
        start = carla.Transform(carla.Location(-26.0, 9.0, 1.4))
        walker = world.spawn_actor(world.get_blueprint_library().find(WALKER), start)
        server.tick()
        blueprint = world.get_blueprint_library().find("controller.ai.walker")
        controller = world.spawn_actor(blueprint, carla.Transform(), attach_to=walker)
        server.tick()
        controller.start()
        controller.go_to_location(carla.Location(40.0, 9.0, 0.1))
        controller.set_max_speed(1.3)
        for _ in range(60):
            server.tick()
        theirs = stand_in.commands()[walker.id]
        controller.stop()
        controller.destroy()
        walker.destroy()
        _, ((x, y, _), (_, yaw, _)), speed = theirs[1]
        ground = nodes[2][np.argmin(np.hypot(nodes[0] - x, nodes[1] + y))]
        places = [(x, -y, float(ground), -math.radians(yaw), 0.0, speed)]
        return [[theirs, *shown(server, stand_in, WALKER, "pedestrian", places)]]


def of_the_traffic_manager(root: Path) -> list[list[Command]]:
    import socket

    from odscen.carla.server.carla_server import Server
    from odscen.carla.server.client import Address
    from tests.carla_standin.process import StandIn

    lanes = Workspace.open(root).map("rural_hills").graph().lanes
    with socket.socket() as probe:
        probe.bind(("", 0))
        port = probe.getsockname()[1]
    stand_in = StandIn(MAPS / "rural_hills.xodr").__enter__()
    server = Server(Address(stand_in.host, stand_in.port)).__enter__()
    server.synchronize(0.05)
    world = server.world
    blueprint = world.get_blueprint_library().find(CAR)
    spots = world.get_map().get_spawn_points()[:25:5]
    cars = [world.spawn_actor(blueprint, at) for at in spots]
    server.tick()
    manager = server.client.get_trafficmanager(port)
    manager.set_synchronous_mode(True)
    manager.set_hybrid_physics_mode(True)
    manager.set_random_device_seed(1)
    for car in cars:
        car.set_autopilot(True, port)
        manager.set_desired_speed(car, 36.0)
    for _ in range(90):  # from spawn points, which float, down to the road
        server.tick()
    said = stand_in.commands()
    theirs = [said[car.id] for car in cars]
    for car in cars:
        car.set_autopilot(False, port)
    manager.set_synchronous_mode(False)
    server.destroy([car.id for car in cars])
    places = [on_the_road(lanes, *command[1][1]) for command in theirs]
    ours = shown(server, stand_in, CAR, "car", places)
    return [list(pair) for pair in zip(theirs, ours, strict=True)]


def on_the_road(lanes: Any, at: list[float], turn: list[float]) -> tuple[float, ...]:
    """A place of CARLA's with height, heading and slope of odscen's own lane graph there."""
    x, y, hdg = at[0], -at[1], -math.radians(turn[1])
    along = np.cos(lanes.hdg - hdg) > 0.9
    away = np.where(along, np.hypot(lanes.x - x, lanes.y - y), np.inf)
    node = int(np.argmin(away))
    ahead = (x - lanes.x[node]) * math.cos(hdg) + (y - lanes.y[node]) * math.sin(hdg)
    pitch = float(lanes.pitch[node])
    z = float(lanes.z[node]) + ahead * math.tan(pitch)
    return x, y, z, float(lanes.hdg[node]), pitch, 10.0


def shown(
    server: Any, stand_in: Any, blueprint: str, category: str, places: list[tuple[float, ...]]
) -> list[Command]:
    """Commands by which the mirror shows road users at places: x, y, z, hdg, pitch, speed."""
    from odscen.carla.mirror.mirrored import Mirror
    from odscen.records.run_plan import Plan, PlannedActor
    from odscen.sumo.runner.in_step import Step

    count = len(places)
    x, y, z, hdg, pitch, speed = np.array(places).T
    actors = tuple(
        PlannedActor(f"a{k}", category, "", None, 0.0, 4.5, 1.8, 0.0, 0.0, 0.0, 0.0)
        for k in range(count)
    )
    plan = Plan("differential", 0, 60.0, 0.05, (0.0, 0.0), actors)
    mirror = Mirror(plan, [blueprint] * count, server.shapes([blueprint]))
    numbers = np.arange(count)
    for time in (0.0, 0.05):
        step = Step(
            time,
            numbers,
            numbers.astype(np.str_),
            x,
            y,
            z,
            hdg,
            pitch,
            speed,
            np.zeros_like(numbers),
        )
        for batch in mirror.batches(step, (1.0,)):
            mirror.answered(server.apply(batch))
    said = stand_in.commands()
    return [said[mirror.actors[row]] for row in range(count)]


@pytest.fixture(scope="module")
def catalogue(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("catalogue")
    workspace = Workspace.open(root)
    for name in ("signal_crossing", "rural_hills"):
        workspace.add_map(MAPS / f"{name}.xodr")
    return root


@pytest.mark.slow
def test_the_mirror_moves_a_walker_as_the_clients_walker_ai_does(
    catalogue: Path, tmp_path: Path
) -> None:
    [(theirs, ours)] = told("of_the_walker_ai", catalogue, tmp_path)
    assert theirs[0] == ours[0] == 7  # ApplyWalkerState
    (_, (at, turn), speed), (_, (own_at, own_turn), own_speed) = theirs[1], ours[1]
    assert own_at[:2] == pytest.approx(at[:2], abs=1e-3)
    # The ground's height, not that of the walker's middle, which is 0.9 m above it.
    assert own_at[2] == pytest.approx(at[2], abs=0.03)
    assert at[2] < 0.2
    assert own_turn == pytest.approx(turn, abs=1e-3)
    assert own_speed == pytest.approx(speed) == pytest.approx(1.3, abs=0.05)


@pytest.mark.slow
def test_the_mirror_moves_vehicles_as_the_clients_traffic_manager_does(
    catalogue: Path, tmp_path: Path
) -> None:
    """On hills, so that the sign of the slope counts."""
    pairs = told("of_the_traffic_manager", catalogue, tmp_path)
    slopes = [theirs[1][1][1][0] for theirs, _ in pairs]
    assert min(slopes) < -1.0 < 1.0 < max(slopes)
    for theirs, ours in pairs:
        assert theirs[0] == ours[0] == 6  # ApplyTransform
        (_, (at, turn)), (_, (own_at, own_turn)) = theirs[1], ours[1]
        assert own_at[:2] == pytest.approx(at[:2], abs=1e-3)
        # The manager goes on as high as it was for some metres: 0.07 m above its own map's road.
        assert own_at[2] == pytest.approx(at[2], abs=0.1)
        assert own_turn[0] == pytest.approx(turn[0], abs=0.3)
        assert abs((own_turn[1] - turn[1] + 180.0) % 360.0 - 180.0) < 1.0
        assert own_turn[2] == turn[2] == 0.0
