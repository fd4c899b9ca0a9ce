"""RPCs about single actors."""

from __future__ import annotations

import os
from typing import Any

from tests.carla_standin import wire
from tests.carla_standin.actors import MASS, Actor, Kind
from tests.carla_standin.driving import STEERING_CURVE, WHEEL_ANGLE
from tests.carla_standin.poses import turned
from tests.carla_standin.rpc import Returns, rpc
from tests.carla_standin.switches import Switches
from tests.carla_standin.world import World

_NOTHING = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], 0]
_WHEEL = [3.5, 0.25, WHEEL_ANGLE, 35.0, 1500.0, 3000.0, 2.0, 17.0, 1000.0, [0.0, 0.0, 0.0]]
_DOORS, _ALL_DOORS = 4, 6
_PHYSICS = [
    [[0.0, 400.0], [5000.0, 400.0]], 5000.0, 1.0, 0.15, 2.0, 0.35, True, 0.0, 10.0, 4.0,
    [[4.0, 0.5, 0.65]], MASS, 0.3, [0.0, 0.0, 0.0], [list(point) for point in STEERING_CURVE],
    [_WHEEL] * 4, False,
]  # fmt: skip


def _doors(vehicle: Actor, door: int) -> set[int]:
    """Which doors a number means: FL, FR, RL, RR or all; none where a model has none."""
    if vehicle.attribute("has_dynamic_doors") != "true":
        return set()
    return set(range(_DOORS)) if door == _ALL_DOORS else {door} & set(range(_DOORS))


