"""Each kind of condition comes true at the instant that geometry says, whatever the step."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from odscen.scenario.document.rules_document import Condition
from odscen.scenario.story.condition_kinds import CONDITIONS
from tests.scenario.story.straight_road import CAR, rule, started, story

STEPS = (0.05, 0.1, 0.5)
EGO = replace(CAR, id="ego", x=-96.0, speed=18.0)
"""92 m of free road behind the car, 8 m/s faster."""
WALKER = replace(
    CAR, id="walker", x=50.0, y=-5.0, hdg=math.pi / 2, speed=1.0, length=0.4, width=0.6, person=True
)
BRAKES = replace(CAR, speed=12.0, acceleration=-3.0)

CASES: list[tuple[str, dict[str, Any], float]] = [
    ("time", {"time": {"after": 2.345}}, 2.345),
    ("ttc of who comes from behind", {"ttc": {"to": "ego", "below": 3.0}}, 92.0 / 8.0 - 3.0),
    ("ttc seen by the ego", {"ttc": {"of": "ego", "to": "car", "below": 3.0}}, 92.0 / 8.0 - 3.0),
    ("headway of the one behind", {"headway": {"to": "ego", "below": 2.0}}, (92.0 - 36.0) / 8.0),
    ("straight", {"distance": {"to": "ego", "below": 20.0}}, (92.0 - 20.0) / 8.0),
    (
        "straight between centres",
        {"distance": {"to": "ego", "below": 20.0, "free": False}},
        (96.0 - 20.0) / 8.0,
    ),
    (
        "longitudinal",
        {"distance": {"to": "ego", "below": 21.5, "along": "longitudinal"}},
        (92.0 - 21.5) / 8.0,
    ),
    (
        "lateral",
        {"distance": {"to": "walker", "below": 1.0, "along": "lateral"}},
        5.0 - 1.0 - 0.2 - 1.0,
    ),
    ("lane", {"distance": {"to": "ego", "of": "ego", "below": 1.0, "along": "lane"}}, 0.0),
    (
        "along the lane to a place",
        {"distance": {"place": [100.0, 0.0], "below": 33.0, "along": "lane"}},
        (100.0 - 2.0 - 33.0) / 10.0,
    ),
    ("from a place", {"distance": {"place": [-8.0, 0.0], "above": 33.0}}, (33.0 - 6.0) / 10.0),
    ("relative speed", {"relative_speed": {"of": "ego", "to": "brakes", "above": 10.0}}, 4.0 / 3),
    ("speed", {"speed": {"of": "brakes", "below": 5.0}}, 7.0 / 3.0),
    ("stopped", {"stopped": {"of": "brakes", "seconds": 1.25}}, 5.25),
    ("reaches", {"reaches": {"place": [61.0, 0.0], "within": 2.5}}, 5.85),
    ("travelled", {"travelled": {"above": 43.21}}, 4.321),
]


@pytest.mark.parametrize("step", STEPS)
@pytest.mark.parametrize(("name", "when", "instant"), CASES, ids=[case[0] for case in CASES])
def test_a_condition_comes_true_at_its_instant(
    name: str, when: dict[str, Any], instant: float, step: float
) -> None:
    brakes = replace(BRAKES, id="brakes", y=30.0)
    events = story([rule(when)], CAR, EGO, WALKER, brakes, step=step)
    [found] = started(events)
    assert found == pytest.approx(instant, abs=1e-9), name


@pytest.mark.parametrize("step", STEPS)
def test_seconds_that_leap_as_somebody_sets_off_are_not_drawn_out_beyond_the_bound(
    step: float,
) -> None:
    closes = replace(EGO, x=-64.0, speed=9.99, acceleration=2.0)
    [found] = started(story([rule({"ttc": {"to": "ego", "below": 3.0}})], CAR, closes, step=step))
    # gap 60 + 0.01 t - t², closing -0.01 + 2 t
    assert found == pytest.approx((-5.99 + math.sqrt(5.99**2 + 4 * 60.03)) / 2, abs=0.1 * step)
    stands, starts = replace(CAR, speed=0.0), replace(closes, speed=0.01)
    when = {"headway": {"to": "ego", "below": 2.0}}
    [found] = started(story([rule(when)], stands, starts, step=step))
    # gap 60 - 0.01 t - t², speed 0.01 + 2 t
    assert found == pytest.approx((-4.01 + math.sqrt(4.01**2 + 4 * 59.98)) / 2, abs=0.1 * step)


def test_who_stands_has_no_headway_that_could_be_above_a_bound() -> None:
    """As esmini has it: the rule waits until the one behind drives, and its headway is long."""
    stands = replace(EGO, x=-104.0, speed=0.0)
    when = {"headway": {"of": "ego", "to": "car", "above": 5.0}}
    assert started(story([rule(when)], CAR, stands)) == []
    starts = replace(stands, acceleration=2.0)
    [found] = started(story([rule(when)], CAR, starts, step=0.1))
    assert 0.0 < found <= 0.1


def test_with_ahead_there_is_no_headway_to_one_behind_and_without_free_it_is_of_centres() -> None:
    """The car at 10 m/s is overtaken at 20 m/s by one 24 m behind; bodies are 4 m long."""
    passes = replace(EGO, x=-24.0, speed=20.0, length=4.0)
    above = {"headway": {"of": "car", "to": "ego", "above": 1.0, "ahead": True, "free": False}}
    [found] = started(story([rule(above)], CAR, passes, until=6.0))
    assert found == pytest.approx((24.0 + 10.0) / 10.0, abs=1e-6)
    free = {"headway": {**above["headway"], "free": True}}
    [found] = started(story([rule(free)], CAR, passes, until=6.0))
    assert found == pytest.approx((24.0 + 4.0 + 10.0) / 10.0, abs=1e-6)
    [found] = started(
        story([rule({"headway": {"of": "car", "to": "ego", "above": 1.0}})], CAR, passes)
    )
    assert found == 0.0


@pytest.mark.parametrize(
    ("away", "speed", "brakes", "step"),
    [(8.0, 10.1, -8.0, 0.1), (20.0, 11.0, -4.5, 0.5), (12.0, 9.5, -2.0, 0.5)],
)
def test_seconds_of_a_rule_that_starts_within_a_step_are_those_of_its_bound(
    away: float, speed: float, brakes: float, step: float
) -> None:
    """The car brakes before one that follows: 40 s, then 6 s; a line through both leads below 0."""
    car, follows = replace(CAR, x=away, acceleration=brakes), replace(EGO, x=0.0, speed=speed)
    when = {"ttc": {"of": "ego", "to": "car", "below": 3.0}}
    found = next(one for one in story([rule(when)], car, follows, step=step) if one.values)
    assert found.values == {"ttc": pytest.approx(3.0)}


def test_with_ahead_who_has_been_passed_has_no_time_to_collision() -> None:
    """The ego, 20 m ahead, brakes to a halt; who comes from behind would meet it in 2 s."""
    halts = replace(EGO, x=30.0, speed=4.0, acceleration=-2.0)
    behind = {"of": "ego", "to": "car", "below": 3.0}
    assert len(started(story([rule({"ttc": behind})], CAR, halts))) == 1
    assert started(story([rule({"ttc": {**behind, "ahead": True}})], CAR, halts)) == []


def test_bodies_that_touch_and_stay_so_have_no_time_to_collision() -> None:
    beside = replace(CAR, id="ego", x=-4.0)
    assert started(story([rule({"ttc": {"to": "ego", "below": 3.0}})], CAR, beside)) == []
    assert started(story([rule({"ttc": {"to": "ego", "above": 3.0}})], CAR, beside)) == [0.0]


@pytest.mark.parametrize("step", STEPS)
def test_what_only_steps_can_show_comes_true_on_the_next_step(step: float) -> None:
    def within_a_step(when: dict[str, Any], instant: float, **road: Any) -> None:
        brakes = replace(BRAKES, id="brakes", acceleration=-3.0)
        [found] = started(story([rule(when)], CAR, EGO, WALKER, brakes, step=step, **road))
        assert instant - 1e-9 <= found < instant + step

    within_a_step({"acceleration": {"of": "brakes", "below": -2.9}}, 0.0)
    within_a_step({"appeared": {"of": "ego"}}, 3.21, appears={"ego": 3.21})
    within_a_step({"touched": {"of": "ego", "to": "car"}}, 92.0 / 8.0)
    within_a_step({"off_road": {"of": "walker"}}, 11.02)
    green = {"signal": {"light": "7", "movement": "r1>r2", "shows": "green"}}
    within_a_step(green, 4.56, letters=lambda time: "G" if time >= 4.56 else "y")


def test_a_body_that_any_other_touches_is_enough() -> None:
    [found] = started(story([rule({"touched": {}})], CAR, EGO))
    assert found == pytest.approx(11.5)


def test_a_rule_waits_for_the_instant_at_which_another_starts_or_ends() -> None:
    first = rule({"time": {"after": 1.23}}, "first", then=[{"speed": {"to": 12.0, "rate": 1.5}}])
    after = rule({"rule": {"id": "first", "has": "ended"}}, "after", actor="ego")
    beside = rule({"rule": {"id": "first", "has": "started"}}, "beside", actor="ego")
    events = story([after, beside, first], CAR, EGO)
    assert started(events, "beside") == [pytest.approx(1.23)]
    assert started(events, "after") == [pytest.approx(1.23 + 2.0 / 1.5)]


def test_conditions_combine_to_the_instant() -> None:
    near = {"distance": {"to": "ego", "below": 60.0}}
    late = {"time": {"after": 4.44}}
    assert started(story([rule({"all": [near, late]})], CAR, EGO)) == [pytest.approx(4.44)]
    assert started(story([rule({"any": [near, late]})], CAR, EGO)) == [pytest.approx(4.0)]
    both = {"all": [late, {"not": {"speed": {"above": 99.0}}}]}
    assert started(story([rule(both)], CAR, EGO)) == [pytest.approx(4.44)]


def test_a_delay_comes_on_top_of_the_instant() -> None:
    when = {"travelled": {"above": 12.3}, "delay": 2.5}
    assert started(story([rule(when)], CAR)) == [pytest.approx(3.73)]


def test_a_rising_edge_needs_a_change_that_was_seen() -> None:
    true_at_once = {"speed": {"above": 5.0}}
    assert started(story([rule(true_at_once)], CAR)) == [0.0]
    assert started(story([rule({**true_at_once, "edge": "rising"})], CAR)) == []
    rises = {"travelled": {"above": 12.3}, "edge": "rising"}
    assert started(story([rule(rises)], CAR)) == [pytest.approx(1.23)]


def test_a_rule_fires_as_often_as_it_may_and_anew_at_each_rise() -> None:
    blinks = {
        "signal": {"light": "7", "movement": "r1>r2", "shows": "green"},
        "edge": "rising",
    }
    letters = lambda time: "G" if time % 4.0 >= 2.0 else "r"  # noqa: E731
    events = story([rule(blinks, times=3)], CAR, letters=letters)
    assert started(events) == [pytest.approx(one) for one in (2.0, 6.0, 10.0)]


def test_a_condition_on_an_actor_that_is_not_there_does_not_hold() -> None:
    when = {"ttc": {"to": "ego", "below": 3.0}}
    events = story([rule(when)], CAR, EGO, appears={"ego": 9.0})
    assert started(events) == [pytest.approx(9.0)]
    assert started(story([rule(when)], CAR)) == []


def test_an_event_has_the_value_at_its_instant_and_not_at_the_step() -> None:
    [event] = [
        one
        for one in story([rule({"distance": {"to": "ego", "below": 20.0}})], CAR, EGO, step=0.5)
        if one.what == "started"
    ]
    assert event.values == {"distance": pytest.approx(20.0)}


def test_each_kind_of_the_document_is_in_the_registry() -> None:
    combined = {"all", "any", "not_", "delay", "edge"}
    assert set(CONDITIONS) == set(Condition.model_fields) - combined
