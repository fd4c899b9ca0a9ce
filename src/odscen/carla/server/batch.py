"""What a server is asked to do in one tick; places are in CARLA's frame, metres and degrees."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

ROLE = "odscen."
"""Beginning of the ``role_name`` of every actor that we make; its id in the scenario follows."""
HEROES = ("hero", "ego_vehicle")
"""Roles by which external programs find, or mark, the vehicle they drive; the first is ours."""
LIFTS = (0.3, 0.6, 1.2)
"""Metres above its place at which a spawn is tried, one after the other.

A server refuses bodies that touch the ground, and takes them from 0.15 m on (issues 4006, 5730 and
8313 of carla-simulator/carla); they are put on their place before the tick.
"""

ENOUGH_TRIES = 2 * len(LIFTS)
"""Refused spawns of one road user after which a run in which none was ever taken is given up."""
WHEEL_CALLS = 6
"""Calls that turn the wheels of one vehicle: four that roll, two that are steered."""

POSITION, LOW_BEAM, HIGH_BEAM, BRAKE, RIGHT, LEFT, FOG, SIREN = 1, 2, 4, 8, 16, 32, 128, 512
"""Bits of CARLA's ``VehicleLightState``; the siren's light is its ``Special1``."""


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


class WheelTurn(NamedTuple):
    """How a vehicle's wheels stand, degrees: steered to the right, and rolled, ahead negative."""

    steer: float
    pitch: float


class DoorMove(NamedTuple):
    """Open or shut a door: ``FL``, ``FR``, ``RL`` or ``RR`` of CARLA's ``VehicleDoor``."""

    door: str
    opens: bool


class SwitchLights(NamedTuple):
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
    shine: tuple[SwitchLights, ...] = ()
    views: dict[int, ActorPlace] = field(default_factory=dict)
    """New places of cameras and of the spectator, by actor id."""
    signals: dict[int, str] = field(default_factory=dict)
    """New state (``Red``, ``Yellow``, ``Green``, ``Off``) of traffic lights, by actor id."""
    wheels: dict[int, WheelTurn] = field(default_factory=dict)
    """Wheels of vehicles without physics, by actor id."""
    doors: dict[int, tuple[DoorMove, ...]] = field(default_factory=dict)
    """Doors to open and to shut before anything moves, by actor id."""
