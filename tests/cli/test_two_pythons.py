"""``odscen cosim`` on Python 3.13, for which CARLA has no client, with a Python of 3.12 beside it.

``make test-newest`` makes both environments in ``build/versions``, and runs this.
"""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from odscen.app.generation import generate
from odscen.base.version import __version__
from odscen.maps.store import Workspace
from odscen.scenario.sampling.generation_settings import GenerationSettings
from tests.carla_standin.process import StandIn

ROOT = Path(__file__).parents[2]
CROSSING = ROOT / "maps" / "signal_crossing.xodr"


def python_of(version: str, *packages: str) -> Path:
    """Python of an environment of ``make test-newest``; skips where it is not there."""
    python = ROOT / "build" / "versions" / f"newest-{version}" / "bin" / "python"
    there = (
        python.is_file()
        and not subprocess.run(
            [python, "-c", f"import {', '.join(packages)}"], capture_output=True, check=False
        ).returncode
    )
    if not there:
        pytest.skip(f"no Python {version} with {', '.join(packages)}: make test-newest")
    return python


@pytest.mark.slow
def test_a_run_of_3_13_is_mirrored_by_the_client_of_3_12(tmp_path: Path) -> None:
    newest, with_client = python_of("3.13", "odscen"), python_of("3.12", "odscen", "carla")
    workspace = Workspace.open(tmp_path / "workspace")
    workspace.add_map(CROSSING)
    sampled = GenerationSettings(map_name=CROSSING.stem, seed=5, fill=0.2)
    (path,) = generate(workspace, settings=sampled)
    with StandIn(CROSSING) as server:
        command = [
            *(newest, "-m", "odscen", "cosim", path, "--carla", f"{server.host}:{server.port}"),
            *("--workspace", workspace.root, "--out", tmp_path / "runs", "--until", "20", "--json"),
        ]
        without, having = (
            subprocess.run(
                [*command, *words], capture_output=True, text=True, check=False, cwd=tmp_path,
                env={name: os.environ[name] for name in ("HOME", "PATH")},
            )
            for words in ([], ["--carla-python", with_client])
        )  # fmt: skip
    assert without.returncode == 2
    assert "--carla-python PATH" in without.stderr
    assert "CPython 3.11 or 3.12" in without.stderr
    assert having.returncode == 0, having.stderr
    summary = json.loads(having.stdout)
    assert summary["status"] == "completed"
    assert summary["versions"]["odscen"] == __version__
    assert summary["versions"]["python"].startswith("3.12")
    assert summary["carla"]["spawned"] > 10
    (file,) = tmp_path.rglob("parity.json")
    parity = json.loads(file.read_text(encoding="utf-8"))
    assert parity["share_mirrored"] == 1.0
    assert parity["position_error_m"]["max"] <= 0.001
    assert parity["heading_error_deg"]["max"] <= 0.01
    assert parity["lights"]["samples"] > 0
    assert parity["lights"]["wrong"] == 0