class ActorCalls:
    """Spawning, moving, steering. Methods take what is on the wire, without the metadata."""

    def __init__(self, world: World, switches: Switches) -> None:
        self._world = world
        self._switches = switches
        self._physics_controls: dict[int, list[Any]] = {}

    # ------------------------------------------------------------------------------- life
    @rpc("spawn_actor")
    def spawn(self, description: list[Any], at: list[Any]) -> list[Any]:
        return self._described(self._world.spawn(description, wire.pose(at)))

    @rpc("spawn_actor_with_parent")
    def spawn_with_parent(
        self, description: list[Any], at: list[Any], parent: int, *_attachment: Any
    ) -> list[Any]:
        return self._described(self._world.spawn(description, wire.pose(at), parent))

    @rpc("destroy_actor")
    def destroy(self, actor: int) -> bool:
        return self._world.destroy(actor)

    @rpc("get_actors_by_id")
    def described(self, ids: list[int]) -> list[Any]:
        actors = self._world.actors
        return [self._described(actors[number]) for number in ids if number in actors]

    @rpc("get_spectator")
    def spectator(self) -> list[Any]:
        return self._described(self._world.spectator)

    @rpc("get_actor_bounding_box")
    def bounding_box(self, actor: int) -> list[Any]:
        # The Traffic Manager asks for vehicles that are gone, and an error would kill the client.
        known = self._world.actors.get(actor)
        return known.box if known else _NOTHING

    # ------------------------------------------------------------------------------- motion
    @rpc("set_actor_transform", Returns.VOID)
    def set_transform(self, actor: int, at: list[Any]) -> None:
        found = self._world[actor]
        x, y, z, *turn = wire.pose(at)
        if found.kind is Kind.VEHICLE:
            x, z = x + self._switches.place_aside, z + self._switches.place_error
            if self._switches.drops_pitch:
                turn[0] = 0.0
            if self._switches.late_places:
                self._world.late_places[actor] = (x, y, z, *turn)
                return
        found.put((x, y, z, *turn))

    @rpc("set_actor_location", Returns.VOID)
    def set_location(self, actor: int, location: list[float]) -> None:
        found = self._world[actor]
        old = found.relative or found.at
        found.put((*wire.vector(location), *wire.vector(old[3:])))

    @rpc("set_actor_target_velocity", Returns.VOID)
    def set_velocity(self, actor: int, velocity: list[float]) -> None:
        self._world[actor].velocity = wire.vector(velocity)

    @rpc("set_actor_target_angular_velocity", Returns.VOID)
    def set_angular_velocity(self, actor: int, velocity: list[float]) -> None:
        self._world[actor].angular = wire.vector(velocity)

    @rpc("enable_actor_constant_velocity", Returns.VOID)
    def keep_velocity(self, actor: int, velocity: list[float]) -> None:
        """Keep a velocity of the actor's own frame."""
        found = self._world[actor]
        found.constant_velocity = wire.vector(velocity)
        found.velocity = turned(found.at, found.constant_velocity)

    @rpc("disable_actor_constant_velocity", Returns.VOID)
    def release_velocity(self, actor: int) -> None:
        self._world[actor].constant_velocity = None

    @rpc("add_actor_impulse", Returns.VOID)
    @rpc("add_actor_impulse_at_location", Returns.VOID)
    def push(self, actor: int, impulse: list[float], *_where: Any) -> None:
        self._world[actor].push(wire.vector(impulse))

    @rpc("add_actor_force", Returns.VOID)
    @rpc("add_actor_force_at_location", Returns.VOID)
    def pull(self, actor: int, force: list[float], *_where: Any) -> None:
        self._world[actor].force = wire.vector(force)

    @rpc("add_actor_angular_impulse", Returns.VOID)
    @rpc("add_actor_torque", Returns.VOID)
    @rpc("set_actor_collisions", Returns.VOID)
    def take_note(self, actor: int, *_what: Any) -> None:
        """Accept what has no effect here: actors have no moments of inertia and no collisions."""
        _ = self._world[actor]  # refuses an unknown one

    @rpc("set_actor_enable_gravity", Returns.VOID)
    def set_gravity(self, actor: int, on: bool) -> None:
        self._world[actor].gravity = on

    @rpc("set_actor_simulate_physics", Returns.VOID)
    def simulate_physics(self, actor: int, on: bool) -> None:
        found = self._world[actor]
        if found.physics != on:
            found.doors.clear()  # ResetConstraints opens and shuts all
        found.physics = on

    # ------------------------------------------------------------------------------- vehicles
    @rpc("apply_control_to_vehicle", Returns.VOID)
    def drive(self, actor: int, control: list[Any]) -> None:
        self._world.of_kind(actor, Kind.VEHICLE).drive(control)

    @rpc("apply_ackermann_control_to_vehicle", Returns.VOID)
    @rpc("show_vehicle_debug_telemetry", Returns.VOID)
    def note_vehicle(self, actor: int, *_: Any) -> None:
        """Accept what has no effect here."""
        self._world.of_kind(actor, Kind.VEHICLE)

    @rpc("set_actor_autopilot", Returns.VOID)
    def autopilot(self, actor: int, on: bool) -> None:
        """Remember it; nothing drives but a Traffic Manager in the client."""
        self._world.of_kind(actor, Kind.VEHICLE).autopilot = on

    @rpc("set_vehicle_light_state", Returns.VOID)
    def set_lights(self, actor: int, state: list[int]) -> None:
        self.set_light_flags(actor, state[0])

    def set_light_flags(self, actor: int, flags: int) -> None:
        vehicle = self._world.of_kind(actor, Kind.VEHICLE)
        if not self._switches.deaf_lamps:
            vehicle.lights = flags

    @rpc("get_vehicle_light_state")
    def lights(self, actor: int) -> list[int]:
        return [self._world.of_kind(actor, Kind.VEHICLE).lights]

    @rpc("get_vehicle_light_states")
    def all_lights(self) -> list[list[int]]:
        vehicles = self._world.actors.values()
        return [[actor.id, actor.lights] for actor in vehicles if actor.kind is Kind.VEHICLE]

    @rpc("get_physics_control")
    def physics_control(self, actor: int) -> list[Any]:
        self._world.of_kind(actor, Kind.VEHICLE)
        return self._physics_controls.get(actor, _PHYSICS)

    @rpc("apply_physics_control", Returns.VOID)
    def set_physics_control(self, actor: int, control: list[Any]) -> None:
        self._world.of_kind(actor, Kind.VEHICLE)
        self._physics_controls[actor] = control

    @rpc("set_wheel_steer_direction", Returns.VOID)
    def steer_wheel(self, actor: int, wheel: int, angle: float) -> None:
        self._turn_wheel(actor, wheel, 0, angle)

    @rpc("set_wheel_pitch_angle", Returns.VOID)
    def roll_wheel(self, actor: int, wheel: int, angle: float) -> None:
        self._turn_wheel(actor, wheel, 1, angle)

    def _turn_wheel(self, actor: int, wheel: int, kind: int, angle: float) -> None:
        """Turn a wheel by hand, which acts only without physics (CarlaWheeledVehicle.cpp)."""
        vehicle = self._world.of_kind(actor, Kind.VEHICLE)
        if not vehicle.physics:
            vehicle.wheels.setdefault(wheel, [0.0, 0.0])[kind] = angle

    @rpc("open_vehicle_door", Returns.VOID)
    def open_door(self, actor: int, door: int) -> None:
        vehicle = self._world.of_kind(actor, Kind.VEHICLE)
        vehicle.doors |= _doors(vehicle, door)

    @rpc("close_vehicle_door", Returns.VOID)
    def close_door(self, actor: int, door: int) -> None:
        vehicle = self._world.of_kind(actor, Kind.VEHICLE)
        vehicle.doors -= _doors(vehicle, door)

    # ------------------------------------------------------------------------------- walkers
    @rpc("apply_control_to_walker", Returns.VOID)
    def walk(self, actor: int, control: list[Any]) -> None:
        self._world.of_kind(actor, Kind.WALKER).walk_on(control)

    def set_walker_state(self, actor: int, at: list[Any], speed: float) -> None:
        """Put a walker on the ground somewhere, walking ahead; only exists as a command.

        The server adds half the height of the capsule itself: CarlaActor.cpp since pull request
        6395, and the client's own walkers send the height of the ground.
        """
        walker = self._world.of_kind(actor, Kind.WALKER)
        if walker.dormant:
            os._exit(139)
        x, y, z, *turn = wire.pose(at)
        half = walker.box[1][2] if self._switches.half_capsule else 0.0
        walker.put((x, y, z + half, *turn))
        walker.walk_on([list(turned(walker.at, (1.0, 0.0, 0.0))), speed, False])

    def _described(self, actor: Actor) -> list[Any]:
        return actor.wire(self._world.token(actor))
