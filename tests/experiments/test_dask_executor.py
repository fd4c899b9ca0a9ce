"""Studies carried out by the workers of a Dask scheduler, some of which are killed."""

from __future__ import annotations

import os
import signal
import socket
import sys
import time
from contextlib import contextmanager, suppress
from subprocess import DEVNULL, Popen
from typing import TYPE_CHECKING, Any

import dask
import pytest
from distributed import Client, LocalCluster

from odscen.base.errors import ConflictError, InputError, ToolError
from odscen.experiments import dask_executor
from odscen.experiments import work as study_work
from odscen.experiments.dask_executor import (
    CACHE_VARIABLE,
    DaskExecutor,
    carry_out_packed,
    pack_map,
    unpack_map,
)
from odscen.experiments.studies import TABLE_FILE, StudyOrders, begin_study, carry_out_study
from odscen.experiments.work import LocalExecutor, Outcome
from odscen.runs.finished_run import Run
from tests.experiments.study_case import MadeUp, place, plan_file
from tests.sumo.story_case import entry

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from pathlib import Path

    from odscen.experiments.work import WorkOrder

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))


@contextmanager
def cluster(*, processes: bool = False, **given: Any) -> Iterator[str]:
    """A scheduler with two workers: in this process, or in processes of their own."""
    settings = {"distributed.worker.daemon": False, "distributed.admin.tick.limit": "1h"}
    with (
        dask.config.set({**settings, **given}),
        LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            processes=processes,
            dashboard_address="127.0.0.1:0",
            silence_logs=50,
        ) as found,
    ):
        yield found.scheduler_address


def begun(folder: Path, **parts: Any) -> Path:
    begin_study(place(), plan_file(folder, **parts), folder / "out")
    return folder / "out"


def made_up(order: WorkOrder, packs: Mapping[str, Any]) -> list[Outcome]:
    """What a worker would do, without a run."""
    assert set(packs) == {"signal_crossing"}
    return [Outcome(run.name, MadeUp().row(run.name)) for run, _ in order.runs]


def test_a_map_travels_as_a_workspace_of_its_own(tmp_path: Path) -> None:
    pack = pack_map(place(), entry("signal_crossing"))
    assert pack.sha256 == pack_map(place(), entry("signal_crossing")).sha256
    found = unpack_map(pack)
    assert found.root == tmp_path / "cache" / "packs" / pack.sha256
    assert unpack_map(pack) == found
    own = found.map("signal_crossing")
    assert own.damaged() == []
    assert own.sha256 == entry("signal_crossing").sha256


def test_the_table_is_that_of_local_runs_and_maps_travel_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask_executor, "carry_out_packed", made_up)
    out = begun(tmp_path, seeds=40)
    with cluster() as address:
        executor = DaskExecutor(place(), address)
        ended = carry_out_study(out, executor)
        assert len(executor._packs) == 1
    assert ended.state.counts["completed"] == 40
    (tmp_path / "two").mkdir()
    other = begun(tmp_path / "two", seeds=40)
    carry_out_study(other, MadeUp())
    assert (out / TABLE_FILE).read_bytes() == (other / TABLE_FILE).read_bytes()


def test_a_worker_with_another_version_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    orders = StudyOrders(begin_study(place(), plan_file(tmp_path), tmp_path / "out"), {})
    order = orders.next(1)
    assert order is not None
    monkeypatch.setattr(study_work, "version", lambda _: "1.27.0")
    with pytest.raises(ConflictError, match=r"has sumo 1\.27\.0, the study needs 1\.28"):
        carry_out_packed(order, {})  # one that came after the study had begun
    worker = {"odscen": "0.1", "sumo": "1.28.0"}
    with pytest.raises(ConflictError, match=r"worker tcp://x has odscen 0\.1, the study needs"):
        study_work.refuse_other_versions(order.versions, found=worker, where="worker tcp://x")


def test_runs_whose_workers_die_are_tried_one_by_one_and_given_up_last(tmp_path: Path) -> None:
    from distributed import KilledWorker

    class Died:
        def result(self) -> None:
            raise KilledWorker("task", None, 3)

    orders = StudyOrders(begin_study(place(), plan_file(tmp_path), tmp_path / "out"), {})
    order = orders.next(2)
    assert order is not None
    executor = DaskExecutor(place(), None)
    assert executor._take_outcomes(Died(), order) == []
    assert [len(one.runs) for one in executor._again] == [1, 1]
    single = executor._again[0]
    assert executor._take_outcomes(Died(), single) == []
    (lost,) = executor._take_outcomes(Died(), single)
    assert lost.name == single.runs[0][0].name
    assert lost.row["status"] == "failed"
    assert "have died again and again" in lost.row["detail"]


