from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl
import pytest

from odscen.base.errors import InputError
from odscen.figures.judging.actor_measures import ACTOR_NAMES, RunRecords
from odscen.figures.judging.criteria import criteria_rows, missed_rows, missed_words
from odscen.figures.judging.expectations import (
    evaluate,
    needs_criticality,
    parse_expectation,
)
from odscen.figures.judging.lane_departure import DrivenLanes
from odscen.figures.measures.conflicts import conflict_table
from odscen.figures.measures.summary import Trip, actor_outcomes
from odscen.records.run_events import Event, EventKind
from odscen.records.run_plan import Plan, PlannedActor

if TYPE_CHECKING:
    from collections.abc import Sequence


def planned(name: str, *, ego: bool = False) -> PlannedActor:
    return PlannedActor(
        id=name, category="car", spawn="a", goal="b", depart=0.0, length=4.5, width=1.8,
        x=0.0, y=0.0, z=0.0, hdg=0.0, route_length=200.0, ego=ego,
    )  # fmt: skip


PLAN = Plan("s", 1, 60.0, 0.5, (0.0, 0.0), (planned("hero", ego=True), planned("van")))
EVENTS = (
    Event(1.0, EventKind.DEPARTED, "hero"),
    Event(2.0, EventKind.DEPARTED, "van"),
    Event(3.0, EventKind.RULE_STARTED, "van", rule="cut-in"),
    Event(
        12.5,
        EventKind.COLLISION,
        "van",
        partner="hero",
        values={"impact_speed": 10.0, "overlap": 0.25},
    ),
    Event(14.0, EventKind.COLLISION, "van", partner="hero"),
    Event(21.0, EventKind.ARRIVED, "hero", travel_time=20.0),
)
CONFLICTS = conflict_table(
    [
        {"begin": 8.0, "end": 9.0, "one": "hero", "other": "van", "kind": "following", "ttc": 1.2},
        {"begin": 3.0, "end": 4.0, "one": "van", "other": "bus", "kind": "crossing", "ttc": 0.6},
    ]
)
SPEEDS = pl.DataFrame({"time": [1.0, 2.0, 3.0], "speed": [8.0, 15.0, 15.0]})
BODIES = {
    name: pl.DataFrame(
        {"time": [1.0, 2.0], "x": x, "y": [0.0, 3.0], "hdg": [0.0, 0.0],
         "length": [4.0, 4.0], "width": [2.0, 2.0]}
    )
    for name, x in (("hero", [0.0, 4.0]), ("van", [14.0, 10.0]))
}  # fmt: skip
LANES = DrivenLanes({"lane": np.array([[-50.0, 0.0], [50.0, 0.0]])}, {"lane": 3.5}, {})
RECORDS = RunRecords(
    actor_outcomes(PLAN, EVENTS, {"hero": Trip(4.0, 1.5, 1)}),
    EVENTS,
    CONFLICTS,
    lambda actor: SPEEDS if actor == "hero" else None,
    BODIES.get,
    lambda: LANES,
)
SUMMARY = {
    "actors": {"planned": 2, "arrived": 1, "collided": 2},
    "figures": {"min_ttc": 0.6, "mean_delay": 4.0},
}


def rows(*criteria: str, records: RunRecords = RECORDS) -> Sequence[dict[str, object]]:
    return criteria_rows(criteria, SUMMARY, records)


@pytest.mark.parametrize(
    ("text", "value", "passed", "time"),
    [
        ("arrived(hero) == 1", 1.0, True, 21.0),
        ("arrived(van) == 1", 0.0, False, None),
        ("collided(hero) == 0", 2.0, False, 12.5),
        ("min_ttc(hero) >= 1.5 s", 1.2, False, 8.0),
        ("min_ttc(van) >= 0.5", 0.6, True, 3.0),
        ("min_pet(hero) >= 1", 3.0, True, None),
        ("max_speed(hero) <= 50 km/h", 54.0, False, 2.0),
        ("mean_speed(hero) >= 10", 10.0, True, 21.0),
        ("delay(hero) <= 5 s", 4.0, True, 21.0),
        ("delay(van) <= 5 s", None, False, None),
        ("max_speed(van) <= 50 km/h", None, False, None),
        ("impact_speed(hero) <= 20 km/h", 36.0, False, 12.5),
        ("impact_overlap(hero) >= 0.2", 0.25, True, 12.5),
        ("stopped(hero) == 1", 0.0, False, None),
        ("max_deceleration(hero) <= 3", 0.0, True, 3.0),
        ("max_jerk(hero) <= 5", 7.0, False, 2.0),
        ("lane_departure(hero) <= 0.5 m", 2.25, False, 2.0),
        ("lane_departure(van) <= 0", 2.25, False, 2.0),
        ("min_distance(hero,van) >= 3 m", 2.0, False, 2.0),
        ("min_distance(ego,bus) >= 3 m", None, False, None),
        ("stopped_before(hero,van) >= 3 m", None, False, None),
        ("fired(cut-in) == 1", 1.0, True, 3.0),
        ("fired_at(cut-in) <= 2.5 s", 3.0, False, 3.0),
        ("fired(other) == 0", 0.0, True, None),
        ("fired_at(other) <= 2.5 s", None, False, None),
        ("collided == 0", 2.0, False, 12.5),
        ("min_ttc >= 1 s", 0.6, False, 3.0),
        ("arrived >= 95 %", 50.0, False, None),
        ("mean_delay <= 40 s", 4.0, True, None),
    ],
)
def test_a_criterion_has_a_verdict_a_value_in_its_unit_and_an_instant(
    text: str, value: float | None, passed: bool, time: float | None
) -> None:
    (row,) = rows(text)
    assert row["value"] == (None if value is None else pytest.approx(value))
    assert (row["passed"], row["time"]) == (passed, time)


