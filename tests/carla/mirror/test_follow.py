"""Another client ticks: the mirror goes by the server's clock, and never ticks itself."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from odscen.base.errors import CarlaError, InputError
from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from tests.carla.conftest import MAPS, hero_pose, scenario_of
from tests.carla.driver import Car, Driver
from tests.carla.observer import Observer
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

WEAVE = MAPS / "motorway_weave.xodr"
TICK, STEP = 0.1, 0.5
ACTOR = {
    "id": "a", "category": "car", "spawn": "2.1.-1.40", "goal": "4.1.-1.200", "speed": 20.0,
}  # fmt: skip


@pytest.mark.slow
def test_a_run_goes_by_the_clock_of_the_client_that_ticks(
    workspace: Workspace, tmp_path: Path
) -> None:
    path = scenario_of(workspace, WEAVE, [ACTOR], tmp_path)
    with (
        StandIn(WEAVE, map_name=WEAVE.stem, refuse_grounded=False) as server,
        Driver(
            server, Car(hero_pose(workspace, WEAVE, "36.0.-1.40"), [(0.0, 0.0)]), led=TICK
        ) as driver,
    ):
        client = carla.Client(server.host, server.port)
        client.set_timeout(10.0)
        before = client.get_world().get_settings()
        with Observer(server, tmp_path / "seen.json", ego="stranger") as observer:
            result, report = cosim(
                workspace,
                path,
                CosimOptions(
                    Address(server.host, server.port, 30.0),
                    follow=True,
                ),
                out=tmp_path,
                settings=RunSettings(until=6.0, step_length=STEP),
            )
        assert client.get_world().get_settings() == before
    assert driver.ticks_of_others == 0
    assert (result.status, report.error, report.spawned) == ("completed", None, 1)
    seen = [(frame.elapsed, frame.users["a"][0]) for frame in observer.frames if "a" in frame.users]
    elapsed, x = np.array(seen)[:-1].T
    assert len(x) > 40
    assert np.diff(elapsed) == pytest.approx(TICK, abs=1e-6)
    rows = pl.read_parquet(result.folder / "trajectories.parquet")
    driven = rows["vehicle_x"].to_numpy()
    # Where it is seen says when that was in SUMO: as late all the time, but for ticks that were
    # made before their batch came.
    time = np.interp(x - x[0], driven - driven[0], rows["timestep_time"].to_numpy())
    apart = elapsed - time
    late = np.abs(apart - np.median(apart))
    assert np.median(late) <= 1e-3
    assert len(np.unique(np.round(x, 3))) > 2 * rows.height, "between SUMO's steps as well"


def test_what_only_a_ticking_client_can_do_is_refused() -> None:
    for options in (
        CosimOptions(follow=True, tick=0.05),
        CosimOptions(follow=True, sensed_speed=True),
    ):
        with pytest.raises(InputError, match="another client makes the ticks"):
            options.check()


@pytest.mark.slow
def test_a_server_that_no_client_ticks_ends_in_a_message(
    workspace: Workspace, tmp_path: Path
) -> None:
    path = scenario_of(workspace, WEAVE, [ACTOR], tmp_path)
    with StandIn(WEAVE, map_name=WEAVE.stem) as server:
        client = carla.Client(server.host, server.port)
        client.set_timeout(10.0)
        world = client.get_world()
        settings = world.get_settings()
        settings.synchronous_mode, settings.fixed_delta_seconds = True, TICK
        world.apply_settings(settings)
        options = CosimOptions(Address(server.host, server.port, 1.0), follow=True)
        with pytest.raises(CarlaError, match="no client has ticked"):
            cosim(workspace, path, options, out=tmp_path)
