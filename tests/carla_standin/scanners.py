"""Lidar and radar: one point for each body that is near enough, in the middle of its box.

Layouts are LibCarla's (``LidarData.h``, ``RadarData.h``), proved by the client that reads them.
Both look by yaw alone. A radar's speed is that which bodies report, less its own displacement,
along its line (``Radar.cpp``): of a body without physics it sees no speed of its own.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable
from math import asin, atan2, cos, hypot, radians, sin, sqrt

from tests.carla_standin.actors import Actor
from tests.carla_standin.wire import Vector

_LIDAR_HEAD = struct.Struct("<fII")
"""Horizontal angle, how many channels, and points of the only one."""
_POINT = struct.Struct("<4f")
_INTENSITY = 0.5

Speed = Callable[[Actor], Vector]


def lidar(sensor: Actor, bodies: Iterable[Actor]) -> bytes:
    """Points: x ahead, y to the right, z up, metres, and intensity."""
    reach = float(sensor.attribute("range"))
    seen = [at for body in bodies if 0.0 < hypot(*(at := _from(sensor, body))) <= reach]
    points = b"".join(_POINT.pack(*at, _INTENSITY) for at in seen)
    return _LIDAR_HEAD.pack(0.0, 1, len(seen)) + points


def radar(sensor: Actor, bodies: Iterable[Actor], own: Vector, reported: Speed) -> bytes:
    """Detections: speed away from it (m/s), azimuth, altitude (rad), depth (m)."""
    reach = float(sensor.attribute("range"))
    half = radians(float(sensor.attribute("horizontal_fov"))) / 2.0
    found = b""
    for body in bodies:
        x, y, z = _from(sensor, body)
        depth = sqrt(x * x + y * y + z * z)
        if body is sensor.parent or not 0.0 < depth <= reach or abs(atan2(y, x)) > half:
            continue
        velocity = _turned(sensor, *(a - b for a, b in zip(reported(body), own, strict=True)))
        speed = sum(a * b for a, b in zip(velocity, (x, y, z), strict=True)) / depth
        found += _POINT.pack(speed, atan2(y, x), asin(z / depth), depth)
    return found


def _from(sensor: Actor, body: Actor) -> Vector:
    """Where the middle of a body is, seen from a sensor."""
    box = body.footprint()
    x, y, z, *_ = sensor.at
    return _turned(sensor, box.x - x, box.y - y, body.at[2] + body.box[0][2] - z)


def _turned(sensor: Actor, dx: float, dy: float, dz: float) -> Vector:
    yaw = radians(sensor.at[4])
    return dx * cos(yaw) + dy * sin(yaw), dy * cos(yaw) - dx * sin(yaw), dz
