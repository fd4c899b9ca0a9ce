"""What can become of a run, an actor and a place on the road, and why: with words for each.

A member's value is written into the files of a run; its ``label`` is what people read.
"""

from __future__ import annotations

from enum import StrEnum


class RunStatus(StrEnum):
    """How a run ended; one that a user has stopped early is ``completed``, too."""

    COMPLETED = "completed"
    FAILED = "failed"


class ActorStatus(StrEnum):
    """What has become of an actor when the run ended.

    ``waiting`` is planned, but not inserted; ``running`` is inserted and has not arrived;
    ``stranded`` was taken out because a measure had closed every route to its goal.
    """

    ARRIVED = "arrived"
    RUNNING = "running"
    WAITING = "waiting"
    STRANDED = "stranded"

    @property
    def label(self) -> str:
        """In words."""
        return _STATUS_LABELS[self]


_STATUS_LABELS = {
    ActorStatus.ARRIVED: "arrived",
    ActorStatus.RUNNING: "still under way",
    ActorStatus.WAITING: "not inserted",
    ActorStatus.STRANDED: "blocked by closure",
}


class IncidentKind(StrEnum):
    """What can go wrong with traffic at a place.

    ``jam``: vehicles are stopped there for minutes; ``moved_on``: SUMO has teleported a vehicle,
    that is removed it and put it back further on; ``kept_out``: planned, but not inserted.
    """

    JAM = "jam"
    TELEPORTED = "moved_on"
    NOT_INSERTED = "kept_out"

    @property
    def label(self) -> str:
        """In words."""
        return _INCIDENT_LABELS[self]


_INCIDENT_LABELS = {
    IncidentKind.JAM: "Jam",
    IncidentKind.TELEPORTED: "Teleported",
    IncidentKind.NOT_INSERTED: "Not inserted",
}


class StopReason(StrEnum):
    """Why vehicles are stopped for minutes, or are not inserted, as far as it shows."""

    CIRCLE = "vehicles wait for each other in a circle"
    NO_CONNECTION = "its lane does not lead on along its way"
    WRONG_LANE = "it did not get to the lane that its way needs"
    RED = "a red light"
    PEOPLE = "people on a crossing"
    GIVES_WAY = "it has to give way to traffic that does not end"
    NO_ROOM = "no room on the road ahead"
    NO_ROOM_TO_START = "no room where they start"
    UNKNOWN = "the reason does not show"

    @property
    def label(self) -> str:
        """In words."""
        return _REASON_LABELS[self]


_REASON_LABELS = {
    StopReason.CIRCLE: "gridlock: vehicles wait for each other in a circle",
    StopReason.NO_CONNECTION: "its lane does not continue along its route",
    StopReason.WRONG_LANE: "it did not reach the lane that its route needs",
    StopReason.RED: "red light",
    StopReason.PEOPLE: "pedestrians on a crossing",
    StopReason.GIVES_WAY: "it has to yield to traffic that does not end",
    StopReason.NO_ROOM: "no room on the road ahead",
    StopReason.NO_ROOM_TO_START: "no room where they depart",
    StopReason.UNKNOWN: "unknown",
}


def stop_reason(text: str | None) -> StopReason | str:
    """Read a reason from a file; why an actor has no route is in words of its own and stays so."""
    if text is None:
        return StopReason.UNKNOWN
    try:
        return StopReason(text)
    except ValueError:
        return text


def reason_label(reason: StopReason | str) -> str:
    """Words for a reason that :func:`stop_reason` has read."""
    return reason.label if isinstance(reason, StopReason) else reason
