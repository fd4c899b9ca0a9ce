"""The verdict on a run, from outcomes and incidents that one can count by hand."""

from __future__ import annotations

from dataclasses import replace

import pytest

from odscen.figures.judging.expectations import evaluate, parse_expectation
from odscen.figures.measures.figure import RunData
from odscen.figures.measures.gridlock import Incident, find_incidents
from odscen.figures.measures.registry import figure_values
from odscen.figures.measures.summary import ActorOutcome, Trip, actor_outcomes
from odscen.figures.measures.usability import (
    UsabilityKind,
    UsabilityLevel,
    failed_run,
    run_usability,
)
from odscen.records.outcomes import IncidentKind, StopReason
from odscen.records.run_events import Event, EventKind
from odscen.records.run_plan import Plan, PlannedActor

END = 1000.0


def planned(name: str, *, depart: float = 0.0) -> PlannedActor:
    return PlannedActor(
        name, "car", "n1", "n2", depart, 4.5, 1.8, 5.0, 6.0, 0.0, 0.0,
        route_length=500.0, free_flow_time=50.0,
    )  # fmt: skip


def outcomes(
    arrived: int, *, waiting: int = 0, running: int = 0, wait: float = 0.0, teleported: int = 0
) -> tuple[Plan, tuple[ActorOutcome, ...]]:
    """Outcomes of vehicles that all are due at 0; those that are inserted are after ``wait`` s."""
    names = [f"a{k}" for k in range(arrived)] + [f"r{k}" for k in range(running)]
    actors = tuple(planned(name) for name in [*names, *(f"w{k}" for k in range(waiting))])
    plan = Plan("made", 1, END, 1.0, (0.0, 0.0), actors)
    events = [Event(wait, EventKind.DEPARTED, name) for name in names]
    events += [Event(50.0, EventKind.TELEPORT_START, name) for name in names[:teleported]]
    events += [
        Event(100.0 + wait, EventKind.ARRIVED, name, travel_time=100.0) for name in names[:arrived]
    ]
    trips = {name: Trip(40.0, 10.0, 1) for name in names}
    return plan, actor_outcomes(plan, events, trips)


def jam(reason: StopReason, *, since: float, until: float | None = None) -> Incident:
    return Incident(IncidentKind.JAM, since, until, "a", 7, 12.0, 34.0, "e_0", None, reason)


def test_a_run_whose_whole_demand_arrived_is_usable() -> None:
    verdict = run_usability(outcomes(100)[1], [], end=END)
    assert verdict.level is UsabilityLevel.USABLE
    assert verdict.headline == "usable"
    assert verdict.reasons == ()


def test_a_run_with_a_gridlock_is_not_usable_and_says_where() -> None:
    incidents = [jam(StopReason.CIRCLE, since=700.0)]
    verdict = run_usability(outcomes(100)[1], incidents, end=END)
    assert verdict.level is UsabilityLevel.NOT_USABLE
    (reason,) = verdict.reasons
    assert (reason.kind, reason.value, reason.count) == (UsabilityKind.GRIDLOCK, 300.0, 1)
    assert reason.places == ("e_0 (x 12 m, y 34 m)",)
    assert verdict.headline.startswith(
        "not usable: unresolved gridlock, first at e_0 (x 12 m, y 34 m) since 700 s"
    )


@pytest.mark.parametrize(
    ("since", "until", "reason", "level"),
    [
        (700.0, None, StopReason.RED, UsabilityLevel.RESERVATIONS),
        (300.0, None, StopReason.RED, UsabilityLevel.NOT_USABLE),
        (100.0, 900.0, StopReason.CIRCLE, UsabilityLevel.RESERVATIONS),
        (100.0, 900.0, StopReason.RED, UsabilityLevel.USABLE),
    ],
)
def test_a_jam_counts_by_how_long_it_lasted_and_whether_it_dissolved(
    since: float, until: float | None, reason: StopReason, level: UsabilityLevel
) -> None:
    incidents = [jam(reason, since=since, until=until)]
    assert run_usability(outcomes(100)[1], incidents, end=END).level is level


