"""Passages of count stations, seen in trajectories."""

from __future__ import annotations

import polars as pl

from odscen.scenario.demand.count_stations import Observation
from odscen.sumo.realize.passages import seen_passages
from odscen.sumo.realize.sumo_lane_places import lane_places
from tests.sumo.runner.test_on_maps import built

MOTORWAY = "motorway_weave"


def lane_of(segment: str) -> str:
    lanes = lane_places(built(MOTORWAY).sumo).lanes
    return str(lanes.filter(pl.col("segment") == segment)["lane"][0])


def passed(
    records: list[tuple[float, str]], places: list[str], *, until: float = 0.0
) -> dict[str, int]:
    """Counts of one vehicle that was recorded on these segments; another is ``until`` then."""
    other = [(until, "r2-2")]
    frame = pl.LazyFrame(
        {
            "timestep_time": [time for time, _ in [*records, *other]],
            "vehicle_id": ["a"] * len(records) + ["b"],
            "vehicle_lane": [lane_of(segment) for _, segment in [*records, *other]],
        }
    )
    seen = [Observation("survey", place, 0.0, 900.0, 0.0) for place in places]
    found, vehicles = seen_passages(frame, built(MOTORWAY).sumo, seen)
    assert vehicles == 2
    return {place: found[place, 0.0, 900.0] for place in places}


def test_segments_between_two_records_are_filled_in_however_many_lie_there() -> None:
    places = ["r1-0>r1-1", "r1-1>r1-2", "r1-2>j10001", "r1-2>j10001>r2-0"]
    all_seen = [(1.0, "r1-0"), (2.0, "r1-1"), (3.0, "r1-2"), (4.0, "j10001"), (5.0, "r2-0")]
    assert passed(all_seen, places) == dict.fromkeys(places, 1)
    assert passed([all_seen[0], all_seen[3], all_seen[4]], places) == dict.fromkeys(places, 1)
    assert passed([all_seen[0], all_seen[4]], places) == dict.fromkeys(places, 1)


def test_nothing_is_filled_in_against_the_direction_of_traffic() -> None:
    places = ["r1-0>r1-1", "r1-1>r1-2"]
    assert passed([(1.0, "r1-2"), (2.0, "r1-0")], places) == dict.fromkeys(places, 0)


def test_who_arrives_at_the_end_of_a_segment_has_not_passed_into_the_junction() -> None:
    places = ["r1-1>r1-2", "r1-2>j10001"]
    records = [(1.0, "r1-1"), (2.0, "r1-2"), (3.0, "j10001")]
    assert passed(records, places, until=9.0) == {"r1-1>r1-2": 1, "r1-2>j10001": 0}
    assert passed(records, places) == dict.fromkeys(places, 1)  # the run ended just then
