"""The client's own walkers walk on the navigation mesh that the stand-in serves."""

from __future__ import annotations

import json
import os
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import crosswalks
from odscen.opendrive.parse import parse
from tests.carla_standin.conftest import MAPS
from tests.carla_standin.detour import CROSSWALK, SIDEWALK, mesh_file
from tests.carla_standin.navigation import navigation_mesh
from tests.carla_standin.road_map import RoadMap

CROSSING = MAPS / "signal_crossing.xodr"
SCRIPT = """
import json, os, sys
from pathlib import Path
import carla
from tests.carla_standin.conftest import connect, synchronize
from tests.carla_standin.process import StandIn

with StandIn(Path(sys.argv[1]), navigation=True) as server:
    world = synchronize(connect(server))
    world.set_pedestrians_seed(3)
    library = world.get_blueprint_library()
    above = carla.Location(z=1.2)
    starts = [carla.Location(-26.0, 9.0, 0.1), carla.Location(30.0, -8.5, 0.1)]
    goals = [carla.Location(-21.5, -8.0, 0.1), world.get_random_location_from_navigation()]
    walkers = [
        world.spawn_actor(library.find("walker.pedestrian.0001"), carla.Transform(at + above))
        for at in starts
    ]
    world.tick()
    controller = library.find("controller.ai.walker")
    controllers = [world.spawn_actor(controller, carla.Transform(), attach_to=w) for w in walkers]
    world.tick()
    for one, goal in zip(controllers, goals):
        one.start()
        one.go_to_location(goal)
        one.set_max_speed(1.4)
    half = [walker.bounding_box.extent.z for walker in walkers]
    ways = []
    for _ in range(500):
        world.tick()
        seen = [world.get_snapshot().find(walker.id) for walker in walkers]
        places = [one.get_transform().location for one in seen]
        ways.append([[at.x, at.y, at.z - up] for at, up in zip(places, half)])
    velocity = [one.get_velocity().length() for one in seen]
    goals = [[at.x, at.y] for at in goals]
    print(json.dumps({"ways": ways, "goals": goals, "velocity": velocity}))
    sys.stdout.flush()
    os._exit(0)
"""


@pytest.mark.slow
def test_the_clients_own_walkers_walk_on_sidewalks_and_cross_on_crosswalks(tmp_path: Path) -> None:
    # The client keeps the mesh below its home.
    ended = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(CROSSING)],
        cwd=MAPS.parent, env={**os.environ, "HOME": str(tmp_path)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    told = json.loads(ended.stdout.splitlines()[-1])
    [kept] = tmp_path.rglob("*.bin")
    road_map = RoadMap.read(CROSSING, "Crossing")
    assert kept.read_bytes() == navigation_mesh(road_map, 0.0)
    ways = np.array(told["ways"])
    speeds = np.hypot(*np.moveaxis(np.diff(ways[..., :2], axis=0), -1, 0)) / 0.05
    assert np.median(speeds, axis=0) == pytest.approx([1.4, 1.4], abs=0.02)
    assert told["velocity"] == [0.0, 0.0], "walkers that are put somewhere report none"
    # The first has crossed the road, from one sidewalk to the other, before it goes elsewhere.
    assert np.hypot(*(ways[:, 0, :2] - told["goals"][0]).T).min() < 1.0
    for x, y, feet in ways.reshape(-1, 3)[::20].tolist():
        ground = road_map.surface(x, y, feet + 1.0, 0.0)
        assert ground is not None
        if ground[1]:
            assert feet == pytest.approx(ground[0], abs=0.03)


@pytest.mark.slow
def test_a_mesh_covers_sidewalks_and_crosswalks_and_hangs_together() -> None:
    road_map = RoadMap.read(CROSSING, "Crossing")
    header, vertices, polygons = unpacked(navigation_mesh(road_map, 0.0))
    corners = vertices[polygons["vertices"][:, :3]][:, :, [0, 2]]
    a, b, c = np.moveaxis(corners, 1, 0)
    area = 0.5 * np.abs(
        (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    )
    of_sidewalks = area[polygons["area"] == SIDEWALK].sum()
    assert of_sidewalks == pytest.approx(sidewalk_area(), rel=0.1)
    assert area[polygons["area"] == CROSSWALK].sum() > 100.0
    assert (polygons["flags"] == 1 << polygons["area"]).all()
    assert header["links"] == np.count_nonzero(polygons["neighbours"])
    reached, new = {0}, [0]
    while new:
        near = polygons["neighbours"][new][:, :3].ravel()
        new = sorted({int(one) - 1 for one in near if one} - reached)
        reached |= set(new)
    assert len(reached) == len(polygons)


def test_neighbours_are_each_others_and_what_is_alone_has_none() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [5, 5, 0]], dtype=float)
    triangles = np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4]])
    _, _, polygons = unpacked(mesh_file(vertices, triangles, np.array([1, 2, 1])))
    found = [sorted(row[row > 0].tolist()) for row in polygons["neighbours"]]
    assert found == [[2], [1, 3], [2]]
    with pytest.raises(ValueError, match="0 triangles on 5 vertices"):
        mesh_file(vertices, triangles[:0], np.array([], dtype=int))


def sidewalk_area() -> float:
    odr = parse(CROSSING.read_bytes(), file="Crossing")
    table = RoadTable.of(odr)
    assert crosswalks(odr, table)
    total = 0.0
    for row, kind in enumerate(table.lane_type):
        if kind == "sidewalk":
            s = np.linspace(table.lane_s0[row], table.lane_s1[row], 200)
            width = table.lane_width(np.full(200, row), s)
            total += float(np.trapezoid(width, s))
    return total


def unpacked(data: bytes) -> tuple[dict[str, int], np.ndarray, np.ndarray]:
    """Counts of the tile, its vertices (y up) and polygons, read from the bytes alone."""
    magic, version, tiles = struct.unpack_from("<4sii", data)
    assert (magic, version, tiles) == (b"TESM", 1, 1)
    tile, size = 48, struct.unpack_from("<i", data, 44)[0]
    assert tile + size == len(data)
    numbers = struct.unpack_from("<4s14i", data, tile)
    assert numbers[:2] == (b"VAND", 7)
    count, points, links = numbers[6:9]
    vertices = np.frombuffer(data, "<f4", 3 * points, tile + 100).reshape(-1, 3)
    kind = np.dtype(
        [("link", "<u4"), ("vertices", "<u2", 6), ("neighbours", "<u2", 6), ("flags", "<u2"),
         ("count", "u1"), ("area", "u1")]
    )  # fmt: skip
    polygons = np.frombuffer(data, kind, count, tile + 100 + 12 * points)
    return {"links": links}, vertices, polygons
