import numpy as np
import polars as pl
import pytest

from odscen.records.traces import (
    bin_width,
    counts_over_time,
    speed_by_place,
    speed_over_time,
    thinned_paths,
    tidy,
    travel,
)


def recorded(prefix="vehicle_"):
    """Car a drives 10 m/s along x for 10 s with a bend at its middle; b stands."""
    time = np.arange(11.0)
    a = pl.DataFrame(
        {
            "timestep_time": time,
            f"{prefix}id": ["a"] * 11,
            f"{prefix}x": 100.0 + np.minimum(time, 5.0) * 10.0,
            f"{prefix}y": 200.0 + np.maximum(time - 5.0, 0.0) * 10.0,
            f"{prefix}speed": [10.0] * 11,
        }
    )
    b = a.with_columns(
        pl.lit("b").alias(f"{prefix}id"),
        pl.lit(150.0).alias(f"{prefix}x"),
        pl.lit(250.0).alias(f"{prefix}y"),
        pl.lit(0.0).alias(f"{prefix}speed"),
    )
    return pl.concat([a, b]).sort("timestep_time")


@pytest.mark.parametrize("prefix", ["vehicle_", "person_"])
def test_columns_named_after_vehicles_or_persons_are_read_alike(prefix):
    traces = tidy(recorded(prefix), {"a": "car"}, net_offset=(100.0, 200.0))
    assert traces.columns == ["time", "id", "x", "y", "speed", "category", "piece"]
    assert traces["category"].unique().sort().to_list() == ["car", "other"]
    assert traces.row(0) == (0.0, "a", 0.0, 0.0, 10.0, "car", 0)


def test_rows_without_anybody_and_files_without_columns_are_left_out():
    nobody = pl.DataFrame({"timestep_time": [1.0], "vehicle_id": [None], "vehicle_x": [None]})
    assert tidy(nobody, {}).is_empty()
    rows = pl.concat([recorded(), recorded().with_columns(pl.lit(None).alias("vehicle_id"))])
    assert len(tidy(rows, {})) == 22


def test_only_the_points_that_matter_are_kept_and_who_stands_has_no_way():
    paths = thinned_paths(tidy(recorded(), {"a": "car"}))
    assert paths.ids == ("a",)
    assert paths.xy.tolist() == [[100.0, 200.0], [150.0, 200.0], [150.0, 250.0]]
    assert paths.start.tolist() == [0, 3]
    assert thinned_paths(tidy(recorded(), {}).clear()).ids == ()


def test_a_teleport_splits_the_way_and_is_not_travelled():
    gap = recorded().filter(~pl.col("timestep_time").is_between(3.0, 7.0))
    traces = tidy(gap, {"a": "car"})
    paths = thinned_paths(traces)
    assert paths.ids == ("a", "a")
    assert paths.last == (False, True)
    assert paths.xy.tolist() == [[100.0, 200.0], [120.0, 200.0], [150.0, 230.0], [150.0, 250.0]]
    assert travel(traces).distance["a"] == 40.0


def test_a_jump_within_one_step_is_a_teleport_too():
    jumped = recorded().with_columns(
        pl.when(pl.col("timestep_time") >= 6.0)
        .then(pl.col("vehicle_y") + 90.0)
        .otherwise(pl.col("vehicle_y"))
        .alias("vehicle_y")
    )
    assert thinned_paths(tidy(jumped, {"a": "car"})).ids == ("a", "a")


def test_travel_is_metres_driven_and_mean_speed():
    moved = travel(tidy(recorded(), {}))
    assert moved.distance == pytest.approx({"a": 100.0, "b": 0.0})
    assert moved.speed == pytest.approx({"a": 10.0, "b": 0.0})


def test_speed_over_time_has_mean_and_percentiles_and_gaps():
    curve = speed_over_time(tidy(recorded(), {}), end=20.0, width=5.0)
    assert curve.time.tolist() == [2.5, 7.5, 12.5, 17.5]
    assert curve.mean[:2].tolist() == [5.0, 5.0]
    assert (curve.low[0], curve.high[0]) == (0.0, 10.0)
    assert np.isnan(curve.mean[3])


def test_counts_tell_running_arrived_and_waiting():
    counts = counts_over_time(
        np.array([0.0, 0.0, 3.0]),
        np.array([0.0, 2.0, np.nan]),
        np.array([4.0, np.nan, np.nan]),
        end=5.0,
        width=1.0,
    )
    assert counts.running.tolist() == [1, 1, 2, 2, 1, 1]
    assert counts.arrived.tolist() == [0, 0, 0, 0, 1, 1]
    assert counts.waiting.tolist() == [1, 1, 0, 1, 1, 1]


def test_speed_by_place_averages_in_cells():
    cells = speed_by_place(tidy(recorded(), {}), size=100.0)
    assert cells.corner.tolist() == [[100.0, 200.0]]
    assert cells.speed.tolist() == [5.0]


def test_bins_are_round_numbers_of_seconds():
    assert [bin_width(end) for end in (60.0, 600.0, 3600.0, 86400.0, 3_600_000.0)] == [
        1.0,
        5.0,
        30.0,
        600.0,
        25200.0,
    ]
