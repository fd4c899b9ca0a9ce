"""Rules that cannot fire yet are left alone, and fire as if they had been looked at all along."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from odscen.scenario.story.road_view import LastPose, leapt
from odscen.scenario.story.story_engine import StoryEngine, StoryEvent
from tests.scenario.story.straight_road import CAR, Road, rule, started

bounds = st.floats(0.5, 60.0)
CONDITIONS: tuple[Any, ...] = (
    bounds.map(lambda b: {"distance": {"to": "other", "below": b}}),
    bounds.map(lambda b: {"distance": {"to": "other", "below": b, "free": False}}),
    bounds.map(lambda b: {"distance": {"place": [150.0, 3.0], "below": b}}),
    bounds.map(lambda b: {"reaches": {"place": [120.0, -4.0], "within": b}}),
    bounds.map(lambda b: {"travelled": {"above": 4.0 * b}}),
    bounds.map(lambda b: {"speed": {"above": b}}),
    bounds.map(lambda b: {"speed": {"of": "other", "below": b / 4.0}}),
    bounds.map(lambda b: {"time": {"after": b / 3.0}}),
    bounds.map(lambda b: {"ttc": {"to": "other", "below": b / 10.0}}),
)
one = st.one_of(CONDITIONS)
conditions = st.one_of(
    one,
    st.lists(one, min_size=2, max_size=3).map(lambda parts: {"all": parts}),
    st.lists(one, min_size=2, max_size=3).map(lambda parts: {"any": parts}),
    one.map(lambda part: {"not": part}),
    st.tuples(one, st.floats(0.0, 1.0)).map(lambda both: {**both[0], "delay": both[1]}),
    one.map(lambda part: {**part, "edge": "rising"}),
)
# No accelerations below a micrometre per second squared: rounding then decides in which of two
# steps a bound is met, and with it how the value at that instant is written.
actors = st.builds(
    lambda x, y, hdg, speed, gain: replace(
        CAR, x=x, y=y, hdg=hdg, speed=speed, acceleration=gain, gain=max(gain, 0.0)
    ),
    st.floats(-200.0, 200.0), st.floats(-30.0, 30.0), st.floats(-3.1, 3.1),
    st.floats(0.0, 40.0), st.floats(-4.0, 9.0).map(lambda gain: round(gain, 6)),
)  # fmt: skip


lane_changes = st.lists(
    st.tuples(st.sampled_from(("car", "other")), st.floats(0.0, 15.0), st.sampled_from((-7, 3.5))),
    max_size=2,
    unique_by=lambda change: change[0],
)


class _CountedRoad(Road):
    looks = 0
    changes_of_lanes: Any = ()

    def actor(self, name: str) -> Any:
        self.looks += 1
        one = super().actor(name)
        for _, _, left in (
            change
            for change in self.changes_of_lanes
            if change[0] == name and change[1] < self.time
        ):
            x, y = one.x - left * math.sin(one.hdg), one.y + left * math.cos(one.hdg)
            one = replace(one, x=x, y=y)
        return one


def _story(
    when: list[dict[str, Any]],
    *,
    patient: bool,
    step: float,
    bodies: Any,
    until: float = 15.0,
    changes: Any = (),
) -> tuple[list[StoryEvent], int]:
    rules = [rule(one, name=f"r{n}", times=2) for n, one in enumerate(when)]
    engine = StoryEngine(rules, step=step)
    engine.patient = patient
    road = _CountedRoad(bodies, engine.rule_changes)
    road.changes_of_lanes, road.step = changes, step
    events: list[StoryEvent] = []
    for number in range(round(until / step)):
        road.time = number * step
        events += engine.step(road)[1]
    return events, road.looks


stories = given(
    when=st.lists(conditions, min_size=1, max_size=3),
    car=actors,
    other=actors,
    step=st.sampled_from((0.05, 0.1, 0.2, 0.5)),
    changes=lane_changes,
)


def _same(when: list[dict[str, Any]], car: Any, other: Any, step: float, changes: Any) -> None:
    bodies = (car, replace(other, id="other"))
    patient, _ = _story(when, patient=True, step=step, bodies=bodies, changes=changes)
    always, _ = _story(when, patient=False, step=step, bodies=bodies, changes=changes)
    assert patient == always


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@stories
def test_the_same_happens_at_the_same_instants(**story: Any) -> None:
    _same(**story)


@pytest.mark.slow
@settings(max_examples=1500, deadline=None)
@stories
def test_the_same_happens_in_many_stories(**story: Any) -> None:
    _same(**story)


@pytest.mark.parametrize("step", [0.05, 0.1, 0.5])
def test_who_changes_two_lanes_while_no_one_looks_is_met_there(step: float) -> None:
    when = [{"distance": {"to": "other", "below": 3.0}}]
    car = replace(CAR, speed=2.0, gain=2.5)
    bodies, left = (car, replace(car, id="other", y=11.0)), (("car", 1.03, 7.0),)
    found, _ = _story(when, patient=True, step=step, bodies=bodies, changes=left, until=3.0)
    assert started(found, "r0") == [pytest.approx(1.03, abs=step)]


@pytest.mark.parametrize("patient", [True, False])
def test_the_leap_of_a_lane_change_is_not_drawn_out_to_the_next_step(*, patient: bool) -> None:
    when = [
        {"distance": {"place": [150.0, 3.0], "below": 1.0}},
        {"reaches": {"place": [150.0, 3.0], "within": 2.0}},
        {"distance": {"to": "other", "below": 1.0}},
    ]
    car = replace(CAR, x=135.0, hdg=2.0, speed=0.0)
    bodies = (car, replace(CAR, id="other", x=150.0, y=3.0, speed=0.0))
    changes = [("car", 0.0, -7)]
    found, _ = _story(when, patient=patient, step=0.05, bodies=bodies, changes=changes)
    assert found == []


def test_who_follows_a_bend_does_not_leap_and_who_changes_lanes_does() -> None:
    turn, radius = 0.6, 12.0  # 7 m of a bend in one step
    bend = replace(
        CAR, x=radius * math.sin(turn), y=radius * (1.0 - math.cos(turn)), hdg=turn, speed=7.0
    )
    assert not leapt(CAR, bend, 0.1)
    aside = replace(bend, x=bend.x - 3.2 * math.sin(turn), y=bend.y + 3.2 * math.cos(turn))
    assert leapt(CAR, aside, 0.1)
    assert leapt(CAR, replace(CAR, speed=CAR.speed + 4.0), 0.1)
    assert not leapt(CAR, replace(CAR, speed=CAR.speed + 4.0), 1.0)
    assert leapt(LastPose(0.0, 0.0, math.pi), replace(CAR, x=-7.0, y=3.2, hdg=-math.pi), 0.1)


def test_who_stays_on_a_bound_is_met_there_whatever_was_before() -> None:
    when = [{"all": [{"distance": {"to": "other", "below": 1.0}}, {"speed": {"above": 2.0}}]}]
    car = replace(CAR, speed=0.0, acceleration=0.5, gain=0.5)
    bodies = (car, replace(car, id="other", y=10.0))
    touches_then_a_metre_away = (("other", 1.03, -9.0), ("other", 2.0, 2.0))
    for patient in (True, False):
        found, _ = _story(
            when, patient=patient, step=0.05, bodies=bodies, changes=touches_then_a_metre_away
        )
        assert started(found, "r0") == [pytest.approx(4.0)]


def test_a_person_who_runs_at_once_is_met_in_time() -> None:
    walker = replace(CAR, id="car", speed=0.0, acceleration=60.0, person=True, length=0.4)
    when = [{"speed": {"above": 2.9}}]
    patient, _ = _story(when, patient=True, step=0.05, bodies=(walker,), until=0.2)
    always, _ = _story(when, patient=False, step=0.05, bodies=(walker,), until=0.2)
    assert started(patient, "r0") == started(always, "r0") == [pytest.approx(0.05)]


@pytest.mark.parametrize(
    "when",
    [
        {"distance": {"to": "other", "below": 3.0}},
        {"reaches": {"place": [3000.0, 0.0], "within": 2.0}},
        {"travelled": {"above": 3000.0}},
        {"time": {"after": 300.0}},
        {"all": [{"ttc": {"to": "other", "below": 60.0}}, {"time": {"after": 300.0}}]},
    ],
)
def test_what_is_far_off_is_read_in_few_steps(when: dict[str, Any]) -> None:
    bodies = (CAR, replace(CAR, id="other", x=2000.0))
    _, patient = _story([when], patient=True, step=0.1, bodies=bodies)
    _, always = _story([when], patient=False, step=0.1, bodies=bodies)
    assert patient < 0.25 * max(always, 150)


@pytest.mark.parametrize(
    "when",
    [
        {"ttc": {"to": "other", "below": 0.1}},
        {"distance": {"to": "other", "below": 3.0, "along": "lateral"}},
        {"speed": {"below": 1.0}},
        {"not": {"time": {"after": 0.0}}},
        {"any": [{"time": {"after": 300.0}}, {"ttc": {"to": "other", "below": 0.1}}]},
        {"time": {"after": 300.0}, "delay": 1.0},
    ],
)
def test_what_may_be_met_at_once_is_read_in_each(when: dict[str, Any]) -> None:
    bodies = (CAR, replace(CAR, id="other", x=2000.0))
    _, patient = _story([when], patient=True, step=0.1, bodies=bodies)
    _, always = _story([when], patient=False, step=0.1, bodies=bodies)
    assert patient == always


def test_whoever_is_put_elsewhere_is_seen_there_in_the_next_step() -> None:
    engine = StoryEngine([rule({"distance": {"to": "other", "below": 3.0}})], step=0.1)
    road = Road((CAR, replace(CAR, id="other", x=2000.0, speed=0.0)), engine.rule_changes)
    engine.step(road)
    road.actors = (CAR, replace(CAR, id="other", x=6.0, speed=0.0))
    engine.look_at_all()
    road.time = 0.1
    assert started(engine.step(road)[1]) == pytest.approx([0.1], abs=0.1)


def test_spells_go_on_after_a_saved_state() -> None:
    rules = [rule({"travelled": {"above": 100.0}})]
    whole, _ = _story([{"travelled": {"above": 100.0}}], patient=True, step=0.1, bodies=(CAR,))
    engine = StoryEngine(rules, step=0.1)
    road = _CountedRoad((CAR,), engine.rule_changes)
    events: list[StoryEvent] = []
    for number in range(150):
        if number == 7:
            saved, engine = engine.state(), StoryEngine(rules, step=0.1)
            engine.restore(saved)
            road.looks = 0
        road.time = number * 0.1
        events += engine.step(road)[1]
        assert number != 8 or road.looks == 0
    assert [one.time for one in events] == [one.time for one in whole]
