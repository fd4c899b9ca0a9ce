"""The intelligent driver: its equilibrium, lights, and lane changes that pay and are safe."""

from __future__ import annotations

import numpy as np
import pytest

from odscen.learning.behaviour.behaviour_model import LightAhead
from odscen.learning.behaviour.intelligent_driver import IntelligentDriver
from tests.learning.behaviour.road import scene, seen


def drive(model: IntelligentDriver, lane: list[int], pos: list[float], speed: list[float], **more):
    road = scene(len(lane), **more.pop("scene", {}))
    state = model.init(np.random.default_rng(0), road)
    action, controlled = model.act(seen(road, lane, pos, speed, **more), state)
    assert controlled.all()
    return action


def test_at_the_equilibrium_gap_of_its_paper_it_keeps_its_speed() -> None:
    model, speed = IntelligentDriver(changes_lanes=False), 10.0
    gap = (model.gap + speed * model.headway) / np.sqrt(1.0 - (speed / 20.0) ** 4)
    action = drive(model, [0, 0], [100.0, 105.0 + gap], [speed, speed])
    assert action.speed[0] == pytest.approx(speed)
    assert drive(model, [0, 0], [100.0, 104.0 + gap], [10.0, 10.0]).speed[0] < speed
    assert action.change is None


def test_alone_it_comes_to_the_limit_times_its_factor_or_to_its_own_speed() -> None:
    road = scene(2, speed_factor=np.array([1.1, 1.0]), desired_speed=np.array([np.nan, 12.0]))
    model = IntelligentDriver()
    state = model.init(np.random.default_rng(0), road)
    speed = [0.0, 0.0]
    for _ in range(400):
        action, _ = model.act(seen(road, [0, 1], [100.0, 100.0], speed), state)
        speed = action.speed.tolist()
    assert speed == pytest.approx([22.0, 12.0], abs=0.05)


def test_it_stops_at_a_red_light_with_its_front_before_the_line() -> None:
    road, model = scene(1, step_length=0.1), IntelligentDriver()
    state = model.init(np.random.default_rng(0), road)
    pos, speed, hardest = 1850.0, 14.0, 0.0
    for _ in range(600):
        light = np.array([LightAhead.RED], dtype=np.int32)
        action, _ = model.act(seen(road, [0], [pos], [speed], light=light), state)
        new = float(action.speed[0])
        hardest = max(hardest, (speed - new) / 0.1)
        pos, speed = pos + 0.05 * (speed + new), new
    assert speed < 0.1  # the model creeps up to where it stands
    assert 1997.0 < pos < 2000.0
    assert hardest < 3.0


def test_it_overtakes_where_that_pays_and_nobody_behind_has_to_brake_hard() -> None:
    model = IntelligentDriver()
    slow = drive(model, [0, 0], [100.0, 130.0], [15.0, 8.0])
    assert slow.change[0] == 1
    # Somebody fast is close behind on the lane beside.
    unsafe = drive(model, [0, 0, 1], [100.0, 130.0, 88.0], [15.0, 8.0, 20.0])
    assert unsafe.change[0] == 0
    beside = drive(model, [0, 0, 1], [100.0, 130.0, 97.0], [15.0, 8.0, 15.0])
    assert beside.change[0] == 0
    closed = drive(model, [0, 0], [100.0, 130.0], [15.0, 8.0], can_left=np.zeros(2, dtype=bool))
    assert closed.change[0] == 0


def test_drivers_differ_by_the_seed_alone() -> None:
    model, road = IntelligentDriver(spread=0.1), scene(50)
    one, other = (model.init(np.random.default_rng(seed), road).desire for seed in (1, 2))
    np.testing.assert_array_equal(one, model.init(np.random.default_rng(1), road).desire)
    assert not np.array_equal(one, other)
    assert 0.05 < one.std() < 0.15
