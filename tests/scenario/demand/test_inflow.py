"""Vehicles that drive in at the boundary of a region."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from odscen.base.categories import Category
from odscen.base.errors import InputError, ScenarioError
from odscen.scenario import edits
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.demand.demand_tables import InputRow, read_counts, read_inputs, read_matrix
from odscen.scenario.demand.inflow import LEAST_HEADWAY, entries, input_trips
from odscen.scenario.demand.trips import Trips
from odscen.scenario.demand.zones import TripEnds
from odscen.scenario.document.json_form import dumps, loads
from odscen.scenario.document.scenario_document import Scenario, VehicleInput
from odscen.scenario.placing.region import Region, Usable
from tests.graphs import ToyLane, fork, key, map_graph

FORK = fork()
WHOLE = ("r1", "j9", "r2", "r3")


def widening() -> Any:
    """Two lanes for 200 m; after 100 m a third begins on the right."""
    lanes = []
    for section, ids in ((0, (-1, -2)), (1, (-1, -2, -3))):
        for lane in ids:
            follows = (key("1", lane, 1),) if section == 0 else ()
            lanes.append(
                ToyLane(
                    key("1", lane, section),
                    100.0 * section,
                    3.5 * lane,
                    0.0,
                    100.0,
                    f"r1-{section}",
                    next=follows,
                    left=key("1", lane + 1, section) if lane < -1 else None,
                    right=key("1", lane - 1, section) if lane - 1 in ids else None,
                )
            )
    return map_graph(lanes, adjacency=[("r1-0", "r1-1")])


WIDE = widening()


def closed_town() -> Any:
    """Two roads, each of which leads through a junction into the other."""
    places = (("1", "r1"), ("8", "j8"), ("2", "r2"), ("9", "j9"))
    lanes = [
        ToyLane(
            key(road, -1),
            0.0 if number % 2 else 120.0 * number,
            60.0 * number,
            0.0,
            100.0,
            segment,
            next=(key(places[(number + 1) % 4][0], -1),),
            junction=segment[1:] if segment.startswith("j") else None,
        )
        for number, (road, segment) in enumerate(places)
    ]
    pairs = [
        (one[1], other[1]) for one, other in zip(places, (*places[1:], places[0]), strict=True)
    ]
    return map_graph(lanes, adjacency=pairs)


def with_input(graph: Any = FORK, roi: tuple[str, ...] = WHOLE, **fields: Any) -> Scenario:
    scenario = edits.new_scenario(graph, name="test", roi=roi, seed=fields.pop("seed", 3))
    scenario = edits.set_simulation(scenario, duration=fields.pop("duration", 3600))
    return edits.set_input(scenario, graph, inflow="west", **fields)


def trips(scenario: Scenario, graph: Any = FORK) -> list[Trips]:
    ground = TripEnds(Region.of(graph, scenario.roi), Usable())
    return list(input_trips(scenario, ground, scenario.demand.inputs[0]))


def wide(**fields: Any) -> list[Trips]:
    return trips(with_input(WIDE, ("r1-0", "r1-1"), segment="r1-0", **fields), WIDE)


def test_vehicles_enter_where_lanes_begin_at_the_boundary_and_nowhere_else() -> None:
    def found(*roi: str) -> list[tuple[str, str, list[int]]]:
        every = entries(Region.of(FORK, roi))
        return [(one.segment, one.direction, [lane.lane for lane in one.lanes]) for one in every]

    assert found(*WHOLE) == [("r1", "forward", [-1]), ("r1", "backward", [1])]
    assert found("r2") == [("r2", "forward", [-1])]
    assert found("j9") == []


def test_a_lane_that_begins_where_the_road_widens_is_no_entry() -> None:
    (one,) = entries(Region.of(WIDE, ("r1-0", "r1-1")))
    assert (one.segment, [lane.lane for lane in one.lanes]) == ("r1-0", [-2, -1])
    (cut,) = entries(Region.of(WIDE, ("r1-1",)))
    assert [lane.lane for lane in cut.lanes] == [-3, -2, -1]


def test_as_many_come_as_were_counted_in_each_slice() -> None:
    made = wide(volumes=(10, 0, 25, 7), interval=300, duration=900, arrivals="even")
    assert [len(one.departs) for one in made] == [10, 0, 25]
    for number, one in enumerate(made):
        assert np.all((one.departs >= 300 * number) & (one.departs < 300 * (number + 1)))
        assert one.entering


def test_vehicles_share_the_lanes_and_keep_a_headway() -> None:
    for one in wide(per_hour=3600.0, mix={"car": 1}):
        lanes, numbers = np.unique(one.starts, return_counts=True)
        assert len(lanes) == 2
        assert abs(numbers[0] - numbers[1]) <= 1
        for lane in lanes:
            gaps = np.diff(np.sort(one.departs[one.starts == lane]))
            assert gaps.min() >= LEAST_HEADWAY - 0.011
            assert gaps.std() > 0.5


@pytest.mark.slow
def test_arrivals_of_many_seeds_scatter_as_poisson_does() -> None:
    """Variance over mean of the vehicles of a quarter of an hour is 1, from seed to seed."""

    def numbers(**fields: Any) -> np.ndarray[Any, Any]:
        return np.array(
            [
                [len(one.departs) for one in wide(per_hour=600.0, seed=seed, **fields)]
                for seed in range(200)
            ],
            dtype=float,
        )

    random = numbers()
    assert random.shape == (200, 4)
    assert random.mean() == pytest.approx(150.0, rel=0.02)
    # Of 800 draws the ratio has a standard deviation of 0.05.
    assert random.var(axis=0, ddof=1).mean() / random.mean() == pytest.approx(1.0, abs=0.15)
    # Quarters do not make up for one another: the hour scatters as well.
    assert random.sum(axis=1).var(ddof=1) / 600.0 == pytest.approx(1.0, abs=0.3)
    assert set(numbers(arrivals="even").ravel()) == {150.0}


def test_within_a_quarter_as_many_seconds_have_no_vehicle_as_poisson_says() -> None:
    gaps = np.concatenate(
        [
            np.diff(np.sort(one.departs))
            for seed in range(30)
            for one in wide(per_hour=400.0, seed=seed)
        ]
    )
    # Exponential gaps of two lanes together: standard deviation and mean are alike.
    assert gaps.std() / gaps.mean() == pytest.approx(1.0, abs=0.06)


def test_the_second_quarter_of_an_hour_has_what_the_peak_hour_factor_says() -> None:
    made = wide(per_hour=1000.0, peak_hour_factor=0.8, arrivals="even", duration=7200)
    numbers = [len(one.departs) for one in made]
    assert sum(numbers) == pytest.approx(2000, abs=8)
    assert numbers[1] == pytest.approx(1000 / (4 * 0.8), abs=1)
    assert numbers[5] == pytest.approx(numbers[1], abs=1)
    assert 1000 / (4 * max(numbers[:4])) == pytest.approx(0.8, abs=0.01)
    with pytest.raises(ValueError, match="leave peak_hour_factor out"):
        VehicleInput(id="a", segment="r1", volumes=(1, 2), peak_hour_factor=0.9)


def test_documents_that_say_nothing_of_arrivals_have_even_ones_and_keep_their_bytes() -> None:
    new = with_input(segment="r1", direction="forward", per_hour=100.0)
    assert new.demand.inputs[0].arrivals == "random"
    old = edits.set_input(new, FORK, inflow="west", arrivals="even")
    assert "arrivals" not in dumps(old)
    assert loads(dumps(old)).demand.inputs[0].arrivals == "even"
    changed = edits.set_input(old, FORK, inflow="west", per_hour=200.0)
    assert changed.demand.inputs[0].arrivals == "even"


def test_in_a_closed_town_vehicles_can_begin_behind_every_junction() -> None:
    ring = closed_town()
    every = entries(Region.of(ring, ring.segments.ids))
    assert [(one.segment, [lane.lane for lane in one.lanes]) for one in every] == [
        ("r1", [-1]),
        ("r2", [-1]),
    ]
    made = trips(with_input(ring, ("r1", "j8", "r2", "j9"), segment="r2", per_hour=300.0), ring)
    assert sum(len(one.departs) for one in made) > 200
    assert sum(one.unmet for one in made) == 0


def test_trucks_come_on_the_outer_lane_and_cars_fill_the_others() -> None:
    (one, *_) = wide(per_hour=2000.0, mix={"car": 3, "truck": 1})
    trucks = np.array([category is Category.TRUCK for category in one.categories])
    outer = WIDE.lanes.lane[one.starts] == WIDE.lanes.lanes.keys.index(key("1", -2))
    assert 80 < trucks.sum() < 170
    assert outer[trucks].all()
    assert abs(int(outer.sum()) - int((~outer).sum())) <= 1


def test_only_the_lanes_named_are_used() -> None:
    (one, *_) = wide(per_hour=600.0, lanes=(-1,))
    assert {WIDE.lanes.lanes.keys[WIDE.lanes.lane[start]].lane for start in one.starts} == {-1}


def test_destinations_are_met_in_the_shares_given() -> None:
    scenario = with_input(
        segment="r1", direction="forward", per_hour=4000.0, to=(("r2", 3), ("r3", 1))
    )
    goals = np.concatenate([one.goals for one in trips(scenario)])
    segments = np.array(FORK.segments.ids)[FORK.lanes.segment[goals]]
    assert set(segments) == {"r2", "r3"}
    assert np.mean(segments == "r2") == pytest.approx(0.75, abs=0.02)


@pytest.mark.parametrize("arrivals", ["even", "random"])
def test_a_shorter_run_has_the_same_vehicles_up_to_its_end(arrivals: str) -> None:
    fields = {"segment": "r1", "direction": "forward", "per_hour": 900.0, "arrivals": arrivals}
    whole, cut = trips(with_input(**fields)), trips(with_input(duration=1000, **fields))
    departs = np.concatenate([one.departs for one in whole])
    assert np.concatenate([one.departs for one in cut]).tolist() == departs[departs < 1000].tolist()
    assert len(departs) == 900 if arrivals == "even" else abs(len(departs) - 900) < 120


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"segment": "r1"}, "both ways; give its direction"),
        ({"segment": "r9"}, r"no segment 'r9'; vehicles can enter on r1 \(forward\)"),
        ({"segment": "r2"}, "no lane leads into the region of interest on 'r2'"),
        ({"segment": "r1", "direction": "forward", "lanes": (-1, -4)}, r"lanes\[1\]: lane -4"),
        ({"segment": "r1", "direction": "forward", "to": (("r7", 1),)}, "'r7' is neither a zone"),
        ({"segment": "r1", "direction": "backward", "to": (("r2", 1),)}, "no way leads from 'r1'"),
        ({"segment": "r1", "direction": "forward", "mix": {"pedestrian": 1}}, "has pedestrians"),
    ],
)
def test_an_input_that_cannot_be_right_is_refused(fields: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        with_input(per_hour=100.0, **fields)


def test_an_input_has_one_volume_and_an_edit_takes_the_other_out() -> None:
    with pytest.raises(ValueError, match="one of per_hour and volumes, not none"):
        VehicleInput(id="a", segment="r1")
    with pytest.raises(ValueError, match="leave profile 'weekday' out"):
        VehicleInput(id="a", segment="r1", volumes=(1, 2), profile="weekday")
    one = with_input(segment="r1", direction="forward", per_hour=100.0)
    two = edits.set_input(one, FORK, inflow="west", volumes=(3, 4))
    assert (two.demand.inputs[0].per_hour, two.demand.inputs[0].volumes) == (None, (3, 4))
    assert loads(dumps(two)) == two
    assert [p.code for p in check(two, FORK)] == ["volumes_too_short"]
    assert edits.remove_demand(two, FORK, part="west").demand.inputs == ()


def test_wide_and_square_tables_are_read_as_people_have_them() -> None:
    wide_table = "segment;direction;7:00;7:15;7:30\nr1;Forward;110;125;9.5\n"
    assert read_inputs(wide_table, clock=7 * 3600.0) == (
        InputRow("r1", "forward", 0.0, 900.0, (110.0, 125.0, 9.5), 2),
    )
    counts = read_counts("place\t0\t300\nr1>j9\t4\t6\n")
    assert counts.values == (("r1>j9", 0.0, 300.0, 4.0), ("r1>j9", 300.0, 600.0, 6.0))
    square = read_matrix(",r1,Centre\nr1,,12\nCentre,30,0\n")
    assert square[None].values == (("r1", "Centre", 12.0), ("Centre", "r1", 30.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("segment,7:00,7:15,7:45\nr1,1,2,3\n", "line 1: the slice that begins at 7:45"),
        ("segment,7:00,7:15\nr1,1,x\n", "line 2: 7:15 must be a number"),
        ("road,7:00,7:15\nr1,1,2\n", "line 1: the columns needed are segment"),
    ],
)
def test_a_wide_table_that_cannot_be_used_is_refused_with_its_place(
    text: str, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read_inputs(text)
