"""Kinds of facilities, and their levels of service by the tables of the HCM."""

from __future__ import annotations

from dataclasses import replace

import polars as pl
import pytest

from odscen.figures.by_place.facilities import (
    FacilityData,
    NetFacts,
    highway_density,
    junction_facilities,
    movement_facilities,
    passage_sums,
)
from odscen.figures.by_place.lane_parts import lane_parts
from odscen.figures.by_place.lane_places import LanePlaces
from odscen.figures.by_place.level_of_service import highway_level
from odscen.figures.by_place.traffic import over_run, traffic_figures
from odscen.figures.by_place.traffic_sums import summable

col = pl.col


def density_of(lanes: pl.DataFrame, heavy: pl.DataFrame | None) -> pl.DataFrame:
    return highway_density(lane_parts(summable(lanes), PLACES, None), PLACES, STOP, heavy)


PLACES = LanePlaces.of(
    lanes=[
        ("m_0", 500.0, True, "r1", 1.0, True),
        ("m_1", 500.0, True, "r1", 1.0, True),
        ("s_0", 500.0, True, "r2", 1.0, True),
    ],
    ways=[
        ("m_0", "j9", "m", None, None, None),
        ("s_0", "j9", "s", None, None, None),
        (":9_0", "j9", "m", "m_0", ":9_0", "r1>j9>r3"),
        (":9_1", "j9", "s", "s_0", ":9_1", "r2>j9>r3"),
    ],
    segments=[("r1", 500.0), ("r2", 500.0)],
    junctions=[("j9", "priority", 20.0)],
    movements=[("r1>j9>r3", "j9", "priority", 20.0), ("r2>j9>r3", "j9", "priority", 20.0)],
)
CLOCK = pl.DataFrame({"begin": [0.0], "end": [3600.0]})


def facts(main: tuple[str, bool, bool, bool], side: tuple[str, bool, bool, bool]) -> NetFacts:
    names = ("state", "gives_way", "onto_ring", "from_ring")
    links = [
        {"via": via, **dict(zip(names, row, strict=True))}
        for via, row in ((":9_0", main), (":9_1", side))
    ]
    limits = [("m_0", "m", 30.0), ("m_1", "m", 30.0), ("s_0", "s", 30.0)]
    drivers = pl.DataFrame({"id": ["a", "b"], "heavy": [False, True], "serves": [False, False]})
    return NetFacts(
        pl.DataFrame(limits, schema=("lane", "edge", "limit"), orient="row"),
        pl.DataFrame(links),
        drivers,
    )


STOP = facts(("M", False, False, False), ("s", True, False, False))


@pytest.mark.parametrize(
    ("known", "of_junction", "of_movements"),
    [
        (STOP, "two-way stop", ["major movement", "minor movement"]),
        (
            facts(("w", True, False, False), ("w", True, False, False)),
            "all-way stop",
            ["all-way stop"] * 2,
        ),
        (
            facts(("M", False, True, True), ("m", True, True, False)),
            "roundabout",
            ["major movement", "roundabout"],
        ),
        (
            facts(("M", False, False, False), ("M", False, False, False)),
            "uncontrolled",
            ["major movement"] * 2,
        ),
        (
            facts(("m", False, False, False), ("m", True, False, False)),
            "two-way stop",
            ["major movement", "minor movement"],
        ),
    ],
)
def test_the_network_says_what_kind_of_facility_a_junction_is(
    known: NetFacts, of_junction: str, of_movements: list[str]
) -> None:
    movements = movement_facilities(PLACES, known)
    assert movements["facility"].to_list() == of_movements
    assert junction_facilities(movements)["facility"].to_list() == [of_junction]


def test_at_a_two_way_stop_only_the_minor_movements_are_graded() -> None:
    """90 vehicles go first without delay, 10 wait for 40 s: their level is E, not A."""
    rows = [(f"m{k}", "j9", "r1>j9>r3", "m", float(k), 0.0) for k in range(90)]
    rows += [(f"s{k}", "j9", "r2>j9>r3", "s", float(k), 40.0) for k in range(10)]
    names = ("id", "junction", "movement", "approach", "time", "control_delay")
    passed = pl.DataFrame(rows, schema=names, orient="row")
    movements = movement_facilities(PLACES, STOP)
    by_junction, by_movement = passage_sums(passed, movements, CLOCK)
    assert by_junction.rows() == [("j9", 0.0, 10, 400.0)]
    assert by_movement.rows() == [("r1>j9>r3", 0.0, 90, 0.0), ("r2>j9>r3", 0.0, 10, 400.0)]
    lanes = _lanes(90.0, 10)
    found = traffic_figures(
        lanes,
        PLACES,
        end=3600.0,
        facilities=FacilityData(
            movements,
            by_junction,
            by_movement,
            density_of(lanes, None),
        ),
    )
    row = over_run(found.junctions).row(0, named=True)
    assert (row["facility"], row["passages"], row["control_delay"]) == ("two-way stop", 10, 40.0)
    assert row["level"] == "E"
    assert over_run(found.movements)["level"].to_list() == [None, "E"]


