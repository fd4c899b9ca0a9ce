from __future__ import annotations

import socket
import threading
import time
from pathlib import Path

import pytest

from odscen.carla.client import ActorRequest, Address, connect
from odscen.errors import CarlaError
from odscen.frames import CarlaPose
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="co-simulation needs the package carla")

MAPS = Path(__file__).parents[2] / "maps"
CROSSING = MAPS / "signal_crossing.xodr"
CAR = ActorRequest("vehicle.tesla.model3", CarlaPose(0.0, 0.0, 0.0, 90.0))


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


def test_the_world_is_ours_inside_and_as_it_was_outside() -> None:
    with StandIn(CROSSING) as server:
        assert is_free_running(server)
        with connect(address_of(server), delta=0.05) as session:
            assert session.map_name == "signal_crossing"
            assert not is_free_running(server)
            answer, refused = session.spawn([CAR, CAR])
            assert answer.actor is not None
            assert refused.actor is None
            assert "collision" in refused.problem
            first = session.tick()
            assert session.tick() == first + 1
            at = session.world.get_snapshot().find(answer.actor).get_transform()
            assert at.rotation.yaw == 90.0
        assert vehicles(server) == []
        assert is_free_running(server)


def test_a_time_step_that_was_never_set_is_not_restored_as_a_number() -> None:
    with StandIn(CROSSING) as server:
        client = carla.Client(server.host, server.port)
        settings = carla.WorldSettings()
        # The client has been seen to read this from its own memory where there is no step.
        settings.fixed_delta_seconds = 4.7e-310
        client.get_world().apply_settings(settings)
        assert not is_free_running(server)
        with connect(address_of(server), delta=0.05):
            pass
        assert is_free_running(server)


def test_what_others_spawned_is_left_alone() -> None:
    with StandIn(CROSSING) as server:
        client = carla.Client(server.host, server.port)
        world = client.get_world()
        blueprint = world.get_blueprint_library().find("vehicle.audi.tt")
        world.spawn_actor(blueprint, carla.Transform(carla.Location(50.0, 0.0)))
        with connect(address_of(server), delta=0.05) as session:
            session.spawn([CAR])
        assert vehicles(server) == ["vehicle.audi.tt"]


def test_actors_that_were_destroyed_early_do_not_matter_at_the_end() -> None:
    with StandIn(CROSSING) as server, connect(address_of(server), delta=0.05) as session:
        (answer,) = session.spawn([CAR])
        assert answer.actor is not None
        session.destroy([answer.actor])
        assert vehicles(server) == []


def spawn_and_fail(address: Address) -> None:
    with connect(address, delta=0.05) as session:
        session.spawn([CAR])
        raise ZeroDivisionError


def test_the_world_is_restored_after_an_error_too() -> None:
    with StandIn(CROSSING) as server:
        with pytest.raises(ZeroDivisionError):
            spawn_and_fail(address_of(server))
        assert vehicles(server) == []
        assert is_free_running(server)


def test_an_absent_server_is_named_with_what_to_do() -> None:
    port = free_port()
    with (
        pytest.raises(CarlaError, match=f"no CARLA server at 127.0.0.1:{port} .*start CARLA"),
        connect(Address("127.0.0.1", port, 0.5), delta=0.05),
    ):
        pass


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
    with (
        pytest.raises(CarlaError, match="has not answered for 2 s"),
        connect(Address("127.0.0.1", port, 2.0), delta=0.05),
    ):
        pass
    late.join()
    listener.close()


def test_an_unknown_host_is_named() -> None:
    with (
        pytest.raises(CarlaError, match=r"no machine named 'nowhere\.invalid'"),
        connect(Address("nowhere.invalid", 2000, 0.5), delta=0.05),
    ):
        pass


def test_another_release_is_refused_before_anything_is_touched() -> None:
    with StandIn(CROSSING, version="0.9.15") as server:
        with (
            pytest.raises(CarlaError, match=r"release 0\.9\.15, the package carla is 0\.9\.16"),
            connect(address_of(server), delta=0.05),
        ):
            pass
        assert set(server.calls()) == {"version"}


def test_another_map_is_refused_by_name() -> None:
    text = (MAPS / "roundabout.xodr").read_text(encoding="utf-8")
    with StandIn(CROSSING) as server:
        with (
            pytest.raises(CarlaError, match="another map, Carla/Maps/signal_crossing: load"),
            connect(address_of(server), delta=0.05, opendrive=text),
        ):
            pass
        assert is_free_running(server)


def test_the_same_map_with_other_line_ends_is_the_same() -> None:
    text = CROSSING.read_text(encoding="utf-8").replace("\n", "\r\n")
    with (
        StandIn(CROSSING) as server,
        connect(address_of(server), delta=0.05, opendrive=text) as session,
    ):
        assert session.map_name == "signal_crossing"


def test_the_server_makes_a_world_of_our_map_if_it_may() -> None:
    text = (MAPS / "roundabout.xodr").read_text(encoding="utf-8")
    with (
        StandIn(CROSSING) as server,
        connect(address_of(server), delta=0.05, opendrive=text, generate=True) as session,
    ):
        assert session.world.get_map().to_opendrive() == text
        session.tick()


def tick_until_death(server: StandIn) -> None:
    with connect(address_of(server, timeout=0.5), delta=0.05) as session:
        session.spawn([CAR])
        server.set(die_at_tick=2)
        session.tick()
        session.tick()


def test_a_server_that_dies_is_told() -> None:
    with StandIn(CROSSING) as server:
        with pytest.raises(CarlaError, match=r"has not answered for 0\.5 s"):
            tick_until_death(server)
        assert server.has_died()


def kill_and_fail(server: StandIn) -> None:
    with connect(address_of(server, timeout=0.5), delta=0.05) as session:
        session.spawn([CAR])
        server.kill()
        raise ZeroDivisionError


def test_the_first_error_is_not_hidden_by_one_of_restoring() -> None:
    with StandIn(CROSSING) as server, pytest.raises(ZeroDivisionError):
        kill_and_fail(server)


def test_an_unknown_blueprint_or_attribute_is_named() -> None:
    with StandIn(CROSSING) as server, connect(address_of(server), delta=0.05) as session:
        with pytest.raises(CarlaError, match=r"cannot make a vehicle\.flying\.carpet"):
            session.spawn([ActorRequest("vehicle.flying.carpet", CAR.pose)])
        with pytest.raises(CarlaError, match="wings"):
            session.spawn([ActorRequest(CAR.blueprint, CAR.pose, {"wings": "2"})])
