from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from odscen.base.categories import Category
from odscen.scenario.document.rules_document import StoryRule
from odscen.scenario.document.scenario_document import (
    Actor,
    Flow,
    MapReference,
    Scenario,
    Simulation,
)
from odscen.scenario.placing.region import Region
from odscen.sumo.realize.realization import realize
from odscen.sumo.realize.road_users import planned_positions as planning
from odscen.sumo.realize.road_users.planned_positions import PlannedPositions, planned_positions
from tests.graphs import SHA256
from tests.sumo.toys import sumo_map


def scenario(*actors: Actor, **changes: Any) -> Scenario:
    values: dict[str, Any] = {
        "name": "toy",
        "map": MapReference(name="toy", sha256=SHA256),
        "seed": 5,
        "roi": ("r1", "j9", "r3"),
        "actors": actors,
        "simulation": Simulation(duration=100.0),
    }
    return Scenario(**{**values, **changes})


def planned(one: Scenario) -> PlannedPositions:
    toy = sumo_map()
    return planned_positions(one, toy, Region.of(toy.graph, one.roi))


def at(found: PlannedPositions, name: str, time: float) -> tuple[float, float]:
    """Where a road user is at a time."""
    row = [user.id for user in found.users].index(name)
    rows = slice(found.first[row], found.first[row + 1])
    times = found.time[rows]
    return (
        float(np.interp(time, times, found.x[rows])),
        float(np.interp(time, times, found.y[rows])),
    )


CAR = Actor(
    id="car", category=Category.CAR, spawn="1.0.-2.5", goal="3.0.-2.49", speed=10.0, depart=4.0
)
WALKER = Actor(
    id="w", category=Category.PEDESTRIAN, spawn="ped.1.0.-3.5", goal="ped.3.0.-3.40", speed=2.0
)


def test_a_car_gets_up_to_its_speed_and_keeps_it() -> None:
    found = planned(scenario(CAR))
    start, accel = at(found, "car", 4.0)[0], 2.6
    assert start == pytest.approx(11.0)
    assert at(found, "car", 0.0) == at(found, "car", 4.0)
    # s = a t^2 / 2 while it speeds up, to the nodes of the lane graph
    assert at(found, "car", 6.0)[0] - start == pytest.approx(accel * 2.0**2 / 2, abs=0.2)
    # s = v (t - v / (2 a)) once it has its speed
    for seconds in (8.0, 12.5, 16.0):
        gone = 10.0 * (seconds - 10.0 / (2 * accel))
        assert at(found, "car", 4.0 + seconds)[0] - start == pytest.approx(gone, abs=0.05)


def test_a_pedestrian_goes_at_its_speed_and_keeps_its_offset() -> None:
    found = planned(scenario(WALKER.model_copy(update={"lateral_offset": 0.5})))
    start = at(found, "w", 0.0)
    x, y = at(found, "w", 15.0)
    assert (x - start[0], y) == (pytest.approx(30.0, abs=0.05), pytest.approx(-7.5))


def test_the_last_time_is_the_free_flow_time_of_the_run() -> None:
    bus = Actor(id="bus", category=Category.BUS, spawn="1.0.-1.10", goal="3.0.-1.49")
    one = scenario(CAR, bus, WALKER)
    found = planned(one)
    plan = {actor.id: actor for actor in realize(one, sumo_map()).plan.actors}
    ends = found.time[found.first[1:] - 1]
    for user, end in zip(found.users, ends.tolist(), strict=True):
        assert end - user.depart == pytest.approx(plan[user.id].free_flow_time, rel=1e-9)
    assert all(np.all(np.diff(part) > 0) for part in np.split(found.time, found.first[1:-1]))


def test_members_of_a_flow_are_planned_as_they_are_drawn_for_a_run() -> None:
    flow = Flow(id="f", spawn="1.0.-1.5", goal="3.0.-1.49", per_hour=600, begin=20, end=80)
    one = scenario(flows=(flow,))
    found = planned(one)
    plan = realize(one, sumo_map()).plan.actors
    assert len(plan) > 5
    assert [(user.id, user.depart) for user in found.users] == [(a.id, a.depart) for a in plan]
    assert {user.flow for user in found.users} == {"f"}


def test_who_cannot_be_planned_is_named_and_the_others_are_planned() -> None:
    lost = CAR.model_copy(update={"id": "lost", "goal": "1.0.-2.1", "spawn": "3.0.-2.5"})
    away = CAR.model_copy(update={"id": "away", "spawn": "8.0.-2.5"})
    later = CAR.model_copy(update={"id": "later", "spawn": "1.0.-1.5"})
    rule = StoryRule.model_validate(
        {
            "id": "comes",
            "actor": "later",
            "when": {"time": {"after": 5}},
            "then": [{"appear": {}}],
        }
    )
    found = planned(scenario(CAR, lost, away, later, rules=(rule,)))
    assert [user.id for user in found.users] == ["car"]
    assert found.left_out == ("lost", "away", "later")


def test_of_too_many_those_who_depart_last_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(planning, "MOST_PLANNED", 1)
    found = planned(scenario(CAR, WALKER))
    assert ([user.id for user in found.users], found.not_planned) == (["w"], 1)


def test_routes_that_are_searched_together_are_as_long_as_those_of_a_run(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cars = [CAR.model_copy(update={"id": f"c{n}", "spawn": f"1.0.-2.{5 * n}"}) for n in range(6)]
    walkers = [
        WALKER.model_copy(update={"id": f"w{n}", "spawn": f"ped.1.0.-3.{4 * n}"}) for n in range(6)
    ]
    one = scenario(*cars, *walkers)
    alone = planned(one)
    monkeypatch.setattr(planning, "GROUPED_FROM", 2)
    together = planned(one)
    assert [user.id for user in together.users] == [user.id for user in alone.users]
    ends = alone.first[1:] - 1, together.first[1:] - 1
    assert together.time[ends[1]].tolist() == pytest.approx(alone.time[ends[0]].tolist())
    assert [replace(user, trip=False) for user in together.users] == list(alone.users)


def test_a_region_without_anybody_has_no_rows() -> None:
    found = planned(scenario())
    assert (found.users, found.first.tolist(), len(found.time)) == ((), [0], 0)
