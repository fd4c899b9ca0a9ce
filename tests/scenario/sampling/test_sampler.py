import hashlib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.base.errors import ScenarioError
from odscen.lanegraph.build_graphs import build_map_graph
from odscen.lanegraph.graphs import MapGraph
from odscen.lanegraph.query import is_connected, node_index
from odscen.opendrive.parse import parse
from odscen.scenario.checks.scenario_checks import check
from odscen.scenario.document.distributions import Choice, Constant, Normal, Uniform, stream
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.sampling_config import (
    MapFilter,
    SamplingConfig,
    loads_config,
    overridden,
)
from odscen.scenario.placing.region import Region, Usable
from odscen.scenario.placing.sampled_places import vehicle_supply
from odscen.scenario.sampling.sampler import (
    choose_map,
    numbers_to_place,
    sample_roi,
    sample_scenario,
)
from tests.graphs import fork, line_of_segments, ring, two_lane_road

GRAPHS = {"fork": fork(), "road": two_lane_road(300.0), "ring": ring(), "line": line_of_segments()}
CARS = "[vehicles]\ncar = 1.0\n"


def config(text: str) -> SamplingConfig:
    return loads_config(text)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(sorted(GRAPHS)),
    st.integers(0, 2**31 - 1),
    st.floats(0, 1),
    st.integers(1, 6),
)
def test_whatever_is_sampled_passes_every_check_and_is_sampled_again(
    name: str, seed: int, fill: float, segments: int
) -> None:
    graph = GRAPHS[name]
    settings_ = config(f"fill = {fill}\nego = true\n[roi]\nsegments = {segments}")
    scenario = sample_scenario(graph, settings_, seed=seed, name="s")
    assert [p for p in check(scenario, graph) if p.code != "no_actors"] == []
    assert all(actor.goal for actor in scenario.actors)
    assert is_connected(graph.segments, scenario.roi)
    assert dumps(sample_scenario(graph, settings_, seed=seed, name="s")) == dumps(scenario)


@pytest.mark.parametrize("fill", [0.0, 0.25, 0.5, 0.9, 1.0])
def test_the_fill_share_counts_by_what_fits(fill: float) -> None:
    graph = GRAPHS["road"]
    settings_ = config(f"fill = {fill}\npedestrian_share = 0\n{CARS}[places]\nminimum_trip = 0")
    region = Region.of(graph, ["r1"])
    fits = len(vehicle_supply(region, settings_.places, settings_.vehicles, Usable()).fit)
    assert fits == 2 * 37
    scenario = sample_scenario(graph, settings_, seed=4, name="s")
    assert len(scenario.actors) == int(fill * fits + 0.5)


def test_pedestrians_get_their_share_of_all_actors() -> None:
    assert numbers_to_place(1.0, 90, 50, pedestrian_share=0.1) == (90, 10)
    assert numbers_to_place(1.0, 90, 5, pedestrian_share=0.1) == (90, 5)
    assert numbers_to_place(0.5, 90, 50, pedestrian_share=0.1) == (45, 5)
    assert numbers_to_place(0.5, 90, 50, pedestrian_share=0.1, most=10) == (9, 1)
    assert numbers_to_place(0.001, 90, 50, pedestrian_share=0.1) == (1, 0)
    assert numbers_to_place(0.0, 90, 50, pedestrian_share=0.1) == (0, 0)


def test_different_seeds_give_different_scenarios() -> None:
    texts = {
        dumps(sample_scenario(GRAPHS["fork"], SamplingConfig(), seed=seed, name="s"))
        for seed in range(10)
    }
    assert len(texts) == 10


def test_sampled_vehicles_keep_off_junction_lanes_and_tight_curves() -> None:
    settings_ = config("fill = 1\n[roi]\nsegments = 9")
    scenario = sample_scenario(GRAPHS["fork"], settings_, seed=1, name="s")
    roads = {a.spawn.split(".")[0] for a in scenario.actors if a.category != "pedestrian"}
    assert roads == {"1", "2", "3"}


