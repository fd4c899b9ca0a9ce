"""The shipped maps in the programs that they are for."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
import sumo

from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import crosswalks
from odscen.opendrive.parse import parse

ROOT = Path(__file__).parents[2]
MAPS = sorted((ROOT / "maps").glob("*.xodr"))
every_map = pytest.mark.parametrize("path", MAPS, ids=[path.stem for path in MAPS])


@pytest.fixture(scope="module")
def carla():
    return pytest.importorskip("carla", reason="needs the carla package")


@every_map
def test_carla_opens_the_map_without_complaint(path, carla, capfd):
    world = carla.Map(path.stem, path.read_text(encoding="utf-8"))
    assert len(world.generate_waypoints(2.0)) > 400
    captured = capfd.readouterr()
    assert (captured.out, captured.err) == ("", "")


@every_map
def test_ways_in_carla_end_only_at_the_borders_of_the_map(path, carla):
    world = carla.Map(path.stem, path.read_text(encoding="utf-8"))
    odr = parse(path.read_bytes())
    for waypoint in world.generate_waypoints(2.0):
        if waypoint.next(2.0):
            continue
        road = odr.roads[str(waypoint.road_id)]
        forward = (waypoint.lane_id < 0) == (road.rule == "RHT")
        assert (road.successor if forward else road.predecessor) is None
        assert (road.length - waypoint.s if forward else waypoint.s) < 2.1


@pytest.mark.slow
def test_ways_in_carla_do_not_end_in_the_large_town(carla):
    pytest.importorskip("scenariogeneration", reason="needs the maintainers' tools")
    from tools.make_maps.__main__ import map_text

    world = carla.Map("large_town", map_text("large_town"))
    waypoints = world.generate_waypoints(5.0)
    assert len(waypoints) > 10_000
    assert all(waypoint.next(5.0) for waypoint in waypoints)


@every_map
def test_the_topology_in_carla_has_no_gaps(path, carla):
    """Every lane that a link of the topology leads to starts where the link before it ended."""
    world = carla.Map(path.stem, path.read_text(encoding="utf-8"))
    pairs = world.get_topology()
    roads = {waypoint.road_id for pair in pairs for waypoint in pair}
    assert roads == {int(road) for road in parse(path.read_bytes()).roads} - _without_cars(path)
    for waypoint in world.generate_waypoints(2.0):
        for following in waypoint.next(0.02):
            if following.road_id != waypoint.road_id:
                here, there = waypoint.transform, following.transform
                assert here.location.distance(there.location) < 0.04
                turn = here.rotation.yaw - there.rotation.yaw
                assert abs((turn + 180.0) % 360.0 - 180.0) < 1.0


def _without_cars(path):
    return {
        int(road.id)
        for road in parse(path.read_bytes()).roads.values()
        if not any(lane.type == "driving" for s in road.sections for lane in s.lanes.values())
    }


@every_map
def test_crosswalks_in_carla_are_where_ours_are(path, carla):
    points = carla.Map(path.stem, path.read_text(encoding="utf-8")).get_crosswalks()
    odr = parse(path.read_bytes())
    ours = crosswalks(odr, RoadTable.of(odr))
    theirs = np.array([(p.x, -p.y) for p in points]).reshape(-1, 5, 2)
    assert len(theirs) == len(ours)
    for walk, polygon in zip(
        sorted(ours, key=lambda w: tuple(np.round(w.polygon.mean(axis=0), 1))),
        sorted(theirs, key=lambda p: tuple(np.round(p[:4].mean(axis=0), 1))),
        strict=True,
    ):
        gaps = np.linalg.norm(walk.polygon[:, None] - polygon[None, :4], axis=2)
        assert gaps.min(axis=1).max() < 0.02


@every_map
def test_netconvert_makes_one_network_of_it(path, tmp_path):
    sumolib = pytest.importorskip("sumolib", reason="needs sumolib")
    target = tmp_path / "net.net.xml"
    odr = parse(path.read_bytes())
    done = subprocess.run(
        [
            str(Path(sumo.SUMO_HOME) / "bin" / "netconvert"),
            *("--opendrive-files", str(path), "-o", str(target), "--no-turnarounds"),
            *(["--lefthand"] if odr.rule == "LHT" else []),
        ],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "Error" not in done.stderr
    net = sumolib.net.readNet(str(target))
    graph = nx.Graph()
    graph.add_nodes_from(edge.getID() for edge in net.getEdges())
    for edge in net.getEdges():
        graph.add_edges_from((edge.getID(), other.getID()) for other in edge.getOutgoing())
    assert nx.number_connected_components(graph) == 1
    lights = sum(1 for junction in odr.junctions.values() if junction.controllers)
    # netconvert moves lights amid a road to the junctions at its two ends.
    amid = 2 if path.stem == "bus_street" else 0
    assert len(net.getTrafficLights()) == lights + amid


@pytest.mark.slow
@every_map
def test_asam_checks_find_nothing(path):
    candidates = (
        ROOT / "build" / "qc" / "bin" / "python",
        Path(shutil.which("qc_opendrive") or sys.executable).parent / "python",
    )
    python = next((c for c in candidates if c.with_name("qc_opendrive").exists()), None)
    if python is None:
        pytest.skip("asam-qc-opendrive is not here; `make check-maps` installs it")
    command = [str(python), str(ROOT / "tools" / "check_maps.py"), str(path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout
    completed = re.search(r"(\d+) checks completed, 0 issues", done.stdout)
    assert completed is not None
    assert int(completed[1]) >= 20
