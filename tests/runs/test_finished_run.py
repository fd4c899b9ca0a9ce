from __future__ import annotations

import json
from pathlib import Path

import polars as pl
import pytest

from odscen.app.running.runs import run
from odscen.base.errors import InputError, NotFoundError
from odscen.figures.judging.expectations import parse_expectation
from odscen.maps.store import Workspace
from odscen.runs.finished_run import Run
from odscen.runs.recording import Recording
from odscen.runs.run_settings import RunSettings

ROOT = Path(__file__).parents[2]
SCENARIO = ROOT / "suites" / "scenarios" / "signal_crossing.scenario.json"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    store = Workspace.open(tmp_path_factory.mktemp("workspace"))
    store.add_map(ROOT / "maps" / "signal_crossing.xodr")
    return store


@pytest.fixture(scope="module")
def finished(workspace: Workspace) -> Run:
    expectations = (parse_expectation("arrived >= 1"), parse_expectation("mean_delay < 0 s"))
    settings = RunSettings(until=60.0, expectations=expectations)
    return run(workspace, SCENARIO, settings=settings)


@pytest.mark.slow
def test_a_run_that_is_opened_again_is_the_same(finished: Run) -> None:
    again = Run.open(finished.folder)
    assert again.summary == json.loads(json.dumps(finished.summary))
    assert (again.status, again.expectations_met, again.exit_code) == ("completed", False, 1)
    assert again.report == finished.folder / "report.html"


def test_figures_and_counts_are_those_of_the_summary(finished: Run) -> None:
    assert finished.figures == finished.summary["figures"]
    assert finished.counts["planned"] == finished.actors().height


def test_one_figure_is_a_number_or_says_why_there_is_none(finished: Run) -> None:
    assert finished.figure("mean_delay") == finished.figures["mean_delay"]
    assert finished.figure("planned") == finished.counts["planned"]
    assert finished.figure("sim_seconds") == finished.summary["sim_seconds"]
    with pytest.raises(NotFoundError, match=r"no figure named 'mean_dealy'; did you mean mean_del"):
        finished.figure("mean_dealy")
    with pytest.raises(InputError, match="the run has no min_ttc"):
        finished.figure("min_ttc")
    assert repr(finished).startswith("<Run of signal_crossing, seed ")


def test_actors_agree_with_counts_and_events(finished: Run) -> None:
    actors, events = finished.actors(), finished.events()
    arrived = actors.filter(pl.col("status") == "arrived")
    assert arrived.height == finished.counts["arrived"] > 0
    told = events.filter(pl.col("kind") == "arrived")
    assert sorted(told["actor"]) == sorted(arrived["id"])
    assert events["time"].is_sorted()
    vehicles = arrived.filter(pl.col("category") != "pedestrian")
    mean = vehicles["travel_time"].mean()
    assert mean == pytest.approx(finished.figures["mean_travel_time"], abs=1e-3)


def test_tables_have_their_types_whatever_is_null(finished: Run) -> None:
    actors = finished.actors()
    assert actors["problem"].null_count() == actors.height
    assert actors.schema["problem"] == pl.String
    assert actors.schema["teleports"] == pl.Int64
    assert finished.events().schema["waited"] == pl.Float64


def test_trajectories_begin_where_the_plan_has_the_body_centres(finished: Run) -> None:
    plan = json.loads((finished.folder / "plan.json").read_text())["actors"]
    rows = finished.trajectories()
    assert rows.columns[:7] == ["time", "id", "category", "x", "y", "hdg", "speed"]
    vehicles = [one for one in plan if one["category"] != "pedestrian" and one["depart"] == 0]
    assert len(vehicles) > 5
    start = {row["id"]: row for row in rows.filter(pl.col("time") == 0.0).to_dicts()}
    for one in vehicles:
        if one["id"] in start:
            row = start[one["id"]]
            assert row["category"] == one["category"]
            assert (row["x"], row["y"]) == pytest.approx((one["x"], one["y"]), abs=0.1)
            assert row["hdg"] == pytest.approx(one["hdg"], abs=0.05) or abs(row["hdg"]) > 3.09


def test_places_of_the_whole_run_and_over_time_are_of_the_same_traffic(finished: Run) -> None:
    whole = finished.figures_by("junction")
    over = finished.figures_by("junction", over_time=True)
    assert whole["junction"].to_list() == ["j10001"]
    assert over["distance"].sum() == pytest.approx(whole["distance"].sum(), rel=1e-4)
    assert finished.figures_by("segment").height >= 4
    assert "movement" in finished.figures_by("movement").columns
    assert finished.figures_by("network").height == 1


def test_lanes_of_trajectories_lie_in_places(finished: Run) -> None:
    ways = finished.lane_places().ways.select("lane", "junction").unique()
    joined = finished.trajectories().join(ways, on="lane", how="inner")
    assert joined["junction"].unique().to_list() == ["j10001"]


@pytest.mark.slow
def test_what_is_not_there_is_named(finished: Run, workspace: Workspace, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no finished run here"):
        Run.open(tmp_path)
    with pytest.raises(NotFoundError, match="did you mean junction"):
        finished.figures_by("junctions")  # type: ignore[arg-type]
    settings = RunSettings(until=5.0, recording=Recording(trajectories=False))
    bare = run(workspace, SCENARIO, settings=settings, name="bare", out=tmp_path)
    with pytest.raises(InputError, match="no trajectories"):
        bare.trajectories()
