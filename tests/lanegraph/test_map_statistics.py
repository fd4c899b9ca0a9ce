import json

import pytest

from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.map_statistics import map_semantics, map_statistics
from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.parse import parse
from tests.drawing import maps


def model(text):
    odr = parse(text, file="test.xodr")
    return odr, RoadTable.of(odr)


def test_figures_of_a_street():
    statistics = map_statistics(*model(maps.STREET))
    assert statistics.bounds == pytest.approx((0.0, -3.5, 100.0, 3.5))
    assert statistics.road_length == pytest.approx(100.0)
    assert statistics.connecting_road_length == 0.0
    assert statistics.driving_lane_length == pytest.approx(200.0)
    assert (statistics.roads, statistics.junctions) == (1, 0)
    assert (statistics.crosswalks, statistics.traffic_lights) == (1, 1)
    assert (statistics.stop_signs, statistics.yield_signs) == (1, 1)
    assert statistics.speed_limit_min == pytest.approx(50 / 3.6)
    assert statistics.speed_limit_max == pytest.approx(50 / 3.6)
    assert statistics.rule == "RHT"


def test_lane_length_is_that_of_the_centre_line_on_curves_and_slopes():
    arc = maps.document(maps.road(shape='<arc curvature="0.02"/>'))
    assert map_statistics(*model(arc)).driving_lane_length == pytest.approx(103.5, abs=0.01)
    slope = '<elevation s="0" a="0" b="0.75" c="0" d="0"/>'
    hill = maps.document(maps.road(elevation=slope))
    assert map_statistics(*model(hill)).driving_lane_length == pytest.approx(125.0, abs=0.01)


def test_the_length_of_a_given_graph_is_the_same():
    odr, table = model(maps.STREET)
    graph = build_map_graph(odr, name="x", sha256="0" * 64, table=table)
    given = map_statistics(odr, table, graph).driving_lane_length
    assert given == pytest.approx(map_statistics(odr, table).driving_lane_length, rel=1e-4)


def test_a_limit_of_the_lane_beats_that_of_the_road():
    fast = maps.lane(-1, more='<speed sOffset="0" max="30"/>') + maps.lane(-2)
    statistics = map_statistics(*model(maps.document(maps.road(right=fast))))
    assert statistics.speed_limit_min == pytest.approx(50 / 3.6)
    assert statistics.speed_limit_max == pytest.approx(30.0)


def test_a_map_without_limits_or_drivable_lanes_has_none():
    text = maps.document(maps.road(right=maps.lane(-1, "sidewalk")))
    statistics = map_statistics(*model(text))
    assert statistics.speed_limit_min is None
    assert statistics.driving_lane_length == 0.0


def test_left_hand_traffic_is_reported():
    assert map_statistics(*model(maps.document(maps.road(rule="LHT")))).rule == "LHT"


def test_statistics_become_json():
    values = map_statistics(*model(maps.STREET)).to_dict()
    again = json.loads(json.dumps(values, allow_nan=False))
    assert again["bounds"] == [0.0, -3.5, 100.0, 3.5]
    assert again["speed_limit_max"] == 13.889


def test_semantics_say_what_is_where():
    semantics = json.loads(json.dumps(map_semantics(*model(maps.STREET)), allow_nan=False))
    assert [walk["id"] for walk in semantics["crosswalks"]] == ["1:7"]
    assert sorted((s["kind"], s["id"]) for s in semantics["signals"]) == [
        ("speed_limit", "4"),
        ("stop", "2"),
        ("traffic_light", "1"),
        ("yield", "3"),
    ]
    limit = next(s for s in semantics["signals"] if s["kind"] == "speed_limit")
    assert limit["value"] == pytest.approx(30 / 3.6)
    assert (limit["x"], limit["y"], limit["z"]) == (40.0, -5.0, 2.0)


@pytest.mark.slow
def test_real_town_figures(shared_maps):
    text = (shared_maps / "carla-2020" / "Town04.xodr").read_bytes()
    statistics = map_statistics(*model(text))
    assert (statistics.junctions, statistics.crosswalks) == (27, 27)
    assert statistics.traffic_lights == 43
