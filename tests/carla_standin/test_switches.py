from __future__ import annotations

import os
import subprocess
import sys
import time

import pytest

from tests.carla_standin.conftest import MAPS, Connected, connect, synchronize
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="the real client asks the stand-in")

CAR = "vehicle.tesla.model3"


def place(number: int) -> carla.Transform:
    return carla.Transform(carla.Location(0.0, 10.0 * number, 0.0))


def test_every_third_spawn_is_refused_with_a_message(connected: Connected) -> None:
    connected.server.set(refuse_spawn_every=3, refusal="no room today")
    blueprint = connected.blueprint(CAR)
    batch = [carla.command.SpawnActor(blueprint, place(number)) for number in range(9)]
    answers = connected.client.apply_batch_sync(batch, True)
    assert [answer.error for answer in answers] == ["", "", "no room today"] * 3
    connected.server.set(refuse_spawn_every=1)
    with pytest.raises(RuntimeError, match="no room today"):
        connected.spawn(CAR, place(10))
    connected.server.set(refuse_spawn_every=0)
    connected.spawn(CAR, place(10))


@pytest.mark.slow
def test_a_server_of_another_version_says_so() -> None:
    with StandIn(MAPS / "signal_crossing.xodr", version="0.9.15") as server:
        assert connect(server).get_server_version() == "0.9.15"


@pytest.mark.slow
def test_a_frozen_server_answers_too_late(connected: Connected) -> None:
    connected.client.set_timeout(0.5)
    connected.server.set(freeze_at_tick=2, freeze_seconds=1.5)
    before = connected.world.tick()
    with pytest.raises(RuntimeError, match="time-out"):
        connected.world.tick()
    connected.client.set_timeout(5.0)
    assert connected.world.tick() == before + 2


@pytest.mark.slow
def test_a_dropped_stream_loses_its_tick_and_comes_back(connected: Connected) -> None:
    connected.server.set(drop_stream_at_tick=1)
    with pytest.raises(RuntimeError, match="time-out"):
        connected.world.tick(0.5)
    frame = connected.world.tick(2.0)
    assert connected.world.get_snapshot().frame == frame


@pytest.mark.slow
def test_a_stream_that_is_refused_stays_away(connected: Connected) -> None:
    connected.server.set(drop_stream_at_tick=1, refuse_streams=True)
    for _ in range(3):
        with pytest.raises(RuntimeError, match="time-out"):
            connected.world.tick(0.3)


@pytest.mark.slow
def test_a_server_dies_at_the_tick_it_was_told(connected: Connected) -> None:
    connected.client.set_timeout(0.5)
    connected.server.set(die_at_tick=3)
    connected.world.tick()
    connected.world.tick()
    with pytest.raises(RuntimeError, match="time-out"):
        connected.world.tick()
    assert connected.server.has_died()


@pytest.mark.slow
def test_a_paused_server_goes_on_where_it_was(connected: Connected) -> None:
    connected.client.set_timeout(0.3)
    connected.server.pause()
    with pytest.raises(RuntimeError, match="time-out"):
        connected.world.get_weather()
    connected.server.resume()
    connected.client.set_timeout(5.0)
    connected.world.get_weather()


@pytest.mark.slow
def test_a_wrong_switch_is_refused(server: StandIn) -> None:
    with pytest.raises(RuntimeError, match="no such switch: explode"):
        server.set(explode=True)


@pytest.mark.slow
def test_calls_are_counted_by_name(connected: Connected) -> None:
    connected.server.reset_calls()
    connected.world.tick()
    connected.client.apply_batch_sync([], True)
    assert connected.server.calls() == {"tick_cue": 2, "apply_batch": 1}


@pytest.mark.slow
def test_the_server_knows_its_actors_as_the_client_does(connected: Connected) -> None:
    car = connected.spawn(CAR, place(2))
    connected.world.tick()
    mine = {actor["id"]: actor for actor in connected.server.actors()}
    assert set(mine) == {actor.id for actor in connected.world.get_actors()}
    assert mine[car.id]["transform"][0] == [0.0, 20.0, 0.0]


@pytest.mark.slow
def test_no_process_outlives_the_test_that_started_it() -> None:
    script = (
        "import os, sys; from pathlib import Path\n"
        "from tests.carla_standin.process import StandIn\n"
        "with StandIn(Path(sys.argv[1])) as server:\n"
        "    print(server._process.pid, flush=True)\n"
        "    os._exit(9)\n"
    )
    ended = subprocess.run(
        [sys.executable, "-c", script, str(MAPS / "signal_crossing.xodr")],
        cwd=MAPS.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 9
    deadline = time.monotonic() + 10.0
    while is_alive(int(ended.stdout)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not is_alive(int(ended.stdout))


def is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.slow
def test_two_servers_live_side_by_side() -> None:
    with (
        StandIn(MAPS / "signal_crossing.xodr") as first,
        StandIn(MAPS / "roundabout.xodr") as second,
    ):
        worlds = [synchronize(connect(server)) for server in (first, second)]
        names = [world.get_map().name for world in worlds]
    assert names == ["Carla/Maps/signal_crossing", "Carla/Maps/roundabout"]
