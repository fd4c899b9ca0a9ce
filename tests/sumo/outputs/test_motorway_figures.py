"""Density, speed and level of a motorway against Edie's definitions on the trajectories alone.

Edie (1963): in ``T`` seconds on ``L`` metres, ``density = seconds / (T L)`` and
``speed = metres / seconds``, of all vehicles there. Each step is cut into parts, and each part
counts for the segment that its middle lies in.
"""

from __future__ import annotations

from typing import NamedTuple

import polars as pl
import pytest

from odscen.figures.by_place.analysis_times import WHOLE_RUN
from odscen.figures.by_place.lane_parts import part_sums
from odscen.figures.by_place.queue_metres import positions
from odscen.runs.finished_run import Run
from odscen.runs.net_facts import read_net_facts
from odscen.runs.recorded import read_lanes
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.document.measures_document import LaneIncident
from odscen.scenario.edits.demand_edits import set_input
from odscen.scenario.edits.rule_edits import set_measure
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.realize.test_routes_file import empty
from tests.sumo.runner.test_on_maps import built, net_file

col = pl.col
MAP = "motorway_weave"
STEP, WARM_UP, UNTIL = 0.2, 120.0, 420.0
CLOSE = 0.01
MILE = 1.609344
PARTS = 4
"""Of a step."""
MINUTE, HELD = 60.0, 240.0
STANDS = 450.0
"""Metres of road 4 at which vehicles stand in :func:`held_motorway`."""
ROAD_4, SEGMENT = 1453.0, 596.0 / 6.0
"""x at which road 4 begins, on which a queue grows, and the length of its segments, m."""
LEVELS = ((11.0, "A"), (18.0, "B"), (26.0, "C"), (35.0, "D"), (45.0, "E"))
"""HCM Exhibit 12-15: passenger cars per mile and lane up to which a segment has the level."""


class Motorway(NamedTuple):
    """Figures of the segments that are highways, and what their trajectories say of each."""

    figures: pl.DataFrame
    edie: pl.DataFrame
    run: Run


@pytest.fixture(scope="module")
def motorway(tmp_path_factory: pytest.TempPathFactory) -> Motorway:
    folder = tmp_path_factory.mktemp("motorway")
    sumo_map = built(MAP).sumo
    scenario = empty(MAP)
    mix = {"car": 9.0, "truck": 1.0}
    for name, segment, number in (("main", "r1-0", 5400), ("ramp", "r36-1", 400)):
        scenario = set_input(
            scenario, sumo_map.graph, inflow=name, segment=segment, per_hour=number, mix=mix,
            to=(("r5-2", 1),),
        )  # fmt: skip
    scenario = edits.set_simulation(scenario, duration=UNTIL, step_length=STEP)
    recording = Recording(columns=("lane", "pos"))
    settings = RunSettings(warm_up=WARM_UP, interval=300.0, recording=recording)
    prepared = prepare(scenario, sumo_map, net_file(MAP, folder), settings=settings)
    run = run_prepared(prepared, folder / "run")
    lanes = run.lane_places().lanes.filter("motor")
    figures = run.figures_by("segment", over_time=True).filter(col("facility") == "highway")
    return Motorway(figures, edie(run, lanes), run)


@pytest.fixture(scope="module")
def held_motorway(tmp_path_factory: pytest.TempPathFactory) -> Motorway:
    """Vehicles stand on all three lanes from the first minute on; figures by minute."""
    folder = tmp_path_factory.mktemp("held")
    sumo_map = built(MAP).sumo
    scenario = set_input(
        empty(MAP), sumo_map.graph, inflow="main", segment="r1-0", per_hour=2400,
        mix={"car": 9.0, "truck": 1.0}, to=(("r5-2", 1),),
    )  # fmt: skip
    for lane in (1, 2, 3):
        stands = LaneIncident(
            id=f"stands{lane}", kind="incident", begin=MINUTE, end=HELD, lane=f"4.1.-{lane}",
            s=STANDS,
        )  # fmt: skip
        scenario = set_measure(scenario, sumo_map.graph, measure=stands)
    scenario = edits.set_simulation(scenario, duration=HELD, step_length=STEP)
    settings = RunSettings(interval=MINUTE, recording=Recording(columns=("lane", "pos")))
    prepared = prepare(scenario, sumo_map, net_file(MAP, folder), settings=settings)
    run = run_prepared(prepared, folder / "run")
    lanes = run.lane_places().lanes.filter("motor")
    figures = run.figures_by("segment", over_time=True).filter(col("facility") == "highway")
    return Motorway(figures, edie(run, lanes, warm_up=0.0, period=MINUTE), run)


