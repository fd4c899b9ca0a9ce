from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from odscen.simulators.assets import shipped_assets
from tests.carla_standin.conftest import DELTA, MAPS, Connected, connect, synchronize
from tests.carla_standin.process import StandIn

carla = pytest.importorskip("carla", reason="the real client asks the stand-in")

CAR = "vehicle.tesla.model3"
WALKER = "walker.pedestrian.0001"


def transform(
    x: float, y: float, z: float = 0.0, *, pitch: float = 0.0, yaw: float = 0.0, roll: float = 0.0
) -> carla.Transform:
    return carla.Transform(carla.Location(x, y, z), carla.Rotation(pitch, yaw, roll))


def flat(at: carla.Transform) -> list[float]:
    place, turn = at.location, at.rotation
    return [place.x, place.y, place.z, turn.pitch, turn.yaw, turn.roll]


@pytest.mark.slow
def test_a_spawned_vehicle_is_in_the_next_snapshot_where_it_was_put(connected: Connected) -> None:
    at = transform(12.25, -7.5, 0.3, pitch=2.0, yaw=-135.0, roll=1.0)
    car = connected.spawn(CAR, at)
    car.set_enable_gravity(False)
    connected.world.tick()
    assert connected.world.get_snapshot().has_actor(car.id)
    assert flat(car.get_transform()) == pytest.approx(flat(at))
    assert car.type_id == CAR
    body = shipped_assets().blueprint(CAR).body
    extent = car.bounding_box.extent
    assert (2 * extent.x, 2 * extent.y, 2 * extent.z) == pytest.approx(body)


@pytest.mark.slow
def test_attributes_are_kept_as_they_were_chosen(connected: Connected) -> None:
    blueprint = connected.blueprint(CAR)
    blueprint.set_attribute("role_name", "hero 7")
    blueprint.set_attribute("color", "1,2,3")
    car = connected.world.spawn_actor(blueprint, transform(0.0, 0.0))
    connected.world.tick()
    peer = connect(connected.server).get_world().get_actor(car.id)
    assert (peer.attributes["role_name"], peer.attributes["color"]) == ("hero 7", "1,2,3")


@pytest.mark.slow
def test_two_vehicles_cannot_be_spawned_into_each_other(connected: Connected) -> None:
    connected.spawn(CAR, transform(0.0, 0.0))
    with pytest.raises(RuntimeError, match="collision"):
        connected.spawn(CAR, transform(2.0, 0.5))
    assert connected.world.try_spawn_actor(connected.blueprint(CAR), transform(1.0, 0.0)) is None
    connected.spawn(CAR, transform(0.0, 4.0))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("blueprint", "z", "made"),
    [(CAR, 0.0, False), (CAR, 0.3, True), (WALKER, 0.93, False), (WALKER, 1.25, True)],
)
def test_what_touches_the_ground_is_not_made(
    connected: Connected, blueprint: str, z: float, made: bool
) -> None:
    connected.server.set(refuse_grounded=True)
    point = connected.world.get_map().get_spawn_points()[0].location
    at = carla.Transform(carla.Location(point.x, point.y, point.z - 0.5 + z))
    answer = connected.client.apply_batch_sync(
        [carla.command.SpawnActor(connected.blueprint(blueprint), at)]
    )[0]
    assert bool(answer.error) is not made


@pytest.mark.slow
def test_a_destroyed_actor_is_gone_with_the_next_tick(connected: Connected) -> None:
    car = connected.spawn(CAR, transform(0.0, 0.0))
    connected.world.tick()
    assert car.destroy()
    connected.world.tick()
    assert not connected.world.get_snapshot().has_actor(car.id)
    assert connected.client.apply_batch_sync([carla.command.DestroyActor(car.id)])[0].error


