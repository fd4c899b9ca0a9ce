"""Figures of segments that lie on one SUMO lane, against trajectories and SUMO's own edge data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from odscen.figures.by_place.lane_traffic import lane_traffic
from odscen.figures.by_place.traffic import over_run, traffic_figures
from odscen.runs.finished_run import Run
from odscen.runs.measured import read_parts
from odscen.runs.recorded import read_lanes
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.document.measures_document import LaneIncident
from odscen.scenario.edits.demand_edits import set_input
from odscen.scenario.edits.rule_edits import set_measure
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.straight_road import LENGTH, straight_road

col = pl.col
STEP, UNTIL, PERIOD = 0.5, 1200.0, 300.0
CLOSE = 0.01
PLACE, BEGIN, END = 2490.0, 300.0, 900.0
"""Where something stands on the road, m, and when, s."""
STARTS = 24
"""Segment in which what stands there later is put on the road."""
CELL = 100.0
"""Metres of a segment."""
SUMMED = ("seconds", "distance", "time_loss", "co2", "nox", "fuel")
PARTS = 20
"""Of a step, which a reference is counted in."""


def straight(folder: Path, **settings: Any) -> Run:
    """A run on the straight road with an incident."""
    sumo_map, net = straight_road()
    graph = sumo_map.graph
    scenario = edits.new_scenario(graph, name="straight", roi=graph.segments.ids, seed=3)
    scenario = set_input(
        scenario, graph, inflow="in", segment="r1-0", per_hour=500, to=(("r1-29", 1),),
        mix={"car": 9.0, "truck": 1.0},
    )  # fmt: skip
    stands = LaneIncident(
        id="stands", kind="incident", begin=BEGIN, end=END, lane="1.0.-1", s=PLACE
    )
    scenario = set_measure(scenario, graph, measure=stands)
    scenario = edits.set_simulation(scenario, duration=UNTIL, step_length=STEP)
    file = folder / "straight.net.xml"
    file.write_bytes(net)
    prepared = prepare(scenario, sumo_map, file, settings=RunSettings(interval=PERIOD, **settings))
    return run_prepared(prepared, folder / "run")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return straight(tmp_path_factory.mktemp("straight"))


@pytest.fixture(scope="module")
def unrecorded(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("unrecorded")
    return straight(folder, recording=Recording(trajectories=False))


def edie(run: Run) -> pl.DataFrame:
    """Seconds, metres and stopped seconds of each segment and interval, step by step.

    Each step is cut into many parts, and each part counts where its middle is.
    """
    rows = pl.read_parquet(run.folder / "trajectories.parquet").select(
        id="vehicle_id", time="timestep_time", x="vehicle_x", speed="vehicle_speed"
    ).sort("id", "time")  # fmt: skip
    moved = rows.with_columns(was=col("x").shift().over("id")).drop_nulls()
    last = (
        rows.group_by("id").agg(pl.all().sort_by("time").last())
        .filter(col("time") < UNTIL - STEP)
        .with_columns(was="x", x=col("x") + col("speed") * STEP, time=col("time") + STEP)
    )  # fmt: skip
    steps = pl.concat([moved, last.select(moved.columns)])
    shares = (np.arange(PARTS) + 0.5) / PARTS
    was, way = steps["was"].to_numpy(), (steps["x"] - steps["was"]).to_numpy()
    middle = was[:, None] + way[:, None] * shares
    metres = np.broadcast_to((way / PARTS)[:, None], middle.shape)
    stopped = np.broadcast_to((steps["speed"].to_numpy() < 0.1)[:, None], middle.shape)
    begin = np.broadcast_to((steps["time"].to_numpy() // PERIOD * PERIOD)[:, None], middle.shape)
    there = middle < LENGTH - 10.5  # where they arrive
    return (
        pl.DataFrame(
            {
                "cell": np.floor(middle[there] / CELL).astype(int),
                "begin": begin[there],
                "metres": metres[there],
                "stopped": stopped[there] * (STEP / PARTS),
            }
        )
        .group_by("cell", "begin")
        .agg(
            seconds=pl.len() * (STEP / PARTS),
            metres=col("metres").sum(),
            stopped=col("stopped").sum(),
        )
    )


def of_segments(run: Run) -> pl.DataFrame:
    figures = run.figures_by("segment", over_time=True)
    return figures.with_columns(cell=col("segment").str.strip_prefix("r1-").cast(pl.Int64)).sort(
        "cell", "begin"
    )


@pytest.mark.slow
def test_each_segment_has_what_was_driven_in_it(run: Run) -> None:
    # Who arrives does so on the last segment, within a step of which SUMO alone knows.
    there = of_segments(run).filter(col("cell") < 29)
    both = there.join(edie(run), on=("cell", "begin"), suffix="_edie")
    assert both.height > 100
    for row in both.iter_rows(named=True):
        name = f"{row['segment']} from {row['begin']:g} s"
        assert row["spread"] == 0.0, name
        assert row["seconds"] == pytest.approx(row["seconds_edie"], rel=CLOSE, abs=1.0), name
        assert row["distance"] == pytest.approx(row["metres"], rel=CLOSE, abs=10.0), name
        assert row["standing_seconds"] == pytest.approx(row["stopped"], rel=CLOSE, abs=1.0), name


@pytest.mark.slow
def test_the_road_before_the_queue_is_free_and_in_the_queue_it_has_level_f(run: Run) -> None:
    figures = of_segments(run)
    stopped = (
        pl.read_parquet(run.folder / "trajectories.parquet")
        .filter((col("vehicle_speed") < 5.0 / 3.6) & (col("vehicle_x") < PLACE))
        .filter(col("timestep_time").is_between(BEGIN, END, closed="left"))
        .group_by(begin=col("timestep_time") // PERIOD * PERIOD)
        .agg(tail=col("vehicle_x").min())
        .sort("begin")
    )
    tails = dict(stopped.rows())
    assert list(tails) == [300.0, 600.0]
    assert tails[600.0] < tails[300.0] - CELL, "the queue grows"
    for begin, tail in tails.items():
        held = figures.filter(col("begin") == begin)
        levels = {k: level for k, level in held.select("cell", "level").rows() if k < PLACE // CELL}
        reached = {level for k, level in levels.items() if k * CELL >= tail}
        free = {level for k, level in levels.items() if (k + 1) * CELL < tail}
        assert reached == {"F"}, begin
        assert levels[0] in ("A", "B")
        assert free <= {"A", "B"}, begin
    held = figures.filter(col("begin") == 600.0)
    assert figures.filter(col("begin") < 300.0)["level"].is_in(["A", "B"]).all()
    beyond = held.filter(col("cell") > PLACE // CELL)
    assert beyond["seconds"].max() < 5.0, "nobody gets past"


@pytest.mark.slow
def test_parts_of_a_lane_add_up_to_what_sumo_measures_on_it(run: Run, unrecorded: Run) -> None:
    for one in (run, unrecorded):
        lanes = pl.read_parquet(one.folder / "lanes.parquet").filter(col("edge") == "1.0.f")
        sums = of_segments(one).group_by("begin").agg(col(*SUMMED).sum()).sort("begin")
        theirs = lanes.group_by(col("begin") // PERIOD * PERIOD).agg(col(*SUMMED).sum())
        both = sums.join(theirs, on="begin", suffix="_sumo")
        assert both.height == UNTIL / PERIOD
        for name in SUMMED:
            assert both[name].to_list() == pytest.approx(both[f"{name}_sumo"].to_list(), rel=1e-4)


def test_vehicles_of_a_segment_are_those_that_came_into_it(run: Run) -> None:
    """Counted at its beginning, as an induction loop there does; of the first those that depart."""
    x = pl.read_parquet(run.folder / "trajectories.parquet").sort("vehicle_id", "timestep_time")
    x = x.with_columns(was=col("vehicle_x").shift().over("vehicle_id")).drop_nulls("was")
    figures = run.figures_by("segment")
    for cell in (1, 10, 24):
        crossed = x.filter((col("was") < cell * CELL) & (col("vehicle_x") >= cell * CELL)).height
        own = figures.filter(col("segment") == f"r1-{cell}")["vehicles"].item()
        assert own == crossed + (cell == STARTS)
    inserted = run.summary["actors"]["inserted"]
    assert figures.filter(col("segment") == "r1-0")["vehicles"].item() == inserted


def test_without_trajectories_segments_have_nearly_the_same_figures(
    run: Run, unrecorded: Run
) -> None:
    assert not (unrecorded.folder / "trajectories.parquet").exists()
    assert not (unrecorded.folder / "positions.parquet").exists()
    assert (unrecorded.folder / "lane_segments.parquet").is_file()
    both = of_segments(run).join(of_segments(unrecorded), on=("cell", "begin"), suffix="_less")
    busy = both.filter(col("vehicles") >= 20)
    assert busy.height > 80
    assert busy["spread_less"].max() == 0.0
    assert (busy["level"] != busy["level_less"]).sum() <= 2
    off = ((busy["seconds_less"] - busy["seconds"]) / busy["seconds"]).abs()
    assert off.mean() < 0.02
    assert off.max() < 0.15


def test_figures_of_whole_lanes_say_so_where_nothing_else_is_known(run: Run) -> None:
    lanes, places = read_lanes(run.folder), run.lane_places()
    assert lanes is not None
    found = over_run(traffic_figures(lanes, places, end=UNTIL).segments)
    assert found["spread"].to_list() == [1.0] * 30
    assert found["speed"].max() == pytest.approx(found["speed"].min())
    assert over_run(of_segments(run).drop("cell"))["spread"].to_list() == [0.0] * 30


@pytest.mark.slow
def test_of_a_region_only_its_segments_have_figures_of_their_own(tmp_path: Path) -> None:
    region = Recording(region=(-10.0, -50.0, 1000.0, 50.0))
    found = straight(tmp_path, recording=region).figures_by("segment")
    assert found["spread"].min() == 1.0, "who was beyond it is not known"


def test_a_map_in_colours_has_each_segment_by_itself(run: Run) -> None:
    lanes = read_lanes(run.folder)
    assert lanes is not None
    measured = read_parts(run.folder, end=UNTIL)
    found = lane_traffic(lanes, run.lane_places(), end=UNTIL, measured=measured)
    first, held = found.names.index(("1.0.f_0", "r1-2")), found.names.index(("1.0.f_0", "r1-24"))
    begin, end = found.times.index(600.0), found.times.index(900.0)
    sums = found.sums.filter(col("interval").is_between(begin, end - 1)).group_by("lane").sum()
    speed = dict(sums.select("lane", col("distance") / col("seconds")).rows())
    assert speed[first] > 18.0
    assert speed[held] < 1.0
    assert found.lengths == pytest.approx([100.0] * 30)


def test_who_drives_in_far_behind_a_queue_has_the_speed_of_the_road_there(run: Run) -> None:
    first = run.figures_by("segment", over_time=True).filter(col("segment") == "r1-0")
    assert first["speed"].min() > 18.0
