"""What SUMO measures in a run, held against what its trajectories say step by step."""

from __future__ import annotations

import json
import subprocess
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest
from lxml import etree

from odscen.figures.measures.summary import actors_from_json
from odscen.runs.recorded import read_lanes, read_trajectories, read_trips
from odscen.sumo.outputs.output_tables import lane_table
from odscen.sumo.realize.measure_files import interval_of, measures_xml
from odscen.sumo.realize.sumocfg import SumocfgSettings, sumo_config
from odscen.sumo.runner.run_folder import SumoPreparedRun
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.conftest import BIN, SLICE, UNTIL, Prepare

col = pl.col
STEP = 0.5
STANDS = 0.1


LANE_INDEX = r"_\d+$"


@pytest.fixture(scope="module")
def folder(long: SumoPreparedRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in four slices."""
    result = run_prepared(long, tmp_path_factory.mktemp("measured") / "run")
    assert result.status == "completed"
    return result.folder


@pytest.fixture(scope="module")
def lanes(folder: Path) -> pl.DataFrame:
    found = read_lanes(folder)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def trips(folder: Path) -> pl.DataFrame:
    found = read_trips(folder)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def steps(folder: Path) -> pl.DataFrame:
    """Vehicles of each step with lane, the lane of the step before, and edges."""
    recorded = read_trajectories(folder)
    assert recorded is not None
    return (
        recorded.rows.rename(lambda name: name.removeprefix("vehicle_"))
        .sort("id", "timestep_time")
        .with_columns(before=col("lane").shift(1).over("id"))
        .with_columns(
            edge=col("lane").str.replace(LANE_INDEX, ""),
            edge_before=col("before").str.replace(LANE_INDEX, ""),
        )
    )


def cars(table: pl.DataFrame) -> pl.DataFrame:
    return table.filter(col("id").str.starts_with("car"))


@pytest.mark.slow
def test_everybody_who_set_out_has_one_trip_across_all_slices(
    folder: Path, trips: pl.DataFrame
) -> None:
    actors = actors_from_json((folder / "actors.json").read_text())
    assert trips["id"].is_duplicated().sum() == 0
    assert set(trips["id"]) == {actor.id for actor in actors if actor.inserted is not None}
    unfinished = trips.filter(col("arrival").is_null())
    assert set(unfinished["id"]) == {actor.id for actor in actors if actor.status == "running"}
    assert trips["arrival"].to_list()[-unfinished.height :] == [None] * unfinished.height
    assert trips["arrival"].drop_nulls().is_sorted()


def test_trips_across_boundaries_are_as_long_as_the_events_say(
    folder: Path, trips: pl.DataFrame
) -> None:
    across = trips.filter(
        col("arrival").is_not_null(),
        (col("depart") / SLICE).floor() < (col("arrival") / SLICE).floor(),
    )
    assert across.height > 20
    assert across["person"].sum() > 3
    known = {a.id: a for a in actors_from_json((folder / "actors.json").read_text())}
    for trip in across.iter_rows(named=True):
        actor = known[trip["id"]]
        assert trip["duration"] == actor.travel_time
        assert actor.inserted == trip["depart"]
        assert actor.delay == actor.time_loss == trip["time_loss"]
        assert actor.waiting_time == trip["waiting_time"]
        assert actor.stops == trip["waiting_count"]


def test_waiting_and_halts_are_those_of_the_steps(trips: pl.DataFrame, steps: pl.DataFrame) -> None:
    """The step in which somebody appears is none of standing; a car appears with some speed."""
    moving = steps.with_columns(
        stands=(col("speed") < STANDS) & col("before").is_not_null(),
    ).with_columns(stood=col("stands").shift(1, fill_value=False).over("id"))
    recomputed = moving.group_by("id").agg(
        waited=col("stands").sum() * STEP, halts=(col("stands") & ~col("stood")).sum()
    )
    both = trips.join(recomputed, on="id")
    assert both.height == trips.height
    late = both.filter(~col("person"))
    assert (late["waiting_time"] - late["waited"]).abs().max() <= STEP
    assert late["waiting_time"].sum() == pytest.approx(late["waited"].sum(), rel=0.005)
    assert (late["waiting_count"] - late["halts"]).abs().max() <= 1
    assert late["waiting_count"].sum() == pytest.approx(late["halts"].sum(), rel=0.05)
    walkers = both.filter(col("person"))
    assert walkers["waiting_count"].null_count() == walkers.height
    assert walkers["waiting_time"].sum() > 0


def test_time_loss_is_what_the_steps_lack_of_the_desired_speed(
    trips: pl.DataFrame, steps: pl.DataFrame
) -> None:
    """Speed limit 13.89 m/s, speed factor 0.95, on the streets; turning is slower."""
    wished = 0.95 * 13.89
    ways = cars(steps).filter(~col("edge").str.starts_with(":"), col("before").is_not_null())
    lost = ways.group_by("id").agg(lost=((wished - col("speed")).clip(0) / wished).sum() * STEP)
    both = trips.join(lost, on="id")
    assert both.height > 60
    # The steps inside junctions are left out above; nobody stands there.
    assert both["time_loss"].sum() == pytest.approx(both["lost"].sum(), rel=0.05)
    assert ((both["time_loss"] - both["lost"]) > -2.0).all()


def test_nobody_enters_twice_at_a_boundary(lanes: pl.DataFrame, steps: pl.DataFrame) -> None:
    """SUMO counts whoever comes back with the saved state as having entered."""
    # By edge: who changes lanes while entering may have flipped to the other when it is recorded.
    passed = cars(steps).filter(col("edge") != col("edge_before"))
    by_edge = lanes.with_columns(edge=col("lane").str.replace(LANE_INDEX, ""))
    entered = passed.group_by("edge").agg(n=pl.len().cast(pl.Int64)).sort("edge")
    measured = (
        by_edge.group_by("edge").agg(n=col("entered").sum()).filter(col("n") > 0).sort("edge")
    )
    assert measured.equals(entered)
    left = passed.group_by(edge="edge_before").agg(n=pl.len().cast(pl.Int64))
    measured = by_edge.group_by("edge").agg(n=col("left").sum())
    gone = measured.join(left, on="edge", how="left").with_columns(col("n_right").fill_null(0))
    arrived = lanes["arrived"].sum()
    assert (gone["n"] - gone["n_right"]).abs().sum() <= arrived
    assert lanes["departed"].sum() == cars(steps)["id"].n_unique()


def test_seconds_of_a_lane_are_those_in_which_fronts_are_on_it(
    lanes: pl.DataFrame, steps: pl.DataFrame, trips: pl.DataFrame
) -> None:
    """A vehicle enters and leaves within a step: half a second more or less each."""
    spent = cars(steps).group_by("lane").agg(spent=pl.len() * STEP, visits=col("id").n_unique())
    measured = lanes.group_by("lane").agg(col("seconds", "distance", "waiting", "time_loss").sum())
    both = measured.join(spent, on="lane", how="full", coalesce=True).fill_null(0.0)
    assert ((both["seconds"] - both["spent"]).abs() <= STEP * (both["visits"] + 1)).all()
    by_car = trips.filter(~col("person"))
    assert measured["seconds"].sum() == pytest.approx(by_car["duration"].sum(), rel=0.01)
    assert measured["distance"].sum() == pytest.approx(by_car["route_length"].sum(), rel=1e-4)
    assert measured["waiting"].sum() == pytest.approx(by_car["waiting_time"].sum(), rel=0.02)
    assert measured["time_loss"].sum() == pytest.approx(by_car["time_loss"].sum(), rel=0.005)


def test_intervals_are_whole_and_none_is_twice_in_a_run_in_slices(lanes: pl.DataFrame) -> None:
    assert lanes.select("begin", "lane").is_duplicated().sum() == 0
    assert set(lanes.rows_by_key("begin")) == {0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0}
    assert set(lanes["end"] - lanes["begin"]) == {30.0, UNTIL - 180.0}
    assert lanes.select("begin", "lane").rows() == sorted(lanes.select("begin", "lane").rows())


def test_plain_sumo_measures_the_same(prepare: Prepare, tmp_path: Path) -> None:
    run = run_prepared(prepare(), tmp_path / "run").folder
    assert not list(run.glob("*.xml"))
    sumo = run / "sumo"
    subprocess.run([BIN / "sumo", "-c", sumo / "scenario.sumocfg"], check=True, capture_output=True)
    mine = read_lanes(run)
    assert mine is not None
    edges = etree.parse(sumo / "net.net.xml").getroot().iterfind("edge")
    lengths = {
        edge.get("id"): {lane.get("id"): float(lane.get("length")) for lane in edge.iter("lane")}
        for edge in edges
    }
    theirs = lane_table(sumo / "lanes.parquet", sumo / "emissions.parquet", lengths)
    assert mine.equals(theirs)
    raw = pl.read_parquet(sumo / "emissions.parquet")
    assert mine["co2"].sum() == pytest.approx(raw["lane_CO2_abs"].sum() / 1000.0)
    assert 50.0 < mine["co2"].sum() < 1000.0  # four cars, 290 m each, in grams


def test_without_emissions_there_are_no_columns_for_them(prepare: Prepare, tmp_path: Path) -> None:
    run = prepare()
    files = {**run.sumo_files, "measures.add.xml": measures_xml(10.0, emissions=False)}
    folder = run_prepared(replace(run, sumo_files=files), tmp_path / "run").folder
    lanes = read_lanes(folder)
    assert lanes is not None
    assert lanes.columns[-2:] == ["waiting", "time_loss"]


def test_a_run_without_anybody_has_neither_lanes_nor_trips(
    prepare: Prepare, tmp_path: Path
) -> None:
    nobody = prepare(cars=0, walker=False, routes="<routes/>")
    result = run_prepared(nobody, tmp_path / "run")
    assert result.status == "completed"
    assert read_lanes(result.folder) is None
    assert read_trips(result.folder) is None


@pytest.mark.slow
def test_queues_of_the_mesoscopic_model_are_measured_across_slices_too(
    long: SumoPreparedRun, tmp_path: Path
) -> None:
    settings = SumocfgSettings(until=UNTIL, step_length=0.5, seed=7, measures=True, meso=True)
    files = {**long.sumo_files, "scenario.sumocfg": sumo_config(settings)}
    folder = run_prepared(replace(long, sumo_files=files), tmp_path / "run").folder
    lanes, trips = read_lanes(folder), read_trips(folder)
    assert lanes is not None
    assert trips is not None
    by_car = trips.filter(~col("person"))
    assert set(lanes["lane"].str.replace(r"_\d+$", "")) == set(lanes["edge"])
    assert lanes["seconds"].sum() == pytest.approx(by_car["duration"].sum(), rel=0.01)
    assert lanes["entered"].sum() == lanes["left"].sum()
    assert lanes["departed"].sum() == by_car.height
    assert lanes["arrived"].sum() == by_car["arrival"].count()


def test_figures_of_the_run_are_those_of_the_trips(folder: Path, trips: pl.DataFrame) -> None:
    figures = json.loads((folder / "summary.json").read_text())["figures"]
    arrived = trips.filter(col("arrival").is_not_null())
    by_car, on_foot = arrived.filter(~col("person")), arrived.filter("person")
    planned = {
        one["id"]: one["depart"] for one in json.loads((folder / "plan.json").read_text())["actors"]
    }
    late = trips["depart"] - trips["id"].replace_strict(planned, return_dtype=pl.Float64)
    with_wait = trips.with_columns(delay=col("time_loss") + late)
    for name, expected in {
        "mean_travel_time": by_car["duration"].mean(),
        "mean_delay": with_wait.filter(~col("person"))["delay"].mean(),
        "mean_waiting_time": by_car["waiting_time"].mean(),
        "mean_stops": by_car["waiting_count"].mean(),
        "pedestrian_mean_delay": with_wait.filter("person")["delay"].mean(),
        "pedestrian_mean_waiting_time": on_foot["waiting_time"].mean(),
    }.items():
        assert figures[name] == pytest.approx(expected, abs=1e-4), name


@pytest.mark.parametrize(
    ("until", "slice_length", "seconds"),
    [
        (600.0, None, 10.0),
        (961.0, None, 30.0),
        (3600.0, None, 60.0),
        (2 * 3600.0, 3600.0, 300.0),
        (86400.0, 3600.0, 900.0),
        (10 * 86400.0, 3600.0, 900.0),
        (86400.0, 60.0, 60.0),
        (5.0, None, 5.0),
    ],
)
def test_intervals_are_fine_for_short_runs_and_no_longer_than_a_slice(
    until: float, slice_length: float | None, seconds: float
) -> None:
    assert interval_of(until, slice_length) == seconds