@pytest.mark.slow
def test_a_batch_spawns_moves_and_shows_all_in_one_tick(connected: Connected) -> None:
    places = [transform(10.0 * number, 3.0) for number in range(20)]
    command, new = carla.command, carla.command.FutureActor
    spawn = [
        command.SpawnActor(connected.blueprint(CAR), at)
        .then(command.SetEnableGravity(new, False))
        .then(command.ApplyTargetVelocity(new, carla.Vector3D(3.0, 0, 0)))
        for at in places
    ]
    answers = connected.client.apply_batch_sync(spawn, True)
    assert not any(answer.error for answer in answers)
    snapshot = connected.world.get_snapshot()
    for answer, at in zip(answers, places, strict=True):
        seen = snapshot.find(answer.actor_id)
        assert seen.get_velocity().x == 3.0
        assert seen.get_transform().location.x == pytest.approx(at.location.x + 3.0 * DELTA)


@pytest.mark.slow
def test_a_batch_goes_on_after_a_refusal(connected: Connected) -> None:
    blueprint = connected.blueprint(CAR)
    spawn = carla.command.SpawnActor
    answers = connected.client.apply_batch_sync(
        [
            spawn(blueprint, transform(0.0, 0.0)),
            spawn(blueprint, transform(1.0, 0.0)),
            carla.command.ApplyTransform(99999, transform(0.0, 0.0)),
            spawn(blueprint, transform(20.0, 0.0)),
        ],
        True,
    )
    assert [bool(answer.error) for answer in answers] == [False, True, True, False]


@pytest.mark.slow
def test_without_physics_a_body_is_exactly_where_it_was_put_and_reports_no_velocity(
    connected: Connected,
) -> None:
    car = connected.spawn(CAR, transform(0.0, 0.0))
    car.set_simulate_physics(False)
    numbers = np.random.default_rng(5)
    for _ in range(10):
        at = transform(*numbers.uniform(-900, 900, 3), pitch=3.3, yaw=numbers.uniform(-180, 180))
        velocity = carla.Vector3D(*numbers.uniform(-40, 40, 3))
        spin = carla.Vector3D(*numbers.uniform(-40, 40, 3))
        connected.client.apply_batch_sync(
            [
                carla.command.ApplyTransform(car.id, at),
                carla.command.ApplyTargetVelocity(car.id, velocity),
                carla.command.ApplyTargetAngularVelocity(car.id, spin),
            ],
            True,
        )
        seen = connected.world.get_snapshot().find(car.id)
        assert flat(seen.get_transform()) == flat(at)
        assert seen.get_velocity() == seen.get_angular_velocity() == carla.Vector3D()


@pytest.mark.slow
def test_with_physics_a_body_moves_by_its_velocity(connected: Connected) -> None:
    car = connected.spawn(CAR, transform(5.0, 5.0, yaw=90.0))
    car.enable_constant_velocity(carla.Vector3D(10.0, 0.0, 0.0))
    for _ in range(20):
        connected.world.tick()
    assert flat(car.get_transform()) == pytest.approx([5.0, 15.0, 0.0, 0.0, 90.0, 0.0], abs=1e-4)
    car.disable_constant_velocity()
    car.set_target_velocity(carla.Vector3D(0.0, 0.0, 0.0))
    connected.world.tick()
    assert car.get_acceleration().y == pytest.approx(-10.0 / DELTA)


@pytest.mark.slow
def test_controls_and_lights_are_shown_as_they_were_set(connected: Connected) -> None:
    car = connected.spawn(CAR, transform(0.0, 0.0))
    car.apply_control(carla.VehicleControl(throttle=0.5, steer=-0.25, brake=0.125, gear=3))
    state = carla.VehicleLightState.LeftBlinker | carla.VehicleLightState.Brake
    car.set_light_state(carla.VehicleLightState(state))
    connected.world.tick()
    control = car.get_control()
    assert (control.throttle, control.steer, control.brake, control.gear) == (0.5, -0.25, 0.125, 3)
    assert int(car.get_light_state()) == int(state)
    other = carla.VehicleLightState.HighBeam
    batch = [carla.command.SetVehicleLightState(car.id, other)]
    connected.client.apply_batch_sync(batch, True)
    assert connected.world.get_vehicles_light_states()[car.id] == other


