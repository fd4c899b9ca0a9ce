"""Trips that begin and end in parking places, as SUMO runs them; also in slices."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import polars as pl
import pytest

from odscen.base.frames import body_centre
from odscen.figures.measures.summary import actors_from_json
from odscen.records.run_plan import Plan
from odscen.runs.layout import PARKING_FILE
from odscen.runs.measured import read_parking
from odscen.runs.recorded import read_stays, read_trips
from odscen.runs.run_settings import RunSettings
from odscen.sumo.realize.realization import realize
from odscen.sumo.runner.long_runs import resume
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tests.parking_case import PLACES, parking_scenario, parking_town
from tests.sumo.conftest import start_killed_workers
from tests.sumo.runner.test_long_runs import results

if TYPE_CHECKING:
    from pathlib import Path

    from odscen.scenario.document.scenario_document import Scenario
    from odscen.sumo.runner.run_folder import SumoPreparedRun

STAY = {"kind": "uniform", "low": 60, "high": 200}


def prepared(scenario: Scenario, folder: Path, **options: Any) -> SumoPreparedRun:
    folder.mkdir(exist_ok=True)
    net = folder / "net.net.xml"
    net.write_bytes(parking_town().net_xml)
    made = prepare(scenario, parking_town().sumo, net, settings=RunSettings(**options))
    assert made.problems == ()
    return made


def run(scenario: Scenario, folder: Path, **options: Any) -> tuple[Path, pl.DataFrame]:
    run_prepared(prepared(scenario, folder, **options), folder / "run")
    stays = read_stays(folder / "run")
    assert stays is not None
    return folder / "run", stays


def plan_of(folder: Path) -> Plan:
    return Plan.from_json((folder / "plan.json").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_trips_begin_and_end_parked_in_the_shares_of_the_demand(tmp_path: Path) -> None:
    scenario = parking_scenario({"begin": 0.1, "end": 0.2, "stay": STAY}, trips=200)
    folder, stays = run(scenario, tmp_path)
    planned = plan_of(folder).actors
    begun = {one.id for one in planned if one.begins_in}
    ended = {one.id for one in planned if one.ends_in}
    assert 10 <= len(begun) <= 30
    assert 25 <= len(ended) <= 55
    assert set(stays.filter("begins")["actor"]) == begun
    assert set(stays.filter(~pl.col("begins"))["actor"]) == ended
    over = stays.filter(~pl.col("begins"), pl.col("departure").is_not_null())
    lasted = over["departure"] - over["arrival"]
    assert lasted.min() >= 60.0  # type: ignore[operator]
    assert lasted.max() <= 200.5  # type: ignore[operator]


@pytest.mark.slow
def test_a_trip_is_from_leaving_a_place_to_taking_one(tmp_path: Path) -> None:
    scenario = parking_scenario({"begin": 0.2, "end": 0.3, "stay": STAY})
    folder, stays = run(scenario, tmp_path)
    outcomes = {
        one.id: one for one in actors_from_json((folder / "actors.json").read_text("utf-8"))
    }
    for actor, _, begins, came, left in stays.iter_rows():
        if begins:
            assert outcomes[actor].inserted == pytest.approx(left, abs=1.0)
        else:
            assert outcomes[actor].arrived == pytest.approx(came, abs=1.0)
    trips = read_trips(folder)
    assert trips is not None
    assert trips["id"].n_unique() == trips.height
    for row in trips.iter_rows(named=True):
        one = outcomes[row["id"]]
        assert row["depart"] == pytest.approx(one.inserted, abs=1.0)
        if one.arrived is not None:
            assert row["duration"] == pytest.approx(one.travel_time, abs=1.0)
            assert row["time_loss"] <= row["duration"]


@pytest.mark.slow
def test_cars_stand_in_the_places_that_the_map_draws(tmp_path: Path) -> None:
    folder, stays = run(parking_scenario({"end": 0.3, "stay": STAY}), tmp_path)
    plan = plan_of(folder)
    places = {area.id: area.places for area in parking_town().parking.areas}
    rows = pl.read_parquet(folder / "trajectories.parquet")
    for actor, area, _, came, _ in stays.head(20).iter_rows():
        own = rows.filter(pl.col("vehicle_id") == actor, pl.col("timestep_time") == came + 5.0)
        x, y, angle = own.select("vehicle_x", "vehicle_y", "vehicle_angle").row(0)
        middle = body_centre(x, y, angle, length=5.0, net_offset=plan.net_offset)
        assert min(math.dist(middle, (one.x, one.y)) for one in places[area]) < 0.05


@pytest.mark.slow
def test_an_area_never_holds_more_cars_than_it_has_places(tmp_path: Path) -> None:
    scenario = parking_scenario({"begin": 0.3, "end": 0.9, "stay": 400}, trips=150)
    folder, stays = run(scenario, tmp_path)
    parking = read_parking(folder, end=900.0)
    assert parking is not None
    uses = [parking.use(one.id) for one in parking.areas]
    assert [one.places for one in uses] == [PLACES] * 6
    assert all(one.highest <= PLACES for one in uses)
    # More want to park than there is room for: some drive on to another area.
    whole = parking.use()
    assert whole.diverted > 0
    assert whole.highest >= 0.8 * whole.places
    assert stays.filter(~pl.col("begins")).height == whole.ended


@pytest.mark.slow
def test_without_parking_the_files_of_a_run_are_as_before() -> None:
    town = parking_town().sumo
    plain = realize(parking_scenario({}), town)
    assert PARKING_FILE not in plain.files
    assert "parking" not in "".join(plain.files.values()) + plain.plan.to_json().replace(
        '"scenario": "parking"', ""
    )


@pytest.mark.slow
def test_what_of_parking_cannot_be_done_is_said() -> None:
    town = parking_town().sumo
    near = parking_scenario({"end": 1.0, "stay": STAY})
    meso = realize(near, town, settings=RunSettings(meso=True))
    assert PARKING_FILE not in meso.files
    assert "meso: no trip begins or ends in a parking place" in meso.notes
    crowd = realize(parking_scenario({"begin": 1.0, "stay": 600}, trips=200), town)
    (note,) = (text for text in crowd.notes if text.startswith("parking:"))
    assert "ends of trips are on the road" in note


def test_other_trips_change_nothing_for_those_that_end_parked() -> None:
    town = parking_town().sumo
    few, more = (
        realize(parking_scenario({"end": 0.4}, trips=trips), town).plan for trips in (40, 80)
    )
    ends = {one.id: one.ends_in for one in more.actors}
    starts = {one.id: one.spawn for one in more.actors}
    same = [one for one in few.actors if starts[one.id] == one.spawn]
    assert len(same) > 20
    assert [one.ends_in for one in same] == [ends[one.id] for one in same]


@pytest.mark.slow
def test_a_run_in_slices_that_is_killed_and_resumed_ends_with_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = parking_scenario({"begin": 0.2, "end": 0.5, "stay": STAY}, trips=80, duration=450)
    made = prepared(scenario, tmp_path, slice_length=150.0)
    alone = results(run_prepared(made, tmp_path / "alone").folder)
    assert any(name.startswith("parking_stays") for name in alone)
    for after in (1, 2):
        cut = tmp_path / f"after{after}"
        with monkeypatch.context() as patch:
            start_killed_workers(patch)
            patch.setenv("KILL_AFTER_SLICE", str(after))
            run_prepared(made, cut)
        resume(cut)
        assert results(cut) == alone


@pytest.mark.slow
def test_a_run_in_slices_counts_each_trip_and_each_stay_once(tmp_path: Path) -> None:
    scenario = parking_scenario({"begin": 0.2, "end": 0.5, "stay": STAY})
    folder, stays = run(scenario, tmp_path, slice_length=100.0)
    assert stays.select("actor", "begins").is_duplicated().sum() == 0
    trips = read_trips(folder)
    assert trips is not None
    assert trips["id"].n_unique() == trips.height
    outcomes = actors_from_json((folder / "actors.json").read_text("utf-8"))
    gone = {one.id: one for one in outcomes if one.inserted is not None}
    assert set(trips["id"]) == set(gone)
    for row in trips.iter_rows(named=True):
        if (known := gone[row["id"]]).arrived is not None:
            assert row["duration"] == pytest.approx(known.travel_time, abs=1.0)
