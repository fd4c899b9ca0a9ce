"""Time and memory as the network and its traffic grow, against bare ``sumo``.

``python -m bench network_size [--maps MAP...] [--vehicles N...] [--seconds S]``: each map (the
shipped town, and ten of it joined, if not given; ``python -m tools.make_maps --only towns_100``
writes a hundred) is added, scenarios with so many vehicles under way at once are sampled on it, and
each is run by ``odscen run --no-report`` and by ``sumo`` from the same files with the same output.
Wall seconds, CPU seconds and memory of each, with all processes that it has started: CPU seconds
are the figure to compare on a machine with other work. Memory is the most that all of them held at
one time (pages that they share count once for each), looked at five times a second.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import psutil

from odscen.maps.shipped import shipped_maps
from odscen.runs import layout
from odscen.sumo.runner.forked_worker import worker_environment
from tools.make_maps.__main__ import map_text

COMMAND = (sys.executable, "-m", "odscen")
BUILD = ("--build-memory", "16", "--build-minutes", "120")
PEER = worker_environment()
"""With the allocator that the runs have."""


class Cost(NamedTuple):
    """Of a command with all that it has started: seconds, bytes, and the mean load of the machine.

    The load is that of all processes, of other work too.
    """

    wall: float
    cpu: float
    memory: int
    load: float
    code: int

    def __str__(self) -> str:
        return (
            f"{self.wall:.0f} s, {self.cpu:.1f} CPU s, {self.memory / 1e6:,.0f} MB "
            f"(load {self.load:.0f})"
        )


def main() -> None:
    options = argparse.ArgumentParser(prog="bench network_size")
    options.add_argument("--maps", nargs="+", type=Path)
    options.add_argument("--vehicles", type=int, nargs="+", default=[1000])
    options.add_argument("--seconds", type=float, default=120.0, help="simulated")
    options.add_argument("--workspace", type=Path, help="one that has the maps already")
    asked = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="odscen-bench-") as name:
        folder = Path(name)
        for path in asked.maps or made(folder):
            workspace = asked.workspace or folder / "workspace"
            if asked.workspace is None:
                added(path, workspace)
            for vehicles in asked.vehicles:
                driven(path.stem, workspace, folder, vehicles, asked.seconds)


def made(folder: Path) -> list[Path]:
    (town,) = (path for path in shipped_maps() if path.stem == "town_5x5")
    ten = folder / "towns_10.xodr"
    ten.write_text(map_text(ten.stem), encoding="utf-8")
    return [town, ten]


def added(path: Path, workspace: Path) -> None:
    add = [*COMMAND, "maps", "add", str(path), "--workspace", str(workspace), *BUILD]
    cost = measured(add)
    info = json.loads((workspace / "maps" / path.stem / "map.json").read_text(encoding="utf-8"))
    graph, statistics = info["graph"], info["statistics"]
    print(
        f"{path.stem}: {path.stat().st_size / 1e6:.1f} MB, {statistics['junctions']:,} junctions, "
        f"{statistics['driving_lane_length'] / 1e3:,.0f} km of driving lanes, "
        f"{graph['nodes']:,} nodes, {graph['pedestrian_nodes']:,} of walks; maps add {cost}",
        flush=True,
    )


def driven(name: str, workspace: Path, folder: Path, vehicles: int, seconds: float) -> None:
    """Run so many vehicles from a standstill all over the map, and the same in bare ``sumo``."""
    config = folder / "vehicles.json"
    sampling = {
        "actors_max": vehicles, "pedestrian_share": 0.0, "duration": seconds,
        "roi": {"segments": {"kind": "constant", "value": 1e6}},
        "fill": {"kind": "constant", "value": 1.0},
    }  # fmt: skip
    config.write_text(json.dumps(sampling), encoding="utf-8")
    out, given = folder / f"{name}-{vehicles}", ["--workspace", str(workspace)]
    sampled = measured(
        [*COMMAND, "generate", "--map", name, "--config", str(config), "--out", str(out), *given]
    )
    print(f"  {vehicles:,} vehicles, {seconds:g} s: sampled {sampled}", flush=True)
    (scenario,) = out.glob("*.scenario.json")
    ours = measured([*COMMAND, "run", str(scenario), "--out", str(out), "--no-report", *given])
    print(f"    odscen {ours}", flush=True)
    (run,) = (path.parent for path in out.glob(f"*/{layout.SUMO_FOLDER}"))
    plan = json.loads((run / layout.PLAN_FILE).read_text(encoding="utf-8"))
    bare = Path(shutil.copytree(run / layout.SUMO_FOLDER, out / "bare"))
    peer = measured([str(binary()), "-c", str(bare / layout.CONFIG_FILE)], environment=PEER)
    print(
        f"    sumo {peer}; {len(plan['actors']):,} in the plan; ratio of CPU "
        f"{ours.cpu / peer.cpu:.2f}, of memory {ours.memory / peer.memory:.1f}"
        f"{'' if not ours.code and not peer.code else f'; exit codes {ours.code}, {peer.code}'}",
        flush=True,
    )
    shutil.rmtree(out)


def binary() -> Path:
    import sumo

    return Path(sumo.SUMO_HOME) / "bin" / "sumo"


def measured(command: Sequence[str], *, environment: dict[str, str] | None = None) -> Cost:
    """Carry out a command; its process and all below it are looked at while it goes on."""
    began = time.perf_counter()
    process = psutil.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    most, spent, loads = 0, dict[int, float](), list[float]()
    while process.poll() is None:
        held = 0
        for one in (process, *_below(process)):
            with suppress(psutil.Error):
                times = one.cpu_times()
                spent[one.pid] = times.user + times.system
                held += one.memory_info().rss
        most = max(most, held)
        loads.append(os.getloadavg()[0])
        time.sleep(0.2)
    wall, load = time.perf_counter() - began, sum(loads) / max(len(loads), 1)
    return Cost(wall, sum(spent.values()), most, load, process.returncode)


def _below(process: psutil.Popen) -> list[psutil.Process]:
    with suppress(psutil.Error):
        return process.children(recursive=True)
    return []


if __name__ == "__main__":
    main()
