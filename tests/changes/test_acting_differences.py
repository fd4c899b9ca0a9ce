"""Two scenarios by what acts: what counts as the same, and what does not."""

from __future__ import annotations

from typing import Any

import pytest

from odscen.changes.acting_differences import acting_differences
from odscen.scenario.document.scenario_document import Scenario

SPEED = {"speed": {"to": 4.0, "rate": 2.0}}
BEFORE: dict[str, Any] = {
    "name": "one",
    "map": {"name": "town", "sha256": "0" * 64},
    "roi": ["s1", "s2"],
    "actors": [
        {"id": "van", "category": "van", "spawn": "5.0.-1.3"},
        {"id": "child", "category": "pedestrian", "spawn": "ped.5.0.-2.9"},
    ],
    "rules": [
        {"id": "slow", "actor": "van", "when": {"time": {"after": 3.0}}, "then": [SPEED]},
        {"id": "on", "actor": "van", "when": {"rule": {"id": "slow"}}, "then": [{"go": {}}]},
    ],
}


def places(before: dict[str, Any], after: dict[str, Any]) -> list[tuple[str, ...]]:
    old, new = (Scenario.model_validate(BEFORE | one) for one in (before, after))
    return [one.place for one in acting_differences(old, new)]


def when(condition: dict[str, Any], **parts: Any) -> dict[str, Any]:
    rule = {"id": "r", "actor": "van", "when": condition, "then": [SPEED]} | parts
    return {"rules": [rule]}


def test_order_and_the_name_of_the_scenario_do_not_count() -> None:
    turned = {key: BEFORE[key][::-1] for key in ("roi", "actors", "rules")}
    assert places({}, turned | {"name": "other"}) == []


def test_the_name_of_a_rule_does_not_count_nor_do_those_that_refer_to_it() -> None:
    slow, on = BEFORE["rules"]
    renamed = [slow | {"id": "a"}, on | {"id": "b", "when": {"rule": {"id": "a"}}}]
    assert places({}, {"rules": renamed}) == []


def test_a_rule_that_waits_for_another_one_is_another_rule() -> None:
    slow, on = BEFORE["rules"]
    waits = [slow, on | {"when": {"rule": {"id": "slow", "has": "started"}}}]
    assert places({}, {"rules": waits}) == [("rules", "on", "when")]


TTC = {"ttc": {"to": "child", "below": 2.0}}
FAST = {"speed": {"above": 3.0}}


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (TTC, {"ttc": {"of": "van", "to": "child", "below": 2.0}}),
        (TTC, {"ttc": {"to": "child", "below": 2.00001}}),
        ({"all": [TTC, FAST]}, {"all": [FAST, {"all": [TTC]}]}),
        ({"all": [TTC, {"any": [FAST, TTC]}]}, {"any": [{"all": [TTC, FAST]}, TTC]}),
        ({"not": {"all": [TTC, FAST]}}, {"any": [{"not": TTC}, {"not": FAST}]}),
        ({"not": FAST}, {"speed": {"below": 3.0}}),
        ({"all": [{"time": {"after": 0.0}}, TTC]}, TTC),
        ({"all": [TTC, FAST], "delay": 2.0}, {"all": [TTC | {"delay": 2.0}, FAST | {"delay": 2}]}),
    ],
)
def test_conditions_that_hold_at_the_same_times_are_the_same(before: Any, after: Any) -> None:
    assert places(when(before), when(after)) == []


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (TTC, {"ttc": {"to": "child", "below": 2.1}}),
        (TTC, TTC | {"delay": 0.5}),
        (TTC, TTC | {"edge": "rising"}),
        ({"all": [TTC, FAST]}, {"any": [TTC, FAST]}),
        ({"all": [TTC, FAST], "edge": "rising"}, {"all": [TTC, FAST]}),
    ],
)
def test_conditions_that_hold_at_other_times_differ(before: Any, after: Any) -> None:
    assert places(when(before), when(after)) == [("rules", "r", "when")]


def test_a_stop_is_a_speed_of_zero_but_a_pedestrian_stays() -> None:
    def stop(actor: str, then: dict[str, Any]) -> dict[str, Any]:
        return when({"time": {"after": 1.0}}, actor=actor, then=[then])

    zero = {"speed": {"to": 0.0, "shape": "step"}}
    assert places(stop("van", {"stop": {}}), stop("van", zero)) == []
    brake = {"speed": {"to": 0.0, "rate": 6.0}}
    assert places(stop("van", {"brake": {"by": 6.0}}), stop("van", brake)) == []
    held = stop("van", {"brake": {"by": 6.0, "hold": 2.0}})
    assert ("rules", "r", "then", "0", "brake") in places(held, stop("van", brake))
    assert places(stop("child", {"stop": {}}), stop("child", zero)) != []


def test_what_acts_is_told_with_its_place() -> None:
    van, child = BEFORE["actors"]
    assert places({}, {"actors": [van | {"speed": 8.0}, child], "seed": 4}) == [
        ("seed",),
        ("actors", "van", "speed"),
    ]
    slow, on = BEFORE["rules"]
    faster = slow | {"then": [{"speed": {"to": 5.0, "rate": 2.0}}]}
    assert places({}, {"rules": [faster, on]}) == [("rules", "slow", "then", "0", "speed", "to")]


def test_who_appears_at_the_place_where_it_is_placed_appears_there() -> None:
    at = {"appear": {"at": [3.0, -1.75, 0.0], "speed": 0.0}}
    old, new = (
        Scenario.model_validate(BEFORE | when({"time": {"after": 0.0}}, then=[then]))
        for then in (at, {"appear": {}})
    )
    assert len(acting_differences(old, new)) == 1
    assert acting_differences(old, new, placed={"van": (3.0, -1.75, 0.0)}) == ()
