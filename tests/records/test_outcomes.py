from __future__ import annotations

import json

import pytest

from odscen.figures.measures.gridlock import find_incidents, incident_summary
from odscen.figures.measures.summary import actor_outcomes
from odscen.records.outcomes import (
    ActorStatus,
    IncidentKind,
    RunStatus,
    StopReason,
    reason_label,
    stop_reason,
)
from odscen.records.run_events import Event, EventKind
from tests.figures.measures.test_summary import plan, planned


@pytest.mark.parametrize("enumeration", [ActorStatus, IncidentKind, StopReason])
def test_every_member_has_words_of_its_own(enumeration: type[ActorStatus]) -> None:
    labels = [member.label for member in enumeration]
    assert all(labels)
    assert len(set(labels)) == len(labels)


def test_files_keep_what_they_have_always_said() -> None:
    assert [*RunStatus, *ActorStatus, *IncidentKind] == [
        "completed", "failed", "arrived", "running", "waiting", "stranded", "jam",
        "moved_on", "kept_out",
    ]  # fmt: skip
    assert set(StopReason) == {
        "vehicles wait for each other in a circle",
        "its lane does not lead on along its way",
        "it did not get to the lane that its way needs",
        "a red light",
        "people on a crossing",
        "it has to give way to traffic that does not end",
        "no room on the road ahead",
        "no room where they start",
        "the reason does not show",
    }


@pytest.mark.parametrize(
    ("text", "reason", "label"),
    [
        ("a red light", StopReason.RED, "red light"),
        (None, StopReason.UNKNOWN, "unknown"),
        ("what an older version said", "what an older version said", "what an older version said"),
    ],
)
def test_a_reason_comes_back_from_its_file(text: str | None, reason: str, label: str) -> None:
    assert stop_reason(text) == reason
    assert reason_label(stop_reason(text)) == label


def test_incidents_are_in_order_with_their_kinds_and_reasons() -> None:
    whole = plan(planned("a"), planned("b"), planned("c", problem="no way to its goal"))
    events = (
        Event(0.0, EventKind.DEPARTED, "a"),
        Event(200.0, EventKind.JAM_BEGIN, "a", lane="e_0", detail="a red light", waited=180.0),
        Event(320.0, EventKind.TELEPORT_START, "a", lane="e_0", waited=300.0),
    )
    outcomes = actor_outcomes(whole, events)
    found = find_incidents(whole, outcomes, events, end=400.0)
    assert [(one.kind, one.reason, one.count) for one in found] == [
        (IncidentKind.JAM, StopReason.RED, 1),
        (IncidentKind.NOT_INSERTED, StopReason.NO_ROOM_TO_START, 1),
        (IncidentKind.NOT_INSERTED, "no way to its goal", 1),
        (IncidentKind.TELEPORTED, StopReason.UNKNOWN, 1),
    ]
    written = json.loads(json.dumps(incident_summary(found)))
    assert (written["jams"], written["jams_at_the_end"]) == (1, 1)
    assert (written["moved_on"], written["kept_out"]) == (1, 2)
    assert [place["reason"] for place in written["places"]] == [
        "a red light", "no room where they start", "no way to its goal", "the reason does not show",
    ]  # fmt: skip
