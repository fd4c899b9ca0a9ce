from __future__ import annotations

import json
import os
import re
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from typer.testing import CliRunner

from bench.kills import traffic
from odscen.app.running.runs import check_file, prepare_run
from odscen.base.errors import (
    ConflictError,
    DamagedError,
    InputError,
    NotFoundError,
    SimulationError,
    WorkspaceError,
)
from odscen.cli.commands import command_line
from odscen.figures.judging.expectations import parse_expectation
from odscen.figures.measures.summary import actors_from_json
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.maps.store import Workspace
from odscen.records.run_events import EventKind, events_from_json
from odscen.runs import checkpoint, layout, run_status
from odscen.runs.layout import RECORDED
from odscen.runs.new_run import run_lock
from odscen.runs.parts import check_room
from odscen.runs.recorded import read_trajectories, recorded_files, trajectory_files
from odscen.runs.reporter import Progress
from odscen.runs.run_settings import RunSettings
from odscen.runs.run_sums import seal_start
from odscen.sumo.runner import forecast, forked_worker
from odscen.sumo.runner.allocator import fast_allocator
from odscen.sumo.runner.live_run import Live
from odscen.sumo.runner.long_runs import resume
from odscen.sumo.runner.run_folder import SumoPreparedRun
from odscen.sumo.runner.run_jobs import run_prepared
from odscen.sumo.worker.protocol import Command, Pace
from tests.reporters import EachProgress, Listener
from tests.sumo.conftest import SLICE, TYPES, UNTIL, start_killed_workers

TOWN = Path(__file__).parents[3] / "maps" / "town_5x5.xodr"
TOWN_SLICE, TOWN_SLICES = 120.0, 3


