from __future__ import annotations

import json
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import polars as pl
import pytest

from odscen.figures.judging.expectations import parse_expectation
from odscen.figures.measures.summary import actors_from_json
from odscen.records.run_events import EventKind, events_from_json
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.run_folder import SumoPreparedRun
from odscen.sumo.runner.run_jobs import run_prepared
from tests.reporters import EachProgress, Listener
from tests.sumo.conftest import BIN, Prepare

if TYPE_CHECKING:
    from odscen.runs.reporter import Progress

SAME_EVERYWHERE = (
    "trajectories.parquet",
    "events.json",
    "actors.json",
    "plan.json",
    "sumo/routes.rou.xml",
    "sumo/scenario.sumocfg",
)


@pytest.mark.slow
def test_a_run_inserts_everyone_in_place_and_everyone_arrives(
    prepare: Prepare, tmp_path: Path
) -> None:
    result = run_prepared(prepare(), tmp_path / "run")
    assert result.status == "completed"
    assert result.exit_code == 0
    actors = result.summary["actors"]
    assert actors == {
        "planned": 5, "inserted": 5, "arrived": 5, "running": 0, "waiting": 0, "stranded": 0,
        "teleported": 0, "collided": 0, "emergency_stopped": 0,
    }  # fmt: skip
    assert result.summary["insertion_error_max"] < 0.001
    assert 20 < result.summary["sim_seconds"] < 200


@pytest.mark.slow
def test_all_files_named_in_the_summary_are_there_and_the_parquet_reads(
    prepare: Prepare, tmp_path: Path
) -> None:
    result = run_prepared(prepare(), tmp_path / "run")
    files = result.to_dict()["files"]
    assert set(files) >= {"scenario", "net", "routes", "config", "trajectories", "events"}
    assert all(Path(file).is_file() for file in files.values())
    frame = pl.read_parquet(files["trajectories"])
    assert set(frame["vehicle_id"]) == {"car0", "car1", "car2", "car3", "walker"}
    assert frame["vehicle_x"].null_count() == 0
    on_disk = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert on_disk == result.summary


@pytest.mark.slow
def test_events_tell_departure_and_arrival_of_each_actor(prepare: Prepare, tmp_path: Path) -> None:
    run_prepared(prepare(), tmp_path / "run")
    events = events_from_json((tmp_path / "run" / "events.json").read_text())
    assert [e.time for e in events] == sorted(e.time for e in events)
    for name in ("car0", "car1", "car2", "car3", "walker"):
        mine = [e for e in events if e.actor == name]
        assert [e.kind for e in mine] == [EventKind.DEPARTED, EventKind.ARRIVED]
        assert mine[1].travel_time == mine[1].time - mine[0].time


@pytest.mark.slow
def test_the_same_plan_gives_the_same_bytes_in_two_folders(
    prepare: Prepare, tmp_path: Path
) -> None:
    first, second = tmp_path / "a", tmp_path / "somewhere" / "else"
    run_prepared(prepare(), first)
    run_prepared(prepare(), second)
    for name in SAME_EVERYWHERE:
        assert (first / name).read_bytes() == (second / name).read_bytes(), name


@pytest.mark.slow
def test_plain_sumo_on_the_same_files_records_the_same_trajectories(
    prepare: Prepare, tmp_path: Path
) -> None:
    run_prepared(prepare(), tmp_path / "run")
    plain = subprocess.run(
        [BIN / "sumo", "-c", "sumo/scenario.sumocfg"],
        cwd=tmp_path / "run",
        capture_output=True,
        text=True,
        check=True,
    )
    assert "rror" not in plain.stderr
    ours = (tmp_path / "run" / "trajectories.parquet").read_bytes()
    assert (tmp_path / "run" / "sumo" / "trajectories.parquet").read_bytes() == ours


@pytest.mark.slow
def test_plain_sumo_stops_at_the_same_end_as_we_do(prepare: Prepare, tmp_path: Path) -> None:
    result = run_prepared(prepare(until=10.0), tmp_path / "run")
    assert result.summary["sim_seconds"] == 10.0
    assert result.summary["actors"]["running"] == 5
    subprocess.run(
        [BIN / "sumo", "-c", "sumo/scenario.sumocfg"], cwd=tmp_path / "run", check=True,
        capture_output=True,
    )  # fmt: skip
    ours = (tmp_path / "run" / "trajectories.parquet").read_bytes()
    assert (tmp_path / "run" / "sumo" / "trajectories.parquet").read_bytes() == ours


