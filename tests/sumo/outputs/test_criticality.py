"""What SUMO's SSM device says of a run, held against what its trajectories say step by step."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

from odscen.figures.measures import safety
from odscen.figures.measures.conflicts import SEEN_TTC
from odscen.figures.measures.figure import RunData
from odscen.figures.measures.registry import figure_values
from odscen.runs.recorded import read_conflicts, read_trajectories
from odscen.runs.recording import Recording
from odscen.sumo.realize.sumocfg import SumocfgSettings, sumo_config
from odscen.sumo.runner.run_folder import SumoPreparedRun
from odscen.sumo.runner.run_jobs import run_prepared
from tests.sumo.conftest import LENGTH, UNTIL

col = pl.col


def watched(prepared: SumoPreparedRun) -> SumoPreparedRun:
    """The same run with an SSM device in every vehicle."""
    settings = SumocfgSettings(
        until=UNTIL,
        step_length=prepared.plan.step_length,
        seed=prepared.plan.seed,
        recording=Recording(columns=("lane", "pos"), criticality=True),
        measures=True,
    )
    device = '<param key="has.ssm.device" value="true"/>'
    routes = re.sub(
        r"<vType (id=\"car\"[^>]*)/>",
        rf"<vType \1>{device}</vType>",
        prepared.sumo_files["routes.rou.xml"],
    )
    assert device in routes
    files = {**prepared.sumo_files, "routes.rou.xml": routes}
    return replace(prepared, sumo_files={**files, "scenario.sumocfg": sumo_config(settings)})


@pytest.fixture(scope="module")
def whole(long: SumoPreparedRun, tmp_path_factory: pytest.TempPathFactory) -> Path:
    one_piece = replace(long, plan=replace(long.plan, slice_length=None))
    result = run_prepared(watched(one_piece), tmp_path_factory.mktemp("critical") / "run")
    assert result.status == "completed"
    figures = result.summary["figures"]
    conflicts = read_conflicts(result.folder)
    assert conflicts is not None
    found = figure_values(RunData(conflicts=conflicts), safety.FIGURES)
    assert {name: figures[name] for name in found} == pytest.approx(found)
    return result.folder


def following(folder: Path) -> dict[frozenset[str], float]:
    """Smallest gap over closing speed of two behind each other on one lane, by the trajectories."""
    recorded = read_trajectories(folder)
    assert recorded is not None
    rows = recorded.rows.rename(lambda name: name.removeprefix("vehicle_")).filter(
        ~col("id").str.starts_with("walker")
    )
    ahead = rows.sort("timestep_time", "lane", "pos").with_columns(
        leader=col("id").shift(-1).over("timestep_time", "lane"),
        gap=(col("pos").shift(-1) - LENGTH - col("pos")).over("timestep_time", "lane"),
        closing=(col("speed") - col("speed").shift(-1)).over("timestep_time", "lane"),
    )
    near = ahead.filter(col("closing") > 0).with_columns(ttc=col("gap") / col("closing"))
    least = near.group_by("id", "leader").agg(col("ttc").min()).filter(col("ttc") < SEEN_TTC)
    return {frozenset((one, other)): ttc for one, other, ttc in least.iter_rows()}


def test_time_to_collision_is_that_of_the_trajectories(whole: Path):
    conflicts = read_conflicts(whole)
    assert conflicts is not None
    told = {
        frozenset((one, other)): ttc
        for one, other, ttc in conflicts.filter(col("kind") == "following")
        .group_by("one", "other")
        .agg(col("ttc").min())
        .iter_rows()
        if ttc is not None and ttc < SEEN_TTC
    }
    seen = following(whole)
    both = told.keys() & seen.keys()
    assert len(both) >= 5
    assert len(both) >= 0.9 * len(seen)
    # The device looks ahead over junctions, too, so that it may have seen two even closer.
    assert all(told[pair] <= seen[pair] + 0.01 for pair in both)
    same = [pair for pair in both if told[pair] == pytest.approx(seen[pair], abs=0.01)]
    assert len(same) >= 0.8 * len(both)


@pytest.mark.slow
def test_a_run_in_slices_and_another_time_has_its_conflicts_as_well(
    long: SumoPreparedRun, whole: Path, tmp_path: Path
):
    sliced = watched(long)
    one, other = (run_prepared(sliced, tmp_path / name).folder for name in ("one", "other"))
    files = sorted(path.name for path in (one / "conflicts").iterdir())
    assert len(files) == 4
    assert all(
        (one / "conflicts" / name).read_bytes() == (other / "conflicts" / name).read_bytes()
        for name in files
    )
    found, in_one_piece = read_conflicts(one), read_conflicts(whole)
    assert found is not None
    assert in_one_piece is not None
    # The two runs differ after a reload, as SUMO's chance does; devices live on.
    assert found.height == pytest.approx(in_one_piece.height, rel=0.3)
    assert found["begin"].max() > 120.0
    parts = [pl.read_parquet(one / "conflicts" / name) for name in files]
    assert found.height < sum(part.height for part in parts)
    over = found.filter((col("begin") < 60.0) & (col("end") > 60.0))
    assert len(over) >= 1


def test_nothing_is_measured_that_was_not_asked_for(long: SumoPreparedRun, tmp_path: Path):
    one_piece = replace(long, plan=replace(long.plan, slice_length=None, until=20.0))
    result = run_prepared(one_piece, tmp_path / "run")
    assert read_conflicts(result.folder) is None
    assert "min_ttc" not in result.summary["figures"]
