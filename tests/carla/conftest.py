"""Maps, scenarios on them, and what SUMO alone says of a run."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from odscen.app.generation import generate
from odscen.lanegraph.query import node_index
from odscen.maps.store import Workspace
from odscen.scenario.document.json_form import dumps
from odscen.scenario.document.scenario_document import Actor, MapReference, Scenario
from odscen.scenario.sampling.generation_settings import GenerationSettings

MAPS = Path(__file__).parents[2] / "maps"
Sample = Callable[..., Path]

_LIGHTS = """
import json, sys
import libsumo
libsumo.start(["sumo", "--configuration-file", sys.argv[1], "--fcd-output", "/dev/null"])
told = []
for _ in range(int(sys.argv[2])):
    libsumo.simulationStep()
    light = libsumo.trafficlight
    told.append({name: light.getRedYellowGreenState(name) for name in light.getIDList()})
libsumo.close()
print("\\n" + json.dumps(told))
"""


def lights_of_sumo_alone(folder: Path, steps: int) -> list[dict[str, str]]:
    """State of each traffic light after each step, from SUMO without anything of ours."""
    done = subprocess.run(
        [sys.executable, "-c", _LIGHTS, str(folder / "sumo" / "scenario.sumocfg"), str(steps)],
        capture_output=True,
        text=True,
        check=True,
    )
    return list(json.loads(done.stdout.splitlines()[-1]))


def scenario_of(workspace: Workspace, xodr: Path, actors: list[dict[str, Any]], out: Path) -> Path:
    entry = workspace.add_map(xodr)
    scenario = Scenario(
        format="odscen-scenario",
        version=1,
        name="ego",
        map=MapReference(name=entry.name, sha256=entry.sha256),
        roi=tuple(entry.graph().segments.ids),
        actors=tuple(Actor(**actor) for actor in actors),
    )
    path = out / "ego.scenario.json"
    path.write_text(dumps(scenario), encoding="utf-8")
    return path


def hero_pose(workspace: Workspace, xodr: Path, node: str) -> tuple[float, float, float, float]:
    graph = workspace.map(xodr.stem).graph()
    i = node_index(graph, node)
    lanes = graph.lanes
    return (
        float(lanes.x[i]), -float(lanes.y[i]), float(lanes.z[i]), -math.degrees(lanes.hdg[i])
    )  # fmt: skip


@pytest.fixture(scope="session")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    return Workspace.open(tmp_path_factory.mktemp("cosim"))


@pytest.fixture(scope="session")
def sample(workspace: Workspace) -> Sample:
    """Return a function that samples a scenario on a map, shipped or named by its file."""

    def sampled(xodr: Path, *, seed: int = 1, fill: float = 0.2, segments: int = 12) -> Path:
        workspace.add_map(xodr)
        [path] = generate(
            workspace,
            settings=GenerationSettings(
                map_name=xodr.stem, seed=seed, fill=fill, roi_segments=segments
            ),
        )
        return path

    return sampled
