"""Actors: what each is, where it is, how it moves, and its record in the state message."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from math import cos, hypot, radians, sin
from typing import Any

from odscen.scenario.placing.bodies import Box
from tests.carla_standin import driving, wire
from tests.carla_standin.blueprints import CAMERA, LIDAR, RADAR
from tests.carla_standin.driving import Ground
from tests.carla_standin.poses import attached, turned
from tests.carla_standin.wire import ZERO, Pose, Vector

_NO_CONTROL = [0.0, 0.0, 0.0, False, False, False, 0]
_NO_WALK = [[1.0, 0.0, 0.0], 0.0, False]
_SPEED_LIMIT = 30.0
_LEFT = 0.001
"""Metres that a vehicle is put away from an open door."""
_GREEN = 2
MASS = 1500.0
"""Of every actor, kg: impulses and forces act, but not true to the model."""


class Kind(Enum):
    """What the union at the end of an actor's record holds."""

    VEHICLE = "vehicle."
    WALKER = "walker."
    LIGHT = "traffic.traffic_light"
    SIGN = "traffic."
    OTHER = ""

    @classmethod
    def of(cls, type_id: str) -> Kind:
        """Kind of a blueprint, by the beginning of its id."""
        return next(kind for kind in cls if type_id.startswith(kind.value))


