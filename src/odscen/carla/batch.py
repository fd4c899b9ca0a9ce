"""What a server is asked to do in one tick; places are in CARLA's frame, metres and degrees."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple


class ActorPlace(NamedTuple):
    """Origin of an actor: x, y, z, then pitch and yaw in degrees."""

    x: float
    y: float
    z: float
    pitch: float
    yaw: float


class Velocity(NamedTuple):
    """m/s in the world."""

    x: float
    y: float
    z: float


class Move(NamedTuple):
    """Put an actor somewhere; a walker with a speed, at which it moves its legs."""

    actor: int
    at: ActorPlace
    velocity: Velocity
    speed: float
    walks: bool


class Shine(NamedTuple):
    """Switch a vehicle's lights: bits of CARLA's ``VehicleLightState``."""

    actor: int
    flags: int


@dataclass(frozen=True, slots=True)
class Spawn:
    """Make an actor.

    Attributes
    ----------
    blueprint, role_name
        What, and the mark that it is ours.
    at
        Where it is to be.
    lift
        Metres above that at which it is made, for a server refuses what touches the ground.
    flags
        Lights, 0 for walkers.
    """

    blueprint: str
    role_name: str
    at: ActorPlace
    velocity: Velocity
    speed: float
    walks: bool
    lift: float
    flags: int


@dataclass(frozen=True, slots=True)
class Batch:
    """One tick. Everything in it happens before the tick is made."""

    destroy: tuple[int, ...] = ()
    spawn: tuple[Spawn, ...] = ()
    move: tuple[Move, ...] = ()
    shine: tuple[Shine, ...] = ()
    signals: dict[int, str] = field(default_factory=dict)
    """New state (``Red``, ``Yellow``, ``Green``, ``Off``) of traffic lights, by actor id."""