@pytest.mark.parametrize(
    ("scheduler", "error", "words"),
    [
        (None, InputError, "needs --scheduler"),
        ("tcp://127.0.0.1:9", ToolError, "no Dask scheduler answers at tcp://127.0.0.1:9"),
    ],
)
def test_a_scheduler_that_is_not_there_is_named(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    scheduler: str | None,
    error: type[Exception],
    words: str,
) -> None:
    monkeypatch.setattr(dask_executor, "_CONNECT", "300ms")
    with pytest.raises(error, match=words):
        carry_out_study(begun(tmp_path), DaskExecutor(place(), scheduler))


def test_a_map_that_was_lost_with_its_workers_is_sent_again(tmp_path: Path) -> None:
    from distributed import KilledWorker

    class Lost:
        status = "error"

        def result(self) -> None:
            raise KilledWorker("odscen-map-1234-1", None, 3)

    orders = StudyOrders(begin_study(place(), plan_file(tmp_path), tmp_path / "out"), {})
    order = orders.next(2)
    assert order is not None
    executor = DaskExecutor(place(), None)
    executor._packs["signal_crossing"] = Lost()
    assert executor._take_outcomes(Lost(), order) == []
    assert executor._packs == {}
    assert executor._again == [order]
    assert executor._deaths == {}


@contextmanager
def daemons(folder: Path) -> Iterator[Callable[..., Popen[bytes]]]:
    """Start Dask's scheduler and workers as processes, and end them."""
    started: list[Popen[bytes]] = []

    def start(what: str, *given: str) -> Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", "--no-dashboard"]
        command += ["--host", "127.0.0.1", *given]
        started.append(Popen(command, cwd=folder, stdout=DEVNULL, stderr=DEVNULL))
        return started[-1]

    try:
        yield start
    finally:
        for process in started:
            process.kill()
            process.wait()


@pytest.mark.slow
@pytest.mark.parametrize("patience", ["3s", "60s"])
def test_a_scheduler_that_is_started_anew_loses_and_doubles_no_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, patience: str
) -> None:
    """It is away for 6 s: Dask's client gives up before, or is patient and comes back."""
    monkeypatch.setattr(dask_executor, "_CONNECT", patience)
    out, port = begun(tmp_path, seeds=6), free_port()
    address = f"tcp://127.0.0.1:{port}"
    worker = ("worker", address, "--no-nanny", "--nthreads", "1")
    with daemons(tmp_path) as start:
        schedulers = [start("scheduler", "--port", str(port))]
        start(*worker)

        def kill(ended: int, _: int) -> None:
            if ended >= 2 and len(schedulers) == 1:
                schedulers[0].kill()
                schedulers[0].wait()
                time.sleep(6.0)
                schedulers.append(start("scheduler", "--port", str(port)))
                start(*worker)

        wait_for(port)
        ended = carry_out_study(out, DaskExecutor(place(), address), done=kill)
    assert len(schedulers) == 2
    assert ended.state.counts["completed"] == 6
    assert len((out / "journal.jsonl").read_text("utf-8").splitlines()) == 6


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def wait_for(port: int) -> None:
    """Wait until something listens."""
    for _ in range(600):
        with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1.0):
            return
        time.sleep(0.1)


@pytest.mark.slow
def test_killed_workers_lose_and_double_no_run(tmp_path: Path) -> None:
    """Two processes with real runs: one is killed after the second run has ended."""
    (tmp_path / "two").mkdir()
    out, other = begun(tmp_path, seeds=6, keep="all"), begun(tmp_path / "two", seeds=6)
    killed: list[int] = []

    with cluster(processes=True) as address, Client(address, set_as_default=False) as client:

        def kill(ended: int, _: int) -> None:
            if ended >= 2 and not killed:
                pids = client.run(os.getpid, on_error="ignore")
                killed.append(min(pid for pid in pids.values() if isinstance(pid, int)))
                os.kill(killed[-1], signal.SIGKILL)

        carry_out_study(out, DaskExecutor(place(), address), done=kill)
    assert len(killed) == 1
    ended = carry_out_study(other, LocalExecutor(place(), 2))
    assert ended.state.counts["completed"] == 6
    assert len((out / "journal.jsonl").read_text("utf-8").splitlines()) == 6
    assert (out / TABLE_FILE).read_bytes() == (other / TABLE_FILE).read_bytes()
    folder = out / "runs/crossing/as-designed/seed-5"
    assert Run.open(folder).figure("mean_speed") == ended.table["mean_speed"][4]
