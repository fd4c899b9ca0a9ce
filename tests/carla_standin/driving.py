"""Vehicles on their wheels: a kinematic bicycle on the ground that obeys a VehicleControl.

Not PhysX: tyres do not slip, slopes neither push nor hold, and nothing collides. It is enough for
the client's Traffic Manager, whose controller sees speed and heading and sends throttle, brake and
steering. Numbers are those of a usual car, whatever the model; the wheelbase goes by the length.

Formulas: R. Rajamani, Vehicle Dynamics and Control, 2nd ed., section 2.2, with the reference point
in the middle between the axles.
"""

from __future__ import annotations

from collections.abc import Callable
from math import atan, atan2, copysign, cos, degrees, hypot, radians, sin, tan
from typing import Any

import numpy as np

from tests.carla_standin.poses import turned
from tests.carla_standin.wire import Pose, Vector

ENGINE, POWER = 5.0, 80.0
"""m/s2 at full throttle, and W/kg that are the most of it at higher speeds."""
BRAKES = 8.0
"""m/s2 at full brake or with the hand brake."""
ROLLING, DRAG = 0.2, 5e-4
"""m/s2 of a vehicle that coasts, and what is added by the square of its speed, 1/m."""
GRIP = 8.0
"""m/s2 to the side that tyres hold: a turn is no sharper."""
WHEEL_ANGLE = 70.0
"""Degrees of the front wheels at full steering."""
STEERING_CURVE = ((0.0, 1.0), (20.0, 0.9), (60.0, 0.8), (120.0, 0.7))
"""Share of that angle by speed, km/h; the default of CARLA's vehicles."""
WHEELBASE_SHARE = 0.6
"""Of a vehicle's length."""
GRAVITY = 9.81

_CLEAR = 0.02
"""Metres above the ground from which on wheels do not touch it."""

Ground = Callable[[float, float, float], float | None]
"""Height of what is below a place, if it is known."""


def driven(
    at: Pose, velocity: Vector, control: list[Any], *, wheelbase: float, dt: float, ground: Ground
) -> tuple[Pose, Vector, float]:
    """Pose, velocity and yaw rate (deg/s) of a vehicle after a tick of ``dt`` seconds.

    Where there is no ground it goes on at its height: land beside the roads is not known here.
    """
    x, y, z, pitch, yaw, roll = at
    below = ground(x, y, z)
    if below is not None and z > below + _CLEAR:
        return _falling(at, velocity, below, dt)
    ahead = turned(at, (1.0, 0.0, 0.0))
    speed = _speed(sum(a * v for a, v in zip(ahead, velocity, strict=True)), control, dt)
    slip, rate = _turn(speed, control[1], wheelbase)
    way = radians(yaw) + slip
    level = cos(radians(pitch))
    x, y = x + speed * level * cos(way) * dt, y + speed * level * sin(way) * dt
    yaw += degrees(rate) * dt
    rise, pitch = _on_ground((x, y, z, pitch, yaw, roll), wheelbase, ground)
    # What is said of the velocity is what brought it here.
    velocity = (speed * level * cos(way), speed * level * sin(way), (rise - z) / dt)
    return (x, y, rise, pitch, yaw, 0.0), velocity, degrees(rate)


def _falling(at: Pose, velocity: Vector, below: float, dt: float) -> tuple[Pose, Vector, float]:
    x, y, z, *turn = at
    vx, vy, vz = velocity
    vz = max(vz - GRAVITY * dt, (below - z) / dt)
    pitch, yaw, roll = turn
    return (x + vx * dt, y + vy * dt, z + vz * dt, pitch, yaw, roll), (vx, vy, vz), 0.0


def _speed(speed: float, control: list[Any], dt: float) -> float:
    """Speed ahead after a tick; brakes and resistance stop a vehicle, and turn none around."""
    throttle, _, brake, hand_brake, reverse, *_ = control
    push = throttle * min(ENGINE, POWER / max(abs(speed), 1.0))
    speed += (-push if reverse else push) * dt
    hold = BRAKES * max(brake, float(hand_brake)) + ROLLING + DRAG * speed**2
    return copysign(max(abs(speed) - hold * dt, 0.0), speed)


def _turn(speed: float, steer: float, wheelbase: float) -> tuple[float, float]:
    """Slip angle of the middle, rad, and yaw rate, rad/s."""
    share = float(np.interp(abs(speed) * 3.6, *zip(*STEERING_CURVE, strict=True)))
    wheels = tan(radians(WHEEL_ANGLE) * share * steer)
    most = wheelbase * GRIP / max(speed**2, 1e-6)
    wheels = min(max(wheels, -most), most)
    slip = atan(wheels / 2.0)
    return slip, speed / wheelbase * cos(slip) * wheels


def _on_ground(at: Pose, wheelbase: float, ground: Ground) -> tuple[float, float]:
    """Height and pitch (degrees) of a vehicle whose axles stand on the ground."""
    x, y, z, pitch, yaw, _ = at
    dx, dy = 0.5 * wheelbase * cos(radians(yaw)), 0.5 * wheelbase * sin(radians(yaw))
    front, rear = ground(x + dx, y + dy, z), ground(x - dx, y - dy, z)
    if front is None or rear is None:
        return z, pitch
    return (front + rear) / 2.0, degrees(atan2(front - rear, 2.0 * hypot(dx, dy)))
