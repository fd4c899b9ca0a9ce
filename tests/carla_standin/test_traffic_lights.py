from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

from odscen.opendrive.lanes import RoadTable
from odscen.opendrive.objects import signal_kind
from odscen.opendrive.parse import parse
from tests.carla_standin.conftest import DELTA, MAPS, Connected, connect, synchronize
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="the real client asks the stand-in")

RED, YELLOW, GREEN = (
    carla.TrafficLightState.Red,
    carla.TrafficLightState.Yellow,
    carla.TrafficLightState.Green,
)


def lights_of(world: Any) -> list[Any]:
    return list(world.get_actors().filter("traffic.traffic_light"))


@pytest.mark.slow
def test_every_light_of_the_map_is_found_by_its_opendrive_id(connected: Connected) -> None:
    odr = parse((MAPS / "signal_crossing.xodr").read_bytes())
    expected = {
        signal.id
        for road in odr.roads.values()
        for signal in road.signals
        if signal_kind(signal) == "traffic_light"
    }
    lights = lights_of(connected.world)
    assert {light.get_opendrive_id() for light in lights} == expected
    for light in lights:
        found = connected.world.get_traffic_light_from_opendrive_id(light.get_opendrive_id())
        assert found.id == light.id
        assert light.get_affected_lane_waypoints()


@pytest.mark.slow
def test_lights_stand_where_the_map_has_them_also_on_slopes() -> None:
    odr = parse((MAPS / "rural_hills.xodr").read_bytes())
    table = RoadTable.of(odr)
    road, signal = next(
        (road, signal)
        for road in odr.roads.values()
        for signal in road.signals
        if signal_kind(signal) in ("traffic_light", "stop", "yield")
    )
    row, s = np.array([table.road_index[road.id]]), np.array([signal.s])
    x, y, z = table.points(row, s, np.array([signal.t]), signal.z_offset)
    with StandIn(MAPS / "rural_hills.xodr") as server:
        world = synchronize(connect(server))
        world.tick()
        places = [
            actor.get_transform().location for actor in world.get_actors().filter("traffic.*")
        ]
    assert abs(z[0]) > 1.0
    at = carla.Location(float(x[0]), -float(y[0]), float(z[0]))
    assert min(at.distance(place) for place in places) < 0.001


@pytest.mark.slow
def test_lights_of_a_junction_are_one_group_that_takes_turns(connected: Connected) -> None:
    lights = lights_of(connected.world)
    group = lights[0].get_group_traffic_lights()
    assert {light.id for light in group} == {light.id for light in lights}
    seen: Counter[tuple[int, Any]] = Counter()
    connected.world.tick()
    for light in lights:
        light.set_green_time(0.4)
        light.set_yellow_time(0.2)
        light.set_red_time(0.2)
    for _ in range(int(12.0 / DELTA)):
        connected.world.tick()
        states = {light.id: light.state for light in lights}
        # While one set of lights may go, the others stop.
        assert RED in states.values()
        assert YELLOW not in states.values() or GREEN not in states.values()
        seen.update(states.items())
    assert all(seen[light.id, state] for light in lights for state in (RED, YELLOW, GREEN))


def test_a_state_that_is_set_shows_with_the_next_tick(connected: Connected) -> None:
    light = lights_of(connected.world)[0]
    light.freeze(True)
    for state in (GREEN, YELLOW, RED, carla.TrafficLightState.Off):
        light.set_state(state)
        connected.world.tick()
        assert light.state == state


@pytest.mark.slow
def test_frozen_lights_keep_their_state_until_they_are_released(connected: Connected) -> None:
    lights = lights_of(connected.world)
    light = lights[0]
    for each in lights:
        each.set_green_time(0.3)
    connected.world.freeze_all_traffic_lights(True)
    light.set_state(GREEN)
    for _ in range(20):
        connected.world.tick()
        assert (light.state, light.is_frozen()) == (GREEN, True)
    connected.world.freeze_all_traffic_lights(False)
    states = set()
    for _ in range(400):
        connected.world.tick()
        states.add(light.state)
    assert RED in states
    assert not light.is_frozen()


@pytest.mark.slow
def test_a_group_can_begin_again(connected: Connected) -> None:
    lights = lights_of(connected.world)
    connected.world.tick()
    first = {light.id: light.state for light in lights}
    for _ in range(int(11.0 / DELTA)):
        connected.world.tick()
    assert {light.id: light.state for light in lights} != first
    connected.world.reset_all_traffic_lights()
    connected.world.tick()
    assert {light.id: light.state for light in lights} == first
