"""Every map with the network of netconvert: sampled, run, reported, asked for as the page does.

Each map is added by ``odscen maps add --converter netconvert``, three scenarios are sampled on it,
run, and all that the page shows of map and runs is asked of the server. There is no peer: what
netconvert refuses is named with its words, and anything else that fails is a defect.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from starlette.testclient import TestClient

from bench.common import shared_maps
from odscen.app.generation import generate
from odscen.app.running import batches
from odscen.app.scenarios import SUFFIX
from odscen.base.errors import OdscenError
from odscen.cli.map_commands import names_for
from odscen.figures.measures.summary import actors_from_json
from odscen.maps.shipped import shipped_maps
from odscen.maps.store import Workspace
from odscen.scenario.document.sampling_config import SamplingConfig
from odscen.scenario.sampling.generation_settings import GenerationSettings
from odscen.web.application import create_app

if TYPE_CHECKING:
    from collections.abc import Iterator

    from odscen.sumo.runner.run_folder import Run

SCENARIOS = 3
"""Of each map."""
UNTIL = 3600.0
"""Seconds of a scenario, at most."""
FILL = 0.5
"""Share of the largest number of actors that fit."""


def main() -> None:
    real = shared_maps()
    if real is None:
        print("no real maps here (set ODSCEN_TEST_MAPS): shipped maps only")
    sources = [*(sorted(real.glob("*/*.xodr")) if real else []), *shipped_maps()]
    start = time.perf_counter()
    total: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        workspace = Workspace.open(Path(folder))
        with TestClient(create_app(workspace), base_url="http://localhost") as client:
            for source, name in zip(sources, names_for(sources, None), strict=True):
                found = _counts(workspace, client, source, name)
                total.update(found)
                print(f"{name:30} {_words(found)}", flush=True)
    print(f"{'all':30} {_words(total)}")
    print(f"{time.perf_counter() - start:.0f} s in all")


def _counts(workspace: Workspace, client: TestClient, source: Path, name: str) -> Counter[str]:
    """What came of one map; a reason is printed for whatever is refused or fails."""
    found: Counter[str] = Counter(maps=1)
    refusal = _add(workspace, source, name)
    if refusal is not None:
        print(f"{name}: {refusal}")
        return found
    found["taken"] = 1
    found.update(_answers(client, map_paths(name)))
    settings = GenerationSettings(
        map_name=name, count=SCENARIOS, seed=1, fill=FILL, config=SamplingConfig(duration=UNTIL)
    )
    try:
        paths = generate(workspace, settings=settings)
    except OdscenError as error:
        print(f"{name}: no scenario: {error}")
        return found
    for run in batches.run_many(workspace, paths):
        found.update(_outcome(run))
        lights = client.get(f"/api/maps/{name}").json()["lights"]
        found.update(_answers(client, run_paths(run.folder.name, lights)))
        found["reports"] += (run.folder / "report.html").is_file()
    for path in paths:
        found.update(_answers(client, [f"/api/scenarios/{path.name.removesuffix(SUFFIX)}"]))
    return found


def _add(workspace: Workspace, source: Path, name: str) -> str | None:
    """Add a map by the command; why it is refused, or ``None``."""
    command = [
        sys.executable, "-m", "odscen", "maps", "add", str(source), "--name", name, "--json",
        "--converter", "netconvert", "--workspace", str(workspace.root),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    (row,) = json.loads(done.stdout)["maps"]
    return str(row["error"]["message"]) if "error" in row else None


def _outcome(run: Run) -> Counter[str]:
    if run.status == "failed":
        print(f"{run.folder.name}: {run.summary['error']}")
    actors = actors_from_json((run.folder / "actors.json").read_text(encoding="utf-8"))
    return Counter(
        scenarios=1,
        failed=run.status == "failed",
        actors=len(actors),
        inserted=sum(one.inserted is not None for one in actors),
        arrived=sum(one.arrived is not None for one in actors),
        teleported=sum(one.teleports > 0 for one in actors),
        collided=sum(one.collisions > 0 for one in actors),
    )


def map_paths(name: str) -> Iterator[str]:
    """What the page asks for when it shows a map."""
    yield f"/api/maps/{name}"
    for part in ("preview.svg", "drawing", "graph", "report"):
        yield f"/api/maps/{name}/{part}"


def run_paths(run: str, lights: list[dict[str, Any]]) -> Iterator[str]:
    """What the page asks for when it shows a finished run, with the program of each light."""
    yield f"/api/runs/{run}"
    for part in ("summary", "content", "events", "curves", "trajectories", "signals", "files"):
        yield f"/api/runs/{run}/{part}"
    yield f"/api/runs/{run}/report.html"
    for light in lights:
        yield f"/api/runs/{run}/signals/{light['names'][0]}"


def _answers(client: TestClient, paths: Iterator[str] | list[str]) -> Counter[str]:
    found: Counter[str] = Counter({"wrong answers": 0})
    for path in paths:
        answer = client.get(path)
        found["answers"] += 1
        if answer.status_code != 200:
            found["wrong answers"] += 1
            print(f"{path}: {answer.status_code} {answer.text[:300]}")
    return found


def _words(found: Counter[str]) -> str:
    return ", ".join(f"{count} {what}" for what, count in found.items())
