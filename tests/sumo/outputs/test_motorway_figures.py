"""Density, speed and level of a motorway against Edie's definitions on the trajectories alone.

Edie (1963): in ``T`` seconds on ``L`` metres, ``density = seconds / (T L)`` and
``speed = metres / seconds``, of all vehicles there. A record stands for the step that ends with it;
in the middle of a step, on average, vehicles come onto the road and leave it.
"""

from __future__ import annotations

from typing import NamedTuple

import polars as pl
import pytest

from odscen.runs.finished_run import Run
from odscen.runs.run_settings import RunSettings
from odscen.scenario import edits
from odscen.scenario.edits.demand_edits import set_input
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.realize.test_routes_file import empty
from tests.sumo.runner.test_on_maps import built, net_file

col = pl.col
MAP = "motorway_weave"
STEP, WARM_UP, UNTIL = 0.2, 120.0, 420.0
CLOSE = 0.01
MILE = 1.609344
LEVELS = ((11.0, "A"), (18.0, "B"), (26.0, "C"), (35.0, "D"), (45.0, "E"))
"""HCM Exhibit 12-15: passenger cars per mile and lane up to which a segment has the level."""


class Motorway(NamedTuple):
    """Figures of the segments that are highways, and what their trajectories say of each."""

    figures: pl.DataFrame
    edie: pl.DataFrame


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
    settings = RunSettings(warm_up=WARM_UP, interval=300.0)
    prepared = prepare(scenario, sumo_map, net_file(MAP, folder), settings=settings)
    run = run_prepared(prepared, folder / "run")
    lanes = run.lane_places().lanes.filter("motor")
    figures = run.figures_by("segment", over_time=True).filter(col("facility") == "highway")
    return Motorway(figures, edie(run, lanes))


def edie(run: Run, lanes: pl.DataFrame) -> pl.DataFrame:
    """Vehicle-seconds and metres of each segment, with passenger cars and metres of lane."""
    rows = run.trajectories().sort("id", "time").with_columns(
        first=col("time") == col("time").min().over("id"),
        last=(col("time") == col("time").max().over("id")) & (col("time") < UNTIL - STEP),
        cars=pl.when(col("category") == "truck").then(2.0).otherwise(1.0),
    )  # fmt: skip
    part = pl.when("first").then(0.5).when("last").then(1.5).otherwise(1.0) * STEP
    metres = lanes.group_by("segment").agg(lane_metres=(col("length") * col("share")).sum())
    return (
        rows.filter(col("time") > WARM_UP)
        .join(lanes, on="lane")
        .with_columns(seconds=part * col("share"))
        .group_by("segment")
        .agg(
            seconds=col("seconds").sum(),
            metres=(col("seconds") * col("speed")).sum(),
            cars=(col("seconds") * col("cars")).sum(),
        )
        .join(metres, on="segment")
    )


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