@pytest.mark.slow
def test_what_sumo_refuses_is_a_failed_run_in_sumos_own_words(
    prepare: Prepare, tmp_path: Path
) -> None:
    routes = (
        '<routes><vehicle id="car0" depart="0"><route edges="A0B0 nowhere"/></vehicle></routes>'
    )
    result = run_prepared(prepare(cars=1, walker=False, routes=routes), tmp_path / "run")
    assert result.status == "failed"
    assert result.exit_code == 3
    assert "The edge 'nowhere'" in result.summary["error"]
    assert result.summary["actors"]["planned"] == 1
    assert result.summary["actors"]["inserted"] is None
    assert (tmp_path / "run" / "sumo.log").is_file()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("net", "reason"), [("hello", "invalid document structure"), ("<net></net>", "SIGSEGV")]
)
def test_a_network_that_sumo_cannot_read_or_crashes_on_is_a_failed_run(
    prepare: Prepare, tmp_path: Path, net: str, reason: str
) -> None:
    good = prepare()
    bad_net = tmp_path / "bad.net.xml"
    bad_net.write_text(net)
    bad = SumoPreparedRun(plan=good.plan, sumo_files=good.sumo_files, net=bad_net)
    result = run_prepared(bad, tmp_path / "run")
    assert result.status == "failed"
    assert reason in result.summary["error"]
    assert result.exit_code == 3


@pytest.mark.slow
def test_a_run_over_its_time_limit_is_stopped_and_has_failed(
    prepare: Prepare, tmp_path: Path
) -> None:
    hurried = replace(prepare(), settings=RunSettings(time_limit=0.001))
    result = run_prepared(hurried, tmp_path / "run")
    assert result.status == "failed"
    assert "time limit of 0.001 s" in result.summary["error"]
    assert "trajectories" not in result.summary["files"]


@pytest.mark.slow
def test_an_interrupted_run_leaves_no_folder(prepare: Prepare, tmp_path: Path) -> None:
    def interrupt(_progress: Progress) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_prepared(prepare(), tmp_path / "runs" / "run", reporter=EachProgress(interrupt))
    assert list(tmp_path.iterdir()) == []


def test_progress_is_told_and_never_runs_backwards(prepare: Prepare, tmp_path: Path) -> None:
    listener = Listener()
    run_prepared(prepare(), tmp_path / "run", reporter=listener)
    seen = listener.progress
    assert seen
    assert [p.time for p in seen] == sorted(p.time for p in seen)
    assert all(0 <= p.share <= 1 and p.planned == 5 for p in seen)


@pytest.mark.slow
def test_expectations_are_judged_and_decide_the_exit_code(prepare: Prepare, tmp_path: Path) -> None:
    wanted = parse_expectation("arrived>=0.95"), parse_expectation("sim_seconds<5")
    judged = replace(prepare(), settings=RunSettings(expectations=wanted))
    result = run_prepared(judged, tmp_path / "run")
    assert [v["passed"] for v in result.summary["expectations"]] == [True, False]
    assert result.exit_code == 1


@pytest.mark.slow
def test_finish_adds_files_before_the_folder_appears(prepare: Prepare, tmp_path: Path) -> None:
    def finish(folder: Path, summary: object) -> None:
        assert not (tmp_path / "run").exists()
        assert isinstance(summary, dict)
        (folder / "report.html").write_text("<html></html>")

    result = run_prepared(prepare(), tmp_path / "run", finish=finish)
    assert result.summary["files"]["report"] == "report.html"


@pytest.mark.slow
def test_outcomes_in_actors_json_have_the_figures_of_the_plan(
    prepare: Prepare, tmp_path: Path
) -> None:
    run_prepared(prepare(), tmp_path / "run")
    actors = actors_from_json((tmp_path / "run" / "actors.json").read_text())
    first = actors[0]
    assert (first.id, first.ego, first.status, first.depart_delay) == ("car0", True, "arrived", 0.0)
    assert first.travel_time is not None
    assert first.delay is not None
    assert 0.0 < first.delay < first.travel_time
    assert first.waiting_time == first.stops == 0
    assert first.mean_speed == pytest.approx(290.0 / first.travel_time, abs=1e-5)
