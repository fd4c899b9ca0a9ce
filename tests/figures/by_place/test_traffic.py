"""Figures of traffic from sums that one can reckon by hand."""

from __future__ import annotations

import json

import polars as pl
import pytest

from odscen.figures.by_place.lane_places import LanePlaces
from odscen.figures.by_place.level_of_service import junction_level, street_level
from odscen.figures.by_place.queues import queue_lengths
from odscen.figures.by_place.traffic import TABLES, over_run, traffic_figures
from odscen.figures.by_place.traffic_sums import intervals
from odscen.figures.measures.figure import RunData
from odscen.figures.measures.registry import COLUMN_UNITS
from odscen.figures.measures.traffic_files import figures_json, write_tables

col = pl.col

# Road r1 with a lane of 500 m leads into j2 by two lanes: straight on to r3 and left to r4.
PLACES = LanePlaces.of(
    lanes=[
        ("up", 300.0, True, "r1", 1.0, True),
        ("a", 200.0, True, "r1", 1.0, False),
        ("b", 200.0, True, "r1", 1.0, False),
        (":s", 20.0, True, "j2", 1.0, True),
        (":l", 30.0, True, "j2", 1.0, True),
        ("long", 100.0, True, "r3", 0.25, True),
        ("long", 100.0, True, "r4", 0.75, True),
    ],
    ways=[
        ("up", "j2", "in", None, None, None),
        ("a", "j2", "in", None, None, None),
        ("b", "j2", "in", None, None, None),
        (":s", "j2", "in", "a", ":s", "r1>j2>r3"),
        (":l", "j2", "in", "b", ":l", "r1>j2>r4"),
    ],
    segments=[("r1", 500.0), ("r3", 25.0), ("r4", 75.0)],
    junctions=[("j2", "signal", 25.0)],
    movements=[("r1>j2>r3", "j2", "signal", 20.0), ("r1>j2>r4", "j2", "signal", 30.0)],
)


def lane(
    name: str,
    *,
    begin: float = 0.0,
    seconds: float = 0.0,
    distance: float = 0.0,
    lost: float = 0.0,
    stood: float = 0.0,
    entered: int = 0,
    departed: int = 0,
    arrived: int = 0,
    **grams: float,
) -> dict[str, object]:
    return {
        "begin": begin, "end": begin + 60.0, "edge": "in", "lane": name, "seconds": seconds,
        "distance": distance, "entered": entered, "left": 0, "departed": departed,
        "arrived": arrived, "waiting": stood, "time_loss": lost, **grams,
    }  # fmt: skip


def only(table: pl.DataFrame, **key: object) -> dict[str, object]:
    for name, value in key.items():
        table = table.filter(col(name) == value)
    return table.row(0, named=True)


def test_flow_density_and_speed_are_edies():
    """Two vehicles over all of 500 m at 10 m/s in a minute: 120 vehicles an hour."""
    lanes = pl.DataFrame(
        [
            lane("up", seconds=60.0, distance=600.0, entered=2, lost=12.0),
            lane("a", seconds=40.0, distance=400.0, entered=2, lost=8.0),
        ]
    )
    row = only(traffic_figures(lanes, PLACES, end=60.0).segments, segment="r1")
    assert row["vehicles"] == 2, "those who change to the next edge of a segment count once"
    assert row["flow"] == pytest.approx(120.0)
    assert row["density"] == pytest.approx(100.0 / 60.0 / 0.5)
    assert row["speed"] == pytest.approx(10.0)
    assert row["travel_time"] == pytest.approx(50.0)
    assert row["free_flow_time"] == pytest.approx(40.0), "at the speed that they wished for"
    assert row["level"] is None, "two vehicles are too few for a level"
    assert row["co2"] is None


def test_a_lane_over_two_segments_is_shared_by_length():
    lanes = pl.DataFrame([lane("long", seconds=8.0, distance=100.0, entered=1, co2=40.0)])
    figures = traffic_figures(lanes, PLACES, end=60.0)
    assert only(figures.segments, segment="r3")["co2"] == pytest.approx(10.0)
    assert only(figures.segments, segment="r4")["co2"] == pytest.approx(30.0)
    assert figures.segments["vehicles"].to_list() == [1, 1]
    assert figures.segments["flow"].to_list() == pytest.approx([60.0, 60.0])


