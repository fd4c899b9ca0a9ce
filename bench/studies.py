"""A study with Dask against the same with local processes, and how much a scheduler can take.

Aim: 200 short runs on a LocalCluster of two processes in at most 1.1 times the wall time of two
local processes, both from a study that has begun to its table, and the same table. Then trivial
tasks: the scheduler's own time for each, which bounds how many orders a second it can give out. The
scheduler is a process of its own there; tasks go to it as orders of a study do, a few at a time.

Neither side has loaded the map or started SUMO before; the cluster has been started, and what
that takes is shown apart. CPU seconds are those of the whole tree of processes.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import dask
import psutil
from distributed import Client, LocalCluster, as_completed

from odscen.experiments.dask_executor import CACHE_VARIABLE, DaskExecutor, pack_map
from odscen.experiments.plan import StudyPlan
from odscen.experiments.studies import TABLE_FILE, begin_study_of, carry_out_study
from odscen.experiments.work import Executor, LocalExecutor
from odscen.maps.store import Workspace

MAP = Path(__file__).parents[1] / "maps" / "signal_crossing.xodr"
SECONDS = 60.0
JOBS = 2
SCENARIOS = 20
QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.tick.limit": "1h",
}
"""What docs/studies.md advises: a worker whose threads wake up often takes turns with the run."""


def main() -> None:
    options = argparse.ArgumentParser(prog="bench studies")
    options.add_argument("--runs", type=int, default=200, help="of a study")
    options.add_argument("--repeats", type=int, default=3, help="rounds; medians are shown")
    options.add_argument("--tasks", type=int, default=100_000, help="trivial ones")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as name:
        os.environ[CACHE_VARIABLE] = str(Path(name) / "cache")
        if asked.runs:
            compare(Path(name), runs=asked.runs, repeats=asked.repeats)
        if asked.tasks:
            scheduler_load(Path(name), asked.tasks)


def compare(folder: Path, *, runs: int, repeats: int) -> None:
    workspace = Workspace.open(folder / "workspace")
    entry = workspace.add_map(MAP)
    print(f"{MAP.stem} packed: {len(pack_map(workspace, entry).content) / 1e3:.0f} kB")
    rounds = []
    for number in range(repeats):
        rows = []
        for how in ("local", "dask"):
            out = folder / f"{how}-{number}"
            rows.append((*_study(workspace, out, how, runs), (out / TABLE_FILE).read_bytes()))
        same = rows[0][2] == rows[1][2]
        rounds.append((rows[0][:2], rows[1][:2]))
        print(f"  local {rows[0][0]:.1f} s, Dask {rows[1][0]:.1f} s, the same table: {same}")
    out = folder / "local-0"
    for what, index in (("wall", 0), ("CPU", 1)):
        local = statistics.median(one[0][index] for one in rounds)
        far = statistics.median(one[1][index] for one in rounds)
        ratio = statistics.median(one[1][index] / one[0][index] for one in rounds)
        print(
            f"{runs} runs of {SECONDS:g} s, {what}: local {local:.1f} s ({local / runs:.2f} each), "
            f"Dask {far:.1f} s ({far / runs:.2f} each), ratio {ratio:.2f}"
        )
    sizes = [(out / name).stat().st_size / runs for name in ("journal.jsonl", TABLE_FILE)]
    print(f"a row: {sizes[0]:.0f} bytes in the journal, {sizes[1]:.0f} in the table")


def _study(workspace: Workspace, out: Path, how: str, runs: int) -> tuple[float, float]:
    """Wall and CPU seconds of a study, with a cluster that is there."""
    count = min(SCENARIOS, runs)
    sample = {"maps": ["*"], "count": count, "seed": 1, "fill": 0.5}
    data = {"name": how, "sample": [sample], "seeds": runs // count, "run": {"until": SECONDS}}
    begin_study_of(workspace, StudyPlan.model_validate(data), out, beside=out)
    if how == "local":
        return _carry_out(out, LocalExecutor(workspace, JOBS))
    began = time.perf_counter()
    dask.config.set(QUIET)
    with LocalCluster(
        n_workers=JOBS, threads_per_worker=1, dashboard_address="127.0.0.1:0", silence_logs=50
    ) as cluster:
        print(f"  the cluster has started in {time.perf_counter() - began:.1f} s")
        return _carry_out(out, DaskExecutor(workspace, cluster.scheduler_address))


def _carry_out(out: Path, executor: Executor) -> tuple[float, float]:
    before, began = _cpu(), time.perf_counter()
    state = carry_out_study(out, executor).state
    assert state.counts["completed"] == state.runs, state
    return time.perf_counter() - began, _cpu() - before


def _cpu() -> float:
    """CPU seconds of this process and all below it."""
    total = 0.0
    own = psutil.Process()
    for process in (own, *own.children(recursive=True)):
        try:
            times = process.cpu_times()
        except psutil.Error:
            continue
        total += times.user + times.system + times.children_user + times.children_system
    return total


def trivial(number: int) -> int:
    return number


def scheduler_load(folder: Path, tasks: int) -> None:
    file = folder / "scheduler.json"
    base = [sys.executable, "-m", "distributed.cli"]
    scheduler = [f"{base[2]}.dask_scheduler", "--no-dashboard", "--port", "0"]
    worker = [f"{base[2]}.dask_worker", "--no-dashboard", "--nthreads", "1", "--no-nanny"]
    given = ["--host", "127.0.0.1", "--scheduler-file", str(file)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    commands = [[*base[:2], *scheduler], *([[*base[:2], *worker]] * JOBS)]
    processes = [subprocess.Popen([*one, *given], **quiet) for one in commands]
    try:
        while not file.is_file():
            time.sleep(0.2)
        dask.config.set({"distributed.comm.timeouts.connect": "60s"})
        with Client(scheduler_file=str(file)) as client:
            client.wait_for_workers(JOBS, timeout=120)
            _submit(client, tasks, psutil.Process(processes[0].pid))
    finally:
        for process in processes:
            process.kill()
            process.wait()


def _submit(client: Client, tasks: int, scheduler: psutil.Process) -> None:
    """Keep a few hundred tasks with the scheduler until all are done."""
    window, sent, done = 400, 0, 0
    before, began = sum(scheduler.cpu_times()[:2]), time.perf_counter()
    first = client.map(trivial, range(window), pure=False)
    sent = len(first)
    ended = as_completed(first, with_results=True)
    for batch in ended.batches():
        done += len(batch)
        more = min(len(batch), tasks - sent)
        if more:
            ended.update(client.map(trivial, range(sent, sent + more), pure=False))
            sent += more
    wall, cpu = time.perf_counter() - began, sum(scheduler.cpu_times()[:2]) - before
    memory = scheduler.memory_info().rss / 1e6
    print(
        f"{done:,} trivial tasks: {wall:.0f} s, of the scheduler {cpu / done * 1e3:.2f} ms of CPU "
        f"each, so at most {done / cpu:,.0f} a second; its memory at the end {memory:.0f} MB"
    )


if __name__ == "__main__":
    main()
