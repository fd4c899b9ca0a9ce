"""The world: actors, settings, weather, maps; what a tick does and what clients see of it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from math import hypot
from typing import Any

import numpy as np

from odscen.scenario.placing.bodies import overlap
from odscen.simulators.assets import shipped_assets
from tests.carla_standin import camera, scanners, wire
from tests.carla_standin.actors import Actor, Kind
from tests.carla_standin.blueprints import (
    CAMERA,
    LIDAR,
    SIGN_TAG,
    TRAFFIC_LIGHT_TAG,
    WALKER_CONTROLLER,
    Definition,
    definitions,
)
from tests.carla_standin.poses import attached
from tests.carla_standin.road_map import RoadMap, RoadSign
from tests.carla_standin.streams import StreamServer
from tests.carla_standin.switches import Switches
from tests.carla_standin.traffic_lights import TrafficLights
from tests.carla_standin.wire import Pose

ASYNC_DELTA = 0.05
"""Seconds between ticks, on the clock, while no client ticks."""

_SETTINGS = [False, False, [False], True, 0.01, 10, 0.0, True, 3000.0, 2000.0, True]
_SYNCHRONOUS, _FIXED_DELTA, _STREAM_DISTANCE, _ACTIVE_DISTANCE = 0, 2, 8, 9
_HEROES = ("hero", "ego_vehicle")
_SUNK = 1.0
"""Metres by which a body may be below the ground that carries it."""
_TRIGGER = [[0.0, 0.0, 0.0], [2.0, 2.0, 2.0], [0.0, 0.0, 0.0]]
_POINT = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]


class World:
    """Everything a client can see; ids of actors, episodes and streams are never used again."""

    def __init__(self, road_map: RoadMap, streams: StreamServer, switches: Switches) -> None:
        self.definitions = definitions()
        self.settings: list[Any] = list(_SETTINGS)
        self.weather = list(shipped_assets().preset("ClearNoon").parameters.values())
        self.traffic_managers: dict[int, str] = {}
        self.frame = 0
        self.episode = 0
        self.box_offset = (0.0, 0.0)
        self.spectator: Actor
        self._streams = streams
        self._switches = switches
        self._next_id = 1
        self._next_stream = wire.WORLD_OBSERVER + 1
        self._captured: dict[int, float] = {}
        self._were: dict[int, wire.Vector] = {}
        self.open(road_map)

    # ------------------------------------------------------------------------------- episodes
    def open(self, road_map: RoadMap) -> None:
        """Begin an episode on a map: nothing is left but its traffic lights and signs."""
        self.map = road_map
        self.episode += 1
        self.elapsed = 0.0
        self.actors: dict[int, Actor] = {}
        self.lights = TrafficLights()
        self.traffic_managers.clear()
        self._captured.clear()
        self.late_places: dict[int, Pose] = {}
        nowhere = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self.spectator = self._enter(
            Actor(self._next_id, [0, "spectator", []], nowhere, [*_POINT, self._next_id])
        )
        placed = {sign.id: self._add_sign(sign) for sign in road_map.signs}
        lights = [actor for actor in placed.values() if actor.kind is Kind.LIGHT]
        for actor in lights[: self._switches.nameless_lights]:
            actor.sign_id = ""
        for group in road_map.groups:
            self.lights.add_group([[placed[sign] for sign in sorted(turn)] for turn in group])

    def reset_settings(self) -> None:
        """Back to what a server starts with."""
        self.settings = list(_SETTINGS)

    @property
    def synchronous(self) -> bool:
        """Whether the world waits for clients to tick."""
        return bool(self.settings[_SYNCHRONOUS])

    @property
    def delta(self) -> float:
        """Simulated seconds of a tick."""
        fixed = self.settings[_FIXED_DELTA]
        return float(fixed[1]) if fixed[0] else ASYNC_DELTA

    # ------------------------------------------------------------------------------- actors
    def __getitem__(self, actor: int) -> Actor:
        """Actor by id; refuses an unknown one."""
        if actor not in self.actors:
            raise wire.RefusedError(f"Actor could not be found in the registry.  Actor Id: {actor}")
        return self.actors[actor]

    def of_kind(self, actor: int, kind: Kind) -> Actor:
        """Actor by id; refuses one of another kind."""
        found = self[actor]
        if found.kind is not kind:
            raise wire.RefusedError(f"Actor is not a {kind.name.title()}. Actor Id: {actor}")
        return found

    def spawn(self, description: list[Any], at: Pose, parent: int | None = None) -> Actor:
        """Spawn an actor; with a parent, ``at`` is relative to it."""
        refusal = self._switches.refuse_spawn()
        if refusal is not None:
            raise wire.RefusedError(refusal)
        definition = self.definitions.get(description[1])
        if definition is None:
            raise wire.RefusedError("Spawn failed because of invalid actor description")
        if parent is not None and parent not in self.actors:
            raise wire.RefusedError("unable to attach actor: parent actor not found")
        actor = self._make(definition, description, at, parent)
        grounded = self._switches.refuse_grounded and self._is_grounded(actor)
        if definition.has_body and (grounded or self._is_taken(actor)):
            raise wire.RefusedError("Spawn failed because of a collision at spawn position")
        if actor.sees:
            actor.stream = self._next_stream
            self._next_stream += 1
        return self._enter(actor)

    def destroy(self, actor: int) -> bool:
        """Destroy an actor; what is attached to it stays where it is."""
        if actor not in self.actors or self._switches.keeps_actors:
            raise wire.RefusedError("unable to destroy actor: not found")
        gone = self.actors.pop(actor)
        for other in self.actors.values():
            if other.parent is gone:
                other.parent = other.relative = None
        return True

    def token(self, actor: Actor) -> bytes:
        """Token of an actor's stream, empty for what is no sensor."""
        return b"" if actor.stream is None else self._streams.token(actor.stream)

    def _make(
        self, definition: Definition, description: list[Any], at: Pose, parent: int | None
    ) -> Actor:
        owner = self.actors[parent] if parent is not None else None
        moved = self.box_offset if Kind.of(definition.id) is Kind.VEHICLE else (0.0, 0.0)
        box = [[*moved, definition.box_height], list(definition.half_size), [0.0, 0.0, 0.0]]
        return Actor(
            self._next_id,
            description,
            attached(owner.at, at) if owner else at,
            [*box, self._next_id],
            tag=definition.semantic_tag,
            parent=owner,
            relative=at if owner else None,
            physics=definition.id != WALKER_CONTROLLER,
        )

    def _enter(self, actor: Actor) -> Actor:
        self.actors[actor.id] = actor
        self._next_id += 1
        return actor

    def _add_sign(self, sign: RoadSign) -> Actor:
        return self._enter(
            Actor(
                self._next_id,
                [0, sign.type_id, []],
                sign.at,
                [*_TRIGGER, self._next_id],
                tag=TRAFFIC_LIGHT_TAG if sign.type_id == Kind.LIGHT.value else SIGN_TAG,
                sign_id=sign.id,
            )
        )

    def _is_taken(self, actor: Actor) -> bool:
        ground = actor.footprint()
        return any(
            overlap(ground, other.footprint())
            for other in self.actors.values()
            if other.kind in (Kind.VEHICLE, Kind.WALKER)
        )

    def _is_grounded(self, actor: Actor) -> bool:
        """Whether a body touches the ground: issues 4006, 5730 and 8313 of carla-simulator/carla.

        Wheels and suspension reach below a vehicle's origin, a capsule is as low as its box.
        """
        x, y, z, *_ = actor.at
        (_, _, middle), (_, _, half), *_ = actor.box
        above = z + middle - half - self.map.ground_at(x, y)
        return bool(np.any((above < self._switches.least_lift) & (above > -2.0 * half)))

    def surface(self, x: float, y: float, z: float) -> tuple[float, bool] | None:
        """Height of what is below a place, and whether that is a sidewalk."""
        if self._switches.large_map and not self._is_loaded(x, y):
            return None
        return self.map.surface(x, y, z, self._switches.kerb)

    def _ground(self, x: float, y: float, z: float) -> float | None:
        """Height of the ground below a body that stands on it, or has sunk in a little."""
        found = self.surface(x, y, z + _SUNK)
        return None if found is None else found[0]

    # ------------------------------------------------------------------------------- ticks
    def tick(self) -> int:
        """Let one tick pass and show it; the number of the new frame."""
        dt = self.delta
        self.frame += self._switches.frames_per_tick
        self.elapsed += dt * self._switches.time_factor
        # A parent is older than what is attached to it, and a dictionary keeps its order.
        for actor in self.actors.values():
            actor.advance(dt, self._ground)
            if self._switches.walkers_drift and actor.kind is Kind.WALKER:
                actor.drift(dt)
        if self._switches.large_map:
            self._let_sleep()
        self.lights.advance(dt)
        self.show()
        self._take_pictures()
        for number, at in self.late_places.items():
            if number in self.actors:
                self.actors[number].put(at)
        self.late_places.clear()
        return self.frame

    def show(self) -> None:
        """Send the state of the present frame to all who watch."""
        message = wire.state_message(
            frame=self.frame,
            elapsed=self.elapsed,
            delta=self.delta,
            episode=self.episode,
            platform_time=time.monotonic(),
            records=[self._record(actor) for actor in self.actors.values()],
        )
        self._streams.send(wire.WORLD_OBSERVER, message)

    def _record(self, actor: Actor) -> bytes:
        reported = actor.reported_velocity(self._switches.still_speed)
        if actor.physics and self._switches.speed_factor != 1.0:
            reported = wire.vector(self._switches.speed_factor * part for part in reported)
        return actor.record(reported)

    def _let_sleep(self) -> None:
        """Make actors dormant that are too far from all heroes of a large map (LargeMapManager)."""
        reach, heroes = float(self.settings[_ACTIVE_DISTANCE]), self._heroes()
        for actor in self._bodies():
            actor.dormant = all(
                hypot(actor.at[0] - one.at[0], actor.at[1] - one.at[1]) > reach for one in heroes
            )

    def _is_loaded(self, x: float, y: float) -> bool:
        """Whether the tile of a place is there: those near heroes are (LargeMapManager)."""
        reach = float(self.settings[_STREAM_DISTANCE])
        return any(hypot(x - one.at[0], y - one.at[1]) <= reach for one in self._heroes())

    def _heroes(self) -> Sequence[Actor]:
        """Those around whom a large map is awake: by their roles, or else the spectator."""
        heroes = [
            actor
            for actor in self._bodies()
            if actor.kind is Kind.VEHICLE
            and any(role in actor.attribute("role_name") for role in _HEROES)
        ]
        return heroes or [self.spectator]

    def _take_pictures(self) -> None:
        sensors = [a for a in self.actors.values() if a.sees and self._is_due(a)]
        bodies = self._bodies() if sensors else ()
        for actor in sensors:
            self._captured[actor.id] = self.elapsed
            self._streams.send(actor.stream or 0, self._seen_by(actor, bodies))
        self._were = {actor.id: wire.vector(actor.at[:3]) for actor in sensors}

    def _seen_by(self, actor: Actor, bodies: Sequence[Actor]) -> bytes:
        if actor.type_id == CAMERA:
            return camera.take(actor, bodies, frame=self.frame, elapsed=self.elapsed)
        if actor.type_id == LIDAR:
            kind, payload = wire.LIDAR, scanners.lidar(actor, bodies)
        else:
            here = actor.at[:3]
            was = self._were.get(actor.id, here)
            own = wire.vector((a - b) / self.delta for a, b in zip(here, was, strict=True))
            still = self._switches.still_speed
            kind = wire.RADAR
            payload = scanners.radar(actor, bodies, own, lambda one: one.reported_velocity(still))
        return wire.scan_message(
            kind, frame=self.frame, elapsed=self.elapsed, at=actor.at, payload=payload
        )

    def _is_due(self, actor: Actor) -> bool:
        if actor.stream is None or not self._streams.is_watched(actor.stream):
            return False
        last = self._captured.get(actor.id)
        pause = float(actor.attribute("sensor_tick"))
        # Times are sums of steps: a hair less than the pause is the pause.
        return last is None or self.elapsed - last >= pause - 1e-6

    def _bodies(self) -> Sequence[Actor]:
        return [a for a in self.actors.values() if a.kind in (Kind.VEHICLE, Kind.WALKER)]
