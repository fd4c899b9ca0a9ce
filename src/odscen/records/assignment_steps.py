"""How routes by travel time were found: one step for each run that was made for it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from odscen.base.stored_files import stored_document, typed_rows
from odscen.records.row_text import json_with_rows

ASSIGNMENT_FORMAT = "odscen-assignment"
VERSION = 1


class AssignmentStep(NamedTuple):
    """One iteration of the assignment.

    Attributes
    ----------
    iteration
        From 1 on.
    gap
        ``sum(own - quickest) / sum(quickest)``: what trips would have saved on the routes that were
        quickest, with the travel times of this iteration.
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

    @property
    def words(self) -> str:
        """One line for people."""
        mean = "" if self.travel_time is None else f", mean travel time {self.travel_time:.1f} s"
        return f"routes, iteration {self.iteration}: gap {100 * self.gap:.2f} %{mean}"


@dataclass(frozen=True, slots=True)
class Assignment:
    """All iterations; ``wanted`` is the gap aimed at, ``used`` the iteration that is driven."""

    wanted: float
    used: int
    steps: tuple[AssignmentStep, ...]

    @property
    def gap(self) -> float:
        """Gap of the routes that are driven."""
        return self.steps[self.used - 1].gap

    def to_json(self) -> str:
        """``assignment.json``: one iteration per line."""
        head = {
            "format": ASSIGNMENT_FORMAT,
            "version": VERSION,
            "wanted": self.wanted,
            "used": self.used,
        }
        return json_with_rows(head, "steps", [step._asdict() for step in self.steps])

    @classmethod
    def from_json(cls, text: str) -> Assignment:
        """Inverse of :meth:`to_json`.

        Raises
        ------
        InputError
            If it is not an assignment of this version.
        """
        with stored_document(
            text, form=ASSIGNMENT_FORMAT, version=VERSION, what="an assignment of routes"
        ) as data:
            steps = tuple(map(_STEP, data["steps"]))
            return cls(float(data["wanted"]), int(data["used"]), steps)


_STEP = typed_rows(AssignmentStep)
