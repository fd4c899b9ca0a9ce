"""Clients of other releases than the one that is installed, against a stand-in that speaks theirs.

``ODSCEN_CARLA_CLIENTS`` names a folder with one for each release, such as ``0.9.15``, into which
its package was installed: ``pip install --no-deps --target 0.9.15 carla-0-9-15``. With variables
``PYTHONPATH=FOLDER/0.9.15`` and ``ODSCEN_STANDIN_RELEASE=0.9.15`` all other tests are run with it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from odscen.carla.server.releases import RELEASES
from odscen.maps.store import Workspace
from tests.carla.conftest import MAPS, Sample
from tests.carla_standin.process import USUAL, StandIn
from tests.carla_standin.wire import SPOKEN

CROSSING = MAPS / "signal_crossing.xodr"
CLIENTS = os.environ.get("ODSCEN_CARLA_CLIENTS")
OTHERS = sorted(SPOKEN.keys() - {USUAL})
TIMED = {"ticks with 100 actors", "answers about the ground"}
"""Lines that a busy machine decides."""


def test_the_stand_in_speaks_each_release_that_is_known() -> None:
    assert [release.number for release in RELEASES] == [*SPOKEN]


def cosim(release: str, workspace: Workspace, out: Path, *words: str | Path) -> dict[str, Any]:
    """What ``odscen cosim --json`` says with the client of a release."""
    client = Path(CLIENTS or "") / release
    if not CLIENTS or not client.is_dir():
        pytest.skip(f"ODSCEN_CARLA_CLIENTS has no client of {release}")
    with StandIn(CROSSING, speaks=release) as server:
        done = subprocess.run(
            [
                sys.executable, "-m", "odscen", "cosim", *words, "--json", "--out", out,
                "--carla", f"{server.host}:{server.port}", "--workspace", workspace.root,
            ],
            env={**os.environ, "PYTHONPATH": str(client)},
            capture_output=True, text=True, check=False,
        )  # fmt: skip
    assert done.returncode in (0, 1), done.stderr
    printed: dict[str, Any] = json.loads(done.stdout)
    return printed


@pytest.mark.slow
@pytest.mark.parametrize("release", OTHERS)
def test_the_self_check_with_the_client_of_another_release_differs_in_nothing(
    release: str, workspace: Workspace, tmp_path: Path
) -> None:
    workspace.add_map(CROSSING)
    found = cosim(release, workspace, tmp_path, "--selfcheck")
    assert found["versions"]["carla"] == found["versions"]["server"] == release
    lines = [check for check in found["checks"] if check["name"] not in TIMED]
    assert {check["name"]: check["seen"] for check in lines if check["state"] != "ok"} == {}
    assert len(lines) == 18


@pytest.mark.slow
@pytest.mark.parametrize("release", OTHERS)
def test_a_run_is_mirrored_exactly_with_the_client_of_another_release(
    release: str, workspace: Workspace, sample: Sample, tmp_path: Path
) -> None:
    path = sample(CROSSING, seed=5)
    summary = cosim(release, workspace, tmp_path, path, "--until", "20")
    assert summary["status"] == "completed"
    assert any(release in words for words in summary["carla"]["warnings"])
    (file,) = tmp_path.rglob("parity.json")
    figures = json.loads(file.read_text(encoding="utf-8"))
    assert figures["share_mirrored"] == 1.0
    assert figures["position_error_m"]["max"] <= 0.001
    assert figures["heading_error_deg"]["max"] <= 0.01
    assert figures["lights"]["samples"] > 0
    assert figures["lights"]["wrong"] == 0