@pytest.fixture(scope="module")
def whole(long: SumoPreparedRun, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Results of the run that nobody interrupts, by file."""
    result = run_prepared(long, tmp_path_factory.mktemp("whole") / "run")
    assert result.status == "completed"
    return results(result.folder)


def results(run: Path) -> dict[str, bytes]:
    recorded = [file for name in RECORDED for file in recorded_files(run, name)]
    files = [run / "actors.json", run / "events.json", *recorded]
    return {str(file.relative_to(run)): file.read_bytes() for file in files}


def killed(
    long: SumoPreparedRun, run: Path, monkeypatch: pytest.MonkeyPatch, **environment: int
) -> str:
    """Run, interrupted by ``killed_worker``; what the runner says of it."""
    with monkeypatch.context() as patch:
        start_killed_workers(patch)
        for name, value in environment.items():
            patch.setenv(name, str(value))
        result = run_prepared(long, run)
    return str(result.summary["error"]) if result.status == "failed" else ""


@pytest.mark.slow
def test_a_long_run_inserts_everybody_and_leaves_a_folder_like_any_other(
    long: SumoPreparedRun, tmp_path: Path
) -> None:
    settings = RunSettings(expectations=(parse_expectation("inserted==90"),))
    result = run_prepared(replace(long, settings=settings), tmp_path / "run")
    assert result.exit_code == 0
    assert result.summary["actors"]["arrived"] + result.summary["actors"]["running"] == 90
    assert [one["time"] for one in result.summary["slices"]["done"]][:2] == [60.0, 120.0]
    left = {path.name for path in result.folder.iterdir()}
    assert left == {
        "SHA256SUMS", "actors.json", "events.json", "figures", "lanes", "plan.json",
        "scenario.json", "summary.json", "sumo", "sumo.log", "trajectories", "trips",
    }  # fmt: skip
    assert all(path.exists() for path in map(Path, result.to_dict()["files"].values()))


@pytest.mark.slow
def test_the_parts_read_as_one_table_without_a_gap_or_a_row_twice(
    long: SumoPreparedRun, tmp_path: Path
) -> None:
    run_prepared(long, tmp_path / "run")
    files = trajectory_files(tmp_path / "run")
    assert len(files) == 4
    table = pl.read_parquet(tmp_path / "run" / "trajectories" / "*.parquet")
    assert table.select("timestep_time", "vehicle_id").is_duplicated().sum() == 0
    steps = table.sort("vehicle_id", "timestep_time").select(
        pl.col("timestep_time").diff().over("vehicle_id").alias("pause")
    )
    assert set(steps["pause"].drop_nulls()) == {0.5}
    outcomes = actors_from_json((tmp_path / "run" / "actors.json").read_text())
    assert {one.id for one in outcomes} == set(table["vehicle_id"])


@pytest.mark.slow
def test_a_table_with_too_many_rows_is_read_with_every_nth_record(
    long: SumoPreparedRun, tmp_path: Path
) -> None:
    run_prepared(long, tmp_path / "run")
    everything = read_trajectories(tmp_path / "run")
    some = read_trajectories(tmp_path / "run", most=1000)
    assert everything is not None
    assert some is not None
    assert everything.every == 1
    assert some.every == -(-everything.rows.height // 1000)
    times = sorted(set(everything.rows["timestep_time"]))
    assert sorted(set(some.rows["timestep_time"])) == times[:: some.every]


KILLS = [
    *(("KILL_AT", change) for change in (3, 6, 9, 13)),
    *(("KILL_BOTH_AT", change) for change in (1, 7, 14, 20, 33, 47, 55, 58)),
]
"""The worker makes 14 changes, the process that completes slices 59."""


@pytest.mark.slow
@pytest.mark.parametrize(("who", "change"), KILLS)
def test_killed_before_any_change_of_its_files_a_resumed_run_ends_with_the_same_bytes(
    long: SumoPreparedRun,
    whole: dict[str, bytes],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    who: str,
    change: int,
) -> None:
    run = tmp_path / "run"
    error = killed(long, run, monkeypatch, **{who: change})
    assert "SIGKILL" in error
    assert f"odscen resume {run}" in error
    before = {file.name: file.read_bytes() for file in trajectory_files(run)}
    listener = Listener()
    result = resume(run, reporter=listener)
    assert result.status == "completed"
    assert results(run) == whole
    assert all(whole[f"trajectories/{name}"] == content for name, content in before.items())
    assert len(listener.words) == 1


@pytest.mark.slow
def test_a_town_resumed_after_any_slice_ends_with_the_bytes_of_the_run_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Inside a junction SUMO decides by the order of addresses in memory who yields to whom."""
    workspace = Workspace.open(tmp_path / "workspace")
    name = workspace.add_map(TOWN).name
    file = traffic(workspace, name, hours=TOWN_SLICES * TOWN_SLICE / 3600.0)
    settings = RunSettings(slice_length=TOWN_SLICE)
    town = prepare_run(check_file(workspace, file, settings=settings))
    alone = results(run_prepared(town, tmp_path / "alone").folder)
    assert sum(name.startswith("trajectories") for name in alone) == TOWN_SLICES
    for after in range(1, TOWN_SLICES):
        run = tmp_path / f"after{after}"
        killed(town, run, monkeypatch, KILL_AFTER_SLICE=after)
        assert checkpoint.last_number(run) == after
        resume(run)
        assert results(run) == alone


@pytest.mark.slow
@pytest.mark.parametrize("change", [8, 40, 59])
def test_a_run_of_which_only_the_completing_process_is_killed_says_so_and_resumes(
    long: SumoPreparedRun,
    whole: dict[str, bytes],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    change: int,
) -> None:
    run = tmp_path / "run"
    error = killed(long, run, monkeypatch, KILL_COMPLETER_AT=change)
    assert "the process that completes what was recorded has ended with exit code -9" in error
    assert f"odscen resume {run}" in error
    resume(run)
    assert results(run) == whole


@pytest.mark.slow
def test_slices_whose_processes_cannot_be_forked_are_the_same_bytes(
    long: SumoPreparedRun, whole: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = tmp_path / "run"
    assert killed(long, run, monkeypatch, SLICES_BY_EXEC=1) == ""
    assert results(run) == whole


@pytest.mark.slow
def test_slices_below_the_process_that_forks_for_all_runs_are_the_same_bytes(
    long: SumoPreparedRun, whole: dict[str, bytes], tmp_path: Path
) -> None:
    forked_worker.get_ready()
    try:
        assert forked_worker.is_ready()
        assert run_prepared(long, tmp_path / "run").status == "completed"
    finally:
        forked_worker._end_server()
    assert results(tmp_path / "run") == whole


@pytest.mark.slow
def test_a_slice_whose_parent_is_killed_ends_and_the_run_resumes(
    long: SumoPreparedRun, whole: dict[str, bytes], tmp_path: Path
) -> None:
    """Killed as the system does when memory runs out: one process, without a word."""
    run = tmp_path / "run"
    killed_at: list[int] = []

    def kill(_: Progress) -> None:
        # On a busy machine a first message may be read between two looks into /proc.
        if not killed_at and (hosts := children(os.getpid(), "odscen.sumo.worker.simulate")):
            killed_at.extend(hosts)
            os.kill(hosts[0], signal.SIGKILL)

    result = run_prepared(long, run, reporter=EachProgress(kill))
    assert len(killed_at) == 1
    assert "ended by signal SIGKILL" in str(result.summary["error"])
    assert not children(None, str(run))
    resume(run)
    assert results(run) == whole


def children(parent: int | None, words: str) -> list[int]:
    """Processes with such words in their command, of a parent or of any."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            command = (folder / "cmdline").read_text(encoding="utf-8")
            above = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
        if words in command and parent in (None, above):
            found.append(int(folder.name))
    return found


@pytest.mark.slow
def test_what_was_written_is_completed_when_the_simulation_crashes(
    long: SumoPreparedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed when the third slice has been simulated; the second may not be complete then."""
    run = tmp_path / "run"
    killed(long, run, monkeypatch, KILL_AT=11)
    assert checkpoint.last_number(run) == 2


@pytest.mark.slow
def test_a_damaged_last_slice_is_named_and_the_one_before_is_gone_on_from(
    long: SumoPreparedRun, whole: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = tmp_path / "run"
    killed(long, run, monkeypatch, KILL_AFTER_SLICE=2)
    last = checkpoint.last_number(run)
    assert last == 2
    state = checkpoint.slice_folder(run, last) / checkpoint.STATE_FILE
    content = bytearray(state.read_bytes())
    content[len(content) // 2] ^= 0xFF
    state.write_bytes(content)
    listener = Listener()
    resume(run, reporter=listener)
    assert listener.words[0].startswith(
        f"slice {last} is damaged: slices/000{last}/state.xml.gz: expected sha256 "
    )
    assert listener.words[1] == f"resumes at {(last - 1) * SLICE:g} s, after slice {last - 1}"
    assert results(run) == whole


@pytest.mark.slow
def test_a_full_disk_ends_in_a_clear_message_and_a_run_that_resumes(
    long: SumoPreparedRun, whole: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sizes = {name: len(content) for name, content in whole.items() if "part" in name}
    assert sizes["trajectories/part-0001.parquet"] < sizes["trajectories/part-0002.parquet"]
    run = tmp_path / "run"
    limit = sizes["trajectories/part-0002.parquet"] - 1000
    error = killed(long, run, monkeypatch, FILE_LIMIT=limit)
    assert f"odscen resume {run}" in error
    assert "What happened up to 60 s is kept" in error
    assert list(map(str, trajectory_files(run))) == [str(run / "trajectories/part-0001.parquet")]
    resume(run)
    assert results(run) == whole


@pytest.mark.slow
def test_too_little_memory_is_named_with_what_to_do_and_the_run_resumes(
    long: SumoPreparedRun, whole: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The simulation gets 20 MB, less than SUMO needs; with glibc's allocator it says so."""
    run = tmp_path / "run"
    monkeypatch.setenv("LD_PRELOAD", "")
    error = killed(long, run, monkeypatch, MEMORY_LEFT=20_000_000)
    assert error.startswith("the memory is used up; end other programs, or run less at a time")
    resume(run)
    assert results(run) == whole


@pytest.mark.slow
@pytest.mark.parametrize("change", [1, 5, 9])
def test_killed_while_it_is_resumed_a_run_still_ends_with_the_same_bytes(
    long: SumoPreparedRun,
    whole: dict[str, bytes],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    change: int,
) -> None:
    run = tmp_path / "run"
    killed(long, run, monkeypatch, KILL_AT=6)
    with monkeypatch.context() as patch:
        start_killed_workers(patch)
        patch.setenv("KILL_BOTH_AT", str(change))
        assert resume(run).status == "failed"
    assert resume(run).status == "completed"
    assert results(run) == whole


def test_a_disk_without_room_for_another_slice_stops_the_run_before_anything_is_torn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = checkpoint.slice_folder(tmp_path, 4)
    folder.mkdir(parents=True)
    (folder / checkpoint.STATE_FILE).write_bytes(bytes(2_000_000))
    part = checkpoint.recorded_part(tmp_path, layout.LANES_FILE, 4)
    part.parent.mkdir()
    part.write_bytes(bytes(4_000_000))
    usage = shutil.disk_usage(tmp_path)
    for free, room in ((9_000_000, True), (8_999_999, False)):
        monkeypatch.setattr(shutil, "disk_usage", lambda _, free=free: usage._replace(free=free))
        if room:
            check_room(tmp_path, 4)
        else:
            with pytest.raises(SimulationError, match="slice 5 needs about 9 MB, 9 MB are free"):
                check_room(tmp_path, 4)


@pytest.mark.slow
def test_a_run_that_goes_on_is_neither_resumed_nor_replaced(
    long: SumoPreparedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = tmp_path / "run"
    killed(long, run, monkeypatch, KILL_AT=9)
    assert run_status.going(run) == "interrupted"
    with run_lock(run):
        assert run_status.going(run) == "running"
        with pytest.raises(ConflictError, match=rf"process {os.getpid()} since 20..-"):
            resume(run)
    with pytest.raises(ConflictError, match=r"odscen resume .*run resumes it"):
        run_prepared(long, run)
    resume(run)
    assert run_status.going(run) is None
    with pytest.raises(ConflictError, match="has ended"):
        resume(run)
    with pytest.raises(NotFoundError, match="interrupted run"):
        resume(tmp_path)


def test_a_run_that_the_disk_cannot_hold_is_refused_before_it_starts(
    long: SumoPreparedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = forecast.forecast(long.plan, long.sumo_files, every=None)
    monkeypatch.setattr(
        forecast.shutil, "disk_usage", lambda _path: shutil._ntuple_diskusage(1, 1, 1000)
    )
    with pytest.raises(WorkspaceError, match=r"of disk, .* are free; record less"):
        run_prepared(replace(long, expected=expected), tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_the_forecast_holds_for_a_run_like_this(long: SumoPreparedRun, tmp_path: Path) -> None:
    expected = forecast.forecast(long.plan, long.sumo_files, every=None)
    result = run_prepared(long, tmp_path / "run")
    held = max(one["memory_mb"] for one in result.summary["slices"]["done"])
    assert 50e6 < held * 1e6 < expected.memory < 1e9
    sizes = sum(file.stat().st_size for file in trajectory_files(tmp_path / "run"))
    assert sizes < expected.disk < 20 * sizes
    fewer = forecast.forecast(long.plan, long.sumo_files, every=10.0)
    assert fewer.disk < expected.disk
    assert 10 < expected.running < 90


@pytest.mark.slow
def test_watching_goes_on_across_slices_and_changes_nothing(
    long: SumoPreparedRun, whole: dict[str, bytes], tmp_path: Path
) -> None:
    live = Live(Pace())
    times: list[float] = []

    def look() -> None:
        if live.picture.number > len(times):
            times.append(float(np.frombuffer(live.picture.frame, "<f4")[1]))
        live.ask_frame()

    live.add_watcher(look)
    live.ask_frame()
    result = run_prepared(long, tmp_path / "run", live=live)
    assert result.status == "completed"
    assert {int(time // SLICE) for time in times} == {0, 1, 2, 3}
    assert results(tmp_path / "run") == whole


@pytest.mark.slow
def test_a_long_run_that_somebody_stops_keeps_what_has_happened(
    long: SumoPreparedRun, tmp_path: Path
) -> None:
    live = Live(Pace())

    def stop(message: Progress) -> None:
        if message.time > SLICE + 10.0:
            live.command(Command("stop"))

    live.command(Command("speed", 100.0))
    result = run_prepared(long, tmp_path / "run", live=live, reporter=EachProgress(stop))
    assert result.status == "completed"
    assert result.summary["stopped"]
    end = result.summary["sim_seconds"]
    assert SLICE + 10.0 < end < UNTIL
    table = pl.read_parquet(trajectory_files(tmp_path / "run"))
    assert table["timestep_time"].max() == end - 0.5
    assert run_status.going(tmp_path / "run") is None


@pytest.mark.slow
def test_whoever_waits_for_room_at_a_boundary_is_not_lost(
    long: SumoPreparedRun, tmp_path: Path
) -> None:
    """The number of vehicles in the queue is more than can start before the boundary."""
    cars = "".join(
        f'<vehicle id="queue{i}" type="car" depart="55" departLane="1">'
        '<route edges="A0B0 B0C0"/></vehicle>\n'
        for i in range(20)
    )
    plan = replace(
        long.plan, actors=tuple(replace(long.plan.actors[0], id=f"queue{i}") for i in range(20))
    )
    files = {**long.sumo_files, "routes.rou.xml": f"<routes>\n{TYPES}\n{cars}</routes>\n"}
    result = run_prepared(replace(long, plan=plan, sumo_files=files), tmp_path / "run")
    assert result.summary["actors"]["inserted"] == 20
    events = events_from_json((tmp_path / "run" / "events.json").read_text())
    late = [event for event in events if event.kind is EventKind.DEPARTED and event.time >= SLICE]
    assert late
    assert not [event for event in events if event.kind is EventKind.LOST]


@pytest.mark.slow
def test_whoever_does_not_come_back_with_a_saved_state_is_told(
    long: SumoPreparedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """SUMO is made to forget a car; the run is resumed in a worker that is told so."""
    run = tmp_path / "run"
    killed(long, run, monkeypatch, KILL_AFTER_SLICE=1)
    assert checkpoint.last_number(run) == 1
    on_road = checkpoint.read_checkpoint(run, 1).present
    car = next(name for name in on_road if name.startswith("car"))
    config = run / "sumo" / "scenario.sumocfg"
    forget = f'<processing>\n<load-state.remove-vehicles value="{car}"/>'
    config.write_text(config.read_text().replace("<processing>", forget))
    seal_start(run)
    resume(run)
    events = events_from_json((run / "events.json").read_text())
    lost = [event for event in events if event.kind is EventKind.LOST]
    assert [(event.actor, event.time) for event in lost] == [(car, SLICE)]


@pytest.mark.slow
@pytest.mark.skipif(fast_allocator() is None, reason="there is no faster allocator here")
def test_the_allocator_makes_no_difference_to_results(
    long: SumoPreparedRun, whole: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LD_PRELOAD", "")
    run_prepared(long, tmp_path / "run")
    assert results(tmp_path / "run") == whole


@pytest.mark.slow
def test_whatever_of_its_start_is_changed_deleted_or_added_an_interrupted_run_is_not_resumed(
    long: SumoPreparedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = tmp_path / "run"
    killed(long, run, monkeypatch, KILL_AFTER_SLICE=1)
    started = [*run.glob("sumo/*"), run / layout.PLAN_FILE, run / layout.SETTINGS_FILE]
    assert {"net.net.xml", "routes.rou.xml", "scenario.sumocfg"} <= {one.name for one in started}
    for file in started:
        content = file.read_bytes()
        for changed in (content[:-2] + b" " + content[-1:], content + b" ", None):
            file.unlink() if changed is None else file.write_bytes(changed)
            with pytest.raises(DamagedError, match=re.escape(file.name)):
                resume(run)
        file.write_bytes(content)
    for name in ("closures.add.xml", "stops.add.xml", "behaviour.json"):
        (run / "sumo" / name).write_text("{}", encoding="utf-8")
        with pytest.raises(DamagedError, match=name):
            resume(run)
        (run / "sumo" / name).unlink()
    assert resume(run).status == "completed"


@pytest.mark.slow
def test_a_run_that_a_socket_drives_is_named_again_by_its_socket(
    long: SumoPreparedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = tmp_path / "run"
    killed(long, run, monkeypatch, KILL_AFTER_SLICE=1)
    door = json.dumps({"socket": str(tmp_path / "driver")})
    (run / "sumo" / "behaviour.json").write_text(door, encoding="utf-8")
    seal_start(run)
    with pytest.raises(InputError, match=r"--behaviour-socket '.*driver'"):
        resume(run)
    with pytest.raises(InputError, match="not what drives this run"):
        resume(run, behaviour=BehaviourDoor(socket=str(tmp_path / "other")))
    again = CliRunner().invoke(
        command_line(["resume"]), ["resume", str(run), "--behaviour-socket", f"{tmp_path}/other"]
    )
    assert "not what drives this run" in str(again.exception)


@pytest.mark.slow
@pytest.mark.parametrize("stored", ["command", "name"])
def test_code_that_only_the_folder_names_is_not_executed(
    long: SumoPreparedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stored: str
) -> None:
    """Not even where whoever wrote it has written the checksums, too."""
    run, mark = tmp_path / "run", tmp_path / "executed"
    killed(long, run, monkeypatch, KILL_AFTER_SLICE=1)
    source = f"from pathlib import Path\nPath({str(mark)!r}).touch()\nModel = 1\n"
    (tmp_path / "model.py").write_text(source, encoding="utf-8")
    door = (
        {"command": f"touch {mark}"}
        if stored == "command"
        else {"name": f"{tmp_path}/model.py:Model"}
    )
    (run / "sumo" / "behaviour.json").write_text(json.dumps(door), encoding="utf-8")
    seal_start(run)
    with pytest.raises(InputError, match="name it again"):
        resume(run)
    with pytest.raises(InputError, match="not what drives this run"):
        resume(run, behaviour=BehaviourDoor(name="idm"))
    assert not mark.exists()
