from __future__ import annotations

from math import atan, cos, degrees, hypot, radians, sin, tan

import pytest

from tests.carla_standin import driving
from tests.carla_standin.driving import Ground, driven
from tests.carla_standin.wire import ZERO, Pose, Vector

DT = 0.05
WHEELBASE = 2.8
START: Pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def level(_x: float, _y: float, _z: float) -> float:
    return 0.0


def control(throttle: float = 0.0, steer: float = 0.0, brake: float = 0.0) -> list[float | bool]:
    return [throttle, steer, brake, False, False, False, 0]


def driven_for(
    ticks: int,
    at: Pose,
    velocity: Vector,
    steering: list[float | bool],
    ground: Ground = level,
) -> list[tuple[Pose, Vector, float]]:
    """After each tick: pose, velocity, yaw rate."""
    seen = []
    for _ in range(ticks):
        at, velocity, rate = driven(
            at, velocity, steering, wheelbase=WHEELBASE, dt=DT, ground=ground
        )
        seen.append((at, velocity, rate))
    return seen


def test_full_throttle_drives_off_as_a_car_does_and_comes_to_a_top_speed() -> None:
    seen = driven_for(2400, START, ZERO, control(throttle=1.0))
    speeds = [velocity[0] for _, velocity, _ in seen]
    assert next(k for k, v in enumerate(speeds) if v > 100 / 3.6) * DT == pytest.approx(7.1, abs=1)
    assert 40.0 < speeds[-1] < 70.0
    assert speeds[-1] - speeds[-20] < 0.05


def test_a_full_brake_stops_a_vehicle_where_the_formula_says_and_turns_it_not_around() -> None:
    seen = driven_for(60, START, (20.0, 0.0, 0.0), control(brake=1.0))
    hold = driving.BRAKES + driving.ROLLING
    assert seen[-1][0][0] == pytest.approx(20.0**2 / (2 * hold), rel=0.05)
    assert seen[-1][1] == (0.0, 0.0, 0.0)


def test_a_steered_vehicle_goes_in_the_circle_of_its_front_wheels() -> None:
    seen = driven_for(200, START, (3.0, 0.0, 0.0), control(throttle=0.05, steer=0.3))
    speed = hypot(*seen[-1][1][:2])
    share = 1.0 - 0.1 * speed * 3.6 / 20.0  # of the steering curve's first piece
    wheels = radians(driving.WHEEL_ANGLE) * share * 0.3
    slip = atan(tan(wheels) / 2.0)
    radius = WHEELBASE / (tan(wheels) * cos(slip))
    assert radians(seen[-1][2]) == pytest.approx(speed / radius, rel=0.01)
    # To the right is towards +y, and the middle moves aside of where the vehicle looks.
    (_, _, _, _, yaw, _), (vx, vy, _), _ = seen[-1]
    assert yaw > 60.0
    way = radians(yaw - seen[-1][2] * DT) + slip
    assert (vx, vy) == pytest.approx((speed * cos(way), speed * sin(way)), abs=0.02)


def test_no_turn_is_sharper_than_tyres_hold() -> None:
    seen = driven_for(10, START, (20.0, 0.0, 0.0), control(throttle=0.2, steer=1.0))
    for _, (vx, vy, _), rate in seen:
        assert radians(rate) * hypot(vx, vy) <= driving.GRIP + 1e-6


def test_tyres_take_what_a_vehicle_moves_aside() -> None:
    [(at, velocity, _)] = driven_for(1, START, (5.0, 2.0, 0.0), control())
    assert velocity[1] == at[1] == 0.0


def test_a_vehicle_falls_to_the_ground_and_stays_on_it() -> None:
    high: Pose = (0.0, 0.0, 0.5, 0.0, 0.0, 0.0)
    heights = [at[2] for at, _, _ in driven_for(20, high, ZERO, control())]
    on_ground = next(k for k, z in enumerate(heights) if z == 0.0)
    assert (on_ground + 1) * DT == pytest.approx((2 * 0.5 / driving.GRAVITY) ** 0.5, abs=DT)
    assert heights[on_ground:] == [0.0] * (20 - on_ground)


def test_on_a_slope_a_vehicle_looks_up_it_and_says_how_it_climbs() -> None:
    seen = driven_for(40, START, (10.0, 0.0, 0.0), control(0.1), lambda x, _y, _z: 0.1 * x)
    (x, _, z, pitch, _, _), velocity, _ = seen[-1]
    assert pitch == pytest.approx(degrees(atan(0.1)))
    assert z == pytest.approx(0.1 * x)
    assert velocity[2] == pytest.approx(0.1 * velocity[0], rel=0.01)


def test_every_displacement_is_the_velocity_that_is_reported() -> None:
    before = START
    for at, velocity, _ in driven_for(50, START, (8.0, 0.0, 0.0), control(0.5, 0.2)):
        moved = [(b - a) / DT for a, b in zip(before[:3], at[:3], strict=True)]
        assert moved == pytest.approx(velocity, abs=1e-9)
        before = at


def test_where_no_ground_is_known_a_vehicle_goes_on_at_its_height() -> None:
    high: Pose = (0.0, 0.0, 7.0, 0.0, 0.0, 0.0)
    seen = driven_for(10, high, (10.0, 0.0, 0.0), control(), lambda *_: None)
    assert seen[-1][0][2] == 7.0
    assert seen[-1][0][0] > 4.5