@pytest.mark.slow
def test_wheels_are_turned_by_hand_only_without_physics(connected: Connected) -> None:
    car = connected.spawn(CAR, transform(0.0, 0.0))
    left = carla.VehicleWheelLocation.FL_Wheel

    def turned(angle: float) -> dict[str, list[float]]:
        car.set_wheel_steer_direction(left, angle)
        car.set_wheel_pitch_angle(left, -10.0 * angle)
        connected.world.tick()
        return next(a["wheels"] for a in connected.server.actors() if a["id"] == car.id)

    assert turned(5.0) == {}
    car.set_simulate_physics(False)
    assert turned(6.0) == {"0": [6.0, -60.0]}


@pytest.mark.slow
def test_doors_open_where_a_model_has_some_and_an_open_one_does_not_go_with_its_vehicle(
    connected: Connected,
) -> None:
    bus = connected.spawn("vehicle.mitsubishi.fusorosa", transform(0.0, 0.0))
    old = connected.spawn("vehicle.audi.a2", transform(0.0, 20.0))
    bus.set_simulate_physics(False)
    door = carla.VehicleDoor

    def seen(actor: Any) -> tuple[list[int], int]:
        connected.world.tick()
        own = next(a for a in connected.server.actors() if a["id"] == actor.id)
        return own["doors"], own["left_doors"]

    old.open_door(door.All)
    bus.open_door(door.FR)
    bus.open_door(door.RR)
    assert (seen(old), seen(bus)) == (([], 0), ([1, 3], 0))
    bus.set_transform(transform(1.0, 0.0))
    assert seen(bus) == ([1, 3], 1)
    bus.close_door(door.All)
    bus.set_transform(transform(2.0, 0.0))
    assert seen(bus) == ([], 1)
    bus.open_door(door.All)
    bus.set_simulate_physics(True)
    assert seen(bus) == ([], 1)


@pytest.mark.slow
def test_something_attached_goes_where_its_parent_goes(connected: Connected) -> None:
    car = connected.spawn(CAR, transform(0.0, 0.0, yaw=90.0))
    camera = connected.spawn("sensor.camera.rgb", transform(2.0, 1.0, 1.5), attach_to=car)
    car.set_transform(transform(100.0, 50.0, yaw=90.0))
    connected.world.tick()
    assert camera.parent.id == car.id
    assert flat(camera.get_transform()) == pytest.approx([99.0, 52.0, 1.5, 0.0, 90.0, 0.0])


@pytest.mark.slow
def test_a_walker_walks_straight_on(connected: Connected) -> None:
    walker = connected.spawn(WALKER, transform(0.0, 0.0, 1.0))
    walker.apply_control(carla.WalkerControl(carla.Vector3D(0.0, 2.0, 0.0), 1.5))
    for _ in range(20):
        connected.world.tick()
    assert flat(walker.get_transform())[:3] == pytest.approx([0.0, 1.5, 1.0], abs=1e-5)
    assert walker.get_velocity().y == pytest.approx(1.5)
    assert walker.get_control().speed == 1.5


@pytest.mark.slow
def test_a_walker_is_put_on_the_ground_and_the_server_adds_half_its_height(
    connected: Connected,
) -> None:
    walker = connected.spawn(WALKER, transform(0.0, 0.0, 1.0))
    walker.set_simulate_physics(False)
    at = transform(4.0, 4.0, 0.0, yaw=180.0)
    batch = [carla.command.ApplyWalkerState(walker.id, at, 1.25)]
    assert not connected.client.apply_batch_sync(batch, True)[0].error
    half = walker.bounding_box.extent.z
    assert half > 0.5
    assert flat(walker.get_transform()) == pytest.approx([4.0, 4.0, half, 0.0, 180.0, 0.0])
    assert walker.get_control().speed == 1.25
    assert walker.get_velocity() == carla.Vector3D()


