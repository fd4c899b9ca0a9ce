"""Studies whose processes are killed, against the same studies left alone.

``python -m bench study_kills [--runs N] [--kills N]``: ``odscen study run`` with 10,000 very short
runs (2 to 3 road users, 5 s), killed by SIGKILL at random moments, alone or with all of its
processes, and given again until it ends. The same plan is carried out once without a kill, at the
same time. ``python -m bench study_kills --workers``, ``--scheduler`` and ``--machine``: the same
with Dask, where a worker is killed every 10 s, the scheduler is killed and started again at its
address with new workers, or all processes of a worker with its nanny are killed and stay away.

Each time the table must be the same bytes, no row may be gone after a kill, no run may have two,
and no process and no folder may be left. ``--of sweep`` and ``--of dataset`` kill ``odscen sweep``
and ``odscen dataset`` in the same way: no case and no recording that was there may be gone or done
again, and all files must be the same but for the time that runs took.
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
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import dask
import psutil
from distributed import LocalCluster, Status

from bench.studies import QUIET
from odscen.app.generation import generate
from odscen.experiments.dask_executor import CACHE_VARIABLE
from odscen.experiments.journal import JOURNAL_FILE, PARTS_FOLDER, read_rows
from odscen.experiments.studies import TABLE_FILE
from odscen.maps.store import Workspace
from odscen.scenario.sampling.generation_settings import GenerationSettings

MAP = Path(__file__).parents[1] / "maps" / "t_junction_signs.xodr"
JOBS = 2
MARK = "ODSCEN_BENCH_STUDY"
"""Variable by which processes of this bench are found, whoever their parent is now."""
TRACKER = "multiprocessing.resource_tracker"
"""Python's own process beside that of this bench, which ends with it."""
HOW = ("SIGKILL", "SIGKILL to all")


