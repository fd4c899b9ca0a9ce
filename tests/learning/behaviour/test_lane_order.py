"""Leaders and followers of vehicles on lanes, worked out by hand."""

from __future__ import annotations

import numpy as np

from odscen.learning.behaviour.lane_order import LaneOrder

LANES = np.array([100.0, 10.0, 50.0])
"""Lengths: 0 leads over 1, inside a junction, to 2."""
LANE = np.array([0, 0, 2, -1, 0], dtype=np.int32)
POS = np.array([20.0, 60.0, 8.0, 0.0, 60.0])
LENGTH = np.array([5.0, 4.0, 6.0, 5.0, 4.0])
AHEAD = np.array([[1, 2], [1, 2], [-1, -1], [-1, -1], [-1, -1]], dtype=np.int32)


def test_the_leader_is_the_next_front_on_the_lane_or_on_those_ahead() -> None:
    row, gap = LaneOrder(LANE, POS, LENGTH).leaders(AHEAD, LANES)
    # 4 is beside 1 and comes after it; it does not know where it goes.
    np.testing.assert_array_equal(row, [1, 4, -1, -1, -1])
    np.testing.assert_allclose(gap, [60.0 - 4.0 - 20.0, -4.0, np.inf, np.inf, np.inf])
    alone = LaneOrder(LANE[:3], POS[:3], LENGTH[:3])
    row, gap = alone.leaders(AHEAD[:3], LANES)
    np.testing.assert_array_equal(row, [1, 2, -1])
    np.testing.assert_allclose(gap[:2], [36.0, 40.0 + 10.0 + 8.0 - 6.0])


def test_who_would_be_ahead_and_behind_on_another_lane() -> None:
    order = LaneOrder(LANE, POS, LENGTH)
    lane, pos, length = np.array([0, 2, 1, -1]), np.array([40.0, 8.0, 5.0, 5.0]), np.full(4, 5.0)
    row, gap = order.ahead(lane, pos)
    np.testing.assert_array_equal(row, [1, 2, -1, -1])
    np.testing.assert_allclose(gap, [16.0, -6.0, np.inf, np.inf])
    row, gap = order.behind(lane, pos, length)
    np.testing.assert_array_equal(row, [0, -1, -1, -1])
    np.testing.assert_allclose(gap, [15.0, np.inf, np.inf, np.inf])


def test_an_empty_road_has_nobody() -> None:
    none = np.zeros(0)
    order = LaneOrder(none.astype(np.int32), none, none)
    assert order.ahead(np.array([0]), np.array([1.0]))[0].tolist() == [-1]
    assert order.behind(np.array([0]), np.array([1.0]), np.array([4.0]))[0].tolist() == [-1]
