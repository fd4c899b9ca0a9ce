"""Control delay of trajectories whose every second is written by hand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl
import pytest

from odscen.figures.by_place.control_delay import lost_time, passages, vehicle_passages
from odscen.figures.by_place.facilities import NetFacts
from odscen.figures.by_place.lane_places import LanePlaces

if TYPE_CHECKING:
    from collections.abc import Sequence

PLACES = LanePlaces.of(
    lanes=[],
    ways=[
        ("a", "j1", "in", None, None, None),
        (":j", "j1", "in", "a", ":j", "r1>j1>r2"),
        ("b", "j2", "mid", None, None, None),
        (":k", "j2", "mid", "b", ":k", "r2>j2>r3"),
    ],
    segments=[],
    junctions=[("j1", "signal", 20.0), ("j2", "priority", 20.0)],
    movements=[("r1>j1>r2", "j1", "signal", 20.0), ("r2>j2>r3", "j2", "priority", 20.0)],
)
LIMITS = pl.DataFrame({"lane": ["a", ":j", "b", ":k", "c"], "limit": [10.0, 5.0, 10.0, 10.0, 10.0]})
DRIVERS = pl.DataFrame({"id": ["v"], "factor": [1.0], "max_speed": [50.0]})


def stretches(course: Sequence[tuple[str, Sequence[float]]]) -> pl.DataFrame:
    """Time lost by a vehicle whose speeds (m/s, one a second) are given lane by lane."""
    rows = [("v", lane, speed) for lane, speeds in course for speed in speeds]
    table = pl.DataFrame(
        [(float(time), *row) for time, row in enumerate(rows)],
        schema=("timestep_time", "vehicle_id", "vehicle_lane", "vehicle_speed"),
        orient="row",
    )
    found = lost_time(table.lazy(), PLACES, LIMITS, DRIVERS, period=1.0)
    assert found is not None
    return found


def delays(course: Sequence[tuple[str, Sequence[float]]]) -> dict[str, float]:
    end = float(sum(len(speeds) for _, speeds in course) - 1)
    found = passages(stretches(course), end=end, period=1.0)
    return dict(found.select("junction", "control_delay").rows())


CRUISE = [10.0] * 20


def test_slowing_down_the_queue_and_getting_up_to_speed_are_of_the_junction() -> None:
    course = [
        ("a", [*CRUISE, 8.0, 4.0, 0.0, 0.0, 0.0, 2.0]),  # 0.2 + 0.6 + 3 + 0.8
        (":j", [4.0, 5.0, 5.0]),  # 0.2 against the 5 m/s of the curve
        ("b", [6.0, 8.0, *CRUISE]),  # 0.4 + 0.2
    ]
    assert delays(course) == {"j1": pytest.approx(5.4)}


def test_acceleration_is_of_the_junction_behind_and_not_of_the_next() -> None:
    course = [
        ("a", CRUISE),
        (":j", [5.0]),
        ("b", [5.0, 7.0, *CRUISE, 5.0]),
        (":k", [10.0]),
        ("c", CRUISE),
    ]
    assert delays(course) == {"j1": pytest.approx(0.8), "j2": pytest.approx(0.5)}


def test_getting_up_to_speed_after_the_departure_is_of_no_junction() -> None:
    course = [("a", [0.0, 3.0, 6.0, *CRUISE]), (":j", [5.0]), ("b", CRUISE)]
    assert delays(course) == {"j1": pytest.approx(0.0)}


def test_a_slow_leader_on_the_way_costs_no_control_delay_and_a_crawling_queue_does() -> None:
    slow = [("a", [*CRUISE, *[9.2] * 30]), (":j", [5.0]), ("b", CRUISE)]
    assert delays(slow) == {"j1": pytest.approx(0.0)}
    assert stretches(slow)["on_the_way"].sum() == pytest.approx(30 * 0.08)
    queue = [("a", [0.0, *[3.0] * 50]), (":j", [5.0]), ("b", CRUISE)]
    assert delays(queue) == {"j1": pytest.approx(50 * 0.7)}


def test_who_is_queued_at_the_end_counts_with_what_it_has_lost() -> None:
    found = passages(stretches([("a", [*CRUISE, *[0.0] * 30])]), end=49.0, period=1.0)
    row = found.row(0, named=True)
    assert (row["junction"], row["movement"]) == ("j1", None)
    assert row["control_delay"] == pytest.approx(30.0)


@pytest.mark.parametrize(("serves", "number"), [(False, 1), (True, 0)])
def test_a_bus_that_serves_stops_has_no_control_delay(serves: bool, number: int) -> None:
    rows = [(float(t), "v", lane, 5.0) for t, lane in enumerate(["a", "a", ":j", "c", "c"])]
    names = ("timestep_time", "vehicle_id", "vehicle_lane", "vehicle_speed")
    table = pl.DataFrame(rows, schema=names, orient="row")
    drivers = DRIVERS.with_columns(heavy=pl.lit(value=False), serves=pl.lit(serves))
    found = vehicle_passages(table.lazy(), PLACES, NetFacts(LIMITS, pl.DataFrame(), drivers))
    assert found is not None
    assert found["junction"].to_list() == ["j1"] * number


def test_all_that_is_lost_is_on_one_stretch() -> None:
    course = [("a", [*CRUISE, 2.0, 0.0]), (":j", [1.0, 4.0]), ("b", [7.0, *CRUISE, 0.0])]
    whole = stretches(course).select("behind", "on_the_way", "before", "inside").sum()
    assert sum(whole.row(0)) == pytest.approx(0.8 + 1.0 + 0.8 + 0.2 + 0.3 + 1.0)