def test_bicycles_keep_off_fast_lanes() -> None:
    slow = config("fill = 1\n[vehicles]\nbicycle = 1.0\n[places.speed_limit_max]\nbicycle = 10.0")
    with pytest.raises(ScenarioError, match="no actor fits"):
        sample_scenario(GRAPHS["road"], slow, seed=1, name="s")


def test_bodies_stay_inside_their_lanes_whatever_offset_is_asked_for() -> None:
    settings_ = config("fill = 0.5\n[behaviour]\nlateral_offset = 3.0")
    scenario = sample_scenario(GRAPHS["road"], settings_, seed=1, name="s")
    assert [p for p in check(scenario, GRAPHS["road"]) if p.code != "bodies_overlap"] == []
    assert max(a.lateral_offset for a in scenario.actors if a.category == "car") == 0.8


def test_speeds_follow_the_limit() -> None:
    text = f"fill = 0.5\npedestrian_share = 0\n{CARS}[behaviour]\nspeed_factor = 0.5"
    scenario = sample_scenario(GRAPHS["road"], config(text), seed=1, name="s")
    assert {actor.speed for actor in scenario.actors} == {round(0.5 * 13.89, 2)}


@pytest.mark.parametrize("depart", ["1e18", "1e10"])
def test_a_value_that_nothing_can_have_is_refused_on_reading_with_its_field(depart: str) -> None:
    with pytest.raises(ScenarioError, match=r"depart\.constant\.value: .*equal to 10{9}"):
        config(f'[behaviour]\ndepart = {{kind = "constant", value = {depart}}}')


def test_nodes_that_the_simulator_cannot_use_are_left_alone() -> None:
    graph = GRAPHS["fork"]
    spawnable = np.ones(len(graph.lanes.x), dtype=bool)
    spawnable[graph.lanes.lane == 0] = False  # road 1, lane -1
    drivable = np.ones(len(graph.lanes.x), dtype=bool)
    drivable[node_index(graph, "3.0.-1.10")] = False
    usable = Usable(spawnable=spawnable, drivable=drivable)
    text = f"fill = 0.7\npedestrian_share = 0\n{CARS}[roi]\nsegments = 9"
    scenario = sample_scenario(graph, config(text), seed=1, name="s", usable=usable)
    ends = {(a.spawn.rsplit(".", 1)[0], a.goal) for a in scenario.actors}
    assert ends == {
        ("1.0.1", "1.0.1.49"),
        ("2.0.-1", "2.0.-1.29"),
        ("3.0.-1", "3.0.-1.29"),
    }
    behind = [a for a in scenario.actors if a.spawn.startswith("3.")]
    assert all(int(a.spawn.rsplit(".", 1)[1]) > 10 for a in behind)


@given(st.integers(1, 8), st.integers(0, 1000))
def test_a_sampled_region_is_connected_and_of_the_size_asked_for(size: int, seed: int) -> None:
    graph = GRAPHS["line"]
    region = sample_roi(graph, size, np.random.default_rng(seed))
    assert len(region) == len(set(region)) == min(size, 5)
    assert is_connected(graph.segments, region)


def test_excluded_segments_stay_outside() -> None:
    for seed in range(5):
        region = sample_roi(GRAPHS["line"], 9, np.random.default_rng(seed), exclude=["r3"])
        assert set(region) in ({"r1", "r2"}, {"r4", "r5"})


STATISTICS = {
    "small": {
        "bounds": [0, 0, 1, 1],
        "junctions": 1.0,
        "road_length": 500.0,
        "speed_limit_max": None,
    },
    "town": {"junctions": 30.0, "road_length": 9500.0, "speed_limit_max": 14.0},
    "motorway": {"junctions": 0.0, "road_length": 4000.0, "speed_limit_max": 36.0},
}


