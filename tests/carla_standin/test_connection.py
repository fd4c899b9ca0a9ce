from __future__ import annotations

import time

import numpy as np
import pytest

from odscen.lanegraph.build_graphs import build_map_graph
from odscen.opendrive.parse import parse
from odscen.simulators.assets import shipped_assets
from tests.carla_standin.conftest import DELTA, MAPS, Connected, connect, synchronize
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="the real client asks the stand-in")


@pytest.mark.slow
def test_the_server_says_the_version_of_the_client(server: StandIn) -> None:
    client = connect(server)
    assert client.get_server_version() == client.get_client_version() == "0.9.16"


@pytest.mark.slow
def test_the_map_has_its_name_and_text(server: StandIn) -> None:
    road_map = connect(server).get_world().get_map()
    assert road_map.name == "Carla/Maps/Crossing"
    assert road_map.to_opendrive() == (MAPS / "signal_crossing.xodr").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["signal_crossing", "rural_hills", "left_hand_crossing"])
def test_spawn_points_float_above_lanes_and_look_along_them(name: str) -> None:
    with StandIn(MAPS / f"{name}.xodr") as server:
        road_map = connect(server).get_world().get_map()
        spawn_points = road_map.get_spawn_points()
    assert len(spawn_points) > 10
    for point in spawn_points:
        lane = road_map.get_waypoint(point.location).transform
        assert point.location.distance(lane.location) < 0.8
        for turn in (
            point.rotation.yaw - lane.rotation.yaw,
            point.rotation.pitch - lane.rotation.pitch,
        ):
            assert (turn + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=0.3)


@pytest.mark.slow
def test_waypoints_of_the_client_lie_on_the_lane_graph(server: StandIn) -> None:
    road_map = connect(server).get_world().get_map()
    odr = parse((MAPS / "signal_crossing.xodr").read_bytes())
    nodes = build_map_graph(odr, name="Crossing", sha256="0" * 64).lanes
    for waypoint in road_map.generate_waypoints(5.0):
        at = waypoint.transform.location
        assert np.min(np.hypot(nodes.x - at.x, nodes.y + at.y)) < 1.1


def test_the_blueprints_are_those_of_the_catalogue(server: StandIn) -> None:
    library = connect(server).get_world().get_blueprint_library()
    known = {blueprint.id for blueprint in library}
    assert set(shipped_assets().blueprints) <= known
    assert int(library.find("vehicle.bh.crossbike").get_attribute("number_of_wheels")) == 2
    assert library.find("vehicle.mitsubishi.fusorosa").get_attribute("base_type") == "bus"


@pytest.mark.slow
def test_time_goes_on_without_a_client_that_ticks(server: StandIn) -> None:
    world = connect(server).get_world()
    first = world.wait_for_tick(2.0).frame
    assert world.wait_for_tick(2.0).frame > first


@pytest.mark.slow
def test_in_synchronous_mode_only_ticks_move_time(connected: Connected) -> None:
    world = connected.world
    before = world.get_snapshot()
    # Long enough for ten ticks, if the server still ticked by the clock.
    time.sleep(0.5)
    assert world.get_snapshot().frame == before.frame
    frame = world.tick()
    after = world.get_snapshot()
    assert after.frame == frame == before.frame + 1
    stamp = after.timestamp
    assert stamp.delta_seconds == pytest.approx(DELTA)
    assert stamp.elapsed_seconds - before.timestamp.elapsed_seconds == pytest.approx(DELTA)


@pytest.mark.slow
def test_on_tick_hears_of_every_frame(connected: Connected) -> None:
    frames: list[int] = []
    number = connected.world.on_tick(lambda snapshot: frames.append(snapshot.frame))
    expected = [connected.world.tick() for _ in range(5)]
    connected.world.remove_on_tick(number)
    connected.world.tick()
    assert [frame for frame in frames if frame >= expected[0]] == expected


@pytest.mark.slow
def test_settings_come_back_as_they_were_sent(connected: Connected) -> None:
    settings = connected.world.get_settings()
    assert (settings.synchronous_mode, settings.fixed_delta_seconds) == (True, DELTA)
    settings.synchronous_mode = False
    settings.fixed_delta_seconds = None
    settings.no_rendering_mode = True
    connected.world.apply_settings(settings)
    again = connected.world.get_settings()
    assert again.no_rendering_mode
    assert not again.synchronous_mode
    first = connected.world.wait_for_tick(2.0).frame
    assert connected.world.wait_for_tick(2.0).frame > first


@pytest.mark.slow
def test_weather_comes_back_with_all_its_parameters(connected: Connected) -> None:
    parameters = shipped_assets().preset("HardRainSunset").parameters
    connected.world.set_weather(carla.WeatherParameters(**parameters))
    weather = connected.world.get_weather()
    assert {name: getattr(weather, name) for name in parameters} == pytest.approx(parameters)


@pytest.mark.slow
def test_another_map_can_be_loaded_and_empties_the_world() -> None:
    maps = {"Hills": MAPS / "rural_hills.xodr"}
    with StandIn(
        MAPS / "signal_crossing.xodr", map_name="Crossing", other_maps=maps, refuse_grounded=False
    ) as server:
        client = connect(server)
        world = synchronize(client)
        blueprint = world.get_blueprint_library().find("vehicle.tesla.model3")
        car = world.spawn_actor(blueprint, world.get_map().get_spawn_points()[0])
        assert client.get_available_maps() == [
            "/Game/Carla/Maps/Crossing",
            "/Game/Carla/Maps/Hills",
        ]
        hills = client.load_world("Hills")
        assert hills.id != world.id
        assert hills.get_map().name == "Carla/Maps/Hills"
        assert not hills.get_settings().synchronous_mode
        assert car.id not in {actor["id"] for actor in server.actors()}
        with pytest.raises(RuntimeError, match="Map 'Nowhere' not found"):
            client.load_world("Nowhere")


@pytest.mark.slow
def test_a_map_that_somebody_else_loads_is_noticed() -> None:
    maps = {"Hills": MAPS / "rural_hills.xodr"}
    with StandIn(MAPS / "signal_crossing.xodr", other_maps=maps, refuse_grounded=False) as server:
        world = connect(server).get_world()
        assert world.get_map().name == "Carla/Maps/signal_crossing"
        server.load("Hills")
        world.wait_for_tick(2.0)
        assert world.get_map().name == "Carla/Maps/Hills"


@pytest.mark.slow
def test_a_world_can_be_generated_from_opendrive_text(server: StandIn) -> None:
    text = (MAPS / "t_junction_signs.xodr").read_text(encoding="utf-8")
    world = connect(server).generate_opendrive_world(text)
    assert world.get_map().to_opendrive() == text
    signs = [actor.type_id for actor in world.get_actors().filter("traffic.*")]
    assert sorted(set(signs)) == ["traffic.stop", "traffic.yield"]


@pytest.mark.slow
def test_a_reloaded_world_keeps_its_settings_if_asked_to(connected: Connected) -> None:
    world = connected.client.reload_world(reset_settings=False)
    assert world.id != connected.world.id
    assert world.get_settings().synchronous_mode
