"""Sampled scenarios on signalised maps, mirrored and held against SUMO's recording.

``python -m bench.carla_fidelity [COUNT [SECONDS]]``: 100 scenarios of 60 s if nothing is said. The
judge is that of ``tests/carla/mirror/test_mirror_on_maps.py``; runs that fail it are named, and
the exit code is 1 then.
"""

from __future__ import annotations

import collections
import json
import sys
import tempfile
import traceback
from pathlib import Path

import numpy as np

import tests.carla.mirror.test_mirror_on_maps as judge
from bench.common import shared_maps
from odscen.app.generation import generate
from odscen.maps.store import Workspace
from odscen.scenario.sampling.generation_settings import GenerationSettings

SHIPPED = ("signal_crossing", "town_5x5")
SHARED = ("carla-2019/Town05", "carla-2019/Town03")


def main() -> None:
    count, seconds = (*map(float, sys.argv[1:]), *(100, 60)[len(sys.argv) - 1 :])
    judge.SECONDS = seconds
    folder = shared_maps()
    files = [Path(__file__).parents[1] / "maps" / f"{name}.xodr" for name in SHIPPED]
    files += [folder / f"{name}.xodr" for name in SHARED] if folder else []
    off: dict[str, list[float]] = collections.defaultdict(list)
    categories: collections.Counter[str] = collections.Counter()
    failed: list[str] = []
    with tempfile.TemporaryDirectory() as root:
        workspace = Workspace.open(Path(root))
        for number in range(int(count)):
            xodr = files[number % len(files)]
            workspace.add_map(xodr)
            [path] = generate(
                workspace,
                settings=GenerationSettings(
                    map_name=xodr.stem, seed=number, fill=0.15, roi_segments=15
                ),
            )
            with tempfile.TemporaryDirectory() as out:
                try:
                    found = judge.check(workspace, path, xodr, Path(out))
                except AssertionError:
                    traceback.print_exc()
                    failed.append(path.name)
                    continue
                [plan] = Path(out).glob("*/plan.json")
                actors = json.loads(plan.read_text())["actors"]
            categories.update(actor["category"] for actor in actors)
            for name, values in found.items():
                off[name] += values
            worst = ", ".join(f"{name} {max(values):.4f}" for name, values in found.items())
            print(
                f"{number + 1:3d} {path.name}: {len(actors)} road users; worst {worst}", flush=True
            )
    print(f"{int(count)} scenarios of {seconds:g} s; {dict(categories)}")
    print(f"failed: {', '.join(failed) or 'none'}")
    for name, values in off.items():
        median, high = np.percentile(values, [50, 99])
        print(f"{name}: {len(values):,}; {median:.5f}, 99 % {high:.5f}, worst {max(values):.5f}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
