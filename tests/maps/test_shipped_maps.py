from pathlib import Path

import numpy as np
import pytest

from odscen.opendrive.parse import parse

MAPS = sorted((Path(__file__).parents[2] / "maps").glob("*.xodr"))
NAMES = [path.stem for path in MAPS]


def test_all_the_maps_are_there():
    assert NAMES == [
        "left_hand_crossing",
        "motorway_weave",
        "roundabout",
        "rural_hills",
        "signal_crossing",
        "t_junction_signs",
        "town_5x5",
    ]


@pytest.mark.parametrize("path", MAPS, ids=NAMES)
def test_the_script_writes_the_same_bytes_again(path):
    pytest.importorskip("scenariogeneration", reason="needs the maintainers' tools")
    from tools.make_maps.__main__ import map_text

    assert map_text(path.stem) == path.read_text(encoding="utf-8")


@pytest.mark.parametrize("path", MAPS, ids=NAMES)
def test_our_own_reader_has_nothing_to_remark(path):
    assert parse(path.read_bytes(), file=path.name).notes == ()


@pytest.fixture(scope="module")
def carla():
    return pytest.importorskip("carla", reason="needs the carla package")


@pytest.mark.parametrize("path", MAPS, ids=NAMES)
def test_carla_opens_the_map_and_lanes_end_only_at_its_borders(path, carla, capfd):
    world = carla.Map(path.stem, path.read_text(encoding="utf-8"))
    waypoints = world.generate_waypoints(2.0)
    dead = {(w.road_id, w.lane_id) for w in waypoints if not w.next(2.0)}
    borders = {
        int(road.id)
        for road in parse(path.read_bytes()).roads.values()
        if road.predecessor is None or road.successor is None
    }
    assert len(waypoints) > 400
    assert {road for road, _ in dead} <= borders
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("path", MAPS, ids=NAMES)
def test_lanes_meet_within_two_centimetres_and_one_degree(path, carla):
    world = carla.Map(path.stem, path.read_text(encoding="utf-8"))
    pairs = [
        (world.get_waypoint_xodr(w.road_id, w.lane_id, w.s), n)
        for w in world.generate_waypoints(2.0)
        for n in w.next(0.02)
        if n.road_id != w.road_id
    ]
    for here, there in pairs:
        a, b = here.transform, there.transform
        assert a.location.distance(b.location) < 0.05
        turn = np.radians(a.rotation.yaw - b.rotation.yaw)
        assert abs(np.degrees(np.arctan2(np.sin(turn), np.cos(turn)))) < 1.0


def test_crosswalks_cross_the_carriageway_in_carla_too(carla):
    path = MAPS[NAMES.index("signal_crossing")]
    points = carla.Map("x", path.read_text(encoding="utf-8")).get_crosswalks()
    assert len(points) == 4 * 5
    west_east = np.array([(p.x, -p.y) for p in points[:5]])
    # Three driving lanes and two bicycle lanes, 13.25 m, and 0.3 m beyond on each side.
    assert np.ptp(west_east[:, 1]) == pytest.approx(3 * 3.25 + 2 * 1.75 + 0.6, abs=0.01)
    assert np.ptp(west_east[:, 0]) == pytest.approx(3.0, abs=0.01)
    assert west_east[:, 0].min() == pytest.approx(22.0 + 1.0, abs=0.01)


def test_the_left_hand_map_keeps_left():
    assert parse(MAPS[0].read_bytes()).rule == "LHT"