def main() -> None:
    options = argparse.ArgumentParser(prog="bench study_kills")
    options.add_argument("--of", choices=("study", "sweep", "dataset"), default="study")
    options.add_argument("--runs", type=int, default=10_000, help="of the study")
    options.add_argument("--kills", type=int, default=20, help="of the command")
    options.add_argument("--longest", type=float, default=120.0, help="wall seconds until a kill")
    options.add_argument("--seed", type=int, default=1, help="of the moments")
    options.add_argument("--every", type=float, default=10.0, help="wall seconds, of workers")
    for name in ("workers", "scheduler", "machine"):
        options.add_argument(f"--{name}", action="store_true")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as name:
        trial = Trial.made(Path(name), asked.runs, asked.of)
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
    arguments: Sequence[str]
    runs: int
    environment: dict[str, str]
    of: str = "study"

    @classmethod
    def made(cls, folder: Path, runs: int, of: str = "study") -> Trial:
        workspace = Workspace.open(folder / "workspace")
        workspace.add_map(MAP)
        scenarios = min(20, runs)
        sample = {
            "maps": ["*"], "count": scenarios, "seed": 1, "fill": 0.1, "roi_segments": 2,
        }  # fmt: skip
        how = {"until": 5.0, "trajectories": of == "dataset"}
        study = {"sample": [sample], "seeds": runs // scenarios, "run": how}
        plan: dict[str, Any] = {"name": "kills", **study}
        if of == "dataset":
            plan = {
                "name": "kills", "licence": "CC-BY-4.0", "formats": ["pyg", "scenarionet"],
                "shard": 10, "keep_if": ["planned >= 1"], "study": study,
            }  # fmt: skip
        file = folder / "kills.json"
        arguments = {
            "study": ["study", "run", str(file)],
            "dataset": ["dataset", str(file)],
            "sweep": ["sweep", str(file), "--vary", f"per_hour=60..600:{runs}"],
        }[of]
        if of == "sweep":
            plan = swept_scenario(workspace)
        file.write_text(json.dumps(plan), encoding="utf-8")
        own = {MARK: folder.name, CACHE_VARIABLE: str(folder / "cache"), "TMPDIR": str(folder)}
        count = runs if of == "sweep" else runs // scenarios * scenarios
        return cls(folder, arguments, count, os.environ | own, of)

    @property
    def alone(self) -> Path:
        return self.folder / "alone"

    @property
    def killed(self) -> Path:
        return self.folder / "killed"

    def started(self, out: Path, *options: str) -> subprocess.Popen[bytes]:
        """The command, as the leader of a session."""
        command = [sys.executable, "-m", "odscen", *self.arguments]
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
            if not (left := processes_of(self.folder.name)):
                break
            time.sleep(0.5)
        own = {"workspace", "cache", "alone", "killed", "kills.json"}
        left_files = [
            str(path.relative_to(self.folder))
            for path in (
                *self.folder.iterdir(),
                *self.folder.glob("odscen-*/.*"),
                *self.killed.rglob(".*"),
            )
            if path.name not in own
            and path.suffix not in (".err", ".lock")
            and not path.name.startswith("odscen-")
        ]
        print(
            f"{self.runs} runs of a {self.of}, {what}: {self.results()}; left behind: "
            f"{', '.join(left_files) or 'no file'}, {len(left)} processes",
            flush=True,
        )

    def results(self) -> str:
        """How many results there are, and whether they are those of the study left alone."""
        if self.of == "sweep":
            return f"{len(self.done())} cases have a run; {self.other_files()}"
        folder = self.killed if self.of == "study" else self.killed / "study"
        parts = (folder / PARTS_FOLDER).glob("*")
        lines = sum(len(one.read_bytes().splitlines()) for one in parts)
        lines += len((folder / JOURNAL_FILE).read_bytes().splitlines())
        rows = read_rows(folder)
        statuses = Counter(str(row["status"]) for row in rows.values())
        table = folder.relative_to(self.killed) / TABLE_FILE
        there = (self.killed / table).is_file()
        same = there and (self.killed / table).read_bytes() == (self.alone / table).read_bytes()
        if not same:
            print((self.folder / "killed.err").read_text(encoding="utf-8")[-3000:])
        words = (
            f"{len(rows)} runs have a row ({dict(statuses)}), {lines - len(rows)} have two; "
            f"the table {'is the same bytes' if same else 'DIFFERS'}"
        )
        return words if self.of == "study" else f"{words}; {self.other_files()}"

    def other_files(self) -> str:
        """Files that are not the same bytes as those of the one left alone."""
        found = {
            root: {
                path.relative_to(root): path.read_bytes()
                for path in root.rglob("*")
                if path.is_file() and not path.name.startswith(".") and not has_times(path, root)
            }
            for root in (self.alone, self.killed)
        }
        one, other = found.values()
        names = sorted(str(name) for name in one.keys() | other.keys())
        differing = [name for name in names if one.get(Path(name)) != other.get(Path(name))]
        if differing:
            return f"{len(differing)} of {len(names)} files DIFFER: {', '.join(differing[:5])}"
        return f"{len(names)} files are the same bytes"

    def done(self) -> dict[str, bytes]:
        """What is done so far: it may neither be gone nor be done again after a kill."""
        if not self.killed.is_dir():
            return {}
        if self.of == "sweep":
            found = self.killed.glob("runs/[!.]*/summary.json")
            return {path.parent.name: path.read_bytes() for path in found}
        folder = self.killed if self.of == "study" else self.killed / "study"
        rows = read_rows(folder) if folder.is_dir() else {}
        kept = {f"row {key}": json.dumps(row, default=str).encode() for key, row in rows.items()}
        if self.of == "dataset":
            shards = self.killed.rglob("shard-*/*")
            kept |= {
                str(path): str(path.stat().st_size).encode()
                for path in shards
                if path.suffix == ".npz"
            }
        return kept


def processes_of(mark: str) -> list[psutil.Process]:
    """What was started with :data:`MARK` so and still runs, this process aside."""
    found = []
    for process in psutil.process_iter():
        with suppress(psutil.Error):
            own = process.pid == os.getpid() or TRACKER in " ".join(process.cmdline())
            if not own and process.environ().get(MARK) == mark:
                found.append(process)
    return found


def swept_scenario(workspace: Workspace) -> dict[str, Any]:
    """A sampled scenario with a flow whose volume is a parameter."""
    settings = GenerationSettings(map_name=MAP.stem, seed=1, fill=0.1)
    (path,) = generate(workspace, settings=settings)
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    flow = {"id": "f", "spawn": found["actors"][0]["spawn"], "per_hour": "$per_hour"}
    return found | {
        "actors": found["actors"][1:4],
        "flows": [flow],
        "parameters": {"per_hour": {"value": 60.0}},
        "simulation": {"duration": 5.0},
    }


def has_times(path: Path, root: Path) -> bool:
    """Whether a file says how long something took, or has the checksum of one that does."""
    within_run = "runs" in path.relative_to(root).parts
    return (
        path.name == JOURNAL_FILE
        or (within_run and path.name in ("summary.json", "SHA256SUMS"))
        or PARTS_FOLDER in path.relative_to(root).parts
    )


def killed_command(trial: Trial, kills: int, longest: float, chance: random.Random) -> None:
    alone = trial.run_alone()
    began = time.perf_counter()
    moments: Counter[str] = Counter()
    told: list[int] = []
    lost = again = refused = 0
    before: dict[str, bytes] = {}
    while True:
        command = trial.started(trial.killed, "--jobs", str(JOBS))
        patience = chance.uniform(1.0, longest) if moments.total() < kills else None
        with suppress(subprocess.TimeoutExpired):
            code = command.wait(patience)
            if code == 0:
                break
            refused += 1
            if refused > kills:
                raise SystemExit((trial.folder / "killed.err").read_text(encoding="utf-8")[-2000:])
            continue
        how = chance.choice(HOW)
        kill(command, everything=how == HOW[1])
        moments[how] += 1
        done = trial.done()
        lost += len(before.keys() - done.keys())
        again += sum(done.get(name, kept) != kept for name, kept in before.items())
        before = done
        told.append(len(done))
    ended = time.perf_counter() - began
    alone.wait()
    print(f"done at each kill: {' '.join(map(str, told))}; {ended:.0f} s of wall time")
    ways = ", ".join(f"{moments[one]} by {one}" for one in HOW)
    trial.told(
        f"the command killed {moments.total()} times ({ways}), {lost} results lost by a kill, "
        f"{again} done again, {refused} times not resumed at once"
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