def test_maps_are_filtered_and_weighted_by_statistics() -> None:
    big = MapFilter.model_validate(
        {"where": {"junctions": {"min": 1}, "road_length": {"max": 9e3}}}
    )
    assert {choose_map(big, STATISTICS, seed=s) for s in range(20)} == {"small"}
    limited = MapFilter.model_validate({"where": {"speed_limit_max": {}}})
    assert {choose_map(limited, STATISTICS, seed=s) for s in range(40)} == {"town", "motorway"}
    named = MapFilter(names=("*o*",), exclude=("town",))
    assert {choose_map(named, STATISTICS, seed=s) for s in range(20)} == {"motorway"}
    weighted = MapFilter(weight_by="road_length")
    drawn = Counter(choose_map(weighted, STATISTICS, seed=s) for s in range(400))
    assert drawn["town"] / 400 == pytest.approx(9500 / 14000, abs=0.07)


def test_a_filter_that_nothing_passes_says_so() -> None:
    with pytest.raises(ScenarioError, match="none of the 3 maps"):
        choose_map(MapFilter(names=("x",)), STATISTICS, seed=0)
    with pytest.raises(ScenarioError, match="no statistic 'junction'; there are junctions"):
        choose_map(MapFilter(weight_by="junction"), STATISTICS, seed=0)


def test_every_problem_of_a_configuration_is_named() -> None:
    with pytest.raises(ScenarioError) as caught:
        loads_config(
            'fill = 2\nwings = 1\n[vehicles]\nship = 1\n[behaviour]\ndepart = "x"', file="c"
        )
    places = [problem.split(":")[0] for problem in caught.value.problems]
    assert places == ["fill", "vehicles.ship.[key]", "behaviour.depart", "wings"]
    with pytest.raises(ScenarioError, match="cannot be read"):
        loads_config("= 3")
    with pytest.raises(ScenarioError, match="pedestrian_share"):
        loads_config('{"vehicles": {"pedestrian": 1}}')
    with pytest.raises(ScenarioError, match="low 3 is above high 1"):
        loads_config('fill = {kind = "uniform", low = 3, high = 1}')


def test_fill_and_region_size_can_be_fixed_from_outside() -> None:
    fixed = overridden(SamplingConfig(), fill=0.5, roi_segments=3)
    assert (fixed.fill, fixed.roi.segments) == (Constant(value=0.5), Constant(value=3))
    assert overridden(SamplingConfig()) == SamplingConfig()
    with pytest.raises(ScenarioError, match="between 0 and 1"):
        overridden(SamplingConfig(), fill=1.5)
    with pytest.raises(ScenarioError, match="at least 1"):
        overridden(SamplingConfig(), roi_segments=0)


@pytest.mark.parametrize(
    ("of", "low", "high", "mean"),
    [
        (Constant(value=2), 2, 2, 2),
        (Uniform(low=1, high=3), 1, 3, 2),
        (Normal(mean=2, std=1, low=0, high=4), 0, 4, 2),
        (Normal(mean=9, std=0.1, low=0, high=4), 4, 4, 4),
        (Choice(values=(1, 2, 5), weights=(1, 0, 1)), 1, 5, 3),
    ],
)
def test_distributions_keep_their_bounds_and_mean(
    of: Constant | Uniform | Normal | Choice, low: float, high: float, mean: float
) -> None:
    rng = stream(0, "test")
    values = [of.draw(rng) for _ in range(2000)]
    assert low <= min(values)
    assert max(values) <= high
    assert np.mean(values) == pytest.approx(mean, abs=0.2)


def real_graph(path: Path) -> MapGraph:
    content = path.read_bytes()
    digest = hashlib.sha256(content).hexdigest()
    return build_map_graph(parse(content, file=path.name), name=path.stem, sha256=digest)


@pytest.mark.parametrize("name", ["carla-2019/Town01", "esmini/fabriksgatan"])
def test_scenarios_on_real_maps_pass_every_check(shared_maps: Path, name: str) -> None:
    graph = real_graph(shared_maps / f"{name}.xodr")
    for seed in range(4):
        scenario = sample_scenario(graph, SamplingConfig(), seed=seed, name="s")
        assert scenario.actors
        assert check(scenario, graph) == ()
