"""Rules of real servers that the stand-in has, and that what is sent by us takes into account."""

from __future__ import annotations

from pathlib import Path

import pytest

from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.server.batch import Batch
from odscen.carla.server.carla_server import Server
from odscen.carla.server.client import Address
from odscen.sumo.realize.run_settings import RunSettings
from odscen.workspace.store import Workspace
from tests.carla.conftest import MAPS, Sample
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

CROSSING, TOWN = MAPS / "signal_crossing.xodr", MAPS / "town_5x5.xodr"
_WALL_HEIGHT, _ADDITIONAL_WIDTH = 2, 3
"""Of the parameters by which a world is made."""


def address_of(server: StandIn) -> Address:
    return Address(server.host, server.port, 10.0)


def test_lights_that_change_alone_are_shown_by_the_next_tick_of_a_server_with_several_threads() -> (
    None
):
    with (
        StandIn(CROSSING, late_calls="call") as stand_in,
        Server(address_of(stand_in)) as server,
    ):
        server.synchronize(0.05)
        lights = server.take_lights().values()
        for state in ("Green", "Yellow", "Red", "Green"):
            server.apply(Batch(signals=dict.fromkeys(lights, state)))
            assert set(server.light_states().values()) == {state}


def test_a_generated_world_has_no_walls_and_roads_of_the_maps_width() -> None:
    with StandIn(TOWN) as stand_in, Server(address_of(stand_in)) as server:
        server.load_opendrive(CROSSING.read_text(encoding="utf-8"))
        sent = stand_in.generation()
    assert (sent[_WALL_HEIGHT], sent[_ADDITIONAL_WIDTH]) == (0.0, 0.0)


def sleep_beyond(stand_in: StandIn, metres: float) -> None:
    """Let actors be dormant from so far away."""
    world = carla.Client(stand_in.host, stand_in.port).get_world()
    settings = world.get_settings()
    settings.actor_active_distance = metres
    world.apply_settings(settings)


def test_a_large_map_without_a_hero_survives_pedestrians_far_from_its_spectator(
    workspace: Workspace, sample: Sample, tmp_path: Path
) -> None:
    path = sample(TOWN, seed=3, fill=0.2)
    with StandIn(TOWN, large_map=True) as stand_in:
        sleep_beyond(stand_in, 150.0)
        result, report = cosim(
            workspace,
            path,
            CosimOptions(address_of(stand_in), tick=0.25),
            out=tmp_path,
            settings=RunSettings(until=2.0, step_length=0.5),
        )
        walkers = [a for a in stand_in.actors() if a["type_id"].startswith("walker.")]
    assert (result.status, report.error) == ("completed", None)
    assert report.spawned > 5
    assert walkers == []


def test_a_dormant_walker_that_is_put_somewhere_ends_the_server() -> None:
    with StandIn(CROSSING, large_map=True, refuse_grounded=False) as stand_in:
        sleep_beyond(stand_in, 10.0)
        client = carla.Client(stand_in.host, stand_in.port)
        client.set_timeout(1.0)
        world = client.get_world()
        blueprint = world.get_blueprint_library().filter("walker.pedestrian.*")[0]
        far = carla.Transform(carla.Location(60.0, 0.0, 1.0))
        walker = world.spawn_actor(blueprint, far)
        world.wait_for_tick(2.0)
        world.wait_for_tick(2.0)
        command = carla.command.ApplyWalkerState(walker.id, far, 1.0)
        with pytest.raises(RuntimeError, match="time-out"):
            client.apply_batch_sync([command], False)
        assert stand_in.has_died()
