"""What goes over the wire: answers, tokens and state messages of a CARLA server.

Metres, degrees, m/s, deg/s, seconds; x forward, y right, z up; rotations are pitch, yaw, roll. RPC
structs are msgpack arrays, streams are packed little-endian.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

CLIENT_VERSION: Final = "0.9.16"
WORLD_OBSERVER: Final = 1
"""Stream id of the state messages; sensors count up from 2."""

TOKEN_BYTES: Final = 24
TAIL_BYTES: Final = 54

_TOKEN = struct.Struct("<IHBB16x")
_TCP = 1
_HEADER = struct.Struct("<QQd6f")
_EPISODE = struct.Struct("<Qdf3iI")
_ACTOR = struct.Struct("<IB15f")
_IMAGE = struct.Struct("<IIf")
RADAR, LIDAR = 9, 11
"""Types of sensors, as in the header of their messages."""
_SENSOR_RGB_CAMERA = 13
_ACTIVE, _DORMANT = 1, 2

VEHICLE_TAIL: Final = struct.Struct("<3f3?ifB?IB")
WALKER_TAIL: Final = struct.Struct("<4f?")
LIGHT_TAIL: Final = struct.Struct("<32s4fI?B")
SIGN_TAIL: Final = struct.Struct("<32s")

Vector = tuple[float, float, float]
Pose = tuple[float, float, float, float, float, float]
"""x, y, z, pitch, yaw, roll."""

ZERO: Final[Vector] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class SpokenRelease:
    """What of the wire is another in another release, as their clients were seen to take it.

    Attributes
    ----------
    world_observer
        Type of state messages among sensors.
    first_attribute
        Number of the first type of attributes, that of switches.
    """

    world_observer: int
    first_attribute: int


SPOKEN: Final = {
    "0.9.15": SpokenRelease(16, 0),
    CLIENT_VERSION: SpokenRelease(17, 1),
    "0.10.0": SpokenRelease(16, 0),
}
_spoken = SPOKEN[CLIENT_VERSION]


def speak(release: str) -> None:
    """Speak as servers of a release do, in the whole process."""
    global _spoken  # noqa: PLW0603
    _spoken = SPOKEN[release]


def attribute_type(place: int) -> int:
    """Number of a type of attributes: switch, whole number, number, text, colour from 0 on."""
    return _spoken.first_attribute + place


class RefusedError(Exception):
    """The server refuses a call; the client raises ``RuntimeError`` with this text."""


def value(result: Any) -> list[Any]:
    """``Response<T>`` that carries a result."""
    return [[1, result]]


def value_error(message: str) -> list[Any]:
    """``Response<T>`` that refuses."""
    return [[0, [message]]]


def void() -> list[Any]:
    """``Response<void>`` without an error."""
    return [[False]]


def void_error(message: str) -> list[Any]:
    """``Response<void>`` that refuses."""
    return [[True, [message]]]


def token(stream: int, port: int) -> bytes:
    """Where to subscribe to a stream; without an address the client keeps to its own host."""
    return _TOKEN.pack(stream, port, _TCP, 0)


def pose(transform: list[list[float]]) -> Pose:
    """Flatten a Transform, ``[[x, y, z], [pitch, yaw, roll]]``."""
    (x, y, z), (pitch, yaw, roll) = transform
    return (x, y, z, pitch, yaw, roll)


def transform(at: Pose) -> list[list[float]]:
    """Transform of a flat pose; inverse of :func:`pose`."""
    return [list(at[:3]), list(at[3:])]


def vector(values: Iterable[float]) -> Vector:
    """Vector3D, checked for its length."""
    x, y, z = values
    return (x, y, z)


def actor_record(
    actor: int,
    at: Pose,
    velocity: Vector,
    angular: Vector,
    acceleration: Vector,
    tail: bytes,
    *,
    dormant: bool = False,
) -> bytes:
    """One actor of a state message; ``tail`` is padded to the 54 bytes of the union."""
    state = _DORMANT if dormant else _ACTIVE
    head = _ACTOR.pack(actor, state, *at, *velocity, *angular, *acceleration)
    return head + tail.ljust(TAIL_BYTES, b"\0")


def state_message(
    *,
    frame: int,
    elapsed: float,
    delta: float,
    episode: int,
    platform_time: float,
    records: Iterable[bytes],
) -> bytes:
    """State of the world in one frame, for the world observer's stream.

    ``platform_time`` is the server's own clock. A new number of the episode is all that clients
    need to notice another map.
    """
    return b"".join(
        (
            _HEADER.pack(_spoken.world_observer, frame, elapsed, *ZERO, *ZERO),
            _EPISODE.pack(episode, platform_time, delta, 0, 0, 0, 0),
            *records,
        )
    )


def scan_message(kind: int, *, frame: int, elapsed: float, at: Pose, payload: bytes) -> bytes:
    """Message of a lidar or radar, by its type of sensor."""
    return _HEADER.pack(kind, frame, elapsed, *at) + payload


def image_message(
    *, frame: int, elapsed: float, at: Pose, width: int, height: int, fov: float, bgra: bytes
) -> bytes:
    """Picture of an RGB camera, ``width * height`` pixels of 4 bytes, rows from the top."""
    if len(bgra) != width * height * 4:
        # A wrong length aborts the client's whole process: never send one.
        raise ValueError(f"{len(bgra)} bytes are no picture of {width} x {height} pixels")
    header = _HEADER.pack(_SENSOR_RGB_CAMERA, frame, elapsed, *at)
    return header + _IMAGE.pack(width, height, fov) + bgra
