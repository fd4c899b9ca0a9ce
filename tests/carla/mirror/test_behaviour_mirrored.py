"""Behaviour models drive in mirrored runs as in others, and the server shows what they do."""

from __future__ import annotations

import json
import shlex
import sys
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

from odscen.app.running.runs import run
from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.server.client import Address
from odscen.learning.behaviour.behaviour_model import BehaviourDoor
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.carla.conftest import MAPS, scenario_of
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

WEAVE = MAPS / "motorway_weave.xodr"
SECONDS, STEP = 6.0, 0.5
SERVE = """
from odscen.learning.behaviour.behaviour_messages import serve
from odscen.learning.behaviour.intelligent_driver import IntelligentDriver
serve(IntelligentDriver(headway=3.0))
"""
ACTORS = [
    {"id": name, "category": "car", "spawn": f"2.1.-1.{node}", "goal": "4.1.-1.200", "speed": 20.0,
     "initial_speed": 15.0}
    for name, node in (("behind", 20), ("ahead", 35))
]  # fmt: skip


@pytest.mark.slow
def test_a_model_of_another_program_drives_in_a_mirrored_run_as_it_does_alone(
    workspace: Workspace, tmp_path: Path
) -> None:
    path = scenario_of(workspace, WEAVE, ACTORS, tmp_path)
    program = tmp_path / "drive.py"
    program.write_text(SERVE, encoding="utf-8")
    outside = BehaviourDoor(command=shlex.join([sys.executable, str(program)]))
    inside = BehaviourDoor(name="idm", options={"headway": 3.0})
    plain = RunSettings(until=SECONDS, step_length=STEP)
    with StandIn(WEAVE, map_name=WEAVE.stem) as server:
        mirrored, report = cosim(
            workspace, path, CosimOptions(Address(server.host, server.port)),
            settings=replace(plain, behaviour=outside), out=tmp_path / "mirrored",
        )  # fmt: skip
    assert (mirrored.status, report.error, report.spawned) == ("completed", None, 2)
    alone = run(workspace, path, settings=replace(plain, behaviour=inside), out=tmp_path / "alone")
    by_sumo = run(workspace, path, settings=plain, out=tmp_path / "sumo")
    same = "trajectories.parquet"
    assert (mirrored.folder / same).read_bytes() == (alone.folder / same).read_bytes()
    assert way(by_sumo.trajectories()) - way(mirrored.trajectories()) > 1.0, "the model drives"
    figures = json.loads((mirrored.folder / "parity.json").read_text(encoding="utf-8"))
    assert figures["share_mirrored"] == 1.0
    assert figures["position_error_m"]["max"] <= 0.05
    assert figures["heading_error_deg"]["max"] <= 0.5


def way(table: pl.DataFrame) -> float:
    """Metres that the one behind has gone."""
    x = table.filter(pl.col("id") == "behind")["x"]
    return float(x[-1] - x[0])