@dataclass(slots=True, eq=False)
class Actor:
    """One actor. Angular velocities are deg/s; ``box`` is local, as a BoundingBox on the wire.

    ``wheels`` are those turned by hand: steering and pitch, degrees, by number. ``doors`` are those
    that are open, and ``left_doors`` counts how often it was put elsewhere while some were: an open
    door is a body of its own, on a joint, and does not go with its vehicle (``OpenDoorPhys`` of
    CarlaWheeledVehicle.cpp).

    Without ``physics`` an actor stays where it was put and reports velocity 0, whatever it was
    given, as on a real server (issues 7143, 3683 and 4774 of carla-simulator/carla). With it a
    vehicle falls to the ground and goes on its wheels, as its ``control`` says
    (:mod:`tests.carla_standin.driving`); without ``gravity``, and at a velocity that is kept for
    it, it moves by its velocity, and so does a walker. Nothing collides.
    """

    id: int
    description: list[Any]
    at: Pose
    box: list[Any]
    tag: int = 0
    sign_id: str = ""
    stream: int | None = None
    parent: Actor | None = None
    relative: Pose | None = None
    velocity: Vector = ZERO
    angular: Vector = ZERO
    acceleration: Vector = ZERO
    previous_velocity: Vector = ZERO
    constant_velocity: Vector | None = None
    force: Vector = ZERO
    physics: bool = True
    gravity: bool = True
    autopilot: bool = False
    dormant: bool = False
    lights: int = 0
    wheels: dict[int, list[float]] = field(default_factory=dict)
    doors: set[int] = field(default_factory=set)
    left_doors: int = 0
    control: list[Any] = field(default_factory=lambda: list(_NO_CONTROL))
    walk: list[Any] = field(default_factory=lambda: list(_NO_WALK))
    kind: Kind = field(init=False)
    tail: bytes = field(init=False, default=b"")

    def __post_init__(self) -> None:
        self.kind = Kind.of(self.type_id)
        if self.kind is Kind.VEHICLE:
            self.drive(self.control)
        elif self.kind is Kind.WALKER:
            self.walk_on(self.walk)
        elif self.kind is Kind.SIGN:
            self.tail = wire.SIGN_TAIL.pack(self.sign_id.encode())

    @property
    def type_id(self) -> str:
        """Id of the blueprint."""
        return str(self.description[1])

    @property
    def sees(self) -> bool:
        """Whether it is a sensor with a stream."""
        return self.type_id in (CAMERA, LIDAR, RADAR)

    def attribute(self, name: str) -> str:
        """Value of an attribute that was given at spawning."""
        return next(str(value) for key, _, value in self.description[2] if key == name)

    def wire(self, token: bytes) -> list[Any]:
        """Actor, with the token of its stream."""
        parent = self.parent.id if self.parent else 0
        return [self.id, parent, self.description, self.box, bytes([self.tag]), token]

    def reported_velocity(self, still: float) -> Vector:
        """What it says of its velocity: without physics ``still`` m/s, whatever it was given."""
        if self.physics or self.parent is not None:
            return self.velocity
        return (still, 0.0, 0.0)

    def record(self, velocity: Vector) -> bytes:
        """Its part of the state message, with what it says of its velocity."""
        if not self.physics and self.parent is None:
            return wire.actor_record(
                self.id, self.at, velocity, ZERO, ZERO, self.tail, dormant=self.dormant
            )
        return wire.actor_record(
            self.id,
            self.at,
            velocity,
            self.angular,
            self.acceleration,
            self.tail,
            dormant=self.dormant,
        )

    def footprint(self) -> Box:
        """Rectangle on the ground, in CARLA's frame."""
        (ahead, right, _), (length, width, _) = self.box[:2]
        x, y, z, _, yaw, _ = self.at
        ux, uy = cos(radians(yaw)), sin(radians(yaw))
        middle = x + ahead * ux - right * uy, y + ahead * uy + right * ux
        return Box(*middle, z, ux, uy, length, width)

    def drive(self, control: list[Any]) -> None:
        """Take a VehicleControl: it acts from the next tick on, and is shown to clients."""
        self.control = control
        # No traffic light ever acts on a vehicle here: the client sees green.
        self.tail = wire.VEHICLE_TAIL.pack(*control, _SPEED_LIMIT, _GREEN, False, 0, 0)

    def walk_on(self, walk: list[Any]) -> None:
        """Take a WalkerControl: walk straight on in its direction, and look there."""
        self.walk = walk
        (x, y, z), speed, jump = walk
        self.tail = wire.WALKER_TAIL.pack(x, y, z, speed, jump)
        norm = hypot(x, y, z)
        self.velocity = (x / norm * speed, y / norm * speed, z / norm * speed) if norm else ZERO

    def put(self, at: Pose) -> None:
        """Teleport; the pose of an attached actor is relative to its parent, as in CARLA."""
        if self.parent is None:
            away = max(abs(new - old) for new, old in zip(at[:3], self.at[:3], strict=True))
            self.left_doors += bool(self.doors) and away > _LEFT
            self.at = at
        else:
            self.relative = at
            self.at = attached(self.parent.at, at)

    def push(self, impulse: Vector) -> None:
        """Change the velocity by an impulse, N s."""
        x, y, z = self.velocity
        self.velocity = (x + impulse[0] / MASS, y + impulse[1] / MASS, z + impulse[2] / MASS)

    def advance(self, dt: float, ground: Ground) -> None:
        """Move by one tick of ``dt`` seconds over ``ground``."""
        if self.parent is not None and self.relative is not None:
            self.at = attached(self.parent.at, self.relative)
            self.velocity = self.parent.velocity
            return
        if self.constant_velocity is not None:
            self.velocity = turned(self.at, self.constant_velocity)
        if self.force != ZERO:
            fx, fy, fz = self.force
            self.push((fx * dt, fy * dt, fz * dt))
            self.force = ZERO
        if self.physics:
            if self._on_wheels:
                self._drive_on(dt, ground)
            elif self.velocity != ZERO or self.angular != ZERO:
                self._move(dt)
        velocity = self.velocity
        if velocity != self.previous_velocity or self.acceleration != ZERO:
            (a, b, c), (d, e, f) = velocity, self.previous_velocity
            self.acceleration = ((a - d) / dt, (b - e) / dt, (c - f) / dt)
            self.previous_velocity = velocity

    def drift(self, dt: float) -> None:
        """Walk on from where it was put, though it has no physics."""
        if not self.physics:
            self._move(dt)

    @property
    def _on_wheels(self) -> bool:
        return self.kind is Kind.VEHICLE and self.gravity and self.constant_velocity is None

    def _drive_on(self, dt: float, ground: Ground) -> None:
        length = 2.0 * self.box[1][0]
        self.at, self.velocity, rate = driving.driven(
            self.at,
            self.velocity,
            self.control,
            wheelbase=driving.WHEELBASE_SHARE * length,
            dt=dt,
            ground=ground,
        )
        self.angular = (0.0, 0.0, rate)

    def _move(self, dt: float) -> None:
        x, y, z, pitch, yaw, roll = self.at
        vx, vy, vz = self.velocity
        self.at = (x + vx * dt, y + vy * dt, z + vz * dt, pitch, yaw + self.angular[2] * dt, roll)
