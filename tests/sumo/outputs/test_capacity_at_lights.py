"""Capacity and control delay at fixed-time lights: what is driven, and HCM chapters 19 and 31."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from odscen.runs.finished_run import Run
from odscen.scenario.edits.demand_edits import set_input
from tests.signal_case import carried_out, crossing, scenario

col = pl.col
WARM_UP, HOUR = 300.0, 3600.0
CYCLE, GREEN = 83.0, 37.0
"""Seconds; with what the crossings take to clear."""
PROGRAM: dict[str, Any] = {
    "junction": "10001",
    "groups": [
        {"id": "V1", "movements": ["r1 straight", "r1 right"]},
        {"id": "V1L", "movements": ["r1 left"]},
        {"id": "V2", "movements": ["r2"]},
        {"id": "V3", "movements": ["r3 straight", "r3 right"]},
        {"id": "V3L", "movements": ["r3 left"]},
        {"id": "V4", "movements": ["r4"]},
        *({"id": f"P{leg}", "movements": [f"walk r{leg}"]} for leg in (1, 2, 3, 4)),
    ],
    "stages": [
        {
            "id": "1",
            "protected": ["P2", "P4"],
            "permissive": ["V1", "V1L", "V3", "V3L"],
            "green": 34,
        },
        {"id": "2", "protected": ["P1", "P3"], "permissive": ["V2", "V4"], "green": 25},
    ],
}
LEFT, OPPOSING = "r1>j10001>r4", "r3>j10001>r1"


def driven(folder: Path, *, left: float, opposing: float, period: float, seed: int = 1) -> Run:
    graph = crossing().sumo.graph
    until = WARM_UP + period
    empty = scenario(PROGRAM, walkers=0.0, until=until).model_copy(
        update={"flows": (), "seed": seed}
    )
    for name, segment, to, number in (
        ("left", "r1", "r4", left), ("opposing", "r3", "r1", opposing),
    ):  # fmt: skip
        if number:
            empty = set_input(
                empty, graph, inflow=name, segment=segment, per_hour=number, to=((to, 1),),
                mix={"car": 1.0},
            )  # fmt: skip
    return carried_out(empty, folder, warm_up=WARM_UP, interval=period)


def test_a_turn_through_gaps_that_is_never_empty_has_the_capacity_that_is_driven(
    tmp_path: Path,
) -> None:
    period = 1500.0
    run = driven(tmp_path, left=700.0, opposing=400.0, period=period)
    entered = (
        pl.read_parquet(run.folder / "trajectories.parquet")
        .filter(col("vehicle_lane").str.starts_with(":J10001_4_"))
        .group_by("vehicle_id")
        .agg(col("timestep_time").min())
        .filter(col("timestep_time") >= WARM_UP)
        .height
    )
    group = run.figures_by("lane_group").row(by_predicate=col("lane_group") == LEFT, named=True)
    assert entered > 80
    assert group["demand"] > 1.5 * entered
    assert group["capacity"] == pytest.approx(entered, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("volume", [200.0, 400.0, 550.0])
def test_control_delay_at_a_light_is_within_15_percent_of_hcms(
    tmp_path: Path, volume: float
) -> None:
    """Equations 19-18 to 19-26 with arrivals at random, an hour each with three seeds."""
    measured, expected = 0.0, 0.0
    for seed in (1, 2, 3):
        run = driven(tmp_path / str(seed), left=0.0, opposing=volume, period=HOUR, seed=seed)
        movement = run.figures_by("movement").row(
            by_predicate=col("movement") == OPPOSING, named=True
        )
        x = movement["passages"] / movement["capacity"]
        group = run.figures_by("lane_group").row(
            by_predicate=col("lane_group") == movement["lane_group"], named=True
        )
        # The hour has no whole number of cycles.
        full = group["saturation_flow"] * GREEN / CYCLE
        assert movement["capacity"] == pytest.approx(full, rel=0.03)
        share = GREEN / CYCLE
        uniform = 0.5 * CYCLE * (1.0 - share) ** 2 / (1.0 - x * share)
        random = 900.0 * (x - 1.0 + math.sqrt((x - 1.0) ** 2 + 4.0 * x / movement["capacity"]))
        expected += uniform + random
        measured += movement["control_seconds"] / movement["passages"]
    assert measured == pytest.approx(expected, rel=0.15)
