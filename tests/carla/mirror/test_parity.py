"""The comparison of a mirrored run with SUMO sees what goes wrong, not only what goes right."""

from __future__ import annotations

import json
from pathlib import Path

import polars as pl
import pytest

from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.in_step import Step
from tests.carla.conftest import MAPS, Sample
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

CROSSING = MAPS / "signal_crossing.xodr"
MOVED = 3.0
"""Simulated seconds at which somebody else interferes."""


@pytest.mark.slow
def test_what_somebody_else_does_to_the_mirror_is_in_the_comparison(
    workspace: Workspace, sample: Sample, tmp_path: Path
) -> None:
    path = sample(CROSSING, seed=5)
    with StandIn(CROSSING) as standin:
        address = Address(standin.host, standin.port, 5.0)
        client = carla.Client(standin.host, standin.port)
        client.set_timeout(5.0)

        light = next(iter(client.get_world().get_actors().filter("traffic.traffic_light*")))

        def interfere(step: Step) -> bool:
            """After this step, switch a light; the mirror sets only those that change."""
            if step.time == MOVED:
                state, other = light.get_state(), carla.TrafficLightState
                light.set_state(other.Red if state != other.Red else other.Green)
            return True

        options = CosimOptions(address=address, on_step=interfere)
        result, report = cosim(
            workspace, path, options, out=tmp_path, settings=RunSettings(until=6.0)
        )
        assert report.error is None
    folder = result.folder
    figures = json.loads((folder / "parity.json").read_text(encoding="utf-8"))
    assert figures["share_mirrored"] == 1.0
    assert figures["position_error_m"]["max"] <= 0.05
    assert figures["heading_error_deg"]["max"] <= 0.5
    assert figures["lights"]["wrong"] > 0
    [wrong] = figures["lights"]["worst"]
    assert wrong["since"] > MOVED
    states = pl.read_parquet(folder / "parity.parquet")
    recorded = pl.read_parquet(folder / "trajectories.parquet")
    assert states["time"].n_unique() == recorded["timestep_time"].n_unique()
    assert "The two worlds differ in places" in (folder / "parity.html").read_text("utf-8")
