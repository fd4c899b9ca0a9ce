"""Many short runs by odscen, two at a time, against a bare pool of libsumo that writes the same.

Aim: at most 1.5 times the CPU of the pool, and one run alone at most 0.6 s. The pool has two
processes that keep libsumo loaded and go through the same SUMO files, with the same outputs and
the same allocator; it checks nothing and makes no figures. odscen's side has everything, from the
start of ``odscen run``: with complete records, with figures, too, and with reports, too.
``--actors`` and ``--seconds`` measure larger runs by the same rule.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from odscen.app.generation import generate
from odscen.maps.store import Workspace
from odscen.runs import layout
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.sumo.runner.forked_worker import worker_environment

if TYPE_CHECKING:
    from collections.abc import Sequence

ACTORS = 20
SECONDS = 60.0
JOBS = 2
MAP = Path(__file__).parents[1] / "maps" / "signal_crossing.xodr"
KINDS = {
    "records": ["--no-report"],
    "figures": ["--no-report", "--json"],
    "reports": ["--report"],
}
POOL = """
import sys
from multiprocessing import get_context


def run(config):
    import libsumo

    libsumo.start(["sumo", "-c", config, "--output-prefix", "bare_"])
    while libsumo.simulation.getMinExpectedNumber() and libsumo.simulation.getTime() < %s:
        libsumo.simulationStep()
    libsumo.close()


if __name__ == "__main__":
    with get_context("spawn").Pool(%d) as pool:
        pool.map(run, sys.stdin.read().split(), chunksize=1)
"""


def main() -> None:
    options = argparse.ArgumentParser(prog="bench short_runs")
    options.add_argument("--runs", type=int, default=200, help="scenarios")
    options.add_argument("--repeats", type=int, default=5, help="rounds; medians are shown")
    options.add_argument(
        "--kinds", nargs="+", choices=KINDS, default=list(KINDS), help="what is made of each"
    )
    options.add_argument("--actors", type=int, default=ACTORS, help="of each scenario")
    options.add_argument("--seconds", type=float, default=SECONDS, help="of each scenario")
    options.add_argument("--map", type=Path, default=MAP, help="file with the map")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as name:
        size = Size(asked.map, asked.actors, asked.seconds)
        compare(Path(name), size, asked.kinds, runs=asked.runs, repeats=asked.repeats)


class Size(NamedTuple):
    """Map, actors and simulated seconds of each scenario."""

    map: Path
    actors: int
    seconds: float


def compare(folder: Path, size: Size, chosen: Sequence[str], *, runs: int, repeats: int) -> None:
    scenarios = _scenarios(folder, size, runs)
    script = folder / "pool.py"
    script.write_text(POOL % (size.seconds, JOBS), encoding="utf-8")
    out = folder / "runs"
    kinds = {kind: KINDS[kind] for kind in chosen}
    batches = {kind: _command(folder, out, scenarios, *more) for kind, more in kinds.items()}
    lone = {
        kind: _command(folder, folder / "alone", scenarios[:1], *more)
        for kind, more in kinds.items()
    }
    spent_by(_command(folder, out, scenarios, *KINDS["records"]))
    configs = sorted(out.glob(f"*/{layout.SUMO_FOLDER}/{layout.CONFIG_FILE}"))
    bare = folder / "bare"
    for config in configs:
        shutil.copytree(config.parent, bare / config.parent.parent.name)
    given = "\n".join(str(bare / one.parent.parent.name / one.name) for one in configs)
    pool: list[float] = []
    spent: dict[str, list[float]] = {kind: [] for kind in kinds}
    alone: dict[str, list[tuple[float, float]]] = {kind: [] for kind in kinds}
    for _ in range(repeats):
        pool.append(spent_by([sys.executable, str(script)], given=given)[0])
        for kind in kinds:
            spent[kind].append(spent_by(batches[kind])[0])
            alone[kind].append(spent_by(lone[kind]))
    peer = statistics.median(pool) / runs
    for kind in kinds:
        each = statistics.median(spent[kind]) / runs
        ratio = statistics.median(a / b for a, b in zip(spent[kind], pool, strict=True))
        print(
            f"{runs} runs of {size.actors} actors, {size.seconds:g} s, {JOBS} at a time, {kind}: "
            f"odscen {each:.3f} CPU s each, bare pool {peer:.3f}, ratio {ratio:.2f} (aim 1.5)"
        )
        cpu, wall = (statistics.median(one[part] for one in alone[kind]) for part in (0, 1))
        print(f"one alone, {kind}: {wall:.2f} s, {cpu:.2f} CPU s (aim 0.6 s)")


def _scenarios(folder: Path, size: Size, number: int) -> list[Path]:
    workspace = Workspace.open(folder / "workspace")
    workspace.add_map(size.map)
    config = SamplingConfig(actors_max=size.actors, duration=size.seconds)
    settings = GenerationSettings(map_name=size.map.stem, count=number, fill=1.0, config=config)
    return list(generate(workspace, settings=settings))


def _command(folder: Path, out: Path, scenarios: list[Path], *more: str) -> list[str]:
    command = [sys.executable, "-m", "odscen", "run", *map(str, scenarios)]
    command += ["--workspace", str(folder / "workspace"), "--out", str(out)]
    return [*command, "--jobs", str(JOBS), *more]


def spent_by(command: list[str], *, given: str = "") -> tuple[float, float]:
    """CPU seconds of a command with all that it starts, and wall seconds."""
    # What a forked process takes is its server's, which the command waits for.
    environment = worker_environment() if given else dict(os.environ)
    before, start = os.times(), time.perf_counter()
    subprocess.run(
        command, check=True, capture_output=True, text=True, input=given, env=environment
    )
    after, wall = os.times(), time.perf_counter() - start
    spent = after.children_user + after.children_system
    return spent - before.children_user - before.children_system, wall
