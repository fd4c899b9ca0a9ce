"""Studies whose processes are killed, against the same studies left alone.

``python -m bench study_kills [--runs N] [--kills N]``: ``odscen study run`` with 10,000 very short
runs (2 to 3 road users, 5 s), killed by SIGKILL at random moments, alone or with all of its
processes, and given again until it ends. The same plan is carried out once without a kill, at the
same time. ``python -m bench study_kills --workers``, ``--scheduler`` and ``--machine``: the same
with Dask, where a worker is killed every 10 s, the scheduler is killed and started again at its
address with new workers, or all processes of a worker with its nanny are killed and stay away.

Each time the table must be the same bytes, no row may be gone after a kill, no run may have two,
and no process and no folder may be left.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import dask
import psutil
from distributed import LocalCluster, Status

from bench.studies import QUIET
from odscen.experiments.dask_executor import CACHE_VARIABLE
from odscen.experiments.journal import JOURNAL_FILE, PARTS_FOLDER, read_rows
from odscen.experiments.studies import TABLE_FILE
from odscen.maps.store import Workspace

MAP = Path(__file__).parents[1] / "maps" / "t_junction_signs.xodr"
JOBS = 2
MARK = "ODSCEN_BENCH_STUDY"
"""Variable by which processes of this bench are found, whoever their parent is now."""
TRACKER = "multiprocessing.resource_tracker"
"""Python's own process beside that of this bench, which ends with it."""
HOW = ("SIGKILL", "SIGKILL to all")


def main() -> None:
    options = argparse.ArgumentParser(prog="bench study_kills")
    options.add_argument("--runs", type=int, default=10_000, help="of the study")
    options.add_argument("--kills", type=int, default=20, help="of the command")
    options.add_argument("--longest", type=float, default=120.0, help="wall seconds until a kill")
    options.add_argument("--seed", type=int, default=1, help="of the moments")
    options.add_argument("--every", type=float, default=10.0, help="wall seconds, of workers")
    for name in ("workers", "scheduler", "machine"):
        options.add_argument(f"--{name}", action="store_true")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as name:
        trial = Trial.made(Path(name), asked.runs)
        if asked.workers:
            killed_workers(trial, asked.every)
        elif asked.scheduler:
            killed_scheduler(trial)
        elif asked.machine:
            lost_machine(trial)
        else:
            killed_command(trial, asked.kills, asked.longest, random.Random(asked.seed))


