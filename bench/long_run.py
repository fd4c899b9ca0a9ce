"""A day of traffic by odscen, in slices, against bare ``sumo`` in one piece: same demand, devices
and recorded output, whatever the run folder's sumocfg names. Aim: at most 1.15.

``python -m bench.long_run``: a day on the shipped town up to 8:00. With ``--full`` 24 hours from
midnight on the large town and, where the shared maps are, on carla-2019/Town05, at least 50,000
trips each; name one of them to run it alone. ``--rounds N`` for more than one round.

Wall and CPU seconds of each, in turn, and the median of the ratios of each round. Each round has
another seed, as traffic is chance: a run in slices and one in one piece have the same demand, but
not the same jams, and the one with more of them takes longer. How many records of road users the
one made for each of the other is told beside the ratio, and how many road users SUMO moved on in
the run in slices. Preparation and report, which ``sumo`` does not have, are told apart. Memory is
what the worker holds at each boundary between slices.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import polars as pl

from bench.common import compile_modules, shared_maps, without_output
from odscen.app.demand import demands
from odscen.app.maps import load_map
from odscen.app.running.reports import write_report
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.runs import layout
from odscen.runs.checkpoint import last_number, read_checkpoint
from odscen.runs.new_run import make_summary
from odscen.runs.recorded import trajectory_files
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.forked_worker import worker_environment
from odscen.sumo.runner.prepare import prepare
from odscen.sumo.runner.worker_process import run_worker
from tools.make_maps.__main__ import map_text

HOUR = 3600.0
TRIPS = 51_000.0
SHORT_TRIPS = 12_000.0


class Spent(NamedTuple):
    """Seconds of this process and its children that have ended."""

    wall: float
    cpu: float


def main() -> None:
    (town,) = (path for path in shipped_maps() if path.stem == "town_5x5")
    day(town, trips=SHORT_TRIPS, until=8 * HOUR, rounds=3)


def full(only: str | None, rounds: int) -> None:
    with tempfile.TemporaryDirectory() as name:
        large = Path(name) / "large_town.xodr"
        large.write_text(map_text(large.stem), encoding="utf-8")
        maps = shared_maps()
        town = maps / "carla-2019" / "Town05.xodr" if maps else None
        for path in (large, town):
            if path is not None and only in (None, path.stem):
                day(path, trips=TRIPS, until=24 * HOUR, rounds=rounds)


def day(path: Path, *, trips: float, until: float, rounds: int) -> None:
    with tempfile.TemporaryDirectory() as name:
        workspace = Workspace.open(Path(name) / "workspace")
        entry = workspace.add_map(path)
        scenario, _ = demands.whole_day(workspace, entry.name, trips=trips, day="weekday", seed=0)
        loaded = load_map(entry)
        net, assets = entry.path("net"), workspace.assets()
        times: defaultdict[str, list[Spent]] = defaultdict(list)
        records, moved_on = [], []
        for seed in range(rounds):
            run = Path(name) / f"run{seed}"
            run.mkdir()
            start = spent()
            prepared = prepare(
                scenario, loaded.sumo, net, assets, settings=RunSettings(seed=seed, until=until)
            )
            prepared.write(run)
            times["preparation"].append(since(start))
            config = run / layout.SUMO_FOLDER / layout.CONFIG_FILE
            silent = without_output(config)
            times["sumo"].append(timed(config))
            alone = rows([config.parent / layout.TRAJECTORIES_FILE])
            start = spent()
            ended = run_worker(run)
            times["odscen"].append(since(start))
            if ended.sim_seconds is None:
                raise SystemExit(ended.error)
            records.append(rows(trajectory_files(run)) / alone)
            summary = make_summary(prepared, run, ended)
            moved_on.append(summary["actors"]["teleported"])
            times["silent"].append(timed(silent))
        start = spent()
        write_report(run, summary, loaded=loaded)
        report = since(start)
        memory = [read_checkpoint(run, n).memory / 1e6 for n in range(1, last_number(run) + 1)]
        print(
            f"{path.stem}, {until / HOUR:g} h, {len(prepared.plan.actors):,} trips, "
            f"{summary['actors']['arrived']:,} arrived, {rounds} rounds, wall (CPU) seconds:\n"
            f"  odscen {told(times['odscen'])}\n"
            f"  sumo with the same output {told(times['sumo'])}, "
            f"ratio {ratios(times['odscen'], times['sumo'])} (aim 1.15), "
            f"records {' '.join(f'{one:.3f}' for one in records)}, "
            f"moved on {' '.join(map(str, moved_on))}\n"
            f"  sumo without output {told(times['silent'])}, "
            f"ratio {ratios(times['odscen'], times['silent'])}\n"
            f"  apart: preparation {told(times['preparation'])}, report {told([report])}\n"
            f"  memory, MB, at the end of each slice: {' '.join(f'{m:.0f}' for m in memory)}; "
            f"after the first {max(memory[1:], default=0.0) / memory[0]:.2f} times as much at most",
            flush=True,
        )


def rows(files: list[Path]) -> int:
    return int(pl.scan_parquet(files).select(pl.len()).collect().item())


def timed(config: Path) -> Spent:
    """Time of bare ``sumo``, with the allocator that odscen's has."""
    import sumo

    binary = Path(sumo.SUMO_HOME) / "bin" / "sumo"
    start = spent()
    subprocess.run(
        [binary, "-c", config], check=True, capture_output=True, env=worker_environment()
    )
    return since(start)


def spent() -> Spent:
    times = os.times()
    cpu = times.user + times.system + times.children_user + times.children_system
    return Spent(time.perf_counter(), cpu)


def since(start: Spent) -> Spent:
    now = spent()
    return Spent(now.wall - start.wall, now.cpu - start.cpu)


def told(times: list[Spent]) -> str:
    wall = statistics.median(one.wall for one in times)
    return f"{wall:.1f} ({statistics.median(one.cpu for one in times):.1f})"


def ratios(ours: list[Spent], theirs: list[Spent]) -> str:
    pairs = list(zip(ours, theirs, strict=True))
    wall = [mine.wall / other.wall for mine, other in pairs]
    cpu = statistics.median(mine.cpu / other.cpu for mine, other in pairs)
    each = f" [{' '.join(f'{one:.2f}' for one in wall)}]" if len(wall) > 1 else ""
    return f"{statistics.median(wall):.2f} ({cpu:.2f}){each}"


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--full", nargs="?", const="", metavar="MAP")
    parser.add_argument("--rounds", type=int, default=1)
    given = parser.parse_args()
    compile_modules()
    if given.full is None:
        main()
    else:
        full(given.full or None, given.rounds)
