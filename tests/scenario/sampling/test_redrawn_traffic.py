import statistics
from collections import Counter

import pytest

from odscen.scenario.document.scenario_document import Actor, MapReference, Scenario
from odscen.scenario.sampling.sampler import redrawn


def placed(count=200, **fields):
    styles = ("cautious", "normal", "normal", "sporty")
    actors = [
        Actor(id=f"car-{n}", category="car", spawn="a", goal="b", style=styles[n % 4], **fields)
        for n in range(count)
    ]
    ego = Actor(id="me", category="car", spawn="a", goal="b", speed=9.0, depart=4.0, ego=True)
    reference = MapReference(name="m", sha256="0" * 64)
    return Scenario(name="s", map=reference, seed=3, roi=("r",), actors=(*actors, ego))


def test_open_changes_nothing():
    scenario = placed(speed=10.0)
    assert redrawn(scenario, "open") is scenario


def test_drivers_keep_their_speed_on_average_and_the_shares_of_their_styles():
    before = placed(speed=10.0, depart=20.0)
    after = redrawn(before, "drivers")
    speeds = [one.speed for one in after.actors if not one.ego]
    assert statistics.mean(speeds) == pytest.approx(10.0, abs=0.2)
    assert statistics.stdev(speeds) == pytest.approx(0.8, abs=0.15)
    assert 8.0 <= min(speeds) <= max(speeds) <= 12.0
    departs = [one.depart for one in after.actors if not one.ego]
    assert 20.0 <= min(departs) < 23.0 < 47.0 < max(departs) <= 50.0
    assert Counter(one.style for one in after.actors) == Counter(one.style for one in before.actors)
    assert [one.style for one in after.actors] != [one.style for one in before.actors]
    assert {one.goal for one in after.actors} == {"b"}


def test_whoever_is_there_from_the_start_and_the_ego_stay_as_they_are():
    before = placed(speed=10.0)
    after = redrawn(before, "traffic")
    assert {one.depart for one in after.actors if not one.ego} == {0.0}
    assert after.actors[-1] == before.actors[-1]


def test_traffic_leaves_goals_to_the_seed():
    assert {one.goal for one in redrawn(placed(), "traffic").actors if not one.ego} == {None}


def test_an_actor_without_a_speed_of_its_own_gets_none():
    assert {one.speed for one in redrawn(placed(), "drivers").actors if not one.ego} == {None}


def test_the_seed_decides_and_other_actors_do_not():
    scenario = placed(speed=10.0)
    assert redrawn(scenario, "drivers") == redrawn(scenario, "drivers")
    other = redrawn(scenario.model_copy(update={"seed": 4}), "drivers")
    assert other.actors != redrawn(scenario, "drivers").actors
    fewer = scenario.model_copy(update={"actors": scenario.actors[:5]})
    speeds = [one.speed for one in redrawn(fewer, "drivers").actors]
    assert speeds == [one.speed for one in redrawn(scenario, "drivers").actors[:5]]


@pytest.mark.parametrize(("speed", "low", "high"), [(55.0, 44.0, 55.6), (70.0, 56.0, 70.0)])
def test_speeds_stay_plausible_unless_the_scenario_wants_them_otherwise(speed, low, high):
    speeds = [one.speed for one in redrawn(placed(speed=speed), "drivers").actors[:-1]]
    assert low <= min(speeds) < speed
    assert max(speeds) == high
