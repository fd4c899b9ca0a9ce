"""Wheels near the ego turn as their vehicles go, within a budget of calls."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest

from odscen.carla.mirror.cosim import cosim
from odscen.carla.mirror.cosim_options import CosimOptions
from odscen.carla.mirror.wheels import NEAR, RADIUS, WHEELBASE_SHARE, Wheels
from odscen.carla.server.batch import WHEEL_CALLS
from odscen.carla.server.client import Address
from odscen.maps.store import Workspace
from odscen.records.run_plan import Plan, PlannedActor
from odscen.runs.run_settings import RunSettings
from odscen.sumo.runner.in_step import Step
from tests.carla.conftest import MAPS, scenario_of
from tests.carla_standin.process import StandIn

LENGTH = 4.5
WEAVE = MAPS / "motorway_weave.xodr"


def plan_of(count: int, category: str = "car") -> Plan:
    """The first is the ego."""
    actors = tuple(
        PlannedActor(
            f"a{row}", category if row else "car", "", None, 0.0, LENGTH, 1.8,
            0.0, 0.0, 0.0, 0.0, ego=not row,
        )
        for row in range(count)
    )  # fmt: skip
    return Plan("test", 0, 60.0, 1.0, (0.0, 0.0), actors)


def step_of(places: list[tuple[float, float, float]]) -> Step:
    """Of all rows: x, y, heading."""
    x, y, hdg = (np.array(column, dtype=float) for column in zip(*places, strict=True))
    count = len(places)
    return Step(
        0.0, np.arange(count), np.arange(count).astype(np.str_), x, y, np.zeros(count), hdg,
        np.zeros(count), np.zeros(count), np.zeros(count, dtype=int),
    )  # fmt: skip


def test_wheels_roll_by_the_way_of_their_vehicle() -> None:
    wheels = Wheels(plan_of(1), calls=24)
    for k in range(11):
        [turn] = wheels.turned(step_of([(0.1 * k, 0.0, 0.0)]), {0: 7}).values()
    assert turn.pitch == pytest.approx(-math.degrees(1.0 / RADIUS["car"]))
    assert turn.steer == 0.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_front_wheels_stand_as_the_circle_takes(side: float) -> None:
    """A circle of 20 m: to the left in OpenDRIVE's frame is negative steering in CARLA."""
    wheels, radius = Wheels(plan_of(1), calls=24), 20.0
    for k in range(5):
        turned = 0.02 * k * side
        at = (radius * math.sin(abs(turned)), side * radius * (1 - math.cos(turned)), turned)
        turn = wheels.turned(step_of([at]), {0: 7})[7]
    wanted = -side * math.degrees(math.atan(WHEELBASE_SHARE * LENGTH / radius))
    assert turn.steer == pytest.approx(wanted, abs=0.05)


def test_the_nearest_come_first_and_no_more_than_the_budget() -> None:
    plan = plan_of(8)
    places = [(10.0 * k, 0.0, 0.0) for k in range(8)]
    actors = {row: 100 + row for row in range(8)}
    wheels = Wheels(plan, calls=3 * WHEEL_CALLS + 5)
    assert list(wheels.turned(step_of(places), actors)) == [100, 101, 102]
    assert list(Wheels(plan, calls=999).turned(step_of(places), actors)) == [
        100 + k for k in range(8) if 10.0 * k <= NEAR
    ]
    assert not Wheels(plan, calls=0).turned(step_of(places), actors)


def test_who_is_not_made_yet_or_has_two_wheels_is_left_out() -> None:
    step = step_of([(0.0, 0.0, 0.0), (5.0, 0.0, 0.0)])
    assert list(Wheels(plan_of(2), calls=24).turned(step, {1: 9})) == [9]
    assert list(Wheels(plan_of(2, "bicycle"), calls=24).turned(step, {0: 8, 1: 9})) == [8]


def test_a_jump_and_a_stop_leave_wheels_as_they_were() -> None:
    wheels = Wheels(plan_of(1), calls=24)
    wheels.turned(step_of([(0.0, 0.0, 0.0)]), {0: 7})
    rolled = wheels.turned(step_of([(1.0, 0.0, 0.02)]), {0: 7})
    assert wheels.turned(step_of([(1.0, 0.0, 0.02)]), {0: 7}) == rolled
    assert wheels.turned(step_of([(90.0, 0.0, 0.02)]), {0: 7}) == rolled


@pytest.mark.slow
def test_on_a_server_wheels_have_rolled_as_far_as_their_vehicles_have_gone(
    workspace: Workspace, tmp_path: Path
) -> None:
    pytest.importorskip("carla", reason="co-simulation needs the package carla")
    actors = [
        {"id": "a", "category": "car", "depart": 0.0, "goal": "4.1.-1.200", "spawn": "2.1.-1.40",
         "ego": True},
        {"id": "b", "category": "car", "depart": 0.0, "goal": "4.1.-1.200", "spawn": "2.1.-2.42"},
    ]  # fmt: skip
    path = scenario_of(workspace, WEAVE, actors, tmp_path)
    seen: list[dict[int, tuple[list[float], float]]] = []
    with StandIn(WEAVE, map_name=WEAVE.stem) as server:
        _, report = cosim(
            workspace,
            path,
            CosimOptions(
                Address(server.host, server.port),
                wheel_calls=2 * WHEEL_CALLS,
                on_step=lambda _: not seen.append(_cars(server)),  # type: ignore[func-returns-value]
            ),
            settings=RunSettings(until=3.0, step_length=0.5),
            out=tmp_path,
        )
        calls = server.calls()
    assert report.error is None
    assert calls["set_wheel_pitch_angle"] <= 2 * 4 * report.ticks
    for car in seen[-1]:
        pairs = [(a[car], b[car]) for a, b in itertools.pairwise(seen) if car in a]
        ways = [math.dist(before[0], now[0]) for before, now in pairs]
        rolled = [math.radians(before[1] - now[1]) for before, now in pairs]
        off = [
            math.remainder(way / RADIUS["car"] - angle, 2 * math.pi)
            for way, angle in zip(ways, rolled, strict=True)
        ]
        # The first way begins with the tick that makes the car.
        assert max(map(abs, off[1:])) < 0.05
        assert max(ways) > 1.0


def _cars(server: StandIn) -> dict[int, tuple[list[float], float]]:
    """Place and pitch of the wheels of each car."""
    return {
        one["id"]: (one["transform"][0], next(iter(one["wheels"].values()), [0.0, 0.0])[1])
        for one in server.actors()
        if one["type_id"].startswith("vehicle.")
    }
