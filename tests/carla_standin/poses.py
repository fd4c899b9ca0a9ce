"""Vectors and poses turned into the frames of others: Unreal's order of rotations, left-handed."""

from __future__ import annotations

from math import cos, radians, sin

from tests.carla_standin import wire
from tests.carla_standin.wire import Pose, Vector


def turned(frame: Pose, local: Vector) -> Vector:
    """Vector of a pose's frame in the world."""
    _, _, _, pitch, yaw, roll = frame
    sp, cp = sin(radians(pitch)), cos(radians(pitch))
    sy, cy = sin(radians(yaw)), cos(radians(yaw))
    sr, cr = sin(radians(roll)), cos(radians(roll))
    x, y, z = local
    return (
        cp * cy * x + (cy * sp * sr - sy * cr) * y - (cy * sp * cr + sy * sr) * z,
        cp * sy * x + (sy * sp * sr + cy * cr) * y - (sy * sp * cr - cy * sr) * z,
        sp * x - cp * sr * y + cp * cr * z,
    )


def attached(parent: Pose, relative: Pose) -> Pose:
    """Pose of something attached; rotations are added, which is exact for a level parent."""
    dx, dy, dz = turned(parent, wire.vector(relative[:3]))
    x, y, z, pitch, yaw, roll = parent
    return (
        x + dx, y + dy, z + dz, pitch + relative[3], yaw + relative[4], roll + relative[5]
    )  # fmt: skip
