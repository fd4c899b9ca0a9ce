"""Sample many scenarios over real and shipped maps, run them, and print what became of everybody.

``python -m bench scenarios`` runs 200. There is no peer: nobody else samples on a lane graph and
says how exactly the bodies stand. Aim: all load, 99 % inserted within 0.10 m, 97 % arrive.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections import Counter, defaultdict
from pathlib import Path

from bench.common import shared_maps
from odscen.app.generation import generate
from odscen.app.running import batches
from odscen.cli.map_commands import names_for
from odscen.figures.measures.summary import ActorOutcome, actors_from_json
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.sampling.generation_settings import GenerationSettings

COUNT = int(os.environ.get("ODSCEN_BENCH_SCENARIOS", "200"))
UNTIL = 3600.0
EXACT = 0.10
"""Metres that a body's centre may be from its place."""


def main() -> None:
    real = shared_maps()
    towns = sorted(real.glob("carla-*/*.xodr")) if real else []
    if not towns:
        print("no real maps here (set ODSCEN_TEST_MAPS): shipped maps only")
    sources = [*towns, *shipped_maps()]
    with tempfile.TemporaryDirectory() as folder:
        workspace = Workspace.open(Path(folder))
        entries = [
            workspace.add_map(path, name=name)
            for path, name in zip(sources, names_for(sources, None), strict=True)
        ]
        config = SamplingConfig(duration=UNTIL)
        start = time.perf_counter()
        outcomes: dict[str, list[ActorOutcome]] = defaultdict(list)
        scenarios: Counter[str] = Counter()
        failed: Counter[str] = Counter()
        for index, entry in enumerate(entries):
            count = COUNT // len(entries) + (index < COUNT % len(entries))
            paths = generate(
                workspace,
                settings=GenerationSettings(
                    map_name=entry.name, count=count, seed=1000 * index, config=config
                ),
            )
            results = batches.run_many(workspace, paths, processes=os.cpu_count() or 1)
            scenarios[entry.name] += len(paths)
            for result in results:
                if result.status == "failed":
                    failed[entry.name] += 1
                    print(result.folder.name, result.summary["error"], file=sys.stderr)
                text = (result.folder / "actors.json").read_text(encoding="utf-8")
                outcomes[entry.name] += actors_from_json(text)
            _row(entry.name, scenarios[entry.name], failed[entry.name], outcomes[entry.name])
        everybody = [one for some in outcomes.values() for one in some]
        _row("all", scenarios.total(), failed.total(), everybody)
        print(f"{time.perf_counter() - start:.0f} s in all")


def _row(name: str, scenarios: int, failed: int, actors: list[ActorOutcome]) -> None:
    planned = len(actors)
    errors = sorted(a.insertion_error for a in actors if a.insertion_error is not None)
    exact = sum(error <= EXACT for error in errors)
    arrived = sum(a.arrived is not None for a in actors)
    print(
        f"{name:28} {scenarios:4} scenarios {failed:2} failed {planned:6} actors "
        f"inserted {len(errors) / planned:7.2%} exact {exact / planned:7.2%} "
        f"(largest error {errors[-1] if errors else 0:.3f} m) arrived {arrived / planned:7.2%} "
        f"teleported {sum(a.teleports > 0 for a in actors):3} "
        f"collided {sum(a.collisions > 0 for a in actors):3}",
        flush=True,
    )
