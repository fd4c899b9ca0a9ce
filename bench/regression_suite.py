"""A suite of many short scenarios with three seeds each, against a bare pool of libsumo.

Aim: 100 scenarios with three seeds in under a minute on two cores, all of ``odscen test`` included:
checks, runs, every figure by place, comparison with the baselines and the verdict. The peer is two
processes that keep libsumo loaded and go through the same SUMO files, with the same outputs and
the same allocator, and neither check nor compare anything.

Wall seconds hold on a machine of one's own; half of the CPU seconds is what two free cores take.
"""

from __future__ import annotations

import argparse
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

from bench.short_runs import JOBS, POOL, spent_by
from odscen.app.generation import generate
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.runs import layout
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.sampling.generation_settings import GenerationSettings

SEEDS = (1, 2, 3)
SECONDS = 60.0
ACTORS = 20


def main() -> None:
    options = argparse.ArgumentParser(prog="bench regression_suite")
    options.add_argument("--scenarios", type=int, default=100)
    options.add_argument("--repeats", type=int, default=3, help="rounds; medians are shown")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as name:
        compare(Path(name), asked.scenarios, asked.repeats)


def compare(folder: Path, number: int, repeats: int) -> None:
    suite, scenarios = written(folder, number)
    workspace = ["--workspace", str(folder / "workspace"), "--jobs", str(JOBS)]
    command = [sys.executable, "-m", "odscen"]
    test = [*command, "test", str(suite), *workspace]
    first = spent_by([*test, "--update-baseline", "--force"])
    print(f"baselines of {len(scenarios)} scenarios: {first[1]:.0f} s, {first[0]:.0f} CPU s")
    for seed in SEEDS:
        more = ["--seed", str(seed), "--out", str(folder / f"seed-{seed}"), "--no-report"]
        run = [*command, "run", *map(str, scenarios), *workspace, *more]
        subprocess.run(run, check=False, capture_output=True)  # traffic may be called unusable
    given = bare_files(folder)
    script = folder / "pool.py"
    script.write_text(POOL % (SECONDS, JOBS), encoding="utf-8")
    ours, peer = [], []
    for _ in range(repeats):
        ours.append(spent_by(test))
        peer.append(spent_by([sys.executable, str(script)], given="\n".join(given)))
    runs = len(scenarios) * len(SEEDS)
    for who, spent in (("odscen test", ours), ("bare pool", peer)):
        cpu, wall = (statistics.median(one[part] for one in spent) for part in (0, 1))
        print(
            f"{who}: {wall:.1f} s of wall time, {cpu:.1f} CPU s, {cpu / JOBS:.1f} of each of "
            f"{JOBS} cores, {cpu / runs:.3f} CPU s for each of {runs} runs"
        )
    ratio = statistics.median(a[0] / b[0] for a, b in zip(ours, peer, strict=True))
    print(f"ratio of CPU {ratio:.1f}; aim: under 60 s")


def written(folder: Path, number: int) -> tuple[Path, list[Path]]:
    """A suite of so many scenarios, sampled on the maps that ship in turn."""
    workspace = Workspace.open(folder / "workspace")
    maps = [workspace.add_map(path).name for path in shipped_maps()]
    config = SamplingConfig(actors_max=ACTORS, duration=SECONDS)
    files: list[Path] = []
    for index, name in enumerate(maps):
        count = number // len(maps) + (index < number % len(maps))
        settings = GenerationSettings(map_name=name, count=count, seed=1, fill=0.5, config=config)
        files += generate(workspace, settings=settings)
    suite = folder / "suite.toml"
    suite.write_text(
        f'name = "many"\nscenarios = ["workspace/scenarios/*.scenario.json"]\n'
        f'baselines = "baselines"\nseeds = {list(SEEDS)}\nusable = false\n',
        encoding="utf-8",
    )
    return suite, files


def bare_files(folder: Path) -> list[str]:
    """SUMO's files of all runs, beside nothing else."""
    given = []
    for config in sorted(folder.glob(f"seed-*/*/{layout.SUMO_FOLDER}/{layout.CONFIG_FILE}")):
        run = config.parent.parent
        copy = folder / "bare" / f"{run.parent.name}-{run.name}"
        shutil.copytree(config.parent, copy)
        given.append(str(copy / config.name))
    return given


if __name__ == "__main__":
    main()