@dataclass(frozen=True)
class Trial:
    """A plan of so many runs, and the study of it that is left alone."""

    folder: Path
    plan: Path
    runs: int
    environment: dict[str, str]

    @classmethod
    def made(cls, folder: Path, runs: int) -> Trial:
        workspace = Workspace.open(folder / "workspace")
        workspace.add_map(MAP)
        scenarios = min(20, runs)
        sample = {
            "maps": ["*"], "count": scenarios, "seed": 1, "fill": 0.1, "roi_segments": 2,
        }  # fmt: skip
        how = {"until": 5.0, "trajectories": False}
        plan = {"name": "kills", "sample": [sample], "seeds": runs // scenarios, "run": how}
        file = folder / "kills.json"
        file.write_text(json.dumps(plan), encoding="utf-8")
        own = {MARK: folder.name, CACHE_VARIABLE: str(folder / "cache"), "TMPDIR": str(folder)}
        return cls(folder, file, runs // scenarios * scenarios, os.environ | own)

    @property
    def alone(self) -> Path:
        return self.folder / "alone"

    @property
    def killed(self) -> Path:
        return self.folder / "killed"

    def started(self, out: Path, *options: str) -> subprocess.Popen[bytes]:
        """The command, as the leader of a session."""
        command = [sys.executable, "-m", "odscen", "study", "run", str(self.plan)]
        command += ["--out", str(out), "--workspace", str(self.folder / "workspace"), *options]
        return subprocess.Popen(
            command, env=self.environment, start_new_session=True,
            stdout=subprocess.DEVNULL, stderr=(self.folder / f"{out.name}.err").open("ab"),
        )  # fmt: skip

    def run_alone(self) -> subprocess.Popen[bytes]:
        return self.started(self.alone, "--jobs", str(JOBS))

    def told(self, what: str) -> None:
        """Print how the study that was killed differs from the one that was not."""
        for _ in range(150):
            if not (left := self.processes()):
                break
            time.sleep(0.5)
        parts = (self.killed / PARTS_FOLDER).glob("*")
        lines = sum(len(one.read_bytes().splitlines()) for one in parts)
        lines += len((self.killed / JOURNAL_FILE).read_bytes().splitlines())
        rows = read_rows(self.killed)
        statuses = Counter(str(row["status"]) for row in rows.values())
        table = self.killed / TABLE_FILE
        same = table.is_file() and table.read_bytes() == (self.alone / TABLE_FILE).read_bytes()
        if not same:
            print((self.folder / "killed.err").read_text(encoding="utf-8")[-3000:])
        own = {"workspace", "cache", "alone", "killed", self.plan.name}
        left_files = [
            str(path.relative_to(self.folder))
            for path in (*self.folder.iterdir(), *self.folder.glob("odscen-*/.*"))
            if path.name not in own
            and path.suffix != ".err"
            and not path.name.startswith("odscen-")
        ]
        print(
            f"{self.runs} runs, {what}: {len(rows)} runs have a row ({dict(statuses)}), "
            f"{lines - len(rows)} have two; the table "
            f"{'is the same bytes' if same else 'DIFFERS'}; left behind: "
            f"{', '.join(left_files) or 'no file'}, {len(left)} processes",
            flush=True,
        )

    def processes(self) -> list[psutil.Process]:
        found = []
        for process in psutil.process_iter():
            with suppress(psutil.Error):
                own = process.pid == os.getpid() or TRACKER in " ".join(process.cmdline())
                if not own and process.environ().get(MARK) == self.folder.name:
                    found.append(process)
        return found


def killed_command(trial: Trial, kills: int, longest: float, chance: random.Random) -> None:
    alone = trial.run_alone()
    began = time.perf_counter()
    moments: Counter[str] = Counter()
    told: list[int] = []
    lost = refused = 0
    before: set[str] = set()
    while True:
        command = trial.started(trial.killed, "--jobs", str(JOBS))
        patience = chance.uniform(1.0, longest) if moments.total() < kills else None
        with suppress(subprocess.TimeoutExpired):
            code = command.wait(patience)
            if code == 0:
                break
            refused += 1
            continue
        how = chance.choice(HOW)
        kill(command, everything=how == HOW[1])
        moments[how] += 1
        rows = set(read_rows(trial.killed)) if trial.killed.is_dir() else set()
        lost += len(before - rows)
        before = rows
        told.append(len(rows))
    ended = time.perf_counter() - began
    alone.wait()
    print(f"rows at each kill: {' '.join(map(str, told))}; {ended:.0f} s of wall time")
    ways = ", ".join(f"{moments[one]} by {one}" for one in HOW)
    trial.told(
        f"the command killed {moments.total()} times ({ways}), {lost} rows lost by a kill, "
        f"{refused} times not resumed at once"
    )


def kill(command: subprocess.Popen[bytes], *, everything: bool) -> None:
    """Kill a command, and all that it has started if ``everything``."""
    below = psutil.Process(command.pid).children(recursive=True) if everything else []
    command.kill()
    for process in below:
        with suppress(psutil.Error):
            process.kill()
    command.wait()


def killed_workers(trial: Trial, every: float) -> None:
    alone_first(trial)
    dask.config.set(QUIET)
    os.environ.update(trial.environment)
    with LocalCluster(
        n_workers=JOBS, threads_per_worker=1, dashboard_address="127.0.0.1:0", silence_logs=50
    ) as cluster:
        command = trial.started(
            trial.killed, "--executor", "dask", "--scheduler", cluster.scheduler_address
        )
        ended = threading.Event()
        killed: list[int] = []

        def go_on() -> None:
            while not ended.wait(every):
                # A nanny gives up for good if its worker dies before it has started.
                workers = [
                    one.process.pid
                    for one in cluster.workers.values()
                    if one.process is not None and one.process.status is Status.running
                ]
                if workers:
                    killed.append(workers[len(killed) % len(workers)])
                    with suppress(ProcessLookupError):
                        os.kill(killed[-1], signal.SIGKILL)

        killer = threading.Thread(target=go_on)
        began = time.perf_counter()
        killer.start()
        code = command.wait()
        ended.set()
        killer.join()
        took = time.perf_counter() - began
    trial.told(f"Dask, {len(killed)} workers killed in {took:.0f} s, exit code {code}")


def killed_scheduler(trial: Trial) -> None:
    """Kill the scheduler after a third of the runs and start it again; its workers end with it."""
    alone_first(trial)
    address = f"tcp://127.0.0.1:{free_port()}"
    with daemons(trial) as start:
        scheduler = start("scheduler", "--port", address.rpartition(":")[2])
        workers = [start("worker", address) for _ in range(JOBS)]
        command = trial.started(trial.killed, "--executor", "dask", "--scheduler", address)
        rows = wait_for_rows(trial, trial.runs // 3, command)
        kill_session(scheduler)
        time.sleep(5.0)
        start("scheduler", "--port", address.rpartition(":")[2])
        time.sleep(10.0)
        gone = [one for one in workers if one.poll() is not None]
        for _ in gone:
            start("worker", address)
        code = command.wait()
    trial.told(
        f"Dask, the scheduler killed after {rows} rows and started again 5 s later, "
        f"{len(gone)} of {JOBS} workers had ended with it, exit code {code}"
    )


def lost_machine(trial: Trial) -> None:
    alone_first(trial)
    address = f"tcp://127.0.0.1:{free_port()}"
    with daemons(trial) as start:
        start("scheduler", "--port", address.rpartition(":")[2])
        workers = [start("worker", address) for _ in range(JOBS)]
        command = trial.started(trial.killed, "--executor", "dask", "--scheduler", address)
        rows = wait_for_rows(trial, trial.runs // 3, command)
        kill_session(workers[0])
        code = command.wait()
    trial.told(f"Dask, one of {JOBS} workers lost after {rows} rows, exit code {code}")


def alone_first(trial: Trial) -> None:
    if trial.run_alone().wait():
        raise SystemExit((trial.folder / "alone.err").read_text(encoding="utf-8"))


def wait_for_rows(trial: Trial, count: int, command: subprocess.Popen[bytes]) -> int:
    while True:
        rows = len(read_rows(trial.killed)) if trial.killed.is_dir() else 0
        if rows >= count or command.poll() is not None:
            return rows
        time.sleep(0.2)


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


@contextmanager
def daemons(trial: Trial) -> Iterator[Callable[..., subprocess.Popen[bytes]]]:
    """Start Dask's scheduler and workers, each as the leader of a session, and end them."""
    started = []

    def start(what: str, *given: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", "--no-dashboard"]
        command += ["--host", "127.0.0.1", *given]
        command += ["--nthreads", "1", "--nworkers", "1"] if what == "worker" else []
        started.append(
            subprocess.Popen(
                command, env=trial.environment, start_new_session=True, cwd=trial.folder,
                stdout=subprocess.DEVNULL,
                stderr=(trial.folder / f"{what}.err").open("ab"),
            )
        )  # fmt: skip
        return started[-1]

    try:
        yield start
    finally:
        for process in started:
            kill_session(process)


def kill_session(process: subprocess.Popen[bytes]) -> None:
    """Kill a process with all that it has started, as a machine does that is switched off."""
    with suppress(psutil.Error):
        kill(process, everything=True)
    process.wait()


if __name__ == "__main__":
    main()
