from __future__ import annotations

import polars as pl
import pytest

from odscen.figures.by_place.lane_traffic import lane_traffic
from tests.figures.made_traffic import INTERVAL, PLACES, lane_rows

ENDS = {"co2": None, "source": True, "sink": False}


def measured(course):
    """Lane data of a road and the road behind it; ``course`` has vehicles and seconds lost."""
    return pl.DataFrame(
        [
            lane_rows(index, lane, vehicles, length=length, lost=lost, **ENDS)
            for index, (vehicles, lost) in enumerate(course)
            for lane, length in (("a_0", 100.0), ("b_0", 200.0))
            if vehicles
        ]
    )


def test_sums_of_each_lane_are_those_measured_and_empty_intervals_stay_in_time():
    course = ((50, 5.0), (0, 0.0), (20, 30.0))
    found = lane_traffic(measured(course), PLACES, end=3 * INTERVAL)
    assert found.times == [0.0, INTERVAL, 2 * INTERVAL, 3 * INTERVAL]
    assert (found.names, found.lengths) == ([("a_0", "r1"), ("b_0", "r2")], [100.0, 200.0])
    assert found.sums.rows() == [
        (0, 0, 5000.0, 50 * 15.0, 250.0),
        (0, 1, 10000.0, 50 * 25.0, 250.0),
        (2, 0, 2000.0, 20 * 40.0, 600.0),
        (2, 1, 4000.0, 20 * 50.0, 600.0),
    ]


def test_lanes_that_no_map_has_are_left_out():
    lanes = measured(((5, 1.0),)).with_columns(pl.col("lane").replace({"b_0": "walk_0"}))
    assert lane_traffic(lanes, PLACES, end=INTERVAL).names == [("a_0", "r1")]


@pytest.mark.parametrize(("most", "intervals"), [(10, 5), (9, 3), (5, 2), (3, 1), (1, 1)])
def test_of_many_intervals_several_become_one_with_the_same_sums(most, intervals):
    lanes = measured([(10 * (k + 1), 2.0) for k in range(5)])
    found = lane_traffic(lanes, PLACES, end=5 * INTERVAL, most=most)
    assert len(found.times) == intervals + 1
    assert (found.times[0], found.times[-1]) == (0.0, 5 * INTERVAL)
    for column in ("distance", "seconds", "time_loss"):
        assert found.sums[column].sum() == pytest.approx(lanes[column].sum())
    assert found.sums["interval"].max() == intervals - 1
