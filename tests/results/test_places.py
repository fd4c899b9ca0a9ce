import numpy as np
import polars as pl
import pytest

from odscen.results.places import PlaceIndex, figures_by_place

# A road of two segments that leads into a junction; a bridge of another lane crosses above it.
INDEX = PlaceIndex(
    xy=np.array([(0.0, 0.0), (50.0, 0.0), (100.0, 0.0), (50.0, 0.1)]),
    lane=np.array([0, 0, 1, 2]),
    lanes=("road_0", ":j_0", "bridge_0"),
    segment=np.array([0, 1, 2, 3]),
    segments=("r1-0", "r1-1", "j1", "r9"),
    junction=(False, False, True, False),
)


def trajectories(*rows):
    names = ("timestep_time", "vehicle_id", "vehicle_x", "vehicle_y", "vehicle_speed")
    return pl.DataFrame(rows, schema=(*names, "vehicle_lane"), orient="row")


def test_waiting_before_a_junction_is_the_junctions():
    rows = trajectories(
        (0.0, "a", 0.0, 0.0, 10.0, "road_0"),
        (0.5, "a", 49.0, 0.0, 0.0, "road_0"),
        (1.0, "a", 49.0, 0.0, 0.0, "road_0"),
        (1.5, "a", 99.0, 0.0, 8.0, ":j_0"),
        (1.5, "b", 100.0, 0.0, 6.0, ":j_0"),
        (1.5, "walker", 100.0, 0.0, 1.0, ""),
    )
    found = figures_by_place(rows, {"a": "car", "b": "car"}, INDEX)
    assert found["junction", "j1"] == {"vehicles": 2.0, "waiting_time": pytest.approx(0.5)}
    assert found["segment", "r1-0"]["mean_speed"] == pytest.approx(10.0)
    assert found["segment", "r1-1"] == {"vehicles": 1.0, "mean_speed": 0.0, "v85": 0.0}
    assert found["segment", "j1"]["mean_speed"] == pytest.approx(7.0)
    assert ("segment", "r9") not in found


def test_a_bridge_is_not_taken_for_the_road_below():
    rows = trajectories((0.0, "a", 50.0, 0.0, 10.0, "bridge_0"))
    assert set(figures_by_place(rows, {"a": "car"}, INDEX)) == {("segment", "r9")}


def test_a_lane_without_nodes_is_where_the_nearest_node_is():
    rows = trajectories((0.0, "a", 99.0, 1.0, 10.0, ":short_0"))
    assert ("segment", "j1") in figures_by_place(rows, {"a": "car"}, INDEX)


def test_a_run_without_vehicles_has_no_places():
    assert figures_by_place(pl.DataFrame({"person_id": ["a"]}), {}, INDEX) == {}
