"""CARLA's traffic lights lead: SUMO shows what they show, and its traffic obeys."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import polars as pl
import pytest

from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.carla.conftest import MAPS, Sample
from tests.carla.observer import Observer
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

CROSSING = MAPS / "signal_crossing.xodr"
STEP, SECONDS = 0.5, 40.0


def test_sumos_lights_show_what_carlas_show_one_step_before(
    workspace: Workspace, sample: Sample, tmp_path: Path
) -> None:
    path = sample(CROSSING, seed=3, fill=0.3)
    with (
        StandIn(CROSSING, map_name=CROSSING.stem) as server,
        Observer(server, tmp_path / "seen.json") as observer,
    ):
        result, report = cosim(
            workspace,
            path,
            CosimOptions(Address(server.host, server.port), tick=STEP, carla_signals=True),
            out=tmp_path,
            settings=RunSettings(until=SECONDS, step_length=STEP),
        )
    assert (result.status, report.error) == ("completed", None)
    frames = observer.frames[-report.ticks - 2 :]
    changes = sum(a.lights != b.lights for a, b in itertools.pairwise(frames))
    assert changes >= 4, "the server's own programs have run"
    assert {state for frame in frames for state in frame.lights.values()} >= {"Green", "Red"}
    lights = pl.read_parquet(result.folder / "parity_lights.parquet").filter(pl.col("time") > 1.5)
    assert lights.height > 100
    assert lights.filter(pl.col("sumo") != pl.col("carla")).height == 0
    assert lights.filter(pl.col("sumo") == "Green").height > 20
    assert lights["time"].n_unique() > 30
    events = json.loads((result.folder / "events.json").read_text())["events"]
    assert [one for one in events if one["kind"] == "arrived"]
    assert not [one for one in events if one["kind"] == "collision"]