def test_ego_stands_for_every_ego_and_the_one_furthest_from_it_counts() -> None:
    plan = Plan("s", 1, 60.0, 0.5, (0.0, 0.0), (planned("a", ego=True), planned("b", ego=True)))
    events = (
        Event(1.0, EventKind.DEPARTED, "a"),
        Event(1.0, EventKind.DEPARTED, "b"),
        Event(9.0, EventKind.ARRIVED, "b", travel_time=8.0),
    )
    records = RunRecords(actor_outcomes(plan, events), events)
    assert [row["passed"] for row in rows("arrived(ego) == 1", records=records)] == [False]
    assert [row["passed"] for row in rows("arrived(b) == 1", records=records)] == [True]


def test_an_actor_called_ego_is_meant_itself() -> None:
    plan = Plan("s", 1, 60.0, 0.5, (0.0, 0.0), (planned("ego"), planned("b", ego=True)))
    events = (
        Event(1.0, EventKind.DEPARTED, "b"),
        Event(9.0, EventKind.ARRIVED, "b", travel_time=8.0),
    )
    records = RunRecords(actor_outcomes(plan, events), events)
    assert [row["passed"] for row in rows("arrived(ego) == 1", records=records)] == [False]


def test_criticality_that_was_not_measured_is_not_met() -> None:
    (row,) = rows("min_ttc(hero) >= 0.1", records=RunRecords(RECORDS.outcomes, EVENTS))
    assert (row["value"], row["passed"]) == (None, False)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("arrived(hero) == 1", "hero reaches its goal"),
        ("collided(hero) == 0", "hero does not collide"),
        ("min_ttc(hero)>=1.5", "Shortest time to collision (TTC) of hero: at least 1.5 s"),
        ("max_speed(hero) <= 50 km/h", "Highest speed of hero: at most 50 km/h"),
        ("mean_delay <= 40 s", "Mean delay: at most 40 s"),
        ("min_distance(hero,van) >= 3 m", "Shortest distance of hero to van: at least 3 m"),
        ("fired(cut-in) == 1", "cut-in fires"),
        ("stopped(hero) == 1", "hero comes to a standstill"),
    ],
)
def test_criteria_are_sentences(text: str, words: str) -> None:
    assert parse_expectation(text).words == words


def test_what_was_missed_is_said_with_its_value_and_instant() -> None:
    summary = {"criteria": rows("max_speed(hero) <= 50 km/h", "arrived(hero) == 1")}
    assert [missed_words(row) for row in missed_rows(summary)] == [
        "Highest speed of hero: at most 50 km/h, but it is 54 km/h at 2 s"
    ]


def test_expecting_the_criteria_counts_those_not_met() -> None:
    wanted = [parse_expectation("criteria")]
    summary = {**SUMMARY, "criteria": rows("collided == 0", "arrived(hero) == 1")}
    (verdict,) = evaluate(wanted, summary)
    assert (verdict.value, verdict.passed) == (1.0, False)
    (verdict,) = evaluate(wanted, SUMMARY)
    assert (verdict.value, verdict.passed) == (0.0, True)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("min_tct(hero) >= 1", "did you mean min_ttc"),
        ("planned(hero) >= 1", "no measure of an actor is named 'planned'"),
        ("arrived(hero) >= 95 %", "has no percentage"),
        ("max_speed(hero) <= 3 s", "is written in m/s, km/h"),
        ("arrived() == 1", "not of the form"),
    ],
)
def test_what_cannot_be_asked_of_an_actor_is_refused(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        parse_expectation(text)


def test_only_conflicts_of_actors_need_criticality() -> None:
    needing = [
        name for name in ACTOR_NAMES if needs_criticality([parse_expectation(f"{name}(a) >= 0")])
    ]
    assert needing == ["min_ttc", "min_pet", "max_drac"]


@pytest.mark.parametrize(
    ("x", "speeds", "value", "time"),
    [
        # Fronts at 2 m and at 4 m; the other's near side is at x = 9 m.
        ([0.0, 0.0, 2.0, 2.0], [0.0, 8.0, 0.05, 0.0], 5.0, 3.0),
        ([0.0, 0.0, 2.0, 2.0], [8.0, 0.05, 8.0, 0.0], 5.0, 4.0),  # the nearer one of two stops
        ([0.0, 4.0, 14.0, 20.0], [8.0, 8.0, 8.0, 0.0], None, None),  # when it is past the other
        ([0.0, 4.0, 4.0, 4.0], [8.0, 8.0, 8.0, 8.0], None, None),
        ([4.0, 4.0, 4.0, 4.0], [0.0, 0.0, 0.0, 0.0], None, None),  # never under way
    ],
)
def test_the_gap_when_stopped_is_that_before_the_other_one(
    x: list[float], speeds: list[float], value: float | None, time: float | None
) -> None:
    times = [1.0, 2.0, 3.0, 4.0]
    shared = {"time": times, "y": [0.0] * 4, "hdg": [0.0] * 4, "width": [2.0] * 4}
    bodies = {
        "hero": pl.DataFrame(shared | {"x": x, "length": [4.0] * 4}),
        "van": pl.DataFrame(shared | {"x": [11.0] * 4, "length": [4.0] * 4}),
    }
    records = RunRecords(
        RECORDS.outcomes, EVENTS, None,
        lambda _: pl.DataFrame({"time": times, "speed": speeds}), bodies.get,
    )  # fmt: skip
    (row,) = rows("stopped_before(ego,van) >= 4 m", records=records)
    assert row["value"] == (None if value is None else pytest.approx(value))
    assert (row["passed"], row["time"]) == (value is not None, time)
