from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from odscen.base.errors import InputError
from odscen.figures.measures.summary import (
    Outcomes,
    Trip,
    actor_outcomes,
    actors_from_json,
    actors_to_json,
    outcome_row,
)
from odscen.records.run_events import Event, EventKind, events_from_json, events_to_json
from odscen.records.run_plan import Plan, PlannedActor


def planned(name: str, **changes: object) -> PlannedActor:
    values: dict[str, object] = {
        "id": name, "category": "car", "spawn": "1.0.-1.0", "goal": "1.0.-1.9", "depart": 0.0,
        "length": 4.5, "width": 1.8, "x": 1.0, "y": 2.0, "z": 0.0, "hdg": 0.0,
        "route_length": 100.0, "free_flow_time": 10.0,
    }  # fmt: skip
    return PlannedActor(**{**values, **changes})  # type: ignore[arg-type]


def plan(*actors: PlannedActor) -> Plan:
    return Plan("test", 1, 100.0, 0.5, (10.0, -5.0), actors)


EVENTS = (
    Event(0.0, EventKind.DEPARTED, "a", x=1.0, y=2.0, error=0.03),
    Event(1.5, EventKind.DEPARTED, "b", x=1.0, y=2.0, error=0.01),
    Event(3.0, EventKind.COLLISION, "a", partner="b", lane="e_0", detail="collision"),
    Event(4.0, EventKind.TELEPORT_START, "b"),
    Event(4.0, EventKind.EMERGENCY_STOP, "b"),
    Event(5.0, EventKind.TELEPORT_END, "b"),
    Event(6.0, EventKind.TELEPORT_START, "b"),
    Event(16.0, EventKind.ARRIVED, "a", travel_time=16.0),
)
TRIPS = {"a": Trip(4.5, 1.5, 2), "b": Trip(3.0, 2.0, 1)}


def test_each_actor_gets_its_own_outcome() -> None:
    actors = plan(planned("a"), planned("b", depart=1.0), planned("c"))
    a, b, c = actor_outcomes(actors, EVENTS, TRIPS)
    assert (a.status, a.travel_time, a.delay, a.mean_speed) == ("arrived", 16.0, 4.5, 6.25)
    assert (a.time_loss, a.waiting_time, a.stops) == (4.5, 1.5, 2)
    assert (b.delay, b.time_loss, b.waiting_time, b.stops) == (None, 3.0, 2.0, 1)
    assert (a.insertion_error, a.collisions, a.teleports) == (0.03, 1, 0)
    assert (b.status, b.depart_delay, b.arrived, b.travel_time) == ("running", 0.5, None, None)
    assert (b.teleports, b.collisions, b.emergency_stops) == (2, 1, 1)
    assert (c.status, c.inserted, c.insertion_error) == ("waiting", None, None)


def test_plan_events_and_actors_come_back_from_their_files() -> None:
    whole = plan(planned("a", ego=True, model="vehicle.x", speed=8.0), planned("b", flow="f"))
    assert Plan.from_json(whole.to_json()) == whole
    assert events_from_json(events_to_json(EVENTS)) == EVENTS
    outcomes = actor_outcomes(whole, EVENTS, TRIPS)
    assert actors_from_json(actors_to_json(outcomes)) == outcomes


def test_rows_written_down_early_are_those_of_the_outcomes() -> None:
    whole = plan(planned("a"), planned("b"), planned("never"))
    found = Outcomes(whole)
    for event in EVENTS:
        found.hear([event], TRIPS)
        found.settle()
    rows = [outcome_row(outcome) for outcome in actor_outcomes(whole, EVENTS, TRIPS)]
    assert list(found.rows()) == rows


@pytest.mark.slow
@given(
    st.lists(
        st.builds(
            Event,
            time=st.integers(0, 10**6).map(lambda n: n / 2),
            kind=st.sampled_from(EventKind),
            actor=st.text(min_size=1),
            x=st.none() | st.integers(-(10**6), 10**6).map(lambda n: n / 1000),
            error=st.none() | st.floats(0, 1).map(lambda e: round(e, 6)),
            partner=st.none() | st.text(),
            rule=st.none() | st.text(),
            values=st.none()
            | st.dictionaries(st.text(), st.integers(-(10**9), 10**9).map(lambda n: n / 10**6)),
            **dict.fromkeys(("y", "lane", "travel_time", "detail", "waited", "queue"), st.none()),
        )
    ).map(tuple)
)
def test_any_events_survive_their_file(events: tuple[Event, ...]) -> None:
    assert events_from_json(events_to_json(events)) == events


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"format": "x", "version": 1}', '{"events": 3}'])
def test_foreign_files_are_refused(text: str) -> None:
    for reader in (Plan.from_json, events_from_json, actors_from_json):
        with pytest.raises(InputError):
            reader(text)


def test_a_trip_that_is_told_after_the_arrival_counts() -> None:
    """SUMO tells the trip of a car that ends in a parking place when that leaves it."""
    actors = plan(planned("a"))
    outcomes = Outcomes(actors)
    outcomes.hear([event for event in EVENTS if event.actor == "a"])
    outcomes.settle()
    outcomes.hear((), {"a": TRIPS["a"]})
    outcomes.settle()
    (row,) = outcomes.rows()
    assert row == outcome_row(actor_outcomes(actors, EVENTS, TRIPS)[0])
    assert '"delay": 4.5' in row