def test_who_is_queued_on_a_minor_approach_counts_and_on_a_major_one_does_not() -> None:
    rows = [("a", "j9", None, "m", 5.0, 90.0), ("b", "j9", None, "s", 5.0, 60.0)]
    names = ("id", "junction", "movement", "approach", "time", "control_delay")
    types = {"movement": pl.String}
    passed = pl.DataFrame(rows, schema=names, orient="row", schema_overrides=types)
    by_junction, by_movement = passage_sums(passed, movement_facilities(PLACES, STOP), CLOCK)
    assert by_junction.rows() == [("j9", 0.0, 1, 60.0)]
    assert by_movement.is_empty()


def _lanes(seconds: float, number: int) -> pl.DataFrame:
    names = ("m_0", "m_1", "s_0", ":9_0", ":9_1")
    return pl.DataFrame(
        [
            {
                "begin": 0.0, "end": 3600.0, "edge": name.split("_")[0], "lane": name,
                "seconds": seconds, "distance": 10.0 * seconds, "entered": number, "left": number,
                "departed": 0, "arrived": 0, "waiting": 0.0, "time_loss": 0.0,
            }
            for name in names
        ]
    )  # fmt: skip


def test_density_of_a_highway_is_passenger_cars_per_km_and_lane() -> None:
    """10 vehicles at any time on 2 lanes of 500 m: 10 per km and lane, 15 cars with half trucks."""
    lanes = _lanes(5 * 3600.0, 900)
    shares = pl.DataFrame(
        {"lane": ["m_0", "m_1"], "begin": [0.0, 0.0], "share": [0.0, 0.0]},
    )
    movements = movement_facilities(PLACES, STOP)
    for heavy, density, level in ((shares, 10.0, "B"), (None, 15.0, "C")):
        data = FacilityData(movements, None, None, density_of(lanes, heavy))
        segments = over_run(traffic_figures(lanes, PLACES, end=3600.0, facilities=data).segments)
        main, side = segments.rows(named=True)
        assert (main["facility"], main["lane_density"]) == ("highway", pytest.approx(density))
        assert main["level"] == level
        assert (side["facility"], side["lane_density"]) == ("street", None), "one lane is none"


def test_levels_of_a_freeway_are_those_of_exhibit_12_15() -> None:
    """At 11, 18, 26, 35 and 45 passenger cars per mile and lane the next level begins."""
    miles = [11.0, 11.1, 18.1, 26.1, 35.1, 45.1]
    found = pl.DataFrame({"density": [one / 1.609344 for one in miles]})
    assert found.select(highway_level(col("density"))).to_series().to_list() == [*"ABCDEF"]


def _level(density: float) -> str:
    """Level of a freeway by passenger cars per mile and lane."""
    found = pl.DataFrame({"density": [density / 1.609344]})
    return str(found.select(highway_level(col("density"))).item())


def test_the_freeway_of_hcms_first_example_has_its_density_and_level() -> None:
    """HCM 2000, chapter 23, example problem 1: 2,000 veh/h, PHF 0.92, 5 % trucks, rolling.

    Flow rate 1,169 pc/h/ln, speed 68 mi/h, density 17 pc/mi/ln, level B. Bounds are the same today.
    """
    heavy = 1.0 / (1.0 + 0.05 * (2.5 - 1.0))
    flow = 2000.0 / (0.92 * 2 * heavy)
    assert flow == pytest.approx(1169.0, abs=1.0)
    assert flow / 68.2 == pytest.approx(17.0, abs=0.5)
    assert _level(flow / 68.2) == "B"


def test_hcms_service_flow_rates_at_their_speeds_are_the_bounds_of_our_levels() -> None:
    """HCM 2000, Exhibit 23-2, 70 mi/h: greatest flow rates (pc/h/ln) of A to E and their speeds."""
    rates = ((770, 70.0), (1260, 70.0), (1735, 66.7), (2115, 60.4), (2400, 53.3))
    for (flow, speed), level, following in zip(rates, "ABCDE", "BCDEF", strict=True):
        assert _level(0.99 * flow / speed) == level
        assert _level(1.01 * flow / speed) == following


def test_what_follows_from_the_map_is_made_once_for_all_runs_on_it() -> None:
    made: list[str] = []

    def make() -> str:
        made.append("made")
        return "what follows"

    of_run = facts(("M", False, False, False), ("s", True, False, False))
    of_another = replace(of_run, drivers=of_run.drivers.head(1))
    assert of_run.once("it", PLACES, make) == of_another.once("it", PLACES, make)
    assert made == ["made"]
    of_run.once("it", LanePlaces.from_json(PLACES.to_json()), make)
    assert made == ["made"] * 2
    assert movement_facilities(PLACES, of_run) is movement_facilities(PLACES, of_another)