def edie(
    run: Run, lanes: pl.DataFrame, *, warm_up: float = WARM_UP, period: float = UNTIL - WARM_UP
) -> pl.DataFrame:
    """Vehicle-seconds and metres of each segment, with passenger cars and metres of lane."""
    rows = (
        pl.read_parquet(run.folder / "trajectories.parquet")
        .select(
            id="vehicle_id", time="timestep_time", lane="vehicle_lane", pos="vehicle_pos",
            speed="vehicle_speed",
        )
        .sort("id", "time")
        .with_columns(old=col("lane").shift().over("id"), was=col("pos").shift().over("id"))
        .drop_nulls("old")
        .filter(col("time") >= warm_up)
    )  # fmt: skip
    trucks = run.actors().filter(col("category") == "truck")["id"].implode()
    shares = pl.DataFrame({"share": [(k + 0.5) / PARTS for k in range(PARTS)]})
    back = col("pos") - col("speed") * STEP * (1.0 - col("share"))
    beside = col("lane").str.head(-1) == col("old").str.head(-1)
    on_old = (col("lane") != col("old")) & ((back < 0.0) | beside)
    steps = rows.join(shares, how="cross").select(
        lane=pl.when(on_old).then("old").otherwise("lane"),
        pos=pl.when(on_old).then(col("was") + col("speed") * STEP * col("share")).otherwise(back),
        begin_of=(col("time") - warm_up) // period * period + warm_up,
        metres=col("speed") * STEP / PARTS,
        cars=pl.when(col("id").is_in(trucks)).then(2.0).otherwise(1.0) * STEP / PARTS,
    )
    own = lanes.with_columns(
        begin=(col("share").cum_sum().over("lane") - col("share")) * col("length")
    )
    metres = lanes.group_by("segment").agg(lane_metres=(col("length") * col("share")).sum())
    return (
        steps.sort("pos")
        .join_asof(
            own.select("lane", "segment", "begin").sort("begin"),
            left_on="pos", right_on="begin", by="lane", check_sortedness=False,
        )
        .group_by("segment", begin="begin_of")
        .agg(
            seconds=pl.len() * (STEP / PARTS),
            metres=col("metres").sum(),
            cars=col("cars").sum(),
        )
        .join(metres, on="segment")
    )  # fmt: skip


@pytest.mark.slow
def test_density_speed_and_level_of_each_segment_are_edies_and_hcms(motorway: Motorway) -> None:
    both = motorway.figures.join(motorway.edie, on="segment", suffix="_edie")
    busy = both.filter(col("vehicles") > 200)
    assert busy.height >= 15
    period = UNTIL - WARM_UP
    for row in busy.iter_rows(named=True):
        name, length = row["segment"], row["length"]
        assert (row["begin"], row["end"]) == (WARM_UP, UNTIL)
        density = row["seconds_edie"] / period / length
        assert row["density"] == pytest.approx(density, rel=CLOSE), name
        speed = row["metres"] / row["seconds_edie"]
        assert row["speed"] == pytest.approx(speed, rel=CLOSE), name
        assert row["flow"] == pytest.approx(density * speed * 3.6, rel=CLOSE), name
        cars = row["cars"] / period / (row["lane_metres_edie"] / 1000.0)
        assert row["lane_density"] == pytest.approx(cars, rel=CLOSE), name
        level = next((level for most, level in LEVELS if cars * MILE <= most), "F")
        assert row["level"] == level, name
    assert busy["level"].n_unique() >= 2, "the same level everywhere would show nothing"


def test_a_motorway_with_an_incident_is_free_before_the_queue_and_has_level_f_in_it(
    held_motorway: Motorway,
) -> None:
    figures, edies, run = held_motorway
    both = figures.join(edies, on=("segment", "begin"), suffix="_edie")
    busy = both.filter(col("seconds_edie") > 20.0)
    assert busy.height > 50
    for row in busy.iter_rows(named=True):
        name = f"{row['segment']} from {row['begin']:g} s"
        # Up to a step of one vehicle at each border of an interval or a lane.
        assert row["seconds"] == pytest.approx(row["seconds_edie"], rel=CLOSE, abs=1.0), name
        assert row["distance"] == pytest.approx(row["metres"], rel=CLOSE, abs=20.0), name
    stopped = (
        pl.read_parquet(run.folder / "trajectories.parquet")
        .filter((col("vehicle_speed") < 5.0 / 3.6) & (col("timestep_time") > MINUTE))
        .group_by(begin=col("timestep_time") // MINUTE * MINUTE)
        .agg(tail=col("vehicle_x").min())
    )
    for begin, tail in stopped.filter(col("begin") < HELD).sort("begin").rows():
        level = dict(figures.filter(col("begin") == begin).select("segment", "level").rows())
        reached = [f"r4-{k}" for k in range(5) if ROAD_4 + k * SEGMENT >= tail]
        free = [f"r4-{k}" for k in range(5) if ROAD_4 + (k + 1) * SEGMENT < tail]
        assert {level[name] for name in reached} == {"F"}, begin
        assert {level[name] for name in ("r1-0", "r2-0", "r3-0", *free)} <= {"A", "B"}, begin
    assert stopped.height >= 3


@pytest.mark.slow
def test_places_along_curved_lanes_are_found_from_x_and_y(motorway: Motorway) -> None:
    run, facts = motorway.run, read_net_facts(motorway.run.folder)
    lanes = read_lanes(run.folder)
    assert facts is not None
    assert lanes is not None
    clock = WHOLE_RUN.clock(lanes, end=UNTIL)
    rows = pl.read_parquet(run.folder / "trajectories.parquet").lazy()
    recorded = part_sums(rows, run.lane_places(), clock)
    found = part_sums(
        rows.drop("vehicle_pos"),
        run.lane_places(),
        clock,
        positions=lambda some: positions(some, facts),
    )
    assert recorded is not None
    assert found is not None
    both = recorded.join(found, on=("lane", "part", "begin"), suffix="_found")
    assert both.height > 100
    for name in ("seconds", "distance"):
        assert (both[name] - both[f"{name}_found"]).abs().max() < 0.01 * both[name].max()
