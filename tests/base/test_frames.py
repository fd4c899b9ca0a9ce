import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.frames import (
    CarlaPose,
    SumoPose,
    XodrPose,
    angle_deg_from_hdg,
    body_centre,
    carla_to_xodr,
    hdg_from_angle_deg,
    sumo_to_xodr,
    xodr_to_carla,
    xodr_to_sumo,
)

coordinate = st.floats(-1e5, 1e5)
poses = st.builds(
    XodrPose, coordinate, coordinate, coordinate, st.floats(-3.14, 3.14), st.floats(-0.6, 0.6)
)


@given(poses, st.floats(0.3, 20.0), st.tuples(coordinate, coordinate))
def test_sumo_and_back_is_the_same_pose_on_slopes_too(pose, length, net_offset):
    there = xodr_to_sumo(pose, length=length, net_offset=net_offset)
    back = sumo_to_xodr(there, length=length, net_offset=net_offset)
    np.testing.assert_allclose(np.array(back, float), np.array(pose, float), atol=1e-8)


@given(poses)
def test_carla_and_back_is_the_same_pose(pose):
    back = carla_to_xodr(xodr_to_carla(pose))
    np.testing.assert_allclose(np.array(back, float), np.array(pose, float), atol=1e-9)


@given(st.floats(-10, 10))
def test_headings_round_trip_modulo_a_turn(hdg):
    back = float(hdg_from_angle_deg(angle_deg_from_hdg(hdg)))
    assert math.isclose(math.cos(back), math.cos(hdg), abs_tol=1e-9)
    assert math.isclose(math.sin(back), math.sin(hdg), abs_tol=1e-9)


@pytest.mark.parametrize(
    ("hdg", "angle_deg"), [(0.0, 90.0), (math.pi / 2, 0.0), (math.pi, 270.0), (-math.pi / 2, 180.0)]
)
def test_sumo_angles_count_clockwise_from_north(hdg, angle_deg):
    assert angle_deg_from_hdg(hdg) == pytest.approx(angle_deg)


def test_the_bumper_of_a_four_metre_car_heading_east_is_two_metres_east_of_its_centre():
    pose = xodr_to_sumo(XodrPose(10.0, 5.0, 1.0, 0.0), length=4.0, net_offset=(100.0, 200.0))
    np.testing.assert_allclose(pose, SumoPose(112.0, 205.0, 1.0, 90.0, 0.0))


@given(poses, st.floats(0.3, 20.0), st.tuples(coordinate, coordinate))
def test_one_body_has_its_centre_where_whole_columns_have(pose, length, net_offset):
    front = xodr_to_sumo(pose._replace(pitch=0.0), length=length, net_offset=net_offset)
    x, y = body_centre(front.x, front.y, front.angle_deg, length=length, net_offset=net_offset)
    assert (x, y) == pytest.approx((pose.x, pose.y), abs=1e-6)


def test_carla_turns_north_into_minus_y():
    pose = xodr_to_carla(XodrPose(1.0, 2.0, 3.0, math.pi / 2, 0.1))
    np.testing.assert_allclose(pose, CarlaPose(1.0, -2.0, 3.0, -90.0, math.degrees(0.1)))


def test_whole_trajectories_convert_in_one_call():
    x = np.linspace(0, 1, 5)
    pose = xodr_to_sumo(XodrPose(x, x, x, x, np.zeros(5)), length=np.full(5, 4.0))
    assert np.shape(pose.x) == (5,)
