"""Speeds of recorded road users are those of their positions."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from odscen.figures.measures.motion import check_motion
from odscen.records.replay import body_centres, speeds_of_positions
from odscen.records.run_plan import Plan, PlannedActor

STEPS = pytest.mark.parametrize("step", [0.05, 0.1, 0.2, 0.5, 1.0])


def speeds(time, x, y, angle, speed, *, walking=False, row=0):
    columns = np.broadcast_arrays(time, row, x, y, angle, speed, walking)
    return speeds_of_positions(*(np.array(column) for column in columns))


@STEPS
def test_a_person_who_is_moved_has_the_speed_of_the_way(step):
    time = np.arange(round(6.0 / step)) * step
    found = speeds(time, 1.39 * time, 0.0, 90.0, 0.33, walking=True)
    assert found[1:] == pytest.approx(1.39)


@STEPS
def test_a_vehicle_that_moves_aside_has_the_speed_of_the_way_and_else_that_of_sumo(step):
    time = np.arange(round(12.0 / step)) * step
    y = np.clip(1.25 * (time - 4.0), 0.0, 3.75)
    found = speeds(time, 2.0 * time, y, 90.0, 2.0)
    aside = (time > 4.0 + 0.5 * step) & (time < 7.0 + 0.5 * step)
    assert found[aside] == pytest.approx(np.hypot(2.0, 1.25))
    assert found[~aside].tolist() == [2.0] * int((~aside).sum())


def test_beside_the_centre_of_a_curve_the_speed_is_that_of_the_arc():
    time = np.arange(40) * 0.5
    turned = 0.2 * time  # at 10 m/s on 50 m, 2 m further in
    x, y = 48.0 * np.sin(turned), 48.0 * (1.0 - np.cos(turned))
    found = speeds(time, x, y, 90.0 - np.degrees(turned), 10.0)
    assert found[1:] == pytest.approx(9.6, abs=1e-3)


def test_slips_where_lanes_meet_jumps_and_gaps_are_no_speeds():
    time = np.arange(100) * 0.1
    x = 10.0 * time + np.where(time > 3.0, 0.05, 0.0) + np.where(time > 6.0, 40.0, 0.0)
    assert speeds(time, x, 0.0, 90.0, 10.0).tolist() == [10.0] * 100
    gap = (time < 2.0) | (time > 4.0)
    found = speeds(time[gap], np.where(time < 2.0, time, 100.0 + time)[gap], 0.0, 90.0, 1.0)
    assert found.tolist() == [1.0] * int(gap.sum())


def test_road_users_are_told_apart():
    time = np.repeat(np.arange(10) * 0.5, 2)
    row = np.tile([0, 1], 10)
    found = speeds(time, np.where(row == 0, 3.0 * time, 0.0), 0.0, 0.0, 1.0, row=row)
    assert found[row == 0] == pytest.approx([1.0] + [3.0] * 9)
    assert found[row == 1] == pytest.approx([1.0] + [0.0] * 9)


def test_a_pedestrian_who_turns_on_the_spot_stands():
    """In SUMO the place is that of the front, which a turn moves by half a step."""
    plan = Plan(
        scenario="s", seed=0, net_offset=(0.0, 0.0), until=10.0, step_length=0.1,
        actors=(
            PlannedActor(
                id="p", category="pedestrian", spawn="n", goal=None, depart=0.0, length=0.3,
                width=0.5, x=0.0, y=0.0, z=0.0, hdg=0.0,
            ),
        ),
    )  # fmt: skip
    time = np.arange(20) * 0.1
    hdg = np.where(time < 1.0, 0.0, np.pi / 2.0)
    walked = np.maximum(time - 1.0, 0.0) * 1.4
    recorded = pl.DataFrame(
        {
            "time": time, "id": ["p"] * 20, "x": 0.15 * np.cos(hdg),
            "y": walked + 0.15 * np.sin(hdg), "angle": 90.0 - np.degrees(hdg), "speed": 0.0,
        }
    )  # fmt: skip
    found = body_centres(recorded, plan)
    assert found["speed"].to_numpy() == pytest.approx(np.where(time > 1.05, 1.4, 0.0), abs=1e-9)
    moved = check_motion(found, plan)
    assert moved is not None
    assert moved.filter(pl.col("kind") == "recorded speed").is_empty()
