from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import psutil
import pytest

from odscen.runs import layout
from odscen.runs.reporter import Progress
from odscen.sumo.runner import forked_worker, worker_process
from odscen.sumo.runner.run_jobs import left_results, run_prepared
from odscen.sumo.runner.worker_process import run_worker
from odscen.sumo.worker.protocol import Left
from tests.reporters import EachProgress
from tests.sumo.conftest import Prepare

pytestmark = pytest.mark.skipif(
    not forked_worker.POSSIBLE, reason="processes are forked on Linux only"
)

RECORDS = (layout.TRAJECTORIES_FILE, layout.TRIPS_FILE, layout.EVENTS_FILE, layout.ACTORS_FILE)


def made(prepare: Prepare, folder: Path, *, forked: bool) -> dict[str, bytes]:
    """Records of a run whose process was forked, or started."""
    folder.mkdir()
    prepare().write(folder)
    ended = run_worker(folder, forked=forked)
    assert ended.error is None
    return {name: (folder / name).read_bytes() for name in RECORDS}


def server_pid() -> int:
    """Number of the process that forks."""
    server = forked_worker._server
    assert server is not None
    return server._process.pid


@pytest.mark.slow
def test_a_forked_process_records_the_bytes_of_one_that_was_started(
    prepare: Prepare, tmp_path: Path
) -> None:
    fresh = made(prepare, tmp_path / "fresh", forked=False)
    assert made(prepare, tmp_path / "first", forked=True) == fresh
    assert made(prepare, tmp_path / "second", forked=True) == fresh


@pytest.mark.slow
def test_results_that_are_left_to_us_are_those_that_the_process_makes(
    prepare: Prepare, tmp_path: Path
) -> None:
    fresh = made(prepare, tmp_path / "fresh", forked=True)
    folder = tmp_path / "raw"
    folder.mkdir()
    prepare().write(folder)
    asked = []

    def results(left: Left) -> None:
        asked.append((folder / layout.TRIPINFO_FILE).is_file())
        assert not (folder / layout.EVENTS_FILE).exists()
        left_results(folder, left)

    assert run_worker(folder, forked=True, results=results).error is None
    assert asked == [True]
    assert {name: (folder / name).read_bytes() for name in RECORDS} == fresh


@pytest.mark.slow
def test_records_that_results_cannot_be_made_of_fail_their_run(
    prepare: Prepare, tmp_path: Path
) -> None:
    prepare().write(tmp_path)

    def torn(left: Left) -> None:
        (tmp_path / layout.TRIPINFO_FILE).write_text("<tripinfos><tripinfo", encoding="utf-8")
        left_results(tmp_path, left)

    ended = run_worker(tmp_path, forked=True, results=torn)
    assert ended.sim_seconds is None
    assert ended.error is not None
    assert ended.error.startswith("SUMO has not written")


@pytest.mark.slow
def test_a_crash_of_sumo_ends_one_run_and_leaves_the_next_alone(
    prepare: Prepare, tmp_path: Path
) -> None:
    good = made(prepare, tmp_path / "good", forked=True)
    before = server_pid()
    broken = tmp_path / "broken"
    broken.mkdir()
    prepare().write(broken)
    net = broken / layout.SUMO_FOLDER / layout.NET_FILE
    net.unlink()
    net.write_text("<net></net>", encoding="utf-8")
    ended = run_worker(broken, forked=True)
    assert ended.sim_seconds is None
    assert ended.error is not None
    assert "SIGSEGV" in ended.error
    assert made(prepare, tmp_path / "after", forked=True) == good
    assert server_pid() == before


def test_a_worker_that_hangs_when_its_run_is_called_off_is_killed(
    prepare: Prepare, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker_process, "SILENT_FOR", 0.5)
    prepare().write(tmp_path)
    stopped: list[psutil.Process] = []

    def stop_worker() -> bool:
        for child in psutil.Process().children() if not stopped else ():
            with suppress(psutil.Error):  # others have ended
                if worker_process.WORKER in child.cmdline():
                    child.suspend()
                    stopped.append(child)
        return bool(stopped)

    class CalledOffError(Exception):
        pass

    def progress(_: Progress) -> None:
        raise CalledOffError

    with pytest.raises(CalledOffError):
        run_worker(tmp_path, progress=progress, called_off=stop_worker)
    assert not stopped[0].is_running()


@pytest.mark.slow
def test_a_server_that_was_killed_is_replaced(prepare: Prepare, tmp_path: Path) -> None:
    good = made(prepare, tmp_path / "good", forked=True)
    before = server_pid()
    os.kill(before, signal.SIGKILL)
    assert made(prepare, tmp_path / "after", forked=True) == good
    assert server_pid() != before


@pytest.mark.slow
def test_a_server_that_dies_during_a_run_costs_nothing(prepare: Prepare, tmp_path: Path) -> None:
    killed = []

    def kill(_progress: object) -> None:
        if not killed:
            killed.append(server_pid())
            os.kill(killed[0], signal.SIGKILL)

    result = run_prepared(prepare(), tmp_path / "run", reporter=EachProgress(kill))
    assert killed
    assert result.status == "completed"


@pytest.mark.slow
def test_another_environment_has_a_server_of_its_own(
    prepare: Prepare, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made(prepare, tmp_path / "good", forked=True)
    before = server_pid()
    monkeypatch.setenv("ODSCEN_TEST_OTHER", "1")
    made(prepare, tmp_path / "after", forked=True)
    assert server_pid() != before


def test_what_is_forked_brings_neither_tables_nor_numpy_along() -> None:
    code = (
        "import sys; from odscen.sumo.worker import warm_imports as w; w.import_all();"
        "print(*(name in sys.modules for name in ('polars', 'numpy', 'sumolib.net', 'libsumo')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False", "False", "True"]


@pytest.mark.slow
def test_what_polars_sets_for_itself_does_not_start_another_server() -> None:
    code = (
        "from odscen.sumo.runner import forked_worker as f; f.get_ready();"
        "before = f._server._process.pid; import os, polars; f.get_ready();"
        "print(before == f._server._process.pid, f.is_ready(), f.SET_BY_POLARS in os.environ)"
    )
    environment = {k: v for k, v in os.environ.items() if k != forked_worker.SET_BY_POLARS}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment
    )
    assert done.stdout.split() == ["True", "True", "True"]


def test_where_no_server_starts_the_run_says_so(
    prepare: Prepare, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ODSCEN_TEST_OTHER", "2")
    monkeypatch.setattr(forked_worker, "SERVER", "odscen.there_is_no_such_module")
    monkeypatch.setattr(forked_worker, "_many", True)  # of many runs the first is forked, too
    with pytest.raises(forked_worker.ResourceError, match="no process can be started"):
        run_prepared(prepare(), tmp_path / "runs" / "run")
    assert not (tmp_path / "runs").exists()


@pytest.mark.slow
def test_nothing_is_left_of_a_server_when_its_user_has_ended() -> None:
    code = (
        "from odscen.sumo.runner import forked_worker as f; f.get_ready();"
        "print(f._server._process.pid)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    with pytest.raises(ProcessLookupError):
        os.kill(int(done.stdout), 0)
