from __future__ import annotations

import socket
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from odscen.base.errors import CarlaError, InputError
from odscen.carla.server.batch import ActorPlace, Batch, Move, Spawn, SwitchLights, Velocity
from odscen.carla.server.carla_server import Server
from odscen.carla.server.client import Address, connect
from odscen.carla.server.server_map import ensure_map, same_map
from tests.carla_standin.process import StandIn

if TYPE_CHECKING:
    from collections.abc import Callable

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

MAPS = Path(__file__).parents[3] / "maps"
CROSSING = MAPS / "signal_crossing.xodr"
ROUNDABOUT = MAPS / "roundabout.xodr"
STILL = Velocity(0.0, 0.0, 0.0)


def car(x: float = 0.0) -> Spawn:
    at = ActorPlace(x, 0.0, 0.0, 0.0, 90.0)
    return Spawn("vehicle.tesla.model3", "odscen.a", at, STILL, 0.0, False, 0.3, 0)


def address_of(server: StandIn, *, timeout: float = 5.0) -> Address:
    return Address(server.host, server.port, timeout)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def is_free_running(server: StandIn) -> bool:
    """Whether the server's time goes on by itself, with its own steps."""
    client = carla.Client(server.host, server.port)
    client.set_timeout(5.0)
    world = client.get_world()
    if world.get_settings().synchronous_mode:
        return False
    return bool(world.wait_for_tick(2.0).delta_seconds > 0.0)


def vehicles(server: StandIn) -> list[str]:
    return [a["type_id"] for a in server.actors() if a["type_id"].startswith("vehicle.")]


@pytest.mark.slow
def test_the_world_is_ours_inside_and_as_it_was_outside() -> None:
    with StandIn(CROSSING) as stand_in:
        assert is_free_running(stand_in)
        with Server(address_of(stand_in)) as server:
            server.synchronize(0.05)
            assert not is_free_running(stand_in)
            # The server has no room for the second one: it is made above and set to its place.
            for made in server.apply(Batch(spawn=(car(), car()))):
                assert isinstance(made, int)
                assert server.place(made) == pytest.approx((0.0, 0.0, 0.0, 0.0, 90.0))
        assert vehicles(stand_in) == []
        assert is_free_running(stand_in)
        assert server.left_behind == []


@pytest.mark.slow
def test_a_time_step_that_was_never_set_is_not_restored_as_a_number() -> None:
    with StandIn(CROSSING) as stand_in:
        client = carla.Client(stand_in.host, stand_in.port)
        settings = carla.WorldSettings()
        # The client has been seen to read this from its own memory where there is no step.
        settings.fixed_delta_seconds = 4.7e-310
        client.get_world().apply_settings(settings)
        with Server(address_of(stand_in)) as server:
            server.synchronize(0.05)
        assert is_free_running(stand_in)


@pytest.mark.slow
def test_a_tick_is_two_calls_however_many_actors_there_are() -> None:
    with StandIn(CROSSING) as stand_in, Server(address_of(stand_in)) as server:
        server.synchronize(0.05)
        made = server.apply(Batch(spawn=tuple(car(10.0 * number) for number in range(30))))
        at = ActorPlace(0.0, 0.0, 0.0, 0.0, 90.0)
        moves = [Move(int(actor), at, STILL, 0.0, False) for actor in made]
        shines = [SwitchLights(int(actor), 8) for actor in made]
        for few in (1, 30):
            stand_in.reset_calls()
            server.apply(Batch(move=tuple(moves[:few]), shine=tuple(shines[:few])))
            assert stand_in.calls() == {"apply_batch": 1, "tick_cue": 1}


@pytest.mark.slow
def test_what_others_spawned_is_left_alone() -> None:
    with StandIn(CROSSING) as stand_in:
        world = carla.Client(stand_in.host, stand_in.port).get_world()
        blueprint = world.get_blueprint_library().find("vehicle.audi.tt")
        world.spawn_actor(blueprint, carla.Transform(carla.Location(50.0, 0.0, 0.5)))
        with Server(address_of(stand_in)) as server:
            server.synchronize(0.05)
            server.apply(Batch(spawn=(car(),)))
        assert vehicles(stand_in) == ["vehicle.audi.tt"]