def test_delay_of_a_junction_begins_on_the_way_to_it():
    lanes = pl.DataFrame(
        [
            lane("up", seconds=50.0, lost=30.0, stood=20.0, distance=300.0),
            lane("a", seconds=50.0, lost=40.0, stood=30.0, distance=100.0),
            lane(":s", seconds=4.0, lost=2.0, distance=40.0, entered=2),
        ]
    )
    row = only(traffic_figures(lanes, PLACES, end=60.0).junctions, junction="j2")
    assert (row["vehicles"], row["throughput"]) == (2, 2)
    assert row["delay"] == pytest.approx(36.0)
    assert row["waiting"] == pytest.approx(25.0)
    assert row["standing"] == pytest.approx(50.0 / 60.0)
    assert row["level"] is None, "two vehicles are too few for a level"
    assert row["seconds"] == 4.0, "time is spent in the junction, not before it"
    assert row["queue_max"] is None


def test_vehicles_of_a_lane_share_its_delay_and_those_of_a_road_what_is_lost_before():
    lanes = pl.DataFrame(
        [
            lane("up", lost=30.0, distance=300.0),
            lane("a", lost=8.0, distance=100.0),
            lane("b", lost=60.0, distance=100.0),
            lane(":s", entered=2, distance=40.0, seconds=4.0),
            lane(":l", entered=1, distance=30.0, seconds=3.0, lost=1.0),
        ]
    )
    movements = traffic_figures(lanes, PLACES, end=60.0).movements
    straight, left = (only(movements, movement=f"r1>j2>{name}") for name in ("r3", "r4"))
    assert straight["delay"] == pytest.approx(10.0 + 4.0)
    assert left["delay"] == pytest.approx(10.0 + 60.0 + 1.0)
    assert (straight["level"], left["level"]) == (None, None), "too few vehicles for a level"


def test_what_a_red_light_costs_is_told_when_it_turns_green():
    lanes = pl.DataFrame(
        [
            lane("b", lost=50.0, stood=50.0, seconds=50.0),
            lane("b", begin=60.0, lost=20.0, seconds=20.0, distance=50.0),
            lane(":l", begin=60.0, entered=2, seconds=6.0, distance=60.0),
        ]
    )
    movements = traffic_figures(lanes, PLACES, end=120.0).movements
    assert only(movements, movement="r1>j2>r4", begin=0.0)["delay"] is None
    assert only(movements, movement="r1>j2>r4", begin=60.0)["delay"] == pytest.approx(35.0)


def test_a_junction_that_nobody_gets_into_has_level_f():
    lanes = pl.DataFrame([lane("a", lost=60.0, stood=60.0, seconds=60.0)])
    row = only(traffic_figures(lanes, PLACES, end=60.0).junctions, junction="j2")
    assert (row["delay"], row["level"]) == (None, "F")


def test_over_a_run_sums_are_taken_before_quotients():
    lanes = pl.DataFrame(
        [
            lane("up", seconds=10.0, distance=100.0, entered=1, departed=1, lost=1.0, co2=5.0),
            lane("up", begin=60.0, seconds=90.0, distance=300.0, arrived=1, lost=60.0, co2=7.0),
        ]
    )
    figures = traffic_figures(lanes, PLACES, end=240.0)
    assert figures.network["begin"].to_list() == [0.0, 60.0, 120.0, 180.0]
    assert figures.network["vehicles"].to_list() == [1, 1, 0, 0], "who is under way goes on"
    assert figures.network["speed"].to_list() == [10.0, 300.0 / 90.0, None, None]
    whole = over_run(figures.segments).row(0, named=True)
    assert (whole["begin"], whole["end"], whole["vehicles"]) == (0.0, 240.0, 2)
    assert whole["speed"] == pytest.approx(4.0)
    assert whole["co2"] == pytest.approx(12.0)
    network = over_run(figures.network).row(0, named=True)
    assert (network["vehicles"], network["running"]) == (1, pytest.approx(100.0 / 240.0))


def test_a_run_without_traffic_has_a_network_and_no_places():
    nobody = pl.DataFrame([lane("up")]).clear()
    figures = traffic_figures(nobody, PLACES, end=60.0)
    assert figures.network.height == 1
    assert [getattr(figures, name).height for name in TABLES[1:]] == [0, 0, 0, 0]
    data = json.loads(figures_json(RunData(traffic=figures), figures))
    assert data["run"]["vehicle_km"] == data["run"]["throughput"] == 0.0
    assert data["run"]["co2_per_km"] is data["run"]["travel_time_index"] is None


