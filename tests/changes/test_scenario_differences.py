"""Two scenario documents, field by field."""

from __future__ import annotations

from odscen.changes.scenario_differences import scenario_differences
from odscen.scenario.document.scenario_document import (
    Actor,
    Demand,
    Flow,
    MapReference,
    Profile,
    Scenario,
    Simulation,
)

BEFORE = Scenario(
    name="crossing",
    map=MapReference(name="town", sha256="0" * 64),
    roi=("s1", "s2"),
    actors=(
        Actor(id="van-1", category="van", spawn="5.0.-1.3", goal="7.0.-1.9"),
        Actor(id="bus-1", category="bus", spawn="5.0.-1.9"),
    ),
    flows=(Flow(id="north", spawn="1.0.-1.0", per_hour=400.0),),
    demand=Demand(profiles=(Profile(id="day", shares=(1.0, 2.0)),)),
)


def words(after: Scenario) -> list[str]:
    return [one.words for one in scenario_differences(BEFORE, after)]


def test_the_same_scenario_has_no_difference() -> None:
    assert words(BEFORE.model_copy(deep=True)) == []


def test_fields_of_an_actor_are_told_with_its_id() -> None:
    van, bus = BEFORE.actors
    after = van.model_copy(update={"goal": "9.0.1.4", "speed": 8.5})
    assert words(BEFORE.model_copy(update={"actors": (after, bus)})) == [
        'actor van-1, goal: "7.0.-1.9" -> "9.0.1.4"',
        "actor van-1, speed: null -> 8.5",
    ]


def test_actors_that_came_and_went_are_told_by_id() -> None:
    van, _ = BEFORE.actors
    new = Actor(id="car-1", category="car", spawn="5.0.-1.0")
    assert words(BEFORE.model_copy(update={"actors": (van, new)})) == [
        "actor bus-1: removed",
        "actor car-1: added",
    ]


def test_another_order_of_actors_is_told_as_that() -> None:
    after = BEFORE.model_copy(update={"actors": BEFORE.actors[::-1]})
    assert words(after) == ["actor order: as it was -> another"]


def test_settings_and_nested_parts_are_told_by_their_path() -> None:
    after = BEFORE.model_copy(
        update={
            "roi": ("s1", "s3"),
            "simulation": Simulation(step_length=0.4),
            "demand": Demand(profiles=(Profile(id="day", shares=(1.0, 3.0)),)),
        }
    )
    assert words(after) == [
        'roi: ["s1", "s2"] -> ["s1", "s3"]',
        "demand, profile day, shares: [1.0, 2.0] -> [1.0, 3.0]",
        "simulation, step length: 0.5 -> 0.4",
    ]


def test_long_lists_are_told_by_how_many_values_are_new() -> None:
    old = BEFORE.model_copy(update={"roi": tuple(f"segment-{k}" for k in range(40))})
    new = BEFORE.model_copy(update={"roi": tuple(f"segment-{k}" for k in range(2, 41))})
    (found,) = scenario_differences(old, new)
    assert found.words == "roi: 40 values, of them 2 only here -> 39 values, of them 1 only here"
