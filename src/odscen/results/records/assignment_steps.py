"""How routes by travel time were found: one step for each run that was made for it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from odscen.base.stored_files import typed_rows
from odscen.results.records.run_records import json_with_rows, rows_from_json

if TYPE_CHECKING:
    from collections.abc import Iterable

ASSIGNMENT_FORMAT = "odscen-assignment"


class AssignmentStep(NamedTuple):
    """One iteration of the assignment.

    Attributes
    ----------
    iteration
        From 1 on.
    gap
        Share of the travel time of all trips that they would have saved on the routes that were
        quickest: ``sum(own - quickest) / sum(quickest)``, with the travel times of this iteration.
    travel_time
        Mean time from departure to arrival of the vehicles that arrived, seconds.
    changed
        Trips that had another route than in the iteration before.
    arrived, teleported, waiting
        Vehicles that arrived, were teleported, and were not inserted by the end.
    """

    iteration: int
    gap: float
    travel_time: float | None
    changed: int
    arrived: int
    teleported: int
    waiting: int


def steps_to_json(steps: Iterable[AssignmentStep], *, wanted: float, used: int) -> str:
    """``assignment.json``: one iteration per line; ``used`` is the one whose routes are driven."""
    head = {"format": ASSIGNMENT_FORMAT, "version": 1, "wanted": wanted, "used": used}
    return json_with_rows(head, "steps", (step._asdict() for step in steps))


def steps_from_json(text: str) -> tuple[AssignmentStep, ...]:
    """Inverse of :func:`steps_to_json`, without its head.

    Raises
    ------
    InputError
        If it is not an assignment of this version.
    """
    return rows_from_json(text, "steps", ASSIGNMENT_FORMAT, typed_rows(AssignmentStep))