def spawn_and_fail(address: Address) -> None:
    with Server(address) as server:
        server.synchronize(0.05)
        server.apply(Batch(spawn=(car(),)))
        raise ZeroDivisionError


@pytest.mark.slow
def test_the_world_is_restored_after_an_error_too() -> None:
    with StandIn(CROSSING) as stand_in:
        with pytest.raises(ZeroDivisionError):
            spawn_and_fail(address_of(stand_in))
        assert vehicles(stand_in) == []
        assert is_free_running(stand_in)


def sooner_or_later(holds: Callable[[], bool]) -> bool:
    deadline = time.monotonic() + 60.0
    while not holds() and time.monotonic() < deadline:
        time.sleep(0.01)
    return holds()


@pytest.mark.slow
@pytest.mark.parametrize("late", ["", "call", "tick"])
def test_weather_and_traffic_lights_are_given_back(late: str) -> None:
    """Also by a server whose threads come to what nobody waits for after the next call, or tick."""
    with StandIn(CROSSING, late_calls=late) as stand_in:
        world = carla.Client(stand_in.host, stand_in.port).get_world()
        before = world.get_weather()
        with Server(address_of(stand_in)) as server:
            server.synchronize(0.05)
            server.set_weather({"fog_density": 77.0, "sun_altitude_angle": -30.0})
            server.tick()  # weather is set without an answer; by now it has arrived, or else late
            server.tick()
            assert world.get_weather().fog_density == 77.0
            lights = server.take_lights()
            server.apply(Batch(signals=dict.fromkeys(lights.values(), "Off")))
            server.tick()
            first = world.get_actors().filter("traffic.traffic_light*")[0]
            # The other client hears of it with a later snapshot, whenever that comes.
            assert sooner_or_later(lambda: first.get_state() == carla.TrafficLightState.Off)
            assert first.is_frozen()
        assert sooner_or_later(lambda: world.get_weather() == before)
        light = world.get_actors().filter("traffic.traffic_light*")[0]
        assert sooner_or_later(lambda: not light.is_frozen())


def test_an_absent_server_is_named_with_what_to_do() -> None:
    port = free_port()
    with pytest.raises(CarlaError, match=f"no CARLA server at 127.0.0.1:{port} .*start CARLA"):
        connect(Address("127.0.0.1", port, 0.5))


@pytest.mark.slow
def test_a_server_that_is_only_starting_is_waited_for() -> None:
    port = free_port()
    listener = socket.socket()

    def listen_late() -> None:
        time.sleep(0.5)
        listener.bind(("127.0.0.1", port))
        listener.listen()

    late = threading.Thread(target=listen_late)
    late.start()
    # Nothing but the port comes up, so it gets further than "no server" and then no answer.
    with pytest.raises(CarlaError, match="has not answered for 2 s"):
        connect(Address("127.0.0.1", port, 2.0))
    late.join()
    listener.close()


def test_an_unknown_host_is_named() -> None:
    with pytest.raises(CarlaError, match=r"no machine named 'nowhere\.invalid'"):
        connect(Address("nowhere.invalid", 2000, 0.5))


@pytest.mark.parametrize("text", ["localhost:port", "localhost:", "host:0", "host:70000"])
def test_what_is_no_address_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="HOST:PORT"):
        Address.parse(text)


@pytest.mark.parametrize(
    ("text", "host", "port"),
    [(":2010", "127.0.0.1", 2010), ("box", "box", 2000), ("box:2010", "box", 2010)],
)
def test_half_an_address_is_completed(text: str, host: str, port: int) -> None:
    assert Address.parse(text, timeout=3.0) == Address(host, port, 3.0)