@pytest.mark.parametrize(
    ("waiting", "level"),
    [(1, UsabilityLevel.RESERVATIONS), (60, UsabilityLevel.NOT_USABLE)],
)
def test_those_not_inserted_are_counted_with_their_share_and_place(
    waiting: int, level: UsabilityLevel
) -> None:
    plan, found = outcomes(1000 - waiting, waiting=waiting)
    incidents = find_incidents(plan, found, (), end=END)
    reasons = {one.kind: one for one in run_usability(found, incidents, end=END).reasons}
    reason = reasons[UsabilityKind.NOT_INSERTED]
    assert (reason.level, reason.count) == (level, waiting)
    assert reason.value == pytest.approx(waiting / 1000.0)
    assert reason.places == (f"n1 (x 5 m, y 6 m): {waiting}",)
    assert f"{waiting} of 1,000 road users w" in reason.words


def test_who_is_due_in_the_last_seconds_is_not_missed() -> None:
    plan = Plan("made", 1, END, 1.0, (0.0, 0.0), (planned("late", depart=END - 5.0),))
    assert run_usability(actor_outcomes(plan, ()), [], end=END).level is UsabilityLevel.USABLE


@pytest.mark.parametrize(
    ("teleported", "level"),
    [
        (1, UsabilityLevel.USABLE),
        (3, UsabilityLevel.RESERVATIONS),
        (6, UsabilityLevel.NOT_USABLE),
    ],
)
def test_more_than_half_a_per_cent_of_teleports_are_too_many(
    teleported: int, level: UsabilityLevel
) -> None:
    found = outcomes(1000, teleported=teleported)[1]
    assert run_usability(found, [], end=END).level is level


def test_demand_that_did_not_get_through_is_not_served() -> None:
    verdict = run_usability(outcomes(80, running=20)[1], [], end=END)
    assert verdict.headline == (
        "not usable: 20 of 100 road users due had not arrived (demand not served) (20.0 %)"
    )


def test_a_run_that_was_stopped_by_hand_has_reservations() -> None:
    verdict = run_usability(outcomes(100)[1], [], end=END, until=3600.0)
    assert verdict.level is UsabilityLevel.RESERVATIONS
    assert "1000 s of 3600 s" in verdict.headline


def test_the_mean_delay_is_of_all_who_were_due_with_what_they_waited_for() -> None:
    """8 arrived and 1 under way lost 40 s after 30 s of waiting, 1 waits for 1000 s."""
    _, found = outcomes(8, running=1, waiting=1, wait=30.0)
    figures = figure_values(RunData(found, end=END))
    assert figures["mean_delay"] == pytest.approx((9 * 70.0 + 1000.0) / 10)
    assert figures["mean_latent_delay"] == pytest.approx((9 * 30.0 + 1000.0) / 10)
    reasons = {one.kind: one for one in run_usability(found, [], end=END).reasons}
    assert reasons[UsabilityKind.LATENT_DELAY].value == pytest.approx(127.0)
    assert reasons[UsabilityKind.LATENT_DELAY].level is UsabilityLevel.NOT_USABLE


def test_who_has_no_route_is_not_inserted_and_in_no_mean_delay() -> None:
    plan, found = outcomes(9, waiting=1)
    found = (*found[:9], replace(found[9], problem="no route"))
    figures = figure_values(RunData(found, end=END))
    assert (figures["mean_delay"], figures["mean_latent_delay"]) == (40.0, 0.0)
    incidents = find_incidents(plan, found, (), end=END)
    (reason, _) = run_usability(found, incidents, end=END).reasons
    assert (reason.kind, reason.value) == (UsabilityKind.NOT_INSERTED, 0.1)


def test_the_expectation_usable_is_met_with_reservations_but_not_otherwise() -> None:
    expected = parse_expectation(" usable ")
    levels = [
        run_usability(outcomes(arrived, waiting=waiting)[1], [], end=END).to_dict()
        for arrived, waiting in ((100, 0), (999, 1), (50, 50))
    ]
    passed = [evaluate([expected], {"usable": level})[0] for level in levels]
    assert [(one.value, one.passed) for one in passed] == [(2.0, True), (1.0, True), (0.0, False)]
    assert not evaluate([expected], {"usable": failed_run("no\nmore").to_dict()})[0].passed
    assert not evaluate([expected], {})[0].passed, "a run of an earlier version is not judged"
