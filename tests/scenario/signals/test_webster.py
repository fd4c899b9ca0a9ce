"""Cycle and splits by Webster, against values calculated by hand."""

from __future__ import annotations

import math

import pytest

from odscen.scenario.signals.webster import (
    GapGreen,
    LaneNeed,
    StageNeed,
    critical_ratios,
    left_turn_equivalent,
    webster,
    whole_seconds,
)

TWO = (StageNeed(8.0), StageNeed(8.0))


def test_two_stages_get_the_cycle_and_greens_of_the_textbook() -> None:
    # 900 and 600 vehicles an hour on lanes of 2,000; two intergreens of 6 s. L = 12, Y = 0.75:
    # C = (1.5 * 12 + 5) / 0.25 = 92 s, of which 80 s are green, 3 : 2.
    lanes = [LaneNeed(900 / 2000, (0,)), LaneNeed(600 / 2000, (1,)), LaneNeed(0.1, (1,))]
    splits = webster(TWO, lanes, between=12.0)
    assert splits.wanted == pytest.approx(92.0)
    assert splits.cycle == 92.0
    assert splits.greens == (48.0, 32.0)
    assert splits.lost == 12.0
    assert splits.flow_ratio == pytest.approx(0.75)


def test_the_cycle_keeps_to_its_bounds_and_demand_beyond_capacity_gets_the_longest() -> None:
    few = [LaneNeed(0.05, (0,)), LaneNeed(0.05, (1,))]
    assert webster(TWO, few, between=12.0).cycle == 40.0
    assert webster(TWO, few, between=12.0, bounds=(60.0, 90.0)).cycle == 60.0
    many = [LaneNeed(0.7, (0,)), LaneNeed(0.5, (1,))]
    splits = webster(TWO, many, between=12.0)
    assert math.isinf(splits.wanted)
    assert splits.cycle == 120.0
    assert sum(splits.greens) == 108.0


def test_no_green_is_shorter_than_its_least_and_crossings_keep_theirs() -> None:
    stages = (StageNeed(8.0), StageNeed(12.0), StageNeed(7.0, fixed=True))
    lanes = [LaneNeed(0.55, (0,)), LaneNeed(0.05, (1,))]
    splits = webster(stages, lanes, between=20.0)
    # The green of the crossing is lost to vehicles: L = 27, C = 45.5 / 0.4 = 113.75.
    assert splits.lost == 27.0
    assert splits.cycle == 114.0
    assert splits.greens == (75.0, 12.0, 7.0)


def test_green_that_vehicles_keep_while_crossings_are_cleared_counts_for_the_stage() -> None:
    stages = (StageNeed(8.0, more=4.0), StageNeed(8.0))
    lanes = [LaneNeed(0.3, (0,)), LaneNeed(0.3, (1,))]
    splits = webster(stages, lanes, between=14.0, cycle=60.0)
    assert splits.lost == 10.0
    assert splits.greens == (21.0, 25.0)


def test_a_given_cycle_shorter_than_least_greens_is_made_as_long_as_they_need() -> None:
    splits = webster(TWO, [LaneNeed(0.1, (0,))], between=12.0, cycle=20.0)
    assert splits.cycle == 28.0
    assert splits.greens == (8.0, 8.0)


def test_what_a_lane_with_two_stages_lacks_is_divided_among_them() -> None:
    lanes = [LaneNeed(0.2, (0,)), LaneNeed(0.1, (1,)), LaneNeed(0.6, (0, 1))]
    assert critical_ratios(lanes, 2) == pytest.approx((0.4, 0.2))
    assert critical_ratios([LaneNeed(0.6, (0, 1))], 2) == pytest.approx((0.3, 0.3))
    assert critical_ratios([LaneNeed(0.6, ())], 2) == (0.0, 0.0)


def test_a_protected_permissive_turn_needs_what_gaps_do_not_carry() -> None:
    # 0.3 of the cycle are 0.45 with half as much spare; 0.2 go by with the oncoming queue, the rest
    # (0.25 of 0.8) has gaps for half the saturation flow: 0.156 of 0.25.
    turn = LaneNeed(0.25, (1,), (GapGreen(0, 0.5, 0.2),))
    found = critical_ratios([turn, LaneNeed(0.3, (0,))], 2, spare=1.5)
    assert found == pytest.approx((0.3, 0.09375))
    assert critical_ratios([LaneNeed(0.3, (0,)), turn], 2) == pytest.approx((0.3, 0.1875))
    few = turn._replace(ratio=0.05)
    assert critical_ratios([LaneNeed(0.3, (0,)), few], 2) == pytest.approx((0.3, 0.0))


def test_greens_of_a_protected_permissive_turn_carry_it() -> None:
    stages = (StageNeed(8.0), StageNeed(6.0), StageNeed(8.0))
    lanes = [
        LaneNeed(0.3, (0,)),
        LaneNeed(0.2, (2,)),
        LaneNeed(0.2, (1,), (GapGreen(0, 0.5, 0.3),)),
    ]
    splits = webster(stages, lanes, between=18.0)
    through, arrow, _ = (green / splits.cycle for green in splits.greens)
    carried = arrow + (through - 0.3) / 0.7 * 0.5
    assert through > 0.3
    assert 0.2 <= carried < 0.3, "half as much again at most: greens are in proportion"
    assert splits.ratios[1] < 0.2


def test_greens_are_whole_seconds_that_add_up() -> None:
    assert whole_seconds({0: 10.4, 1: 10.6, 2: 9.0}, 30.0) == (10.0, 11.0, 9.0)
    assert whole_seconds({0: 10.25, 1: 9.25}, 19.5) == (10.5, 9.0)


def test_left_turns_across_more_traffic_take_longer() -> None:
    # 600 an hour: 600 exp(-0.75) / (1 - exp(-0.41667)) = 831.7 an hour.
    assert left_turn_equivalent(600.0) == pytest.approx(1900.0 / 831.7, rel=1e-3)
    assert left_turn_equivalent(0.0) == pytest.approx(1900.0 / 1440.0)
    assert left_turn_equivalent(3000.0) == 8.0
