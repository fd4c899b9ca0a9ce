"""Demand on shipped maps: who sets out, whence and whither, and what becomes of counts."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from odscen.base.categories import Category
from odscen.base.errors import ToolError
from odscen.records.run_plan import PlannedActor
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.demand.count_stations import Observation, transitions
from odscen.scenario.demand.zones import TripEnds
from odscen.scenario.document.scenario_document import Scenario
from odscen.scenario.edits.demand_edits import set_background, set_counts, set_input, set_matrix
from odscen.scenario.placing.region import Region, place_of
from odscen.sumo.calibrate.count_fit import planned_fit, run_fit
from odscen.sumo.calibrate.town_day import approach_capacities, peak_share, town_day
from odscen.sumo.realize.passages import planned_passages
from odscen.sumo.realize.realization import all_road_users, realize
from odscen.sumo.realize.sumo_tools import run_tool
from odscen.sumo.realize.usable import usable_places
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.runner.test_on_maps import built, net_file, sampled

CROSSING = "signal_crossing"
TOWN = "town_5x5"


def empty(name: str, *, duration: float = 3600.0, seed: int = 1) -> Scenario:
    graph = built(name).sumo.graph
    scenario = edits.new_scenario(graph, name="demand", roi=graph.segments.ids, seed=seed)
    return edits.set_simulation(scenario, duration=duration)


def arms(name: str) -> list[str]:
    segments = built(name).sumo.graph.segments
    return [str(n) for n, k in zip(segments.ids, segments.kinds, strict=True) if k == "road"]


def planned(scenario: Scenario, name: str = CROSSING, **options: Any) -> tuple[PlannedActor, ...]:
    return realize(scenario, built(name).sumo, settings=RunSettings(**options)).plan.actors


def segment(name: str, node: str | None) -> str:
    graph = built(name).sumo.graph
    place = place_of(graph, node or "")
    assert place is not None
    rows = graph.walks.segment if place.walk else graph.lanes.segment
    return str(graph.segments.ids[rows[place.node]])


def with_matrix(*trips: tuple[str, str, float], **fields: Any) -> Scenario:
    graph = built(CROSSING).sumo.graph
    fields = {"arrivals": "even", **fields}
    return set_matrix(empty(CROSSING), graph, matrix="od", trips=trips, **fields)


def test_a_matrix_puts_as_many_on_the_road_as_it_says_between_its_segments() -> None:
    one, other, third = arms(CROSSING)[:3]
    actors = planned(with_matrix((one, other, 40), (third, one, 15)))
    pairs = Counter((segment(CROSSING, a.spawn), segment(CROSSING, a.goal)) for a in actors)
    assert pairs == {(one, other): 40, (third, one): 15}
    assert all(a.problem is None for a in actors)
    assert len({a.spawn for a in actors}) > 10
    assert 0 < min(a.depart for a in actors) < max(a.depart for a in actors) < 3600


def test_members_of_a_matrix_do_not_depend_on_each_other_nor_on_other_rows() -> None:
    one, other, third = arms(CROSSING)[:3]
    few = {a.id: a for a in planned(with_matrix((one, other, 10)))}
    many = {a.id: a for a in planned(with_matrix((third, one, 5), (one, other, 25)))}
    assert len(many) == 30
    assert all(many[name] == actor for name, actor in few.items())


def test_a_shorter_run_has_the_same_trips_up_to_its_end() -> None:
    one, other = arms(CROSSING)[:2]
    scenario = with_matrix((one, other, 30), profile="weekday")
    whole, cut = planned(scenario), planned(scenario, until=1000.0)
    assert cut == tuple(actor for actor in whole if actor.depart < 1000)
    assert 0 < len(cut) < len(whole)


def test_people_walk_between_the_segments_of_a_matrix() -> None:
    one, other = arms(CROSSING)[:2]
    actors = planned(with_matrix((one, other, 12), mix={"pedestrian": 1}))
    assert {a.category for a in actors} == {"pedestrian"}
    assert {segment(CROSSING, a.goal) for a in actors} == {other}
    assert all(a.problem is None for a in actors)


@pytest.mark.slow
def test_trips_without_a_way_are_told_and_not_made() -> None:
    scenario = empty("motorway_weave")
    graph = built("motorway_weave").sumo.graph
    onwards = transitions(graph)
    last = next(n for n in arms("motorway_weave") if not onwards.get(n))
    first = next(n for n in arms("motorway_weave") if n != last)
    trips = [(last, first, 7)]
    scenario = set_matrix(scenario, graph, matrix="back", trips=trips, arrivals="even")
    done = realize(scenario, built("motorway_weave").sumo)
    assert done.plan.actors == ()
    assert any("7 trips left out" in note for note in done.notes)


def test_placed_actors_keep_their_place_and_time_among_demand() -> None:
    scenario = sampled(CROSSING)
    graph = built(CROSSING).sumo.graph
    inside = [n for n in arms(CROSSING) if n in scenario.roi]
    alone = {a.id: a for a in planned(scenario)}
    scenario = set_matrix(scenario, graph, matrix="od", trips=[(inside[0], inside[1], 30)])
    scenario = set_background(scenario, graph, background="around", per_km=10)
    together = {a.id: a for a in planned(scenario)}
    assert len(together) > len(alone) + 30
    assert all(together[name] == actor for name, actor in alone.items())
    starts = {a.spawn for a in alone.values()}
    assert not any(a.spawn in starts for name, a in together.items() if name not in alone)


@pytest.mark.slow
def test_background_traffic_is_there_from_the_start_and_keeps_coming(tmp_path: Path) -> None:
    graph = built(TOWN).sumo.graph
    scenario = set_background(empty(TOWN, duration=600), graph, background="around", fill=0.05)
    scenario = edits.set_simulation(scenario, duration=600, step_length=1.0)
    prepared = prepare(scenario, built(TOWN).sumo, net_file(TOWN, tmp_path))
    first = [a for a in prepared.plan.actors if a.depart == 0]
    run_prepared(prepared, tmp_path / "run")
    frame = pl.read_parquet(tmp_path / "run" / "trajectories.parquet")
    on_road = frame.group_by("timestep_time").len().sort("timestep_time")
    assert len(first) > 20
    assert on_road["len"][0] == len(first)
    later = on_road.filter(pl.col("timestep_time") > 300)["len"].to_numpy()
    assert 0.5 * len(first) < np.mean(later) < 2.0 * len(first)


@pytest.mark.slow
@pytest.mark.parametrize("step_length", [0.5, 1.0])
def test_each_lane_of_a_motorway_takes_what_hcm_gives_it(
    step_length: float, tmp_path: Path
) -> None:
    name = "motorway_weave"
    graph = built(name).sumo.graph
    scenario = set_input(
        empty(name), graph, inflow="west", segment="r1-0", per_hour=6900, to=(("r5-2", 1),)
    )
    scenario = edits.set_simulation(scenario, duration=900, step_length=step_length)
    prepared = prepare(scenario, built(name).sumo, net_file(name, tmp_path))
    run_prepared(prepared, tmp_path / "run")
    trips = pl.read_parquet(tmp_path / "run" / "trips.parquet")
    starts = {a.id: a.spawn.rsplit(".", 1)[0] for a in prepared.plan.actors}
    inside = trips.filter(pl.col("depart").is_not_null())
    per_lane = Counter(starts[one] for one in inside["id"])
    assert len(per_lane) == 3
    assert min(per_lane.values()) * 4 > 2100


def surveyed(name: str, *, trips: float) -> tuple[Scenario, list[tuple[str, float, float, float]]]:
    """Known demand of an hour, and its counts of all streams and turns in quarters of it."""
    graph = built(name).sumo.graph
    known = set_background(empty(name), graph, background="known", trips=trips, end=3300.0)
    region = Region.of(graph, known.roi)
    users, _ = all_road_users(known, built(name).sumo, region, until=3600)
    places = [
        ">".join(names)
        for one, others in sorted(transitions(graph).items())
        for two in sorted(others)
        for names in ((one, two), *((one, two, n) for n in sorted(transitions(graph)[two])))
        if len(names) == 2 or two.startswith("j")
    ]
    slices = [(900.0 * k, 900.0 * (k + 1)) for k in range(4)]
    seen = [Observation("known", place, *when, 0.0) for place in places for when in slices]
    ground = TripEnds(region, usable_places(built(name).sumo))
    passages = planned_passages(users, region, ground.router, seen)
    rows = [(place, *when, float(passages[place, *when])) for place in places for when in slices]
    return known, [row for row in rows if row[3] > 0]


@pytest.mark.slow
def test_traffic_made_from_the_counts_of_a_known_demand_reproduces_them() -> None:
    graph = built(CROSSING).sumo.graph
    _, rows = surveyed(CROSSING, trips=1200)
    scenario = set_counts(empty(CROSSING, seed=5), graph, counts="survey", rows=rows)
    found = planned_fit(scenario, built(CROSSING).sumo)
    assert len(found.rows) > 50
    assert found.share_met is not None
    assert found.share_met >= 0.85
    assert found.contradictions == ()
    assert all(row.why for row in found.rows if not row.met)
    assert found.vehicles > 300
    assert planned(scenario, CROSSING) == planned(scenario, CROSSING)


@pytest.mark.slow
def test_counts_leave_room_for_the_traffic_that_is_there_already() -> None:
    graph = built(CROSSING).sumo.graph
    known, rows = surveyed(CROSSING, trips=600)
    scenario = set_counts(known, graph, counts="survey", rows=rows)
    ids = [actor.id for actor in planned(scenario, CROSSING)]
    assert sum(name.startswith("survey.") for name in ids) < 0.1 * len(ids)


@pytest.mark.slow
def test_counts_that_contradict_each_other_are_named_as_the_reason() -> None:
    graph = built(CROSSING).sumo.graph
    _, rows = surveyed(CROSSING, trips=1200)
    wrong = max(
        (row for row in rows if row[0].count(">") == 1 and ">j" in row[0]), key=lambda r: r[3]
    )
    spoiled = [(p, b, e, n * 3 if p == wrong[0] else n) for p, b, e, n in rows]
    scenario = set_counts(empty(CROSSING), graph, counts="survey", rows=spoiled)
    found = planned_fit(scenario, built(CROSSING).sumo)
    unmet = [row for row in found.rows if not row.met and row.place == wrong[0]]
    assert unmet
    assert all(f"were counted at {wrong[0]}" in row.why for row in unmet)
    assert any(f"at {wrong[0]}" in message for message in found.contradictions)


def test_a_place_that_no_way_passes_is_the_reason_for_its_count() -> None:
    graph = built(CROSSING).sumo.graph
    junction = next(str(n) for n in graph.segments.ids if n.startswith("j"))
    arm = arms(CROSSING)[0]
    rows = [(f"{arm}>{junction}>{arm}", 0.0, 3600.0, 200.0)]
    scenario = set_counts(empty(CROSSING), graph, counts="survey", rows=rows)
    (row,) = planned_fit(scenario, built(CROSSING).sumo).rows
    assert (row.modelled, row.met) == (0, False)
    assert row.why == "no route inside the region passes here"


@pytest.mark.slow
def test_a_run_is_counted_as_it_was_planned_where_traffic_is_light(tmp_path: Path) -> None:
    graph = built(CROSSING).sumo.graph
    known, rows = surveyed(CROSSING, trips=150)
    whole = Counter[str]()
    for place, _, _, number in rows:
        whole[place] += int(number)
    hour = [(place, 0.0, 3600.0, float(number)) for place, number in whole.items()]
    scenario = edits.set_simulation(known, duration=3600, step_length=0.5)
    prepared = prepare(scenario, built(CROSSING).sumo, net_file(CROSSING, tmp_path))
    run_prepared(prepared, tmp_path / "run")
    counted = set_counts(scenario, graph, counts="survey", rows=hour)
    trajectories = pl.scan_parquet(tmp_path / "run" / "trajectories.parquet")
    found = run_fit(counted, built(CROSSING).sumo, trajectories)
    assert abs(found.vehicles - len(prepared.plan.actors)) <= 2  # may still wait at the end
    assert sum(abs(row.modelled - row.counted) for row in found.rows) <= 0.05 * sum(whole.values())


@pytest.mark.slow
def test_a_day_of_traffic_keeps_every_way_into_a_junction_below_what_it_carries() -> None:
    sumo_map = built(TOWN).sumo
    trips, load = town_day(empty(TOWN, duration=86_400), sumo_map, trips=20_000, day="weekday")
    assert sum(number for _, _, number in trips) == pytest.approx(load.trips, rel=0.01)
    assert load.volume <= 0.71 * load.capacity
    assert load.capacity == approach_capacities(sumo_map)[load.place]
    assert load.peak_trips == pytest.approx(load.trips * peak_share("weekday"))
    assert 0.08 < peak_share("weekday") < 0.09


@pytest.mark.slow
def test_more_trips_than_a_town_carries_are_made_fewer() -> None:
    _, load = town_day(empty(TOWN, duration=86_400), built(TOWN).sumo, trips=400_000, day="weekday")
    assert load.trips < 400_000
    assert load.volume <= 0.71 * load.capacity


def test_a_tool_that_fails_says_why(tmp_path: Path) -> None:
    with pytest.raises(ToolError, match="route-files"):
        run_tool("routeSampler.py", [], folder=tmp_path)


def test_every_category_of_a_mix_takes_part() -> None:
    one, other = arms(CROSSING)[:2]
    actors = planned(with_matrix((one, other, 200), mix=dict.fromkeys(Category, 1)))
    assert {a.category for a in actors} == set(Category)
