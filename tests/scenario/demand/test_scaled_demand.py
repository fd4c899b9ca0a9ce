import pytest

from odscen.scenario import edits
from odscen.scenario.demand.day_profiles import DAY, Curve, known_profiles
from odscen.scenario.demand.scaled_demand import (
    BEFORE,
    CALM,
    HOUR,
    busiest_hour,
    excerpt,
    part_trips,
    scaled,
    trips_of,
)
from odscen.scenario.document.scenario_document import Background, Scenario
from tests.graphs import fork

GRAPH = fork()


def day(*, profile: str | None = "weekday", clock: float = 0.0, trips: float = 1000.0) -> Scenario:
    one = edits.new_scenario(GRAPH, name="test", roi=("r1", "j9", "r2", "r3"))
    one = edits.set_simulation(one, duration=DAY)
    one = edits.set_clock(one, clock=clock)
    return edits.set_matrix(
        one, GRAPH, matrix="m", trips=[("r1", "r2", trips)], profile=profile, begin=0.0, end=DAY
    )


def test_the_busiest_hour_of_a_weekday_is_in_the_afternoon_whenever_the_run_begins() -> None:
    begin, end = busiest_hour(day())
    assert (begin, end - begin) == (17 * HOUR, HOUR)
    assert busiest_hour(day(clock=6 * HOUR))[0] == 11 * HOUR


def test_the_excerpt_of_a_day_has_the_trips_of_its_busiest_hour_and_the_half_hour_before() -> None:
    cut = excerpt(day())
    curve = Curve(known_profiles(day().demand)["weekday"])
    passed = curve.amount(18 * HOUR) - curve.amount(16.5 * HOUR)
    assert trips_of(cut.demand) == pytest.approx(1000.0 * passed / DAY, rel=1e-4)
    assert cut.demand.clock == 16.5 * HOUR
    (matrix,) = cut.demand.matrices
    assert (matrix.begin, matrix.end) == (0.0, BEFORE + HOUR)
    assert cut.simulation.duration == BEFORE + HOUR + CALM


def test_matrices_that_are_over_before_the_busiest_hour_are_left_out_of_it() -> None:
    early = edits.set_matrix(
        day(), GRAPH, matrix="night", trips=[("r1", "r3", 5)], begin=0.0, end=HOUR
    )
    assert [one.id for one in excerpt(early).demand.matrices] == ["m"]


def test_a_short_run_and_one_with_traffic_at_times_of_its_own_are_tried_whole() -> None:
    short = edits.set_simulation(day(), duration=2 * HOUR)
    assert excerpt(short) is short
    fed = edits.set_input(
        day(), GRAPH, inflow="in", segment="r1", direction="forward", per_hour=100
    )
    assert excerpt(fed) is fed


def test_demand_is_scaled_by_part_and_the_inputs_stay() -> None:
    one = edits.set_background(day(), GRAPH, background="some", per_km=4)
    one = edits.set_background(one, GRAPH, background="more", trips=200)
    one = edits.set_input(one, GRAPH, inflow="in", segment="r1", direction="forward", per_hour=100)
    half = scaled(one.demand, 0.5)
    assert half.matrices[0].trips == (("r1", "r2", 500.0),)
    assert [(part.per_km, part.trips) for part in half.background] == [(2.0, None), (None, 100.0)]
    assert half.inputs == one.demand.inputs
    assert trips_of(half) == 600.0
    named = scaled(one.demand, 0.5, only="more")
    assert named.matrices == one.demand.matrices
    assert [(part.per_km, part.trips) for part in named.background] == [(4.0, None), (None, 100.0)]


def test_background_gets_the_trips_of_a_rate_in_its_busiest_hour() -> None:
    part = Background(id="all", trips=1.0, profile="weekday")
    found = part_trips(day(), part, per_hour=860.0)
    assert found == pytest.approx(860.0 / 0.086, rel=0.01)  # the profile's largest share
    short = edits.set_simulation(day(), duration=600.0)
    assert part_trips(short, Background(id="all", trips=1.0), per_hour=600.0) == pytest.approx(100)