@pytest.mark.slow
@pytest.mark.parametrize("version", ["0.9.16-dirty", "0.9.16-12-g0123abc", "7a1b0e5c"])
def test_a_server_that_was_built_from_source_is_taken_with_a_warning(version: str) -> None:
    with StandIn(CROSSING, version=version) as stand_in:
        [warning] = Server(address_of(stand_in)).warnings
        assert f"calls itself {version}, the package carla is 0.9.16" in warning


@pytest.mark.slow
def test_another_client_that_ticks_is_noticed_at_once() -> None:
    with StandIn(CROSSING) as stand_in:
        with Server(address_of(stand_in)) as server:
            server.synchronize(0.1)
            server.tick()
            server.tick()
            other = carla.Client(stand_in.host, stand_in.port)
            other.set_timeout(5.0)
            frame = other.get_world().tick()
            words = rf"led from frame {frame - 1} to {frame + 1}; only one client may tick"
            with pytest.raises(CarlaError, match=words):
                server.tick()
        assert is_free_running(stand_in)


@pytest.mark.slow
def test_another_release_is_refused_before_anything_is_touched() -> None:
    with StandIn(CROSSING, version="0.9.15") as stand_in:
        with pytest.raises(CarlaError, match=r"release 0\.9\.15, the package carla is 0\.9\.16"):
            Server(address_of(stand_in))
        assert set(stand_in.calls()) == {"version"}


@pytest.mark.slow
def test_another_map_is_refused_by_name_if_none_may_be_loaded() -> None:
    text = ROUNDABOUT.read_text(encoding="utf-8")
    with (
        StandIn(CROSSING) as stand_in,
        Server(address_of(stand_in)) as server,
        pytest.raises(CarlaError, match="shows signal_crossing, and the scenario is on round"),
    ):
        ensure_map(server, "roundabout", text, load=False)


@pytest.mark.slow
def test_the_server_loads_the_map_if_it_has_it() -> None:
    text = ROUNDABOUT.read_text(encoding="utf-8")
    maps = {"roundabout": ROUNDABOUT}
    with StandIn(CROSSING, other_maps=maps) as stand_in, Server(address_of(stand_in)) as server:
        assert ensure_map(server, "roundabout", text) == "loaded"
        assert server.map_name == "roundabout"
        assert ensure_map(server, "roundabout", text) == "there"


@pytest.mark.slow
def test_the_server_makes_a_world_of_our_map_if_it_does_not_have_it() -> None:
    text = ROUNDABOUT.read_text(encoding="utf-8")
    # A map of that name that is another one does not do.
    maps = {"roundabout": MAPS / "rural_hills.xodr"}
    with StandIn(CROSSING, other_maps=maps) as stand_in, Server(address_of(stand_in)) as server:
        assert ensure_map(server, "roundabout", text) == "generated"
        assert server.opendrive() == text


def test_maps_are_the_same_whatever_their_header_and_line_ends() -> None:
    text = CROSSING.read_text(encoding="utf-8")
    assert same_map(text, text.replace("\n", "\r\n"))
    assert same_map(text, text.replace('name="signal_crossing"', 'name="other"', 1))
    assert not same_map(text, ROUNDABOUT.read_text(encoding="utf-8"))


def tick_until_death(stand_in: StandIn) -> None:
    with Server(address_of(stand_in, timeout=0.5)) as server:
        server.synchronize(0.05)
        server.apply(Batch(spawn=(car(),)))
        stand_in.set(die_at_tick=2)
        server.apply(Batch())
        server.apply(Batch())


@pytest.mark.slow
def test_a_server_that_dies_is_told() -> None:
    with StandIn(CROSSING) as stand_in:
        with pytest.raises(CarlaError, match="is gone: no server listens"):
            tick_until_death(stand_in)
        assert stand_in.has_died()


def kill_and_fail(stand_in: StandIn) -> None:
    with Server(address_of(stand_in, timeout=0.5)):
        stand_in.kill()
        raise ZeroDivisionError


@pytest.mark.slow
def test_the_first_error_is_not_hidden_by_one_of_restoring() -> None:
    with StandIn(CROSSING) as stand_in, pytest.raises(ZeroDivisionError):
        kill_and_fail(stand_in)