def test_levels_are_those_of_the_highway_capacity_manual():
    delays = pl.DataFrame({"delay": [10.0, 15.1, 35.0, 55.0, 80.0, 80.1, None]})
    for control, levels in (("signal", "ABCDEF"), ("priority", "ACDFFF")):
        found = delays.select(junction_level(col("delay"), pl.lit(control)))
        assert found.to_series().to_list() == [*levels, None]
    shares = pl.DataFrame({"share": [0.81, 0.8, 0.6, 0.45, 0.35, 0.3, None]})
    found = shares.select(street_level(col("share"))).to_series().to_list()
    assert found == [*"ABCDEF", None]


def test_ten_vehicles_have_a_level_and_nine_do_not():
    for number, level in ((9, None), (10, "D")):
        lanes = pl.DataFrame(
            [
                lane("up", seconds=50.0, lost=30.0 * number, stood=20.0, distance=300.0),
                lane(":s", seconds=4.0, lost=6.0 * number, distance=40.0, entered=number),
            ]
        )
        row = only(traffic_figures(lanes, PLACES, end=60.0).junctions, junction="j2")
        assert (row["delay"], row["level"]) == (pytest.approx(36.0), level)
        assert row["graded_by"] == "delay on approaches and inside"


def test_intervals_without_anybody_are_there_too():
    lanes = pl.DataFrame([lane("up", begin=60.0), lane("a", begin=60.0), lane("up", begin=240.0)])
    assert intervals(lanes, 330.0)["begin"].to_list() == [0.0, 60.0, 120.0, 180.0, 240.0, 300.0]
    assert intervals(lanes, 330.0)["end"].to_list()[-1] == 330.0


def test_a_queue_is_who_stands_at_one_time_on_all_ways_to_a_junction():
    rows = [(float(t), "up" if k else "a", 0.0) for t in range(40) for k in range(t // 10)]
    rows += [(39.0, ":s", 0.0), (39.0, "up", 5.0), (39.0, "elsewhere", 0.0)]
    names = ("timestep_time", "vehicle_lane", "vehicle_speed")
    steps = pl.DataFrame(rows, schema=names, orient="row")
    steps = pl.concat([steps, pl.DataFrame([(float(t), "", 1.0) for t in range(40)],
                                           schema=names, orient="row")])  # fmt: skip
    clock = pl.DataFrame({"begin": [0.0, 20.0], "end": [20.0, 40.0]})
    found = queue_lengths(steps.lazy(), PLACES, clock)
    assert found.rows() == [("j2", 0.0, 20.0, 1.0, 1.0, 3.0), ("j2", 20.0, 40.0, 4.0, 3.0, 3.0)]
    later = queue_lengths(steps.lazy(), PLACES, clock, since=20.0)
    assert later["queue_p95_run"].to_list() == [3.0, 3.0]
    assert queue_lengths(steps.lazy().drop("vehicle_lane"), PLACES, clock) is None


def test_files_say_the_same_and_their_units(tmp_path):
    lanes = pl.DataFrame(
        [lane("up", seconds=10.0, distance=100.0, entered=1, departed=1, co2=5.0, nox=0.1)]
    )
    figures = traffic_figures(lanes, PLACES, end=60.0)
    write_tables(figures, tmp_path / "figures")
    for name in TABLES:
        table = pl.read_csv(tmp_path / "figures" / f"{name}.csv")
        assert table.height == getattr(figures, name).height
        words = {"segment", "junction", "movement", "control", "facility", "level", "lane_group"}
        words |= {"graded_by"}
        assert set(table.columns) - words <= set(COLUMN_UNITS)
    data = json.loads(figures_json(RunData(traffic=figures), figures))
    assert data["segments"][0]["co2"] == 5.0
    assert data["run"]["co2_per_km"] == 50.0
    assert data["units"]["run"]["co2_per_km"] == "g/km"
    assert data["units"]["tables"]["co2"] == "g"


def test_places_of_lanes_come_back_from_their_file():
    again = LanePlaces.from_json(PLACES.to_json())
    names = ("lanes", "ways", "segments", "junctions", "movements")
    assert tuple(again.columns) == names
    assert all(getattr(again, name).equals(getattr(PLACES, name)) for name in names)
