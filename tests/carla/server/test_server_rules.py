"""Rules of real servers that the stand-in has, and that what is sent by us takes into account."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.server.batch import Batch
from odscen.carla.server.carla_server import Server
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.in_step import Step
from tests.carla.conftest import MAPS, Sample, scenario_of
from tests.carla_standin.bumps import HALF, HIGH, LANE, bumps
from tests.carla_standin.generated import SIDEWALK_LIFT
from tests.carla_standin.process import StandIn
from tests.sumo.story_case import node_at, walk_node_at

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

CROSSING, TOWN = MAPS / "signal_crossing.xodr", MAPS / "town_5x5.xodr"
EDGE = (60.0, 9.125)
"""Where a sidewalk of the crossing ends."""
_WALL_HEIGHT, _ADDITIONAL_WIDTH, _SMOOTH = 2, 3, 4
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


@pytest.mark.slow
def test_a_generated_world_has_no_walls_and_roads_of_the_maps_width() -> None:
    with (
        StandIn(MAPS / "t_junction_signs.xodr") as stand_in,
        Server(address_of(stand_in)) as server,
    ):
        server.load_opendrive(CROSSING.read_text(encoding="utf-8"))
        sent = stand_in.generation()
        assert (sent[_WALL_HEIGHT], sent[_ADDITIONAL_WIDTH]) == (0.0, 0.0)
        x, y = EDGE
        assert server.ground_below(x, y - 0.05, 3.0, 5.0) == pytest.approx(SIDEWALK_LIFT)
        assert server.ground_below(x, y + 0.1, 3.0, 5.0) is None
        world = world_by_default(stand_in, CROSSING.read_text(encoding="utf-8"))
        wall = world.ground_projection(carla.Location(x, y + 0.1, 3.0), 5.0)
        assert wall.location.z == pytest.approx(SIDEWALK_LIFT + 1.0), "by default"


def world_by_default(stand_in: StandIn, xodr: str) -> Any:
    client = carla.Client(stand_in.host, stand_in.port)
    client.set_timeout(10.0)
    return client.generate_opendrive_world(xodr, carla.OpendriveGenerationParameters())


@pytest.mark.slow
def test_the_ground_in_junctions_of_a_generated_world_is_the_maps() -> None:
    xs = [-6.0, -2.0, 1.0, 3.0, 6.0]
    with StandIn(CROSSING) as stand_in, Server(address_of(stand_in)) as server:
        server.load_opendrive(bumps())
        assert stand_in.generation()[_SMOOTH] is False
        ours = [server.ground_below(x, LANE / 2, 3.0, 5.0) for x in xs]
        world = world_by_default(stand_in, bumps())
        assert stand_in.generation()[_SMOOTH] is True
        theirs = [world.ground_projection(carla.Location(x, LANE / 2, 3.0), 5.0) for x in xs]
    height = [HIGH * (1.0 - (x / HALF) ** 2) for x in xs]
    assert ours == pytest.approx(height, abs=0.002), "cross-sections are two metres apart"
    sunk = [a - b.location.z for a, b in zip(height, theirs, strict=True)]
    assert max(sunk) > 0.1, "where the other lane is lower the smoothed ground is not the map's"


def sleep_beyond(stand_in: StandIn, metres: float, *, tiles: float = 3000.0) -> None:
    """Let actors be dormant from so far away, and no tile be loaded beyond so many metres."""
    world = carla.Client(stand_in.host, stand_in.port).get_world()
    settings = world.get_settings()
    settings.actor_active_distance, settings.tile_stream_distance = metres, tiles
    world.apply_settings(settings)


@pytest.mark.slow
def test_the_egos_role_loads_the_tiles_on_whose_ground_pedestrians_walk(
    workspace: Workspace, tmp_path: Path
) -> None:
    kerb = 0.1
    workspace.add_map(TOWN)
    name = TOWN.stem
    actors = [
        {"id": "ego", "category": "car", "spawn": node_at(name, 215.0, 103.4),
         "goal": node_at(name, 390.0, 103.4), "speed": 3.0, "ego": True},
        {"id": "child", "category": "pedestrian", "spawn": walk_node_at(name, 240.0, 100.5),
         "goal": walk_node_at(name, 260.0, 100.5)},
    ]  # fmt: skip
    path = scenario_of(workspace, TOWN, actors, tmp_path)
    feet: list[float] = []
    with StandIn(TOWN, large_map=True, kerb=kerb) as stand_in:
        sleep_beyond(stand_in, 2000.0, tiles=60.0)  # the spectator is further away than that

        def look(_step: Step) -> bool:
            walkers = [a for a in stand_in.actors() if a["type_id"].startswith("walker.")]
            feet.extend(a["transform"][0][2] - 0.93 for a in walkers)
            return True

        result, report = cosim(
            workspace,
            path,
            CosimOptions(address_of(stand_in), on_step=look, parity=False),
            out=tmp_path,
            settings=RunSettings(until=4.0, step_length=0.5),
        )
    assert (result.status, report.error) == ("completed", None)
    ground = workspace.map(name).graph().walks.z.max()
    assert len(feet) > 5
    # In the first step the ego is not there yet, and so no tile; places are asked for ahead.
    assert max(abs(z - kerb - ground) for z in feet[3:]) < 0.03


@pytest.mark.slow
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


@pytest.mark.slow
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