@pytest.mark.slow
def test_a_controller_of_walkers_starts_and_stops(connected: Connected) -> None:
    walker = connected.spawn(WALKER, transform(0.0, 0.0, 1.0))
    controller = connected.spawn("controller.ai.walker", carla.Transform(), attach_to=walker)
    connected.world.tick()
    controller.start()
    controller.set_max_speed(1.4)
    connected.world.tick()
    controller.stop()
    assert controller.destroy()


@pytest.mark.slow
def test_a_car_is_no_walker(connected: Connected) -> None:
    car = connected.spawn(CAR, transform(0.0, 0.0))
    batch = [carla.command.ApplyWalkerControl(car.id, carla.WalkerControl())]
    answer = connected.client.apply_batch_sync(batch, True)[0]
    assert "not a Walker" in answer.error


@pytest.mark.slow
def test_boxes_may_lie_before_and_beside_the_origin_of_their_vehicles() -> None:
    xodr, offset = MAPS / "signal_crossing.xodr", (0.25, 0.125)
    with StandIn(xodr, box_offset=offset, refuse_grounded=False) as server:
        world = synchronize(connect(server))
        blueprint = world.get_blueprint_library().find(CAR)
        car = world.spawn_actor(blueprint, transform(0.0, 0.0))
        box = car.bounding_box
        assert (box.location.x, box.location.y) == offset
        # A car that looks south has its box to the west and south of its origin, one that looks
        # east to the south and east.
        world.spawn_actor(blueprint, transform(100.0, 20.0, yaw=90.0))
        last = 100.0 - offset[1] - offset[0] - box.extent.y - box.extent.x
        with pytest.raises(RuntimeError, match="collision"):
            world.spawn_actor(blueprint, transform(last + 0.05, 20.0))
        world.spawn_actor(blueprint, transform(last - 0.05, 20.0))


@pytest.mark.slow
def test_every_command_of_the_client_is_understood(connected: Connected) -> None:
    car = connected.spawn(CAR, transform(0.0, 0.0))
    walker = connected.spawn(WALKER, transform(0.0, 20.0, 1.0))
    connected.world.tick()
    command, vector = carla.command, carla.Vector3D(1.0, 0.0, 0.0)
    commands = [
        command.ApplyVehicleControl(car.id, carla.VehicleControl()),
        command.ApplyVehicleAckermannControl(car.id, carla.VehicleAckermannControl()),
        command.ApplyWalkerControl(walker.id, carla.WalkerControl()),
        command.ApplyVehiclePhysicsControl(car.id, car.get_physics_control()),
        command.ApplyTransform(car.id, transform(1.0, 1.0)),
        command.ApplyWalkerState(walker.id, transform(1.0, 20.0, 1.0), 1.0),
        command.ApplyTargetVelocity(car.id, vector),
        command.ApplyTargetAngularVelocity(car.id, vector),
        command.ApplyImpulse(car.id, vector),
        command.ApplyForce(car.id, vector),
        command.ApplyAngularImpulse(car.id, vector),
        command.ApplyTorque(car.id, vector),
        command.SetSimulatePhysics(car.id, False),
        command.SetEnableGravity(car.id, False),
        command.SetVehicleLightState(car.id, carla.VehicleLightState.Fog),
        command.DestroyActor(car.id),
    ]
    answers = connected.client.apply_batch_sync(commands, True)
    assert [answer.error for answer in answers] == [""] * len(commands)
    assert not connected.world.get_snapshot().has_actor(car.id)


def test_a_push_and_a_pull_change_the_velocity(connected: Connected) -> None:
    car = connected.spawn(CAR, transform(0.0, 0.0))
    car.set_enable_gravity(False)  # off its wheels, it is not held to their direction
    mass = car.get_physics_control().mass
    car.add_impulse(carla.Vector3D(2.0 * mass, 0.0, 0.0))
    car.add_force(carla.Vector3D(0.0, mass, 0.0))
    connected.world.tick()
    velocity = car.get_velocity()
    assert (velocity.x, velocity.y) == pytest.approx((2.0, DELTA))
    connected.world.tick()
    assert car.get_velocity().y == pytest.approx(DELTA)
